"""Force balances of measured records as evidence, and the unexplained residual as their noise.

The noise of the sensors is estimated from the records. No model of a real machine fits down to it:
the unexplained residual of the best model then counts as noise, as in Birge's ratio (Physical
Review 40, 1932).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.whitened_balances import (
    BalanceObjective,
    Values,
    WhitenedBalances,
)
from pymoo_hdte.discrepancy._selection.candidate import Candidate, out_of_tolerance
from pymoo_hdte.discrepancy._selection.excess import Excess
from pymoo_hdte.discrepancy._selection.fitting import Fit, Response, Vector
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import ForceBalance


@dataclass(frozen=True, eq=False)
class MeasuredData(WhitenedBalances):
    """Force balances of records in the form of `fitting.Evidence`.

    Attributes
    ----------
    mechanism, spectra, deviation, known
        As in `WhitenedBalances`.
    rules : Rules
        Thresholds of the verdict.
    """

    rules: Rules = RULES

    def what(self, part: str) -> str:
        """Return the name of a part in words."""
        return (
            f"force balance of {part}" if part in self.mechanism.coordinates else f"reading {part}"
        )

    @property
    def evident(self) -> frozenset[str]:
        """Empty, because no effect shows by itself in records of a mechanism."""
        return frozenset()

    def objective(self, candidates: Sequence[Candidate]) -> BalanceObjective:
        """Return whitened residuals with candidates."""
        return BalanceObjective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[: len(self.base)]
        return lambda added: -self.whitened_forces(base, added)

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each part."""
        return [np.flatnonzero(self._part == part) for part in range(len(self.names))]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part, shape (r, n_parts)."""
        chi_square, degrees_of_freedom = self._chi_square(fitted.residuals), self._coefficients
        return Excess(chi_square - degrees_of_freedom, degrees_of_freedom)

    def known_over_noise(self) -> float:
        """Return the ratio of exactly known forces to the noise.

        It is the largest ratio of powers in the force balance of a coordinate in a record. Without
        an exactly known force, all others are known up to a common factor only. A constant part
        that all records share may be the zero of a sensor and does not count.
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

    def held_out_test(self, base: Fit, fitted: Fit) -> None:
        """Return None, because held-out records of a mechanism are simulated after the verdict."""
        return

    def says_nothing_of(self, effects: Sequence[LawAt]) -> bool:
        """Tell whether a record rests throughout and effects hold it by dry friction.

        At rest a force says only that friction holds it, whatever law is right.
        """
        held = any(effect.law.breakaway for effect in effects)
        return held and all(balance.moving.rests for balance in self.spectra)

    def with_residual_as_noise(self, residuals: Vector) -> MeasuredData:
        """Return the data with whitened residuals (n,) beyond the sensors' noise as further noise.

        The noise is white, with one level for each part of a record: with weights by frequency, a
        model that is wrong at low frequencies would be fitted to the others.
        """
        deviations = []
        for residual, balance in zip(self.coefficients(residuals), self.spectra, strict=True):
            beyond = np.sum(residual**2 - balance.noise**2 * balance.kept, axis=1, keepdims=True)
            level = np.maximum(beyond, 0.0) / balance.kept.sum(axis=1, keepdims=True)
            deviations.append(np.sqrt(balance.noise**2 + level))
        return replace(self, deviation=tuple(deviations))

    def coefficients(self, residuals: Vector) -> list[Values]:
        """Return whitened residuals (n,) as coefficients (n_parts, n_bins) of each record.

        They are in SI, and zero where a part is unknown.
        """
        coefficients, start = [], 0
        for balance, deviation in zip(self.spectra, self.deviation, strict=True):
            whole, end = np.zeros(deviation.shape), start + int(balance.kept.sum())
            whole[balance.kept] = residuals[start:end]
            coefficients.append(whole * deviation)
            start = end
        return coefficients

    def power(self, residuals: Vector) -> Vector:
        """Return the sum of squares of whitened residuals (n,) by part, in squares of its unit."""
        return np.sum(
            [np.sum(values**2, axis=1) for values in self.coefficients(residuals)], axis=0
        )

    def _chi_square(self, residuals: Vector) -> Values:
        """Return the sum of squares of whitened residuals (n,) by record and part."""
        chi_square = np.zeros((len(self.spectra), len(self.names)))
        np.add.at(chi_square, (self._record, self._part), residuals**2)
        return chi_square

    @property
    def _coefficients(self) -> Values:
        """Number of coefficients by record and part."""
        return np.array([balance.kept.sum(axis=1) for balance in self.spectra], dtype=float)

    @cached_property
    def _part(self) -> NDArray[np.int_]:
        return np.concatenate([np.nonzero(balance.kept)[0] for balance in self.spectra])

    @cached_property
    def _record(self) -> NDArray[np.int_]:
        sizes = [int(balance.kept.sum()) for balance in self.spectra]
        return np.repeat(np.arange(len(sizes)), sizes)


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
        Frequency up to which the motion is known, Hz.
    known : sequence of LawAt
        Effects that the mechanism has. Rows at rest are left out, see `moving_rows`.
    rules : Rules
        Thresholds of the verdict on the records.

    Raises
    ------
    InvalidInput
        See `ForceBalance`.
    """
    spectra = tuple(ForceBalance(mechanism, record, cutoff, known) for record in records)
    noise = tuple(balance.noise for balance in spectra)
    return MeasuredData(mechanism, spectra, noise, tuple(known), rules)
