"""The bench of a drive: nuisances that are fitted together with the base, whatever else is.

Their unknowns are unknowns of the base. So every hypothesis about the drive has them, each fit
finds their values anew, and its evidence is summed over them: hypotheses never differ in them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.known_values import equal_rows, of_equal_numbers
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import strength_is_certain
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.effects.unknowns import Parameter

Values = NDArray[np.float64]


class Group(NamedTuple):
    """Vectors that share the effects by which they move.

    Attributes
    ----------
    rows : ndarray of int, shape (k,)
        Their indices.
    moving : tuple of DriveEffect
        Believed effects and those of the bench that change the motion.
    parts : list of tuple
        Places among the rows that share all others, with these.
    """

    rows: NDArray[np.int_]
    moving: tuple[DriveEffect, ...]
    parts: list[tuple[NDArray[np.int_], tuple[DriveEffect, ...]]]


@dataclass(frozen=True, eq=False)
class Bench:
    """Nuisances of a bench.

    Attributes
    ----------
    nuisances : tuple of Candidate
    begins : tuple of tuple of float
        For each of them the values at which a fit begins.
    """

    nuisances: tuple[Candidate, ...] = ()
    begins: tuple[tuple[float, ...], ...] = ()

    def with_nuisance(self, nuisance: Candidate, begin: Sequence[float]) -> Bench:
        """Return the bench with one more."""
        return Bench((*self.nuisances, nuisance), (*self.begins, tuple(map(float, begin))))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Their unknowns, with names of their own among those of the base."""
        return tuple(
            replace(parameter, name=name, start=begin)
            for nuisance, begins in zip(self.nuisances, self.begins, strict=True)
            for parameter, name, begin in zip(
                nuisance.parameters, names_of(nuisance), begins, strict=True
            )
        )

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of their unknowns among those of the base."""
        return tuple(name for nuisance in self.nuisances for name in names_of(nuisance))

    def shown(self, fitted: Fit, rules: Rules) -> list[tuple[Candidate, slice]]:
        """Return the nuisances whose strength a fit shows, each with the places of its values."""
        names = [parameter.name for parameter in fitted.parameters]
        places = []
        for nuisance in self.nuisances:
            begin = names.index(names_of(nuisance)[0])
            places.append((nuisance, slice(begin, begin + len(nuisance.parameters))))
        return [
            (nuisance, place)
            for nuisance, place in places
            if strength_is_certain(fitted, nuisance, place, rules)
        ]

    def effects(self, values: Mapping[str, float]) -> tuple[DriveEffect, ...]:
        """Return them as effects of a drive, for values by the names of `parameters`."""
        return tuple(
            effect
            for nuisance in self.nuisances
            for effect in nuisance.build([float(values[name]) for name in names_of(nuisance)])
        )

    def groups(
        self,
        known: Sequence[DriveEffect],
        values: Mapping[str, Values],
        moves: Callable[[DriveEffect], bool],
    ) -> list[Group]:
        """Return groups of vectors that share all numbers of effects that change the motion.

        Parameters
        ----------
        known : sequence of DriveEffect
            Believed effects, whose numbers may be among the values.
        values : mapping of str to ndarray, shape (v,)
            Parameters of v vectors by name.
        moves : callable
            Tells whether a nuisance changes the motion; others only add to readings.
        """
        moving, further = Bench(), Bench()
        for nuisance, begin in zip(self.nuisances, self.begins, strict=True):
            if any(moves(effect) for effect in nuisance.build(begin)):
                moving = moving.with_nuisance(nuisance, begin)
            else:
                further = further.with_nuisance(nuisance, begin)
        groups = []
        for rows, effects in of_equal_numbers(known, values):
            # What is believed may be as strong as any effect of the drive.
            believed = tuple(effect for effect in effects if effect.changes_motion)
            rest = tuple(effect for effect in effects if not effect.changes_motion)
            for places, own in moving._of_equal_numbers(values, rows):
                some = rows[places]
                parts = further._of_equal_numbers(values, some)
                parts = [(part, (*rest, *lines)) for part, lines in parts]
                groups.append(Group(some, (*believed, *own), parts))
        return groups

    def _of_equal_numbers(
        self, values: Mapping[str, Values], rows: NDArray[np.int_]
    ) -> list[tuple[NDArray[np.int_], tuple[DriveEffect, ...]]]:
        """Return places among rows that share all values of the bench, with its effects there."""
        own = {name: values[name] for name in self.unknowns}
        return [(places, self.effects(numbers)) for places, numbers in equal_rows(own, rows)]


IDEAL = Bench()
"""A bench without any nuisance."""


def names_of(nuisance: Candidate) -> list[str]:
    """Return the names of the unknowns of a nuisance among those of a base."""
    order = [] if nuisance.order is None else [f"{nuisance.order:.6g}"]
    place = ".".join([nuisance.name, nuisance.port, *order])
    form = f"/{nuisance.form}" if nuisance.form else ""
    return [f"{place}{form}.{parameter.name}" for parameter in nuisance.parameters]
