"""The contestants by name: what each needs and how it is run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec

import numpy as np
from pymoo.core.problem import Problem

from experiments.comparing.peers_pymoo import OWN, PYMOO, Offer, run_pymoo

EVALUATIONS, SPENT = "evaluations", "spent"
"""Columns of a run: its budgets, and what it spent of each."""

RunFunction = Callable[[Problem, Sequence[int], int], list[Offer]]


@dataclass(frozen=True)
class Contestant:
    """An algorithm of the comparison.

    Attributes
    ----------
    library : str
        Where it comes from.
    run : callable
        Takes a problem, ascending budgets and a seed; gives what is offered at each budget.
    starts_anew : bool
        Whether every budget is a run of its own: because the algorithm moves otherwise if it may
        spend more, or cannot be stopped on the way.
    takes_constraints : bool
    two_objectives_only : bool
    """

    library: str
    run: RunFunction
    starts_anew: bool = False
    takes_constraints: bool = True
    two_objectives_only: bool = False

    @property
    def available(self) -> bool:
        """Whether its library is installed."""
        return find_spec(self.library) is not None

    def budgets_of_runs(self, budgets: tuple[int, ...]) -> list[tuple[int, ...]]:
        """Return the budgets that share a run: all, unless it starts anew for each."""
        return [(budget,) for budget in budgets] if self.starts_anew else [budgets]


@dataclass(frozen=True)
class ContestantRun:
    """One contestant on one problem with one seed, and what it offers at each budget, as a job."""

    problem: str
    algorithm: str
    seed: int
    budgets: tuple[int, ...]

    @property
    def key(self) -> str:
        """All settings in one name, which may be that of a file."""
        budgets = "_".join(map(str, self.budgets))
        return f"{self.problem}_{self.algorithm.replace('/', '-')}_{budgets}_seed{self.seed}"

    def offers(
        self, contestant: Contestant, problem: Problem
    ) -> tuple[Iterator[tuple[int, Offer]], float]:
        """Return budgets with what is offered at each, and the seconds of the run."""
        started = time.perf_counter()
        offers = contestant.run(problem, self.budgets, self.seed)
        seconds = time.perf_counter() - started
        return zip(self.budgets, offers, strict=True), seconds


def run_random(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    """Draw designs uniformly and return the feasible objectives after each budget."""
    rng = np.random.default_rng(seed)
    X = problem.xl + rng.random((budgets[-1], problem.n_var)) * (problem.xu - problem.xl)
    F, G = problem.evaluate(X, return_values_of=["F", "G"])
    feasible = np.all(G <= 0.0, axis=1)
    return [Offer(F[:budget][feasible[:budget]], budget) for budget in budgets]


def of_jmetal(name: str) -> RunFunction:
    """Return what runs an algorithm of jMetalPy."""

    def run(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
        # Imported where it is used, because the extra may be absent.
        from experiments.comparing.peers_jmetal import run_jmetal

        return run_jmetal(name, problem, budgets, seed)

    return run


def _pygmo(problem: Problem, budgets: Sequence[int], seed: int) -> list[Offer]:
    from experiments.comparing.peers_pygmo import run_pygmo

    return run_pygmo(problem, budgets, seed)


CONTESTANTS = {
    **{
        name: Contestant("pymoo_hdte", partial(run_pymoo, make), starts_anew=knows)
        for name, (make, knows) in OWN.items()
    },
    **{name: Contestant("pymoo", partial(run_pymoo, make)) for name, make in PYMOO.items()},
    "SMPSO": Contestant("jmetal", of_jmetal("SMPSO")),
    "OMOPSO": Contestant("jmetal", of_jmetal("OMOPSO"), starts_anew=True),
    "NSPSO": Contestant("pygmo", _pygmo, starts_anew=True, takes_constraints=False),
    "random search": Contestant("numpy", run_random),
}
"""All contestants by name."""
