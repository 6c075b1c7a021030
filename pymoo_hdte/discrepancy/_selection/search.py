"""Search for the set of effects that explains a misfit; sets that decide are fitted to the end.

Sets grow by the effects that could remove most of what is left, in total, in the part of the data
that is explained worst, or beyond all forms of their laws, and by the base parameters that they
leave at bounds. Members are tried by exchange, too, and each has to be earned.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitted_sets import (
    Effects,
    FittedSets,
    ill_explained,
    may_be_together,
)
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit
from pymoo_hdte.discrepancy._selection.freed import freed_together, gain_of_freed
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    label_of,
    leave_the_same,
    misfit_of,
)
from pymoo_hdte.discrepancy._selection.screening import Screened, most_hopeful, varied


class Search(FittedSets):
    """The search among sets of effects.

    Parameters
    ----------
    data : Evidence
    base : Fit
        Without any of them.
    candidates : sequence of Candidate
        Effects that may be missing, and base parameters that may be out of tolerance.
    screened : sequence of Screened
        The same beside the base, where they were screened.
    forms_only : sequence of Candidate
        Further forms of theirs, tried only in the place of another.
    """

    def __init__(
        self,
        data: Evidence,
        base: Fit,
        candidates: Sequence[Candidate],
        screened: Sequence[Screened] = (),
        forms_only: Sequence[Candidate] = (),
    ) -> None:
        super().__init__(data, base)
        self.candidates, self.screened, self.forms_only = candidates, screened, forms_only
        self._extended: set[frozenset[str]] = set()

    def singles(self) -> None:
        """Fit the most promising single effects, and the base parameters out of tolerance."""
        rules, screened = self.data.rules, self.screened
        least = rules.promising_share * screened[0].reduction
        promising = [one for one in screened if one.reduction >= least]
        for one in varied(promising, rules.most_of_one_name)[: rules.most_fitted]:
            self.alone(one)
        if self.found and self.found[0].explained < rules.explained_share:
            self.from_other_starts(self.of_size(1))
        self._parameters()
        self.finish_near(1)
        if not self.enough(self.found[0]):
            self.from_other_starts(self.found[:1])
        self._exchange_forms(self.found[0])
        self.finish_near(1)

    def grow(self) -> None:
        """Fit sets of more effects as long as what is left could be that of a further one."""
        rules, first = self.data.rules, self.found[0]
        done = self.enough(first) and not self.held_by_sensors(first)
        if done or not self.could_count(first):
            self._extend_beyond_forms(first)
            return
        for size in range(1, rules.most_effects):
            grown = self.of_size(size)[: rules.most_firsts if size == 1 else 1]
            for one in grown:
                same = one is not grown[0] and leave_the_same(one, grown[0], rules)
                if self.could_count(one) and not same:
                    self._extend(one)
            self.finish_near(size + 1)
            if size == 1:
                self._past_resonances(first)
            self._vary_best(size + 1)
            self._prune_near(size + 1)
            self.finish_near(size + 1)

    def alone(self, one: Screened) -> Hypothesis:
        """Return a single effect, fitted so far as to rank it, beside one that leaves noise."""
        start = np.append(self.base.values, one.start)
        return self.fitted((one.candidate,), start, hopeless=self.hopeless)

    def _parameters(self) -> None:
        """Fit all base parameters that want to leave their tolerances together.

        Those that stay within once others are free, or that gain nothing, keep their tolerances.
        If all of them together do no better than one effect, fewer are not tried.
        """
        freed, found = freed_together(self.data, self.base)
        needed = tuple(one for one in freed if one.outside(self.data.base, found.values))
        best = self.found[0].bic if self.found else np.inf
        if not needed or found.chi_square > best:
            return
        for one in self._prune(self.fitted(needed, found.values)).freed:
            if not self._covered((one,)):
                self.fitted((one,), found.values)

    def _covered(self, freed: Effects) -> frozenset[str]:
        """Return the labels of parameters that an effect in the list covers under another name."""
        names = {one.name for one in self.candidates}
        return frozenset(one.label for one in freed if one.covered_by in names)

    def _prune(self, one: Hypothesis) -> Hypothesis:
        """Return a set without its needless base parameters, of which one stays.

        Sets of the same effects with covered parameters alone, or with needless ones beside them,
        are left out.
        """
        best, covered = one, self._covered(one.freed)
        while len(best.freed) > 1:
            # Another way may have led the same fewer to a worse minimum before.
            every = [self.without(best, (each,), again=True) for each in best.freed]
            fewer = min(every, key=lambda each: each.bic)
            if not self._needless(best, fewer):
                break
            best = fewer
        if len(best.freed) == 1 and label_of(best.freed) <= covered:
            self._by_its_effect(best)
        needed = label_of(best.freed)
        for other in self.found:
            freed = label_of(other.freed)
            needless = len(freed) == 1 or needed < freed
            if label_of(other.effects) == label_of(one.effects) and freed & covered and needless:
                self.leave_out(other)
        return best

    def _needless(self, one: Hypothesis, fewer: Hypothesis) -> bool:
        """Tell whether the parameter that a set has beyond ``fewer`` costs more than it removes.

        Where more than noise is left, it has to remove as many times more. Beside an effect it is
        needless, too, where without it no more than noise is left: it may stand for a law's form.
        """
        cost = misfit_of(one, self.degrees_of_freedom) * np.log(len(one.fit.residuals))
        less = fewer.fit.chi_square - one.fit.chi_square <= cost
        return less or (bool(one.effects) and self.enough(fewer))

    def _by_its_effect(self, one: Hypothesis) -> None:
        """Fit a set with the effect that covers its one freed parameter, beside where that led."""
        (freed,) = one.freed
        for more in self.candidates:
            if more.name == freed.covered_by and may_be_together((*one.effects, more)):
                values = one.values_of(one.effects)
                for start in more.starts:
                    self.fitted((*one.effects, more), np.append(values, start), again=True)

    def _free_beside(self, one: Hypothesis) -> None:
        """Fit a set of effects with the base parameters that it leaves at their bounds, free.

        Beside an effect others may be out of tolerance than those that carry its misfit alone.
        Where the best set of its size explains the misfit in another form of its laws, or where no
        forms are known, an amplitude out of tolerance may stand for the form: none is freed.
        """
        rules = self.data.rules
        least = rules.explained_part_share * (one.fit.chi_square - self.degrees_of_freedom)
        least = max(least, rules.single_effect_gain)
        bounded = self.data.out_of_tolerance(one.fit.at_bounds, together=True)
        if one.freed or not bounded or gain_of_freed(one.fit, bounded) < least:
            return
        best = self.of_size(len(one.members))[0]
        if self.forms.rest(best.fit) is None or self.forms.explains(best):
            return
        freed, found = freed_together(self.data, one.fit)
        names = {each.name for each in one.candidates}
        beside = [each for each in freed if each.covered_by not in names]
        needed = tuple(each for each in beside if each.outside(self.data.base, found.values))
        if len(needed) > 1 or not label_of(needed) <= self._covered(needed):
            self.fitted((*one.candidates, *needed), found.values)

    def _prune_near(self, size: int) -> None:
        """Fit the best sets of effects and freed parameters without the needless parameters."""
        for one in self.of_size(size):
            beside = one.freed and one.effects
            if not beside or label_of(one.candidates) in self._left_out:
                continue
            if self.may_come_as_near(one, self.of_size(size)[0]):
                self._prune(self.finished(one))

    def _extend(self, one: Hypothesis, by_part: bool = True) -> None:
        """Fit a set with each effect that removes most of what it leaves, or with freed bounds."""
        label = label_of(one.candidates)
        if label in self._extended or label in self._left_out:
            return
        self._extended.add(label)
        self._free_beside(one)
        if not (others := self._further(one)):
            return
        self.add_evident(one, others)
        if len(one.members) > 1 and self.forms.explains(one):
            # A third effect shows beside two only in what no form of theirs explains.
            self._extend_beyond_forms(one)
            return
        rules, left = self.data.rules, one.fit.chi_square - self.degrees_of_freedom
        if far := self.held_by_sensors(one):
            # What brings a sensor back to what is stated removes at least that, of noise as well.
            left = far if self.enough(one) else min(left, far)
        before, after = (self.data.excess(each) for each in (self.base, one.fit))
        ill = ill_explained(before, after, rules) if by_part and not one.exact else []
        of_ill = [(part, float(after.of_parts[part])) for part in ill]
        chosen = most_hopeful(self.data, one.fit, others, self._known(others), left, of_ill)
        for more in chosen:
            self.fitted((*one.candidates, more.candidate), np.append(one.fit.values, more.start))
        self._extend_beyond_forms(one)

    def _further(self, one: Hypothesis) -> list[Candidate]:
        """Return the effects that may stand beside a set."""
        return [
            other
            for other in self.candidates
            if other.frees is None and all(other.goes_with(each) for each in one.candidates)
        ]

    def _extend_beyond_forms(self, one: Hypothesis) -> None:
        """Fit a set with effects that remove what its laws do not explain in any form."""
        small = len(one.members) < self.data.rules.most_effects
        found = self.forms.beside(one, self._known(self._further(one))) if small else []
        for more in found:
            self.fitted((*one.candidates, more.candidate), np.append(one.fit.values, more.start))
        if found:
            self.finish_near(len(one.members) + 1)

    def _known(self, others: Sequence[Candidate]) -> list[Screened]:
        """Return effects as screened beside the base; none where none was."""
        known = {one.candidate.label: one for one in self.screened}
        return [known[one.label] for one in others] if known else []

    def _vary_best(self, size: int) -> None:
        """Fit sets that differ from the best of a size by one member, until it stays the best."""
        varied = frozenset[str]()
        while (sets := self.of_size(size)) and (best := label_of(sets[0].candidates)) != varied:
            varied = best
            if size == 2:
                self._exchange(sets[0])
            self._exchange_forms(sets[0])

    def _exchange(self, one: Hypothesis) -> None:
        """Fit sets in which something else is in the place of one member."""
        for member in one.members:
            self._extend(self.without(one, member), by_part=False)

    def _past_resonances(self, first: Hypothesis) -> None:
        """Fit the first effect with an inertia from all its starts, if all sets fail plainly.

        An inertia moves resonances past lines: to first order it does next to nothing for them.
        """
        rules = self.data.rules
        if misfit_of(self.found[0], self.degrees_of_freedom) <= rules.contradicting_chi_square:
            return
        for more in self._further(first):
            if more.exact and len(more.parameters) == 1 and len(more.starts) > 1:
                for start in more.starts:
                    values = np.append(first.fit.values, start)
                    self.fitted((*first.candidates, more), values, again=True)

    def _exchange_forms(self, one: Hypothesis) -> None:
        """Fit sets in which one member is another form or a special case of it, at its port.

        Or a form of the effect that covers a base parameter, in place of all that are free. Curves
        are replaced by each other one, too, where effects alone leave more than noise: only those
        that to first order take most of the rest were tried before.
        """
        open_to_curves = not (self.enough(one) or one.freed)
        for member in one.candidates:
            others = tuple(each for each in one.candidates if each is not member)
            kept = one.effects if member.covered_by else others
            for other in (*self.candidates, *self.forms_only):
                fits = other.stands_for(member, open_to_curves) and may_be_together((*kept, other))
                # What only stands for listed forms is tried where these leave some.
                if fits and (not other.only_as_form or self.leaves_form_of(one, member)):
                    self.fitted((*kept, other), np.append(one.values_of(kept), other.starts[0]))
