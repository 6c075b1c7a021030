"""Whether a fit gives the published trade-off: the steps between the optima, and their depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from experiments.paper.inference.data import Fit
from experiments.paper.inference.likelihood import (
    BAND,
    BOX,
    DEPTH_TOLERANCE,
    FITTED,
    FRONT_WIDTHS,
    OBSERVED,
    READING,
    Evaluation,
)
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.node_noise import grid_influence
from experiments.paper.inference.rungs import RIGID, Rung
from experiments.paper.inference.search import BASIN
from experiments.published_values import TABLE_9
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia

PER_AXIS = 5
"""Designs on each axis of the box: K, J_in, B_in and B_fc. Noise makes B_in matter, too."""
DRAWN = 400
SEED = 3
RANGE = (2.5, 97.5)
"""Percentiles of a 95 % range."""
FEATURES = ("width of the mean", "width of the std", *(f"K {name}" for name in PREFERENCES))
"""Of a front, arcsec, and of the three designs chosen from it, as a share of the nominal K."""


@dataclass(frozen=True)
class NoisyChoice:
    """Ranges of `FEATURES` over noise polynomials, (5, 2), and the published values, (5,)."""

    ranges: NDArray[np.float64]
    published: NDArray[np.float64]

    @property
    def holds_the_published(self) -> bool:
        """Whether every published value lies within its range."""
        low, high = self.ranges.T
        return bool(np.all((low <= self.published) & (self.published <= high)))


def noisy_choice(
    rung: Rung, parameters: dict[str, float], node_noise: float, n: int = DRAWN
) -> NoisyChoice:
    """Return what preferences choose under n noise polynomials of this size in arcsec."""
    surrogate = TensorSurrogate.fit(rung, parameters)
    nominal = surrogate.model.nominal[1:]
    shares = 1.0 + np.linspace(-BOX, BOX, PER_AXIS)
    grid = np.stack(np.meshgrid(*[shares] * len(nominal), indexing="ij"), axis=-1)
    designs = grid.reshape(-1, len(nominal))
    influence = grid_influence(surrogate, nominal * designs, BAND)
    noise = node_noise * np.random.default_rng(SEED).standard_normal(
        (n, influence.of_means.shape[1])
    )
    objectives = np.stack(
        [
            influence.means + noise @ influence.of_means.T,
            influence.stds + noise @ influence.of_stds.T,
        ],
        axis=-1,
    )
    features = np.array([_features(values, designs[:, 0]) for values in objectives])
    # Rounded to four digits, one of the printed values lies outside the box.
    stiffness = [min(TABLE_9[name][0] / nominal[0], 1.0 + BOX) for name in PREFERENCES]
    published = np.array([*FRONT_WIDTHS, *stiffness])
    return NoisyChoice(np.percentile(features, RANGE, axis=0).T, published)


def _features(
    objectives: NDArray[np.float64], stiffness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `FEATURES` of designs with objectives (n, 2) and shares of the nominal K, (n,)."""
    order = np.lexsort((objectives[:, 1], objectives[:, 0]))
    lowest = np.minimum.accumulate(objectives[order, 1])
    front = order[np.concatenate([[True], objectives[order[1:], 1] < lowest[:-1]])]
    chosen = [
        front[WeightedUtopia(weights).do(objectives[front])] for weights in PREFERENCES.values()
    ]
    start, end = objectives[chosen[0]], objectives[chosen[-1]]
    return np.array([end[0] - start[0], start[1] - end[1], *stiffness[chosen]])


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
    (independent,) = (fit for fit in fits if fit.target == "independent")
    plain = [fit for fit in fits if fit.target == "common" and not fit.rung.closures]
    closed = [fit for fit in fits if fit.target == "common" and fit.rung.closures]
    front = [fit for fit in fits if fit.target == "front"]
    same = next(fit for fit in plain if fit.rung == independent.rung)

    def best(group: Sequence[Fit]) -> Fit:
        return min(group, key=lambda fit: fit.deviance)

    return [
        Named(f"as {PRESET}: numbers taken as independent", independent),
        Named("the same model, with the covariance", same),
        Named("best of the ladder, with the covariance", best(plain)),
        Named("best with closures, with the covariance", best(closed)),
        Named("best where optima shall not be dominated", best(front)),
    ]


def noisy_fits(fits: Sequence[Fit]) -> list[Named]:
    """Return the fits that stand for the outcome with node noise: the rigid one and the best."""
    noisy = with_noise(fits)
    return [
        Named("rigid drive with a share of torsion, with node noise", rigid(noisy)),
        Named("likeliest by BIC, with node noise", noisy[0]),
    ]


