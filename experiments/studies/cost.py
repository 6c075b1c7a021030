"""What the surrogate saves: the paper's times of computing, and ours beside them as ratios."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.published_values import (
    BATCH_MODEL_SECONDS,
    BATCH_SIZE,
    BATCH_SURROGATE_SECONDS,
    GENERATIONS,
    MODEL_SECONDS,
    POPULATION,
    SPEED_UPS,
    SURROGATE_SECONDS,
)
from experiments.runner.machine import machine_table, processor
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.timing import best_time, integration_time
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte._runner.result import OF_MODELS, Column, Finding, Result, Table, significant
from pymoo_hdte.drive import PRESETS, DriveModel, harmonic_balance
from pymoo_hdte.problems import RobustDTEDirect
from pymoo_hdte.problems.drive_response import PAPERS_ORDER
from pymoo_hdte.surrogate import latin_hypercube
from pymoo_hdte.units import ARCSEC

METHOD = "DOP853"
REPEATS = 3
DIRECT_DESIGNS = 10
SEED = 1
LITTLE = 1.0
"""Seconds on one core for a Monte Carlo analysis of the model that ask for no surrogate."""
RUN_DESIGNS = POPULATION * GENERATIONS
NODES = (PAPERS_ORDER + 1) ** 5
ALIKE = 1.05

(SETTING,) = paragraphs("cost", batch_size=f"{BATCH_SIZE:,}", method=METHOD)


@dataclass(frozen=True)
class Seconds:
    """Wall times in s of `BATCH_SIZE` DTEs of one drive model."""

    model: str
    integration: float
    balance: float
    steady_state: float
    surrogate: float


def run(context: Context) -> Result:
    """Time the model, an integrator and the surrogate; hold the paper's times against each other.

    Sentences outside the tables of wall times say nothing that depends on how long things took,
    but for whether the model takes less than `LITTLE`.
    """
    measured = [_measured(name) for name in PRESETS]
    quick = max(entry.steady_state for entry in measured) < LITTLE
    return Result(
        title="Cost: the drive model, an integrator and the surrogate",
        command="python -m experiments cost",
        answer=f"{verdict(quick=quick)}. {_on_the_integrator()}",
        paragraphs=(SETTING,),
        models=models_of(*PRESETS),
        tables=(_printed_table(), _times_table(measured, _direct_seconds()), machine_table()),
        first_page={OF_MODELS: _lowered(verdict(quick=quick))},
    )


def balanced_dte(model: DriveModel, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the DTE in arcsec, shape (n,), by harmonic balance with a free input angle."""
    spectrum = harmonic_balance(model.coefficients(points)).spectrum()
    return spectrum.peak_to_peak(model.sheet.ratio) / ARCSEC


@ONE_THREAD
def _measured(name: str) -> Seconds:
    problem = robust_problem(name)
    model, surrogate = problem.model, problem.surrogate
    points = latin_hypercube(surrogate.box, BATCH_SIZE, SEED)
    return Seconds(
        name,
        integration_time(model, model.nominal[None], METHOD) * BATCH_SIZE,
        best_time(lambda: balanced_dte(model, points), 1),
        best_time(lambda: model.dte_arcsec(points), REPEATS),
        best_time(lambda: surrogate(points), 10 * REPEATS),
    )


@ONE_THREAD
def _direct_seconds() -> float:
    """Return how long mean and deviation of one design take by quadrature of the model."""
    problem = RobustDTEDirect()
    rng = np.random.default_rng(SEED)
    designs = rng.uniform(problem.xl, problem.xu, (DIRECT_DESIGNS, problem.n_var))
    return best_time(lambda: problem.evaluate(designs), 1) / DIRECT_DESIGNS


def verdict(*, quick: bool) -> str:
    """Say whether the drive model itself is quick enough to need no surrogate; no full stop."""
    if not quick:
        return (
            f"{BATCH_SIZE:,} DTEs of the drive model itself take {LITTLE:g} s or more on this "
            f"machine, where the paper's integration takes {BATCH_MODEL_SECONDS} s"
        )
    return (
        f"{BATCH_SIZE:,} DTEs of the drive model itself, solved in the frequency domain, take "
        f"less than {LITTLE:g} s on one core, where the paper's integration takes "
        f"{BATCH_MODEL_SECONDS} s: a surrogate is hardly needed"
    )


def _on_the_integrator() -> str:
    return (
        f"The paper's ratio of {SPEED_UPS[1]:,} compares the surrogate with an integrator, not "
        "with the fastest way to solve the equations."
    )


def _lowered(sentence: str) -> str:
    return sentence[0].lower() + sentence[1:]


