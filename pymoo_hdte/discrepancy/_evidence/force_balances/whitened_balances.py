"""Whitened residuals of force balances, and their derivatives by the base and by effects.

They are linear in the quantities of a mechanism, such as masses and dampers, but not in those of a
law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Unknowns, Vector, built
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import LawAt, Mechanism, Port
from pymoo_hdte.mechanism.balances import ForceBalance, balance_names, quantity_names

Values = NDArray[np.float64]

_OF_LAWS = ("stiffness of ", "zero of ")


@dataclass(frozen=True, eq=False)
class WhitenedBalances:
    """Force balances of records, in units of what counts as their noise.

    Attributes
    ----------
    mechanism : Mechanism
    spectra : tuple of ForceBalance
        Force balances of the records.
    deviation : tuple of ndarray, shape (n_balances, n_bins)
        Standard deviation of what counts as noise, by record.
    known : tuple of LawAt
        Effects of the base.
    """

    mechanism: Mechanism
    spectra: tuple[ForceBalance, ...]
    deviation: tuple[Values, ...]
    known: tuple[LawAt, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the balances."""
        return balance_names(self.mechanism)

    @cached_property
    def base(self) -> tuple[Parameter, ...]:
        """Quantities that are not known exactly, within their tolerances, and sensors' zeros."""
        parameters = []
        for name, quantity in self.mechanism.quantities.items():
            if not quantity.known:
                least, most = quantity.fit_limits
                parameters.append(
                    Parameter(name, quantity.value, least, most, (most - least) / 2.0)
                )
        for port in self.mechanism.ports:
            if port.read or port.followed:
                size = max(*(self._peak(port, balance) for balance in self.spectra), 1e-12)
                parameters.append(
                    Parameter(f"zero of {port.name}", 0.0, -2.0 * size, 2.0 * size, size)
                )
        return tuple(parameters)

    @staticmethod
    def _peak(port: Port, balance: ForceBalance) -> float:
        """Return the largest force of a sensor, or of the spring between two angles.

        That of the spring is the force at the measured torsion, whose zero is unknown, and the
        force that holds the inputs.
        """
        if port.read:
            return float(np.abs(balance.record.channels[port.name]).max())
        wound = port.stiffness.limits[1] * float(np.abs(balance.ports[port.name].position).max())
        held = (
            max(map(abs, signal.gain.limits))
            * sum(map(abs, signal.acts.values()))
            * float(np.abs(balance.record.channels[signal.name]).max())
            for signal in balance.mechanism.inputs
        )
        return wound + sum(held)

    @cached_property
    def _linear(self) -> tuple[Vector, Values]:
        """Whitened residuals without the base's parameters, (n,), and their slopes, (n, n_base)."""
        quantities = quantity_names(self.mechanism)
        places = [quantities.index(parameter.name) for parameter in self.base]
        known = np.zeros(len(quantities))
        for name, quantity in self.mechanism.quantities.items():
            known[quantities.index(name)] = quantity.value
        known[places] = 0.0
        constants, slopes = [], []
        for balance, deviation in zip(self.spectra, self.deviation, strict=True):
            constant = balance.constant.copy()
            constant += np.einsum("bqk,q->bk", balance.terms, known)
            constants.append((constant / deviation)[balance.kept])
            terms = balance.terms[:, places] / deviation[:, None]
            slopes.append(np.moveaxis(terms, 1, 2)[balance.kept])
        return np.concatenate(constants), np.concatenate(slopes)

    def whitened_forces(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return how effects reduce whitened residuals, (n,), at base parameters (n_base,)."""
        stiffness, zeros = (
            {
                parameter.name.removeprefix(prefix): float(value)
                for parameter, value in zip(self.base, base, strict=True)
                if parameter.name.startswith(prefix)
            }
            for prefix in _OF_LAWS
        )
        return np.concatenate(
            [
                (balance.forces(effects, stiffness, zeros) / deviation)[balance.kept]
                for balance, deviation in zip(self.spectra, self.deviation, strict=True)
            ]
        )

    def residuals(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return whitened residuals, shape (n,), at base parameters (n_base,) with effects."""
        constant, slopes = self._linear
        return constant + slopes @ base - self.whitened_forces(base, (*self.known, *effects))

    @cached_property
    def frequency(self) -> Vector:
        """Frequency of each residual, Hz, shape (n,)."""
        return np.concatenate(
            [
                np.broadcast_to(balance.frequency, balance.kept.shape)[balance.kept]
                for balance in self.spectra
            ]
        )


class BalanceObjective(Unknowns):
    """Whitened residuals of force balances and their derivatives for a set of candidates."""

    def __init__(self, data: WhitenedBalances, candidates: Sequence[Candidate]) -> None:
        super().__init__(data.base, candidates)
        self.data = data
        self._of_laws = {f"stiffness of {port.name}" for port in data.mechanism.ports}
        self._of_laws |= {f"zero of {port.name}" for port in data.mechanism.ports if port.followed}

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        n_base = len(self.data.base)
        return self.data.residuals(values[:n_base], self._effects(values[n_base:]))

    def jacobian(self, values: Vector) -> Values:
        """Return derivatives (n, n_parameters) by parameters in units of their scale."""
        n_base, steps = len(self.data.base), self.steps(values)
        jacobian = np.zeros((len(self.data.frequency), len(values)))
        jacobian[:, :n_base] = self.data._linear[1] * self.scale[:n_base]
        forces = self._forces(values)
        for place, parameter in enumerate(self.parameters):
            # A law may depend on stiffness and zero of its port, but not on masses and dampers.
            if place >= n_base or parameter.name in self._of_laws:
                moved = values.copy()
                moved[place] += steps[place] * self.scale[place]
                jacobian[:, place] -= (self._forces(moved) - forces) / steps[place]
        return jacobian

    def _forces(self, values: Vector) -> Vector:
        n_base = len(self.data.base)
        effects = (*self.data.known, *self._effects(values[n_base:]))
        return self.data.whitened_forces(values[:n_base], effects)

    def _effects(self, values: Vector) -> tuple[LawAt, ...]:
        parts = built(self.candidates, values)
        return tuple(effect for part in parts for effect in part)
