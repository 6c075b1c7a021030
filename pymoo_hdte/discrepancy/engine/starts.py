"""Fits of a set of effects from several starts, so that they do not end at a local minimum."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis, contains
from pymoo_hdte.discrepancy.engine.rules import Rules
from pymoo_hdte.discrepancy.engine.screening import basis_of
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]

FORETOLD = 1e-3
"""Share of a change of the residuals, squared, up to which derivatives foretell it.

Steps from there lead back: 27 starts of seen campaigns that were foretold this well ended where the
derivatives were taken. That they are not is no evidence of another minimum.
"""


def best_fit(
    data: Evidence, one: Hypothesis, starts: Sequence[Vector], found: Iterable[Hypothesis]
) -> Fit:
    """Return the best fit of a set from its values, the believed base and other starts.

    From a start that leads back only the residuals are computed. A fit ends where it arrives at an
    earlier one.

    Parameters
    ----------
    data : Evidence
    one : Hypothesis
        The set, fitted at least so far as to rank it.
    starts : sequence of ndarray, shape (n_parameters,)
        In addition to its own values and those with the believed base.
    found : iterable of Hypothesis
        Sets that it may contain: where it does no better than one of them, other shapes are tried.
    """
    fits = [fit(data, one.candidates, one.fit)]

    def fit_from(further: Iterable[Vector]) -> Fit:
        for start in further:
            if _may_lead_elsewhere(data, _least(fits), start):
                fits.append(fit(data, one.candidates, start, known=fits))
        return _least(fits)

    best = fit_from((_from_believed(data.base, one), *starts))
    return fit_from(_other_shapes(best, one, found, data.rules))


def _least(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda each: each.chi_square)


def _may_lead_elsewhere(data: Evidence, best: Fit, start: Vector) -> bool:
    """Tell whether a fit from a start may end lower than the best one so far.

    Not where the derivatives of the best one foretell the residuals at the start. Nor where what
    they do not foretell there, as a new shape of a law, with any strength removes less of what the
    best one leaves than evidence would count, in units of that. A rule of thumb: of 173 starts of
    seen campaigns 107 were left out by it, one of which would have gained 2.8 of chi-square.
    """
    problem = data.objective(best.candidates)
    moved = np.clip(start, problem.lower, problem.upper) - best.values
    foretold = best.jacobian @ (moved / problem.scale)
    beyond = problem.residuals(best.values + moved) - best.residuals - foretold
    if not np.isfinite(beyond).all():
        return True
    if beyond @ beyond <= FORETOLD * (foretold @ foretold):
        return False
    by_unknowns = basis_of(best.jacobian[:, best.bound_sides == 0.0])
    beyond -= by_unknowns @ (by_unknowns.T @ beyond)
    removed, size = (beyond @ best.residuals) ** 2, beyond @ beyond
    misfit = max(best.chi_square / max(len(best.residuals) - len(best.values), 1), 1.0)
    return bool(removed >= data.rules.evidence_distance / 2.0 * misfit * size)


def other_starts(one: Hypothesis, base: Vector) -> list[Vector]:
    """Return starts of a single effect from all its own ones, beside fitted values of the base.

    An inertia that is larger by half moves a resonance past lines, so that chi-square does not
    decrease steadily on the way there; and values of the base that hide an effect lie far off.
    """
    (*others, last) = one.candidates
    if others or len(last.starts) == 1 or last.linear:
        return []
    return [np.append(base, start) for start in last.starts]


def _from_believed(base: Sequence[Parameter], one: Hypothesis) -> Vector:
    """Return the believed values of the base with the fitted ones of a set's effects."""
    believed = np.array([parameter.start for parameter in base])
    return np.append(believed, one.fit.values[len(believed) :])


def _other_shapes(
    best: Fit, one: Hypothesis, found: Iterable[Hypothesis], rules: Rules
) -> list[Vector]:
    """Return starts with other shapes for a set that does no better than a special case of it.

    A part of a law that has vanished during a fit has no shape that could lead it back.
    """
    special = {
        name
        for other in found
        if one.names != other.names
        and contains(one, other)
        and other.fit.chi_square - best.chi_square < rules.evidence_distance
        for name in other.names
    }
    starts = []
    for member, place in best.places if special else ():
        vanished = (member.name, member.port) not in special and not member.linear
        for shape in member.starts if len(member.starts) > 1 and vanished else ():
            start = best.values.copy()
            start[place.start + 1 : place.stop] = shape[1:]
            starts.append(start)
    return starts
