"""Truncation by hypervolume against its definition, and the choice of a quality."""

import numpy as np
import pytest
from moocore import hypervolume, is_nondominated
from pymoo.indicators.hv import HV
from pymoo.indicators.igd import IGD
from pymoo.problems import get_problem
from swarm_problems import run

from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.algorithms.hypervolume import _added_to_three, most_hypervolume
from pymoo_hdte.algorithms.spread import most_spread
from pymoo_hdte.checks import InvalidInput


def front(n, n_obj, seed, power=2.0):
    F = np.random.default_rng(seed).dirichlet(np.ones(n_obj), size=n) ** (1.0 / power)
    return F / np.linalg.norm(F, axis=1, keepdims=True)


def by_definition(F, size, reference, safe=()):
    """Take out, one at a time, the row without which most hypervolume is left."""
    scaled = (F - F.min(axis=0)) / np.ptp(F, axis=0)
    rows = list(range(len(F)))
    while len(rows) > size:
        others = {row: [one for one in rows if one != row] for row in rows if row not in safe}
        left = {row: hypervolume(scaled[some], ref=reference) for row, some in others.items()}
        rows.remove(max(left, key=left.get))
    return rows


def test_an_objective_that_is_the_same_everywhere_keeps_no_row():
    """The first row stayed, whatever it was, as an end of it."""
    F = np.column_stack([front(20, 2, 3), np.full(20, 4.0)])
    order = np.random.default_rng(1).permutation(20)
    kept = most_hypervolume(F[order], 8)
    np.testing.assert_array_equal(np.sort(order[kept]), most_hypervolume(F, 8))


@pytest.mark.parametrize("seed", range(3))
def test_the_row_that_adds_least_leaves(seed):
    # So far a reference point never loses an end of two objectives.
    F = front(30, 2, seed)
    np.testing.assert_array_equal(most_hypervolume(F, 9), by_definition(F, 9, [1e3, 1e3]))
    F, corner = front(25, 3, seed), [1.1, 1.1, 1.1]
    freely = most_hypervolume(F, 9, keep_ends=False)
    np.testing.assert_array_equal(freely, by_definition(F, 9, corner))
    ends = set(F.argmax(axis=0))
    np.testing.assert_array_equal(most_hypervolume(F, 9), by_definition(F, 9, corner, ends))


@pytest.mark.parametrize("grid", [False, True])
def test_what_a_row_adds_is_counted_without_the_others(grid):
    rng = np.random.default_rng(4)
    F = rng.integers(0, 9, (150, 3)) / 8.0 if grid else front(80, 3, 4)
    F = F[is_nondominated(F, keep_weakly=True)]
    stays = rng.random(len(F)) < 0.8
    order, buffer = np.argsort(F[:, 2], kind="stable"), np.empty((len(F) + 1, 2))
    for row in np.flatnonzero(stays):
        others = stays & (np.arange(len(F)) != row)
        both = [hypervolume(F[some], ref=[1.1, 1.1, 1.1]) for some in (stays, others)]
        added = _added_to_three(F, order, stays, row, buffer)
        assert added == pytest.approx(both[0] - both[1], abs=1e-14)


@pytest.mark.parametrize("n_obj", [2, 3])
def test_units_and_order_of_rows_do_not_matter_and_the_input_stays(n_obj):
    F = front(60, n_obj, 5)
    before = F.copy()
    kept = most_hypervolume(F, 20)
    np.testing.assert_array_equal(F, before)
    # Powers of two, so that scaling back is exact.
    np.testing.assert_array_equal(kept, most_hypervolume(F * 2.0 ** np.arange(9, 9 + n_obj), 20))
    turned = most_hypervolume(F[::-1], 20)
    np.testing.assert_array_equal(kept, np.sort(59 - turned))


def test_of_equal_contributions_the_first_row_leaves():
    line = np.array([0.5, 0.0, 1.0, 0.25, 0.75])
    F = np.column_stack([line, 1.0 - line])
    np.testing.assert_array_equal(most_hypervolume(F, 4), [1, 2, 3, 4])
    np.testing.assert_array_equal(most_hypervolume(F, 2), [1, 2])


@pytest.mark.parametrize("n_obj", [2, 3])
def test_a_swarm_does_not_shrink_to_where_an_objective_hardly_varies(n_obj):
    """Nearly all is where the last objective is least, and what is gained elsewhere is little."""
    F = front(200, n_obj, 3)
    F[:, -1] *= 1e-3
    F[:-1, -1] *= 1e-3
    F[-1] = [*F[:-1, :-1].min(axis=0) - 1e-6, 1e-3]
    for size in (199, 50, n_obj):
        kept = F[most_hypervolume(F, size)]
        np.testing.assert_array_equal(kept.max(axis=0), F.max(axis=0))
        assert len(kept) == size


@pytest.mark.parametrize("n_obj", [2, 3])
def test_sets_without_a_range_and_small_sets_are_cut_too(n_obj):
    assert len(most_hypervolume(np.ones((4, n_obj)), 1)) == 1
    np.testing.assert_array_equal(most_hypervolume(front(5, n_obj, 0), 5), np.arange(5))


def test_with_four_objectives_spread_decides():
    F = front(40, 4, 1)
    np.testing.assert_array_equal(most_hypervolume(F, 15), most_spread(F, 15))


@pytest.mark.parametrize("n_obj", [2, 3])
def test_each_quality_serves_its_indicator(n_obj):
    """On a front with a knee, where the two differ."""
    F = front(300, n_obj, 2, power=0.5)
    F = F[is_nondominated(F)]
    F = (F - F.min(axis=0)) / np.ptp(F, axis=0)
    volume, distance = HV(np.full(n_obj, 1.1)), IGD(F)
    spread, greedy = F[most_spread(F, 25)], F[most_hypervolume(F, 25)]
    assert volume(greedy) > volume(spread)
    assert distance(spread) < distance(greedy)


def test_a_swarm_takes_a_quality_by_name_or_as_a_function():
    problem = get_problem("zdt1")
    volume = HV(np.array([1.1, 1.1]))
    named = run(ElitistSwarm(20, quality="hypervolume"), problem, n_gen=150)
    given = run(ElitistSwarm(20, quality=most_hypervolume), problem, n_gen=150)
    np.testing.assert_array_equal(named.F, given.F)
    assert volume(named.F) > volume(run(ElitistSwarm(20), problem, n_gen=150).F)
    for unknown in ("crowding", ["spread"]):
        with pytest.raises(InvalidInput, match="quality"):
            ElitistSwarm(quality=unknown)
