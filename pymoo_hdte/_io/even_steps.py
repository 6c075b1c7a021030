"""Rows at uneven times brought to even steps.

Either the time stamps are right and the rows were taken unevenly, or the rows were taken evenly and
the stamps are late by what a network or an operating system needed. The rows tell: at right times
each follows smoothly from its neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.ndimage import minimum_filter1d

Values = NDArray[np.float64]

STEP_SPREAD = 0.01
"""Largest relative deviation of even time steps from their median and from their mean."""
LONGEST_STEP = 5.0
"""In mean steps. Motion is used up to ten rows in a period at most, which has two rows left then:
the fewest that determine it (Shannon, Proc. IRE 37, 1949)."""
_NEAREST = 0.5
"""Least distance of rows, in mean steps: nearer ones make a slope out of noise."""
_CLEARLY = 0.8
"""Ratio of roughness below which an even clock is believed instead of the stamps. Of white noise,
which tells nothing of either, it was lower in fewer than 3 of 1000 simulated draws of 16 rows at
steps of half to one and a half, or of a half and an exponential rest; of 64 rows it was 0.89 there.
Stamps that are believed although they are late add less than a quarter to the noise: 1 / 0.8."""
_SETTLES = 9
"""Rows within which a late stamp is followed by one that is in time."""
_SLOPE = 50
"""Rows over which the tick of a clock is guessed, so that jitter is divided by their number."""
_OFF, _FINE = 2e-3, 8
"""Relative error that the guess may have, and steps of the search per step of a spectrum."""
_ROWS_AT_START, _GROWTH = 1000, 8
"""Rows with which the search begins, and the factor by which each next search has more."""


@dataclass(frozen=True, eq=False)
class EvenRows:
    """Signals at even steps.

    Attributes
    ----------
    time : ndarray, shape (n,)
        s.
    signals : dict of str to ndarray, shape (n,)
    remark : str
        What was done, in one or two sentences.
    interpolated : bool
        Whether rows stand where none was measured.
    """

    time: Values
    signals: dict[str, Values]
    remark: str
    interpolated: bool


def is_even(time: Values) -> bool:
    """Tell whether all steps of times, shape (n,), are within 1 % of the median and the mean."""
    steps = np.diff(time)
    usual = float(np.median(steps)), float(np.mean(steps))
    return all(bool(np.all(np.abs(steps - typical) < STEP_SPREAD * typical)) for typical in usual)


def even_steps(time: Values, signals: dict[str, Values]) -> EvenRows:
    """Return signals at even steps, on a cubic spline through the rows.

    The error of the spline is about a thousandth of a motion that has ten rows in a period, for
    steps within 50 % of the mean; with three it is a fifth.

    Parameters
    ----------
    time : ndarray, shape (n,)
        s, rising; at least five.
    signals : dict of str to ndarray, shape (n,)

    Returns
    -------
    EvenRows
        As many rows as there were, or as the clock ticked.
    """
    steps = np.diff(time)
    step, instants, usable = float(np.mean(steps)), time, _apart(time)
    interpolated = True
    remark = (
        f"Time stamps are uneven, with steps of {_ms(steps.min())} to {_ms(steps.max())}. "
        "All signals are taken "
    )
    clock, tick = _clock(time)
    if _rougher(clock, time, signals) < _CLEARLY:
        step, instants, usable = tick, clock, np.ones(len(time), dtype=bool)
        lost = round((clock[-1] - clock[0]) / tick) + 1 - len(clock)
        interpolated = lost > 0
        remark += (
            f"as sampled evenly, every {_ms(tick)}, and the stamps as late: the signals are "
            f"smoother so. Rows that were lost and are interpolated: {lost}."
        )
    else:
        dropped = int(np.count_nonzero(~usable))
        remark += f"at even steps of {_ms(step)}, on a cubic spline through the rows."
        remark += f" Rows too near to the one before are left out: {dropped}." if dropped else ""
    count = int((instants[usable][-1] - instants[0]) / step + 1e-6) + 1
    even = instants[0] + step * np.arange(count)
    values = np.array([signal[usable] for signal in signals.values()]).T
    resampled = make_interp_spline(instants[usable], values, 3)(even)
    if interpolated:
        remark += f" Motion is known up to {0.1 / step:.4g} Hz: ten rows in a period."
    return EvenRows(even, dict(zip(signals, resampled.T, strict=True)), remark, interpolated)


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms"


def _apart(time: Values) -> NDArray[np.bool_]:
    """Return which rows are far enough from the last usable row before them, shape (n,)."""
    least, previous = _NEAREST * float(np.mean(np.diff(time))), -np.inf
    apart = np.ones(len(time), dtype=bool)
    for row, moment in enumerate(time.tolist()):
        apart[row] = moment - previous >= least
        previous = moment if apart[row] else previous
    return apart


def _clock(time: Values) -> tuple[Values, float]:
    """Return the ticks of an even clock to which stamps belong, shape (n,), and its step, s.

    A late stamp is followed by one in time, while after a lost row all are later.
    """
    reach = min(_SLOPE, len(time) - 1)
    rate = reach / float(np.median(time[reach:] - time[:-reach]))
    off, rows, line = _OFF, min(_ROWS_AT_START, len(time)), 1.0 + 0.0j
    while True:
        # Stamps of a clock have a line in their spectrum, whatever rows are lost.
        since = time[:rows] - time[0]
        fine = 1.0 / (_FINE * since[-1])
        rates = rate + fine * np.arange(-(reach := int(off * rate / fine) + 1), reach + 1)
        lines = [complex(np.mean(np.exp(2j * np.pi * frequency * since))) for frequency in rates]
        best = int(np.argmax(np.abs(lines)))
        rate, line = float(rates[best]), lines[best]
        if rows == len(time):
            break
        off, rows = 1.0 / rows, min(_GROWTH * rows, len(time))
    tick = 1.0 / rate
    start = time[0] + tick * float(np.angle(line)) / (2.0 * np.pi)
    late = time - start - tick * np.arange(len(time))
    # The least of the rows to come.
    least = minimum_filter1d(late, _SETTLES, origin=-(_SETTLES // 2))
    ticks = np.arange(len(time)) + np.maximum.accumulate(np.round(least / tick))
    return start + tick * ticks, tick


def _rougher(clock: Values, stamps: Values, signals: dict[str, Values]) -> float:
    """Return by how much rougher signals are at ticks than at stamps, the mean of logarithms."""
    ratios = [
        np.log(_roughness(clock, signal) / _roughness(stamps, signal))
        for signal in signals.values()
        if np.ptp(signal) > 0.0
    ]
    return float(np.exp(np.mean(ratios))) if ratios else 1.0


def _roughness(time: Values, signal: Values) -> float:
    """Return the error with which four neighbours predict a row, root mean square.

    By the cubic through them, in units in which white noise has an error of its own size wherever
    the rows are.
    """
    neighbours = [np.roll(time, shift)[2:-2] for shift in (2, 1, -1, -2)]
    here, error, power = time[2:-2], -signal[2:-2], 1.0
    for shift, own in zip((2, 1, -1, -2), neighbours, strict=True):
        others = [neighbour for neighbour in neighbours if neighbour is not own]
        weight = np.prod([(here - neighbour) / (own - neighbour) for neighbour in others], axis=0)
        error, power = error + weight * np.roll(signal, shift)[2:-2], power + weight**2
    # Never zero, so that ratios are numbers.
    return float(np.sqrt(np.mean(error**2 / power))) + 1e-12 * float(np.ptp(signal))
