"""One design over input speed, load and direction, with the resonances that explain it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.free_angle import continued_from_nearest, harmonic_balance
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive._solve.stability import state_matrix
from pymoo_hdte.drive._solve.steady_motion import SteadyMotion
from pymoo_hdte.drive.figures import power_share
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

_PROMINENCE = 0.02
"""Least prominence of a peak over speed, as a share of its height."""

_NEIGHBOURS = 0.05
"""Relative distance in speed within which resonances are listed together."""


@dataclass(frozen=True)
class SpeedLoadMap:
    """DTE in arcsec at the nominal design.

    Attributes
    ----------
    model : DriveModel
    speeds : ndarray, shape (n,)
        Input speeds, r/min.
    loads : ndarray, shape (m,)
        Load torques, N.m.
    dte : ndarray, shape (m, n)
        arcsec; NaN where the drive has no steady state.
    """

    model: DriveModel
    speeds: NDArray[np.float64]
    loads: NDArray[np.float64]
    dte: NDArray[np.float64]

    @property
    def unstable(self) -> int:
        """Number of conditions without a steady state."""
        return int(np.isnan(self.dte).sum())

    def peaks(self, row: int) -> list[tuple[float, float]]:
        """Return speed and DTE of every peak over speed at the load of that row."""
        dte = self.dte[row]
        places, properties = scipy.signal.find_peaks(np.nan_to_num(dte), prominence=0.0)
        standing_out = properties["prominences"] >= _PROMINENCE * dte[places]
        return [(float(self.speeds[i]), float(dte[i])) for i in places[standing_out]]


@dataclass(frozen=True)
class TorsionalMode:
    """Free vibration of both inertias against the mean mesh stiffness.

    Attributes
    ----------
    frequency : float
        Undamped, Hz.
    damping_ratio : float
        1 is critical; from 1 / sqrt(2) on nothing resonates.
    """

    frequency: float
    damping_ratio: float

    @property
    def resonates(self) -> bool:
        """Whether the response can exceed its static value at some frequency."""
        return self.damping_ratio < np.sqrt(0.5)

    def speed(self, order: float) -> float:
        """Return the input speed in r/min at which an order of the input turn meets the mode."""
        return 60.0 * self.frequency / order


def torsional_mode(model: DriveModel) -> TorsionalMode:
    """Return the torsional mode of the nominal design, its bearings left out.

    With an inertia that is not rigidly on the output, it is the least damped vibration, bearings
    included.
    """
    return _mode(model.coefficients(model.nominal[None]))


def _mode(coefficients: Coefficients) -> TorsionalMode:
    if coefficients.is_loose:
        steady = replace(coefficients, laws=(), stiffness_depth=0.0)
        values = np.linalg.eigvals(state_matrix(steady, 0.0)[0])
        swinging = values[values.imag > 0.0]
        if not swinging.size:
            return TorsionalMode(0.0, 1.0)
        mode = swinging[np.argmax(swinging.real / np.abs(swinging))]
        return TorsionalMode(float(abs(mode) / (2.0 * np.pi)), float(-mode.real / abs(mode)))
    input_inertia = coefficients.input_inertia[0] * coefficients.ratio**2
    compliance = 1.0 / input_inertia + 1.0 / coefficients.output_inertia
    stiffness, damping = coefficients.stiffness[0], coefficients.damping[0]
    angular = np.sqrt(stiffness * compliance)
    return TorsionalMode(
        float(angular / (2.0 * np.pi)), float(damping * angular / (2.0 * stiffness))
    )


def critical_speeds(model: DriveModel) -> list[tuple[float, float]]:
    """Return order and input speed (r/min) of every resonance of an excited order.

    Excited are the orders of theta_s and, under load, those of a varying stiffness.
    """
    mode = torsional_mode(model)
    if not mode.resonates:
        return []
    coefficients = model.coefficients(model.nominal[None])
    orders = set(coefficients.error_orders.tolist())
    orders |= set(coefficients.further_orders)
    orders |= {law.order for law in coefficients.stiffness_variations}
    return [(order, mode.speed(order)) for order in sorted(orders)]


def neighbouring_resonances(model: DriveModel, fastest: float) -> list[tuple[str, float]]:
    """Return the orders, as a text, and the speed (r/min) of resonances up to ``fastest`` r/min.

    Orders whose speeds lie within 5 % of the highest are listed together.
    """
    within = [(order, speed) for order, speed in critical_speeds(model) if speed <= fastest]
    resonances = []
    while within:
        speed = within[0][1]
        together = [
            order for order, neighbour in within if abs(neighbour - speed) <= _NEIGHBOURS * speed
        ]
        resonances.append((" and ".join(f"{order:g}" for order in together), speed))
        within = within[len(together) :]
    return resonances


def speed_load_map(
    model: DriveModel, speeds: NDArray[np.float64], loads: NDArray[np.float64]
) -> SpeedLoadMap:
    """Evaluate the nominal design at all speeds (r/min) and loads (N.m)."""
    dte = np.full((len(loads), len(speeds)), np.nan)
    conditions = [(row, column) for row in range(len(loads)) for column in range(len(speeds))]
    for row, column in conditions:
        there = model.at(float(speeds[column]) * REVOLUTION_PER_MINUTE, float(loads[row]))
        try:
            dte[row, column] = there.dte_arcsec(model.nominal[None])[0]
        except ArithmeticError:
            # Left NaN: a motion that grows, or is not found, has no peak-to-peak.
            continue
    return SpeedLoadMap(model, speeds, loads, dte)


DIRECTIONS = {"forward": 1.0, "reverse": -1.0}
"""Directions of an operating map, with the sign of the input speed."""


@dataclass(frozen=True, eq=False)
class OperatingMap:
    """What the nominal design does over speed, load and direction.

    A positive load opposes the motion, in either direction; a negative one drives it.

    Attributes
    ----------
    model : DriveModel
    speeds : ndarray, shape (n,)
        Of the input, rad/s, above 0.
    loads : ndarray, shape (m,)
        N.m at the output.
    dte : ndarray, shape (2, m, n)
        Peak-to-peak of the transmission error over an output turn, arcsec; first index as
        `DIRECTIONS`. NaN, here and below, where no steady state was found.
    ripple : ndarray, shape (2, m, n)
        Peak-to-peak of the torque between drive and load inertia, N.m.
    motor_torque : ndarray, shape (2, m, n)
        Mean torque of the motor in the direction of motion, N.m; negative where it brakes.
    efficiency : ndarray, shape (2, m, n)
        Power out over power in, whichever side drives, dimensionless; 0 where both have to push,
        NaN without load.
    tangent : ndarray, shape (m,)
        Mean stiffness of the mesh about the torsion under each load, N.m/rad.

    Examples
    --------
    >>> mapped = operating_map(preset("calibrated"), np.array([100.0, 200.0]), np.array([-40.0]))
    >>> mapped.dte.shape, mapped.not_found
    ((2, 1, 2), 0)
    """

    model: DriveModel
    speeds: NDArray[np.float64]
    loads: NDArray[np.float64]
    dte: NDArray[np.float64]
    ripple: NDArray[np.float64]
    motor_torque: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    tangent: NDArray[np.float64]

    @property
    def not_found(self) -> int:
        """Number of conditions without a steady state."""
        return int(np.isnan(self.dte).sum())

    def resonances(self) -> dict[float, NDArray[np.float64]]:
        """Return the input speed of the resonance of each excited order under each load, rad/s.

        That of the `torsional_mode` with the `tangent` stiffness; empty where damping leaves none.

        Returns
        -------
        dict of ndarray, shape (m,)
            By order, rad/s.
        """
        if not torsional_mode(self.model).resonates:
            return {}
        coefficients = self.model.coefficients(self.model.nominal[None])
        frequency = np.full(len(self.loads), np.nan)
        for row in np.flatnonzero(np.isfinite(self.tangent)):
            mode = _mode(replace(coefficients, stiffness=self.tangent[row : row + 1]))
            frequency[row] = 2.0 * np.pi * mode.frequency
        orders = {order for order, _ in critical_speeds(self.model)}
        return {order: frequency / order for order in sorted(orders)}


def operating_map(
    model: DriveModel, speeds: NDArray[np.float64], loads: NDArray[np.float64]
) -> OperatingMap:
    """Return error, ripple, motor torque and efficiency over speed, load and direction.

    Parameters
    ----------
    model : DriveModel
    speeds : ndarray, shape (n,)
        Of the input, rad/s, above 0.
    loads : ndarray, shape (m,)
        N.m at the output; positive ones oppose the motion.

    Returns
    -------
    OperatingMap

    Examples
    --------
    >>> mapped = operating_map(preset("calibrated"), np.array([200.0]), np.array([40.0]))
    >>> print(f"{mapped.efficiency[0, 0, 0]:.2f}")
    0.92
    """
    shape = (len(DIRECTIONS), len(loads), len(speeds))
    sign = np.reshape(list(DIRECTIONS.values()), (-1, 1, 1))
    speed = np.broadcast_to(sign * speeds, shape).ravel()
    load = np.broadcast_to(sign * loads[:, None], shape).ravel()
    rows = model.coefficients(np.repeat(model.nominal[None], len(speed), axis=0))
    motion = _near_what_was_found(
        rows, harmonic_balance(rows, input_speed=speed, load_torque=load), speed, load
    )
    found = np.where(motion.converged, 1.0, np.nan)
    torque = motion.motor_torque[:, 0].real * found
    ripple = OrderSpectrum(motion.torus.orders[1:], motion.coupling_torque[:, 1:])
    of_motion = np.reshape(torque, shape) * sign
    tangent = np.reshape(motion.slopes[:, 0] * found, shape)
    return OperatingMap(
        model=model,
        speeds=speeds,
        loads=loads,
        dte=np.reshape(motion.spectrum().peak_to_peak(model.sheet.ratio) / ARCSEC * found, shape),
        ripple=np.reshape(ripple.peak_to_peak(model.sheet.ratio) * found, shape),
        motor_torque=of_motion,
        efficiency=power_share(
            of_motion * model.sheet.ratio, np.broadcast_to(loads[:, None], shape)
        ),
        tangent=np.nanmedian(np.moveaxis(tangent, 1, 0).reshape(len(loads), -1), axis=1),
    )


def _near_what_was_found(
    rows: Coefficients,
    motion: SteadyMotion,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
) -> SteadyMotion:
    """Return the motion with lost conditions solved again from the nearest ones in speed and load.

    It ends when a round finds none.
    """
    places = np.column_stack([speed / np.abs(speed).max(), load / max(np.abs(load).max(), 1e-300)])
    while True:
        before = motion.converged.sum()
        motion = continued_from_nearest(rows, motion, places, input_speed=speed, load_torque=load)
        if motion.converged.sum() == before:
            return motion
