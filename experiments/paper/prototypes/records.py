"""Simulated records of a prototype, taken through the measurement chain of Section 4 (Fig. 14)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pymoo_hdte.drive import DriveModel, low_pass, measured_dte, simulate_drive
from pymoo_hdte.drive.measurement import SAMPLING_RATE
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True)
class Record:
    """One record at 1 kHz, a little longer than an output turn.

    Attributes
    ----------
    output_angle : ndarray, shape (n_times,)
        Nominal output angle, 0 where the turn begins, in degrees.
    raw, filtered : ndarray, shape (n_times,)
        Transmission error before and after the low pass, arcsec, without its mean.
    steady, integrated, sampled, measured : float
        DTE in arcsec: of the steady state, of the integrated motion, after sampling, and after
        sampling and filtering.
    ratio : float
    """

    output_angle: NDArray[np.float64]
    raw: NDArray[np.float64]
    filtered: NDArray[np.float64]
    steady: float
    integrated: float
    sampled: float
    measured: float
    ratio: float


def record(model: DriveModel, parameters: NDArray[np.float64]) -> Record:
    """Run a prototype, parameters (5,) in SI units, from rest and record one output turn."""
    run = simulate_drive(model, parameters)
    times = np.arange(run.time[0], run.time[-1], 1.0 / SAMPLING_RATE)
    error = CubicSpline(run.time, run.transmission_error)(times)
    angle = CubicSpline(run.time, run.input_angle)(times)
    offset = error.mean()
    turn = (angle >= 0.0) & (angle <= 2.0 * np.pi * run.ratio)
    return Record(
        output_angle=np.degrees(angle / run.ratio),
        raw=(error - offset) / ARCSEC,
        filtered=(low_pass(error) - offset) / ARCSEC,
        steady=float(model.dte_arcsec(parameters[None])[0]),
        integrated=run.dte_arcsec(),
        sampled=float(np.ptp(error[turn])) / ARCSEC,
        measured=measured_dte(angle, angle / run.ratio - error, run.ratio) / ARCSEC,
        ratio=run.ratio,
    )
