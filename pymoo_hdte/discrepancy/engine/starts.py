"""Where fits of a set of effects begin again, so that they do not end at a local minimum."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis, contains
from pymoo_hdte.discrepancy.engine.rules import Rules
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]


def from_believed(base: Sequence[Parameter], one: Hypothesis) -> Vector:
    """Return the believed values of the base with the fitted ones of a set's effects."""
    believed = np.array([parameter.start for parameter in base])
    return np.append(believed, one.fit.values[len(believed) :])


def other_shapes(one: Hypothesis, found: Iterable[Hypothesis], rules: Rules) -> list[Vector]:
    """Return starts with other shapes for a set that does no better than a special case of it.

    A part of a law that has vanished during a fit has no shape that could lead it back.

    Parameters
    ----------
    one : Hypothesis
    found : iterable of Hypothesis
        Sets that it may contain.
    rules : Rules

    Returns
    -------
    list of ndarray, shape (n_parameters,)
        None where the set does better than all that it contains.
    """
    if not any(_does_no_better(one, other, rules) for other in found):
        return []
    starts = []
    for member, place in one.fit.places:
        for shape in member.starts if len(member.starts) > 1 and not member.linear else ():
            start = one.fit.values.copy()
            start[place.start + 1 : place.stop] = shape[1:]
            starts.append(start)
    return starts


def _does_no_better(one: Hypothesis, other: Hypothesis, rules: Rules) -> bool:
    gain = other.fit.chi_square - one.fit.chi_square
    wider = one.names != other.names and contains(one, other)
    return wider and gain < rules.evidence_distance
