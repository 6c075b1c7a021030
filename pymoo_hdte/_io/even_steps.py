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
"""Of a time step from the median and from the mean one, relative, up to which steps are even."""
LONGEST_STEP = 5.0
"""In mean steps. Motion is used up to ten rows in a period at most, which has two rows left then:
the fewest that determine it (Shannon, Proc. IRE 37, 1949)."""
_NEAREST = 0.5
"""In steps: a row that is nearer to the one before makes a slope out of noise."""
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
"""By how much the guess may be off, relative, and steps of the search over that of a spectrum."""
_FIRST, _FURTHER = 1000, 8
"""Rows with which the search begins, and how many times as many the next one has."""


@dataclass(frozen=True, eq=False)
class EvenRows:
    """Signals at even steps.

    Attributes
    ----------
    time : ndarray, shape (n,)
        s.
    signals : dict of str to ndarray, shape (n,)
    remark : str
        What was done, in a sentence or two.
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
    return all(bool(np.all(np.abs(steps - one) < STEP_SPREAD * one)) for one in usual)


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
    step, instants, kept = float(np.mean(steps)), time, _apart(time)
    interpolated = True
    remark = (
        f"Time stamps are uneven, with steps of {_ms(steps.min())} to {_ms(steps.max())}. "
        "All signals are taken "
    )
    clock, tick = _clock(time)
    if _rougher(clock, time, signals) < _CLEARLY:
        step, instants, kept = tick, clock, np.ones(len(time), dtype=bool)
        lost = round((clock[-1] - clock[0]) / tick) + 1 - len(clock)
        interpolated = lost > 0
        remark += (
            f"as sampled evenly, every {_ms(tick)}, and the stamps as late: the signals are "
            f"smoother so. Rows that were lost and are interpolated: {lost}."
        )
    else:
        near = int(np.count_nonzero(~kept))
        remark += f"at even steps of {_ms(step)}, on a cubic spline through the rows."
        remark += f" Rows too near to the one before are left out: {near}." if near else ""
    count = int((instants[kept][-1] - instants[0]) / step + 1e-6) + 1
    even = instants[0] + step * np.arange(count)
    values = np.array([one[kept] for one in signals.values()]).T
    found = make_interp_spline(instants[kept], values, 3)(even)
    if interpolated:
        remark += f" Motion is known up to {0.1 / step:.4g} Hz: ten rows in a period."
    return EvenRows(even, dict(zip(signals, found.T, strict=True)), remark, interpolated)


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms"


def _apart(time: Values) -> NDArray[np.bool_]:
    """Return which rows are not too near to the one before that is kept, shape (n,)."""
    least, last = _NEAREST * float(np.mean(np.diff(time))), -np.inf
    kept = np.ones(len(time), dtype=bool)
    for row, moment in enumerate(time.tolist()):
        kept[row] = moment - last >= least
        last = moment if kept[row] else last
    return kept


def _clock(time: Values) -> tuple[Values, float]:
    """Return the ticks of an even clock to which stamps belong, shape (n,), and its step, s.

    A late stamp is followed by one in time, while after a lost row all are later.
    """
    reach = min(_SLOPE, len(time) - 1)
    rate = reach / float(np.median(time[reach:] - time[:-reach]))
    off, rows, line = _OFF, min(_FIRST, len(time)), 1.0 + 0.0j
    while True:
        # Stamps of a clock have a line in their spectrum, whatever rows are lost.
        since = time[:rows] - time[0]
        fine = 1.0 / (_FINE * since[-1])
        rates = rate + fine * np.arange(-(reach := int(off * rate / fine) + 1), reach + 1)
        lines = [complex(np.mean(np.exp(2j * np.pi * one * since))) for one in rates]
        best = int(np.argmax(np.abs(lines)))
        rate, line = float(rates[best]), lines[best]
        if rows == len(time):
            break
        off, rows = 1.0 / rows, min(_FURTHER * rows, len(time))
    tick = 1.0 / rate
    first = time[0] + tick * float(np.angle(line)) / (2.0 * np.pi)
    late = time - first - tick * np.arange(len(time))
    # The least of the rows to come.
    least = minimum_filter1d(late, _SETTLES, origin=-(_SETTLES // 2))
    ticks = np.arange(len(time)) + np.maximum.accumulate(np.round(least / tick))
    return first + tick * ticks, tick


def _rougher(one: Values, other: Values, signals: dict[str, Values]) -> float:
    """Return the roughness of signals at some times over that at others, mean of logarithms."""
    ratios = [
        np.log(_roughness(one, signal) / _roughness(other, signal))
        for signal in signals.values()
        if np.ptp(signal) > 0.0
    ]
    return float(np.exp(np.mean(ratios))) if ratios else 1.0


def _roughness(time: Values, signal: Values) -> float:
    """Return the error with which four neighbours predict a row, root mean square.

    By the cubic through them, in units in which white noise has an error of its own size wherever
    the rows are.
    """
    near = [np.roll(time, shift)[2:-2] for shift in (2, 1, -1, -2)]
    here, error, power = time[2:-2], -signal[2:-2], 1.0
    for shift, own in zip((2, 1, -1, -2), near, strict=True):
        others = [one for one in near if one is not own]
        weight = np.prod([(here - one) / (own - one) for one in others], axis=0)
        error, power = error + weight * np.roll(signal, shift)[2:-2], power + weight**2
    # Never zero, so that ratios are numbers.
    return float(np.sqrt(np.mean(error**2 / power))) + 1e-12 * float(np.ptp(signal))
