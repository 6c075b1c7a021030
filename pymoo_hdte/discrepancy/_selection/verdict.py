"""The verdict: whether an effect is missing, which one it is, and how certain the answer is.

Of a drive, and of a machine of one's own, the posterior decides: see `decided`. Of mechanisms rules
do. The base is fitted within its tolerances first. If it is not adequate, candidates are screened,
the best few are fitted jointly with the base, and the one with the least BIC is named, provided
that it removes most of the excess, and at least half of it in each part of the data. Hypotheses
that the data cannot separate from it are named with it. A second effect must remove most of the
first one's residual, in total or in the part that the first explains worst. What stands out from
all else but leaves more than noise is named in part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pymoo_hdte.discrepancy._selection import probability
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.caveats import (
    above_noise,
    reasons_of,
)
from pymoo_hdte.discrepancy._selection.choice import replaced
from pymoo_hdte.discrepancy._selection.equivalents import (
    Answer,
    answer_of,
    chosen_of,
    complete,
    distinct,
)
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitted_sets import beyond_stated
from pymoo_hdte.discrepancy._selection.fitting import Fit, JudgedEvidence
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, down_to_noise
from pymoo_hdte.discrepancy._selection.reason import (
    HELD_OUT_ERROR_GROWS,
    NOT_VALIDATED,
    Reason,
)
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._selection.screening import screen
from pymoo_hdte.discrepancy._selection.search import Search

STATUSES = ("adequate", "named", "class", "parameter", "unlisted", "partial")
EXPLAINED = ("named", "class", "parameter", "partial")
"""Statuses that say what is missing."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is missing: its content, from which its ``status`` follows.

    Attributes
    ----------
    base : Fit
        Without any effect.
    chosen : Hypothesis or None
    certain : bool
        Whether the data show that the chosen effects are missing; without a chosen set, that
        nothing is.
    alternatives : tuple of Hypothesis
        Other sets that were fitted.
    equivalent : tuple of Hypothesis
        Those of them that explain the data, or leave the same of them, as well as the chosen one.
    degrees_of_freedom : int
    rules : Rules
        Thresholds of the verdict.
    reasons : tuple of Reason
        What forbids to name the chosen effects plainly; with ``"partial"`` and ``"class"`` they are
        certain as far as they go. In words they are ``caveats`` of an analysis.
    shown_in_held_out : bool
        Whether the records kept out of the fit, if there are any, show what is chosen.
    probability : float or None
        That it is right: its posterior, or of a mechanism as of `probability`. None where it names
        nothing, or nothing was compared.
    outside : float
        Probability that something outside of the library is there; 1 if no set is possible, 0 where
        rules decide.
    seen_beyond : tuple of str
        Names of effects that are seen in what no fit holds, as ripple beyond the band of a motion.
    rivals_beyond : tuple of str
        What would explain as much and is in no fit, as the delay of an encoder.
    """

    base: Fit
    chosen: Hypothesis | None
    certain: bool
    alternatives: tuple[Hypothesis, ...]
    equivalent: tuple[Hypothesis, ...]
    degrees_of_freedom: int
    rules: Rules = RULES
    reasons: tuple[Reason, ...] = ()
    shown_in_held_out: bool = True
    probability: float | None = None
    outside: float = 0.0
    seen_beyond: tuple[str, ...] = ()
    rivals_beyond: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """One of `STATUSES`, as the content of the verdict allows."""
        chosen = self.chosen
        if chosen is None:
            if not self.certain:
                return "unlisted"
            return "named" if self.seen_beyond else "adequate"
        if not (self.certain and chosen.listed) or self.has_reason(NOT_VALIDATED):
            return "unlisted"
        if self.equivalent or self.rivals_beyond:
            return "class"
        if self.reasons:
            return "partial"
        values_only = all(candidate.is_value for candidate in chosen.candidates)
        # One value that an effect covers is that effect.
        out = values_only and any(name == "parameter" for name, _ in chosen.names)
        return "parameter" if out else "named"

    @property
    def accepted(self) -> Fit:
        """The fit accepted by the verdict: without effects unless some are named."""
        chosen = self.chosen
        return chosen.fit if chosen is not None and self.status in EXPLAINED else self.base

    @property
    def leaves_more_than_noise(self) -> bool:
        """Whether the chosen effects do not explain the data down to the noise."""
        chosen = self.chosen
        degrees_of_freedom, rules = self.degrees_of_freedom, self.rules
        return chosen is not None and not down_to_noise(chosen.fit, degrees_of_freedom, rules)

    def has_reason(self, code: str) -> bool:
        """Tell whether any of its reasons has a code."""
        return any(reason.code == code for reason in self.reasons)

    @property
    def comes_near(self) -> bool:
        """Whether the chosen effects explain at least half of the misfit."""
        chosen = self.chosen
        return chosen is not None and chosen.explained >= self.rules.explained_part_share

    def after_held_out_test(
        self,
        held_out_test: HeldOutTest | None = None,
        worse: Mapping[str, float] | None = None,
    ) -> Verdict:
        """Return it as the held-out records leave it: those of mechanisms and joints end here.

        Parameters
        ----------
        held_out_test : HeldOutTest, optional
            Theirs on the named effects, where it has not been heard yet.
        worse : mapping of str to float, optional
            Prediction errors that grow with the named effects, after over before: see `grows`.

        Returns
        -------
        Verdict
            ``unlisted`` where they contradict it, and no better than ``partial`` where any error
            of theirs grows.
        """
        if held_out_test and held_out_test.denies(self.rules, self.accepted.misfit):
            reasons = (*self.reasons, Reason(NOT_VALIDATED))
            return replace(self, equivalent=(), reasons=reasons, probability=None)
        shown = self.shown_in_held_out and (
            held_out_test is None or held_out_test.counts(self.rules)
        )
        verdict = replace(self, shown_in_held_out=shown)
        if not worse:
            return verdict
        return verdict.with_caveats([Reason.of(HELD_OUT_ERROR_GROWS, numbers=worse)])

    def with_caveats(self, reasons: Sequence[Reason]) -> Verdict:
        """Return it with further reasons, with which no status is unqualified."""
        sure, shares = self.probability, probability.experience_of(self.rules)
        qualified = replace(self, reasons=(*self.reasons, *reasons))
        if sure and qualified.status != self.status:
            sure *= shares[qualified.status] / shares[self.status]
        return replace(qualified, probability=sure)


def judge(
    data: JudgedEvidence,
    base: Fit,
    candidates: Sequence[Candidate],
    known: Sequence[Hypothesis] = (),
) -> Verdict:
    """Return the verdict on a fitted base, by the rules of its data.

    If sets are ``known`` from nearly the same data, only these are compared.
    """
    rules = data.rules
    degrees_of_freedom = len(base.residuals) - len(base.values)
    candidates = [*candidates, *data.out_of_tolerance(base.at_bounds)]
    quiet = down_to_noise(base, degrees_of_freedom, rules)
    # A sensor far from what is stated of it may have taken what is missing.
    quiet = quiet and not beyond_stated(base, rules).any()
    # Screening is slow, and known sets need none unless the base itself may be adequate.
    searched = [candidate for candidate in candidates if not candidate.instead_of]
    screened = screen(data, base, searched) if quiet or not known else []
    gain = max((screening.reduction for screening in screened), default=0.0)
    if quiet and gain < rules.single_effect_gain:
        clean = probability.of_nothing(screened, len(base.residuals), rules)
        return Verdict(base, None, True, (), (), degrees_of_freedom, rules, probability=clean)
    if not screened and not known:
        return Verdict(base, None, False, (), (), degrees_of_freedom, rules)
    forms = [candidate for candidate in candidates if candidate.only_as_form]
    search = Search(data, base, searched, screened, forms)
    if known:
        search.resume(known)
        return _verdict(search, answer_of(search, chosen_of(search)))
    search.singles()
    search.grow()
    chosen = chosen_of(search)
    completed = set[frozenset[tuple[str, str]]]()
    while len(chosen.members) > 1 and chosen.names not in completed:
        completed.add(chosen.names)
        complete(search, chosen)
        chosen = chosen_of(search)
    if replaced(search, chosen, [candidate for candidate in candidates if candidate.instead_of]):
        chosen = chosen_of(search)
    return _verdict(search, answer_of(search, chosen))


def _verdict(search: Search, answer: Answer) -> Verdict:
    """Return the verdict: an answer with its reasons, status and probability."""
    data, rules, degrees_of_freedom = search.data, search.data.rules, search.degrees_of_freedom
    chosen, rivals, certain, in_part = answer
    equivalent = list(rivals)
    held_out_test = data.held_out_test(search.base, chosen.fit)
    shown = held_out_test is None or held_out_test.counts(rules)
    reasons = reasons_of(search, chosen, held_out_test)
    if in_part:
        reason = above_noise(chosen.fit.chi_square / degrees_of_freedom)
        reasons += [reason] if reason not in reasons else []
    if certain or in_part:
        # The rules of earning may pass over a set for which the evidence speaks: both are told.
        equivalent += probability.likelier(
            chosen, equivalent, search.hypotheses, degrees_of_freedom
        )
    equivalent = distinct(chosen, equivalent)
    known = certain or in_part
    verdict = Verdict(
        search.base,
        chosen,
        known,
        tuple(hypothesis for hypothesis in search.hypotheses if hypothesis is not chosen),
        tuple(equivalent),
        degrees_of_freedom,
        rules,
        tuple(reasons),
        shown,
    )
    if verdict.status == "unlisted":
        verdict = replace(verdict, equivalent=())
    others = verdict.equivalent
    # A class that is not all is no more certain than a name in part.
    like = "partial" if in_part and others else verdict.status
    sure = probability.of_names(like, chosen, others, search.hypotheses, degrees_of_freedom, rules)
    return replace(verdict, probability=sure)
