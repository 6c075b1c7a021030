"""Force balances of measured records, whitened, and the unexplained residual as their noise.

The noise of the sensors is estimated from the records. No model of a real machine fits down to it:
the residual of the best model (the rest) then counts as noise, as in Birge's ratio (Physical Review
40, 1932).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.candidate import Candidate, out_of_tolerance
from pymoo_hdte.discrepancy.engine.excess import Excess
from pymoo_hdte.discrepancy.engine.fitting import Fit, Response, Unknowns, Vector, built
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.balances import ForceBalance, balance_names, quantity_names

Values = NDArray[np.float64]

_OF_LAWS = ("stiffness of ", "zero of ")


@dataclass(frozen=True, eq=False)
class MeasuredData:
    """Force balances of records in the form of `fitting.Evidence`.

    Attributes
    ----------
    mechanism : Mechanism
    spectra : tuple of ForceBalance
        Of the records.
    deviation : tuple of ndarray, shape (n_balances, n_bins)
        Standard deviation of what counts as noise, by record.
    known : tuple of LawAt
        Effects of the base.
    rules : Rules
        Thresholds of the verdict.
    """

    mechanism: Mechanism
    spectra: tuple[ForceBalance, ...]
    deviation: tuple[Values, ...]
    known: tuple[LawAt, ...] = ()
    rules: Rules = RULES

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the balances."""
        return balance_names(self.mechanism)

    def what(self, part: str) -> str:
        """Return in words what a part is."""
        return (
            f"force balance of {part}" if part in self.mechanism.coordinates else f"reading {part}"
        )

    @property
    def remainder(self) -> float:
        """Share of the base's excess up to which a residual is attributed to no effect."""
        return self.rules.mechanism_remainder

    @cached_property
    def base(self) -> tuple[Parameter, ...]:
        """Quantities that are not known exactly, within their tolerances, and sensors' zeros."""
        found = []
        for name, one in self.mechanism.quantities.items():
            if not one.known:
                least, most = one.limits
                found.append(Parameter(name, one.value, least, most, (most - least) / 2.0))
        for port in self.mechanism.ports:
            if port.read or port.followed:
                size = max(*(self._peak(port, one) for one in self.spectra), 1e-12)
                found.append(Parameter(f"zero of {port.name}", 0.0, -2.0 * size, 2.0 * size, size))
        return tuple(found)

    @staticmethod
    def _peak(port: Port, balance: ForceBalance) -> float:
        """Return the largest force of a sensor, or of the spring between two angles.

        Of the spring at the measured torsion, whose zero is not known, and to hold the inputs.
        """
        if port.read:
            return float(np.abs(balance.record.channels[port.name]).max())
        wound = port.stiffness.limits[1] * float(np.abs(balance.ports[port.name].position).max())
        held = (
            max(map(abs, one.gain.limits))
            * sum(map(abs, one.acts.values()))
            * float(np.abs(balance.record.channels[one.name]).max())
            for one in balance.mechanism.inputs
        )
        return wound + sum(held)

    @cached_property
    def _linear(self) -> tuple[Vector, Values]:
        """Whitened residuals without the base's parameters, (n,), and their slopes, (n, n_base)."""
        quantities = quantity_names(self.mechanism)
        places = [quantities.index(parameter.name) for parameter in self.base]
        known = np.zeros(len(quantities))
        for name, one in self.mechanism.quantities.items():
            known[quantities.index(name)] = one.value
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
                one.name.removeprefix(prefix): float(value)
                for one, value in zip(self.base, base, strict=True)
                if one.name.startswith(prefix)
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

    def objective(self, candidates: Sequence[Candidate]) -> BalanceObjective:
        """Return whitened residuals with candidates."""
        return BalanceObjective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[: len(self.base)]
        return lambda added: -self.whitened_forces(base, added)

    def corrections(self, candidate: Candidate) -> None:
        """Return none: no forms of laws are known beside those of the library."""

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each part."""
        return [np.flatnonzero(self._part == part) for part in range(len(self.names))]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part, shape (r, n_parts)."""
        chi_square, degrees_of_freedom = self._chi_square(fitted.residuals), self._coefficients
        return Excess(chi_square - degrees_of_freedom, degrees_of_freedom)

    def known_over_noise(self) -> float:
        """Return the ratio of exactly known forces to the noise.

        The largest ratio of powers in the force balance of a coordinate in a record. Without a
        force that is known exactly all others are known up to a common factor only. A part that is
        the same in all records at rest may be the zero of a sensor and does not count.
        """
        believed = np.array([parameter.start for parameter in self.base])
        known = self._linear[0] - self.whitened_forces(believed, self.known)
        for part in range(len(self.names)):
            still = (self.frequency == 0.0) & (self._part == part)
            known[still] -= known[still].mean() if still.any() else 0.0
        ratios = self._chi_square(known) / self._coefficients
        return float(ratios[:, : len(self.mechanism.coordinates)].max())

    def out_of_tolerance(self, at_bounds: Sequence[str], together: bool = False) -> list[Candidate]:
        """Return a candidate for each quantity of the mechanism that a fit left at a bound."""
        return [
            out_of_tolerance(name, name) for name in at_bounds if name in self.mechanism.quantities
        ]

    def held_out_vote(self, base: Fit, fitted: Fit) -> None:
        """Return None: held-out records of a mechanism are simulated, once the verdict stands."""
        return

    def with_rest(self, residuals: Vector) -> MeasuredData:
        """Return the data with whitened residuals (n,) beyond the sensors' noise as further noise.

        White, one level for each part of a record: with weights by frequency a model that is
        wrong at low frequencies would be fitted to the others.
        """
        found = []
        for residual, one in zip(self.coefficients(residuals), self.spectra, strict=True):
            beyond = np.sum(residual**2 - one.noise**2 * one.kept, axis=1, keepdims=True)
            level = np.maximum(beyond, 0.0) / one.kept.sum(axis=1, keepdims=True)
            found.append(np.sqrt(one.noise**2 + level))
        return replace(self, deviation=tuple(found))

    def coefficients(self, residuals: Vector) -> list[Values]:
        """Return whitened residuals (n,) as coefficients (n_parts, n_bins) of each record.

        SI; zero where a part is not known.
        """
        found, start = [], 0
        for balance, deviation in zip(self.spectra, self.deviation, strict=True):
            whole, end = np.zeros(deviation.shape), start + int(balance.kept.sum())
            whole[balance.kept] = residuals[start:end]
            found.append(whole * deviation)
            start = end
        return found

    def power(self, residuals: Vector) -> Vector:
        """Return the sum of squares of whitened residuals (n,) by part, in squares of its unit."""
        return np.sum([np.sum(one**2, axis=1) for one in self.coefficients(residuals)], axis=0)

    @cached_property
    def frequency(self) -> Vector:
        """Frequency of each residual, Hz, shape (n,)."""
        return np.concatenate(
            [np.broadcast_to(one.frequency, one.kept.shape)[one.kept] for one in self.spectra]
        )

    def _chi_square(self, residuals: Vector) -> Values:
        """Return the sum of squares of whitened residuals (n,) by record and part."""
        found = np.zeros((len(self.spectra), len(self.names)))
        np.add.at(found, (self._record, self._part), residuals**2)
        return found

    @property
    def _coefficients(self) -> Values:
        """Number of coefficients by record and part."""
        return np.array([one.kept.sum(axis=1) for one in self.spectra], dtype=float)

    @cached_property
    def _part(self) -> NDArray[np.int_]:
        return np.concatenate([np.nonzero(one.kept)[0] for one in self.spectra])

    @cached_property
    def _record(self) -> NDArray[np.int_]:
        sizes = [int(one.kept.sum()) for one in self.spectra]
        return np.repeat(np.arange(len(sizes)), sizes)


