"""The benchmark: which problems there are, which of them may be tuned on, and their true fronts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from experiments.contest.moved_zdt import MovedZDT
from experiments.contest.true_fronts import (
    N_POINTS,
    dtlz_front,
    even_curve,
    osy_front,
    srn_front,
    tnk_front,
    welded_beam_front,
    wfg_front,
)
from pymoo_hdte.problems import RobustDTE, RobustToy

_ZDT = ("1", "2", "3", "4", "6")
_DTLZ_VARIABLES = {1: 7, 2: 12, 7: 22}
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
    front : callable
        Gives the true front (n, m) of a problem that was built.
    """

    name: str
    family: str
    tuning: bool
    make: Callable[[], Problem]
    front: Callable[[Problem], NDArray[np.float64]]


@cache
def problem_of(name: str) -> Problem:
    """Return the problem of that name, built once per process."""
    return BENCHMARKS[name].make()


@cache
def front_of(name: str) -> NDArray[np.float64]:
    """Return the true front (n, m) of the problem of that name, found once per process."""
    return BENCHMARKS[name].front(problem_of(name))


def _pymoo_front(problem: Problem) -> NDArray[np.float64]:
    return even_curve(problem.pareto_front(10 * N_POINTS))


def _own_front(problem: Problem) -> NDArray[np.float64]:
    return problem.pareto_front()


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
            group.append(Benchmark(full, "ZDT" + suffix, tuning, make, _pymoo_front))
    return plain + moved + rotated


def _dtlz(number: int) -> Benchmark:
    make = partial(get_problem, f"dtlz{number}", n_var=_DTLZ_VARIABLES[number], n_obj=3)
    return Benchmark(f"DTLZ{number}", "DTLZ", number == 2, make, lambda _: dtlz_front(number))


def _wfg(number: int) -> Benchmark:
    n_var = _WFG_POSITIONS + _WFG_DISTANCES
    make = partial(get_problem, f"wfg{number}", n_var=n_var, n_obj=2, k=_WFG_POSITIONS)
    return Benchmark(f"WFG{number}", "WFG", False, make, lambda _: wfg_front(number))


def _constrained() -> list[Benchmark]:
    fronts: dict[str, Callable[[Problem], NDArray[np.float64]]] = {
        "BNH": _pymoo_front,
        "TNK": lambda _: tnk_front(),
        "SRN": srn_front,
        "OSY": osy_front,
        "welded_beam": lambda _: welded_beam_front(),
    }
    return [
        Benchmark(name, "constrained", False, partial(get_problem, name.lower()), front)
        for name, front in fronts.items()
    ]


def _robust(model: str) -> Benchmark:
    return Benchmark(
        f"RobustDTE-{model}", "RobustDTE", False, partial(RobustDTE, model), _own_front
    )


BENCHMARKS = {
    benchmark.name: benchmark
    for benchmark in (
        *_zdt(),
        Benchmark("RobustToy", "toy twin", True, RobustToy, _own_front),
        *map(_dtlz, (2, 1, 7)),
        *map(_wfg, range(1, 10)),
        *_constrained(),
        *map(_robust, ("calibrated", "resonant")),
    )
}
"""All problems by name."""
