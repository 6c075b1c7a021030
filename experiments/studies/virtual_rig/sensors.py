"""Sensors of the virtual rig: geometry errors, drift, noise, quantisation and averaging."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.believed import Rig


@dataclass(frozen=True)
class OutputEncoder:
    """Errors that the output encoder adds to the angle; none by default.

    Attributes
    ----------
    eccentricity, eccentricity_phase, eccentricity_second : float
        e (cos(theta_out + phase) + 0.2 cos(2 theta_out + second)), rad.
    drift, drift_time : float
        Drift over the session, rad and s: four fifths of it as 1 - exp(-t / drift_time), the rest
        three times as fast.
    interpolation, interpolation_lines, interpolation_phase : float
        Amplitude of the interpolation error, rad, and its periods in one turn.
    """

    eccentricity: float = 0.0
    eccentricity_phase: float = 0.0
    eccentricity_second: float = 0.0
    drift: float = 0.0
    drift_time: float = 1.0
    interpolation: float = 0.0
    interpolation_lines: float = 1.0
    interpolation_phase: float = 0.0

    def reading(
        self, angle: NDArray[np.float64], clock: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return what is read at the true ``angle`` (rad) at ``clock`` (s)."""
        once = np.cos(angle + self.eccentricity_phase)
        twice = np.cos(2.0 * angle + self.eccentricity_second)
        fine = np.sin(self.interpolation_lines * angle + self.interpolation_phase)
        ages = clock / self.drift_time
        drifted = self.drift * -(0.8 * np.expm1(-ages) + 0.2 * np.expm1(-3.0 * ages))
        return (
            angle + self.eccentricity * (once + 0.2 * twice) + self.interpolation * fine + drifted
        )


@dataclass(frozen=True)
class TorqueErrors:
    """Gain (relative) and zero (N.m) errors of both torque sensors, constant in a campaign."""

    input_gain: float
    input_zero: float
    output_gain: float
    output_zero: float


def draw_torque_errors(rig: Rig, rng: np.random.Generator) -> TorqueErrors:
    """Draw gain and zero errors uniformly within what the rig is believed to keep."""
    share = rng.uniform(-1.0, 1.0, 4)
    return TorqueErrors(
        float(share[0] * rig.input_torque_gain),
        float(share[1] * rig.input_torque_zero),
        float(share[2] * rig.output_torque_gain),
        float(share[3] * rig.output_torque_zero),
    )


def measure(
    samples: NDArray[np.float64],
    ratio: float,
    rig: Rig,
    errors: TorqueErrors,
    samples_averaged: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return what the four sensors give: noise, quantisation, gain, zero, then the average.

    Parameters
    ----------
    samples : ndarray, shape (4, n * samples_averaged)
        Raw input angle, output angle (as the encoder shows it), input and output torque.
    ratio : float
        Noise and quantisation of the input encoder are this many times those of the output.
    rig : Rig
    errors : TorqueErrors
    samples_averaged : int
    rng : numpy.random.Generator

    Returns
    -------
    ndarray, shape (4, n)
    """
    stds = np.array(
        [rig.angle_noise * ratio, rig.angle_noise, rig.input_torque_noise, rig.output_torque_noise]
    )
    gains = np.array([1.0, 1.0, 1.0 + errors.input_gain, 1.0 + errors.output_gain])
    zeros = np.array([0.0, 0.0, errors.input_zero, errors.output_zero])
    raw = gains[:, None] * samples + zeros[:, None]
    raw += stds[:, None] * rng.standard_normal(samples.shape)
    if rig.angle_quantisation > 0.0:
        steps = rig.angle_quantisation * np.array([[ratio], [1.0]])
        raw[:2] = np.rint(raw[:2] / steps) * steps
    rows: NDArray[np.float64] = raw.reshape(4, -1, samples_averaged).mean(axis=2)
    return rows
