"""What is known of the parameters, and how far the optimum can move: tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.paper.calibrating.ladder import LOGARITHMIC
from experiments.paper.inference.data import Draws, Fit, Profiled
from experiments.paper.inference.likelihood import BOX, residuals_of
from experiments.paper.inference.posterior import scaled_jacobian
from experiments.paper.inference.rungs import PERIODIC, Rung
from pymoo_hdte._runner.result import Cell, Column, Finding, Table, significant
from pymoo_hdte.decision import PREFERENCES

RANGE = (2.5, 97.5)
"""Percentiles of a 95 % range."""
BOUND = 3.84
"""Of chi-square with one degree of freedom, at 95 %."""
QUANTITIES = (("mean", "arcsec"), ("std", "arcsec"), ("K", ""), ("J_in", ""), ("B_fc", ""))
SETTLED = 0.5
"""Largest shift between the halves of a chain, in standard deviations."""
WEAKEST = 2
"""Directions of the least curvature that are told."""


def title(target: str, rung: Rung) -> str:
    """Name a posterior for tables and legends."""
    words = {"independent": "independent errors", "common": "with the covariance"}
    return f"{words[target]}, {rung.candidate.bands}"


def optimum_table(draws: Sequence[Draws]) -> Table:
    """Return how far each chosen design can move, given what is known of the parameters."""
    rows: list[tuple[Cell, ...]] = []
    for drawn in draws:
        for preference in PREFERENCES:
            cells: list[Cell] = []
            for name, _ in QUANTITIES:
                values = drawn.optima[f"{name}_{preference}"]
                cells += [*map(float, np.percentile(values, RANGE))]
            rows.append((title(drawn.target, drawn.rung), preference.replace("_", " "), *cells))
    columns = [Column("posterior"), Column("preference")]
    for name, unit in QUANTITIES:
        group = name if unit else f"{name} / nominal"
        columns += [Column("from", unit, 4, group), Column("to", unit, 4, group)]
    return Table(
        "optimum",
        "Where the optimum can lie: 95 % ranges over the posterior",
        tuple(columns),
        tuple(rows),
        findings=tuple(
            finding for drawn in draws for finding in (_movement(drawn), _settled(drawn))
        ),
        note="Each draw of the parameters has its own surrogate and its own front over the box; "
        "designs on a grid of 17 values for each variable, B_in being without influence. A uniform "
        "prior within the ranges that were searched.",
    )


def _movement(drawn: Draws) -> Finding:
    mean, std, stiffness, inertia, damping = balanced_ranges(drawn)
    widest = max(np.ptp(values) for values in (stiffness, inertia, damping))
    return Finding(
        bool(widest <= BOX),
        f"Posterior {title(drawn.target, drawn.rung)}: the balanced optimum has a mean of "
        f"{mean[0]:.1f} to {mean[1]:.1f} and a standard deviation of {std[0]:.1f} to {std[1]:.1f} "
        f"arcsec; K at {stiffness[0]:.2f} to {stiffness[1]:.2f}, J_in at {inertia[0]:.2f} to "
        f"{inertia[1]:.2f} and B_fc at {damping[0]:.2f} to {damping[1]:.2f} of the nominal "
        f"(95 %); {significant(100.0 * widest / (2.0 * BOX), 2)} % of the box in the variable that "
        "is known least.",
        check=True,
    )


def balanced_ranges(drawn: Draws) -> list[NDArray[np.float64]]:
    """Return the 95 % ranges of `QUANTITIES` of the balanced optimum, (2,) each."""
    return [np.percentile(drawn.optima[f"{name}_balanced"], RANGE) for name, _ in QUANTITIES]


def shift(drawn: Draws) -> float:
    """Return the largest shift of a median between the halves of a chain, in standard deviations.

    Of all that would be chosen; draws stand in the order of the chain's steps.
    """
    half = len(drawn.deviance) // 2
    return max(
        float(abs(np.median(values[half:]) - np.median(values[:half])) / values.std())
        for values in drawn.optima.values()
        if values.std() > 0.0
    )


def _settled(drawn: Draws) -> Finding:
    return Finding(
        shift(drawn) <= SETTLED,
        f"Posterior {title(drawn.target, drawn.rung)}: between the halves of the chain, medians of "
        f"what would be chosen shift by up to {significant(shift(drawn), 2)} of their standard "
        f"deviation; where it is more than {SETTLED:g}, the chain is too short, and its ranges are "
        "rough.",
        check=True,
    )


def parameter_table(
    fits: Sequence[Fit], draws: Sequence[Draws], profiled: Sequence[Profiled]
) -> Table:
    """Return best value, profile interval and posterior range of each parameter."""
    rows: list[tuple[Cell, ...]] = []
    for drawn, curves in zip(draws, profiled, strict=True):
        best = _fit_of(fits, drawn)
        for name, values in drawn.parameters.items():
            low, high = np.percentile(_unwrapped(name, values, best.parameters[name]), RANGE)
            rows.append(
                (
                    title(drawn.target, drawn.rung),
                    name.replace("_", " "),
                    best.parameters[name],
                    *interval(name, curves.curves[name]),
                    float(low),
                    float(high),
                )
            )
    columns = (
        Column("posterior"),
        Column("parameter"),
        Column("best", "", 4),
        Column("from", "", 3, "profile, 95 %"),
        Column("to", "", 3, "profile, 95 %"),
        Column("from", "", 3, "posterior, 95 %"),
        Column("to", "", 3, "posterior, 95 %"),
    )
    return Table(
        "parameters",
        "What is known of the parameters",
        columns,
        tuple(rows),
        note="SI units, radians; std of theta_s in arcsec; damping in N^2 B_fc; angles without "
        "their whole turns. A profile without an end does not reach 3.84 within three standard "
        "deviations of the curvature, or within the range that is searched. Each point of it is "
        "fitted from its neighbour in few steps, and bounds the profile from above.",
    )


def interval(name: str, curve: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Return where a profile, rows of value and deviance, crosses `BOUND`; None where it does not.

    Physical values; between two points by interpolation, from the outermost below: a point that a
    fit did not bring down bounds the profile from above alone.
    """
    above = curve[:, 1] - curve[:, 1].min() - BOUND
    within = np.flatnonzero(above < 0.0)
    ends: list[float | None] = []
    for place, beyond in ((within[0], within[0] - 1), (within[-1], within[-1] + 1)):
        if not 0 <= beyond < len(curve):
            ends.append(None)
            continue
        share = above[place] / (above[place] - above[beyond])
        value = float(curve[place, 0] + share * (curve[beyond, 0] - curve[place, 0]))
        ends.append(float(np.exp(value)) if name in LOGARITHMIC else value)
    return ends[0], ends[1]


