"""A fit in which the form of a law is free: the sizes of its corrections are unknowns, too.

Corrections are small, so that their response around a listed form is linear. Where the true form is
far from the listed one, as that of a load in a clutch, they have to be followed there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Evidence, Fit, fit
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
