"""Whether any model gives the published trade-off, and what the numbers say of its parameters.

Without ``--full`` the report is made from ``experiments/data/inference*.csv``, the committed
outcome of the last full campaign; with it the campaign runs (some half hour of one core, with
the extra ``posterior``), goes on where it was interrupted, and leaves the files in the results
folder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.paper.calibrating.ladder import EFFECTS, LOGARITHMIC, NARROW, WIDE, Candidate
from experiments.paper.calibrating.predictions import ORDER
from experiments.paper.inference.closures import CLOSURES
from experiments.paper.inference.data import (
    Draws,
    Fit,
    Profiled,
    fits_of,
    format_draws,
    format_fits,
    format_profiles,
    read_draws,
    read_fits,
    read_profiles,
)
from experiments.paper.inference.knowledge import (
    BOUND,
    identity_table,
    optimum_table,
    parameter_table,
    title,
)
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
from experiments.paper.inference.posterior import Posterior, Profile
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
from experiments.published_values import TABLE_8
from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context, require
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, grid
from pymoo_hdte._runner.result import OF_MODELS, Picture, Result
from pymoo_hdte._runner.store import write_atomically

COLOURS = (BLUE, ORANGE, GREEN, PINK, GREY)
_GRID = 17
BEYOND = 7.0
"""Of the published optima, shown on either side, arcsec."""


def objectives(shown: Sequence[Named], draws: Sequence[Draws]) -> Figure:
    """Draw optima and fronts of the models, and the optima of the posteriors' draws."""
    figure, axes = grid(1, 2, width=6.6, height=4.6)
    axis, right = axes.flat
    for named, colour in zip(shown, COLOURS, strict=False):
        predicted = named.fit.evaluation.predicted
        axis.plot(*_front(named).T, "-", color=colour, linewidth=1)
        axis.plot(predicted[1:4], predicted[5:8], "o", color=colour, label=named.label)
    axis.plot(OBSERVED[1:4], OBSERVED[5:8], "x", color=BLACK, markersize=9, label="the paper")
    # A front that the target has drawn close runs on far beyond all others.
    axis.set_xlim(OBSERVED[1] - BEYOND, OBSERVED[3] + BEYOND)
    axis.set_ylim(OBSERVED[7] - 0.3 * BEYOND, OBSERVED[5] + 0.2 * BEYOND)
    _labels(axis)
    for drawn, colour in zip(draws, COLOURS, strict=False):
        values = drawn.optima["mean_balanced"], drawn.optima["std_balanced"]
        label = f"balanced, {title(drawn.target, drawn.rung)}"
        right.plot(*values, ".", color=colour, alpha=0.6, label=label)
    paper = TABLE_8["balanced"]
    right.plot(paper.mean_arcsec, paper.std_arcsec, "x", color=BLACK, markersize=9,
               label="balanced, the paper")  # fmt: skip
    _labels(right)
    return figure


