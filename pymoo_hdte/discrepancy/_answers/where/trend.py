"""How a misfit changes with speed and load: one regression over all records, and its words.

The misfit of a line or mean is fitted by a constant and slopes with |speed| and |load| together, so
that a plan which varies both at once does not take one for the other. The base model may have taken
up a part of the misfit as a constant, a sensor's zero for instance: then it is negative at one end
and positive at the other, and its amplitude would not show the slope. Therefore the signed misfit
is fitted, too, and used where it leaves less. What the straight line leaves beyond the noise counts
as further variance, equal in all records (Mandel and Paule, Analytical Chemistry 42, 1970), so that
the records with the least noise do not decide alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import t as student

from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]

_NEVER = 1e-12
"""Smallest share of a design's largest singular value at which its columns are independent."""


@dataclass(frozen=True)
class Trend:
    """Change of a misfit with one condition, the other at its mean.

    Attributes
    ----------
    start, end : float
        Fitted misfit at the least and at the largest condition, with its sign.
    reach : float
        Half-width of the interval of ``end - start``.
    size : float
        Root mean square misfit of all records, beside which a change has to matter.
    scatter : float
        Standard deviation, beyond the noise, of the records from the fitted plane.
    rules : Rules
        Thresholds by which it is put in words.
    """

    start: float
    end: float
    reach: float
    size: float
    scatter: float
    rules: Rules

    @property
    def kind(self) -> str:
        """``grows``, ``falls``, ``turns``, ``steady``, or ``unknown`` if the records do not tell.

        A change is stated only if it is certain and matters beside the misfit itself; that there is
        none, only if one that matters can be excluded.
        """
        low, high = abs(self.start), abs(self.end)
        change = abs(self.end - self.start)
        matters = (1.0 - 1.0 / self.rules.growth_ratio) * max(low, high, self.size)
        if change <= self.reach and change + self.reach > matters:
            return "unknown"
        if change <= matters:
            return "steady"
        if self.start * self.end < 0.0 and min(low, high) >= matters:
            return "turns"
        return "grows" if high > low else "falls"

    @property
    def scattered(self) -> bool:
        """Whether records differ by as much as a change that matters, whatever the condition."""
        return self.scatter > (1.0 - 1.0 / self.rules.growth_ratio) * self.size

    @property
    def ratio(self) -> float | None:
        """The larger end over the smaller one; None where the smaller may be zero."""
        low, high = sorted((abs(self.start), abs(self.end)))
        certain = self.start * self.end > 0.0 and low > self.reach
        return high / low if certain else None


def trends(
    misfit: NDArray[np.complex128], noise: Values, speed: Values, load: Values, rules: Rules
) -> dict[str, Trend | None]:
    """Return how a misfit changes with ``speed`` and ``load``; None for a condition not varied.

    Parameters
    ----------
    misfit : complex ndarray, shape (r,)
        Of one line or mean in every record.
    noise : ndarray, shape (r,)
        Standard deviation of its real and of its imaginary part.
    speed, load : ndarray, shape (r,)
        In any unit.
    rules : Rules

    Returns
    -------
    dict
        Where speed and load were varied only together, one entry ``speed or load``.
    """
    sizes = {"speed": np.abs(speed), "load": np.abs(load)}
    names = [name for name, size in sizes.items() if _varied(name, size, rules)]
    columns = [_scaled(sizes[name]) for name in names]
    joined = len(names) == 2 and _dependent(columns)
    if joined:
        names, columns = ["speed or load"], columns[:1]
    design = _design(columns, len(misfit))
    values = _signed(misfit, noise, design, speed, load)
    by_condition: dict[str, Trend | None] = {} if joined else dict.fromkeys(sizes)
    for place, name in enumerate(names, start=1):
        by_condition[name] = trend = _trend(values, noise, design, place, rules)
        if trend.kind == "unknown" and len(names) == 2:
            (condition,) = set(names) - {name}
            alike = _alike(condition, sizes[condition], rules)
            grouped = np.column_stack([columns[place - 1], alike])
            by_condition[name] = _trend(
                _signed(misfit, noise, grouped, speed, load), noise, grouped, 0, rules
            )
    return by_condition


def _trend(values: Values, noise: Values, design: Values, place: int, rules: Rules) -> Trend:
    """Return the change with the condition in one column of a regression."""
    freedom = len(values) - design.shape[1]
    added = _added_variance(values, design, noise, freedom) if freedom > 0 else 0.0
    slope, covariance = _regressed(values, design, noise**2 + added)
    reach = np.inf
    if freedom > 0:
        reach = student.isf(rules.growth_chance / 2.0, freedom) * covariance[place, place] ** 0.5
    column = design[:, place]
    # Conditions have the mean zero, and so has their product nearly.
    level = float(np.mean(design @ slope) - slope[place] * column.mean())
    start, end = level + slope[place] * np.array([column.min(), column.max()])
    size = float(np.sqrt(np.mean(values**2)))
    return Trend(float(start), float(end), float(reach), size, added**0.5, rules)


def _alike(name: str, size: Values, rules: Rules) -> NDArray[np.float64]:
    """Return which records have which level of a condition, 0 or 1, shape (r, levels).

    Between records of one speed, a resonance makes no difference that the load did not make.
    """
    order = np.argsort(size)
    low, high = size[order[:-1]], size[order[1:]]
    if name == "speed":
        steps = high > rules.one_speed_ratio * low
    else:
        steps = high - low > rules.one_load_range * size.max()
    level = np.empty(len(size), dtype=int)
    level[order] = np.cumsum([0, *steps])
    return np.eye(level.max() + 1)[level]


