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
    same fit if none of them can be larger: see `_with_free_form`.
    """
    released = [
        _with_free_form(candidate, data.corrections(candidate) or ())
        for candidate in fitted.candidates
    ]
    start = [fitted.values[: fitted.n_base]]
    for (candidate, place), corrected in zip(fitted.places, released, strict=True):
        start += [
            fitted.values[place],
            np.zeros(len(corrected.parameters) - len(candidate.parameters)),
        ]
    values = np.concatenate(start)
    if len(values) == len(fitted.values):
        return fitted
    return fit(data, released, values, settled=data.rules.trial_gain)


def _with_free_form(candidate: Candidate, corrections: Sequence[Any]) -> Candidate:
    """Return a candidate with the sizes of its corrections as unknowns beside its own.

    Those that have no ``times``, or none but themselves, are left out: data are close to linear in
    lines and drifts, and laws of the library do more than their force.
    """
    own = len(candidate.parameters)
    sized = [
        correction
        for correction in corrections
        if hasattr(correction, "times") and correction.times(1.0) is not None
    ]
    names = [f"correction_{number}" for number in range(len(sized))]
    sizes = [unknown(name, -_MOST, _MOST, 1.0, linear=True) for name in names]

    def build(values: Sequence[float]) -> tuple[Any, ...]:
        added = zip(sized, values[own:], strict=True)
        return (
            *candidate.build(values[:own]),
            *(correction.times(size) for correction, size in added if size),
        )

    starts = tuple((*start, *(0.0 for _ in sized)) for start in candidate.starts)
    parameters = (*candidate.parameters, *sizes)
    return replace(candidate, parameters=parameters, starts=starts, build=build)


def released_together(data: Evidence, fitted: Fit) -> tuple[tuple[Candidate, ...], Fit]:
    """Return the parameters that a fit leaves at a bound, free, and its set fitted with them.

    Freeing some may carry others to their bounds, which are released in a further round.
    """
    released: tuple[Candidate, ...] = ()
    released_fit = fitted
    for _ in range(data.rules.most_freed_rounds):
        names = {candidate.releases for candidate in released}
        bounded = data.out_of_tolerance(released_fit.at_bounds, together=True)
        further = [candidate for candidate in bounded if candidate.releases not in names]
        if not further:
            break
        released = (*released, *further)
        released_fit = fit(
            data,
            (*fitted.candidates, *released),
            released_fit.values,
            settled=data.rules.trial_gain,
        )
    return released, released_fit


def gain_of_released(fitted: Fit, released: Sequence[Candidate]) -> float:
    """Return by how much chi-square would fall if parameters that a fit left at bounds were free.

    To first order. For 22 of 25 sets of the blind bench that was right to 0.05 of the chi-square
    that they left beyond the noise, for the others to 0.27.
    """
    movable = fitted.bound_sides == 0.0
    names = {candidate.releases for candidate in released}
    wider = movable | [parameter.name in names for parameter in fitted.parameters]
    removed = [
        float(np.sum((basis_of(fitted.jacobian[:, columns]).T @ fitted.residuals) ** 2))
        for columns in (movable, wider)
    ]
    return removed[1] - removed[0]
