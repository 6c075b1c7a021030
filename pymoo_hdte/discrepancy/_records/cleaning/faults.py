"""Spikes and jumps in one channel: rows that depart from their neighbours as no motion does.

What is looked at is the residual of the order lines. It may hold motion that the lines do not
describe, such as a vibration of fixed frequency; so a fault has to stand out of whatever else the
residual does, not only of the noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from pymoo_hdte.discrepancy._records.line_basis import LineFit
from pymoo_hdte.discrepancy._selection.rules import Rules

Rows = NDArray[np.float64]

# Shapes of the statistics; what they are compared with are rules.
_BESIDE = 5
"""Rows on either side of a row whose median it is compared with; a spike may have two of them."""

WINDOWS = (4, 16, 64)
"""Rows before and after a jump that are compared: for jumps down to 5, 2.3, and 1.1 deviations."""

_WIDE = 256
"""Rows before and after what may be a jump in the whole record: a ramp is none."""

_LEAST_ROWS = 16
"""Least number of rows before and after a jump."""

_WINDOWS_IN_RECORD = 30
"""Least number of windows (before and after) in a record, for the scatter of the comparison."""

_DEVIATION = 1.4826
"""Standard deviation of a normal variable over the median of its absolute value."""


class Step(NamedTuple):
    """A jump that may be one: its first row, its size, and how far it stands out."""

    row: int
    size: float
    deviations: float


class Lines:
    """What order lines leave of a step of one from a row to the end, for every row.

    Block by block, as `LineFit` has them.

    Parameters
    ----------
    fit : LineFit

    Attributes
    ----------
    lengths : ndarray, shape (n,)
        Square of the length of what is left.
    """

    def __init__(self, fit: LineFit) -> None:
        self.fit, self.lengths = fit, np.arange(len(fit.record.time), 0.0, -1.0)
        later = np.zeros(len(fit.triangle))
        for part in reversed(fit.parts):
            shares = later + np.cumsum(fit.basis(part)[::-1], axis=0)[::-1]
            self.lengths[part] -= np.einsum("np,np->n", shares, shares)
            later = shares[0]

    def left_of_step(self, row: int) -> Rows:
        """Return what is left of the step from a row, shape (n,)."""
        left = np.zeros(len(self.lengths))
        left[row:] = 1.0
        share = sum(self.fit.basis(part).T @ left[part] for part in self.fit.parts)
        for part in self.fit.parts:
            left[part] -= self.fit.basis(part) @ share
        return left


def scatter(rows: Rows) -> float:
    """Return the standard deviation of the noise of rows (n,) by their differences, robustly."""
    return float(_DEVIATION / np.sqrt(2.0) * np.median(np.abs(np.diff(rows))))


def spikes(residual: Rows, deviations: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which rows are spikes, shape (n,).

    A spike departs to the same side from the medians of the rows before and of those after it: the
    rows on both sides of a jump are no spikes.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    deviations : float
        Least departure, in standard deviations of the usual one.
    rules : Rules
    """
    median = median_filter(residual, _BESIDE, mode="nearest")
    far = _BESIDE // 2 + 1
    after, before = residual.copy(), residual.copy()
    after[:-far] -= median[far:]
    before[far:] -= median[:-far]
    return _outstanding(before, after, deviations, rules)


