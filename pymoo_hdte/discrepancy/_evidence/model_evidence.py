"""Evidence of a machine of any kind, from a function that predicts its records."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of, out_of_tolerance
from pymoo_hdte.discrepancy._selection.excess import Excess, HeldOutTest
from pymoo_hdte.discrepancy._selection.fitting import Fit, Response, Unknowns, Vector, built
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.quantity_units import unit_at_length

_LOST = 1e3
"""Whitened residual where a model has no finite prediction, which a fit leaves again."""


class ModelEvidence(ABC):
    """Records of a machine beside the predictions of its model; the base of your own evidence.

    A subclass states the unknowns of the model, predicts, and tells the sizes of its ports. Fits,
    screening, the verdict, validation, the next test and the report need nothing else.

    Attributes
    ----------
    base : tuple of Parameter
        Unknowns of the model without further effects, within their tolerances; see
        `pymoo_hdte.effects.unknown`.
    known : tuple of LawAt
        Effects that the model has already; they are not searched for.
    units : mapping of str to str
        SI unit of an unknown of the base; those that are missing are dimensionless.
    along : collection of str
        Ports that move along a line: numbers of effects are in N and m there, elsewhere in N.m and
        rad.
    rules : Rules
        Thresholds of the verdict; `analyse` sets them.

    Examples
    --------
    See ``docs/examples/ring_down.py``, a machine kind in one file.
    """

    base: tuple[Parameter, ...]
    known: tuple[LawAt, ...] = ()
    units: Mapping[str, str] = MappingProxyType({})
    along: Collection[str] = ()
    rules: Rules = RULES
    held_out: ModelEvidence | None = None
    evident: frozenset[str] = frozenset()

    @abstractmethod
    def residuals(
        self, values: Mapping[str, float], effects: Sequence[LawAt]
    ) -> Sequence[Mapping[str, ArrayLike]]:
        """Return predicted minus measured over the noise, by channel, for each record.

        Parameters
        ----------
        values : mapping of str to float
            Of the base, SI.
        effects : sequence of LawAt
            Beside those that are known.

        Returns
        -------
        sequence of mapping of str to array_like, shape (n,)
            For each record its channels, in standard deviations of their noise. Names and lengths
            are the same in every call.
        """

    @abstractmethod
    def sizes(self, fitted: Fit) -> Mapping[str, Sizes]:
        """Return the ports at which effects may be, each with its sizes.

        Parameters
        ----------
        fitted : Fit
            Of the base, which leaves what is missing.
        """

    @property
    def remainder(self) -> float:
        """Share of the base's excess up to which a residual counts as the model's own error."""
        return self.rules.model_accuracy**2

    def candidates(self, fitted: Fit) -> list[Candidate]:
        """Return every effect that a port may have; override it to search for less, or more."""
        known = {place_of(effect) for effect in self.known}
        found = [
            self._in_units(candidate_of(effect, guess, port, "force", LawAt))
            for port, sizes in self.sizes(fitted).items()
            for effect in law_effects()
            if effect.of_reading == sizes.read
            for guess in effect.guesses(sizes)
        ]
        return [candidate for candidate in found if not candidate.places & known]

    def _in_units(self, candidate: Candidate) -> Candidate:
        unit = candidate.unit
        if unit is None or candidate.port not in self.along:
            return candidate
        return replace(candidate, unit=lambda name: unit_at_length(unit(name)))

    def objective(self, candidates: Sequence[Candidate]) -> ModelObjective:
        """Return the whitened residuals with candidates, and their derivatives."""
        return ModelObjective(self, candidates)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[: len(self.base)]
        before = self.whitened(base, fitted.effects)
        priors = np.zeros(len(fitted.residuals) - len(before))

        def change(added: Sequence[Any]) -> Vector:
            after = self.whitened(base, (*fitted.effects, *added))
            return np.concatenate([after - before, priors])

        return change

    def corrections(self, candidate: Candidate) -> None:
        """Return None: no forms of laws are known beside those of the library."""
        return

    def with_noise_of(self, fitted: Fit) -> None:
        """Return None: the noise does not depend on the model."""
        return

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each channel."""
        return [np.flatnonzero(self.layout[1] == part) for part in range(len(self.parts))]

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and channel."""
        record, part = self.layout
        chi_square, degrees_of_freedom = np.zeros((2, record.max() + 1, len(self.parts)))
        np.add.at(chi_square, (record, part), fitted.residuals[: len(record)] ** 2)
        np.add.at(degrees_of_freedom, (record, part), 1.0)
        return Excess(chi_square - degrees_of_freedom, degrees_of_freedom)

    def out_of_tolerance(self, at_bounds: Sequence[str], together: bool = False) -> list[Candidate]:
        """Return a candidate for each unknown of the base that a fit left at a bound."""
        names = [parameter.name for parameter in self.base]
        return [out_of_tolerance(name, name) for name in at_bounds if name in names]

    def held_out_test(self, base: Fit, fitted: Fit) -> HeldOutTest | None:
        """Return what the records kept out of the fit say of two fits; None without any."""
        if self.held_out is None:
            return None
        before, after = (self.held_out.left_by(each) for each in (base, fitted))
        change = after - before
        return HeldOutTest(float(before @ before), float(after @ after), float(change @ change))

    def left_by(self, fitted: Fit) -> Vector:
        """Return the whitened residuals of these records, (n,), by a fit of any records."""
        return self.whitened(fitted.values[: len(self.base)], fitted.effects)

    def whitened(self, base: Vector, effects: Sequence[LawAt]) -> Vector:
        """Return all whitened residuals, shape (n,), record by record and channel by channel."""
        names = [parameter.name for parameter in self.base]
        values = dict(zip(names, base.tolist(), strict=True))
        found = [
            np.asarray(channels[part], dtype=float)
            for channels in self.residuals(values, tuple(effects))
            for part in channels
        ]
        return np.nan_to_num(np.concatenate(found), nan=_LOST, posinf=_LOST, neginf=-_LOST)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the channels."""
        self.check()
        return self._parts

    @property
    def layout(self) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Record and channel of each residual, both of shape (n,)."""
        self.check()
        return self._layout

    def check(self) -> None:
        """Check the residuals of the base once, and see where they come from.

        Raises
        ------
        InvalidInput
            If there are none, or some are not finite.
        """
        if hasattr(self, "_layout"):
            return
        start = {parameter.name: parameter.start for parameter in self.base}
        by_record = self.residuals(start, ())
        self._parts = tuple(dict.fromkeys(part for channels in by_record for part in channels))
        if not self._parts:
            raise InvalidInput("residuals", by_record, "one channel or more for each record")
        places = []
        for record, channels in enumerate(by_record):
            for part, values in channels.items():
                row = np.asarray(values, dtype=float)
                if row.ndim != 1 or not np.all(np.isfinite(row)):
                    allowed = "finite numbers of shape (n,) at the start of the base"
                    raise InvalidInput(f"residuals of {part} in record {record}", values, allowed)
                places += [(record, self._parts.index(part))] * len(row)
        record_of, part_of = np.array(places).T
        self._layout = record_of, part_of


class ModelObjective(Unknowns):
    """Whitened residuals of a model with candidates, those of priors last."""

    def __init__(self, data: ModelEvidence, candidates: Sequence[Candidate]) -> None:
        super().__init__(data.base, candidates)
        self.data = data

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        n_base = len(self.data.base)
        effects = [part for parts in built(self.candidates, values[n_base:]) for part in parts]
        return np.concatenate([self.data.whitened(values[:n_base], effects), self.priors(values)])

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives (n_residuals, n_parameters) in units of the parameters' scale."""
        here, steps = self.residuals(values), self.steps(values)
        moved = values + np.diag(steps * self.scale)
        changes = [self.residuals(vector) - here for vector in moved]
        return np.array(changes).T / steps
