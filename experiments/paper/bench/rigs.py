"""A virtual test bench: records with known truth, for tests and for trying the procedures.

Sensors add zero error and noise; the drive adds Coulomb friction and hysteresis. Every size is our
own choice within the usual range of such benches; the paper prints none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from pymoo_hdte.checks import finite_array, real_number, whole_number
from pymoo_hdte.identification.damping import INPUT_SPEEDS, OUTPUT_SPEEDS, NoLoadRun
from pymoo_hdte.identification.torsion import TorsionLoop, stiffness
from pymoo_hdte.units import ARCSEC

_GRID = 4001
"""Points on which the loop of a drive with friction is traced before it is sampled."""


@dataclass(frozen=True)
class TorsionBench:
    """A rig that locks the input, loads the output 0 -> +T -> 0 -> -T -> 0 and records.

    The drive is a spring beside a friction element of Dahl's form: on each branch the friction
    torque runs exponentially to its bound, over ``friction_angle`` (P. R. Dahl, 1968).

    Attributes
    ----------
    peak_torque : float
        T, N.m.
    samples_per_branch : int
        At least 4.
    friction_torque, friction_angle : float
        Bound of the hysteretic torque, N.m, and the torsion over which it turns, rad.
    torque_noise, torsion_noise : float
        Standard deviations, N.m and rad.
    noise_correlation : float
        From sample to sample, of both (first-order autoregression).
    torque_zero, torsion_zero : float
        Zero errors of the sensors, N.m and rad.
    """

    peak_torque: float = 40.0
    samples_per_branch: int = 200
    friction_torque: float = 1.5
    friction_angle: float = 10.0 * ARCSEC
    torque_noise: float = 0.04
    torsion_noise: float = 0.7 * ARCSEC
    noise_correlation: float = 0.4
    torque_zero: float = 0.1
    torsion_zero: float = 5.0 * ARCSEC

    def __post_init__(self) -> None:
        real_number("peak_torque", self.peak_torque, above=0.0)
        whole_number("samples_per_branch", self.samples_per_branch, 4)
        limit = self.peak_torque / 2.0
        real_number("friction_torque", self.friction_torque, at_least=0.0, below=limit)
        real_number("friction_angle", self.friction_angle, above=0.0)
        real_number("torque_noise", self.torque_noise, at_least=0.0)
        real_number("torsion_noise", self.torsion_noise, at_least=0.0)
        real_number("noise_correlation", self.noise_correlation, at_least=0.0, below=1.0)
        real_number("torque_zero", self.torque_zero)
        real_number("torsion_zero", self.torsion_zero)

    def record(self, spring: float, rng: np.random.Generator) -> TorsionLoop:
        """Record one loop of a drive whose spring has this stiffness, N.m/rad."""
        torque, torsion = self._noise_free(spring)
        size = len(torque)
        return TorsionLoop(
            torque + self.torque_zero + self.torque_noise * self._noise(size, rng),
            torsion + self.torsion_zero + self.torsion_noise * self._noise(size, rng),
        )

    def loading_stiffness(self, spring: float) -> float:
        """Return the true K, N.m/rad: the slope of a1 without noise, which friction bends."""
        return stiffness(TorsionLoop(*self._noise_free(spring))).slope

    def _noise_free(self, spring: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        real_number("spring", spring, above=0.0)
        corners = self.peak_torque * np.array([0.0, 1.0, 0.0, -1.0, 0.0])
        at = np.arange(4 * self.samples_per_branch + 1) / self.samples_per_branch
        torque = np.interp(at, np.arange(5.0), corners)
        torsion = np.empty_like(torque)
        angle = friction = 0.0
        for first, last, direction in ((0, 1, 1.0), (1, 3, -1.0), (3, 4, 1.0)):
            part = slice(first * self.samples_per_branch, last * self.samples_per_branch + 1)
            reach = (2.0 * self.peak_torque + 2.0 * self.friction_torque) / spring
            travel = np.linspace(0.0, reach, _GRID)
            bound = direction * self.friction_torque
            frictions = bound + (friction - bound) * np.exp(-travel / self.friction_angle)
            loads = spring * (angle + direction * travel) + frictions
            moved = np.interp(direction * torque[part], direction * loads, travel)
            torsion[part] = angle + direction * moved
            friction = torque[part][-1] - spring * torsion[part][-1]
            angle = torsion[part][-1]
        return torque, torsion

    def _noise(self, size: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw noise of unit variance, stationary from the first sample."""
        noise = rng.standard_normal(size)
        noise[1:] *= (1.0 - self.noise_correlation**2) ** 0.5
        return lfilter([1.0], [1.0, -self.noise_correlation], noise)


@dataclass(frozen=True)
class NoLoadBench:
    """A rig that turns an assembly at constant speeds and records its mean torque.

    Attributes
    ----------
    speeds : ndarray, shape (n,)
        rad/s.
    friction_torque : float
        Coulomb friction of the assembly, N.m.
    torque_noise : float
        Standard deviation of the mean torque at one speed, N.m.
    torque_zero : float
        Zero error of the sensor, N.m.
    """

    speeds: NDArray[np.float64]
    friction_torque: float
    torque_noise: float
    torque_zero: float

    def __post_init__(self) -> None:
        finite_array("speeds", self.speeds, (None,))
        real_number("friction_torque", self.friction_torque, at_least=0.0)
        real_number("torque_noise", self.torque_noise, at_least=0.0)
        real_number("torque_zero", self.torque_zero)

    def record(self, damping: float, rng: np.random.Generator) -> NoLoadRun:
        """Record one run of an assembly with this viscous damping, N.m.s/rad."""
        real_number("damping", damping, at_least=0.0)
        noise = self.torque_noise * rng.standard_normal(len(self.speeds))
        friction = self.friction_torque + self.torque_zero
        return NoLoadRun(self.speeds, damping * self.speeds + friction + noise)


INPUT_BEARING = NoLoadBench(INPUT_SPEEDS, 0.012, 5e-4, 1e-3)
"""Wave generator and flexible bearing alone."""

COMPLETE_DRIVE = NoLoadBench(INPUT_SPEEDS, 0.045, 5e-4, 1e-3)
"""All parts, turned at the input."""

OUTPUT_BEARING = NoLoadBench(OUTPUT_SPEEDS, 2e-3, 2e-5, 1e-4)
"""Cross-roller bearing and circular spline, turned at the output."""
