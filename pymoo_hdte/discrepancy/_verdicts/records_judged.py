"""The verdict on the records of a drive: sets of effects grown on them, and what these decide.

With a clearance a drive whose load does not hold the tooth flanks together has no steady state that
could be fitted: such records are predicted without the clearance. Where they are fitted, they speak
against every set that has one, and for a soft wind-up, which follows the motion within it. So they
are judged last, and only where a set that is likely without them may explain them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import LawErrors
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decided import verdict_of
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.growth import (
    MOST_MEMBERS,
    NO_EXPERIENCE,
    Experience,
    Growth,
)
from pymoo_hdte.discrepancy._selection.screening import Screened
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.rattling import clearances, leading_sweep_effect
from pymoo_hdte.effects.effect import effect_named

MOST_RENEWED = MOST_MEMBERS + 1
"""Times that the noise may be renewed: with each effect that is found, and once with another form.
Sets that take turns in being the likeliest end it."""

Guess = Callable[..., list[Candidate]]
"""From data, the fit of their base, and perhaps a further one, to the effects that may be missing
from what they leave."""


class Judged(NamedTuple):
    """The data on the bench that they show, what they show, and what more data may start with."""

    data: Data
    verdict: Verdict
    experience: Experience


def judged(data: Data, base: Fit, candidates_of: Guess) -> Judged:
    """Return the verdict on some data, with the data that it is of.

    If sweeps speak for a clearance, records in which it would rattle are left out. If they speak
    for another effect, the others are judged first: that verdict is taken if it names a clearance
    beside another effect, and the verdict on all records is not sure.

    Parameters
    ----------
    data : Data
    base : Fit
        Of these data, without effects.
    candidates_of : callable
        See `Guess`.
    """
    leading = leading_sweep_effect(data, base, candidates_of(data, base))
    loaded = data if leading is None else data.loaded
    if loaded is data or leading is None:
        return _judged_on(data, base, candidates_of)
    of_loaded = _judged_on(loaded, fit(loaded), candidates_of)
    if effect_named(leading).rattles:
        return of_loaded
    if not _explains_by_a_clearance(of_loaded.verdict):
        return _judged_on(data, base, candidates_of, of_loaded.experience)
    overall = judged_if_explained(of_loaded, data, base, candidates_of, without=clearances())
    if overall is None or overall.verdict.status in ("unlisted", "partial"):
        return of_loaded
    return overall


def judged_if_explained(
    of_part: Judged, data: Data, base: Fit, candidates_of: Guess, without: Collection[str] = ()
) -> Judged | None:
    """Return the verdict on data of which a part was judged, or None.

    None where no set that is likely of the part, ``without`` some effects, may leave nothing of the
    data to something outside.
    """
    likely = [
        fitted
        for fitted in of_part.experience.likeliest
        if not {member.name for member in fitted.candidates} & set(without)
    ]
    if not likely:
        return None
    before = of_part.experience._replace(likeliest=likely)
    every, growth = _begun(data, base, candidates_of, before)
    if not growth.may_do_with_known:
        return None
    return _judged_by(growth, every, data, base, candidates_of)


def _judged_on(
    data: Data, base: Fit, candidates_of: Guess, before: Experience = NO_EXPERIENCE
) -> Judged:
    """Return the verdict on all these data, with the data on the bench that they show."""
    every, growth = _begun(data, base, candidates_of, before)
    return _judged_by(growth, every, data, base, candidates_of)


def _begun(data: Data, base: Fit, candidates_of: Guess, before: Experience) -> tuple[Data, Growth]:
    """Return the data of all records, with the noise of the set that was likeliest, and a growth.

    The likelihood of all records is that of those that are fitted, times the predictive density of
    those that are kept out of fits, with the same coefficients.
    """
    candidates, every = candidates_of(data, base), data.with_held_out
    for of_part in before.likeliest[:1]:
        fitted = fit(every, of_part.candidates, of_part.values)
        every = every.with_noise_of(fitted) or every
    of_every = base if every is data else fit(every, start=base.values)
    return every, _growth(every, of_every, candidates, candidates_of, before)


def _growth(
    data: Data,
    base: Fit,
    candidates: Sequence[Candidate],
    candidates_of: Guess,
    before: Experience,
    screened: dict[str, Screened] | None = None,
) -> Growth:
    guess = partial(candidates_of, data, base)
    return Growth(data, base, candidates, LawErrors(data, base), screened or {}, guess, before)


def _judged_by(growth: Growth, every: Data, data: Data, base: Fit, candidates_of: Guess) -> Judged:
    """Return the verdict by a growth on ``every`` record of some data."""
    known, growth = _grown(growth, every, candidates_of)
    decision, sets = growth.decide()
    likeliest, bench = sets[0].fit, data
    if known.reference is not data.reference:
        bench = replace(data, reference=known.reference, reference_effects=known.reference_effects)
    for nuisance, place in likeliest.places:
        if nuisance.nuisance:
            bench = bench.on_bench(nuisance, likeliest.values[place].tolist())
    verdict = verdict_of(bench, decision, sets, base if bench is data else None)
    return Judged(bench, verdict, growth.experience)


def _grown(growth: Growth, data: Data, candidates_of: Guess) -> tuple[Data, Growth]:
    """Return the sets of effects grown with the noise of the likeliest one, and the data with it.

    An effect that moves a resonance changes what an error that does not repeat brings to each
    channel, and one that creeps leaves what fades. Where the likeliest set does so, the sets are
    compared anew: without it, what creeps seemed to be further effects beside a hysteresis.
    """
    for _ in range(MOST_RENEWED):
        renewals = map(data.with_noise_of, growth.steps())
        renewed = next((renewed for renewed in renewals if renewed is not None), None)
        if renewed is None:
            return data, growth
        screened = {
            label: replace(effect, signatures=renewed.rewhitened(effect.signatures, data))
            for label, effect in growth.screened.items()
        }
        base, before = fit(renewed, start=growth.base.values), growth.experience
        growth = _growth(renewed, base, growth.candidates, candidates_of, before, screened)
        data = renewed
    growth.grow()
    return data, growth


def _explains_by_a_clearance(verdict: Verdict) -> bool:
    """Tell whether a clearance beside another effect is sure, perhaps as one of a class."""
    sure = verdict.status in ("named", "class")
    named = (verdict.chosen, *verdict.equivalent) if sure else ()
    several = [item.effects for item in named if item is not None and len(item.effects) > 1]
    members = [member for effects in several for member in effects if member.listed]
    return any(effect_named(member.name).rattles for member in members)
