"""Whether any model gives the published trade-off.

Without ``--full`` the report is made from ``experiments/data/inference.csv``, the committed
outcome of the last full campaign; with it the campaign runs (some half hour of one core), goes on
where it was interrupted, and leaves the file in the results folder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from experiments.paper.calibrating.ladder import EFFECTS, NARROW, WIDE, Candidate
from experiments.paper.calibrating.predictions import ORDER
from experiments.paper.inference.closures import CLOSURES
from experiments.paper.inference.data import Fit, fits_of, format_fits, read_fits
from experiments.paper.inference.likelihood import (
    BAND,
    DEPTH_TOLERANCE,
    OBSERVED,
    READING,
    SAMPLES,
    box_axes,
)
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.node_noise import LARGEST
from experiments.paper.inference.rungs import Rung, all_rungs, noisy_rungs
from experiments.paper.inference.search import Effort, Search
from experiments.paper.inference.tables import (
    held_out_table,
    ladder_table,
    noise_table,
    of_the_first_page,
    opening,
    steps_table,
)
from experiments.paper.inference.verdicts import Named, chosen_fits, noisy_fits
from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, grid
from pymoo_hdte._runner.result import OF_MODELS, Picture, Result
from pymoo_hdte._runner.store import write_atomically

COLOURS = (BLUE, ORANGE, GREEN, PINK, GREY)
_GRID = 17
BEYOND = 7.0
"""Of the published optima, shown on either side, arcsec."""


def objectives(shown: Sequence[Named]) -> Figure:
    """Draw optima and fronts of the models."""
    figure, axes = grid(1, 1, width=6.6, height=4.6)
    axis = axes.flat[0]
    for named, colour in zip(shown, COLOURS, strict=False):
        predicted = named.fit.evaluation.predicted
        axis.plot(*_front(named).T, "-", color=colour, linewidth=1)
        axis.plot(predicted[1:4], predicted[5:8], "o", color=colour, label=named.label)
    axis.plot(OBSERVED[1:4], OBSERVED[5:8], "x", color=BLACK, markersize=9, label="the paper")
    # A front that the target has drawn close runs on far beyond all others.
    axis.set_xlim(OBSERVED[1] - BEYOND, OBSERVED[3] + BEYOND)
    axis.set_ylim(OBSERVED[7] - 0.3 * BEYOND, OBSERVED[5] + 0.2 * BEYOND)
    axis.set_xlabel("mean [arcsec]")
    axis.set_ylabel("standard deviation [arcsec]")
    axis.legend(frameon=False, fontsize=7)
    return figure


def _front(named: Named) -> np.ndarray:
    surrogate = TensorSurrogate.fit(named.fit.rung, named.fit.parameters)
    moments = surrogate.on_designs(box_axes(surrogate, _GRID), BAND)
    values = np.column_stack([part.ravel() for part in moments])
    rising = values[np.lexsort((values[:, 1], values[:, 0]))]
    lowest = np.minimum.accumulate(rising[:, 1])
    return rising[np.concatenate([[True], rising[1:, 1] < lowest[:-1]])]


NAME = "inference"
FITS = f"{NAME}.csv"
SEED = 1
LARGE, FRONT, MIDDLE, SMALL = Effort(64), Effort(32), Effort(24), Effort(9)
"""Of the models with all effects: theta_s as semi-amplitude, the same with the front as a target,
and theta_s as peak-to-peak; of all other models, which are special cases of these or one closure
more."""
FULL = {bands: Rung(Candidate(EFFECTS, "semi_amplitude", bands)) for bands in (NARROW, WIDE)}
"""The rung of ``calibrated``, under either reading of the bands."""

SETTING, DEPTH, NOISE = paragraphs(
    "inference",
    samples=SAMPLES,
    reading=READING,
    depth_tolerance=f"{DEPTH_TOLERANCE:g}",
    largest=f"{LARGEST:.2f}",
    order=ORDER,
)
WORDS = (
    "R1 and R2 are the readings of the bands of the calibration: R1 has every Monte "
    "Carlo run at ±5 %, R2 that of the initial design at ±35 %. Closures, each one equation beside "
    "Eq. (9): "
    + "; ".join(f"{name}: {closure.sentence}" for name, closure in CLOSURES.items())
    + "."
)


def run(context: Context) -> Result:
    """Search or read what was found, and say what it means."""
    fits = _campaign(context) if context.full else read_fits(committed_file(FITS, NAME))
    shown = chosen_fits(fits)
    return Result(
        title="Which model gives the published trade-off",
        command=context.command(NAME),
        answer=opening(fits),
        paragraphs=(*stored_outcome(context, NAME), SETTING, NOISE, DEPTH, WORDS),
        tables=(
            steps_table(fits),
            noise_table(fits),
            ladder_table(fits),
            held_out_table([*shown, *noisy_fits(fits)]),
        ),
        pictures=(
            Picture(
                "objectives",
                "The three published optima (crosses), where models put the same designs (dots), "
                "and their fronts (lines).",
                objectives(shown),
                leading=True,
            ),
        ),
        first_page={OF_MODELS: of_the_first_page(fits)},
    )


def searches() -> list[Search]:
    """Return all searches without node noise, in the order in which they are reported."""
    rungs = all_rungs()
    found = [Search(FULL[NARROW], "independent", SEED, LARGE)]
    for rung in rungs:
        found.append(Search(rung, "common", SEED, effort_for(rung)))
    closed = [Rung(rung.candidate, tuple(CLOSURES)) for rung in FULL.values()]
    return [*found, *(Search(rung, "front", SEED, FRONT) for rung in (*FULL.values(), *closed))]


def noisy_searches(best: dict[tuple[str, Rung], tuple[float, ...]]) -> list[Search]:
    """Return the searches with node noise; each also goes on from the best place without it."""
    return [
        Search(rung, "noise", SEED, noisy_effort(rung), best["common", rung])
        for rung in noisy_rungs()
    ]


def effort_for(rung: Rung) -> Effort:
    """Return how long a rung is searched: longest where it holds all others of its readings."""
    if set(rung.candidate.effects) != set(EFFECTS) or len(rung.closures) == 1:
        return SMALL
    if rung.candidate.reading != "semi_amplitude":
        return MIDDLE
    # Under R2 the ladder meets the numbers without closures.
    return MIDDLE if rung.closures and rung.candidate.bands == WIDE else LARGE


def noisy_effort(rung: Rung) -> Effort:
    """Return how long a rung is searched with node noise, which widens every valley."""
    return MIDDLE if set(rung.candidate.effects) == set(EFFECTS) else SMALL


def _campaign(context: Context) -> list[Fit]:
    jobs = searches()
    runs = context.campaign.run(jobs, "searches")
    best = {
        (job.target, job.rung): tuple(run.values[0, 1:].tolist())
        for job, run in zip(jobs, runs, strict=True)
    }
    noisy = noisy_searches(best)
    jobs, runs = [*jobs, *noisy], [*runs, *context.campaign.run(noisy, "with node noise")]
    path = context.out / NAME / FITS
    write_atomically(path, format_fits(fits_of(jobs, runs)).encode())
    return read_fits(path)
