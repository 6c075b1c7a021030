"""Each strategy of the swarm family on its own, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.core.population import Population
from pymoo.core.termination import NoTermination, TerminateIfAll, TerminateIfAny
from pymoo.termination import get_termination
from pymoo.termination.collection import TerminationCollection
from scipy.stats import entropy

from pymoo_hdte.algorithms import EntropyWeight, Flat, LinearDecrease, Pyramid
from pymoo_hdte.algorithms.horizon import generation_limit
from pymoo_hdte.algorithms.inertia import normalised_entropy
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.pyramid import mutation_step
from pymoo_hdte.algorithms.swarm import improves, personal_bests
from pymoo_hdte.checks import InvalidInput

LINE = np.column_stack([np.arange(8.0), np.arange(8.0)[::-1]])
fronts = arrays(
    float, st.tuples(st.integers(1, 60), st.integers(2, 3)), elements=st.floats(-1e6, 1e6)
)


@pytest.mark.parametrize(
    ("front", "expected"),
    [
        (LINE, 1.0),  # a cell each
        (LINE[[0, 0, 7, 7]], 0.5),  # two cells of two: ln 2 / ln 4
        (LINE[[0, 0, 0, 7]], (4 * np.log(4) - 3 * np.log(3)) / (4 * np.log(4))),
        # The upper edge belongs to the last cell, so the last two solutions share it.
        (LINE[[0, 6, 7]] + [[0, 0], [0.9, -0.9], [0, 0]], 1 - 2 * np.log(2) / (3 * np.log(3))),
        (LINE[[3, 3, 3]], 0.0),  # one cell
        (LINE[:1], 0.0),  # one solution, 0 / 0 in the formula
        (LINE[:0], 0.0),
    ],
)
def test_entropy_of_known_distributions(front, expected):
    assert normalised_entropy(front, divisions=32) == pytest.approx(expected, abs=1e-15)


def test_entropy_is_bounded_by_the_number_of_cells_if_that_is_smaller():
    corners = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    # Four full cells of four are all the diversity there can be, though there are 40 solutions.
    assert normalised_entropy(np.tile(corners, (10, 1)), divisions=2) == pytest.approx(1.0)
    # Four of the eight cells that three objectives make hold two thirds of it: ln 4 / ln 8.
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    assert normalised_entropy(np.tile(corners, (10, 1)), divisions=2) == pytest.approx(2.0 / 3.0)


@pytest.mark.parametrize("n_obj", [2, 3])
def test_entropy_agrees_with_scipy_on_a_histogram(n_obj):
    front = np.random.default_rng(n_obj).random((50, n_obj)) ** 3
    counts, _ = np.histogramdd(front, bins=32)
    assert normalised_entropy(front, 32) == pytest.approx(entropy(counts.ravel()) / np.log(50))


@given(fronts)
def test_entropy_weight_stays_in_its_range(front):
    assert 0.4 <= EntropyWeight()(0.5, front) <= 0.9


def test_entropy_weight_explores_without_diversity_and_settles_with_it():
    weight = EntropyWeight()
    assert weight(0.0, LINE[:1]) == pytest.approx(0.9)
    assert weight(0.0, LINE[[0, 0, 7, 7]]) == pytest.approx(0.65)
    assert weight(0.0, LINE) == pytest.approx(0.4)


def test_linear_weight():
    weight = LinearDecrease()
    np.testing.assert_allclose([weight(p, LINE) for p in (0.0, 0.5, 1.0)], [0.9, 0.65, 0.4])


@pytest.mark.parametrize(
    ("kind", "arguments", "field"),
    [
        (LinearDecrease, {"w_min": 1.0}, "w_min"),
        (LinearDecrease, {"w_max": -0.1}, "w_max"),
        (EntropyWeight, {"w_min": np.nan}, "w_min"),
        (EntropyWeight, {"divisions": 1}, "divisions"),
    ],
)
def test_weights_check_their_input(kind, arguments, field):
    with pytest.raises(InvalidInput, match=field):
        kind(**arguments)


def test_pyramid_accelerates_by_layer():
    c1, c2 = Pyramid().acceleration(np.array([1, 2, 3, 9]))
    np.testing.assert_array_equal(c1, [1.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(c2, [2.0, 2.0, 1.0, 1.0])


def test_flat_swarm_has_one_layer_and_no_mutation():
    c1, c2 = Flat().acceleration(np.array([1, 3, 9]))
    assert set(c1) == set(c2) == {2.0}
    shift = Flat().mutation(np.array([1, 3, 9]), 0.0, np.ones(4), np.random.default_rng(0))
    np.testing.assert_array_equal(shift, np.zeros((3, 4)))


@pytest.mark.parametrize(
    ("progress", "expected"), [(0.0, 0.2), (0.5, 0.1), (0.95, 0.01), (0.99, 0.01), (1.0, 0.01)]
)
def test_mutation_step_shrinks_to_a_floor(progress, expected):
    span = np.array([1.0, 30.0])
    np.testing.assert_allclose(mutation_step(progress, span), expected * span)


def test_mutation_strikes_two_in_five_of_the_bottom_and_none_of_the_top():
    n = 20_000
    ranks = np.tile([1, 2, 3, 7], n // 4)
    span = np.array([1.0, 10.0])
    shift = Pyramid().mutation(ranks, 0.5, span, np.random.default_rng(1))
    assert not shift[ranks <= 2].any()
    bottom = shift[ranks > 2]
    struck = bottom.all(axis=1)
    assert not bottom[~struck].any()  # all dimensions of a particle or none
    assert struck.mean() == pytest.approx(0.4, abs=4 * np.sqrt(0.4 * 0.6 / len(bottom)))
    # Four standard errors of a normal standard deviation, 0.1 of the span at half time.
    error = 4 / np.sqrt(2 * struck.sum())
    np.testing.assert_allclose(bottom[struck].std(axis=0) / span, 0.1, rtol=error)
    assert abs(np.corrcoef(bottom[struck].T)[0, 1]) < 4 / np.sqrt(struck.sum())


def test_personal_best_follows_dominance():
    best = Points(np.zeros((4, 1)), np.array([[2.0, 2.0]] * 4), np.array([0.0, 0.0, 1.0, 0.0]))
    visited = Points(
        np.ones((4, 1)),
        np.array([[1.0, 2.0], [2.0, 3.0], [9.0, 9.0], [0.0, 0.0]]),
        np.array([0.0, 0.0, 0.5, 0.1]),
    )
    for seed in range(8):
        replaced = improves(best, visited, np.random.default_rng(seed))
        np.testing.assert_array_equal(replaced, [True, False, True, False])


def test_a_coin_decides_between_incomparable_bests():
    n = 10_000
    best = Points(np.zeros((n, 1)), np.tile([1.0, 2.0], (n, 1)), np.zeros(n))
    visited = Points(np.ones((n, 1)), np.tile([2.0, 1.0], (n, 1)), np.zeros(n))
    replaced = improves(best, visited, np.random.default_rng(2))
    assert replaced.mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(n))


def test_a_particle_carries_its_best_and_is_that_itself_by_default():
    first, second, third, old = Population.new("X", np.arange(4.0)[:, np.newaxis])
    second.data["best"], third.data["best"] = old, None
    bests = personal_bests(Population([first, second, third]))
    assert list(bests) == [first, old, third]


@pytest.mark.parametrize(
    ("termination", "n_max_gen", "expected"),
    [
        (get_termination("n_gen", 70), None, 70),
        (get_termination("n_gen", 70), 30, 70),
        (get_termination("n_eval", 1001), None, 11),
        (get_termination("n_eval", 1000), 30, 30),
        (get_termination("n_eval", 5), None, 1),
        (get_termination("time", 5), 30, 30),
        (get_termination("n_gen"), 30, 30),
        (get_termination("moo"), None, 1000),
        (get_termination("moo"), 30, 30),
        (NoTermination(), 30, 30),
        (TerminateIfAny(get_termination("time", 5), get_termination("n_gen", 40)), None, 40),
        (TerminationCollection(get_termination("n_eval", 900), NoTermination()), None, 9),
    ],
)
def test_number_of_generations(termination, n_max_gen, expected):
    assert generation_limit(termination, 100, n_max_gen) == expected


@pytest.mark.parametrize(
    "termination",
    [
        NoTermination(),
        get_termination("time", 5),
        get_termination("n_gen"),
        TerminateIfAll(get_termination("time", 5), get_termination("n_gen", 40)),
    ],
)
def test_without_a_limit_schedules_count_on_what_pymoo_allows_by_default(termination):
    with pytest.warns(UserWarning, match="n_max_gen"):
        usual = generation_limit(termination, 100, None)
    assert usual == get_termination("moo").criteria[-2].n_max_gen
