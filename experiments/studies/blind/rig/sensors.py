"""What the sensors of the bench make of the motion: errors, noise, steps of the scale, averages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.torques import wave


@dataclass(frozen=True)
class ScaleError:
    """An error of the output encoder that repeats with its angle.

    ``amplitude`` in rad, ``order`` in cycles per turn, ``phase`` in rad; ``form`` of `shapes.wave`.
    """

    amplitude: float
    order: float
    phase: float
    form: float = 0.0

    def at(self, angle: Values) -> Values:
        """Return the error at angles (n,), rad."""
        heights = np.linspace(0.0, 2.0 * np.pi, 721)
        shape = [wave(self.form, x)[0] for x in heights]
        turned = (self.order * angle + self.phase) % (2.0 * np.pi)
        return self.amplitude * np.interp(turned, heights, shape)


@dataclass(frozen=True)
class Drift:
    """A zero of the output encoder that runs away during the session.

    ``size`` in rad and ``time`` in s; ``form`` 0 has one time constant, 1 two, 2 is hyperbolic, 3
    begins as the root of the time, as heat that diffuses does.
    """

    size: float
    time: float
    form: int = 0

    def at(self, clock: Values) -> Values:
        """Return the drift at times (n,) of the session, rad."""
        age = clock / self.time
        if self.form == 1:
            return -self.size * (0.6 * np.expm1(-age) + 0.4 * np.expm1(-6.0 * age))
        if self.form == 2:
            return self.size * age / (1.0 + age)
        if self.form == 3:
            return self.size * np.sqrt(age) / (1.0 + np.sqrt(age))
        return -self.size * np.expm1(-age)


@dataclass(frozen=True)
class ZeroDrift:
    """Zeros of the torque sensors that run away, N.m, with one time constant, s."""

    input: float
    output: float
    time: float

    def at(self, clock: Values) -> Matrix:
        """Return the zeros at times (n,) of the session, N.m, shape (2, n)."""
        return np.outer([self.input, self.output], -np.expm1(-clock / self.time))


@dataclass(frozen=True)
class ZeroStep:
    """New zeros of the output angle (rad) and of both torques (N.m) from a time (s) on."""

    angle: float
    input: float
    output: float
    since: float


@dataclass(frozen=True)
class Mount:
    """A base of the output encoder that the load turns back.

    ``compliance`` in rad/(N.m), ``frequency`` of its resonance in rad/s, ``damping`` as a ratio.
    It is much stiffer than the drive, so that the drive does not feel it.
    """

    compliance: float
    frequency: float
    damping: float

    def turned(self, torque: Values, rate: float) -> Values:
        """Return by how much the angle shows too little, rad, as ``torque`` (n,) in steady state.

        A record is one turn, so that its spectrum has all lines but those that miss a whole number.
        """
        s = 2j * np.pi * np.fft.rfftfreq(len(torque), 1.0 / rate) / self.frequency
        answer = self.compliance / (1.0 + 2.0 * self.damping * s + s * s)
        return np.fft.irfft(answer * np.fft.rfft(torque), len(torque))


@dataclass(frozen=True)
class Sensors:
    """The sensors of one bench.

    Attributes
    ----------
    angle_noise, torsion_noise : float
        Standard deviation of a sample of each encoder, at the output, rad; in torsion records.
    angle_step : float
        Of both scales, at the output, rad.
    input_noise, output_noise : float
        Of the torque sensors, N.m.
    gains, zeros : tuple of float
        Relative errors and zeros (N.m) of the torque sensors of input and output.
    curvature : float
        Share by which the output's torque sensor shows too much at `FULL_SCALE`.
    scale : tuple of ScaleError
    drift : tuple of Drift
    zero_drift : ZeroDrift or None
    zero_step : ZeroStep or None
    mount : Mount or None
    ranges : tuple of float
        Torques of input and output beyond which nothing more is shown, N.m; zero for no limit.
    torque_steps : tuple of float
        Resolution of both torques, N.m; zero for none.
    """

    angle_noise: float
    torsion_noise: float
    angle_step: float
    input_noise: float
    output_noise: float
    gains: tuple[float, float] = (0.0, 0.0)
    zeros: tuple[float, float] = (0.0, 0.0)
    curvature: float = 0.0
    scale: tuple[ScaleError, ...] = ()
    drift: tuple[Drift, ...] = ()
    zero_drift: ZeroDrift | None = None
    zero_step: ZeroStep | None = None
    mount: Mount | None = None
    ranges: tuple[float, float] = (0.0, 0.0)
    torque_steps: tuple[float, float] = (0.0, 0.0)

    def shown(self, seen: Matrix, clock: Values, rate: float) -> Matrix:
        """Return what the sensors would show without noise, as ``seen``.

        Parameters
        ----------
        seen : ndarray, shape (4, n)
            Input angle, output angle, torques of motor and load; rad and N.m.
        clock : ndarray, shape (n,)
            Time of the session, s.
        rate : float
            Samples per second.
        """
        shown = seen.copy()
        for error in self.scale:
            shown[1] += error.at(seen[1])
        for drift in self.drift:
            shown[1] += drift.at(clock)
        shown[2] = (1.0 + self.gains[0]) * seen[2] + self.zeros[0]
        shown[3] = self.load_shown(seen[3])
        if self.mount is not None:
            shown[1] -= self.mount.turned(seen[3], rate)
        if self.zero_drift is not None:
            shown[2:] += self.zero_drift.at(clock)
        if self.zero_step is not None:
            step = self.zero_step
            shown[1:] += np.outer([step.angle, step.input, step.output], clock >= step.since)
        return self._within(shown)

    def _within(self, shown: Matrix) -> Matrix:
        """Return channels (k, n), the torques last, that stay within the ranges."""
        for row, limit in zip(shown[-2:], self.ranges, strict=True):
            if limit:
                np.clip(row, -limit, limit, out=row)
        return shown

    def load_shown(self, torque: Values) -> Values:
        """Return what the torque sensor of the output shows without noise, N.m, shape (n,)."""
        bent = torque * (1.0 + self.curvature * np.abs(torque) / FULL_SCALE)
        return (1.0 + self.gains[1]) * bent + self.zeros[1]

    def sampled(
        self, shown: Matrix, ratio: float, averaged: int, rng: np.random.Generator
    ) -> Matrix:
        """Return rows with noise and rounding: each the mean of ``averaged`` raw samples."""
        noise = np.array([self.angle_noise * ratio, self.angle_noise])
        torque_noise = np.array([self.input_noise, self.output_noise]) / averaged**0.5
        angles = shown[:2] + noise[:, None] * rng.standard_normal(shown[:2].shape)
        steps = self.angle_step * np.array([[ratio], [1.0]])
        angles = steps * np.rint(angles / steps)
        # A sensor without steps averages the same, drawn with fewer numbers.
        torques = rows_of(shown[2:], averaged)
        torques = torques + torque_noise[:, None] * rng.standard_normal(torques.shape)
        torques = self._within(torques)
        for row, height in zip(torques, self.torque_steps, strict=True):
            if height:
                row[:] = height * np.rint(row / height)
        return np.vstack([rows_of(angles, averaged), torques])


FULL_SCALE = 40.0
"""N.m."""


def rows_of(samples: Matrix, averaged: int) -> Matrix:
    """Return the means of groups of samples (k, n averaged) as rows (k, n)."""
    rows: Matrix = samples.reshape(len(samples), -1, averaged).mean(axis=2)
    return rows
