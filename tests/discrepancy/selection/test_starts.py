"""Which further starts a fit follows, and where it ends."""

from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Unknowns, fit
from pymoo_hdte.discrepancy._selection.hypothesis import hypothesis_of
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._selection.starts import best_fit
from pymoo_hdte.effects.unknowns import Parameter, unknown

TIME = np.linspace(0.0, 10.0, 400)
STRENGTH, FREQUENCY, LEVEL = 3.0, 2.0, 5.0


class Wave:
    """Residuals of a level and a wave of unknown strength and frequency, measured with noise 1."""

    parameters = (
        Parameter("level", 0.0, -10.0, 10.0, 1.0),
        Parameter("strength", 1.0, 0.0, 10.0, 1.0),
        Parameter("frequency", 6.0, 0.5, 12.0, 1.0),
    )
    candidates = (SimpleNamespace(parameters=parameters[1:]),)
    scale = np.ones(3)
    lines = np.empty((0, 2), dtype=int)
    start, lower, upper = np.array([[one.start, one.lower, one.upper] for one in parameters]).T

    def __init__(self):
        noise = np.random.default_rng(3).normal(size=len(TIME))
        self.measured = LEVEL + STRENGTH * np.sin(FREQUENCY * TIME) + noise
        self.derived = 0

    def residuals(self, values):
        level, strength, frequency = values
        return level + strength * np.sin(frequency * TIME) - self.measured

    def jacobian(self, values):
        self.derived += 1
        _, strength, frequency = values
        slopes = np.sin(frequency * TIME), strength * TIME * np.cos(frequency * TIME)
        return np.column_stack([np.ones_like(TIME), *slopes])


@pytest.fixture
def far():
    """The evidence, and a fit whose wave has vanished far from the true frequency."""
    problem = Wave()
    data = SimpleNamespace(objective=lambda _: problem, rules=RULES, base=Wave.parameters[:1])
    vanished = fit(data, (), np.array([0.0, 1.0, 9.0]))
    assert vanished.values[1] < 0.5
    one = SimpleNamespace(candidates=Wave.candidates, names=frozenset(), fit=vanished)
    return data, problem, one


def found_from(far, start):
    """Where the best fit ends with one more start, and how often derivatives were asked for."""
    data, problem, one = far
    problem.derived = 0
    best = best_fit(data, one, [np.array(start)], ())
    return best, problem.derived


def test_a_start_is_followed_where_its_shape_removes_what_is_left(far):
    _, without = found_from(far, far[2].fit.values)
    best, derived = found_from(far, [0.0, 1.0, 2.2])
    assert derived > without
    assert best.values == pytest.approx([LEVEL, STRENGTH, FREQUENCY], abs=0.3)


@pytest.mark.parametrize("start", [[0.0, 1.0, 7.0], [-3.0, 0.0, 9.0]])
def test_no_start_is_followed_whose_shape_is_not_in_the_data_or_that_leads_back(far, start):
    _, without = found_from(far, far[2].fit.values)
    best, derived = found_from(far, start)
    assert derived == without
    assert best.chi_square == pytest.approx(far[2].fit.chi_square, abs=0.1)
    # That it would lead nowhere else: followed, it ends no lower.
    assert fit(far[0], (), np.array(start)).chi_square > best.chi_square - 0.1


class Fold:
    """Residuals of a zero and of its size: two minima, on either side of the kink at nothing.

    As of a friction that acts against the load: a load near zero may have either sign.
    """

    candidates = ()
    parameters = (Parameter("zero", 0.0, -10.0, 10.0, 1.0),)
    scale, start, lower, upper = np.ones(1), np.zeros(1), np.array([-10.0]), np.array([10.0])
    lines = np.empty((0, 2), dtype=int)
    SIZE, BELIEVED = 3.0, -1.0

    def __init__(self):
        self.tried, self.derived = [], []

    def residuals(self, values):
        self.tried.append(values[0])
        return np.array([abs(values[0]) - self.SIZE, 0.5 * (values[0] - self.BELIEVED)])

    def jacobian(self, values):
        # Where, and which place was tried last.
        self.derived.append((values[0], self.tried[-1]))
        return np.array([[np.sign(values[0])], [0.5]])


