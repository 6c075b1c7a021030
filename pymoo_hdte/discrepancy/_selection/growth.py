"""Sets of effects grown, exchanged and pruned by their posterior probability.

A set is extended as long as it is among the likeliest ones, by the effects that could raise its
probability: to first order each is one more quantity of unknown size, beside the unknowns of the
set and the errors of its laws. Those that could are fitted jointly with the base and scored. Of the
likeliest set each member is left out and exchanged in turn. Nothing here knows a machine, and
nothing is compared but probabilities.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.decision import (
    SURE,
    Decision,
    Explanation,
    Name,
    decide,
    log_prior,
)
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    hypothesis_of,
    label_of,
    may_be_together,
)
from pymoo_hdte.discrepancy._selection.levenberg_marquardt import SETTLED_SHARE
from pymoo_hdte.discrepancy._selection.released import gain_of_released, released_together
from pymoo_hdte.discrepancy._selection.score import (
    MOST_PLACES,
    VISIBLE,
    Integral,
    Linearised,
    Score,
    Sized,
    score_with_outside,
)
from pymoo_hdte.discrepancy._selection.screening import Screened, screen
from pymoo_hdte.discrepancy._selection.starts import best_fit, other_starts

Vector = NDArray[np.float64]

WINDOW = float(np.log(1000.0))
"""Logarithm of odds within which a set may still matter: all that is further behind changes no
probability by more than some thousandths (Occam's window of Madigan and Raftery, JASA 89, 1994)."""
MOST_MEMBERS = 3
"""Most effects of a set; values out of tolerance count as one."""
MOST_FIRSTS = 4
"""Most sets that are extended although another one is likelier, if that one lacks something: two
effects may be missing of which each alone explains less than a third one."""
WIDTH = 8
"""Most extensions of a set that are fitted, the likeliest to first order."""
TRUSTED, OF_LINEAR = 3.0, 1.5
"""Factors by which an effect may gain more than it does to first order, as springs that slip do on
logs, and one in which residuals are linear, beside a misfit of a thousand times the noise: widths
of the search."""
OF_ONE_NAME = 2
"""Most of them that have one name."""
FEWEST = 4
"""Single effects that are fitted at least: a base at its bounds may leave a thousand times what it
does beside the true effect, of which the first order knows nothing."""
HOPELESS = 9.0
"""Chi-square, as a multiple of that of the likeliest set, at which a fit is given up. With free
noise it costs half the logarithm of this a residual; errors of laws made that 70 at the least."""
MOST_OUTSIDE = 6
"""Sets beside which something outside of the library is looked for, the likeliest without it."""


class Errors(Protocol):
    """What the score has to know about the data of fits."""

    @property
    def outside(self) -> tuple[Sized, ...]:
        """What no law of the library holds, by place."""
        ...

    @property
    def groups(self) -> list[NDArray[np.int_]]:
        """Rows of each record and of each channel."""
        ...

    def linearised(self, fitted: Fit) -> Linearised:
        """Return a fit as a hypothesis."""
        ...


@dataclass(frozen=True, eq=False)
class Weighed:
    """A set of effects with its probability.

    Attributes
    ----------
    fit : Fit
    linearised : Linearised
    score : Score
    prior : float
        Logarithm of its prior odds against nothing.
    outside : bool
        Whether something outside of the library is there as well.
    places : tuple of str
        Where that is.
    worst_chance : float
        As of `Explanation`.
    losses : dict of str to float
        By how much its probability would fall without each of its effects, to first order.
    """

    fit: Fit
    linearised: Linearised
    score: Score
    prior: float
    worst_chance: float
    losses: dict[str, float]
    outside: bool = False
    places: tuple[str, ...] = ()

    @property
    def weight(self) -> float:
        """Logarithm of the unnormalised posterior probability."""
        return self.score.ln + self.prior

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """Members of the set."""
        return self.fit.candidates

    def without(self, member: Candidate) -> Linearised:
        """Return its hypothesis without one of its effects, to first order."""
        labels = [effect.label for effect, _ in self.fit.places]
        return self.linearised.without(labels.index(member.label))

    @property
    def explanation(self) -> Explanation:
        """It as a decision takes it: nuisances of a bench have no name."""
        named = [candidate for candidate in self.candidates if not candidate.nuisance]
        return Explanation(
            "+".join(candidate.label for candidate in self.candidates) or "nothing",
            frozenset(candidate.named_effect for candidate in named),
            self.score.ln,
            self.outside,
            self.worst_chance,
            bool(named) and all(candidate.is_value for candidate in named),
        )


class Invisible(NamedTuple):
    """A fit of a set, and those of its effects that could not be seen beside the others."""

    fit: Fit
    effects: list[Candidate]


class Exchanged(NamedTuple):
    """A set of which a member was exchanged.

    It was ``ahead`` of all with at most another effect for that, and its ``loss`` to first order
    would be that without the member.
    """

    label: frozenset[str]
    member: str
    ahead: float
    loss: float


class Experience(NamedTuple):
    """What a growth brings along to another noise, or to more data.

    The ``likeliest`` sets, each of other names, which further sets may come from, and what members
    of sets were ``asked`` for.
    """

    likeliest: Sequence[Fit]
    asked: Sequence[Exchanged]


NO_EXPERIENCE = Experience((), ())


@dataclass(eq=False)
class Growth:
    """The sets of effects that may explain some data, grown by their probability.

    Attributes
    ----------
    data : Evidence
    base : Fit
        Without any effect.
    candidates : sequence of Candidate
        Effects that may be missing, and nuisances of the bench.
    errors : Errors
    screened : dict of str to Screened
        What each candidate does alone, if it is known.
    guess : callable, optional
        From what a fit leaves to effects that may be missing, known ones among them: small lines
        are seen beside the large ones only when these are explained.
    before : Experience
        With another noise, or on a part of the data.
    """

    data: Evidence
    base: Fit
    candidates: Sequence[Candidate]
    errors: Errors
    screened: dict[str, Screened] = field(default_factory=dict)
    guess: Callable[[Fit], Sequence[Candidate]] | None = None
    before: Experience = NO_EXPERIENCE
    counts: Counter[str] = field(init=False)
    _known: dict[frozenset[str], Weighed] = field(default_factory=dict)
    _invisible: dict[frozenset[str], Invisible] = field(default_factory=dict)
    _extended: set[frozenset[str]] = field(default_factory=set)
    _complete: set[frozenset[str]] = field(default_factory=set)
    _outside: dict[Weighed, Weighed] = field(default_factory=dict)
    _equipped: set[frozenset[str]] = field(default_factory=set)
    _varied: dict[frozenset[str], set[str]] = field(default_factory=dict)
    _tried: set[tuple[frozenset[str], bytes]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._count()

    def _count(self) -> None:
        self.counts = Counter(candidate.name for candidate in self.candidates)
        self.counts["parameter"] = len(self.data.base)

    def _guess_further(self, fitted: Fit) -> None:
        """Take up the effects that are guessed from what a fit leaves."""
        known = {candidate.label for candidate in self.candidates}
        guessed = self.guess(fitted) if self.guess is not None else ()
        if not (further := [effect for effect in guessed if effect.label not in known]):
            return
        self.candidates = [*self.candidates, *further]
        self._count()
        self._known = {
            label: replace(weighed, prior=self._prior(weighed.candidates))
            for label, weighed in self._known.items()
        }
        self._extended.clear()
        self._outside.clear()

    @property
    def ranked(self) -> list[Weighed]:
        """All sets that were weighed, the likeliest first."""
        return sorted(self._known.values(), key=lambda weighed: -weighed.weight)

    @property
    def experience(self) -> Experience:
        """What other growths may start with."""
        of_names = dict[frozenset[Name], Fit]()
        for weighed in self.ranked:
            of_names.setdefault(weighed.explanation.names, weighed.fit)
        return Experience(list(of_names.values())[:MOST_FIRSTS], self._asked)

    def grow(self) -> None:
        """Extend, exchange and prune sets until none could become as likely as the best."""
        for _ in self.steps():
            pass

    def steps(self) -> Iterator[Fit]:
        """Grow, and yield the fit of the likeliest set whenever another one is."""
        self._weigh_known()
        if not self.screened:
            self._extend(self._known[frozenset()])
        yield from self._settled()
        asked = set[frozenset[str]]()
        while self._lacks_something(best := self.ranked[0]):
            if (label := label_of(best.candidates)) in asked:
                break
            asked.add(label)
            self._extend(best, every=True)
            yield from self._settled()
        for _ in range(MOST_FIRSTS):
            further = [weighed for weighed in self.ranked if self._may_be_extended(weighed)]
            if not further or not self._lacks_something(self.ranked[0]):
                break
            self._extend(further[0])
            yield from self._settled()

    @property
    def may_do_with_known(self) -> bool:
        """Whether a set that was likely before may leave nothing to something outside."""
        self._weigh_known()
        return not self._lacks_something(self.ranked[0])

    def _weigh_known(self) -> None:
        """Weigh sets that were likely before, and none."""
        self._weigh(self.base)
        for fitted in self.before.likeliest:
            self._fit(fitted.candidates, fitted.values)

    def _settled(self) -> Iterator[Fit]:
        """Extend the likeliest sets, and exchange members of the best one, until it stays best.

        Members are exchanged first: beside a wrong form of a law all else seems to be missing.
        Those that were essential beside fewer members are asked again at the end only. Nuisances
        that are evident come before, as their laws have one form.
        """
        while True:
            nothing = self._known[frozenset()]
            if any(map(self._fit_evident_nuisances, (self.ranked[0], nothing))):
                continue
            weighed, best = self._open(), self.ranked[0]
            label = label_of(best.candidates)
            if label not in self._equipped:
                continue
            first, varied = label not in self._varied, self._varied.setdefault(label, set())
            if first or (weighed is None and varied < label):
                for member in best.candidates:
                    asked = weighed is None or not self._is_essential(best, member)
                    if asked and member.label not in varied and self._is_likeliest(label):
                        varied.add(member.label)
                        self._exchange(best, member)
                if self._is_likeliest(label):
                    yield self.ranked[0].fit
            elif weighed is None:
                return
            else:
                self._extend(weighed)

    def _is_likeliest(self, label: frozenset[str]) -> bool:
        return label_of(self.ranked[0].candidates) == label

    def _lacks_something(self, weighed: Weighed) -> bool:
        """Tell whether it is not sure that a set leaves nothing to something outside."""
        sure = np.log((1.0 - SURE) / SURE)
        if weighed not in self._outside:
            # A further place only makes it surer.
            score, _ = self._scored_outside(weighed, most=1)
            prior = self._prior(weighed.candidates, True)
            if score.ln + prior - weighed.weight > sure:
                return True
        return self._with_outside(weighed).weight - weighed.weight > sure

    def decide(self) -> tuple[Decision, list[Weighed]]:
        """Return what is said, and all sets with and without something outside of the library."""
        self._prune_likeliest()
        lacking = [weighed for weighed in self.ranked if self._lacks_evident(weighed.candidates)]
        ranked = [weighed for weighed in self.ranked if weighed not in lacking] or lacking
        best = ranked[0]
        # Far behind the likeliest set only one without some of its members may gain by that, and
        # only what the likeliest one leaves.
        lacks = self._lacks_something(best)
        near = [
            weighed
            for weighed in ranked
            if weighed.weight >= best.weight - WINDOW
            or (lacks and label_of(weighed.candidates) < label_of(best.candidates))
        ]
        looked_beside = [
            weighed
            for number, weighed in enumerate(near)
            if number < MOST_OUTSIDE or not weighed.candidates
        ]
        every = sorted(
            [*ranked, *map(self._with_outside, looked_beside)],
            key=lambda weighed: -weighed.weight,
        )
        explanations = [weighed.explanation for weighed in every]
        decision = decide(explanations, [weighed.prior for weighed in every])
        if ranked is lacking and decision.status == "adequate":
            # Something is evident that no effect that was fitted makes visible.
            decision = replace(decision, status="unlisted", members=(), probability=1.0)
        return decision, every

    def _prune_likeliest(self) -> None:
        """Fit the likeliest set without each member if something else is missing beside it.

        However far behind that is: the member may stand for a part of what is outside.
        """
        best = self.ranked[0]
        if len(best.candidates) > 1 and self._lacks_something(best):
            for member in best.candidates:
                others, values = _others(best.fit, member)
                if label_of(others) not in self._known:
                    self._trial(others, values)

    def _open(self) -> Weighed | None:
        """Return the likeliest set that may be extended, fitted to the end."""
        while ranked := self.ranked:
            for weighed in ranked:
                if weighed.weight < ranked[0].weight - WINDOW:
                    return None
                label = label_of(weighed.candidates)
                if label not in self._complete:
                    self._complete_fit(weighed)
                    break
                if self._may_be_extended(weighed):
                    return weighed
            else:
                return None
        return None

    def _may_be_extended(self, weighed: Weighed) -> bool:
        label = label_of(weighed.candidates)
        return label not in self._extended and _size(weighed.candidates) < MOST_MEMBERS

    def _complete_fit(self, weighed: Weighed) -> None:
        """Fit a set to the end, from other starts as well, and without each of its members."""
        label = label_of(weighed.candidates)
        self._complete.add(label)
        if not weighed.candidates:
            return
        hypothesis = self._as_hypothesis(weighed.fit)
        others = [self._as_hypothesis(other.fit) for other in self._known.values()]
        starts = other_starts(hypothesis, self.base.values)
        self._weigh(best_fit(self.data, hypothesis, starts, others))
        weighed = self._known[label]
        for member in weighed.candidates if len(weighed.candidates) > 1 else ():
            if not self._is_essential(weighed, member):
                self._without(weighed, member)

    def _is_essential(self, weighed: Weighed, member: Candidate) -> bool:
        """Tell whether a member is as essential as it was in nearly the same set.

        There it was asked for: no set without it, with another effect instead, was as likely that
        it would come near the likeliest one here. To first order it brings as much here, whatever
        is in place of one effect that was there.
        """
        whole, loss = label_of(weighed.candidates), weighed.losses[member.label]
        if self._near(weighed.weight - loss / TRUSTED):
            return False
        return any(
            exchanged.member == member.label
            and len(exchanged.label - whole) <= 1
            and loss >= exchanged.loss / TRUSTED
            and not self._near(weighed.weight - exchanged.ahead / TRUSTED)
            for exchanged in [*self.before.asked, *self._asked]
        )

    @property
    def _asked(self) -> list[Exchanged]:
        """What became of the sets of which members were exchanged."""
        return [
            Exchanged(label, member, self._ahead(label, member), self._known[label].losses[member])
            for label, varied in self._varied.items()
            if label in self._known
            for member in varied
        ]

    def _ahead(self, label: frozenset[str], member: str) -> float:
        """Return how far a set is ahead of all that have at most another effect for a member."""
        rivals = [
            known.weight
            for other, known in self._known.items()
            if member not in other and len(other - label) <= 1
        ]
        return self._known[label].weight - max(rivals, default=-np.inf)

    def _exchange(self, weighed: Weighed, member: Candidate) -> None:
        """Fit what a set may have in place of a member: its forms and lines, and other effects."""
        others, values = _others(weighed.fit, member)
        for candidate in self.candidates:
            if candidate.is_instead_of(member):
                members = (*others, candidate)
                if not may_be_together(members) or self._was_worse(weighed, member, candidate):
                    continue
                residuals = self.data.objective(members).residuals
                starts = [np.append(values, start) for start in candidate.starts]
                self._fit(members, min(starts, key=lambda s: np.sum(residuals(s) ** 2)), again=True)
                exchanged = self._known.get(label_of(members))
                if candidate.nuisance and exchanged is not None:
                    # Lines of a nuisance may have kept out others of the same.
                    self._fit_evident_nuisances(exchanged)
        is_effect = member.releases is None and not member.nuisance
        if is_effect and any(other.nuisance for other in others):
            # A law that errs may stand for several nuisances, none of which brings much alone.
            self._fit_with_evident(weighed.without(member), others, values)
        without = self._without(weighed, member)
        if without is not None and self._may_be_extended(without):
            self._extend(without)

    def _was_worse(self, weighed: Weighed, member: Candidate, candidate: Candidate) -> bool:
        """Tell whether a candidate in place of a member was far worse beside some of the others.

        Where the members that were not there bring more than that, they may bring as much beside
        the candidate, and nothing is known.
        """
        whole, old, new = label_of(weighed.candidates), label_of([member]), label_of([candidate])
        behind = [
            (known.weight - self._known[(label - old) | new].weight, weighed.weight - known.weight)
            for label, known in self._known.items()
            if old <= label < whole and (label - old) | new in self._known
        ]
        return any(
            loss > brought and not self._near(weighed.weight - loss / TRUSTED)
            for loss, brought in behind
        )

    def _extend(self, weighed: Weighed, every: bool = False) -> None:
        """Fit a set with each effect that could make it likelier.

        What could not by what it does beside the base is not asked, unless ``every`` one is: a
        weight beside a brake's ripple differs from that by the spread of the loads only.
        """
        self._extended.add(label_of(weighed.candidates))
        self._release(weighed)
        members = weighed.candidates
        candidates = [
            candidate
            for candidate in self.candidates
            if not candidate.instead_of and all(candidate.goes_with(member) for member in members)
        ]
        integral = Integral(weighed.linearised)
        integral.score()
        n = len(weighed.linearised.residuals)
        if not every:
            before = [self.screened[c.label] for c in candidates if c.label in self.screened]
            hopeful = self._gains(integral, before, n)
            # A shaft that gives way does nothing until something else moves it.
            candidates = [
                effect.candidate
                for effect, gain in zip(before, hopeful, strict=True)
                if self._may_lead(weighed.weight, effect, gain)
                or (effect.candidate.nuisance and not effect.candidate.linear)
            ] + [c for c in candidates if c.label not in self.screened]
        if not candidates:
            return
        screened = screen(self.data, weighed.fit, candidates)
        if not members:
            self.screened.update((effect.candidate.label, effect) for effect in screened)
        if self._lacks_evident(members):
            # To first order what parts now and then does nothing.
            for candidate in candidates:
                for start in candidate.starts if candidate.name in self.data.evident else ():
                    values = np.append(weighed.fit.values, start)
                    self._fit((*members, candidate), values, again=True)
            return
        gains = self._gains(integral, screened, n)
        ranked = np.argsort(-gains, kind="stable")
        taken = Counter[str]()
        for place in ranked[gains[ranked] >= -WINDOW]:
            effect = screened[place]
            if taken.total() == WIDTH or not effect.start:
                break
            if taken[effect.candidate.name] == OF_ONE_NAME:
                continue
            tried = bool(members) or taken.total() >= FEWEST
            if tried and not self._may_lead(weighed.weight, effect, gains[place]):
                break
            taken[effect.candidate.name] += 1
            self._fit((*members, effect.candidate), np.append(weighed.fit.values, effect.start))
        if not members:
            self._screen_at_fitted_values()

    def _screen_at_fitted_values(self) -> None:
        """Screen laws that were fitted alone with the values of these fits as a start, too.

        The starts of a curve may be far off: what they leave to first order, errors of the records
        take up, so that the curve seems to bring nothing beside another effect.
        """
        curves = list[Candidate]()
        alone = [known.fit for known in self._known.values() if len(known.candidates) == 1]
        for fitted in alone:
            (candidate,), values = fitted.candidates, tuple(fitted.values[fitted.n_base :].tolist())
            is_curve = candidate.releases is None and not candidate.linear and values[0] != 0.0
            if is_curve and candidate.label in self.screened and values not in candidate.starts:
                curves.append(replace(candidate, starts=(*candidate.starts, values)))
        if curves:
            screened = screen(self.data, self.base, curves)
            self.screened.update((effect.candidate.label, effect) for effect in screened)

    def _fit_evident_nuisances(self, weighed: Weighed) -> bool:
        """Fit a set with the nuisances that it lacks by far; tell whether that is the likeliest.

        A bench may have ten, and one after the other takes ten searches. To first order is enough:
        what is one too many is left out afterwards.
        """
        if (label := label_of(weighed.candidates)) in self._equipped:
            return False
        self._equipped.add(label)
        self._guess_further(weighed.fit)
        nuisances = [candidate for candidate in self.candidates if candidate.nuisance]
        if unknown := [each for each in nuisances if each.label not in self.screened]:
            effects = screen(self.data, self.base, unknown)
            self.screened.update((effect.candidate.label, effect) for effect in effects)
        before = self.ranked[0]
        self._fit_with_evident(weighed.linearised, weighed.candidates, weighed.fit.values)
        return self.ranked[0] is not before

    def _fit_with_evident(
        self, hypothesis: Linearised, members: Sequence[Candidate], values: Vector
    ) -> None:
        """Fit members with the nuisances they lack by far to first order, if there are any.

        One by one those are left out that the others stand for.
        """
        evident = list[Screened]()
        while remaining := [
            self.screened[candidate.label]
            for candidate in self.candidates
            if candidate.nuisance
            and candidate.label in self.screened
            and all(candidate.goes_with(member) for member in members)
        ]:
            integral = Integral(hypothesis)
            integral.score()
            gains = self._gains(integral, remaining, len(hypothesis.residuals))
            if gains.max() < TRUSTED * WINDOW:
                break
            evident.append(best := remaining[int(np.argmax(gains))])
            hypothesis = hypothesis.beside(*_first_order(best, len(hypothesis.residuals)))
            members = (*members, best.candidate)
        if evident:
            starts = [effect.start or effect.candidate.starts[0] for effect in evident]
            self._fit(members, np.concatenate([values, *starts]))
        while spare := self._spare(label_of(members), evident):
            members, values = _others(*spare)
            self._fit(members, values)

    def _spare(
        self, label: frozenset[str], added: Sequence[Screened]
    ) -> tuple[Fit, Candidate] | None:
        """Return the fit of a set and what it is likeliest without, of what was added to it."""
        own = [effect.candidate for effect in reversed(added) if effect.candidate.label in label]
        if (unseen := self._invisible.get(label)) is not None:
            unseen_labels = {candidate.label for candidate in unseen.effects}
            hidden = [candidate for candidate in own if candidate.label in unseen_labels]
            return (unseen.fit, hidden[0]) if hidden else None
        if not own or (weighed := self._known.get(label)) is None:
            return None
        losses = [weighed.losses[member.label] + self._prior((member,)) for member in own]
        return (weighed.fit, own[int(np.argmin(losses))]) if min(losses) < 0.0 else None

    def _release(self, weighed: Weighed) -> None:
        """Fit a set with the values released that it leaves at the bounds of their tolerance."""
        members = weighed.candidates
        already = {candidate.releases for candidate in members} - {None}
        bounded = self.data.out_of_tolerance(weighed.fit.at_bounds, together=bool(already))
        for candidate in bounded:
            if candidate.releases not in already and self._may_release(weighed, [candidate]):
                self._fit((*members, candidate), weighed.fit.values)
        together = self.data.out_of_tolerance(weighed.fit.at_bounds, True)
        if len(together) > 1 and not already and self._may_release(weighed, together):
            released, fitted = released_together(self.data, weighed.fit)
            self._fit((*members, *released), fitted.values)

    def _may_release(self, weighed: Weighed, released: Sequence[Candidate]) -> bool:
        """Tell whether a set may be seen to come near the likeliest one by released values."""
        removed = gain_of_released(weighed.fit, released)
        # A residual beyond the noise counts as noise, as in the covariance of a fit.
        gain = 0.5 * removed / weighed.fit.misfit
        return removed > VISIBLE and self._near(weighed.weight + TRUSTED * gain)

    def _near(self, weight: float) -> bool:
        """Tell whether a set of a weight is within the window of the likeliest one."""
        return weight >= self.ranked[0].weight - WINDOW

    def _may_lead(self, weight: float, effect: Screened, gain: float) -> bool:
        """Tell whether a set of a weight may become likelier by an effect, and near the likeliest.

        A set that is less likely than a part of it says nothing that this part does not (the second
        principle of Occam's window).
        """
        raised = self._at_most(effect, gain) >= 0.0
        return raised and self._may_reach(weight, effect, gain)

    def _may_reach(self, weight: float, effect: Screened, gain: float) -> bool:
        """Tell whether a set of a weight may come near the likeliest one by an effect's gain."""
        return self._near(weight + self._at_most(effect, gain))

    def _at_most(self, effect: Screened, gain: float) -> float:
        """Return by how much an effect may raise a probability that it raises to first order."""
        prior = self._prior((effect.candidate,))
        trusted = OF_LINEAR if effect.candidate.linear else TRUSTED
        return trusted * max(gain - prior, 0.0) + prior

    def _gains(self, integral: Integral, screened: Sequence[Screened], n: int) -> Vector:
        """Return by how much each effect could raise the probability of a set to first order."""
        parts, owners = list[Sized](), list[int]()
        for number, effect in enumerate(screened):
            for part in _first_order(effect, n):
                parts.append(part)
                owners.append(number)
        gains = np.full(len(screened), -np.inf)
        if parts:
            np.maximum.at(gains, owners, integral.gains(parts, renewed=True))
        priors = [self._prior((effect.candidate,)) for effect in screened]
        return gains + np.array(priors)

    def _without(self, weighed: Weighed, member: Candidate) -> Weighed | None:
        """Return a set without a member; None if that is not to be seen, or far from all others.

        It is fitted if it could be likelier than a known fit of it, which may have ended at a worse
        minimum, or near the likeliest set: alone, or with an effect in place of the member.
        """
        others, values = _others(weighed.fit, member)
        label = label_of(others)
        if label in self._invisible:
            return None
        if member.releases is not None:
            self._trial(others, values)
            return self._known.get(label)
        linearised = weighed.without(member)
        integral = Integral(linearised)
        weight, known = integral.score().ln + self._prior(others), self._known.get(label)
        if known is not None and known.weight >= weight:
            return known
        if known is None and not self._near(weighed.weight - (weighed.weight - weight) / TRUSTED):
            further = [
                effect
                for effect in self.screened.values()
                if effect.candidate.name != member.name
                and all(effect.candidate.goes_with(other) for other in others)
            ]
            gains = self._gains(integral, further, len(linearised.residuals)).tolist()
            if not any(map(self._may_reach, [weight] * len(further), further, gains)):
                return None
        self._trial(others, values)
        return self._known.get(label)

    def _fit(self, members: Sequence[Candidate], start: Vector, again: bool = False) -> None:
        """Fit a set just enough to rank it, and weigh it, unless it is known.

        A known set is fitted ``again`` from another start, and to the end.
        """
        label = label_of(members)
        known = label in self._known or label in self._invisible
        if (known and not again) or not may_be_together(members):
            return
        if _size(members) > MOST_MEMBERS:
            return
        self._trial(members, start, again)

    @property
    def _hopeless(self) -> float:
        """Chi-square with which a set is nowhere near the likeliest one."""
        return HOPELESS * self.ranked[0].fit.chi_square

    def _trial(self, members: Sequence[Candidate], start: Vector, whole: bool = False) -> None:
        """Weigh a set fitted just enough to rank it, or ``whole``, unless it was from there."""
        if (trial := (label_of(members), start.tobytes())) in self._tried:
            return
        self._tried.add(trial)
        settled = SETTLED_SHARE if whole else self.data.rules.trial_gain
        self._weigh(fit(self.data, members, start, settled=settled, hopeless=self._hopeless))

    def _weigh(self, fitted: Fit) -> None:
        """Keep a fit with its probability, unless one of its effects would be invisible."""
        label = label_of(fitted.candidates)
        known = self._known.get(label)
        if known is not None and known.fit.chi_square <= fitted.chi_square:
            return
        linearised = self.errors.linearised(fitted)
        integral = Integral(linearised)
        score = integral.score()
        if score.invisible or (fitted.candidates and self._lacks_evident(fitted.candidates)):
            invisible = [
                effect
                for (effect, _), member in zip(fitted.places, linearised.members, strict=True)
                if any(part.name in score.invisible for part in linearised.sized[member.sized])
            ]
            self._invisible[label] = Invisible(fitted, invisible)
            return
        prior = self._prior(fitted.candidates)
        chance = score.worst_chance(self.errors.groups)
        effects = [effect.label for effect, _ in fitted.places]
        losses = dict(zip(effects, integral.losses().tolist(), strict=True))
        self._known[label] = Weighed(fitted, linearised, score, prior, chance, losses)

    def _lacks_evident(self, members: Sequence[Candidate]) -> bool:
        """Tell whether some effect is evident, and no member is one that it may be."""
        evident = self.data.evident
        return bool(evident) and not evident & {member.name for member in members}

    def _with_outside(self, weighed: Weighed) -> Weighed:
        """Return a set with something outside of the library as well."""
        if weighed not in self._outside:
            score, places = self._scored_outside(weighed)
            self._outside[weighed] = replace(
                weighed,
                score=score,
                prior=self._prior(weighed.candidates, True),
                worst_chance=score.worst_chance(self.errors.groups),
                outside=True,
                places=tuple(places),
            )
        return self._outside[weighed]

    def _scored_outside(self, weighed: Weighed, most: int = MOST_PLACES) -> tuple[Score, list[str]]:
        """Return the score of a set with something outside, at some places at most, and where."""
        hypothesis, prior = weighed.linearised, self._prior(weighed.candidates, True)
        anywhere = *self.errors.outside, *hypothesis.other_laws
        hopeless = self.ranked[0].weight - WINDOW - prior
        return score_with_outside(hypothesis, anywhere, hopeless, most)

    def _prior(self, members: Sequence[Candidate], outside: bool = False) -> float:
        """Return the logarithm of the prior odds of a set against nothing."""
        names = [member.named_effect for member in members]
        forms = [max(self.counts[member.name], 1) for member in members]
        return log_prior(names, forms, outside)

    def _as_hypothesis(self, fitted: Fit) -> Hypothesis:
        excess = max(self.base.chi_square - len(self.base.residuals), 1.0)
        return hypothesis_of(fitted, excess)


def _others(fitted: Fit, member: Candidate) -> tuple[tuple[Candidate, ...], Vector]:
    """Return the effects of a fit without a member, and the values of base and these."""
    values = [fitted.values[: fitted.n_base]]
    kept = [(other, place) for other, place in fitted.places if other.label != member.label]
    values += [fitted.values[place] for _, place in kept]
    others = tuple(other for other, _ in kept)
    return others, np.concatenate(values)


def _size(members: Sequence[Candidate]) -> int:
    """Return the number of members, of which nuisances do not count and released values are one."""
    effects = [m for m in members if m.releases is None and not m.nuisance]
    return len(effects) + any(member.releases is not None for member in members)


def _first_order(effect: Screened, n: int) -> list[Sized]:
    """Return an effect to first order: all its lines as one quantity, or each of its starts."""
    candidate = effect.candidate
    if not effect.signatures.size:
        return []
    uppers = np.array([parameter.upper for parameter in candidate.parameters])
    first = [int(np.flatnonzero(start)[0]) for start in candidate.starts]
    most = [
        float(uppers[place] / abs(start[place]))
        for place, start in zip(first, candidate.starts, strict=True)
    ]
    if candidate.linear:
        blocks, most = [effect.signatures[:, :n].T], [min(most)]
    else:
        blocks = [signature[:n, None] for signature in effect.signatures]
    return [
        Sized(
            candidate.label,
            block,
            0.0,
            size,
            np.zeros(block.shape[1]),
            np.zeros(block.shape[1], dtype=bool),
            True,
        )
        for block, size in zip(blocks, most, strict=True)
        if size > 0.0
    ]
