"""Whether a surrogate may be trusted: otherwise the reason, and where it may not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems.simulator.inputs import Inputs
from pymoo_hdte.surrogate.sparse.adaptive import AdaptiveFit
from pymoo_hdte.surrogate.sparse.draws import draw_around, draw_designs
from pymoo_hdte.surrogate.trust import region_of

Array = NDArray[np.float64]

MOST_FAILED = 0.2
"""Largest share of failed runs that are left out: what they would have given is extrapolated."""
_LIKE_THE_WORST = 0.3
"""Share of the largest error above which a point belongs to the region of the error."""
_LOOKED_AT = 1024
"""Designs, with two draws of the scatter each, at which the sign of a response is looked at."""

Refusal = tuple[str, float, str, dict[str, tuple[float, float]]]


def failing(inputs: Inputs, fit: AdaptiveFit) -> Refusal | None:
    """Return where the simulator fails, if it does so too often to leave the runs out, or None."""
    share = len(fit.failed) / fit.n_runs
    if share <= MOST_FAILED:
        return None
    region = region_of(inputs.names, inputs.values(fit.failed), reach(inputs))
    return "share of runs that failed", share, f"at most {MOST_FAILED:g}", region


def inaccurate(
    inputs: Inputs, fit: AdaptiveFit, accuracy: float, responses: tuple[str, ...]
) -> Refusal | None:
    """Return why and where the surrogate is less accurate than asked for, or None."""
    errors = np.array([fit.mean_error, fit.std_error])
    which, place = np.unravel_index(np.argmax(errors), errors.shape)
    if errors[which, place] <= accuracy:
        return None
    moment = ("mean", "standard deviation")[which]
    share = np.abs(fit.held_out_error[:, place])
    worst = fit.held_out_points[share > _LIKE_THE_WORST * np.nanmax(share)]
    region = region_of(inputs.names, inputs.values(worst), reach(inputs))
    field = f"error of the {moment} of {responses[place]!r} after {fit.n_runs} runs"
    allowed = f"at most {accuracy:g} of the scatter"
    return field, float(errors[which, place]), allowed, region


def positive_places(positive: Sequence[str] | bool, responses: tuple[str, ...]) -> list[int]:
    """Return the positions of the responses that cannot be negative.

    Raises
    ------
    InvalidInput
        If there is no response of such a name.
    """
    if isinstance(positive, bool):
        return list(range(len(responses))) if positive else []
    for name in positive:
        if name not in responses:
            raise InvalidInput("positive", name, f"one of {responses}")
    return [responses.index(name) for name in positive]


def negative_somewhere(inputs: Inputs, fit: AdaptiveFit, places: list[int]) -> Refusal | None:
    """Return why and where a positive response becomes negative, or None."""
    if not places:
        return None
    random_state = np.random.default_rng(0)
    designs = draw_designs(inputs.axes, _LOOKED_AT, random_state)
    draws, _ = draw_around(inputs.axes, designs, 2, random_state)
    points = draws.reshape(-1, len(inputs.axes))
    values = fit.polynomial(points)[:, places]
    if values.min() >= 0.0:
        return None
    bad = np.flatnonzero((values < 0.0).any(axis=1))
    region = region_of(inputs.names, inputs.values(points[bad]), reach(inputs))
    field = f"surrogate after {fit.n_runs} runs of a positive response"
    return field, float(values.min()), "at least 0", region


def reach(inputs: Inputs) -> Array:
    """Return the smallest and largest value of every input, shape (2, d)."""
    return np.array(list(inputs.reach().values())).T
