"""A steady state as harmonics of the input angle, and the motor that holds its speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive.solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive.solve.torus import Torus

Phasors = NDArray[np.complex128]


@dataclass(frozen=True)
class SpeedLoop:
    """The motor's torque P (w_set - w) + I integral(w_set - w) dt + constant.

    Both gains 0 is a motor of constant torque. The constant is whatever holds the mean speed.
    Proportional-integral control: Astrom and Hagglund, Advanced PID Control, ISA 2006.

    Attributes
    ----------
    proportional : float
        P, N.m.s/rad at the input.
    integral : float
        I, N.m/rad at the input.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> motion = harmonic_balance(
    ...     model.coefficients(model.nominal[np.newaxis]), motor=SpeedLoop(0.02, 0.5)
    ... )
    >>> motion.converged.tolist()
    [True]
    """

    proportional: float = 0.0
    integral: float = 0.0


CONSTANT_TORQUE = SpeedLoop()


@dataclass(frozen=True)
class SteadyMotion:
    """Steady state of n cases, as harmonics of the input angle.

    Phasors multiply exp(i order alpha) with the input angle alpha as it is, in either direction: in
    reverse alpha falls with time, and order lines of a measured record compare as they are.

    Attributes
    ----------
    torus : Torus
        Whose ``orders`` the phasors belong to.
    transmission_error, torsion : ndarray of complex, shape (n, n_harmonics)
        theta_d and d, rad.
    motor_torque, coupling_torque : ndarray of complex, shape (n, n_harmonics)
        Torque on the input, and between drive and load inertia, N.m.
    lead : ndarray of complex, shape (n, n_harmonics)
        Input angle ahead of the mean speed's, alpha - Omega t, rad; its mean is 0.
    energy : ndarray of complex, shape (n, n_harmonics)
        Half the square of the input speed, rad2/s2.
    converged : ndarray of bool, shape (n,)
        Whether the balance of the case was found; if not, its other values mean nothing.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> motion = harmonic_balance(model.coefficients(model.nominal[np.newaxis]))
    >>> motion.converged.tolist(), motion.transmission_error.shape[0]
    ([True], 1)
    """

    torus: Torus
    transmission_error: Phasors
    torsion: Phasors
    motor_torque: Phasors
    coupling_torque: Phasors
    lead: Phasors
    energy: Phasors
    converged: NDArray[np.bool_]

    def rows(self, rows: NDArray[np.int_] | NDArray[np.bool_] | slice) -> SteadyMotion:
        """Return some of the cases, each as often as its place is given.

        Parameters
        ----------
        rows : slice or ndarray of int or bool, shape (m,)
            Places of the cases.

        Returns
        -------
        SteadyMotion
        """
        return SteadyMotion(self.torus, *(getattr(self, name)[rows] for name in BY_CASE))

    def spectrum(self) -> OrderSpectrum:
        """Return theta_d of the n cases as an order spectrum, rad."""
        return OrderSpectrum(self.torus.orders, self.transmission_error)


BY_CASE = (
    "transmission_error", "torsion", "motor_torque", "coupling_torque", "lead", "energy",
    "converged",
)  # fmt: skip
"""Fields of `SteadyMotion` with a row a case, in their order."""
