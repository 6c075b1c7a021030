"""Fits in which more is free than unknowns of effects: forms of laws, values beyond tolerances.

Corrections of a form are small, so that their response around a listed form is linear. Where the
true form is far from the listed one, as that of a load in a clutch, they have to be followed there:
their sizes are unknowns, too. And base parameters may want to leave their tolerances together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy._selection.screening import basis_of
from pymoo_hdte.effects.unknowns import unknown

_MOST = 300.0
"""Largest size of a correction, in units of its own. Set by hand on 2026-11-26: foreign forms on a
bench written apart took 50 at most."""


def in_free_form(data: Evidence, fitted: Fit) -> Fit:
    """Return a set of effects fitted further with the sizes of its corrections as unknowns.

    So far as to rank it: around the end, what forms could still do is taken to first order. The
    same fit if none of them can be larger: see `_freed`.
    """
    freed = [_freed(each, data.corrections(each) or ()) for each in fitted.candidates]
    start = [fitted.values[: fitted.n_base]]
    for (each, place), more in zip(fitted.places, freed, strict=True):
        start += [fitted.values[place], np.zeros(len(more.parameters) - len(each.parameters))]
    values = np.concatenate(start)
    if len(values) == len(fitted.values):
        return fitted
    return fit(data, freed, values, settled=data.rules.trial_gain)


def _freed(candidate: Candidate, corrections: Sequence[Any]) -> Candidate:
    """Return a candidate with the sizes of its corrections as unknowns beside its own.

    Those that have no ``times``, or none but themselves, are left out: data are close to linear in
    lines and drifts, and laws of the library do more than their force.
    """
    own = len(candidate.parameters)
    sized = [one for one in corrections if hasattr(one, "times") and one.times(1.0) is not None]
    names = [f"correction_{number}" for number in range(len(sized))]
    sizes = [unknown(name, -_MOST, _MOST, 1.0, linear=True) for name in names]

    def build(values: Sequence[float]) -> tuple[Any, ...]:
        added = zip(sized, values[own:], strict=True)
        return (*candidate.build(values[:own]), *(one.times(size) for one, size in added if size))

    starts = tuple((*start, *(0.0 for _ in sized)) for start in candidate.starts)
    parameters = (*candidate.parameters, *sizes)
    return replace(candidate, parameters=parameters, starts=starts, build=build)


def freed_together(data: Evidence, fitted: Fit) -> tuple[tuple[Candidate, ...], Fit]:
    """Return the parameters that a fit leaves at a bound, free, and its set fitted with them.

    Freeing some may carry others to their bounds, which are freed in a further round.
    """
    freed: tuple[Candidate, ...] = ()
    found = fitted
    for _ in range(data.rules.most_freed_rounds):
        names = {one.frees for one in freed}
        free = data.out_of_tolerance(found.at_bounds, together=True)
        more = [one for one in free if one.frees not in names]
        if not more:
            break
        freed = (*freed, *more)
        found = fit(data, (*fitted.candidates, *freed), found.values, settled=data.rules.trial_gain)
    return freed, found


def gain_of_freed(fitted: Fit, freed: Sequence[Candidate]) -> float:
    """Return by how much chi-square would fall if parameters that a fit left at bounds were free.

    To first order. For 22 of 25 sets of the blind bench that was right to 0.05 of the chi-square
    that they left beyond the noise, for the others to 0.27.
    """
    free = fitted.bound_sides == 0.0
    names = {one.frees for one in freed}
    wider = free | [one.name in names for one in fitted.parameters]
    removed = [
        float(np.sum((basis_of(fitted.jacobian[:, each]).T @ fitted.residuals) ** 2))
        for each in (free, wider)
    ]
    return removed[1] - removed[0]