def curves(profiled: Sequence[Profiled]) -> Figure:
    """Draw the profile of every parameter of every posterior."""
    names = list(profiled[0].curves)
    figure, axes = grid(-(-len(names) // 3), 3, width=3.6, height=2.4)
    for axis, name in zip(axes.flat, names, strict=False):
        for profile, colour in zip(profiled, COLOURS, strict=False):
            values, deviance = profile.curves[name].T
            shown = np.exp(values) if name in LOGARITHMIC else values
            axis.plot(shown, deviance - deviance.min(), "o-", color=colour, markersize=3,
                      label=title(profile.target, profile.rung))  # fmt: skip
        axis.axhline(BOUND, color=GREY, linewidth=1)
        axis.set_ylim(-0.5, 12.0)
        axis.set_xlabel(name.replace("_", " "))
    axes.flat[0].set_ylabel("deviance above the least")
    # No panel has room for it.
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", frameon=False, fontsize=8, ncols=2)
    return figure


def _front(named: Named) -> np.ndarray:
    surrogate = TensorSurrogate.fit(named.fit.rung, named.fit.parameters)
    moments = surrogate.on_designs(box_axes(surrogate, _GRID), BAND)
    values = np.column_stack([part.ravel() for part in moments])
    rising = values[np.lexsort((values[:, 1], values[:, 0]))]
    lowest = np.minimum.accumulate(rising[:, 1])
    return rising[np.concatenate([[True], rising[1:, 1] < lowest[:-1]])]


def _labels(axis: Axes) -> None:
    axis.set_xlabel("mean [arcsec]")
    axis.set_ylabel("standard deviation [arcsec]")
    axis.legend(frameon=False, fontsize=7)


NAME = "inference"
FITS, DRAWN, PROFILED = (f"{NAME}{part}.csv" for part in ("", "_posterior", "_profiles"))
SEED = 1
LARGE, FRONT, MIDDLE, SMALL = Effort(64), Effort(32), Effort(24), Effort(9)
"""Of the models with all effects: theta_s as semi-amplitude, the same with the front as a target,
and theta_s as peak-to-peak; of all other models, which are special cases of these or one closure
more."""
STEPS = 2000
"""Of each walker of a posterior."""
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
    fits, draws, profiled = _campaign(context) if context.full else _stored()
    shown = chosen_fits(fits)
    return Result(
        title="Which model gives the published trade-off, and what is known of its parameters",
        command=context.command(NAME),
        answer=opening(fits),
        paragraphs=(*stored_outcome(context, NAME), SETTING, NOISE, DEPTH, WORDS),
        tables=(
            steps_table(fits),
            noise_table(fits),
            ladder_table(fits),
            held_out_table([*shown, *noisy_fits(fits)]),
            optimum_table(draws),
            parameter_table(fits, draws, profiled),
            identity_table(fits, draws),
        ),
        pictures=(
            Picture(
                "objectives",
                "Left: the three published optima (crosses), where models put the same designs "
                "(dots), and their fronts (lines). Right: the balanced optimum that draws of the "
                "posteriors would have one choose.",
                objectives(shown, draws),
                leading=True,
            ),
            Picture(
                "profiles",
                "Least deviance over each parameter, all others being fitted, above that of the "
                "best place; the line at 3.84 bounds a 95 % interval. Points that few steps did "
                "not bring down bound the profile from above.",
                curves(profiled),
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


def _stored() -> tuple[list[Fit], list[Draws], list[Profiled]]:
    files = [committed_file(name, NAME) for name in (FITS, DRAWN, PROFILED)]
    return read_fits(files[0]), read_draws(files[1]), read_profiles(files[2])


def _campaign(context: Context) -> tuple[list[Fit], list[Draws], list[Profiled]]:
    require("emcee", "posterior")
    jobs = searches()
    runs = context.campaign.run(jobs, "searches")
    best = {
        (job.target, job.rung): tuple(run.values[0, 1:].tolist())
        for job, run in zip(jobs, runs, strict=True)
    }
    noisy = noisy_searches(best)
    jobs, runs = [*jobs, *noisy], [*runs, *context.campaign.run(noisy, "with node noise")]
    wanted = [("independent", FULL[NARROW]), ("common", FULL[WIDE])]
    posteriors = [Posterior(rung, target, best[target, rung], SEED, STEPS)
                  for target, rung in wanted]  # fmt: skip
    profiles = [Profile(rung, target, best[target, rung]) for target, rung in wanted]
    texts = {
        FITS: format_fits(fits_of(jobs, runs)),
        DRAWN: format_draws(posteriors, context.campaign.run(posteriors, "posteriors")),
        PROFILED: format_profiles(profiles, context.campaign.run(profiles, "profiles")),
    }
    folder = context.out / NAME
    for name, text in texts.items():
        write_atomically(folder / name, text.encode())
    return read_fits(folder / FITS), read_draws(folder / DRAWN), read_profiles(folder / PROFILED)
