"""Coefficients of the equations of motion, Eq. (9) with the terms that effects add to it.

    J_in  th_in''  + B_in  th_in'  + (k d + c d') / N = T_in(t)
    J_out th_out'' + B_out th_out' - (k d + c d')     = -T_L(t)
    d = th_in / N - th_out - th_s(th_in),   k = K (1 + kappa cos(2 th_in + psi))

and laws at ports, which add their torques, and the reaction of theta_s on the input. A law at the
load acts on the second equation as one at the output does, beyond the output torque sensor.
`hill_steady_state`, `harmonic_balance` and `time_domain` all solve these equations, so each term is
defined here once.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.effects.law import Law
from pymoo_hdte.effects.stiffness import PeriodicStiffness


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of the motion, Eq. (9), and of effects, of n designs under one condition.

    Attributes
    ----------
    ratio : float
        Transmission ratio N, dimensionless.
    input_speed : float
        Mean speed of the input, rad/s.
    load_torque : float
        T_L, N.m at the output.
    stiffness : ndarray, shape (n,)
        Mean K between input (referred to the output) and output, N.m/rad.
    damping : ndarray, shape (n,)
        c beside it, N.m.s/rad.
    stiffness_depth : float
        kappa of the stiffness variation, dimensionless; 0 where the stiffness is constant.
    stiffness_phase : float
        psi of the stiffness variation, rad.
    input_inertia : ndarray, shape (n,)
        J_in, kg.m2.
    input_damping : ndarray, shape (n,)
        B_in, N.m.s/rad.
    output_inertia : float or ndarray, shape (n,)
        J_out with all that turns with it, kg.m2.
    output_damping : float or ndarray, shape (n,)
        B_out, N.m.s/rad.
    error_orders : ndarray, shape (n_orders,)
        Orders of theta_s in cycles per input turn.
    error_phasors : ndarray of complex, shape (n, n_orders)
        theta_s = Re sum phasor exp(i order theta_in), rad.
    load_inertia : float or ndarray, shape (n,)
        The part of ``output_inertia`` beyond the output coupling, kg.m2.
    laws : tuple of (str, Law)
        Ports, each with a law whose torque is added there.
    reaction : float
        Share of the mesh torque's reaction on the input through the slope of theta_s: 0 in
        Eq. (9), 1 by the principle of virtual work; dimensionless.
    temperature : float or ndarray, shape (n,)
        Temperature of the drive in kelvin; NaN where it is not known.
    load_rates : tuple of (int, float)
        What a load that is not rigidly on the output adds to its inertia: numbers k with sizes s,
        each a torque of s times the k-th time derivative of the output's acceleration, s in
        N.m.s^(2 + k) per rad. The harmonic balance alone knows them; no effect of the library
        has them.
    coupled : tuple of (float, float)
        Inertias beyond the output coupling that a viscous clutch drives: each J in kg.m2 with the
        time in s after which it has come to speed, J over the damping of the clutch.
    shaft : tuple of float, optional
        Compliance, rad/(N.m), of a shaft behind which the ``load_inertia`` turns, with its damping
        over its stiffness, s; by default it is rigid.
    load_errors : tuple of (float, complex)
        Lines of theta_s in proportion to the load: each an order with a phasor in rad per N.m.
        Solvers know them by `at_loads`.
    late_errors : tuple of (float, float, complex)
        Lines of theta_s that are there from a time of the session on: each the time in s, an order
        and a phasor in rad. Solvers know them by `at_loads` too.
    elapsed : float or ndarray, shape (n,)
        Time of the session, s; by default after all of it.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> coefficients = model.coefficients(model.nominal[np.newaxis])
    >>> coefficients.ratio, coefficients.stiffness.shape
    (101.0, (1,))
    """

    ratio: float
    input_speed: float
    load_torque: float
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness_depth: float
    stiffness_phase: float
    input_inertia: NDArray[np.float64]
    input_damping: NDArray[np.float64]
    output_inertia: float | NDArray[np.float64]
    output_damping: float | NDArray[np.float64]
    error_orders: NDArray[np.float64]
    error_phasors: NDArray[np.complex128]
    load_inertia: float | NDArray[np.float64] = 0.0
    laws: tuple[tuple[str, Law], ...] = ()
    reaction: float = 0.0
    temperature: float | NDArray[np.float64] = np.nan
    load_rates: tuple[tuple[int, float], ...] = ()
    coupled: tuple[tuple[float, float], ...] = ()
    shaft: tuple[float, float] | None = None
    load_errors: tuple[tuple[float, complex], ...] = ()
    late_errors: tuple[tuple[float, float, complex], ...] = ()
    elapsed: float | NDArray[np.float64] = np.inf

    def rows(self, rows: slice | NDArray[np.int_]) -> Coefficients:
        """Return the coefficients of some of the designs.

        Parameters
        ----------
        rows : slice or ndarray of int, shape (m,)
            Places of the designs.

        Returns
        -------
        Coefficients
        """
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        parts = {k: v[rows] for k, v in values.items() if k in _BY_DESIGN and np.ndim(v)}
        return replace(self, **parts)

    def at_loads(self, load_torque: float | NDArray[np.float64]) -> Coefficients:
        """Return the coefficients with all lines of theta_s as at loads and at their times.

        The lines of ``load_errors`` and ``late_errors`` are then among those of theta_s.

        Parameters
        ----------
        load_torque : float or ndarray, shape (n,)
            N.m at the output.

        Returns
        -------
        Coefficients
        """
        if not (self.load_errors or self.late_errors):
            return self
        load, elapsed = (
            np.broadcast_to(of_rows, len(self.stiffness)) for of_rows in (load_torque, self.elapsed)
        )
        phasors = [load * by_load for _, by_load in self.load_errors]
        phasors += [np.where(elapsed >= after, late, 0.0) for after, _, late in self.late_errors]
        return replace(
            self,
            error_orders=np.append(self.error_orders, self.further_orders),
            error_phasors=np.column_stack([self.error_phasors, *phasors]),
            load_errors=(),
            late_errors=(),
        )

    @property
    def further_orders(self) -> tuple[float, ...]:
        """Orders of ``load_errors``, then ``late_errors``, in cycles per input turn; shape (k,)."""
        by_load = tuple(order for order, _ in self.load_errors)
        return (*by_load, *(order for _, order, _ in self.late_errors))

    def torque_at(
        self, input_speed: NDArray[np.float64], load_torque: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the mean mesh torque without laws at n operating conditions, one a design.

        Parameters
        ----------
        input_speed : ndarray, shape (n,)
            rad/s.
        load_torque : ndarray, shape (n,)
            N.m at the output.

        Returns
        -------
        ndarray, shape (n,)
            Load and bearing friction, N.m at the output.
        """
        return load_torque + self.output_damping * input_speed / self.ratio

    @property
    def mean_mesh_torque(self) -> float | NDArray[np.float64]:
        """Mean of k d + c d' in steady state: load and bearing friction, N.m at the output.

        A float, or of shape (n,) where `output_damping` is.
        """
        return self.load_torque + self.output_damping * self.input_speed / self.ratio

    @property
    def loaded_shaft(self) -> tuple[float, float] | None:
        """The ``shaft``, in rad/(N.m) and s, if a load turns behind it: else it is rigid."""
        return self.shaft if np.any(self.load_inertia) else None

    @property
    def is_loose(self) -> bool:
        """Whether any inertia is not rigidly on the output."""
        return bool(self.coupled) or self.loaded_shaft is not None

    @property
    def near_inertia(self) -> float | NDArray[np.float64]:
        """Inertia on the near side of a shaft that twists, kg.m2: all of it without one.

        A float, or of shape (n,) where one of the inertias is.
        """
        if self.loaded_shaft is None:
            return self.output_inertia
        return self.output_inertia - np.asarray(self.load_inertia)

    def loose_inertia(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return what inertias in clutches or behind a shaft add to the rigid one at frequencies.

        Behind a shaft an inertia J is J / (1 + J s^2 y), with the shaft's receptance y.

        Parameters
        ----------
        frequency : ndarray, shape (n, m) or (m,)
            rad/s; negative where the drive turns backward.

        Returns
        -------
        ndarray of complex, shape (n, m) or (m,)
            kg.m2; one 0, of shape (), where all is rigid.
        """
        total = np.zeros((), dtype=complex)
        for inertia, time in self.coupled:
            total = total + inertia / (1.0 + 1j * frequency * time)
        if self.loaded_shaft is not None:
            compliance, time = self.loaded_shaft
            load = np.reshape(self.load_inertia, (-1, 1))
            twist = -load * frequency**2 * compliance / (1.0 + 1j * frequency * time)
            total = total - load * twist / (1.0 + twist)
        return total

    @property
    def stiffness_variations(self) -> tuple[PeriodicStiffness, ...]:
        """All variations of the stiffness with the input angle: its own order 2, and laws."""
        laws = tuple(cast(PeriodicStiffness, law) for _, law in self.laws if law.varies_stiffness)
        if self.stiffness_depth == 0.0:
            return laws
        return (PeriodicStiffness(2.0, self.stiffness_phase, self.stiffness_depth), *laws)


_BY_DESIGN = (
    "stiffness", "damping", "input_inertia", "input_damping", "output_inertia", "output_damping",
    "error_phasors", "load_inertia", "temperature", "elapsed",
)  # fmt: skip
