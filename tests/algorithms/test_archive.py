"""The leader archive, its crowding truncation and the dominance they rest on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.core.population import Population
from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance

from pymoo_hdte.algorithms.archive import LeaderArchive
from pymoo_hdte.algorithms.crowding import crowding_distance, least_crowded
from pymoo_hdte.algorithms.dominance import best_front, constrained_ranks, dominates
from pymoo_hdte.algorithms.points import Points


def points(F, violation=None):
    F = np.asarray(F, dtype=float)
    violation = np.zeros(len(F)) if violation is None else np.asarray(violation, dtype=float)
    return Points(F.copy(), F, violation)


def archived(archive, batch):
    archive.update(Population.new("X", batch.X, "F", batch.F), batch)
    return archive


def least_crowded_by_recount(F, size):
    """A simple reference: compute every distance again before each removal."""
    span = np.ptp(F, axis=0)
    scaled = (F - F.min(axis=0)) / np.where(span > 0, span, 1.0)
    rows = list(range(len(F)))
    while len(rows) > size:
        distances = []
        for row in rows:
            total = 0.0
            for column in scaled.T:
                order = sorted(rows, key=lambda other: (column[other], other))
                place = order.index(row)
                is_extreme = place in (0, len(order) - 1)
                total += (
                    np.inf if is_extreme else column[order[place + 1]] - column[order[place - 1]]
                )
            distances.append(total)
        rows.remove(rows[int(np.argmin(distances))])
    return rows


@st.composite
def objectives(draw):
    shape = (draw(st.integers(1, 14)), draw(st.integers(2, 4)))
    with_ties = st.integers(0, 4).map(float)
    elements = draw(st.sampled_from([with_ties, st.floats(0.0, 1.0)]))
    return draw(arrays(float, shape, elements=elements))


@settings(max_examples=80)
@given(objectives(), st.integers(1, 8))
def test_truncation_equals_its_naive_twin(F, size):
    np.testing.assert_array_equal(least_crowded(F, size), least_crowded_by_recount(F, size))


@pytest.mark.parametrize("n_obj", [2, 3])
def test_truncation_equals_its_naive_twin_at_working_size(n_obj):
    F = np.random.default_rng(n_obj).dirichlet(np.ones(n_obj), size=90)
    np.testing.assert_array_equal(least_crowded(F, 50), least_crowded_by_recount(F, 50))


def test_truncation_leaves_its_input_alone():
    F = np.random.default_rng(0).random((20, 2))
    before = F.copy()
    least_crowded(F, 5)
    np.testing.assert_array_equal(F, before)


def test_one_by_one_keeps_an_even_front_where_all_at_once_would_not():
    # Two tight pairs on an even front: cutting both of a pair at once would leave a hole.
    x = np.array([0.0, 0.3, 0.301, 0.6, 0.601, 1.0])
    kept = least_crowded(np.column_stack([x, 1.0 - x]), 4)
    np.testing.assert_allclose(x[kept], [0.0, 0.3, 0.6, 1.0], atol=1.1e-3)


@given(objectives())
def test_crowding_distance_agrees_with_pymoo(F):
    reference = calc_crowding_distance(F) * F.shape[1]
    # pymoo counts an objective of range 0 as 0 for everyone, even for the extremes.
    if np.all(np.ptp(F, axis=0) > 1e-6) and len(F) > 2:
        np.testing.assert_allclose(crowding_distance(F), reference, rtol=1e-6, atol=1e-9)


@st.composite
def batches(draw):
    n_obj = draw(st.integers(2, 3))
    return [
        points(
            draw(
                arrays(float, (n, n_obj), elements=st.sampled_from([0.0, 1.0, 2.0, 3.0, 5.0, 8.0]))
            ),
            draw(arrays(float, n, elements=st.sampled_from([0.0, 0.0, 0.5, 1.0, np.inf]))),
        )
        for n in draw(st.lists(st.integers(1, 12), min_size=1, max_size=4))
    ]


def beaten(F):
    no_worse = (F[:, np.newaxis] <= F).all(axis=2)
    better = (F[:, np.newaxis] < F).any(axis=2)
    return (no_worse & better).any(axis=0)


@settings(max_examples=80)
@given(batches(), st.integers(2, 10))
def test_archive_invariants(sequence, capacity):
    archive = LeaderArchive(capacity, *[sequence[0].F.shape[1]] * 2)
    for batch in sequence:
        archived(archive, batch)
        held = archive.points
        assert len(archive) == len(archive.members) <= capacity
        assert not beaten(held.F).any()
        assert len(np.unique(held.F, axis=0)) == len(held)
        assert np.all(held.violation == held.violation.min(initial=np.inf))
        np.testing.assert_array_equal(
            archive.members.get("F").reshape(held.F.shape), held.F, strict=True
        )


@settings(max_examples=50)
@given(batches())
def test_large_archive_holds_the_front_of_all_it_has_seen(sequence):
    archive = LeaderArchive(1000, *[sequence[0].F.shape[1]] * 2)
    for batch in sequence:
        archived(archive, batch)
    feasible = np.vstack([batch.F[batch.violation == 0] for batch in sequence])
    if len(feasible):
        front = np.unique(feasible[~beaten(feasible)], axis=0)
        np.testing.assert_array_equal(np.unique(archive.points.F, axis=0), front)
    else:
        least = min(batch.violation.min() for batch in sequence)
        assert list(archive.points.violation) == ([least] if np.isfinite(least) else [])


@settings(max_examples=50)
@given(st.integers(2, 3), st.integers(0, 2**32 - 1))
def test_extremes_stay_whatever_is_cut(n_obj, seed):
    rng = np.random.default_rng(seed)
    archive = LeaderArchive(2 * n_obj, n_obj, n_obj)
    seen = []
    for _ in range(4):
        seen.append(rng.dirichlet(np.ones(n_obj), size=15))
        archived(archive, points(seen[-1]))
    np.testing.assert_array_equal(archive.points.F.min(axis=0), np.vstack(seen).min(axis=0))


def test_oldest_of_equal_objectives_stays():
    archive = LeaderArchive(5, 1, 2)
    first = Points(np.array([[1.0]]), np.array([[1.0, 2.0]]), np.zeros(1))
    second = Points(np.array([[9.0]]), np.array([[1.0, 2.0]]), np.zeros(1))
    assert archived(archived(archive, first), second).points.X == [[1.0]]


def test_feasible_solution_displaces_the_least_infeasible_one():
    archive = LeaderArchive(5, 2, 2)
    archived(archive, points([[0.0, 0.0], [1.0, 1.0]], [3.0, 2.0]))
    np.testing.assert_array_equal(archive.points.F, [[1.0, 1.0]])
    archived(archive, points([[9.0, 9.0], [0.0, 0.0]], [0.0, 0.1]))
    np.testing.assert_array_equal(archive.points.F, [[9.0, 9.0]])


def test_what_cannot_be_judged_never_enters():
    F = np.array([[np.nan, 0.0], [-np.inf, 0.0], [1.0, np.inf]])
    population = Population.new("X", np.zeros((3, 1)), "F", F)
    archive = LeaderArchive(5, 1, 2)
    archive.update(population, Points.of(population, constrained=False))
    assert len(archive) == 0


def test_violation_is_read_from_the_constraints():
    G = np.array([[-1.0, 0.0], [0.5, 0.25], [np.nan, -1.0], [np.inf, 0.0]])
    population = Population.new("X", np.zeros((4, 1)), "F", np.zeros((4, 2)), "G", G)
    read = Points.of(population, constrained=True)
    np.testing.assert_array_equal(read.violation, [0.0, 0.75, np.inf, np.inf])


def test_leaders_come_from_a_tournament_on_crowding():
    archive = archived(LeaderArchive(3, 2, 2), points([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]))
    n = 20_000
    leaders = archive.draw(n, np.random.default_rng(0))
    # The middle one wins only if it is drawn twice: 1/9. Four standard errors.
    share = np.mean(leaders[:, 0] == 0.5)
    assert share == pytest.approx(1 / 9, abs=4 * np.sqrt(1 / 9 * 8 / 9 / n))


def test_ranks_by_hand():
    swarm = points(
        [[1, 4], [2, 2], [4, 1], [3, 3], [4, 4], [0, 0], [0, 1], [9, 9]],
        [0, 0, 0, 0, 0, 2.0, 2.0, np.inf],
    )
    np.testing.assert_array_equal(constrained_ranks(swarm), [1, 1, 1, 2, 3, 4, 4, 5])


def test_ranks_of_a_swarm_without_a_feasible_particle():
    swarm = points(np.zeros((3, 2)), [0.3, 0.1, 0.3])
    np.testing.assert_array_equal(constrained_ranks(swarm), [2, 1, 2])


@settings(max_examples=50)
@given(batches())
def test_ranks_peel_off_fronts_by_dominance(sequence):
    batch = sequence[0]
    left = np.arange(len(batch))
    ranks = constrained_ranks(batch)
    for rank in range(1, ranks.max() + 1):
        pairs = [[dominates(batch[[i]], batch[[j]])[0] for i in left] for j in left]
        front = left[~np.any(pairs, axis=1)]
        np.testing.assert_array_equal(front, np.flatnonzero(ranks == rank))
        left = np.setdiff1d(left, front)
    assert len(left) == 0


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (([1.0, 1.0], 0.0), ([1.0, 2.0], 0.0), True),
        (([1.0, 1.0], 0.0), ([1.0, 1.0], 0.0), False),
        (([1.0, 3.0], 0.0), ([2.0, 2.0], 0.0), False),
        (([9.0, 9.0], 0.0), ([1.0, 1.0], 0.1), True),
        (([9.0, 9.0], 0.1), ([1.0, 1.0], 0.2), True),
        (([1.0, 1.0], 0.2), ([9.0, 9.0], 0.2), False),
        (([np.nan, 1.0], np.inf), ([9.0, 9.0], 5.0), False),
        (([9.0, 9.0], 5.0), ([np.nan, 1.0], np.inf), True),
    ],
)
def test_dominance(first, second, expected):
    (a, va), (b, vb) = first, second
    assert dominates(points([a], [va]), points([b], [vb]))[0] == expected


def test_best_front_of_nothing_is_empty():
    assert len(best_front(points(np.empty((0, 2))))) == 0
