"""Whether a fit gives the published trade-off: the steps between the optima, and their depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from experiments.paper.inference.data import Fit
from experiments.paper.inference.likelihood import (
    DEPTH_TOLERANCE,
    FITTED,
    OBSERVED,
    READING,
    Evaluation,
)
from experiments.paper.inference.rungs import Rung
from experiments.paper.inference.search import BASIN

STEPS = (
    ("accuracy_first", "balanced"),
    ("balanced", "robustness_first"),
)
WITHIN = 2.0
"""Standard errors by which a step may differ from the printed one."""
SIGNIFICANT = 0.05
"""Least probability of so large a chi-square, of nine numbers as if no parameter were open: whoever
fails it misses the numbers however many parameters are counted."""
PRESET = "calibrated"


@dataclass(frozen=True)
class Named:
    """A fit and what to call it."""

    label: str
    fit: Fit


def chosen_fits(fits: Sequence[Fit]) -> list[Named]:
    """Return the fits that stand for the outcome: `PRESET`'s kind, and the best of each target."""
    (independent,) = (one for one in fits if one.target == "independent")
    plain = [one for one in fits if one.target == "common" and not one.rung.closures]
    closed = [one for one in fits if one.target == "common" and one.rung.closures]
    front = [one for one in fits if one.target == "front"]
    same = next(one for one in plain if one.rung == independent.rung)

    def best(group: Sequence[Fit]) -> Fit:
        return min(group, key=lambda one: one.deviance)

    return [
        Named(f"as {PRESET}: numbers taken as independent", independent),
        Named("the same model, with the covariance", same),
        Named("best of the ladder, with the covariance", best(plain)),
        Named("best with closures, with the covariance", best(closed)),
        Named("best where optima shall not be dominated", best(front)),
    ]


def steps_of(predicted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return mean and std, step by step, of predictions (9,); shape (4,)."""
    return _difference() @ predicted


def step_errors(found: Evaluation, sampling_alone: bool = False) -> NDArray[np.float64]:
    """Return by how many standard errors each step misses the printed one, shape (4,).

    With ``sampling_alone`` without `READING`, what the text leaves open.
    """
    contrast = _difference()
    error = np.sqrt(
        np.diag(contrast @ found.covariance @ contrast.T)
        # Each step is the difference of two numbers.
        - (2.0 * READING**2 if sampling_alone else 0.0)
    )
    return np.asarray((steps_of(found.predicted) - steps_of(OBSERVED)) / error)


def gives_trade_off(fit: Fit) -> bool:
    """Whether all four steps and the nine numbers are met."""
    found = fit.evaluation
    likely = chi2.sf(found.chi_square("common"), len(OBSERVED)) > SIGNIFICANT
    return bool(likely and np.all(np.abs(step_errors(found)) <= WITHIN))


def undominated(fit: Fit) -> bool:
    """Whether no design of the box dominates a published optimum."""
    return bool(fit.evaluation.depths.max() <= DEPTH_TOLERANCE)


def above_a_special_case(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits whose search ended above a model that theirs contains: it fell short."""
    return [
        one
        for one in fits
        if any(
            other.target == one.target
            and _contains(one.rung, other.rung)
            and other.deviance + BASIN < one.deviance
            for other in fits
        )
    ]


def _contains(one: Rung, other: Rung) -> bool:
    wide, special = one.candidate, other.candidate
    return (
        (wide.reading, wide.bands) == (special.reading, special.bands)
        and set(wide.effects) >= set(special.effects)
        and set(one.closures) >= set(other.closures)
    )


def gives_both(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits that give the trade-off and leave the optima undominated."""
    return [one for one in fits if gives_trade_off(one) and undominated(one)]


def describe(rung: Rung) -> str:
    """Return a rung in words."""
    effects = ", ".join(name.replace("_", " ") for name in rung.candidate.effects) or "no effect"
    closures = f" with {', '.join(rung.closures)}" if rung.closures else ""
    reading = rung.candidate.reading.replace("_", " ")
    return f"{effects}{closures}; theta_s as {reading}, bands {rung.candidate.bands}"


def _difference() -> NDArray[np.float64]:
    """Return the matrix from the nine numbers to the steps, means first, shape (4, 9)."""
    rows = np.zeros((4, len(FITTED)))
    for place, (moment, (first, last)) in enumerate(
        (moment, step) for moment in ("mean", "std") for step in STEPS
    ):
        rows[place, FITTED.index(f"{moment}_{first}")] = -1.0
        rows[place, FITTED.index(f"{moment}_{last}")] = 1.0
    return rows
