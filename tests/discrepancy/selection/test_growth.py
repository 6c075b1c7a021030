"""Sets grown by their probability against all sets that there are, on linear data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Unknowns, built, fit
from pymoo_hdte.discrepancy._selection.growth import Growth
from pymoo_hdte.discrepancy._selection.linearised import linearise
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._selection.score import Integral, Linearised, Sized, score
from pymoo_hdte.effects.unknowns import Parameter, unknown

N = 60


class Multiple(NamedTuple):
    """So many times a column."""

    name: str
    number: int
    size: float


class Objective(Unknowns):
    """Residuals of linear data."""

    def __init__(self, data: LinearData, candidates: Sequence[Candidate]) -> None:
        super().__init__(data.base, candidates)
        self.data = data

    def residuals(self, values):
        effects = [effect for part in built(self.candidates, values[1:]) for effect in part]
        return values[0] * self.data.level + self.data.force(effects) - self.data.measured

    def jacobian(self, values):
        numbers = [int(candidate.port) for candidate in self.candidates]
        return np.column_stack([self.data.level, *self.data.columns.T[numbers]]) * self.scale


@dataclass(eq=False)
class LinearData:
    """Numbers of white noise beside multiples of a level and of columns, as evidence and errors."""

    measured: np.ndarray
    columns: np.ndarray
    level: np.ndarray
    base: tuple[Parameter, ...] = (Parameter("level", 0.0, -10.0, 10.0, 1.0),)
    rules: object = RULES
    evident: frozenset[str] = frozenset()
    outside: tuple[Sized, ...] = ()

    def force(self, effects):
        return sum((part.size * self.columns[:, part.number] for part in effects), np.zeros(N))

    def objective(self, candidates):
        return Objective(self, candidates)

    def response(self, fitted):
        return self.force

    def rows_of_parts(self):
        return [np.arange(N)]

    def out_of_tolerance(self, at_bounds, together=False):
        return []

    @property
    def groups(self):
        return [np.arange(N)]

    def linearised(self, fitted) -> Linearised:
        return linearise(fitted, np.zeros(N, int), lambda candidate, place: (), 0.0)


def candidate(number):
    return Candidate(
        f"effect_{number}",
        str(number),
        (unknown("size", -30.0, 30.0, 1.0, linear=True),),
        ((1.0,),),
        lambda values: (Multiple(f"effect_{number}", number, values[0]),),
        "",
    )


def grown(measured, columns, level, outside=()):
    data = LinearData(measured, columns, level, outside=outside)
    growth = Growth(data, fit(data), [candidate(k) for k in range(columns.shape[1])], data)
    growth.grow()
    return growth


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.mark.parametrize("seed", range(3))
def test_no_set_is_likelier_than_the_best_one_grown(seed):
    """Columns alike to .7, so that one stands for another until both are exchanged."""
    rng = np.random.default_rng(seed)
    shared = rng.normal(size=(N, 1))
    columns = 0.7 * shared + 0.7 * rng.normal(size=(N, 6))
    true = rng.choice(6, size=2, replace=False)
    sizes = rng.choice([-1.0, 1.0], size=2) * rng.uniform(1.0, 3.0, size=2)
    level = np.ones(N)
    measured = columns[:, true] @ sizes + 0.5 + rng.normal(size=N)
    growth = grown(measured, columns, level)
    best = growth.ranked[0]
    assert {int(member.port) for member in best.candidates} == set(true.tolist())
    every = Growth(growth.data, growth.base, growth.candidates, growth.errors)
    for size in range(3):
        for members in combinations(growth.candidates, size):
            every._weigh(fit(growth.data, members))
    assert best.weight >= every.ranked[0].weight - 0.01
    assert len(growth.ranked) < len(every.ranked)


def test_a_set_without_a_member_is_known_to_first_order(rng):
    """Of linear data that is exact."""
    columns = rng.normal(size=(N, 3))
    data = LinearData(columns @ [2.0, -3.0, 1.0] + rng.normal(size=N), columns, np.ones(N))
    members = [candidate(k) for k in range(3)]
    whole = data.linearised(fit(data, members))
    others = data.linearised(fit(data, [members[0], members[2]]))
    assert score(whole.without(1)).ln == pytest.approx(score(others).ln, abs=0.01)


def test_the_likeliest_set_of_another_noise_goes_along(rng):
    columns = rng.normal(size=(N, 5))
    measured = columns[:, [1, 3]] @ [2.0, -2.0] + rng.normal(size=N)
    before = grown(measured, columns, np.ones(N))
    data = LinearData(measured + 0.1 * rng.normal(size=N), columns, np.ones(N))
    growth = Growth(data, fit(data), before.candidates, data, before=before.experience)
    first = next(growth.steps())
    assert {int(member.port) for member in first.candidates} == {1, 3}


def test_small_effects_are_guessed_when_large_ones_are_explained(rng):
    """A brake's ripple was not among the four strongest lines of a bench, and never looked for."""
    columns = rng.normal(size=(N, 3))
    measured = columns[:, :2] @ [9.0, 2.0] + rng.normal(size=N)
    data = LinearData(measured, columns, np.ones(N))

    def guess(fitted):
        number = 1 if fitted.candidates else 0
        return [candidate(number)]

    growth = Growth(data, fit(data), [candidate(0), candidate(2)], data, guess=guess)
    growth.grow()
    assert {member.port for member in growth.ranked[0].candidates} == {"0", "1"}
    # All sets have the prior of the candidates that there are now.
    for known in growth.ranked:
        assert known.prior == growth._prior(known.candidates)


