"""Fits of a set of effects from several starts, so that they do not end at a local minimum."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, contains
from pymoo_hdte.discrepancy._selection.levenberg_marquardt import SAME, turned, way
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.screening import basis_of
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]


def best_fit(
    data: Evidence,
    hypothesis: Hypothesis,
    starts: Sequence[Vector],
    hypotheses: Collection[Hypothesis],
) -> Fit:
    """Return the best fit of a set from its values, the nominal base and other starts.

    A fit ends where it arrives at an earlier one.

    Parameters
    ----------
    data : Evidence
    one : Hypothesis
        Set, fitted at least well enough to rank it.
    starts : sequence of ndarray, shape (n_parameters,)
        Starts in addition to its own values and those with the nominal base.
    hypotheses : collection of Hypothesis
        Sets that it may contain. If it does no better than one of them, other shapes are tried.
    """
    fits = [fit(data, hypothesis.candidates, hypothesis.fit)]

    def follow(further: Iterable[Vector]) -> Fit:
        for start in further:
            if again := _fit_from(data, fits, start):
                fits.append(again)
        return _least(fits)

    # Of several effects all but one come from a set that was fitted so.
    alone = len(hypothesis.candidates) == 1
    best = follow([*([_from_nominal(data.base, fits[0])] if alone else []), *starts])
    best = follow(_other_shapes(best, _no_better(best, hypothesis, hypotheses, data.rules)))
    return follow(_other_ends(best, _no_better(best, hypothesis, hypotheses, data.rules)))


def _least(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda fitted: fitted.chi_square)


def _fit_from(data: Evidence, fits: Sequence[Fit], start: Vector) -> Fit | None:
    """Return a fit from a start; None if it is not expected to end lower than the best one.

    Derivatives of the best fit serve for the first steps if they predict the residuals at the start
    well, so that a start that leads back costs few evaluations. If effects have other values,
    the prediction by their own unknowns counts, since a law that has vanished predicts nothing of a
    new shape. Otherwise the fit computes its own derivatives, unless the part that is not predicted
    could remove nothing of what the best fit leaves.
    """
    best = _least(fits)
    problem = data.objective(best.candidates)
    to = np.clip(start, problem.lower, problem.upper)
    begin = replace(best, values=to, jacobian=turned(problem, best.values, to, best.jacobian))
    step = way(problem, best.values, to)
    changes = best.jacobian * step
    foretold = changes.sum(axis=1)
    beyond = problem.residuals(to) - best.residuals - foretold
    reshaped = step[best.n_base :].any()
    by_derivatives = changes[:, best.n_base :].sum(axis=1) if reshaped else foretold
    if beyond @ beyond <= max(by_derivatives @ by_derivatives, SAME * best.misfit):
        same = foretold @ foretold <= SAME * best.misfit
        return None if same else fit(data, best.candidates, begin, known=fits)
    return fit(data, best.candidates, start, known=fits) if _could_remove(best, beyond) else None


def _could_remove(best: Fit, change: Vector) -> bool:
    """Tell whether a change of residuals, in any strength, could improve a fit by more than `SAME`.

    Unknowns at no bound are fitted beside it. A change that is not finite could always.
    """
    if not np.isfinite(change).all():
        return True
    by_unknowns = basis_of(best.jacobian[:, best.bound_sides == 0.0])
    beside = change - by_unknowns @ (by_unknowns.T @ change)
    return bool((beside @ best.residuals) ** 2 > SAME * best.misfit * (beside @ beside))


def other_starts(hypothesis: Hypothesis, base: Vector) -> list[Vector]:
    """Return all starts of a single effect, each beside the fitted values of the base.

    An inertia larger by half moves a resonance past lines, so that chi-square does not decrease
    steadily on the way there. Values of the base that hide an effect are far off as well.
    """
    (*others, effect) = hypothesis.candidates
    if others or len(effect.starts) == 1 or effect.linear:
        return []
    return [np.append(base, start) for start in effect.starts]


def _from_nominal(base: Sequence[Parameter], fitted: Fit) -> Vector:
    """Return the nominal values of the base with the fitted values of a set's effects."""
    nominal = np.array([parameter.start for parameter in base])
    return np.append(nominal, fitted.values[len(nominal) :])


def _no_better(
    best: Fit, hypothesis: Hypothesis, hypotheses: Iterable[Hypothesis], rules: Rules
) -> list[tuple[Candidate, slice]]:
    """Return the laws by which a set does no better than a special case of it.

    Only laws with starts of several shapes are returned, each with the place of its shape, that is
    of all values but the strength.
    """
    special = {
        name
        for special_case in hypotheses
        if hypothesis.names != special_case.names
        and contains(hypothesis, special_case)
        and special_case.fit.chi_square - best.chi_square < rules.evidence_distance
        for name in special_case.names
    }
    return [
        (member, slice(place.start + 1, place.stop))
        for member, place in (best.places if special else ())
        if (member.name, member.port) not in special
        and len(member.starts) > 1
        and not member.linear
    ]


def _other_shapes(best: Fit, laws: Iterable[tuple[Candidate, slice]]) -> list[Vector]:
    """Return starts with all shapes of laws that do no better than a special case.

    A part of a law that has vanished during a fit has no shape that could lead it back.
    """
    starts = []
    for member, place in laws:
        for shape in member.starts:
            start = best.values.copy()
            start[place] = shape[1:]
            starts.append(start)
    return starts


def _other_ends(best: Fit, laws: Iterable[tuple[Candidate, slice]]) -> list[Vector]:
    """Return starts at the opposite bound of shapes of such laws that ended at a bound.

    What a law adds to its special case may vanish between the bounds of a shape, so that no slope
    leads across: excess friction may fade at once or nowhere. A value counts as a shape if the
    starts of the law differ in it; other values at a bound begin as in the first start.
    """
    starts = []
    for member, place in laws:
        layout, sides = Layout(member.parameters[1:]), best.bound_sides[place]
        first_shape, *other_shapes = np.array(member.starts)[:, 1:]
        moved = sides * np.any(other_shapes != first_shape, axis=0)
        ends = [layout.array("upper"), layout.array("lower"), first_shape]
        start = best.values.copy()
        start[place] = np.select([moved < 0.0, moved > 0.0, sides != 0.0], ends, start[place])
        if moved.any():
            starts.append(start)
    return starts