def spikes_on_course(values: Rows, deviations: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which rows of a channel that rises and falls are spikes, shape (n,).

    As `spikes`, but compared with straight lines through the rows before and after: the row of a
    turning point lies on both. Not at the ends, where a clearance may begin or end.
    """
    place = np.arange(-_BESIDE, 0.0)
    middle = place.mean()
    weights = 1.0 / _BESIDE - middle * (place - middle) / np.sum((place - middle) ** 2)
    before, after = values.copy(), values.copy()
    before[_BESIDE:] -= np.correlate(values, weights, mode="valid")[:-1]
    after[:-_BESIDE] -= np.correlate(values, weights[::-1], mode="valid")[1:]
    found = _outstanding(before, after, deviations, rules)
    found[:_BESIDE] = found[-_BESIDE:] = False
    return found


def _outstanding(before: Rows, after: Rows, deviations: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which rows depart to the same side from those before and from those after them.

    At the ends there are rows on one side only; there a spike has to stand out of all departures
    from the rows before.
    """
    usual = _DEVIATION * float(np.median(np.abs(before)))
    departs = np.where(after * before > 0.0, np.minimum(np.abs(after), np.abs(before)), 0.0)
    limits = np.full(len(departs), max(deviations * usual, _common(departs, rules)))
    ends = np.r_[:_BESIDE, len(departs) - _BESIDE : len(departs)]
    departs[:_BESIDE], departs[-_BESIDE:] = np.abs(after[:_BESIDE]), np.abs(before[-_BESIDE:])
    limits[ends] = max(deviations * usual, _common(np.abs(before[_BESIDE:]), rules))
    found = departs > limits
    return found & (usual > 0.0) & (_run_lengths(found) <= rules.longest_spike)


def _common(departs: Rows, rules: Rules) -> float:
    """Return what a spike has to exceed beside as many departures as are no spikes any more."""
    most = max(1, int(rules.spike_share * len(departs)))
    return rules.fault_prominence * float(np.partition(departs, -1 - most)[-1 - most])


def _run_lengths(flags: NDArray[np.bool_]) -> NDArray[np.int_]:
    """Return for each row the number of equal flags in a row that it belongs to."""
    first = np.flatnonzero(np.r_[True, flags[1:] != flags[:-1]])
    lengths = np.diff(np.r_[first, len(flags)])
    return np.repeat(lengths, lengths)


def step(residual: Rows, lines: Lines, deviations: float, rules: Rules) -> Step | None:
    """Return the clearest jump, or None.

    Rows before and after are compared in windows, beside a straight line, and in the whole record,
    beside everything that the lines could make of the jump.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    lines : Lines
        That were taken out.
    deviations : float
        Least size in standard deviations of its own.
    rules : Rules
    """
    noise = scatter(residual)
    if noise == 0.0:
        return None
    found = [_step_in_windows(residual, noise, half, deviations, rules) for half in WINDOWS]
    found.append(_step_in_record(residual, noise, lines, deviations, rules))
    return max((one for one in found if one), key=lambda one: one.deviations, default=None)


def _step_in_windows(
    residual: Rows, noise: float, half: int, deviations: float, rules: Rules
) -> Step | None:
    """Return the clearest jump in windows of ``half`` rows before and as many after."""
    if len(residual) < 2 * half * _WINDOWS_IN_RECORD:
        return None
    contrast, deviation = _contrast(half)
    sizes = np.correlate(residual, contrast, mode="valid")
    # Nearer to an end than this there are too few rows to tell a jump from a disturbance.
    edge = max(_LEAST_ROWS - half, 0)
    sizes[:edge] = sizes[len(sizes) - edge :] = 0.0
    heights = np.abs(sizes)
    of_noise = deviation * noise
    if not heights.max() > deviations * of_noise:
        return None
    usual = max(of_noise, _DEVIATION * float(np.median(heights)))
    peaks = _peaks(heights, rules.most_jumps + 1, 2 * half)
    common = float(heights[peaks[-1]]) if len(peaks) > rules.most_jumps else 0.0
    size = float(sizes[peaks[0]])
    if not abs(size) > max(deviations * usual, rules.fault_prominence * common):
        return None
    row = int(peaks[0]) + half
    if not _abrupt(residual, noise, row, size, half):
        return None
    return Step(row, size, abs(size) / usual)


def _peaks(heights: Rows, number: int, apart: int) -> list[int]:
    """Return the places of the highest values, each further than ``apart`` from those before."""
    left, found = heights.copy(), list[int]()
    while len(found) < number and np.isfinite(top := left.max()) and top >= 0.0:
        place = int(np.argmax(left))
        found.append(place)
        left[max(place - apart, 0) : place + apart + 1] = -np.inf
    return found


def _abrupt(residual: Rows, noise: float, row: int, size: float, widest: int) -> bool:
    """Return whether most of a jump happens from one row to the next, as far as noise shows it."""
    most = min(widest, row, len(residual) - row)
    for half in {min(one, most) for one in (*WINDOWS, _WIDE)}:
        contrast, deviation = _contrast(half)
        near = float(contrast @ residual[row - half : row + half])
        if abs(near - size) > 0.5 * abs(size) + 3.0 * deviation * noise:
            return False
    return True


def _contrast(half: int) -> tuple[Rows, float]:
    """Return weights of ``half`` rows before and after a step that give its size.

    Straight lines give zero. The second value is the standard deviation that white noise of one
    gives to the size.
    """
    place = np.arange(2 * half) - (half - 0.5)
    sides = np.sign(place)
    rest = sides - place * (sides @ place) / (place @ place)
    power = float(rest @ rest)
    return 2.0 * rest / power, 2.0 / np.sqrt(power)


def _step_in_record(
    residual: Rows, noise: float, lines: Lines, deviations: float, rules: Rules
) -> Step | None:
    """Return the jump that explains most of a residual, if hardly anything else is left then."""
    lengths = lines.lengths
    known = lengths > 1.0
    known[:_LEAST_ROWS] = known[len(known) - _LEAST_ROWS + 1 :] = False
    if not known.any():
        return None
    strength = _strength(residual, lengths, known) / noise
    row = int(np.argmax(np.abs(strength)))
    clear = abs(float(strength[row]))
    if not clear > deviations:
        return None
    size = float(strength[row] * noise / np.sqrt(lengths[row]))
    rest = residual - size * lines.left_of_step(row)
    left = float(np.abs(_strength(rest, lengths, known)).max()) / noise
    alone = clear > rules.fault_prominence * left
    return Step(row, size, clear) if alone and _abrupt(residual, noise, row, size, _WIDE) else None


def _strength(residual: Rows, lengths: Rows, known: NDArray[np.bool_]) -> Rows:
    """Return how strongly a residual speaks for a step at each row; white noise gives its own."""
    sums = np.cumsum(residual[::-1])[::-1]
    return np.where(known, sums, 0.0) / np.sqrt(np.where(known, lengths, 1.0))
