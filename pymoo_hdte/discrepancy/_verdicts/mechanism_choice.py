"""Which explanation of a mechanism's records is named, and what forbids to name it plainly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import share_removed
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import holds_zero, reasons_of, uncertain
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    bounded_unknowns,
    contains,
    contradicted_parts,
    down_to_noise,
    hypothesis_of,
    label_of,
)
from pymoo_hdte.discrepancy._selection.reason import (
    AT_TOLERANCE,
    EXPLAINS_TOO_LITTLE,
    RICHER_AT_BOUND,
    RICHER_LEAVES_LESS,
    Reason,
)
from pymoo_hdte.discrepancy._selection.search import Search
from pymoo_hdte.discrepancy._selection.verdict import Verdict, judge
from pymoo_hdte.mechanism.believed import SMALLEST_SHARE

_NAMING = ("named", "class", "partial")


def judged(
    sensors: MeasuredData,
    data: MeasuredData,
    candidates: Sequence[Candidate],
    best: Hypothesis | None = None,
) -> Verdict:
    """Return the verdict in units of the residual, if it also holds against the sensors' noise.

    Parameters
    ----------
    sensors, data : MeasuredData
        With the noise of the sensors, and with the unexplained residual as noise.
    candidates : sequence of Candidate
    best : Hypothesis, optional
        Effects beyond whose residual others are judged, so that they are judged themselves.
    """
    base, rules = fit(data), data.rules
    searched = [candidate for candidate in candidates if not candidate.instead_of]
    verdict, added = _compared(data, base, searched, best)
    verdict = _mostly_explained(sensors, data, verdict)
    verdict = _simplest(data, verdict)
    verdict = _with_true_rivals(data, _within_bounds(sensors, data, verdict))
    verdict = _with_substitutes(data, verdict, candidates)
    before, noise = data.power(base.residuals), sensors.power(np.ones_like(base.residuals))
    if verdict.chosen is None:
        quiet = np.all(before <= rules.noise_power_ratio * noise)
        return verdict if quiet else _as_unlisted(verdict, None)
    removed = share_removed(sensors, data, base, verdict.chosen.fit)
    freed = [candidate.releases for candidate in verdict.chosen.candidates]
    out = any(parameter in verdict.chosen.fit.at_bounds for parameter in freed if parameter)
    least = rules.explained_share if verdict.status == "parameter" else rules.main_share
    if removed < least or out:
        return _as_unlisted(verdict, verdict.chosen)
    chosen = _largest_first(data, verdict.chosen)
    verdict = replace(verdict, chosen=chosen)
    # The best effects define the noise, so that they fit down to it in any case.
    among = best is not None and label_of(chosen.candidates) <= label_of(best.candidates)
    own_noise = added or among
    little = own_noise and verdict.status == "named" and removed < rules.explained_share
    # What a real machine leaves is coloured, and the intervals that are printed are wider by that.
    stated = Spread(data, chosen.fit)
    scale = stated.reach / rules.certain_deviations
    unsure = uncertain(chosen.fit, rules, stated.covariance * np.outer(scale, scale))
    of_zeros = [reason for reason in holds_zero(unsure) if reason not in verdict.reasons]
    richer = _much_richer(data, verdict, chosen)
    return verdict.with_caveats([_too_little(removed)] * little + of_zeros + richer)


def _compared(
    data: MeasuredData, base: Fit, candidates: Sequence[Candidate], best: Hypothesis | None
) -> tuple[Verdict, bool]:
    """Return the verdict on the sets of a search, and whether the best effects were added to them.

    They are if the search finds nothing to name and missed them.

    A search extends a set by what could remove most of what it leaves, to first order. That may be
    nothing for one of two effects between which the base lies: springs that slip and a spring that
    hardens are found together only. Some of the best effects may do, so that they are tried, too.
    """
    verdict = judge(data, base, candidates)
    if verdict.status != "unlisted" or verdict.chosen is None or best is None:
        return verdict, False
    hypotheses = [verdict.chosen, *verdict.alternatives]
    if label_of(best.candidates) in [label_of(hypothesis.candidates) for hypothesis in hypotheses]:
        return verdict, False
    some = [
        subset
        for n in range(len(best.candidates))
        for subset in combinations(best.candidates, n + 1)
    ]
    excess = base.chi_square - verdict.degrees_of_freedom
    hypotheses += [
        hypothesis_of(fit(data, subset, best.values_of(subset)), excess) for subset in some
    ]
    return judge(
        data, base, candidates, sorted(hypotheses, key=lambda hypothesis: hypothesis.bic)
    ), True


def _much_richer(data: MeasuredData, verdict: Verdict, chosen: Hypothesis) -> list[Reason]:
    """Return that a further effect would remove most of what a set leaves, if one would.

    Small beside the misfit of the base, it is not named: what is left may be the form of a law.
    """
    rules, power = data.rules, data.power(chosen.fit.residuals)
    richer = [
        hypothesis
        for hypothesis in verdict.alternatives
        if label_of(hypothesis.candidates) > label_of(chosen.candidates)
        and not _bounded(hypothesis.fit)
        and not uncertain(hypothesis.fit, rules)
    ]
    if not richer:
        return []
    best = min(richer, key=lambda hypothesis: hypothesis.bic)
    share = float(np.max(data.power(best.fit.residuals) / power))
    if share > 1.0 - rules.second_share:
        return []
    return [Reason.of(RICHER_LEAVES_LESS, best.label, {"share": share})]


def _largest_first(data: MeasuredData, hypothesis: Hypothesis) -> Hypothesis:
    """Return a set with its effects in the order of their forces, the largest first.

    A search finds them in another one: beside a large force that the base imitates, as damping does
    dry friction, a small one that it does not imitate explains more.
    """
    fitted, places = hypothesis.fit, [place for _, place in hypothesis.fit.places]
    base = fitted.values[: fitted.n_base]
    forces = (data.whitened_forces(base, effects) for effects in fitted.effects_by_candidate)
    order = np.argsort([-float(force @ force) for force in forces], kind="stable")
    columns = np.r_[: fitted.n_base, *(places[k] for k in order)]
    in_order = replace(
        fitted,
        candidates=tuple(fitted.candidates[k] for k in order),
        parameters=tuple(fitted.parameters[k] for k in columns),
        values=fitted.values[columns],
        jacobian=fitted.jacobian[:, columns],
    )
    return replace(hypothesis, fit=in_order)


def _mostly_explained(sensors: MeasuredData, data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict with a nearest effect that explains nearly enough for a name as partial.

    What it leaves may be several effects, none of them large enough to be earned.
    """
    chosen, rules = verdict.chosen, data.rules
    if chosen is None or verdict.status != "unlisted" or not chosen.listed:
        return verdict
    if chosen.released:
        return verdict
    removed = share_removed(sensors, data, verdict.base, chosen.fit)
    if removed < rules.partial_share or contradicted_parts(data, verdict.base, chosen.fit).any():
        return verdict
    rivals = [
        hypothesis
        for hypothesis in verdict.alternatives
        if len(hypothesis.candidates) == len(chosen.candidates)
        and hypothesis.names != chosen.names
        and _does_as_well(data, hypothesis.fit, chosen.fit)
    ]
    reasons = (*_reasons(data, verdict.base, chosen), _too_little(removed))
    return _with_rivals(replace(verdict, reasons=reasons), rivals)


