"""How torsion and torques follow small motions and torques that repeat at any order.

The input is led: it moves as measured, whatever torque that takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.steady_motion import Phasors, SteadyMotion
from pymoo_hdte.effects.law import Law


@dataclass(frozen=True, eq=False)
class LeadResponse:
    """Phasors per radian of the lead of n cases at m orders, each of shape (n, m).

    Attributes
    ----------
    torsion : ndarray of complex
        rad per rad; that of the transmission error, too.
    motor_torque, coupling_torque : ndarray of complex
        Torque that the input takes, and between drive and load inertia, N.m/rad.
    rate : ndarray of complex
        Angular frequency of each order, times 1j, rad/s.
    slow : ndarray, shape (n, 3, 2)
        The first three for a slow motion: per rad/s of its speed and per rad/s2 of its
        acceleration.
    """

    torsion: Phasors
    motor_torque: Phasors
    coupling_torque: Phasors
    rate: Phasors
    slow: NDArray[np.float64]

    @property
    def channels(self) -> Phasors:
        """Transmission error, torque of the motor and of the coupling, shape (n, 3, m)."""
        return np.stack([self.torsion, self.motor_torque, self.coupling_torque], axis=1)

    def without_load(self) -> LeadResponse:
        """Return the response as a torque sensor behind the load inertia reads it."""
        slow = self.slow.copy()
        slow[:, 2] = 0.0
        return replace(self, coupling_torque=np.zeros_like(self.rate), slow=slow)

    @classmethod
    def joined(cls, parts: Sequence[LeadResponse], order: NDArray[np.int_]) -> LeadResponse:
        """Return the cases of several, one after the other, in an order (n,) of their own."""
        names = [attribute.name for attribute in fields(cls)]
        columns = [np.concatenate([getattr(part, name) for part in parts]) for name in names]
        return cls(*(column[order] for column in columns))


def lead_response(
    coefficients: Coefficients,
    slopes: NDArray[np.float64],
    speed: NDArray[np.float64],
    orders: ArrayLike,
) -> LeadResponse:
    """Return the response to a prescribed motion of the input at orders, each for itself.

    Laws act with their mean slopes, as in an order that is in no other term of the equations.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs.
    slopes : ndarray, shape (n, 4)
        Mean derivatives of torques, as in `SteadyMotion`.
    speed : ndarray, shape (n,)
        Mean speed of the input, rad/s.
    orders : array_like, shape (m,)
        Cycles per input turn.

    Returns
    -------
    LeadResponse
    """
    rate = 1j * np.multiply.outer(speed, np.asarray(orders, dtype=float))
    mesh, resisting, beyond = _impedances(coefficients, slopes, rate)
    stiffness, _, output, inputs = (column[:, None] for column in slopes.T)
    torsion = resisting / (mesh + resisting) / coefficients.ratio
    own = coefficients.input_inertia[:, None] * rate**2 + inputs * rate
    # The output follows by 1/N less the torsion.
    follows = 1.0 / coefficients.ratio - torsion
    whole = np.reshape(coefficients.output_inertia, (-1, 1)) + sum(
        mass for mass, _ in coefficients.coupled
    )
    outer = (
        whole
        - np.reshape(coefficients.output_inertia, (-1, 1))
        + np.reshape(coefficients.load_inertia, (-1, 1))
    )
    by_rates = [
        np.hstack([output, whole * np.ones_like(output)]) / (stiffness * coefficients.ratio),
        np.hstack(
            [
                inputs + output / coefficients.ratio**2,
                coefficients.input_inertia[:, None] + whole / coefficients.ratio**2,
            ]
        ),
        np.hstack([np.zeros_like(output), outer * np.ones_like(output)]) / coefficients.ratio,
    ]
    return LeadResponse(
        slow=np.stack(by_rates, axis=1),
        torsion=torsion,
        motor_torque=own + mesh * torsion / coefficients.ratio,
        coupling_torque=beyond * rate**2 * follows,
        rate=rate,
    )


@dataclass(frozen=True, eq=False)
class TorqueLines:
    """Lines of n cases by torques that are one line each, at k orders; phasors (n, k).

    Attributes
    ----------
    orders : ndarray, shape (k,)
        Cycles per input turn.
    torsion : ndarray of complex
        rad; that of the transmission error, too.
    motor_torque, ripple : ndarray of complex
        Torque that the input takes, and what the motor itself adds to that of its loop, N.m.
    coupling_torque, brake_torque : ndarray of complex
        As in `SteadyMotion`, N.m.
    """

    orders: NDArray[np.float64]
    torsion: Phasors
    motor_torque: Phasors
    ripple: Phasors
    coupling_torque: Phasors
    brake_torque: Phasors


def torque_lines(
    coefficients: Coefficients,
    laws: Sequence[tuple[str, Law]],
    motion: SteadyMotion,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
) -> TorqueLines:
    """Return what torques do that are one line each (`Behaviour.line`), while the input is led.

    At the input they add to the motor's torque and do nothing else, exactly. At the output and the
    load other laws act with their mean slopes: what a varying stiffness makes of such a line at
    other orders is left out, a share of its depth.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs.
    laws : sequence of (str, Law)
        Ports, each with a law.
    motion : SteadyMotion
        Steady state without these laws.
    speed, load : ndarray, shape (n,)
        Mean speed of the input, rad/s, and load, N.m.
    """
    at_input = np.array([port == "input" for port, _ in laws], dtype=bool)
    at_load = np.array([port == "load" for port, _ in laws], dtype=bool)
    drives = np.array([law.drives for _, law in laws], dtype=bool)
    of_port = np.array([law.orders[0] for _, law in laws], dtype=float)
    torques = np.zeros((len(load), len(laws)), dtype=complex)
    for column, (_, law) in enumerate(laws):
        torques[:, column] = law.line(load)
    orders = np.where(at_input, of_port, of_port / coefficients.ratio)
    # The output lags by its error; how this varies moves a line by as much of itself.
    lag = motion.transmission_error[:, :1].real
    outside = np.where(at_input, 0.0, torques * np.exp(-1j * of_port * lag))
    rate = 1j * np.multiply.outer(speed, orders)
    mesh, resisting, beyond = _impedances(coefficients, motion.slopes, rate)
    torsion = outside / (mesh + resisting)
    return TorqueLines(
        orders,
        torsion,
        np.where(at_input, torques, mesh * torsion / coefficients.ratio),
        np.where(at_input & drives, -torques, 0.0),
        np.where(at_load, outside, 0.0) - beyond * rate**2 * torsion,
        np.where(at_load & drives, outside, 0.0),
    )


def _impedances(
    coefficients: Coefficients, slopes: NDArray[np.float64], rate: Phasors
) -> tuple[Phasors, Phasors, Phasors]:
    """Return mesh torque per torsion, what the output resists per angle, and inertia beyond it."""
    stiffness, damping, output, _ = (column[:, None] for column in slopes.T)
    loose = coefficients.loose_inertia(rate.imag)
    loose = loose + sum(size * rate**k for k, size in coefficients.load_rates)
    inertia = np.reshape(coefficients.output_inertia, (-1, 1)) + loose
    beyond = np.reshape(coefficients.load_inertia, (-1, 1)) + loose
    return stiffness + damping * rate, inertia * rate**2 + output * rate, beyond