def test_a_start_beyond_a_kink_is_followed_by_the_derivatives_that_foretell_most_of_the_way():
    problem = Fold()
    data = SimpleNamespace(objective=lambda _: problem, rules=RULES, base=())
    above = fit(data, (), np.array([5.0]))
    # Both minima in closed form: where the slope of the sum of squares is nothing on either side.
    assert above.values == pytest.approx([(Fold.SIZE + 0.25 * Fold.BELIEVED) / 1.25], abs=0.01)
    one, problem.derived = SimpleNamespace(candidates=(), names=frozenset(), fit=above), []
    best = best_fit(data, one, [np.array([-2.0])], ())
    assert best.values == pytest.approx([(-Fold.SIZE + 0.25 * Fold.BELIEVED) / 1.25], abs=0.01)
    assert best.chi_square < above.chi_square
    # Derivatives from above the kink lead nowhere, and were tried first.
    assert (-2.0, -2.0) not in problem.derived
    assert -2.0 in dict(problem.derived)


class Falling(Unknowns):
    """Residuals of a dry friction, beside excesses that fade at speeds of their own."""

    speeds = np.linspace(0.5, 100.0, 200)

    def __init__(self, candidates, excesses):
        super().__init__((), candidates)
        self.measured = LEVEL + sum(size * self.left(fading) for fading, size in excesses.items())

    def left(self, fading):
        return np.exp(-((self.speeds / fading) ** 2))

    def residuals(self, values):
        level, *falling = values
        excess, fading = falling or (0.0, 1.0)
        return level + excess * self.left(fading) - self.measured

    def jacobian(self, values):
        steps = self.steps(values)
        moved = values + np.diag(steps * self.scale)
        changes = np.array([self.residuals(one) for one in moved]) - self.residuals(values)
        return (changes / steps[:, None]).T


UNKNOWNS = (
    unknown("level", 0.0, 20.0, LEVEL),
    unknown("excess", 0.0, 20.0, 1.5),
    unknown("fading", 1.0, 100.0, 10.0),
)


def friction(name, *starts):
    return Candidate(f"{name}_friction", "input", UNKNOWNS[: len(starts[0])], starts, tuple, "")


COULOMB = friction("coulomb", (LEVEL,))
STRIBECK = friction("stribeck", *((LEVEL, 1.5, fading) for fading in (5.0, 10.0, 20.0)))


FAR = LEVEL + 3.0


def falling(excesses):
    return SimpleNamespace(
        objective=lambda candidates: Falling(candidates, excesses), rules=RULES, base=()
    )


TWO_ENDS = pytest.mark.parametrize(
    ("excesses", "begin", "end"),
    [
        ({1.0: 1.5, 10.0: -0.6, 100.0: 0.8}, 1.0, 100.0),
        # There the excess has vanished.
        ({1.0: 2.5, 10.0: -0.8}, 100.0, 1.0),
    ],
)


@TWO_ENDS
def test_a_law_no_better_than_its_special_case_is_tried_from_the_other_bound_of_its_shape(
    excesses, begin, end
):
    """From the law's own starts, between the bounds, the excess vanishes."""
    data = falling(excesses)
    one = hypothesis_of(fit(data, (STRIBECK,), np.array([LEVEL, 0.1, begin])), 0.0)
    assert one.fit.values[2] == pytest.approx(begin)
    best = best_fit(data, one, (), [hypothesis_of(fit(data, (COULOMB,)), 0.0)])
    assert best.values[2] == pytest.approx(end)
    assert best.chi_square < one.fit.chi_square - 1.0