def _too_little(removed: float) -> Reason:
    return Reason.of(EXPLAINS_TOO_LITTLE, numbers={"share": removed})


def _simplest(data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict with the model of fewest unknowns that fits nearly as well as the best.

    With many samples the evidence prefers a richer law, or a second effect, for a minimal reduction
    of a residual that is no noise.
    """
    chosen = verdict.chosen
    if chosen is None or verdict.status not in _NAMING:
        return verdict
    simpler = [
        hypothesis
        for hypothesis in verdict.alternatives
        if all(candidate.releases is None for candidate in hypothesis.candidates)
        and _unknowns(hypothesis) < _unknowns(chosen)
        and _does_as_well(data, hypothesis.fit, chosen.fit)
    ]
    if not simpler:
        return _choosing(data, verdict, chosen)
    return _choosing(
        data, verdict, min(simpler, key=lambda hypothesis: (_unknowns(hypothesis), hypothesis.bic))
    )


def _within_bounds(sensors: MeasuredData, data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict with another set than one that ended at a bound, if there is one.

    A further effect that takes it off the bound and leaves nothing is earned by that. Else, at the
    bound of a law lies a simpler one, or one that these records do not show. What is certain is the
    simpler one, as long as it explains most of the misfit; what it leaves is a caveat.
    """
    chosen = verdict.chosen
    if chosen is None or verdict.status not in _NAMING or not _bounded(chosen.fit):
        return verdict
    degrees_of_freedom = verdict.degrees_of_freedom
    larger = [
        hypothesis
        for hypothesis in verdict.alternatives
        if label_of(hypothesis.candidates) > label_of(chosen.candidates)
        and len(hypothesis.candidates) == len(chosen.candidates) + 1
        and not _reasons(data, verdict.base, hypothesis)
        and down_to_noise(hypothesis.fit, degrees_of_freedom, data.rules)
    ]
    if larger:
        return _choosing(data, verdict, min(larger, key=lambda hypothesis: hypothesis.bic))
    simpler = [
        hypothesis
        for hypothesis in verdict.alternatives
        if hypothesis.names != chosen.names
        and contains(chosen, hypothesis)
        and not _bounded(hypothesis.fit)
        and share_removed(sensors, data, verdict.base, hypothesis.fit) >= data.rules.main_share
        and not contradicted_parts(data, verdict.base, hypothesis.fit).any()
    ]
    if not simpler:
        return verdict
    reason = Reason(RICHER_AT_BOUND, chosen.label, tuple(_bounded(chosen.fit)))
    return _choosing(data, verdict, min(simpler, key=lambda hypothesis: hypothesis.bic), reason)


def _choosing(
    data: MeasuredData, verdict: Verdict, preferred: Hypothesis, *further: Reason
) -> Verdict:
    """Return the verdict with another of its sets as the chosen one, and further reasons."""
    assert verdict.chosen is not None
    others = tuple(
        hypothesis
        for hypothesis in (verdict.chosen, *verdict.alternatives)
        if hypothesis is not preferred
    )
    rivals = (
        hypothesis
        for hypothesis in verdict.equivalent
        if hypothesis is not preferred and len(hypothesis.members) == len(preferred.members)
    )
    reasons = (*_reasons(data, verdict.base, preferred), *further)
    return _with_rivals(
        replace(verdict, chosen=preferred, alternatives=others, reasons=reasons), rivals
    )


def _with_true_rivals(data: MeasuredData, verdict: Verdict) -> Verdict:
    """Return the verdict without hypotheses that fit a balance worse, or contain the chosen one.

    A law that contains the chosen one and fits no better is not a different explanation.
    """
    chosen = verdict.chosen
    if chosen is None or verdict.status != "class":
        return verdict
    equivalent = (
        hypothesis
        for hypothesis in verdict.equivalent
        if _does_as_well(data, hypothesis.fit, chosen.fit) and not contains(hypothesis, chosen)
    )
    return _with_rivals(verdict, equivalent)


def _with_substitutes(
    data: MeasuredData, verdict: Verdict, candidates: Sequence[Candidate]
) -> Verdict:
    """Return the verdict with rivals that have something else in the place of an effect."""
    chosen = verdict.chosen
    if chosen is None or verdict.status not in _NAMING:
        return verdict
    rivals = list(verdict.equivalent)
    for member in chosen.candidates:
        others = tuple(candidate for candidate in chosen.candidates if candidate is not member)
        for substitute in candidates:
            if substitute.replaces(member) and all(
                substitute.goes_with(candidate) for candidate in others
            ):
                start = np.append(chosen.values_of(others), substitute.starts[0])
                fitted = fit(data, (*others, substitute), start)
                if _does_as_well(data, fitted, chosen.fit):
                    excess = verdict.base.chi_square - verdict.degrees_of_freedom
                    rivals.append(hypothesis_of(fitted, excess))
    return _with_rivals(verdict, rivals) if len(rivals) > len(verdict.equivalent) else verdict


def _with_rivals(verdict: Verdict, equivalent: Iterable[Hypothesis]) -> Verdict:
    """Return the verdict with other hypotheses that explain as much, which make it a class.

    Without any, reasons against it make it partial.
    """
    return replace(verdict, certain=True, equivalent=tuple(equivalent))


def _reasons(data: MeasuredData, base: Fit, chosen: Hypothesis) -> list[Reason]:
    """Return what forbids to name a set plainly: of its effects, and bounds of believed values.

    A value that ended at zero, or at the least that a fit knows, is a part that the machine does
    not have.
    """
    fitted = chosen.fit
    stuck = [
        parameter.name
        for parameter, side in zip(data.base, fitted.bound_sides, strict=False)
        if side > 0.0
        or (side < 0.0 and parameter.lower not in (0.0, SMALLEST_SHARE * parameter.start))
    ]
    of_effects = reasons_of(Search(data, base, ()), chosen, None)
    return of_effects + [Reason(AT_TOLERANCE, name) for name in stuck]


def _does_as_well(data: MeasuredData, fitted: Fit, chosen: Fit) -> bool:
    """Tell whether a fit leaves about as little as the chosen one, in every balance."""
    most = data.rules.parsimony_ratio * data.power(chosen.residuals)
    return bool(np.all(data.power(fitted.residuals) <= most))


def _bounded(fitted: Fit) -> list[tuple[str, float]]:
    """Return the unknowns of effects that ended at a bound, with their values."""
    return [item for _, values in bounded_unknowns(fitted) for item in values.items()]


def _unknowns(hypothesis: Hypothesis) -> int:
    return sum(candidate.unknowns for candidate in hypothesis.candidates)


def _as_unlisted(verdict: Verdict, nearest: Hypothesis | None) -> Verdict:
    return replace(verdict, certain=False, chosen=nearest, equivalent=())