def test_evident_nuisances_are_found_together(rng):
    """A bench with eleven was searched eleven times."""
    columns = rng.normal(size=(N, 8))
    sizes = [9.0, -8.0, 7.0, -6.0, 5.0, 4.0]
    data = LinearData(columns[:, :6] @ sizes + rng.normal(size=N), columns, np.ones(N))
    nuisances = [replace(candidate(k), nuisance=True) for k in range(8)]
    first = next(Growth(data, fit(data), nuisances, data).steps())
    assert {member.port for member in first.candidates} == set("012345")


@dataclass(eq=False)
class ErringData(LinearData):
    """Linear data of which the first effect errs by a third along some columns."""

    errors: np.ndarray = field(default_factory=lambda: np.empty((N, 0)))

    def linearised(self, fitted) -> Linearised:
        def errors(effect, place):
            return (fitted.values[place] * self.errors,) if effect.port == "0" else ()

        return linearise(fitted, np.zeros(N, int), errors, 0.0)


def test_nuisances_together_are_likelier_than_a_law_that_errs(rng):
    """None of four brings much where the law is left out, and a fifth one is one of them."""
    columns = rng.normal(size=(N, 6))
    columns[:, 0] = columns[:, 1:5].sum(axis=1) + 0.1 * rng.normal(size=N)
    columns[:, 5] = columns[:, 4] + 0.01 * rng.normal(size=N)
    data = ErringData(
        columns[:, 1:5] @ [17.0, 15.0, 13.0, 14.0] + rng.normal(size=N),
        columns,
        np.ones(N),
        errors=np.column_stack([columns[:, 1:4] - columns[:, 2:5], rng.normal(size=(N, 10))]),
    )
    candidates = [replace(candidate(k), nuisance=k > 0) for k in range(6)]
    growth = Growth(data, fit(data), candidates, data)
    growth.grow()
    ports = {member.port for member in growth.ranked[0].candidates}
    assert ports in (set("1234"), set("1235"))


class Passing(NamedTuple):
    """A share of the sizes of all multiples, along a column of its own."""

    name: str
    number: int
    share: float


class PassingData(LinearData):
    """Linear data in which a part passes on what the others do."""

    def force(self, effects):
        multiples = [part for part in effects if isinstance(part, Multiple)]
        total = sum(part.size for part in multiples)
        passed = [part for part in effects if isinstance(part, Passing)]
        beside = sum((total * part.share * self.columns[:, part.number] for part in passed), 0.0)
        return super().force(multiples) + beside

    def response(self, fitted):
        known = [part for parts in built(fitted.candidates, fitted.values[1:]) for part in parts]
        return lambda effects: self.force([*known, *effects]) - self.force(known)

    def objective(self, candidates):
        return PassingObjective(self, candidates)


class PassingObjective(Objective):
    """Its derivatives by differences."""

    def jacobian(self, values):
        steps = 1e-6 * np.eye(len(values))
        return (
            np.column_stack(
                [
                    (self.residuals(values + step) - self.residuals(values - step)) / 2e-6
                    for step in steps
                ]
            )
            * self.scale
        )


def test_what_does_nothing_alone_is_found_beside_what_moves_it(rng):
    """A shaft that gives way was taken for an error of the teeth where a motor cogs."""
    columns = rng.normal(size=(N, 3))
    columns[:, 2] = 0.7 * columns[:, 1] + 0.7 * columns[:, 2]
    measured = 9.0 * columns[:, 0] + 1.5 * columns[:, 1] + rng.normal(size=N)
    data = PassingData(measured, columns, np.ones(N))
    passing = Candidate(
        "shaft",
        "1",
        (unknown("share", 0.0, 1.0, 0.1, linear=False),),
        ((0.1,),),
        lambda values: (Passing("shaft", 1, values[0]),),
        "",
        nuisance=True,
    )
    moving = replace(candidate(0), nuisance=True)
    growth = Growth(data, fit(data), [moving, passing, candidate(2)], data)
    growth.grow()
    assert {member.name for member in growth.ranked[0].candidates} == {"effect_0", "shaft"}


