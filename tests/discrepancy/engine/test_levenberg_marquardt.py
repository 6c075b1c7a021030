"""The least squares behind every fit, on problems whose minima are known."""

from collections import Counter

import numpy as np
import pytest

from pymoo_hdte.discrepancy.engine.fitting import Fit
from pymoo_hdte.discrepancy.engine.levenberg_marquardt import SETTLED, is_hopeless, minimum

WEIGHT = 100.0
NEAR = np.sqrt(SETTLED)
"""Way from a minimum at which chi-square, of curvature 2 or more, is that of the minimum."""


class TwoMinima:
    """Residuals w (x^2 - 1) and x - 1 + y, y: least at (1, 0), and higher near (-1, 1)."""

    scale = np.ones(2)
    lower, upper = np.full(2, -5.0), np.full(2, 5.0)
    lines = np.empty((0, 2), dtype=int)

    def __init__(self):
        self.asked = Counter()

    def residuals(self, values):
        self.asked["residuals"] += 1
        x, y = values
        return np.array([WEIGHT * (x**2 - 1.0), x - 1.0 + y, y])

    def jacobian(self, values):
        self.asked["jacobian"] += 1
        return np.array([[2.0 * WEIGHT * values[0], 0.0], [1.0, 1.0], [0.0, 1.0]])


class Plane:
    """Residuals linear in the parts of a line, given by amplitude and phase, and in one unknown.

    The line and the unknown do nearly the same: along a valley only the last residuals change.
    """

    scale = np.array([1.0, 0.1, 1.0])
    lower, upper = np.array([0.1, -9.0, -9.0]), np.array([9.0, 9.0, 9.0])
    weights = np.array([[1e3, 0.0, -1e3], [0.0, 1e3, -2e3], [0.3, 0.0, 0.0], [0.0, 0.5, 0.0]])

    def __init__(self, best, straight=True):
        self.best, self.derived = np.array(best), 0
        self.lines = np.array([[0, 1]] if straight else [], dtype=int).reshape(-1, 2)

    @staticmethod
    def parts(values):
        amplitude, phase, other = values
        return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase), other])

    def residuals(self, values):
        return self.weights @ (self.parts(values) - self.best)

    def jacobian(self, values):
        self.derived += 1
        amplitude, phase, _ = values
        by_parts = np.eye(3)
        by_parts[:2, 0] = np.cos(phase), np.sin(phase)
        by_parts[:2, 1] = -amplitude * np.sin(phase), amplitude * np.cos(phase)
        return self.weights @ by_parts * self.scale


def found(start, known=(), hopeless=np.inf):
    """Where a search ends, and how often it asked for derivatives."""
    problem = TwoMinima()
    begin = start.minimum if isinstance(start, Fit) else np.array(start)
    values, residuals, jacobian = minimum(problem, begin, 40, known=known, hopeless=hopeless)
    return Fit((), (), values, residuals, jacobian), problem.asked["jacobian"]


def test_each_start_ends_at_the_minimum_of_its_side():
    low, _ = found([3.0, 2.0])
    high, _ = found([-3.0, 2.0])
    assert low.values == pytest.approx([1.0, 0.0], abs=NEAR)
    assert low.chi_square == pytest.approx(0.0, abs=SETTLED)
    # There y = (1 - x) / 2 = 1 leaves 1 + 1.
    assert high.values == pytest.approx([-1.0, 1.0], abs=NEAR)
    assert high.chi_square == pytest.approx(2.0, abs=SETTLED)


def test_a_search_that_arrives_at_a_known_minimum_ends_there():
    low, whole = found([3.0, 2.0])
    again, part = found([3.5, -2.0], [low])
    assert part < whole
    way = low.jacobian @ (again.values - low.values)
    assert way @ way < 1.0
    assert again.chi_square >= low.chi_square


def test_a_known_minimum_elsewhere_or_a_worse_one_ends_no_search():
    low, _ = found([3.0, 2.0])
    high, _ = found([-3.0, 2.0])
    assert found([-3.0, 2.0], [low])[0].values == pytest.approx(high.values, abs=NEAR)
    # A place beside the minimum that claims to be one.
    beside = Fit((), (), low.values + np.array([0.0, 0.3]), np.array([0.0, 0.3, 0.3]), low.jacobian)
    assert found([3.0, 2.0], [beside])[0].values == pytest.approx(low.values, abs=NEAR)


