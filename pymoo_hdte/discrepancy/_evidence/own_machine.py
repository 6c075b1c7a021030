"""What a kind of machine of your own states about its model and its records."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from numpy.typing import ArrayLike

from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.quantity_units import unit_at_length


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

    Examples
    --------
    A machine kind in one file is ``docs/examples/ring_down.py``; this one has a single channel.

    >>> from pymoo_hdte.effects import unknown
    >>> class Springs(ModelEvidence):
    ...     base = (unknown("stiffness", 90.0, 110.0, 100.0),)
    ...     def residuals(self, values, effects):
    ...         return [{"force": [values["stiffness"] - 98.0]}]
    ...     def sizes(self, fitted):
    ...         return {}
    >>> Springs().residuals({"stiffness": 100.0}, ())
    [{'force': [2.0]}]
    """

    base: tuple[Parameter, ...]
    known: tuple[LawAt, ...] = ()
    units: Mapping[str, str] = MappingProxyType({})
    along: Collection[str] = ()

    @abstractmethod
    def residuals(
        self, values: Mapping[str, float], effects: Sequence[LawAt]
    ) -> Sequence[Mapping[str, ArrayLike]]:
        """Return predicted minus measured over the noise, by channel, for each record.

        Parameters
        ----------
        values : mapping of str to float
            Unknowns of the base, SI.
        effects : sequence of LawAt
            To be added to those that are known.

        Returns
        -------
        sequence of mapping of str to array_like, shape (n,)
            For each record its channels, dimensionless: in standard deviations of their noise.
            Names and lengths are the same in every call.
        """

    @abstractmethod
    def sizes(self, fitted: Fit) -> Mapping[str, Sizes]:
        """Return the ports at which effects may be, each with its sizes.

        Parameters
        ----------
        fitted : Fit
            Of the base; its ``residuals``, shape (n,), hold what is missing.

        Returns
        -------
        mapping of str to Sizes
            By the name of the port, SI.
        """

    def candidates(self, fitted: Fit) -> list[Candidate]:
        """Return every effect that a port may have; override it to search for less, or more.

        Parameters
        ----------
        fitted : Fit
            Of the base; its ``residuals``, shape (n,), hold what is missing.

        Returns
        -------
        list of Candidate
        """
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