def without_noise(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits in whose likelihood the nodes are free of noise."""
    return [fit for fit in fits if fit.target != "noise"]


def with_noise(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits with node noise of unknown size, the likeliest by BIC first."""
    return sorted((fit for fit in fits if fit.target == "noise"), key=lambda fit: fit.bic)


def rigid(fits: Sequence[Fit]) -> Fit:
    """Return the likeliest of the fits of a rigid drive with a share of torsion, and no more."""
    alike = [fit for fit in fits if not fit.rung.candidate.effects and fit.rung.closures == RIGID]
    return min(alike, key=lambda fit: fit.bic)


def choice_of(fit: Fit) -> NoisyChoice:
    """Return what the node noise of a fit lets one choose."""
    return _choice(fit.rung, tuple(fit.parameters.items()), fit.node_noise)


@cache
def _choice(rung: Rung, parameters: tuple[tuple[str, float], ...], noise: float) -> NoisyChoice:
    return noisy_choice(rung, dict(parameters), noise)


def steps_of(predicted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return mean and std, step by step, of predictions (9,); shape (4,)."""
    return _difference() @ predicted


def step_errors(
    evaluation: Evaluation, sampling_alone: bool = False, node_noise: float = 0.0
) -> NDArray[np.float64]:
    """Return by how many standard errors each step misses the printed one, shape (4,).

    With ``sampling_alone`` without `READING`, what the text leaves open. ``node_noise`` is that of
    the surrogate's runs, arcsec.
    """
    error = uncertainty_of_steps(evaluation, sampling_alone, node_noise)
    return np.asarray((steps_of(evaluation.predicted) - steps_of(OBSERVED)) / error)


def uncertainty_of_steps(
    evaluation: Evaluation, sampling_alone: bool = False, node_noise: float = 0.0
) -> NDArray[np.float64]:
    """Return the standard errors of the steps, arcsec, shape (4,), as `step_errors` takes them."""
    contrast = _difference()
    variance = np.diag(contrast @ evaluation.covariance_with(node_noise) @ contrast.T)
    # Each step is the difference of two numbers.
    return np.asarray(np.sqrt(variance - (2.0 * READING**2 if sampling_alone else 0.0)))


def noise_that_excuses(evaluation: Evaluation) -> NDArray[np.float64]:
    """Return the least node noise with which each step misses by `WITHIN` at most, arcsec, (4,)."""
    misses = steps_of(evaluation.predicted) - steps_of(OBSERVED)
    without, unit = (uncertainty_of_steps(evaluation, node_noise=size) ** 2 for size in (0.0, 1.0))
    lacking = (misses / WITHIN) ** 2 - without
    return np.asarray(np.sqrt(np.maximum(lacking, 0.0) / (unit - without)))


def gives_trade_off(fit: Fit) -> bool:
    """Whether all four steps and the nine numbers are met."""
    evaluation = fit.evaluation
    target = "noise" if fit.target == "noise" else "common"
    likely = chi2.sf(evaluation.chi_square(target), len(OBSERVED)) > SIGNIFICANT
    errors = step_errors(evaluation, node_noise=fit.node_noise)
    return bool(likely and np.all(np.abs(errors) <= WITHIN))


def undominated(fit: Fit) -> bool:
    """Whether no design of the box dominates a published optimum.

    Where the nodes carry noise, the front of the model itself says little: then, whether the
    published front and stiffnesses lie within the spread of what would be chosen (`choice_of`).
    """
    if fit.node_noise > READING:
        return choice_of(fit).holds_the_published
    return bool(fit.evaluation.depths.max() <= DEPTH_TOLERANCE)


def above_a_special_case(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits whose search ended above a model that theirs contains: it fell short."""
    return [
        fit
        for fit in fits
        if any(
            rival.target == fit.target
            and _contains(fit.rung, rival.rung)
            and rival.deviance + BASIN < fit.deviance
            for rival in fits
        )
    ]


def _contains(rung: Rung, rival: Rung) -> bool:
    wide, special = rung.candidate, rival.candidate
    return (
        (wide.reading, wide.bands) == (special.reading, special.bands)
        and set(wide.effects) >= set(special.effects)
        and set(rung.closures) >= set(rival.closures)
    )


def gives_both(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits that give the trade-off and leave the optima undominated."""
    return [fit for fit in fits if gives_trade_off(fit) and undominated(fit)]


def describe(rung: Rung) -> str:
    """Return a rung in words."""
    effects = ", ".join(name.replace("_", " ") for name in rung.candidate.effects) or "no effect"
    closures = f" with {', '.join(rung.closures)}" if rung.closures else ""
    reading = rung.candidate.reading.replace("_", " ")
    return f"{effects}{closures}; theta_s as {reading}, bands {rung.candidate.bands}"


def _difference() -> NDArray[np.float64]:
    """Return the matrix from the nine numbers to the steps, means first, shape (4, 9)."""
    rows = np.zeros((4, len(FITTED)))
    for place, (moment, (start, end)) in enumerate(
        (moment, step) for moment in ("mean", "std") for step in STEPS
    ):
        rows[place, FITTED.index(f"{moment}_{start}")] = -1.0
        rows[place, FITTED.index(f"{moment}_{end}")] = 1.0
    return rows
