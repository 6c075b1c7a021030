"""The benchmark: which problems there are, and which of them may be tuned on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems import get_problem
from scipy.stats import ortho_group

from pymoo_hdte.problems import RobustToy, robust_dte_family

INTERIOR = (0.25, 0.75)
"""Part of the range of a variable in which its optimum lies."""


class MovedZDT(Problem):
    """One of ZDT1, 2, 3, 4, 6 (Zitzler, Deb, Thiele 2000) with its distance variables moved.

    Parameters
    ----------
    name : str
        Of the problem as pymoo knows it, such as ``"zdt1"``.
    rotated : bool
        Whether the distance variables are also turned by a random rotation.
    seed : int
        Of optimum and rotation.

    Attributes
    ----------
    optimum : ndarray, shape (n_var - 1,)
        Best values of the distance variables x_2 .. x_n.
    rotation : ndarray, shape (n_var - 1, n_var - 1)
    """

    def __init__(self, name: str, rotated: bool, seed: int) -> None:
        self.original = get_problem(name)
        n_var = self.original.n_var
        lower, upper = self.original.bounds()
        super().__init__(n_var=n_var, n_obj=2, xl=lower, xu=upper, vtype=float)
        rng = np.random.default_rng(seed)
        share = rng.uniform(*INTERIOR, n_var - 1)
        self.optimum = lower[1:] + share * (upper - lower)[1:]
        distances = n_var - 1
        self.rotation = (
            ortho_group.rvs(distances, random_state=rng) if rotated else np.eye(distances)
        )

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        distance = np.abs((x[:, 1:] - self.optimum) @ self.rotation.T)
        self.original._evaluate(np.column_stack([x[:, 0], distance]), out)

    def _calc_pareto_front(self, n_pareto_points: int = 100) -> NDArray[np.float64]:
        return self.original.pareto_front(n_pareto_points)


_ZDT = ("1", "2", "3", "4", "6")
_DTLZ_VARIABLES = {1: 7, 2: 12, 7: 22}
ROBUST_MEMBERS = ("calibrated", "resonant", "calibrated_duty_cycle", "calibrated_tolerance")
"""Of `robust_dte_family`; its finer surrogates have nearly the fronts of these."""

_WFG_POSITIONS, _WFG_DISTANCES = 4, 20


@dataclass(frozen=True)
class Benchmark:
    """A problem of the comparison.

    Attributes
    ----------
    name : str
    family : str
    tuning : bool
        Whether our algorithms may be tuned on it; all others are held out.
    make : callable
        Builds the problem.
    """

    name: str
    family: str
    tuning: bool
    make: Callable[[], Problem]


@cache
def problem_of(name: str) -> Problem:
    """Return the problem of that name, one of `EVERY`, built once per process."""
    return EVERY[name].make()


def _zdt() -> list[Benchmark]:
    plain: list[Benchmark] = []
    moved: list[Benchmark] = []
    rotated: list[Benchmark] = []
    for number, digit in enumerate(_ZDT):
        name = f"zdt{digit}"

        make_moved = partial(MovedZDT, name, rotated=False, seed=number + 1)
        make_rotated = partial(MovedZDT, name, rotated=True, seed=number + 101)
        entries = (
            (plain, "", True, partial(get_problem, name)),
            (moved, " moved", True, make_moved),
            (rotated, " rotated", False, make_rotated),
        )
        for group, suffix, tuning, make in entries:
            full = name.upper() + suffix.replace(" ", "-")
            group.append(Benchmark(full, "ZDT" + suffix, tuning, make))
    return plain + moved + rotated


def _dtlz(number: int) -> Benchmark:
    make = partial(get_problem, f"dtlz{number}", n_var=_DTLZ_VARIABLES[number], n_obj=3)
    return Benchmark(f"DTLZ{number}", "DTLZ", number == 2, make)


def _wfg(number: int) -> Benchmark:
    n_var = _WFG_POSITIONS + _WFG_DISTANCES
    make = partial(get_problem, f"wfg{number}", n_var=n_var, n_obj=2, k=_WFG_POSITIONS)
    return Benchmark(f"WFG{number}", "WFG", False, make)


def _constrained(name: str) -> Benchmark:
    known_as = {"WeldedBeam": "welded_beam"}.get(name, name.lower())
    return Benchmark(name, "constrained", False, partial(get_problem, known_as))


def _robust(member: str) -> Benchmark:
    family = "constrained RobustDTE" if member.endswith("_grades") else "RobustDTE"
    return Benchmark(f"RobustDTE-{member}", family, False, robust_dte_family()[member])


BENCHMARKS = {
    benchmark.name: benchmark
    for benchmark in (
        *_zdt(),
        Benchmark("RobustToy", "toy twin", True, RobustToy),
        *map(_dtlz, (2, 1, 7)),
        *map(_wfg, range(1, 10)),
        *map(_constrained, ("BNH", "TNK", "SRN", "OSY", "WeldedBeam")),
        *map(_robust, ROBUST_MEMBERS),
    )
}
"""All problems of the comparison by name."""

CARDS = {
    benchmark.name: benchmark
    for benchmark in (BENCHMARKS["RobustToy"], *map(_robust, robust_dte_family()))
}
"""The problems of this package that have a card, by name."""

EVERY = BENCHMARKS | CARDS
