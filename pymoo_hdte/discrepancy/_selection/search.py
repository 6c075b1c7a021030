"""Search for the set of effects that explains a misfit; sets that decide are fitted to the end.

Sets grow by the effects that could remove most of what is left: in total, or in the part of the
data that is explained worst. Members are also exchanged, and each has to be significant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitted_sets import (
    Effects,
    FittedSets,
    ill_explained,
)
from pymoo_hdte.discrepancy._selection.fitting import Fit, JudgedEvidence
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    label_of,
    leave_the_same,
    may_be_together,
    misfit_of,
)
from pymoo_hdte.discrepancy._selection.released import released_together
from pymoo_hdte.discrepancy._selection.screening import Screened, shortlist, varied


class Search(FittedSets):
    """The search among sets of effects.

    Parameters
    ----------
    data : JudgedEvidence
    base : Fit
        Fit without any effect.
    candidates : sequence of Candidate
        Effects that may be missing, and base parameters that may be out of tolerance.
    screened : sequence of Screened
        These candidates as screened beside the base, if they were.
    forms_only : sequence of Candidate
        Further forms of effects, tried only instead of another form.
    """

    def __init__(
        self,
        data: JudgedEvidence,
        base: Fit,
        candidates: Sequence[Candidate],
        screened: Sequence[Screened] = (),
        forms_only: Sequence[Candidate] = (),
    ) -> None:
        super().__init__(data, base)
        self.candidates, self.screened, self.forms_only = candidates, screened, forms_only
        self._extended: set[frozenset[str]] = set()

    def singles(self) -> None:
        """Fit the shortlisted single effects, and the base parameters out of tolerance."""
        rules, screened = self.data.rules, self.screened
        least = rules.promising_share * screened[0].reduction
        shortlisted = [effect for effect in screened if effect.reduction >= least]
        for effect in varied(shortlisted, rules.most_of_one_name)[: rules.most_fitted]:
            self.alone(effect)
        if self.hypotheses and self.hypotheses[0].explained < rules.explained_share:
            self.from_other_starts(self.of_size(1))
        self._release_parameters()
        self.finish_near(1)
        if not self.enough(self.hypotheses[0]):
            self.from_other_starts(self.hypotheses[:1])
        self._exchange_forms(self.hypotheses[0])
        self.finish_near(1)

    def grow(self) -> None:
        """Fit sets of more effects as long as a further one could explain what is left."""
        rules, leading = self.data.rules, self.hypotheses[0]
        done = self.enough(leading) and not self.held_by_sensors(leading)
        if done or not self.could_count(leading):
            return
        for size in range(1, rules.most_effects):
            grown = self.of_size(size)[: rules.most_firsts if size == 1 else 1]
            for hypothesis in grown:
                same = hypothesis is not grown[0] and leave_the_same(hypothesis, grown[0], rules)
                if self.could_count(hypothesis) and not same:
                    self._extend(hypothesis)
            self.finish_near(size + 1)
            if size == 1:
                self._past_resonances(leading)
            self._vary_best(size + 1)
            self._prune_near(size + 1)
            self.finish_near(size + 1)

    def alone(self, effect: Screened) -> Hypothesis:
        """Return a single effect fitted just enough to rank it."""
        start = np.append(self.base.values, effect.start)
        return self.fitted((effect.candidate,), start, hopeless=self.hopeless)

    def _release_parameters(self) -> None:
        """Fit all base parameters together that the data push out of their tolerances.

        Those that stay within once others are released, or that gain nothing, keep tolerances.
        If all of them together do no better than one effect, fewer are not tried.
        """
        released, fitted = released_together(self.data, self.base)
        needed = tuple(
            parameter for parameter in released if parameter.outside(self.data.base, fitted.values)
        )
        best = self.hypotheses[0].bic if self.hypotheses else np.inf
        if not needed or fitted.chi_square > best:
            return
        for parameter in self._prune(self.fitted(needed, fitted.values)).released:
            if not self._covered((parameter,)):
                self.fitted((parameter,), fitted.values)

    def _covered(self, released: Effects) -> frozenset[str]:
        """Return the labels of the released parameters that an effect in the list covers."""
        names = {candidate.name for candidate in self.candidates}
        return frozenset(parameter.label for parameter in released if parameter.covered_by in names)

    def _prune(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a set without needless released parameters, of which at least one stays.

        Sets of the same effects in which covered parameters stand alone, or with needless ones, are
        left out.
        """
        best, covered = hypothesis, self._covered(hypothesis.released)
        while len(best.released) > 1:
            # An earlier fit of the same fewer parameters may have ended at a worse minimum.
            every = [self.without(best, (parameter,), again=True) for parameter in best.released]
            fewer = min(every, key=lambda hypothesis: hypothesis.bic)
            if not self._needless(best, fewer):
                break
            best = fewer
        if len(best.released) == 1 and label_of(best.released) <= covered:
            self._replace_by_effect(best)
        needed = label_of(best.released)
        for competitor in self.hypotheses:
            released = label_of(competitor.released)
            needless = len(released) == 1 or needed < released
            if (
                label_of(competitor.effects) == label_of(hypothesis.effects)
                and released & covered
                and needless
            ):
                self.leave_out(competitor)
        return best

    def _needless(self, hypothesis: Hypothesis, fewer: Hypothesis) -> bool:
        """Tell whether the parameter that a set has beyond ``fewer`` costs more than it removes.

        The cost grows with the misfit. Beside an effect a parameter is also needless if only noise
        is left without it, since it may stand for the form of a law.
        """
        cost = misfit_of(hypothesis, self.degrees_of_freedom) * np.log(
            len(hypothesis.fit.residuals)
        )
        less = fewer.fit.chi_square - hypothesis.fit.chi_square <= cost
        return less or (bool(hypothesis.effects) and self.enough(fewer))

    def _replace_by_effect(self, hypothesis: Hypothesis) -> None:
        """Fit a set with the effect that covers its one released parameter, from where that led."""
        (released,) = hypothesis.released
        for effect in self.candidates:
            if effect.name == released.covered_by and may_be_together(
                (*hypothesis.effects, effect)
            ):
                values = hypothesis.values_of(hypothesis.effects)
                for start in effect.starts:
                    self.fitted((*hypothesis.effects, effect), np.append(values, start), again=True)

    def _prune_near(self, size: int) -> None:
        """Fit the best sets of effects and released parameters without needless parameters."""
        for hypothesis in self.of_size(size):
            mixed = hypothesis.released and hypothesis.effects
            if not mixed or label_of(hypothesis.candidates) in self._left_out:
                continue
            if self.may_come_as_near(hypothesis, self.of_size(size)[0]):
                self._prune(self.finished(hypothesis))

    def _extend(self, hypothesis: Hypothesis, by_part: bool = True) -> None:
        """Fit a set with each effect that removes most of what it leaves, or releasing values."""
        label = label_of(hypothesis.candidates)
        if label in self._extended or label in self._left_out:
            return
        self._extended.add(label)
        if not (candidates := self._addable(hypothesis)):
            return
        rules, excess = self.data.rules, hypothesis.fit.chi_square - self.degrees_of_freedom
        if sensor_excess := self.held_by_sensors(hypothesis):
            # An effect that brings a sensor back to what is stated removes at least its excess.
            excess = sensor_excess if self.enough(hypothesis) else min(excess, sensor_excess)
        before, after = (self.data.excess(fitted) for fitted in (self.base, hypothesis.fit))
        ill = ill_explained(before, after, rules) if by_part and not hypothesis.exact else []
        of_ill = [(part, float(after.of_parts[part])) for part in ill]
        chosen = shortlist(
            self.data,
            hypothesis.fit,
            candidates,
            self._screened_beside_base(candidates),
            excess,
            of_ill,
        )
        for effect in chosen:
            self.extended(hypothesis, effect.candidate, effect.start)

    def _addable(self, hypothesis: Hypothesis) -> list[Candidate]:
        """Return the effects that may be added to a set."""
        return [
            candidate
            for candidate in self.candidates
            if candidate.releases is None
            and all(candidate.goes_with(member) for member in hypothesis.candidates)
        ]

    def _screened_beside_base(self, candidates: Sequence[Candidate]) -> list[Screened]:
        """Return candidates as screened beside the base; nothing if none was screened."""
        by_label = {effect.candidate.label: effect for effect in self.screened}
        return [by_label[candidate.label] for candidate in candidates] if by_label else []

    def _vary_best(self, size: int) -> None:
        """Fit sets that differ from the best of a size by one member, until it stays the best."""
        varied = frozenset[str]()
        while (sets := self.of_size(size)) and (best := label_of(sets[0].candidates)) != varied:
            varied = best
            if size == 2:
                self._exchange_members(sets[0])
            self._exchange_forms(sets[0])

    def _exchange_members(self, hypothesis: Hypothesis) -> None:
        """Fit sets in which another effect replaces one member."""
        for member in hypothesis.members:
            self._extend(self.without(hypothesis, member), by_part=False)

    def _past_resonances(self, leading: Hypothesis) -> None:
        """Fit the leading effect with an inertia from all its starts, if no set comes near noise.

        An inertia moves resonances past lines, which to first order has hardly any effect on them.
        """
        rules = self.data.rules
        if misfit_of(self.hypotheses[0], self.degrees_of_freedom) <= rules.contradicting_chi_square:
            return
        for candidate in self._addable(leading):
            if candidate.exact and len(candidate.parameters) == 1 and len(candidate.starts) > 1:
                for start in candidate.starts:
                    self.extended(leading, candidate, start, again=True)

    def _exchange_forms(self, hypothesis: Hypothesis) -> None:
        """Fit sets in which another form or a special case replaces a member at its port.

        All released parameters are replaced by a form of the effect that covers one of them. If
        effects alone leave more than noise, every curve also replaces every other: so far only
        those were tried that remove most of what is left to first order.
        """
        open_to_curves = not (self.enough(hypothesis) or hypothesis.released)
        for member in hypothesis.candidates:
            others = tuple(
                candidate for candidate in hypothesis.candidates if candidate is not member
            )
            remaining = hypothesis.effects if member.covered_by else others
            values = hypothesis.values_of(remaining)
            for replacement in (*self.candidates, *self.forms_only):
                effects = (*remaining, replacement)
                suitable = replacement.stands_for(member, open_to_curves)
                suitable = suitable and may_be_together(effects)
                if suitable and replacement.only_as_form:
                    # Such a form only stands for listed ones, and only if these leave some of it.
                    suitable = self.leaves_form_of(hypothesis, member)
                if suitable:
                    self.fitted(effects, np.append(values, replacement.starts[0]))
