"""Parts of the elitist swarm: its moves, its mutation, its truncation, what survives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import kstest, ortho_group

from pymoo_hdte.algorithms.dominance import constrained_ranks, dominates
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange, SparseMutation
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.algorithms.success_shares import SuccessShares
from pymoo_hdte.algorithms.survival import survivors

N, D = 4000, 5


@pytest.fixture
def flock(rng):
    """Positions (N, D), leaders (N, D) and a swarm to take differences from (30, D)."""
    return rng.random((N, D)), rng.random((N, D)), rng.random((30, D))


# --- moves --------------------------------------------------------------------------------------


def test_attraction_pulls_half_of_the_variables_by_up_to_one_and_a_half(flock, rng):
    X, leaders, swarm = flock
    share = Attraction()(X, leaders, swarm, rng) / (leaders - X)
    moved = share != 0.0
    assert moved.mean() == pytest.approx(0.5, abs=0.02)
    assert kstest(share[moved], "uniform", (0.0, 1.5)).pvalue > 1e-3
    # Variables take part independently of each other.
    together = np.corrcoef(moved.T)[np.triu_indices(D, 1)]
    assert np.abs(together).max() < 0.06


def test_exchange_copies_half_of_the_leader(flock, rng):
    X, leaders, swarm = flock
    steps = Exchange()(X, leaders, swarm, rng)
    copied = steps != 0.0
    np.testing.assert_array_equal(steps[copied], (leaders - X)[copied])
    assert copied.mean() == pytest.approx(0.5, abs=0.02)


def test_difference_turns_with_the_coordinates_and_the_others_do_not(flock):
    rotation = ortho_group.rvs(D, random_state=np.random.default_rng(3))
    turned = [positions @ rotation for positions in flock]
    for move, invariant in ((Difference(), True), (Attraction(), False), (Exchange(), False)):
        plain = move(*flock, np.random.default_rng(7)) @ rotation
        after = move(*turned, np.random.default_rng(7))
        assert np.allclose(plain, after, atol=1e-12) == invariant


def test_difference_adds_half_of_a_difference_in_the_swarm_to_the_pull(flock, rng):
    X, leaders, swarm = flock
    # A leader that stands where the particle is does not pull.
    steps = Difference()(X, X, swarm, rng)
    differences = 0.5 * (swarm[:, np.newaxis] - swarm[np.newaxis]).reshape(-1, D)
    distance = np.linalg.norm(steps[:50, np.newaxis] - differences, axis=2).min(axis=1)
    assert distance.max() < 1e-15
    # In a swarm of one place only the pull is left, the same share of all variables.
    share = Difference()(X, leaders, np.zeros((2, D)), rng) / (leaders - X)
    np.testing.assert_allclose(share, np.broadcast_to(share[:, :1], share.shape), rtol=1e-9)
    assert kstest(share[:, 0], "uniform", (0.0, 1.5)).pvalue > 1e-3


@pytest.mark.parametrize("move", [Attraction(), Exchange(), Difference()])
def test_nothing_moves_in_a_swarm_that_stands_in_one_place(move, rng):
    here = np.ones((6, D))
    assert not move(here, here, here, rng).any()


# --- mutation -----------------------------------------------------------------------------------


def test_mutation_strikes_half_a_variable_a_particle(rng):
    steps = np.ones((N, 8))
    struck = SparseMutation()(steps, np.ones(8), rng) != 0.0
    assert struck.sum(axis=1).mean() == pytest.approx(0.5, abs=0.05)


def test_mutation_never_leaves_a_particle_where_it_is(rng):
    steps = np.zeros((N, 8))
    struck = SparseMutation()(steps, np.ones(8), rng) != 0.0
    assert struck.any(axis=1).all()
    assert struck.sum(axis=0).min() > 0.8 * struck.sum() / 8


def test_mutation_sizes_are_spread_over_two_decades_of_the_box(rng):
    span = np.array([1.0, 1e6])
    mutation = SparseMutation()(np.zeros((40_000, 2)), span, rng)
    rows, columns = np.nonzero(mutation)
    # log10 of a normal step times 10^-u, u being uniform on [0.3, 2.3].
    sizes = np.log10(np.abs(mutation[rows, columns]) / span[columns])
    normal = np.log10(np.abs(rng.standard_normal(200_000)))
    assert sizes.mean() - normal.mean() == pytest.approx(-1.3, abs=0.02)
    assert sizes.var() - normal.var() == pytest.approx(2.0**2 / 12.0, abs=0.02)


# --- shares -------------------------------------------------------------------------------------


def test_shares_follow_success_down_to_a_floor(rng):
    success = SuccessShares(3)
    np.testing.assert_array_equal(success.shares, 1.0 / 3.0)
    moves = np.repeat([0, 1, 2], 100)
    survived = np.concatenate([np.ones(100, bool), np.zeros(100, bool), np.arange(100) < 50])
    for _ in range(60):
        success.learn(moves, survived)
    # Rates 1, 0 and 1/2, but for the prior's trials; 0.85 is left above the floors.
    np.testing.assert_allclose(
        success.shares, [0.05 + 0.85 / 1.5, 0.05, 0.05 + 0.425 / 1.5], atol=2e-3
    )
    drawn = success.draw(20_000, rng)
    np.testing.assert_allclose(np.bincount(drawn) / 20_000, success.shares, atol=0.01)


def test_a_rate_is_known_no_better_than_from_so_many_trials():
    success = SuccessShares(3)
    success.learn(np.array([0, 0, 0, 1]), np.array([True, False, False, False]))
    # Laplace's rule of succession: one of three, none of one, none of none.
    rates = np.array([2.0 / 5.0, 1.0 / 3.0, 1.0 / 2.0])
    np.testing.assert_allclose(success.shares, 0.05 + 0.85 * rates / rates.sum())


def test_old_success_fades():
    success = SuccessShares(2)
    moves = np.array([0] * 50 + [1] * 50)
    for _ in range(50):
        success.learn(moves, moves == 0)
    for _ in range(60):
        success.learn(moves, moves == 1)
    assert success.shares[1] > 0.9


@given(
    arrays(int, 30, elements=st.integers(0, 3)),
    arrays(bool, 30),
)
def test_shares_stay_probabilities(moves, survived):
    success = SuccessShares(4)
    success.learn(moves, survived)
    assert success.shares.sum() == pytest.approx(1.0)
    assert success.shares.min() >= 0.05


# --- truncation ---------------------------------------------------------------------------------


def most_spread_by_recount(F, size):
    """A simple reference: compute every distance again before each removal."""
    span = np.ptp(F, axis=0)
    scaled = (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)
    rows = list(range(len(F)))
    while len(rows) > size:
        left = scaled[rows]
        distance = ((left[:, np.newaxis] - left) ** 2).sum(axis=2)
        np.fill_diagonal(distance, np.inf)
        nearest = np.sort(distance, axis=1)[:, :2]
        rows.pop(
            int(np.lexsort((nearest[:, 1] if len(rows) > 2 else nearest[:, 0], nearest[:, 0]))[0])
        )
    return rows


@st.composite
def objectives(draw):
    shape = (draw(st.integers(1, 14)), draw(st.integers(2, 4)))
    # Quarters are exact, so that ties are ties in whatever order squares are added up.
    elements = st.integers(0, 4).map(lambda quarters: quarters / 4.0)
    return draw(arrays(float, shape, elements=elements))


@settings(max_examples=80)
@given(objectives(), st.integers(1, 8))
def test_truncation_equals_its_naive_twin(F, size):
    np.testing.assert_array_equal(most_spread(F, size), most_spread_by_recount(F, size))


@pytest.mark.parametrize("n_obj", [2, 3, 5])
def test_truncation_equals_its_naive_twin_at_working_size(n_obj):
    F = np.random.default_rng(n_obj).dirichlet(np.ones(n_obj), size=120)
    before = F.copy()
    np.testing.assert_array_equal(most_spread(F, 60), most_spread_by_recount(F, 60))
    np.testing.assert_array_equal(F, before)


def test_truncation_does_not_depend_on_units():
    F = np.random.default_rng(4).dirichlet(np.ones(3), size=80)
    # Powers of two, so that scaling back is exact.
    np.testing.assert_array_equal(most_spread(F, 30), most_spread(F * [2.0**20, 1.0, 2.0**-9], 30))


def test_truncation_spreads_evenly_and_keeps_the_ends():
    angle = np.sort(np.random.default_rng(5).random(400)) ** 3 * np.pi / 2.0
    F = np.column_stack([np.cos(angle), np.sin(angle)])
    kept = F[most_spread(F, 20)]
    gaps = np.linalg.norm(np.diff(kept, axis=0), axis=1)
    # Cutting at random leaves gaps that differ a hundredfold, as those of the 400 do.
    assert gaps.max() < 3.0 * gaps.min()
    np.testing.assert_array_equal(kept[[0, -1]], F[[0, -1]])


# --- survival -----------------------------------------------------------------------------------


def points(F, violation=None):
    F = np.asarray(F, dtype=float)
    violation = np.zeros(len(F)) if violation is None else np.asarray(violation, dtype=float)
    return Points(np.arange(len(F), dtype=float)[:, np.newaxis], F, violation)


@st.composite
def swarms(draw):
    n = draw(st.integers(2, 20))
    F = draw(arrays(float, (n, 2), elements=st.integers(0, 5).map(float)))
    return points(F, draw(arrays(float, n, elements=st.sampled_from([0.0, 0.0, 1.0, 2.0, np.inf]))))


@settings(max_examples=100)
@given(swarms(), st.data())
def test_who_survives_is_never_worse_than_who_does_not(swarm, data):
    size = data.draw(st.integers(1, len(swarm)))
    kept = survivors(swarm, size)
    assert len(np.unique(kept)) == size
    gone = np.setdiff1d(np.arange(len(swarm)), kept)
    keys = np.column_stack([swarm.F, swarm.violation])
    for left in gone:
        repeats = (keys[kept] == keys[left]).all(axis=1).any()
        if repeats:
            continue
        # A solution of its own leaves only for others that it does not dominate.
        beaten = dominates(swarm[np.full(size, left)], swarm[kept])
        assert not beaten.any()
        assert constrained_ranks(swarm)[left] >= constrained_ranks(swarm)[kept].min()


def test_copies_go_before_anything_else():
    swarm = points([[0, 1], [0, 1], [1, 0], [5, 5], [0, 1], [9, 9]])
    np.testing.assert_array_equal(survivors(swarm, 4), [0, 2, 3, 5])
    np.testing.assert_array_equal(survivors(swarm, 5), [0, 1, 2, 3, 5])
    # Among themselves they go by the front of what they repeat, not by their place.
    swarm = points([[5, 5], [5, 5], [9, 9], [9, 9], [0, 1], [0, 1]])
    np.testing.assert_array_equal(survivors(swarm, 4), [0, 2, 4, 5])
    np.testing.assert_array_equal(survivors(swarm, 5), [0, 1, 2, 4, 5])


def test_infeasible_points_are_ordered_by_violation():
    swarm = points([[0, 0], [1, 1], [2, 2], [3, 3]], [3.0, 2.0, np.inf, 0.0])
    np.testing.assert_array_equal(survivors(swarm, 1), [3])
    np.testing.assert_array_equal(survivors(swarm, 2), [1, 3])
    np.testing.assert_array_equal(survivors(swarm, 3), [0, 1, 3])
    # Of equal violations those that were there first stay: no front to spread along.
    level = points([[0, 0], [0.1, 0.1], [9, 9], [5, 5]], [1.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(survivors(level, 2), [0, 1])


def test_the_last_front_is_thinned_out_evenly_and_the_first_kept_whole():
    line = np.linspace(0.0, 1.0, 9)
    first = np.column_stack([line, 1.0 - line])
    second = first + 0.5
    kept = survivors(points(np.vstack([second, first])), 14)
    np.testing.assert_array_equal(kept[5:], np.arange(9, 18))
    np.testing.assert_array_equal(kept[:5], [0, 2, 4, 6, 8])
