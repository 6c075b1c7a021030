"""The least squares behind every fit, on problems whose minima are known."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._selection.fitting import Fit, Unknowns
from pymoo_hdte.discrepancy._selection.levenberg_marquardt import (
    SETTLED,
    Minimum,
    _arrived,
    _step,
    is_hopeless,
    minimum,
    moved,
    turned,
    way,
)
from pymoo_hdte.effects.unknowns import Parameter

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


@given(
    start=st.tuples(st.floats(0.5, 3.0), st.floats(-3.0, 3.0)),
    end=st.tuples(st.floats(0.5, 3.0), st.floats(-1.4, 1.4)),
)
def test_a_step_leads_to_where_its_way_begins_and_takes_derivatives_along(start, end):
    """Residuals that are linear in the parts of a line change by derivatives times the way."""
    problem = Plane((1.0, 2.0, 1.0))
    here, there = np.array([*start, 0.0]), np.array([end[0], start[1] + end[1], 1.0])
    step = way(problem, here, there)
    assert moved(problem, here, step) == pytest.approx(there)
    foretold = problem.residuals(here) + problem.jacobian(here) @ step
    assert foretold == pytest.approx(problem.residuals(there), abs=1e-8)
    taken = turned(problem, here, there, problem.jacobian(here))
    assert taken == pytest.approx(problem.jacobian(there), abs=1e-9)


@pytest.mark.parametrize(
    ("start", "lower", "upper", "best", "ends"),
    [
        # The least amplitude is reached along the line, the largest across it.
        ((2.0, -0.4), 1.0, 9.0, (0.3, 0.4), (1.0, np.arctan2(0.4, 0.3))),
        ((0.5, 0.0), 0.1, 1.0, (1.2, 1.6), (1.0, np.arctan2(1.6, 1.2))),
        # A line that was believed not to be there has no direction yet.
        ((0.0, 0.0), 0.0, 9.0, (0.3, 0.4), (0.5, np.arctan2(0.4, 0.3))),
    ],
)
def test_a_step_in_the_plane_of_a_line_stays_within_its_amplitudes(start, lower, upper, best, ends):
    problem, tried = Plane((*best, 0.0)), []
    problem.lower, problem.upper = np.array([lower, -9.0, -9.0]), np.array([upper, 9.0, 9.0])
    problem.weights = np.diag([10.0, 10.0, 1.0])
    residuals = problem.residuals
    problem.residuals = lambda values: (tried.append(values[0]), residuals(values))[1]
    ended = minimum(problem, np.array([*start, 0.0]), 40)
    assert ended.values == pytest.approx([*ends, 0.0], abs=NEAR / 10.0)
    assert lower <= min(tried)
    assert max(tried) <= upper


@pytest.mark.parametrize(("of_known", "of_search"), [(1.0, 1.0), (1.0, 100.0), (100.0, 1.0)])
def test_a_search_arrives_along_a_straight_way_that_neither_derivative_sees(of_known, of_search):
    """Half a right angle apart, along a direction in which residuals hardly change."""
    problem, derived = Plane((0.0, 0.0, 0.0)), [of_known, of_search]
    problem.weights = np.diag([1.0, 0.01, 1.0])
    here, there = np.array([1.0, 0.0, 0.0]), np.array([2.0**0.5, np.pi / 4.0, 0.0])
    for at, values in ((here, there), (there, here)):
        # A little lower than where the search is.
        known = Minimum(at, 0.9 * problem.residuals(at), of_known * problem.jacobian(at))
        residuals, jacobian = problem.residuals(values), of_search * problem.jacobian(values)
        arrived = _arrived(problem, values, residuals, jacobian, known)
        assert arrived == (derived == [1.0, 1.0])


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


def test_derivatives_of_a_line_elsewhere_serve_once_they_are_turned():
    """No further derivatives are needed where residuals are linear in its parts."""
    problem = Plane((1.0, 2.0, 1.0))
    problem.weights = np.vstack([problem.weights, [0.0, 0.0, 3.0]])
    low = minimum(problem, np.array([2.0, 0.0, 2.0]), 40)
    start = np.array([1.0, low.values[1] - 1.0, 0.0])
    begun = Minimum(
        start, problem.residuals(start), turned(problem, low.values, start, low.jacobian)
    )
    problem.derived = 0
    again = minimum(problem, begun, 40, known=[low])
    assert problem.derived == 0
    assert again.residuals @ again.residuals == pytest.approx(
        low.residuals @ low.residuals, abs=0.1
    )


def test_lines_are_found_among_the_unknowns_by_the_amplitude_that_a_phase_is_of():
    level = Parameter("level", 0.0, -1.0, 1.0, 1.0)
    phases = [Parameter(f"phase_{k}", 0.0, -9.0, 9.0, 0.1, phase_of=f"size_{k}") for k in (0, 1)]
    sizes = [Parameter(f"size_{k}", 1.0, 0.5, 2.0, 1.0) for k in (0, 1)]
    assert Unknowns((level, *sizes, *phases), ()).lines.tolist() == [[1, 3], [2, 4]]
    assert Unknowns((level,), ()).lines.shape == (0, 2)


def test_each_line_of_the_error_of_a_drive_has_its_amplitude_and_its_phase():
    base = base_parameters(BELIEVED, RIG, np.zeros(len(BELIEVED.error_orders)), 0.0)
    found = [(base[size].name, base[phase].name) for size, phase in Unknowns(base, ()).lines]
    lines = range(len(BELIEVED.error_orders))
    assert found == [(f"error_amplitude_{line}", f"error_phase_{line}") for line in lines]


class Linear:
    """Residuals J (x - best) that are linear in three unknowns."""

    scale, lower, upper = np.ones(3), np.full(3, -1e3), np.full(3, 1e3)
    lines = np.empty((0, 2), dtype=int)

    def __init__(self, rng):
        self.matrix, self.best = 10.0 * rng.normal(size=(7, 3)), rng.normal(size=3)

    def residuals(self, values):
        return self.matrix @ (values - self.best)

    def jacobian(self, values):
        return self.matrix


@pytest.mark.parametrize("damping", [1e-3, 1.0, 30.0])
def test_a_damped_step_has_its_closed_form_and_brings_all_that_it_promises(damping, rng):
    """Of linear residuals; the next one is then damped ten times less."""
    problem, start = Linear(rng), np.array([3.0, -2.0, 1.0])
    residuals, size = problem.residuals(start), np.array([1.0, 5.0, 20.0])
    ended = _step(problem, start, residuals, problem.matrix, size, damping)
    curvature = problem.matrix.T @ problem.matrix + damping * np.diag(size**2)
    step = np.linalg.solve(curvature, -problem.matrix.T @ residuals)
    assert ended.values - start == pytest.approx(step)
    assert ended.share == pytest.approx(1.0)
    assert ended.damping == pytest.approx(0.1 * damping)


class Saturated:
    """A residual that saturates: steps without damping lead ever farther beyond 1.4."""

    scale, lower, upper = np.ones(1), np.full(1, -1e12), np.full(1, 1e12)
    lines = np.empty((0, 2), dtype=int)

    def residuals(self, values):
        return WEIGHT * np.arctan(values)

    def jacobian(self, values):
        return WEIGHT / (1.0 + values[:, None] ** 2)


@pytest.mark.parametrize("start", [20.0, -300.0])
def test_damping_grows_until_a_step_leads_down(start):
    ended = minimum(Saturated(), np.array([start]), 40)
    assert ended.values == pytest.approx([0.0], abs=NEAR / WEIGHT)


class Valley:
    """Rosenbrock's curved valley, its unknowns counted in other units."""

    lines = np.empty((0, 2), dtype=int)

    def __init__(self, units):
        self.units, self.scale, self.visited = units, np.ones(2), []
        self.lower, self.upper = np.full(2, -1e9), np.full(2, 1e9)

    def residuals(self, values):
        x, y = values * self.units
        self.visited.append((x, y))
        return np.array([100.0 * (y - x**2), 10.0 * (1.0 - x)])

    def jacobian(self, values):
        x, _ = values * self.units
        return np.array([[-200.0 * x, 100.0], [-10.0, 0.0]]) * self.units


def test_damping_does_not_depend_on_the_units_of_unknowns():
    """As long as derivatives are computed: what a step shows of them is updated in given units."""
    first_steps = []
    for units in (np.ones(2), np.array([2.0**-6, 2.0**5])):
        problem = Valley(units)
        ended = minimum(problem, np.array([-1.2, 1.0]) / units, 40)
        assert ended.values * units == pytest.approx([1.0, 1.0], abs=NEAR)
        first_steps.append(problem.visited[:2])
    np.testing.assert_allclose(first_steps[1], first_steps[0], rtol=1e-9)
