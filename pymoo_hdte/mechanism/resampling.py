"""Signals sampled three to ten times in a period: their noise, their band, a curve through them.

A band-limited signal is known between its samples as well (Shannon, Proc. IRE 37, 1949), while a
derivative by polynomials through neighbours needs ten samples in a period.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, periodogram, resample_poly, welch

from pymoo_hdte.mechanism.motion import noise_of
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]

COARSEST_SHARE = 1.0 / 3.0
"""Largest cutoff as a share of the sampling rate: three samples in a period. The theorem asks for
two; a filter of finite length needs the way from a third to half of the rate to fall."""
_REACH = 32
"""Number of samples on either side that determine a value between two samples."""
_KAISER = 8.0
"""Shape of the filter's window: what it lets pass beyond half of the rate is below 1e-4."""
_SEGMENT = 512
_BANDS = 8


def floor_noise(signal: Values) -> float:
    """Return the standard deviation of white noise as strong as the floor of a signal's spectrum.

    Differences of a signal that changes much from sample to sample show the signal. The floor is
    the least mean of eight bands of equal width.

    Parameters
    ----------
    signal : ndarray, shape (n,)

    Returns
    -------
    float
        In units of the signal.
    """
    segment = min(_SEGMENT, len(signal) // 2)
    _, power = welch(signal, 1.0, nperseg=segment, detrend="constant")
    # Without the ends, which have one side only.
    floor = min(float(np.mean(band)) for band in np.array_split(power[1:-1], _BANDS))
    return (floor / 2.0) ** 0.5


def noise_between(record: Record, channel: str, jumps: bool = False) -> float:
    """Return the noise of a channel that may be sampled coarsely: known, or the lesser estimate."""
    if channel in record.noise:
        return record.noise[channel]
    signal = record.channels[channel]
    return min(noise_of(signal, jumps), floor_noise(signal))


def share_beyond(signal: Values, step: float, frequency: float) -> float:
    """Return the share of a signal's power, but for its mean, beyond a frequency in Hz."""
    known, power = periodogram(signal, 1.0 / step, window="hann", detrend="constant")
    total = float(power.sum())
    return float(power[known > frequency].sum()) / total if total > 0.0 else 0.0


def refined(record: Record, factor: int) -> Record:
    """Return a record with ``factor`` times as many samples, on the band-limited curve through it.

    Samples at both ends are left out, where the filter has one side only. The stated
    noise is that of white noise of the same power at each frequency of the former band.

    Parameters
    ----------
    record : Record
    factor : int
        At least 2.

    Returns
    -------
    Record
    """
    taps = firwin(2 * _REACH * factor + 1, 1.0 / factor, window=("kaiser", _KAISER))
    interior = slice(_REACH * factor, (len(record.time) - 1 - _REACH) * factor + 1)
    time = record.time[0] + record.step / factor * np.arange(factor * len(record.time))[interior]
    channels, noise = {}, {}
    for name, channel in record.channels.items():
        middle = float(np.mean(channel))
        channels[name] = resample_poly(channel - middle, factor, 1, window=taps)[interior] + middle
        deviation = noise_between(record, name, jumps=True)
        if deviation > 0.0:
            noise[name] = deviation * factor**0.5
    before, after = (max(rows - _REACH, 0) * factor for rows in record.context)
    return Record(
        record.name,
        record.role,
        time,
        channels,
        noise,
        record.dropped,
        record.remarks,
        context=(before, after),
    )
