"""A steady state as harmonics of the input angle, and the motor that holds its speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.linear_systems import LinearSystem
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive._solve.torus import Torus

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


@dataclass(frozen=True, eq=False)
class Tangents:
    """Linear systems of Newton's method at steady states, computed when first asked for.

    Attributes
    ----------
    solved : callable
        Maps places (m,) of solved cases to their linear systems; None where a step needs none.
    places : ndarray of int, shape (n,)
        Place of each row among the solved cases.
    """

    solved: Callable[[NDArray[np.int_]], Sequence[LinearSystem | None]]
    places: NDArray[np.int_]
    _known: dict[int, LinearSystem | None] = field(default_factory=dict)

    def rows(self, rows: NDArray[np.int_] | NDArray[np.bool_] | slice) -> Tangents:
        """Return the tangents of some of the rows; they share the computed systems."""
        return Tangents(self.solved, self.places[rows], self._known)

    def systems(self) -> list[LinearSystem | None]:
        """Return the linear system of each row."""
        new = np.array(sorted({*self.places.tolist()} - self._known.keys()), dtype=int)
        if new.size:
            self._known.update(zip(new.tolist(), self.solved(new), strict=True))
        return [self._known[place] for place in self.places.tolist()]

    @classmethod
    def joined(cls, parts: Sequence[Tangents]) -> Tangents:
        """Return the rows of several, one after the other.

        Parameters
        ----------
        parts : sequence of Tangents
            Parts of n_1, n_2, ... rows.

        Returns
        -------
        Tangents
            Tangents of n_1 + n_2 + ... rows; each part computes its own systems.
        """
        ends = np.cumsum([0, *(len(part.places) for part in parts)])

        def solved(places: NDArray[np.int_]) -> list[LinearSystem | None]:
            """Return the systems of each part in turn; places rise."""
            systems: list[LinearSystem | None] = []
            for part, start, stop in zip(parts, ends[:-1], ends[1:], strict=True):
                own = places[(start <= places) & (places < stop)] - start
                systems += part.rows(own).systems()
            return systems

        return cls(solved, np.arange(ends[-1]))


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
    motor_torque, coupling_torque, brake_torque : ndarray of complex, shape (n, n_harmonics)
        Torque on the input, between drive and load inertia, and between that and the brake, N.m.
    lead : ndarray of complex, shape (n, n_harmonics)
        Input angle ahead of the mean speed's, alpha - Omega t, rad; its mean is 0.
    energy : ndarray of complex, shape (n, n_harmonics)
        Half the square of the input speed, rad2/s2.
    slower : ndarray of complex, shape (n, n_harmonics)
        Mean speed of the input less its speed, rad/s.
    slopes : ndarray, shape (n, 4)
        Mean derivatives of torques: of the mesh by torsion (N.m/rad) and by its rate, of friction
        at the output and at the input by speed (N.m.s/rad).
    converged : ndarray of bool, shape (n,)
        Whether the balance of the case was found; if not, its other values mean nothing.
    tangents : Tangents, optional
        By which nearby cases are found without systems of their own.

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
    brake_torque: Phasors
    lead: Phasors
    energy: Phasors
    slower: Phasors
    slopes: NDArray[np.float64]
    converged: NDArray[np.bool_]
    tangents: Tangents | None = field(default=None, kw_only=True, repr=False, compare=False)

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
        tangents = None if self.tangents is None else self.tangents.rows(rows)
        values = [getattr(self, name)[rows] for name in BY_CASE]
        return SteadyMotion(self.torus, *values, tangents=tangents)

    def on(self, torus: Torus) -> SteadyMotion:
        """Return the motion with the harmonics of another torus, the only ones that are kept."""
        if np.array_equal(self.torus.orders, torus.orders):
            return self
        values = {name: getattr(self, name) for name in BY_CASE}
        for name, phasors in values.items():
            if name not in ("slopes", "converged"):
                values[name] = torus.harmonics(self.torus.orders, phasors)
        return SteadyMotion(torus, **values)

    def spectrum(self) -> OrderSpectrum:
        """Return theta_d of the n cases as an order spectrum, rad."""
        return OrderSpectrum(self.torus.orders, self.transmission_error)


BY_CASE = (
    "transmission_error", "torsion", "motor_torque", "coupling_torque", "brake_torque", "lead",
    "energy", "slower", "slopes", "converged",
)  # fmt: skip
"""Fields of `SteadyMotion` with a row a case, in their order."""
