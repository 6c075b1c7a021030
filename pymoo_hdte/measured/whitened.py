"""Whitened spectra of what a model leaves of records, and the rest that counts as their noise.

The noise of the sensors is estimated from the records. No model of a real machine meets it: what
the best model leaves, the rest, then counts as noise, as Birge's ratio has it (Physical Review 40,
1932).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.evidence import Residuals, Response, Vector
from pymoo_hdte.discrepancy.excess import Excess
from pymoo_hdte.discrepancy.fit import Fit
from pymoo_hdte.discrepancy.parameters import Parameter
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import PortMotion

Values = NDArray[np.float64]

REMAINDER = 0.05
"""Share of the base's excess up to which what is left is nobody's effect."""


class Spectrum(Protocol):
    """What is left of one record, as coefficients (n_parts, n_bins) of a cosine transform.

    Attributes
    ----------
    record : Record
    frequency : ndarray, shape (n_bins,)
        Hz.
    kept : bool ndarray, shape (n_parts, n_bins)
        Coefficients that are held against a model.
    noise : ndarray, shape (n_parts, n_bins)
        Standard deviation that the sensors give them.
    ports : dict of str to PortMotion
    time : ndarray, shape (n,)
    """

    record: Record
    frequency: Values
    kept: NDArray[np.bool_]
    noise: Values
    ports: dict[str, PortMotion]

    @property
    def time(self) -> Values:
        """Times of the working rate, s, shape (n,)."""
        ...

    def in_time(self, coefficients: Values) -> Values:
        """Return the signal, shape (n,), of coefficients (n_bins,)."""
        ...


@dataclass(frozen=True, eq=False)
class WhitenedData(ABC):
    """Records of a mechanism, as `discrepancy.evidence.Evidence` wants them.

    Attributes
    ----------
    mechanism : Mechanism
    spectra : tuple of Spectrum
        Of the records.
    deviation : tuple of ndarray, shape (n_parts, n_bins)
        Standard deviation that counts as noise, by record.
    known : tuple of LawAt
        Effects that the base has.
    """

    mechanism: Mechanism
    spectra: tuple[Spectrum, ...]
    deviation: tuple[Values, ...]
    known: tuple[LawAt, ...] = ()

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the parts of the data."""

    @abstractmethod
    def what(self, part: str) -> str:
        """Return in words what a part is."""

    @abstractmethod
    def residuals(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return whitened residuals, shape (n,), at base parameters (n_base,) with effects."""

    @abstractmethod
    def objective(self, candidates: Sequence[Candidate], slopes: Values | None = None) -> Residuals:
        """Return the residuals of the mechanism with candidates."""

    @abstractmethod
    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""

    @property
    def remainder(self) -> float:
        """Share of the base's excess up to which what is left is nobody's effect."""
        return REMAINDER

    @cached_property
    def base(self) -> tuple[Parameter, ...]:
        """Quantities that are not known exactly, within their tolerances, and sensors' zeros."""
        found = []
        for name, one in self.mechanism.quantities.items():
            if one.tolerance > 0.0:
                reach = one.tolerance * one.value
                found.append(
                    Parameter(name, one.value, one.value - reach, one.value + reach, reach)
                )
        for port in self.mechanism.ports:
            if port.read:
                largest = max(
                    float(np.abs(one.record.channels[port.name]).max()) for one in self.spectra
                )
                size = max(largest, 1e-12)
                found.append(Parameter(f"zero of {port.name}", 0.0, -2.0 * size, 2.0 * size, size))
        return tuple(found)

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return where the residuals of each part stand."""
        return [np.flatnonzero(self._part == part) for part in range(len(self.names))]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part, shape (r, n_parts)."""
        square = fitted.residuals**2
        shape = (len(self.spectra), len(self.names))
        chi_square = np.zeros(shape)
        np.add.at(chi_square, (self._record, self._part), square)
        freedom = np.array([one.kept.sum(axis=1) for one in self.spectra], dtype=float)
        return Excess(chi_square - freedom, freedom)

    def out_of_tolerance(self, at_bounds: Sequence[str]) -> list[Candidate]:
        """Return a candidate for each quantity of the mechanism that a fit left at a bound."""
        return [
            Candidate(
                "parameter",
                name,
                (),
                ((),),
                lambda v: (),
                f"The {name} lies outside its tolerance.",
                exact=True,
                frees=name,
            )
            for name in at_bounds
            if name in self.mechanism.quantities
        ]

    def with_rest(self, residuals: Vector) -> Self:
        """Return the data with what whitened residuals (n,) show beyond the sensors as more noise.

        White, one level for each part of a record: with weights by frequency a model that is
        wrong at low frequencies would be fitted to the others.
        """
        found = []
        for left, one in zip(self.coefficients(residuals), self.spectra, strict=True):
            beyond = np.sum(left**2 - one.noise**2 * one.kept, axis=1, keepdims=True)
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

    @cached_property
    def _part(self) -> NDArray[np.int_]:
        return np.concatenate([np.nonzero(one.kept)[0] for one in self.spectra])

    @cached_property
    def _record(self) -> NDArray[np.int_]:
        sizes = [int(one.kept.sum()) for one in self.spectra]
        return np.repeat(np.arange(len(sizes)), sizes)