def identity_table(fits: Sequence[Fit], draws: Sequence[Draws]) -> Table:
    """Return the curvature's singular values, and the directions that hardly count."""
    rows: list[tuple[Cell, ...]] = []
    findings = []
    for drawn in draws:
        best = _fit_of(fits, drawn)
        values, directions = singular(best)
        for place in (0, *range(len(values) - WEAKEST, len(values))):
            rows.append(
                (
                    title(drawn.target, drawn.rung),
                    place + 1,
                    float(values[place]),
                    _words(directions[place], list(best.rung.bounds)),
                )
            )
        condition = values[0] / values[-1]
        findings.append(
            Finding(
                bool(values[-1] > 1.0),
                f"Posterior {title(drawn.target, drawn.rung)}: the scaled Jacobian has a condition "
                f"of {significant(condition, 2)}; along its weakest direction, "
                f"{_words(directions[-1], list(best.rung.bounds))}, the whole range changes the "
                f"numbers by {significant(values[-1], 2)} standard errors to first order.",
                check=True,
            )
        )
    columns = (
        Column("posterior"),
        Column("direction", "", 2),
        Column("standard errors per range", "", 3),
        Column("made of"),
    )
    return Table(
        "identifiability",
        "Directions of the parameters that the numbers see most and least",
        columns,
        tuple(rows),
        findings=tuple(findings),
        note="Singular values of the Jacobian of the whitened numbers at the best place, each "
        "parameter scaled by its range; shares of a direction below 0.3 are left out.",
    )


def singular(fit: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return singular values, falling, and directions, a row each, of the nine numbers."""
    low, high = fit.rung.limits

    def numbers(place: NDArray[np.float64]) -> NDArray[np.float64]:
        return residuals_of(fit.rung, fit.target, place)[:9]

    jacobian = scaled_jacobian(numbers, fit.rung.searched(fit.parameters), high - low)
    _, values, directions = np.linalg.svd(jacobian)
    return values, directions


def _fit_of(fits: Sequence[Fit], drawn: Draws) -> Fit:
    (matching,) = (fit for fit in fits if (fit.target, fit.rung) == (drawn.target, drawn.rung))
    return matching


def _unwrapped(name: str, values: NDArray[np.float64], centre: float) -> NDArray[np.float64]:
    """Return angles within half a turn of the best one."""
    if name not in PERIODIC:
        return values
    return centre + (values - centre + np.pi) % (2.0 * np.pi) - np.pi


def _words(direction: NDArray[np.float64], names: Sequence[str]) -> str:
    order = np.argsort(-np.abs(direction))
    sign = np.sign(direction[order[0]])
    return ", ".join(
        f"{names[place].replace('_', ' ')} {sign * direction[place]:+.2f}"
        for place in order
        if abs(direction[place]) >= 0.3
    )