def test_a_search_goes_on_with_the_derivatives_of_an_earlier_one():
    """From its values alone, derivatives would be computed once more."""
    far = Fit((), (), *minimum(TwoMinima(), np.array([3.0, 2.0]), 1))
    assert far.chi_square > 2.0 * SETTLED
    again, derived = found(far)
    from_values, whole = found(far.values)
    assert derived < whole
    assert again.values == pytest.approx(from_values.values, abs=NEAR)


def test_a_search_goes_on_past_derivatives_of_another_place():
    """They promise no way down from here."""
    problem, there = TwoMinima(), np.array([3.0, 2.0])
    elsewhere = Fit((), (), there, problem.residuals(there), np.zeros((3, 2)))
    assert found(elsewhere)[0].values == pytest.approx([1.0, 0.0], abs=NEAR)


@pytest.mark.parametrize(("hopeless", "ends"), [(1.0, True), (3.0, False), (np.inf, False)])
def test_a_search_ends_that_will_leave_too_much(hopeless, ends):
    """At the minimum at (-1, 1) 2 is left."""
    high, whole = found([-3.0, 2.0])
    beside, derived = found([-3.0, 2.0], hopeless=hopeless)
    assert (derived < whole) == ends
    if not ends:
        assert beside.values == pytest.approx(high.values, abs=NEAR)


def test_a_search_that_leaves_little_goes_on():
    assert found([3.0, 2.0], hopeless=1.0)[0].values == pytest.approx([1.0, 0.0], abs=NEAR)


@pytest.mark.parametrize(
    ("promised", "ends"),
    [
        ([69.0], False),
        ([69.0, 29.0], False),
        ([69.0, 40.0], True),
        ([9.0, 40.0], False),
        ([69.0, 19.0], False),
        ([900.0, 69.0, 40.0], True),
    ],
)
def test_a_search_is_hopeless_once_two_promises_are_hardly_better(promised, ends):
    """The first two are those of hysteresis, which was right."""
    assert is_hopeless(promised, 20.0) == ends


@pytest.mark.parametrize("start", [(2.0, 0.0, 2.0), (0.4, 1.4, 0.4), (3.0, -0.3, -1.0)])
def test_a_step_leads_straight_on_in_the_plane_of_a_line(start):
    """Where residuals are linear in it they are known from one place, but for the damping."""
    problem = Plane((1.0, 2.0, 1.0))
    ended = minimum(problem, np.array(start), 40)
    assert ended.residuals @ ended.residuals < SETTLED
    # At the start, and where the search has settled or the damping was too strong.
    assert problem.derived <= 3
    in_polar = Plane((1.0, 2.0, 1.0), straight=False)
    minimum(in_polar, np.array(start), 40)
    assert in_polar.derived > problem.derived


def test_a_step_in_the_plane_of_a_line_stays_within_the_bounds_of_its_amplitude():
    """With 1 as the least amplitude the best one, 0.5, is reached along it, at its best phase."""
    problem = Plane((0.3, 0.4, 0.0))
    problem.lower = np.array([1.0, -9.0, -9.0])
    problem.weights = np.diag([10.0, 10.0, 1.0])
    ended = minimum(problem, np.array([2.0, -0.4, 0.0]), 40)
    assert ended.values == pytest.approx([1.0, np.arctan2(0.4, 0.3), 0.0], abs=NEAR / 10.0)


def test_a_search_in_the_plane_of_a_line_ends_at_a_known_minimum():
    problem = Plane((1.0, 2.0, 1.0))
    problem.weights = np.vstack([problem.weights, [0.0, 0.0, 3.0]])
    low = minimum(problem, np.array([2.0, 0.0, 2.0]), 40)
    problem.derived = 0
    again = minimum(problem, np.array([3.0, -0.3, -1.0]), 40, known=[low])
    assert problem.derived == 1
    assert again.residuals @ again.residuals == pytest.approx(
        low.residuals @ low.residuals, abs=0.1
    )