class BalanceObjective(Unknowns):
    """Whitened residuals of force balances and their derivatives for a set of candidates."""

    def __init__(self, data: MeasuredData, candidates: Sequence[Candidate]) -> None:
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
        found = np.zeros((len(self.data.frequency), len(values)))
        found[:, :n_base] = self.data._linear[1] * self.scale[:n_base]
        stands = self._forces(values)
        for place, parameter in enumerate(self.parameters):
            # A law may depend on stiffness and zero of its port, but not on masses and dampers.
            if place >= n_base or parameter.name in self._of_laws:
                moved = values.copy()
                moved[place] += steps[place] * self.scale[place]
                found[:, place] -= (self._forces(moved) - stands) / steps[place]
        return found

    def _forces(self, values: Vector) -> Vector:
        n_base = len(self.data.base)
        effects = (*self.data.known, *self._effects(values[n_base:]))
        return self.data.whitened_forces(values[:n_base], effects)

    def _effects(self, values: Vector) -> tuple[LawAt, ...]:
        parts = built(self.candidates, values)
        return tuple(effect for part in parts for effect in part)


def measured_data(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float,
    known: Sequence[LawAt] = (),
    rules: Rules = RULES,
) -> MeasuredData:
    """Return records of a mechanism with the noise of their sensors.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
    cutoff : float
        Hz, up to which the motion is known.
    known : sequence of LawAt
        Effects that the mechanism has; rows in which one holds a port at rest are left out.
    rules : Rules
        Thresholds by which the records are judged.

    Raises
    ------
    InvalidInput
        See `ForceBalance`.
    """
    spectra = tuple(ForceBalance(mechanism, record, cutoff, known) for record in records)
    noise = tuple(one.noise for one in spectra)
    return MeasuredData(mechanism, spectra, noise, tuple(known), rules)
