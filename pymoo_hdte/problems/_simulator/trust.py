"""Whether a surrogate may be trusted: otherwise the reason, and where it may not."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.around import RESOLVED
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.surrogate._sparse.adaptive import AdaptiveFit
from pymoo_hdte.surrogate._sparse.draws import draw_around, draw_designs
from pymoo_hdte.surrogate.trust import region_of

Array = NDArray[np.float64]

MOST_FAILED = 0.5
"""Largest probability of failing at a design where it is not limited: more fail than succeed."""
_LIKE_THE_WORST = 0.3
"""Share of the largest error above which a point belongs to the region of the error."""
_OF_ACCURACY = 0.1
"""Share of the requested accuracy up to which runs may differ, by rounding or iteration."""
_REPEATED = 3
"""Runs at one point. Two of a random simulator may agree by chance, three hardly."""
_LOOKED_AT = 1024
"""Designs, with two draws of the scatter each, at which the sign of a response is looked at."""

Refusal = tuple[str, float, str, dict[str, tuple[float, float]]]


def failing(inputs: Inputs, fit: AdaptiveFit) -> Refusal | None:
    """Return where runs around a design are likelier to fail than to succeed, or None.

    Its mean and deviation, of the runs that succeed, would look like those of any other design.
    """
    if fit.success is None:
        return None
    random_state = np.random.default_rng(0)
    designs = draw_designs(inputs.axes, _LOOKED_AT // 4, random_state)
    points, weights = draw_around(inputs.axes, designs, 64, random_state)
    likely = fit.success.probability(points.reshape(-1, len(inputs.axes))).reshape(weights.shape)
    share = 1.0 - np.sum(weights * likely, axis=1)
    if not (bad := share > MOST_FAILED).any():
        return None
    bounds = np.array([axis.design for axis in inputs.axes if axis.designed]).T
    region = region_of(inputs.designed, designs[bad], bounds)
    allowed = f"at most {MOST_FAILED:g} at every design, or CrashProbability() limited or minimised"
    return "probability of failing runs", float(f"{share.max():.3g}"), allowed, region


def unresolved(fit: AdaptiveFit, rarest: float) -> Refusal | None:
    """Return why a probability is too small where runs fail or are random, or None.

    Only common samples know of failures and of own scatter.
    """
    if rarest >= RESOLVED or (fit.success is None and fit.own is None):
        return None
    allowed = f"at least {RESOLVED:.4g} from 0 and from 1 for a simulator that fails or is random"
    return "probability of a statistic", rarest, allowed, {}


def largest_error(fit: AdaptiveFit, places: Sequence[int]) -> tuple[float, int, int]:
    """Return the largest error of some responses, whether of mean (0) or std (1), and of which."""
    errors = fit.errors[:, list(places)]
    which, place = np.unravel_index(np.argmax(errors), errors.shape)
    return float(errors[which, place]), int(which), places[int(place)]


def inaccurate(
    inputs: Inputs,
    fit: AdaptiveFit,
    accuracy: float,
    responses: tuple[str, ...],
    places: Sequence[int],
) -> Refusal | None:
    """Return why and where the surrogate of some responses is less accurate than requested."""
    error, which, place = largest_error(fit, places)
    if error <= accuracy:
        return None
    moment = ("mean", "standard deviation")[which]
    share = np.abs(fit.held_out_error[:, place])
    worst = fit.held_out_points[share > _LIKE_THE_WORST * np.nanmax(share)]
    region = region_of(inputs.names, inputs.values(worst), reach(inputs))
    field = f"error of the {moment} of {responses[place]!r} after {fit.n_runs} runs"
    allowed = (
        f"at most {accuracy:g} of the scatter, to be had by more runs (budget), narrower ranges or "
        "scale='log' for one over decades, or a larger accuracy"
    )
    return field, float(f"{error:.3g}"), allowed, region


def random(
    inputs: Inputs,
    fit: AdaptiveFit,
    accuracy: float,
    responses: tuple[str, ...],
    again: Callable[[tuple[float, ...]], Sequence[float] | None],
) -> Refusal | None:
    """Return why a simulator that gives two values for the same inputs is refused, or None.

    Looked at where a surrogate is refused, by three runs at one point: what differs by less than a
    tenth of the accuracy asked for, as a share of what the surrogate spreads, is not the cause.
    """
    if not len(fit.held_out_points):
        return None
    point = tuple(inputs.values(fit.held_out_points[:1])[0].tolist())
    runs = [gave for _ in range(_REPEATED) if (gave := again(point)) is not None]
    if not runs:
        return None
    spread = np.std(fit.polynomial(fit.held_out_points), axis=0)
    for name, low, high, size in zip(
        responses, np.min(runs, axis=0), np.max(runs, axis=0), spread, strict=True
    ):
        if high - low > _OF_ACCURACY * accuracy * size:
            field = f"difference between values of {name!r} with the same inputs"
            allowed = (
                f"0, not {low:.6g} and {high:.6g}: the simulator is random; fix its seed, or say "
                "replicates=2, which makes its own scatter part of mean, deviation and quantiles"
            )
            return field, float(f"{high - low:.3g}"), allowed, {}
    return None


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
