"""Force balances of measured records, which are linear in the quantities of the mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.evidence import Response, Vector
from pymoo_hdte.discrepancy.fit import Fit
from pymoo_hdte.discrepancy.objective import Unknowns, built
from pymoo_hdte.measured.whitened import WhitenedData
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import Balance, balance_names, quantity_names
from pymoo_hdte.mechanism.motion import highest_frequency

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasuredData(WhitenedData):
    """Force balances of records, whitened; every coordinate is measured."""

    spectra: tuple[Balance, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the balances."""
        return balance_names(self.mechanism)

    def what(self, part: str) -> str:
        """Return in words what a part is."""
        return (
            f"force balance of {part}" if part in self.mechanism.coordinates else f"reading {part}"
        )

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
            constant = balance.constant - balance.forces(self.known)
            constant += np.einsum("bqk,q->bk", balance.terms, known)
            constants.append((constant / deviation)[balance.kept])
            terms = balance.terms[:, places] / deviation[:, None]
            slopes.append(np.moveaxis(terms, 1, 2)[balance.kept])
        return np.concatenate(constants), np.concatenate(slopes)

    def whitened_forces(self, effects: Sequence[LawAt]) -> Vector:
        """Return what effects take from the whitened residuals, shape (n,)."""
        return np.concatenate(
            [
                (balance.forces(effects) / deviation)[balance.kept]
                for balance, deviation in zip(self.spectra, self.deviation, strict=True)
            ]
        )

    def residuals(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return whitened residuals, shape (n,), at base parameters (n_base,) with effects."""
        constant, slopes = self._linear
        return constant + slopes @ base - self.whitened_forces(effects)

    def objective(
        self, candidates: Sequence[Candidate], slopes: Values | None = None
    ) -> BalanceObjective:
        """Return whitened residuals with candidates; slopes are known, they need not be given."""
        return BalanceObjective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        return lambda added: -self.whitened_forces(added)


class BalanceObjective(Unknowns):
    """Whitened residuals of force balances and their derivatives for a set of candidates."""

    def __init__(self, data: MeasuredData, candidates: Sequence[Candidate]) -> None:
        super().__init__(data.base, candidates)
        self.data = data

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        n_base = len(self.data.base)
        return self.data.residuals(values[:n_base], self._effects(values[n_base:]))

    def jacobian(self, values: Vector) -> Values:
        """Return derivatives (n, n_parameters) by parameters in units of their scale."""
        n_base, steps = len(self.data.base), self.steps(values)
        _, slopes = self.data._linear
        columns = [slopes * self.scale[:n_base]]
        stands = self.data.whitened_forces(self._effects(values[n_base:]))
        for place in range(n_base, len(values)):
            moved = values.copy()
            moved[place] += steps[place] * self.scale[place]
            change = self.data.whitened_forces(self._effects(moved[n_base:])) - stands
            columns.append(-change[:, None] / steps[place])
        return np.hstack(columns)

    def slopes_at(self, values: Vector) -> Values:
        """Return derivatives by base parameters, which do not depend on the values."""
        return self.data._linear[1].T

    def _effects(self, values: Vector) -> tuple[LawAt, ...]:
        parts = built(self.candidates, values)
        return tuple(effect for part in parts for effect in part)  # type: ignore[misc]


def usual_cutoff(mechanism: Mechanism, records: Sequence[Record]) -> float:
    """Return the frequency, Hz, up to which every coordinate stands out of its noise.

    Raises
    ------
    InvalidInput
        See `highest_frequency`.
    """
    return min(
        highest_frequency(record.channels[name], record.step)
        for record in records
        for name in mechanism.coordinates
        if name in record.channels
    )


def measured_data(
    mechanism: Mechanism,
    records: Sequence[Record],
    cutoff: float,
    known: Sequence[LawAt] = (),
) -> MeasuredData:
    """Return records of a mechanism with the noise of their sensors.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
    cutoff : float
        Hz, up to which the motion is known.
    known : sequence of LawAt
        Effects that the mechanism has.

    Raises
    ------
    InvalidInput
        See `Balance`.
    """
    spectra = tuple(Balance(mechanism, record, cutoff) for record in records)
    return MeasuredData(mechanism, spectra, tuple(one.noise for one in spectra), tuple(known))