@dataclass(eq=False)
class TurningData(PassingData):
    """Data in which an effect does something else beside the first one."""

    def force(self, effects):
        turned = any(part.number == 0 and part.size for part in effects)
        return sum(
            (part.size * self.columns[:, part.number + (turned and part.number == 2)])
            for part in effects
        ) + np.zeros(N)


def test_what_an_effect_does_beside_others_is_asked_before_something_is_outside(rng):
    """A weight seemed to be no more than the ripple of a brake that it stood beside."""
    columns = rng.normal(size=(N, 4))
    columns[:, 2] = columns[:, 0]
    measured = 9.0 * columns[:, 0] + 3.0 * columns[:, 3] + rng.normal(size=N)
    part = Sized("outside", np.eye(N), 1.0, 30.0, np.zeros(N), np.zeros(N, dtype=bool))
    growth = Growth(
        data := TurningData(measured, columns, np.ones(N), outside=(part,)),
        fit(data),
        [candidate(number) for number in range(3)],
        data,
    )
    growth.grow()
    assert {member.name for member in growth.ranked[0].candidates} == {"effect_0", "effect_2"}


def test_an_effect_is_lost_by_what_its_set_is_likelier_for_it(rng):
    """With noise that is known the ratio of the densities at nothing is that of the integrals."""
    columns = rng.normal(size=(N, 3))
    data = LinearData(columns @ [2.0, -0.5, 1.0] + rng.normal(size=N), columns, np.ones(N))
    hypothesis = data.linearised(fit(data, [candidate(k) for k in range(3)]))
    fixed = replace(
        hypothesis,
        sized=tuple(replace(part, least=3.0, most=3.0, cut=False) for part in hypothesis.sized),
    )
    integral = Integral(fixed)
    whole = integral.score().ln
    for number, loss in enumerate(integral.losses()):
        assert loss == pytest.approx(whole - score(fixed.without(number)).ln, abs=0.02)


def test_changes_below_the_noise_are_no_unknowns(rng):
    """A law errs along a hundred directions, of which a few do anything."""
    narrow = rng.normal(size=(N, 3)) @ rng.normal(size=(3, 20)) + 1e-4 * rng.normal(size=(N, 20))
    data = LinearData(rng.normal(size=(N, 2)) @ [3.0, 1.0], rng.normal(size=(N, 1)), np.ones(N))
    fitted = fit(data, [candidate(0)])
    hypothesis = linearise(fitted, np.zeros(N, int), lambda *_: (narrow,), 0.0)
    form = next(part for part in hypothesis.sized if part.of_form)
    assert form.columns.shape[1] == 3
    whole = replace(form, columns=narrow, at=np.zeros(20), positive=np.zeros(20, bool))
    other = [whole if part is form else part for part in hypothesis.sized]
    assert score(hypothesis).ln == pytest.approx(
        score(replace(hypothesis, sized=tuple(other))).ln, abs=0.01
    )


@pytest.fixture
def place():
    """Something that no column holds, along three waves."""
    at = np.linspace(-1.0, 1.0, N)
    waves = np.column_stack([np.sin(k * np.pi * at) for k in range(1, 4)])
    return Sized("place", waves, 0.2, 30.0, np.zeros(3), np.zeros(3, bool))


def test_nothing_is_grown_from_noise(rng, place):
    growth = grown(rng.normal(size=N), rng.normal(size=(N, 5)), np.ones(N), (place,))
    decision, _ = growth.decide()
    assert decision.status == "adequate"
    assert growth.ranked[0].candidates == ()


def test_what_no_column_holds_is_outside(rng, place):
    measured = place.columns @ [3.0, -2.0, 4.0] + rng.normal(size=N)
    decision, every = grown(measured, rng.normal(size=(N, 5)), np.ones(N), (place,)).decide()
    assert decision.status == "unlisted"
    assert decision.outside > 0.95
    assert every[0].places == ("place",)


def test_nothing_is_not_enough_where_an_effect_is_evident(rng):
    """Parts that lose contact are heard, and no effect that was fitted shows in what is left."""
    data = LinearData(rng.normal(size=N), np.zeros((N, 1)), np.ones(N))
    data.evident = frozenset({"effect_0"})
    growth = Growth(data, fit(data), [candidate(0)], data)
    growth.grow()
    decision, _ = growth.decide()
    assert decision.status == "unlisted"
