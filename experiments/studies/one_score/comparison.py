"""The decision of the score on the fits of a search, beside the verdict that was given on them."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.law_errors import BalanceErrors
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import LawErrors
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decision import Decision, Explanation, decide, log_prior
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, fit_all
from pymoo_hdte.discrepancy._selection.score import Linearised, score, score_with_outside
from pymoo_hdte.discrepancy._selection.screening import screen, varied
from pymoo_hdte.discrepancy._selection.verdict import Verdict

MOST_SETS = 25
"""Sets that are scored, the best by the evidence of their fits."""
MOST_OUTSIDE = 6
"""Sets beside which something outside of the library is looked for, the likeliest without it."""


@dataclass(frozen=True, eq=False)
class Scored:
    """One explanation with the prior that it is weighed with."""

    explanation: Explanation
    prior: float
    chi_square: float
    places: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Comparison:
    """What the score says of a search.

    Attributes
    ----------
    decision : Decision
    scored : tuple of Scored
        The likeliest first.
    seconds : float
        Of processor time.
    """

    decision: Decision
    scored: tuple[Scored, ...]
    seconds: float


def errors_of(data: Any, fits: Mapping[Hypothesis | None, Fit]) -> LawErrors | BalanceErrors:
    """Return what tells the score about the data of fits, of which that of nothing is the base."""
    if isinstance(data, MeasuredData):
        return BalanceErrors(data, fits[None])
    return LawErrors(data, fits[None])


def with_held_out(data: Any) -> Any:
    """Return the data of a drive with the records kept out of fits; other data as they are."""
    if isinstance(data, MeasuredData) or (held_out := data.held_out) is None:
        return data
    records = (*data.features.records, *held_out.features.records)
    orders = data.features.orders.tolist()
    return replace(data, features=measure(data.campaign, records, orders, data.rules))


def compare(
    data: Any, verdict: Verdict, candidates: Sequence[Candidate], held_out: bool = False
) -> Comparison:
    """Return the score's decision on the sets that a verdict compared.

    Parameters
    ----------
    data : Data or MeasuredData
        That the verdict is of.
    verdict : Verdict
    candidates : sequence of Candidate
        All that were searched for, among which the prior of a name is shared.
    held_out : bool
        Whether records kept out of the fits count as well: the likelihood of all records is that of
        those that were fitted, times the predictive density of the others.
    """
    started = time.process_time()
    every = _sets(verdict)
    if len(every) == 1:
        every += _singles(data, verdict.base, candidates)
    fits = {item: verdict.base if item is None else item.fit for item in every}
    if held_out:
        data = with_held_out(data)
        fits = {item: fit(data, f.candidates, f.values, steps=0) for item, f in fits.items()}
    errors = errors_of(data, fits)
    counts = Counter(candidate.name for candidate in candidates)
    counts["parameter"] = sum(parameter.name != "offset" for parameter in data.base)
    sets = sorted(every, key=lambda item: fits[item].evidence)[:MOST_SETS]
    found = list[tuple[Hypothesis | None, Linearised, Scored]]()
    for item in {*sets, None}:
        fitted = fits[item]
        linearised = errors.linearised(fitted)
        result = score(linearised)
        if not result.invisible:
            found.append((item, linearised, _scored(item, fitted, result, counts, errors.groups)))
    found.sort(key=lambda entry: -(entry[2].explanation.ln + entry[2].prior))
    scored = [entry[2] for entry in found]
    for number, (item, linearised, _) in enumerate(found):
        if number < MOST_OUTSIDE or item is None:
            result, places = score_with_outside(linearised, errors.outside)
            fitted = fits[item]
            scored.append(_scored(item, fitted, result, counts, errors.groups, True, places))
    scored.sort(key=lambda entry: -(entry.explanation.ln + entry.prior))
    decision = decide([entry.explanation for entry in scored], [entry.prior for entry in scored])
    return Comparison(decision, tuple(scored), time.process_time() - started)


def _singles(data: Any, base: Fit, candidates: Sequence[Candidate]) -> list[Hypothesis]:
    """Return the single effects that may explain most where no search was made."""
    searched = [candidate for candidate in candidates if not candidate.instead_of]
    shortlisted = varied(screen(data, base, searched), 1)[:MOST_OUTSIDE]
    return fit_all(data, base, [effect for effect in shortlisted if effect.start], 0.0)


def _sets(verdict: Verdict) -> list[Hypothesis | None]:
    chosen = [] if verdict.chosen is None else [verdict.chosen]
    return [None, *chosen, *verdict.alternatives]


def _scored(
    item: Hypothesis | None,
    fitted: Fit,
    result: Any,
    counts: Counter[str],
    groups: Sequence[Any],
    outside: bool = False,
    places: Sequence[str] = (),
) -> Scored:
    members = () if item is None else item.candidates
    names = [candidate.named_effect for candidate in members]
    forms = [max(counts[candidate.name], 1) for candidate in members]
    explanation = Explanation(
        "nothing" if item is None else item.label,
        frozenset(names),
        result.ln,
        outside,
        result.worst_chance(groups),
        bool(members) and all(candidate.releases is not None for candidate in members),
    )
    prior = log_prior(names, forms, outside)
    return Scored(explanation, prior, fitted.chi_square, tuple(places))
