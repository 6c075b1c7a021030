"""The measurement chain of Section 4: 1 kHz sampling, zero-phase low pass, peak-to-peak of a turn.

It applies to records. The DTE of a model is the peak-to-peak of the unfiltered steady state.
"""

from __future__ import annotations

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number

SAMPLING_RATE = 1000.0
"""Frequency in Hz."""

CUTOFF = 100.0
"""Frequency in Hz."""

FILTER_ORDER = 4
"""Order of the Butterworth filter, run forward and backward; the paper prints no type or order."""


def low_pass(signal: ArrayLike, sampling_rate: float = SAMPLING_RATE) -> NDArray[np.float64]:
    """Return the signal after the zero-phase low pass of Section 4.

    Forward and backward passes square the gain: at `CUTOFF` it is 1/2, at 67 Hz 0.96.

    Parameters
    ----------
    signal : array_like, shape (n_times,)
        Equally spaced samples, any unit.
    sampling_rate : float
        Hz, above twice `CUTOFF`.

    Returns
    -------
    ndarray, shape (n_times,)
        In the unit of the signal.

    Raises
    ------
    InvalidInput
        For a wrong rate, or a signal that is not finite or too short to filter.

    Examples
    --------
    >>> time = np.arange(2000) / 1000.0
    >>> slow = np.sin(2 * np.pi * 5.0 * time)
    >>> noisy = slow + 0.1 * np.sin(2 * np.pi * 300.0 * time)
    >>> bool(abs(low_pass(noisy) - slow)[200:-200].max() < 0.01)
    True
    """
    real_number("sampling_rate", sampling_rate, above=2.0 * CUTOFF)
    samples = finite_array("signal", signal, (None,))
    sections = scipy.signal.butter(FILTER_ORDER, CUTOFF, fs=sampling_rate, output="sos")
    shortest = 3 * (2 * len(sections) + 1) + 1
    if len(samples) < shortest:
        raise InvalidInput("length of signal", len(samples), f"at least {shortest} samples")
    return scipy.signal.sosfiltfilt(sections, samples)


def measured_dte(
    input_angle: ArrayLike,
    output_angle: ArrayLike,
    ratio: float,
    sampling_rate: float = SAMPLING_RATE,
) -> float:
    """Return the DTE of a record in rad: filtered transmission error, peak-to-peak of one turn.

    The chain is that of Section 4, see `low_pass`. The turn evaluated is the middle one of the
    record, away from the ends where the filter has no neighbours to average with.

    Parameters
    ----------
    input_angle, output_angle : array_like, shape (n_times,)
        Encoder angles in rad, unwrapped, equally spaced in time.
    ratio : float
        Transmission ratio N, dimensionless.
    sampling_rate : float
        Hz.

    Raises
    ------
    InvalidInput
        For wrong input, or a record shorter than one output turn.

    Examples
    --------
    >>> time = np.arange(4000) / 1000.0
    >>> angle = 2 * np.pi * 10.0 * time
    >>> error = 1e-4 * np.sin(2 * angle)
    >>> print(f"{np.degrees(measured_dte(angle, angle / 20.0 + error, 20.0)) * 3600:.0f} arcsec")
    41 arcsec
    """
    real_number("ratio", ratio, above=0.0)
    driving = finite_array("input_angle", input_angle, (None,))
    driven = finite_array("output_angle", output_angle, driving.shape)
    error = low_pass(driving / ratio - driven, sampling_rate)
    travel = abs(driving[-1] - driving[0])
    turn = 2.0 * np.pi * ratio
    # One sample short of a turn is a whole turn: its end point repeats its start.
    if travel < turn * (1.0 - 1.0 / len(driving)):
        raise InvalidInput("travel of input_angle", float(travel), f"at least {turn:.6g} rad")
    before = max(travel - turn, 0.0) / 2.0
    distance = np.abs(driving - driving[0])
    window = error[(distance >= before) & (distance <= before + turn)]
    return float(window.max() - window.min())
