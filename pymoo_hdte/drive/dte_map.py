"""DTE of one design over input speed and load, with the resonances that explain it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.stability import state_matrix
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

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
    coefficients = model.coefficients(model.nominal[None])
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