def _printed_table() -> Table:
    rows = (
        ("one evaluation", MODEL_SECONDS, SURROGATE_SECONDS, SPEED_UPS[0]),
        (f"Monte Carlo, {BATCH_SIZE:,} evaluations", BATCH_MODEL_SECONDS,
         BATCH_SURROGATE_SECONDS, SPEED_UPS[1]),
        (f"{NODES:,} runs to build the surrogate of order {PAPERS_ORDER}",
         NODES * MODEL_SECONDS, None, None),
    )  # fmt: skip
    columns = (
        Column("what"),
        Column("equations", "s", 5, paper=True),
        Column("surrogate", "s", 2, paper=True),
        Column("ratio", "", 5, paper=True),
    )
    note = "The time to build the surrogate is the number of runs times the printed time of one."
    findings = tuple(_printed_findings())
    return Table("printed", "The printed times", columns, rows, note=note, findings=findings)


def _printed_findings() -> Iterator[Finding]:
    scaled = BATCH_SIZE * MODEL_SECONDS
    apart = scaled / BATCH_MODEL_SECONDS
    yield Finding(
        1.0 / ALIKE <= apart <= ALIKE,
        f"{BATCH_SIZE:,} runs at {MODEL_SECONDS} s take {significant(scaled, 4)} s; the paper "
        f"prints {BATCH_MODEL_SECONDS} s for as many.",
        within_paper=True,
    )
    build = NODES * MODEL_SECONDS
    yield Finding(
        build <= BATCH_MODEL_SECONDS,
        f"The {NODES:,} runs that build the surrogate take {significant(build, 4)} s at the "
        f"printed {MODEL_SECONDS} s, more than the {BATCH_MODEL_SECONDS} s of the analysis that "
        "it speeds up: it pays from the second analysis on, which the ratios leave out.",
        within_paper=True,
    )


def _times_table(measured: Sequence[Seconds], direct: float) -> Table:
    rows = [
        (
            entry.model,
            entry.integration,
            entry.balance,
            entry.steady_state,
            entry.surrogate,
            entry.integration / entry.surrogate,
            entry.steady_state / entry.surrogate,
            entry.integration / entry.steady_state,
        )
        for entry in measured
    ]
    paper = (BATCH_MODEL_SECONDS, None, None, BATCH_SURROGATE_SECONDS, SPEED_UPS[1], None, None)
    columns = (
        Column("model"),
        Column(f"integration, {METHOD}", "s", 3),
        Column("harmonic balance", "s", 2),
        Column("steady state", "s", 2),
        Column("surrogate", "s", 2),
        Column("integration / surrogate", "", 3, "ratio"),
        Column("steady state / surrogate", "", 3, "ratio"),
        Column("integration / steady state", "", 3, "ratio"),
    )
    return Table(
        "times",
        f"{BATCH_SIZE:,} DTEs on one core",
        columns,
        (*rows, ("paper", *paper)),
        note=f"Ours on {processor()}; the paper's on an Intel Core i5-11300H.",
        findings=tuple(_timed_findings(measured, direct)),
        wall_times=True,
    )


def _timed_findings(measured: Sequence[Seconds], direct: float) -> Iterator[Finding]:
    ratios = [entry.integration / entry.surrogate for entry in measured]
    listed = ", ".join(
        f"{ratio:,.0f} ({e.model})" for ratio, e in zip(ratios, measured, strict=True)
    )
    yield Finding(
        min(ratios) >= SPEED_UPS[1],
        f"Integration in time takes as long as the surrogate times {listed}; the paper prints "
        f"{SPEED_UPS[1]:,}.",
    )
    slowest = max(measured, key=lambda entry: entry.steady_state)
    ratio = slowest.integration / slowest.steady_state
    minutes = [RUN_DESIGNS * each / 60.0 for each in (slowest.steady_state, direct)]
    days = RUN_DESIGNS * BATCH_MODEL_SECONDS / 86400.0
    yield Finding(
        slowest.steady_state < LITTLE,
        f"{BATCH_SIZE:,} DTEs of the drive model itself take "
        f"{significant(slowest.steady_state, 2)} s ({slowest.model}), {ratio:,.0f} times less than "
        f"integration in time. {RUN_DESIGNS:,} designs of {BATCH_SIZE:,} samples each then take "
        f"{significant(minutes[0], 2)} minutes without a surrogate, and "
        f"{significant(minutes[1], 2)} by quadrature (`RobustDTEDirect`); by the paper's "
        f"{BATCH_MODEL_SECONDS} s a design, {significant(days, 2)} days.",
        check=True,
    )
