"""Speed of the other parts: imports, surrogate, solvers, sorting, discrepancy workflow."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from subprocess import run

import numpy as np
from moocore import pareto_rank
from pymoo.core.problem import Problem
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from threadpoolctl import threadpool_limits

from experiments.studies.blind.cases import BELIEVED, RIG
from experiments.studies.timing import Ratio, best_time
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign, torque_ripple
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive
from pymoo_hdte.drive import harmonic_balance, preset, simulate_drive
from pymoo_hdte.problems import Design, Mean, RobustDTE, Std
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.surrogate._sparse.adaptive import AdaptiveFit, fit_adaptively
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial
from pymoo_hdte.surrogate.threads import usable_cores

N_POINTS = 1000
SORTED = 200
N_DESIGNS = 1_000_000
N_RUNS = 160
REPEATS = 5
OUR_STUDY = (
    "from pymoo_hdte.algorithms import ElitistSwarm; from pymoo_hdte.problems import RobustDTE; "
    "from pymoo.optimize import minimize"
)
THEIR_STUDY = "from pymoo.algorithms.moo.nsga2 import NSGA2; from pymoo.optimize import minimize"


def ratios_of_parts() -> Iterator[Ratio]:
    """Measure one ratio a part."""
    yield _imports()
    yield _surrogate()
    yield from _many_designs()
    yield _growth()
    yield _harmonic_balance()
    yield from _sorting()
    yield _discrepancy()


def _imports() -> Ratio:
    ours, theirs = (_seconds_of(code) for code in (OUR_STUDY, THEIR_STUDY))
    return Ratio(
        "imports of a study, from Python's start",
        "RobustDTE and ElitistSwarm",
        ours,
        "minimize and NSGA-II of pymoo",
        theirs,
        "less than 2",
        ours < 2.0 * theirs,
    )


def _seconds_of(code: str) -> float:
    return best_time(lambda: run([sys.executable, "-c", code], check=True), REPEATS)


def _surrogate() -> Ratio:
    problem = robust_problem("calibrated")
    model, box = problem.model, problem.surrogate.box
    points = np.random.default_rng(3).uniform(box.lower, box.upper, (N_POINTS, len(box)))
    integrated = best_time(lambda: simulate_drive(model, points[0]), 2)
    return Ratio(
        f"one DTE of {model.name} (paper: 49,000)",
        "integration from rest",
        integrated,
        f"surrogate, {N_POINTS} points at once",
        best_time(lambda: problem.surrogate(points), 20 * REPEATS) / N_POINTS,
        "",
        True,
    )


def _many_designs() -> Iterator[Ratio]:
    """Measure `evaluate` of pymoo, on all cores."""
    problems: tuple[tuple[str, Problem], ...] = (
        ("RobustDTE(order=5)", RobustDTE(order=5)),
        ("sparse surrogate of total degree 5", _of_degree_5()),
    )
    for name, problem in problems:
        X = np.random.default_rng(4).uniform(problem.xl, problem.xu, (N_DESIGNS, 4))
        ours = best_time(lambda p=problem, x=X: p.evaluate(x), REPEATS)  # type: ignore[misc]
        yield Ratio(
            f"mean and deviation of a million designs of four variables, {name}",
            "a second",
            1.0,
            f"evaluate, {usable_cores()} cores",
            ours,
            "at least 1: a million designs a second",
            ours <= 1.0,
        )


def _of_degree_5() -> SimulatorProblem:
    inputs = Inputs({name: Design(1.0, 2.0, tolerance=0.05) for name in "abcd"}, {})
    indices = np.array([one for one in np.ndindex(6, 6, 6, 6) if sum(one) <= 5])
    rng = np.random.default_rng(4)
    coefficients = rng.normal(size=(1, len(indices))) * 0.5 ** indices.sum(axis=1)
    polynomial = SparsePolynomial(indices, coefficients)
    moments, none = SparseMoments(polynomial, inputs.axes), np.zeros(1)
    no_points, no_values = np.empty((0, 4)), np.empty((0, 1))
    runs = (no_points, no_values, no_points, no_points, no_values)
    fit = AdaptiveFit(polynomial, moments, none, none, 0, none, *runs)
    return SimulatorProblem(inputs, fit, ("y",), (Mean(), Std()), (), 0)


def _growth() -> Ratio:
    """Measure whether libraries with a thread a core hold up growth, which fits on one."""
    axes = Inputs({name: Design(1.0, 2.0, tolerance=0.05) for name in "abcd"}, {}).axes

    def grow() -> None:
        rng = np.random.default_rng(6)
        fit_adaptively(axes, lambda cube: np.exp(-np.abs(cube[:, :1])), 0.001, N_RUNS, rng)

    times = []
    for threads in (usable_cores(), 1):
        with threadpool_limits(threads):
            times.append(best_time(grow, 2))
    return Ratio(
        f"growth of a surrogate to {N_RUNS} runs",
        f"libraries with {usable_cores()} threads",
        times[0],
        "with one",
        times[1],
        "less than 1.25",
        times[0] < 1.25 * times[1],
    )


def _harmonic_balance() -> Ratio:
    model = preset("resonant")
    coefficients = model.coefficients(model.nominal[None])
    return Ratio(
        "steady state with a free input angle",
        "integration from rest",
        best_time(lambda: simulate_drive(model, model.nominal), 2),
        "harmonic balance",
        best_time(lambda: harmonic_balance(coefficients), REPEATS),
        "",
        True,
    )


def _sorting() -> Iterator[Ratio]:
    F = np.random.default_rng(4).random((SORTED, 3))
    yield Ratio(
        f"ranks of {SORTED} points",
        "sorting of pymoo",
        best_time(lambda: NonDominatedSorting().do(F), 20 * REPEATS),
        "moocore",
        best_time(lambda: pareto_rank(F), 20 * REPEATS),
        "",
        True,
    )
    yield Ratio(
        f"{SORTED} points thinned out to half",
        "crowding distance, Python",
        best_time(lambda: least_crowded(F, SORTED // 2), 4 * REPEATS),
        "nearest neighbours, compiled",
        best_time(lambda: most_spread(F, SORTED // 2), 4 * REPEATS),
        "",
        True,
    )


def _discrepancy() -> Ratio:
    rng = np.random.default_rng(5)
    rig = draw_rig(BELIEVED, (torque_ripple(rng),), rng)
    begin = time.perf_counter()
    campaign = run_campaign(rig, BELIEVED, RIG, rng)
    recorded = time.perf_counter() - begin
    begin = time.perf_counter()
    examine_drive(campaign)
    return Ratio(
        f"a campaign of {len(campaign.running)} records with a hidden ripple",
        "integrating the rig once",
        recorded,
        "the whole verdict",
        time.perf_counter() - begin,
        "",
        True,
    )
