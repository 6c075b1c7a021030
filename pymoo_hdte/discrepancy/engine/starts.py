"""Fits of a set of effects from several starts, so that they do not end at a local minimum."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis, contains
from pymoo_hdte.discrepancy.engine.levenberg_marquardt import SAME
from pymoo_hdte.discrepancy.engine.rules import Rules
from pymoo_hdte.discrepancy.engine.screening import basis_of
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]


def best_fit(
    data: Evidence, one: Hypothesis, starts: Sequence[Vector], found: Iterable[Hypothesis]
) -> Fit:
    """Return the best fit of a set from its values, the believed base and other starts.

    A fit ends where it arrives at an earlier one.

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

    def follow(further: Iterable[Vector]) -> Fit:
        for start in further:
            if again := _fit_from(data, fits, start):
                fits.append(again)
        return _least(fits)

    best = follow((_from_believed(data.base, fits[0]), *starts))
    return follow(_other_shapes(best, one, found, data.rules))


def _least(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda each: each.chi_square)


def _fit_from(data: Evidence, fits: Sequence[Fit], start: Vector) -> Fit | None:
    """Return a fit from a start; None where it is not expected to end lower than the best one.

    The derivatives of the best one serve for the first steps where they foretell the residuals at
    the start: where what else changes there is no larger. So a start that leads back costs a few
    evaluations, and one beyond a kink of a law, as of a friction whose load changes sign, ends
    lower. Where effects have other values, what their own unknowns do counts: a law that has
    vanished foretells nothing of a new shape. From there a fit takes its own derivatives, unless
    what is not foretold could remove nothing of what the best one leaves.
    """
    best = _least(fits)
    problem = data.objective(best.candidates)
    way = (np.clip(start, problem.lower, problem.upper) - best.values) / problem.scale
    begin = replace(best, values=best.values + way * problem.scale)
    changes = best.jacobian * way
    foretold = changes.sum(axis=1)
    beyond = problem.residuals(begin.values) - best.residuals - foretold
    reshaped = way[best.n_base :].any()
    by_derivatives = changes[:, best.n_base :].sum(axis=1) if reshaped else foretold
    if beyond @ beyond <= by_derivatives @ by_derivatives:
        same = foretold @ foretold <= SAME * best.misfit
        return None if same else fit(data, best.candidates, begin, known=fits)
    return fit(data, best.candidates, start, known=fits) if _could_remove(best, beyond) else None


def _could_remove(best: Fit, change: Vector) -> bool:
    """Tell whether a change of residuals, in any strength, could leave less than a fit does.

    By more than `SAME`, beside the unknowns that are at no bound. What is not finite may.
    """
    if not np.isfinite(change).all():
        return True
    by_unknowns = basis_of(best.jacobian[:, best.bound_sides == 0.0])
    beside = change - by_unknowns @ (by_unknowns.T @ change)
    return bool((beside @ best.residuals) ** 2 > SAME * best.misfit * (beside @ beside))


def other_starts(one: Hypothesis, base: Vector) -> list[Vector]:
    """Return starts of a single effect from all its own ones, beside fitted values of the base.

    An inertia that is larger by half moves a resonance past lines, so that chi-square does not
    decrease steadily on the way there; and values of the base that hide an effect lie far off.
    """
    (*others, last) = one.candidates
    if others or len(last.starts) == 1 or last.linear:
        return []
    return [np.append(base, start) for start in last.starts]


def _from_believed(base: Sequence[Parameter], fitted: Fit) -> Vector:
    """Return the believed values of the base with the fitted ones of a set's effects."""
    believed = np.array([parameter.start for parameter in base])
    return np.append(believed, fitted.values[len(believed) :])


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
