"""Sets of effects fitted jointly with the base: first just enough to rank them, then to the end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.excess import Excess
from pymoo_hdte.discrepancy._selection.fitting import Fit, JudgedEvidence, Vector, fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    contains,
    down_to_noise,
    hypothesis_of,
    indistinguishable,
    is_bounded,
    label_of,
    misfit_of,
)
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.discrepancy._selection.starts import best_fit, other_starts

Effects = tuple[Candidate, ...]


class FittedSets:
    """Sets of effects, what each explains, and whether their members are significant.

    Parameters
    ----------
    data : JudgedEvidence
    base : Fit
        Fit without any effect.

    Attributes
    ----------
    degrees_of_freedom : int
        Degrees of freedom of the base.
    excess : float
        Chi-square of the base beyond its degrees of freedom.
    """

    def __init__(self, data: JudgedEvidence, base: Fit) -> None:
        self.data, self.base = data, base
        self.degrees_of_freedom = len(base.residuals) - len(base.values)
        self.excess = base.chi_square - self.degrees_of_freedom
        self._by_label: dict[frozenset[str], Hypothesis] = {}
        self._left_out: set[frozenset[str]] = set()
        self._finished: set[frozenset[str]] = set()
        self._from_all_starts: set[frozenset[str]] = set()
        self._resumed = False

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """All sets fitted so far except those left out, by rising BIC."""
        hypotheses = [
            hypothesis
            for label, hypothesis in self._by_label.items()
            if label not in self._left_out
        ]
        return sorted(hypotheses, key=lambda hypothesis: hypothesis.bic)

    def of_size(self, size: int) -> list[Hypothesis]:
        """Return the sets with this number of members, by rising BIC."""
        return [hypothesis for hypothesis in self.hypotheses if len(hypothesis.members) == size]

    @property
    def hopeless(self) -> float:
        """Chi-square beyond which a fit cannot compete with a set that leaves only noise."""
        best, rules = self.hypotheses[:1], self.data.rules
        if not (best and self.enough(best[0])):
            return np.inf
        share = rules.outdone_share * self.base.chi_square
        return max(rules.contradicting_chi_square * best[0].fit.chi_square, share)

    def enough(self, hypothesis: Hypothesis) -> bool:
        """Tell whether a set explains the data down to the noise."""
        return down_to_noise(hypothesis.fit, self.degrees_of_freedom, self.data.rules)

    def could_count(self, hypothesis: Hypothesis) -> bool:
        """Tell whether a further effect could be justified.

        An effect at a bound may stand for two, as may a zero or gain far beyond what is stated.
        """
        if self.held_by_sensors(hypothesis):
            return True
        if self.enough(hypothesis):
            return is_bounded(hypothesis.fit)
        return hypothesis.exact or bool(
            self.data.excess(hypothesis.fit).significant(self.data.rules).any()
        )

    def leaves_form_of(self, hypothesis: Hypothesis, member: Candidate) -> bool:
        """Tell whether another form of a member may do better in a set.

        It may if a law with memory leaves more than noise: a loop that forgets is no sum of springs
        that slip, not even to first order.
        """
        return member.remembers and not self.enough(hypothesis)

    def indistinguishable(self, hypothesis: Hypothesis, chosen: Hypothesis) -> bool:
        """Tell whether the data do not separate two sets, as the function of this name does."""
        return indistinguishable(hypothesis, chosen, self.degrees_of_freedom, self.data.rules)

    def is_significant(self, hypothesis: Hypothesis) -> bool:
        """Tell whether each member is significant: without it a set explains clearly less."""
        members = hypothesis.members
        if len(members) == 1:
            return True
        return all(
            self._member_is_significant(hypothesis, member, self.without(hypothesis, member))
            for member in members
        )

    def _member_is_significant(
        self, hypothesis: Hypothesis, member: Effects, simpler: Hypothesis
    ) -> bool:
        """Tell whether a member is significant; ``simpler`` is the set without it."""
        return is_significant(
            self.data, self.base, hypothesis, simpler, member
        ) or self._brings_sensors_back(hypothesis, simpler)

    def _brings_sensors_back(self, hypothesis: Hypothesis, simpler: Hypothesis) -> bool:
        """Tell whether sensors are as stated in a set, and not in the simpler set.

        Friction that grows with the load is nearly a gain of the torque sensor.
        """
        least = self.data.rules.single_effect_gain * misfit_of(hypothesis, self.degrees_of_freedom)
        clear = simpler.fit.chi_square - hypothesis.fit.chi_square >= least
        back = self.beyond_stated(simpler.fit) > 0.0 and self.beyond_stated(hypothesis.fit) == 0.0
        return clear and back

    def held_by_sensors(self, hypothesis: Hypothesis) -> float:
        """Return `beyond_stated` of a set that could be named without qualification, else 0.

        If more is left, sensors absorb a share of it whatever is missing.
        """
        misfit = misfit_of(hypothesis, self.degrees_of_freedom)
        plain = misfit <= self.data.rules.contradicting_chi_square
        return self.beyond_stated(hypothesis.fit) if plain else 0.0

    def beyond_stated(self, fitted: Fit) -> float:
        """Return the chi-square of zeros and gains of sensors far from what is stated."""
        return float(beyond_stated(fitted, self.data.rules).sum())

    def without(self, hypothesis: Hypothesis, member: Effects, again: bool = False) -> Hypothesis:
        """Return a set without one member, fitted to the end; ``again`` as in `fitted`."""
        effects = tuple(candidate for candidate in hypothesis.candidates if candidate not in member)
        return self.finished(self.fitted(effects, hypothesis.values_of(effects), again))

    def fitted(
        self,
        effects: Effects,
        start: Vector,
        again: bool = False,
        steps: int | None = None,
        hopeless: float = np.inf,
    ) -> Hypothesis:
        """Return a set fitted from a start just enough to rank it.

        A known set is returned as it is, or fitted ``again`` until it arrives at the known fit; the
        better of both is stored. ``steps`` and ``hopeless`` are as in `fit`.
        """
        label = label_of(effects)
        known = self._by_label.get(label)
        if known is None or again:
            ends = [known.fit] if known and known.candidates == effects else []
            settled = self.data.rules.trial_gain
            fitted = fit(self.data, effects, start, steps, settled, ends, hopeless)
            trial = hypothesis_of(fitted, self.excess)
            if known is None or trial.bic < known.bic:
                self._by_label[label] = trial
                self._finished.discard(label)
        return self._by_label[label]

    def extended(
        self,
        hypothesis: Hypothesis,
        candidate: Candidate,
        start: Sequence[float],
        again: bool = False,
    ) -> Hypothesis:
        """Return a set with one more effect, fitted from its values and a start of the effect."""
        values = np.append(hypothesis.fit.values, start)
        return self.fitted((*hypothesis.candidates, candidate), values, again)

    def from_other_starts(self, sets: Sequence[Hypothesis]) -> None:
        """Fit single effects from all their starts, each once."""
        for hypothesis in sets:
            starts = other_starts(hypothesis, self.base.values)
            if starts and (label := label_of(hypothesis.candidates)) not in self._from_all_starts:
                self.finished(hypothesis, *starts)
                self._from_all_starts.add(label)

    def finished(self, hypothesis: Hypothesis, *starts: Vector) -> Hypothesis:
        """Return a set fitted to the end: from its values and, unless resumed, other starts."""
        label = label_of(hypothesis.candidates)
        if label not in self._finished or starts:
            fitted_before = self._resumed or label in self._finished
            if self._resumed:
                best = fit(self.data, hypothesis.candidates, hypothesis.fit)
            else:
                self._finish_special_cases(hypothesis)
                best = best_fit(self.data, hypothesis, starts, self._by_label.values())
            self._by_label[label] = hypothesis_of(best, self.excess)
            self._finished.add(label)
            if not fitted_before:
                self._reopen(self._by_label[label])
        return self._by_label[label]

    def _finish_special_cases(self, hypothesis: Hypothesis) -> None:
        """Fit to the end the special cases that may come as near as a set, for `best_fit`."""
        for special in list(self._by_label.values()):
            if is_special_case(special, hypothesis) and self.may_come_as_near(special, hypothesis):
                self.finished(special)

    def _reopen(self, special: Hypothesis) -> None:
        """Mark for another fit the laws that do no better than this special case of them."""
        limit = special.fit.chi_square - self.data.rules.evidence_distance
        for label in list(self._finished):
            law = self._by_label[label]
            if is_special_case(special, law) and law.fit.chi_square > limit:
                self._finished.discard(label)

    def resume(self, hypotheses: Sequence[Hypothesis]) -> None:
        """Fit sets from the values that another search found on nearly the same data.

        The first set is the chosen one. Sets that came nowhere near it are only evaluated.
        """
        self._resumed = True
        chosen, *others = hypotheses
        competing = [
            chosen,
            *(rival for rival in others if self.indistinguishable(rival, chosen)),
        ]
        for hypothesis in hypotheses:
            # Measured from the chosen set: in the best one a member may not be significant.
            shortlisted = hypothesis in competing or self.may_come_as_near(hypothesis, chosen)
            steps = None if shortlisted else 0
            self.fitted(hypothesis.candidates, hypothesis.fit.values, steps=steps)
        for hypothesis in competing:
            self.finished(self._by_label[label_of(hypothesis.candidates)])
        for size in {len(hypothesis.members) for hypothesis in hypotheses}:
            self.finish_near(size)

    def leave_out(self, hypothesis: Hypothesis) -> None:
        """Leave a set out of all comparisons: it is known under another name."""
        self._left_out.add(label_of(hypothesis.candidates))

    def finish_near(self, size: int) -> None:
        """Fit the best sets of a size to the end, and those that may come as near.

        Only the latter are fitted if the search was resumed, or if the best set leaves only noise
        (and, for a single effect, all sensors are as stated).
        """
        for place in range(len(self.of_size(size))):
            ranked = self.of_size(size)
            best, hypothesis = ranked[0], ranked[place]
            complete = self.enough(best) and (size > 1 or not self.held_by_sensors(best))
            only_near = self._resumed or complete
            leading = place < (1 if only_near else self.data.rules.most_firsts)
            if leading or self.may_come_as_near(hypothesis, best):
                self.finished(hypothesis)

    def may_come_as_near(self, hypothesis: Hypothesis, best: Hypothesis) -> bool:
        """Tell whether a set may come as near as the best once both are fitted to the end."""
        rules = self.data.rules
        distance = rules.evidence_distance * misfit_of(best, self.degrees_of_freedom)
        if len(hypothesis.members) == 1:
            # Forms that leave about the same compete, however far apart by evidence.
            distance = max(distance, rules.form_share**2 * best.removed)
        return hypothesis.bic - best.bic < rules.refit_margin * distance


def is_special_case(hypothesis: Hypothesis, law: Hypothesis) -> bool:
    """Tell whether a set is a special case of a law that has more unknowns."""
    return contains(law, hypothesis) and len(hypothesis.fit.values) < len(law.fit.values)


def is_significant(
    data: JudgedEvidence,
    base: Fit,
    hypothesis: Hypothesis,
    simpler: Hypothesis,
    member: Sequence[Candidate],
) -> bool:
    """Tell whether a set explains most of what is left by the ``simpler`` set without a member.

    Beside laws of exact form a member that leads down to the noise is significant if it removes
    most of what they leave. What other laws leave may be an error of their form. Unless the set
    explains the data down to the noise, the member must then also be large compared with the base's
    excess, at the port of another member, or with the model's own error elsewhere.
    """
    rules, degrees_of_freedom = data.rules, len(base.residuals) - len(base.values)
    if down_to_noise(simpler.fit, degrees_of_freedom, rules):
        return False
    excess = simpler.fit.chi_square - degrees_of_freedom
    removed = simpler.fit.chi_square - hypothesis.fit.chi_square
    if simpler.exact:
        to_noise = down_to_noise(hypothesis.fit, degrees_of_freedom, rules)
        share = rules.explained_part_share if to_noise else rules.explained_share
        return excess > 0.0 and removed >= share * excess
    per_degree = simpler.fit.chi_square / degrees_of_freedom
    contradicted = per_degree > rules.contradicting_chi_square
    if contradicted and down_to_noise(hypothesis.fit, degrees_of_freedom, rules):
        return True
    before, between, final = (data.excess(fitted) for fitted in (base, simpler.fit, hypothesis.fit))
    parts = ill_explained(before, between, rules)
    if not parts:
        return False
    same_port = any(
        candidate.shares_port_with(present)
        for candidate in member
        for present in simpler.candidates
    )
    least = rules.second_form_share if same_port else data.model_error_share
    for part in (slice(None), parts[0]):
        whole, residual, remaining = (
            np.sum(by_part.of_parts[part]) for by_part in (before, between, final)
        )
        if residual - remaining >= max(rules.second_share * residual, least * whole):
            return True
    return False


def ill_explained(before: Excess, after: Excess, rules: Rules) -> list[int]:
    """Return the parts of the data that contradict both a base and a fit, the worst first.

    They are the worst part and all others of which the fit explains less than half.
    """
    wrong = np.flatnonzero(before.significant(rules) & after.significant(rules))
    residual = after.of_parts[wrong] / before.of_parts[wrong]
    ranked = wrong[np.argsort(-residual)].tolist()
    return ranked[: max(1, int(np.sum(residual > 1.0 - rules.explained_part_share)))]


def beyond_stated(fitted: Fit, rules: Rules) -> NDArray[np.float64]:
    """Return by parameter the chi-square of values far beyond what is stated of them.

    Shape (n_parameters,); zero where a value is near, or nothing is stated.
    """
    away = from_stated(fitted)
    return np.where(np.abs(away) > rules.false_alarm_deviations, away**2, 0.0)


def from_stated(fitted: Fit) -> NDArray[np.float64]:
    """Return how far parameters are from what is stated of them, in units of its deviation.

    Shape (n_parameters,); zero where nothing is stated.
    """
    stated = Layout(fitted.parameters)
    return np.asarray((fitted.values - stated.array("start")) / stated.array("prior"))
