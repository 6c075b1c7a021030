"""Spikes and jumps in one channel: rows that depart from their neighbours as no motion does.

The rows are those of the order lines' residual. It may hold motion that the lines do not describe,
such as a vibration of fixed frequency, so a fault has to stand out of that as well as of the noise.
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
    """A possible jump: its first row, its size, and how far it stands out of the noise."""

    row: int
    size: float
    deviations: float


class UnitSteps:
    """Residuals of the order lines for unit steps, from any row to the end of a record.

    They are computed block by block, as in `LineFit`.

    Parameters
    ----------
    fit : LineFit

    Attributes
    ----------
    lengths : ndarray, shape (n,)
        Squared length of the residual of the step from each row.
    """

    def __init__(self, fit: LineFit) -> None:
        self.fit, self.lengths = fit, np.arange(len(fit.record.time), 0.0, -1.0)
        later = np.zeros(len(fit.triangle))
        for part in reversed(fit.parts):
            shares = later + np.cumsum(fit.basis(part)[::-1], axis=0)[::-1]
            self.lengths[part] -= np.einsum("np,np->n", shares, shares)
            later = shares[0]

    def residual_of(self, row: int) -> Rows:
        """Return the residual of the step from a row, shape (n,)."""
        beyond = np.zeros(len(self.lengths))
        beyond[row:] = 1.0
        share = sum(self.fit.basis(part).T @ beyond[part] for part in self.fit.parts)
        for part in self.fit.parts:
            beyond[part] -= self.fit.basis(part) @ share
        return beyond


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
        Least departure, in usual departures.
    rules : Rules
    """
    median = median_filter(residual, _BESIDE, mode="nearest")
    offset = _BESIDE // 2 + 1
    after, before = residual.copy(), residual.copy()
    after[:-offset] -= median[offset:]
    before[offset:] -= median[:-offset]
    return _outstanding(before, after, deviations, rules)