def in_words(by_condition: dict[str, Trend | None]) -> str:
    """Return in words how a misfit changes with its conditions."""
    kinds = [None if trend is None else trend.kind for trend in by_condition.values()]
    if kinds == ["steady", "steady"]:
        return "is nearly the same at all speeds and loads"
    if kinds == ["unknown", "unknown"]:
        if any(trend is not None and trend.scattered for trend in by_condition.values()):
            return "differs from record to record, but not surely with speed or load"
        return "neither grows nor falls surely with speed or load"
    return " and ".join(_clause(name, trend) for name, trend in by_condition.items())


def _clause(name: str, trend: Trend | None) -> str:
    if trend is None:
        return f"was measured at one {name} only"
    ratio = trend.ratio
    fold = "" if ratio is None or ratio > 100.0 else f" ({ratio:.2g}-fold)"
    name += ", which were varied together" if " or " in name else ""
    words = {
        "grows": f"grows with {name}{fold}",
        "falls": f"falls with {name}{fold}",
        "turns": f"changes its sign with {name}",
        "steady": f"hardly changes with {name}",
        "unknown": f"neither grows nor falls surely with {name}",
    }
    return words[trend.kind]


def _varied(name: str, size: Values, rules: Rules) -> bool:
    if name == "speed":
        return bool(size.max() > rules.one_speed_ratio * size.min())
    return bool(np.ptp(size) > rules.one_load_range * size.max())


def _scaled(size: Values) -> Values:
    """Return a condition with mean 0 and range 1."""
    return np.asarray((size - size.mean()) / np.ptp(size))


def _dependent(columns: Sequence[Values]) -> bool:
    singular = np.linalg.svd(np.column_stack(columns), compute_uv=False)
    return bool(singular[-1] <= _NEVER * singular[0])


def _design(columns: Sequence[Values], records: int) -> NDArray[np.float64]:
    """Return the columns of the regression, first a constant.

    Last, where enough records are there, the product of both conditions: a misfit proportional to
    the load may grow with speed. It is zero where either is at its mean.
    """
    columns_of_design = [np.ones(records), *columns]
    if len(columns) == 2 and records >= 2 * (len(columns_of_design) + 1):
        columns_of_design.append(columns[0] * columns[1])
    return np.column_stack(columns_of_design)


def _signed(
    misfit: NDArray[np.complex128], noise: Values, design: Values, speed: Values, load: Values
) -> Values:
    """Return the amplitudes (r,), or the misfits with signs where these are nearer to a plane.

    Signs are those along the common direction of the phasors, and, since friction turns with the
    speed and wind-up with the load, also with the sign of either or both.
    """
    power = np.abs(misfit) ** 2
    # A line of noise alone has the mean square 2 noise^2, a mean half of that.
    parts = 2.0 if np.any(misfit.imag) else 1.0
    amplitude = np.sqrt(np.clip(power - parts * noise**2, 0.0, None))
    weight = 1.0 / (noise**2 + power.mean() + np.finfo(float).tiny)
    best, least = amplitude, _residual_power(amplitude, design, weight)
    turned = misfit * np.exp(-0.5j * np.angle(np.sum(weight * misfit**2)))
    # A signed misfit has more freedom than its amplitude: it has to win by more than the noise.
    aside = float(weight @ (turned.imag**2 + noise**2))
    for sign in (1.0, np.sign(speed), np.sign(load), np.sign(speed) * np.sign(load)):
        values = sign * turned.real
        power_left = aside + _residual_power(values, design, weight)
        if power_left < least:
            best, least = values, power_left
    return np.asarray(best)


def _residual_power(values: Values, design: Values, weight: Values) -> float:
    root = np.sqrt(weight)
    slope = np.linalg.lstsq(root[:, None] * design, root * values, rcond=None)[0]
    return float(weight @ (values - design @ slope) ** 2)


def _regressed(
    values: Values, design: Values, variance: Values
) -> tuple[Values, NDArray[np.float64]]:
    """Return the coefficients and their covariance."""
    weight = 1.0 / variance
    covariance = np.linalg.pinv(design.T @ (weight[:, None] * design))
    slope = covariance @ (design.T @ (weight * values))
    return slope, np.asarray(covariance)


def _added_variance(values: Values, design: Values, noise: Values, freedom: int) -> float:
    """Return the variance that makes the weighted squares of the residuals equal their number."""

    def beyond(added: float) -> float:
        return _residual_power(values, design, 1.0 / (noise**2 + added)) - freedom

    if beyond(0.0) <= 0.0:
        return 0.0
    most = _residual_power(values, design, np.ones(len(values))) / freedom
    return float(brentq(beyond, 0.0, 1.01 * most, xtol=1e-9 * most))


def broad_band(
    misfit: NDArray[np.complex128], noise: Values
) -> tuple[NDArray[np.complex128], Values]:
    """Return amplitude and noise (r,) of all lines (r, m) of a channel together.

    The mean contribution of the noise is subtracted.
    """
    power = np.nansum(np.abs(misfit) ** 2 - 2.0 * noise**2, axis=1)
    return np.sqrt(np.clip(power, 0.0, None)) + 0j, np.sqrt(np.nansum(noise**2, axis=1))


def strongest(size: Values, channels: Sequence[int]) -> tuple[int, int]:
    """Return channel and order of the strongest cells of a map (4, 1 + m), among some channels."""
    order = np.argmax(size[list(channels)], axis=1)
    best = int(np.argmax(size[list(channels), order]))
    return channels[best], int(order[best])
