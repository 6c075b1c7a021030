"""Speed as ratios measured in one run, and agreement of the steady state with integration."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.algorithm import Algorithm
from tqdm import tqdm

from experiments.runner.machine import machine_table
from experiments.runner.own_time import seconds_of_run
from experiments.runner.registry import Context
from experiments.studies.benchmark_parts import ratios_of_parts
from experiments.studies.benchmark_verdicts import verdict_times
from experiments.studies.benchmark_workers import ratios_of_workers, virtual_table
from experiments.studies.timing import Ratio, best_time, integration_time, ratio_table
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import Column, Finding, Result, Table
from pymoo_hdte.algorithms import AMPMOPSO, CompactSwarm, ElitistSwarm
from pymoo_hdte.drive import (
    PARAMETERS,
    PRESETS,
    DriveModel,
    harmonic_balance,
    preset,
    simulate_drive,
)
from pymoo_hdte.drive.simulation import ANGLES, METHODS
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.units import ARCSEC

N_DESIGNS = 100
N_SAMPLES = 1000
N_NODES = 1024
N_TIMED = 10
GENERATIONS = 100
REPEATS = 5
AGREEMENT = 1e-4
AGREEMENT_RESONANT_FREE = 1e-2
"""Where a resonance lies between the orders the input angle itself fluctuates, which Hill's method
leaves out and the harmonic balance does not."""
RESONANT = ("calibrated", "resonant")


def run(context: Context) -> Result:
    """Measure all ratios and the agreement; minutes, on one core."""
    agreement = tuple(_agreement())
    ratios = [
        *_moments(),
        *_steady_state(),
        *_algorithms(),
        *ratios_of_parts(),
        *ratios_of_workers(),
    ]
    return Result(
        title="Benchmark: speed ratios and agreement with integration",
        command="python -m experiments benchmark",
        answer=_counted(ratios, agreement),
        paragraphs=(
            "Times are the least of several repetitions on one core, those of a million designs on "
            "all; only their ratios within this run mean anything. The machine should have nothing "
            "else to do: its load stands below.",
        ),
        models=models_of("calibrated", "resonant"),
        tables=(
            ratio_table(ratios),
            virtual_table(),
            *verdict_times(),
            machine_table(),
            _agreement_table(agreement),
        ),
    )


def _moments() -> Iterator[Ratio]:
    exact, sampled = robust_problem("calibrated"), RobustDTE(moments="sample", n_samples=N_SAMPLES)
    rng = np.random.default_rng(1)
    designs = rng.uniform(exact.xl, exact.xu, (N_DESIGNS, exact.n_var))
    polynomial = sampled.surrogate.polynomial
    cube = rng.uniform(-1.0, 1.0, (len(PARAMETERS), N_DESIGNS * N_SAMPLES))
    exact_seconds = best_time(lambda: exact.moments(designs), 200 * REPEATS)
    sampled_seconds = best_time(lambda: sampled.moments(designs), 4 * REPEATS)
    bare_seconds = best_time(lambda: polynomial(cube), 4 * REPEATS)
    yield Ratio(
        f"moments of {N_DESIGNS} designs",
        f"Monte Carlo, {N_SAMPLES} common samples",
        sampled_seconds,
        "exact",
        exact_seconds,
        "at least 300",
        sampled_seconds >= 300.0 * exact_seconds,
    )
    yield Ratio(
        f"surrogate at {N_DESIGNS * N_SAMPLES} points",
        "sampled moments",
        sampled_seconds,
        "bare tensor contraction",
        bare_seconds,
        "at most 2",
        sampled_seconds <= 2.0 * bare_seconds,
    )


def _steady_state() -> Iterator[Ratio]:
    for name in PRESETS:
        model = preset(name)
        nodes = _random_designs(model, N_NODES)
        steady = best_time(lambda m=model, n=nodes: m.dte_arcsec(n), REPEATS)  # type: ignore[misc]
        by_method = {
            method: integration_time(model, nodes[:1], method)
            for method in tqdm(METHODS, desc=f"integrators, {name}", leave=False)
        }
        best = min(by_method, key=by_method.__getitem__)
        scaled = integration_time(model, nodes[:N_TIMED], best) * N_NODES / N_TIMED
        yield Ratio(
            f"{N_NODES} nodes of {name}",
            f"{best}, rtol 1e-8, {N_TIMED} nodes scaled",
            scaled,
            "steady state",
            steady,
            "at least 1000, fast side below 1 s",
            scaled >= 1000.0 * steady and steady < 1.0,
        )


def _algorithms() -> Iterator[Ratio]:
    problem = robust_problem("calibrated")
    makers: dict[str, Callable[[], Algorithm]] = {
        "NSGA-II": lambda: NSGA2(pop_size=100),
        "AMP-MOPSO": lambda: AMPMOPSO(pop_size=100, archive_size=50),
        "ElitistSwarm": lambda: ElitistSwarm(pop_size=100),
        "CompactSwarm": lambda: CompactSwarm(pop_size=100),
    }
    # The models of CompactSwarm are for evaluations that take far longer than it does.
    demanded = dict.fromkeys(makers, 3.0) | {"CompactSwarm": 2.0}
    own, total = (
        {
            name: min(_seconds_per_generation(problem, make())[kind] for _ in range(REPEATS))
            for name, make in makers.items()
        }
        for kind in range(2)
    )
    ours = [name for name in makers if name != "NSGA-II"]
    for (label, seconds), name in product((("own cost", own), ("with evaluation", total)), ours):
        yield Ratio(
            f"one generation of 100, {label}",
            "NSGA-II of pymoo",
            seconds["NSGA-II"],
            name,
            seconds[name],
            f"at least {demanded[name]:.0f}" if label == "own cost" else "",
            seconds["NSGA-II"] >= demanded[name] * seconds[name] or label != "own cost",
        )


def _seconds_per_generation(problem: RobustDTE, algorithm: Algorithm) -> tuple[float, float]:
    """Return the seconds per generation without and with evaluation."""
    algorithm.setup(problem, termination=("n_gen", GENERATIONS), seed=1)
    own, total = seconds_of_run(algorithm, time.perf_counter)
    return own / GENERATIONS, total / GENERATIONS


def _agreement() -> Iterator[tuple[str, str, float, float]]:
    """Yield preset, method and angle, largest relative difference and what is allowed."""
    cases = list(product(PRESETS, ANGLES))
    for name, angle in tqdm(cases, desc="agreement", unit="case"):
        model = preset(name)
        designs = np.vstack([model.nominal, _random_designs(model, N_TIMED)])
        expected = model.dte_arcsec(designs)
        found = [simulate_drive(model, design, angle=angle).dte_arcsec() for design in designs]
        loose = name in RESONANT and angle == "free"
        allowed = AGREEMENT_RESONANT_FREE if loose else AGREEMENT
        yield name, f"steady state, angle {angle}", _largest(found, expected), allowed
        if angle == "free":
            balance = harmonic_balance(model.coefficients(designs)).spectrum()
            balanced = balance.peak_to_peak(model.sheet.ratio) / ARCSEC
            yield name, "harmonic balance, angle free", _largest(found, balanced), AGREEMENT


def _largest(found: list[float], expected: NDArray[np.float64]) -> float:
    return float(np.max(np.abs(np.array(found) / expected - 1.0)))


def _random_designs(model: DriveModel, n: int) -> NDArray[np.float64]:
    box = robust_problem(model.name).surrogate.box
    return np.random.default_rng(2).uniform(box.lower, box.upper, (n, len(PARAMETERS)))


def _counted(ratios: Sequence[Ratio], agreement: Sequence[tuple[str, str, float, float]]) -> str:
    asked = [one for one in ratios if one.target]
    worst = max(difference for _, _, difference, _ in agreement)
    return (
        f"{sum(one.reached for one in asked)} of {len(asked)} speed ratios asked for are reached; "
        f"steady state and integration in time differ by {worst:.1e} at most."
    )


def _agreement_table(rows: tuple[tuple[str, str, float, float], ...]) -> Table:
    return Table(
        "agreement",
        f"Steady state against integration from rest, nominal and {N_TIMED} random designs",
        (
            Column("model"),
            Column("method, angle in theta_s and stiffness"),
            Column("largest relative difference of the DTE", "", 2),
            Column("allowed", "", 1),
        ),
        rows,
        findings=tuple(
            Finding(
                difference <= allowed,
                f"{name}, {method}: the DTE differs by {difference:.1e} at most; "
                f"{allowed:.0e} is allowed.",
                check=True,
            )
            for name, method, difference, allowed in rows
        ),
    )
