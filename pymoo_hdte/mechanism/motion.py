"""Motion from measured positions: smoothed without delay, and differentiated, up to a frequency.

Above the frequency at which a position falls below its sensor's noise its derivatives are noise, so
that force balances are compared with records below it only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import butter, savgol_filter, sosfiltfilt, welch

from pymoo_hdte._io.even_steps import STEP_SPREAD
from pymoo_hdte.checks import InvalidInput

Values = NDArray[np.float64]

RATE_SLACK = 1.0 + STEP_SPREAD / 2.0
"""Ratio up to which rates count as equal: steps of a record may deviate by twice as much."""
_STANDS_OUT = 4.0
"""Least ratio of the power of a position to that of its noise."""
_FEWEST = 4
_HIGHEST_SHARE = 0.1
"""Largest cutoff as a share of the sampling rate: ten samples in a period."""
_MEDIAN_OF_NORMAL = 0.6744897501960817
_THIRD_DIFFERENCE = 20.0**0.5
_CLEAR = 4.0
"""Standard deviations of a difference beyond which a rise between two samples is a jump."""
_NEIGHBOURS = 5
_LAW_SAMPLES = 40
"""Samples per period of the cutoff; the jumps of dry friction occur between two of them."""
_SEGMENT = 1024
_ORDER = 8
_PASS = 2.0
"""Corner of the smoothing over the cutoff, up to which it passes all but 2e-5."""
_SETTLES = 4.0
"""Periods of the cutoff that are left out at either end, where smoothing has one side only."""
_STENCIL = 7
"""Samples of a derivative: exact for polynomials of degree six."""


@dataclass(frozen=True, eq=False)
class SmoothedMotion:
    """Smoothed position with its derivatives, shape (n,) each; SI."""

    position: Values
    speed: Values
    acceleration: Values


def noise_of(signal: Values, jumps: bool = False) -> float:
    """Return the standard deviation of the white noise of a smooth signal, of shape (n,).

    From third differences, in which white noise has 1 + 9 + 9 + 1 times its variance. Of a signal
    that jumps, as a force may and a position cannot, from their median, unless that is zero because
    the signal is coarsely quantised.
    """
    differences = np.abs(np.diff(signal, 3))
    middle = float(np.median(differences)) / _MEDIAN_OF_NORMAL if jumps else 0.0
    return (middle or float(np.sqrt(np.mean(differences**2)))) / _THIRD_DIFFERENCE


def timing_noise(signal: Values) -> float:
    """Return the standard deviation of white noise as strong as the timing of a signal's jumps.

    The time of a jump of a force is known to within one sample: a uniform error, with a standard
    deviation of the jump over the square root of 12, white over the frequencies. A jump is the
    excess of a rise over its neighbours, where it exceeds the noise: a smooth signal, of shape
    (n,), has none.
    """
    rises = np.diff(signal)
    beyond = rises - median_filter(rises, _NEIGHBOURS, mode="nearest")
    clear = np.abs(beyond) > _CLEAR * 2.0**0.5 * noise_of(signal, jumps=True)
    return float(np.sqrt(np.sum(beyond[clear] ** 2) / (12.0 * len(signal))))


def highest_frequency(
    position: Values, step: float, deviation: float, share: float = _HIGHEST_SHARE
) -> float:
    """Return the frequency in Hz up to which a position exceeds its noise.

    Parameters
    ----------
    position : ndarray, shape (n,)
    step : float
        s.
    deviation : float
        Standard deviation of the position's white noise.
    share : float
        Largest result as a share of the sampling rate.

    Raises
    ------
    InvalidInput
        If the position exceeds its noise at no frequency.
    """
    # Second differences, because the spectrum of a position falls too steeply for a window.
    difference = np.diff(position, 2)
    frequency, power = welch(
        difference, 1.0 / step, nperseg=min(_SEGMENT, len(difference)), detrend="constant"
    )
    noise = 2.0 * step * deviation**2 * (2.0 * np.sin(np.pi * frequency * step)) ** 4
    stands_out = power[1:] > _STANDS_OUT * noise[1:]
    moves = power[1:] / frequency[1:] ** 4
    strongest = int(np.argmax(moves))
    # The lowest frequencies contain the leakage of the window even for white noise. Where nothing
    # moves so slowly, a band of twice as many above them, which noise has seldom, is the motion.
    if not (np.all(stands_out[:_FEWEST]) or (strongest >= _FEWEST and stands_out[strongest])):
        in_a_row = np.convolve(stands_out[_FEWEST:], np.ones(2 * _FEWEST), "valid")
        shown = _FEWEST + np.flatnonzero(in_a_row == 2 * _FEWEST)
        if not shown.size:
            allowed = f"more than {_STANDS_OUT:g} at some frequency, or its motion is unknown"
            ratio = float(np.max(power[1:] / np.maximum(noise[1:], 1e-300)))
            raise InvalidInput("power of a position over that of its noise", ratio, allowed)
        strongest = int(shown[np.argmax(moves[shown])])
    quiet = np.flatnonzero(~stands_out[strongest:])
    end = strongest + quiet[0] if quiet.size else len(stands_out)
    return float(min(frequency[end], highest_share(step, share)))


def highest_share(step: float, share: float = _HIGHEST_SHARE) -> float:
    """Return a share of the sampling rate, Hz; by default what ten samples in a period resolve."""
    return share / step


def stride_of(cutoff: float, step: float) -> int:
    """Return the stride in samples that gives `_LAW_SAMPLES` per period of the cutoff."""
    return max(1, int(1.0 / (_LAW_SAMPLES * step * cutoff)))


def finer_than(cutoff: float, step: float) -> int:
    """Return the factor of refinement that gives `_LAW_SAMPLES` per period of the cutoff."""
    return max(1, int(np.ceil(_LAW_SAMPLES * cutoff * step - 1e-9)))


def margin_of(cutoff: float, step: float) -> int:
    """Return the number of samples to be left out at either end."""
    return int(np.ceil(_SETTLES / (step * cutoff)))


def smooth(signal: Values, step: float, cutoff: float) -> Values:
    """Return a signal of shape (n,) without what lies well beyond the cutoff, and without delay."""
    corner = _PASS * cutoff
    if corner * step >= 0.45:
        return signal
    # Relative to the mean, so that a large constant does not cause ringing at the ends.
    middle = float(np.mean(signal))
    filtered = sosfiltfilt(butter(_ORDER, corner, fs=1.0 / step, output="sos"), signal - middle)
    return np.asarray(filtered + middle)


def smoothed_noise(noise: float, step: float, cutoff: float) -> tuple[float, float]:
    """Return the standard deviations of position and speed after smoothing, for white noise."""
    corner = min(_PASS * cutoff, 0.5 / step)
    share = 2.0 * step * corner
    return noise * share**0.5, noise * (share / 3.0) ** 0.5 * 2.0 * np.pi * corner


def motion_of(position: Values, step: float, cutoff: float) -> SmoothedMotion:
    """Return the motion of a measured position, shape (n,), up to the cutoff in Hz."""
    smoothed = smooth(position, step, cutoff)
    speed, acceleration = (
        savgol_filter(smoothed, _STENCIL, _STENCIL - 1, deriv=order, delta=step) for order in (1, 2)
    )
    return SmoothedMotion(smoothed, speed, acceleration)