def spikes_on_course(values: Rows, deviations: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which rows of a channel that rises and falls are spikes, shape (n,).

    As `spikes`, but rows are compared with straight lines through the rows before and after: the
    row of a turning point lies on both. The ends are skipped, because a clearance may begin or end
    there.
    """
    place = np.arange(-_BESIDE, 0.0)
    middle = place.mean()
    weights = 1.0 / _BESIDE - middle * (place - middle) / np.sum((place - middle) ** 2)
    before, after = values.copy(), values.copy()
    before[_BESIDE:] -= np.correlate(values, weights, mode="valid")[:-1]
    after[:-_BESIDE] -= np.correlate(values, weights[::-1], mode="valid")[1:]
    flags = _outstanding(before, after, deviations, rules)
    flags[:_BESIDE] = flags[-_BESIDE:] = False
    return flags


def _outstanding(before: Rows, after: Rows, deviations: float, rules: Rules) -> NDArray[np.bool_]:
    """Return which rows depart to the same side from those before and from those after them.

    At the ends there are rows on one side only; there a spike has to stand out of all departures
    from the rows before.
    """
    usual = _DEVIATION * float(np.median(np.abs(before)))
    departs = np.where(after * before > 0.0, np.minimum(np.abs(after), np.abs(before)), 0.0)
    limits = np.full(len(departs), max(deviations * usual, _common_departure(departs, rules)))
    ends = np.r_[:_BESIDE, len(departs) - _BESIDE : len(departs)]
    departs[:_BESIDE], departs[-_BESIDE:] = np.abs(after[:_BESIDE]), np.abs(before[-_BESIDE:])
    limits[ends] = max(deviations * usual, _common_departure(np.abs(before[_BESIDE:]), rules))
    flags = departs > limits
    return flags & (usual > 0.0) & (_run_lengths(flags) <= rules.longest_spike)


def _common_departure(departs: Rows, rules: Rules) -> float:
    """Return what a spike has to exceed where that many departures are too many to be spikes."""
    most = max(1, int(rules.spike_share * len(departs)))
    return rules.fault_prominence * float(np.partition(departs, -1 - most)[-1 - most])


def _run_lengths(flags: NDArray[np.bool_]) -> NDArray[np.int_]:
    """Return for each row the number of equal flags in a row that it belongs to."""
    starts = np.flatnonzero(np.r_[True, flags[1:] != flags[:-1]])
    lengths = np.diff(np.r_[starts, len(flags)])
    return np.repeat(lengths, lengths)


def step(residual: Rows, steps: UnitSteps, deviations: float, rules: Rules) -> Step | None:
    """Return the clearest jump, or None.

    Rows before and after are compared in windows, beside a straight line, and in the whole record,
    beside everything that the lines could make of the jump.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    steps : UnitSteps
        Unit steps beside the lines that left the residual.
    deviations : float
        Least size of a jump in its standard deviations.
    rules : Rules
    """
    noise = scatter(residual)
    if noise == 0.0:
        return None
    candidates = [_step_in_windows(residual, noise, half, deviations, rules) for half in WINDOWS]
    candidates.append(_step_in_record(residual, noise, steps, deviations, rules))
    return max(
        (candidate for candidate in candidates if candidate),
        key=lambda candidate: candidate.deviations,
        default=None,
    )


def _step_in_windows(
    residual: Rows, noise: float, half: int, deviations: float, rules: Rules
) -> Step | None:
    """Return the clearest jump in windows of ``half`` rows before and as many after."""
    if len(residual) < 2 * half * _WINDOWS_IN_RECORD:
        return None
    contrast, deviation = _contrast(half)
    sizes = np.correlate(residual, contrast, mode="valid")
    # Near an end there are too few rows to tell a jump from a disturbance.
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
    remaining, places = heights.copy(), list[int]()
    while len(places) < number and np.isfinite(top := remaining.max()) and top >= 0.0:
        place = int(np.argmax(remaining))
        places.append(place)
        remaining[max(place - apart, 0) : place + apart + 1] = -np.inf
    return places


def _abrupt(residual: Rows, noise: float, row: int, size: float, widest: int) -> bool:
    """Return whether most of a jump happens from one row to the next, as far as noise shows it."""
    most = min(widest, row, len(residual) - row)
    for half in {min(rows, most) for rows in (*WINDOWS, _WIDE)}:
        contrast, deviation = _contrast(half)
        local_size = float(contrast @ residual[row - half : row + half])
        if abs(local_size - size) > 0.5 * abs(size) + 3.0 * deviation * noise:
            return False
    return True


def _contrast(half: int) -> tuple[Rows, float]:
    """Return weights of ``half`` rows before and after a step that give its size.

    Straight lines give zero. The second value is the standard deviation that white noise of one
    gives to the size.
    """
    place = np.arange(2 * half) - (half - 0.5)
    sides = np.sign(place)
    weights = sides - place * (sides @ place) / (place @ place)
    power = float(weights @ weights)
    return 2.0 * weights / power, 2.0 / np.sqrt(power)


def _step_in_record(
    residual: Rows, noise: float, steps: UnitSteps, deviations: float, rules: Rules
) -> Step | None:
    """Return the jump that explains most of a residual, if it leaves hardly anything else."""
    lengths = steps.lengths
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
    remainder = residual - size * steps.residual_of(row)
    strongest = float(np.abs(_strength(remainder, lengths, known)).max()) / noise
    alone = clear > rules.fault_prominence * strongest
    return Step(row, size, clear) if alone and _abrupt(residual, noise, row, size, _WIDE) else None


def _strength(residual: Rows, lengths: Rows, known: NDArray[np.bool_]) -> Rows:
    """Return how strongly a residual speaks for a step at each row, in units of the residual."""
    sums = np.cumsum(residual[::-1])[::-1]
    return np.where(known, sums, 0.0) / np.sqrt(np.where(known, lengths, 1.0))
