"""The verdict, with or without the records in which a clearance would rattle.

With a clearance a drive whose load does not hold the tooth flanks together has no steady state that
could be fitted: such records are predicted without the clearance. Where they are fitted, they speak
against every set that has one, and for a soft wind-up, which follows the motion within it. Where
several plainly do not repeat with the input, they show a clearance by themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import LawErrors
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.decided import verdict_of
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.growth import (
    MOST_MEMBERS,
    NO_EXPERIENCE,
    Experience,
    Growth,
)
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._selection.screening import Screened
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.effects.effect import effect_named, known_effects

SUMMED = 8
"""Most lines whose sums and differences a steady motion is taken to have."""
LEAKED = 0.01
"""Share of a record's strongest line, in power, up to which a line may be what that one leaks."""
MOST_RENEWED = MOST_MEMBERS + 1
"""Times that the noise may be renewed: with each effect that is found, and once with another form.
Sets that take turns in being the likeliest end it."""
SAME_ORDER = 0.6
"""Cycles of an output turn up to which a line is of a steady order, which may lie between lines.

An order half-way between two lines shows in both.
"""


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


def is_heard(
    lines: Sequence[dict[float, float]],
    held: NDArray[np.bool_],
    orders: Sequence[float],
    ratio: float,
    rules: Rules = RULES,
) -> bool:
    """Tell whether records show by themselves that tooth flanks part.

    Flanks that part and meet again do not repeat with the input. Records whose load does not hold
    them together then have many lines that no steady motion has: a curved law makes only sums and
    differences of the lines that there are, however many of them.

    Parameters
    ----------
    lines : sequence of dict
        Of each record: see `features.unexpected_lines`.
    held : ndarray, shape (r,)
        Which records have a load that holds the flanks together: see `evidence.flanks_held`.
    orders : sequence of float
        Of the error, cycles per input turn. Lines of records with load count as well.
    ratio : float
    rules : Rules
    """
    with_load = [spectrum for spectrum, is_held in zip(lines, held, strict=True) if is_held]
    without = [spectrum for spectrum, is_held in zip(lines, held, strict=True) if not is_held]
    loaded = {order for spectrum in with_load for order in spectrum}
    if sum(len(spectrum) >= rules.rattling_trace for spectrum in without) < rules.fewest_rattling:
        return False
    of_error, steady = (
        _sums_of(known_orders, rules.highest_order, ratio)
        for known_orders in (orders, {*orders, *loaded})
    )
    irregular = np.array([_strong_beyond(spectrum, steady, ratio) for spectrum in without])
    rough = [_strong_beyond(spectrum, of_error, ratio) for spectrum in with_load]
    several = np.sum(irregular >= rules.rattling_trace) >= rules.fewest_rattling
    return bool(several and max(rough, default=0) < rules.rattling_lines <= irregular.max())


def _strong_beyond(lines: dict[float, float], steady: NDArray[np.float64], ratio: float) -> int:
    """Return the number of lines at no steady order; those that a strong one leaks are left out."""
    least = LEAKED * max(lines.values(), default=0.0)
    strong = np.array([order for order, power in lines.items() if power >= least])
    away = np.abs(np.subtract.outer(strong, steady)).min(axis=1)
    return int(np.sum(away > SAME_ORDER / ratio))


def _sums_of(orders: Collection[float], highest: float, ratio: float) -> NDArray[np.float64]:
    """Return the sums and differences of up to `SUMMED` orders, up to the highest.

    To a hundredth of a cycle of an output turn, so that they are not too many.
    """
    signed = np.array([0.0, *orders, *(-order for order in orders)])
    sums = np.zeros(1)
    for _ in range(SUMMED):
        sums = np.abs(np.add.outer(sums, signed)).ravel()
        sums = np.unique((100.0 * ratio * sums[sums <= highest]).round()) / (100.0 * ratio)
    return sums


def with_clearance(data: Data) -> Data:
    """Return the data without records that rattle, in which a clearance is evident.

    The same data where too few records are left.
    """
    loaded = data.loaded
    return data if loaded is data else replace(loaded, evident=clearances())


def clearances() -> frozenset[str]:
    """Return the names of the effects with which parts may lose contact."""
    return frozenset(effect.name for effect in known_effects() if effect.rattles)


def leading_sweep_effect(data: Data, fitted: Fit, candidates: Sequence[Candidate]) -> str | None:
    """Return the name of the effect that the torsion sweeps alone indicate, if any.

    At rest a clearance is a jump at zero torque that no other law imitates, whereas a running
    record with rattling has no steady state that would identify it.
    """
    base = fitted.values[None, : len(data.base)]
    before = data.torsion_residuals(base, fitted.effects)[0]
    layout = Layout(data.base)
    places = [layout.index(name) for name in ("stiffness", "output_torque_zero")]
    stiffness, offset = np.eye(len(data.base))[places]
    steps = np.array([0.01 * base[0, 0], data.campaign.torque_scale * 0.05])
    moved = np.vstack([base + steps[0] * stiffness, base + steps[1] * offset])
    imitated = (data.torsion_residuals(moved, fitted.effects) - before).T
    orthonormal, _ = np.linalg.qr(imitated)
    residual = before - orthonormal @ (orthonormal.T @ before)
    least, gains = data.rules.sweep_gain, list[tuple[float, str]]()
    for candidate in candidates:
        for start in candidate.starts if not candidate.nuisance else ():
            effects = (*fitted.effects, *candidate.build(start))
            change = np.nan_to_num(data.torsion_residuals(base, effects)[0] - before)
            change -= orthonormal @ (orthonormal.T @ change)
            size = float(change @ change)
            along = float(-change @ residual)
            if size > least and along > 0.0:
                gains.append((along**2 / size, candidate.name))
    reduction, name = max(gains, default=(0.0, ""))
    return name if reduction > least else None
