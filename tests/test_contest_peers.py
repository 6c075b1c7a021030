"""Peers are run as their users run them, and their evaluations counted truly."""

import numpy as np
import pytest
from moocore import is_nondominated
from pymoo.problems import get_problem
from swarm_problems import Parabolas

from experiments.contest.job import FINAL_SIZE, ContestRun, final_set
from experiments.contest.peers import CONTESTANTS, SWARM_VARIANTS
from experiments.contest.problems import problem_of

BUDGETS = (400, 700)


@pytest.fixture(params=CONTESTANTS)
def contestant(request):
    """Every contestant in turn, as far as its library is installed."""
    entry = CONTESTANTS[request.param]
    if not entry.available:
        pytest.skip(f"{entry.library} is not installed (extra 'peers')")
    return entry


class Counting(Parabolas):
    """Parabolas in which every row counts, also of a copy of the problem, which pygmo makes."""

    rows = 0

    def _evaluate(self, X, out, *args, **kwargs):
        Counting.rows += len(X)
        super()._evaluate(X, out)


def test_the_budget_is_spent_and_not_more(contestant):
    before = Counting.rows
    offers = contestant.run(Counting(), (700,), seed=1)
    assert len(offers) == 1
    assert offers[0].F.shape[1] == 2
    assert offers[0].spent == Counting.rows - before
    # NSGA-III's population is that of its directions; nobody spends more than allowed.
    assert 600 < Counting.rows - before <= 700


def test_a_larger_budget_does_not_change_what_a_smaller_one_gives(contestant):
    if contestant.knows_budget:
        pytest.skip("it moves by what it has left: every budget is a run of its own")
    early, _ = contestant.run(problem_of("ZDT1"), BUDGETS, seed=3)
    (alone,) = contestant.run(problem_of("ZDT1"), BUDGETS[:1], seed=3)
    np.testing.assert_array_equal(early.F, alone.F)


def test_the_seed_decides(contestant):
    one, again, other = (contestant.run(problem_of("ZDT4"), (700,), s)[0].F for s in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or not np.array_equal(one, other)


def test_what_is_offered_is_feasible_and_reachable(contestant):
    if not contestant.takes_constraints:
        pytest.skip("it does not take constraints")
    F = contestant.run(get_problem("bnh"), (1000,), seed=1)[0].F
    assert len(F)
    # Without the constraints both objectives of BNH could be smaller.
    assert np.all(F[:, 1] >= 4.0 - 1e-9)
    assert np.all(F @ [1.0, 2.0] > 60.0)


def test_those_who_know_their_budget_move_otherwise_with_another(contestant):
    if not contestant.knows_budget:
        pytest.skip("it does not")
    (short,) = contestant.run(problem_of("ZDT1"), (400,), seed=3)
    shorter_of_long = contestant.run(problem_of("ZDT1"), BUDGETS, seed=3)[0]
    assert not np.array_equal(short.F, shorter_of_long.F)


@pytest.mark.parametrize("name", SWARM_VARIANTS)
def test_every_variant_of_the_swarm_differs_from_the_whole(name):
    whole = CONTESTANTS["ElitistSwarm"].run(problem_of("ZDT1"), (700,), 1)[0].F
    variant = SWARM_VARIANTS[name].run(problem_of("ZDT1"), (700,), 1)[0].F
    assert whole.shape != variant.shape or not np.array_equal(whole, variant)


def test_a_job_reduces_what_is_offered_and_keeps_the_budgets_apart():
    run = ContestRun("ZDT1", "NSGA-II", 1, (5000, 10_000)).execute()
    assert run.columns == ("evaluations", "spent", "f1", "f2")
    for budget in (5000, 10_000):
        F = run.values[run.values[:, 0] == budget][:, 2:]
        assert len(F) == FINAL_SIZE
        assert is_nondominated(F).all()
        assert np.all(np.diff(F[:, 0]) > 0)


def test_a_final_set_has_no_copies_no_dominated_and_nothing_that_is_not_a_number():
    line = np.linspace(0.0, 1.0, 101)
    F = np.column_stack([line, 1.0 - line])
    given = np.vstack([F, F + 0.1, F[:5], [[np.nan, 0.0]], [[np.inf, -1.0]]])
    kept = final_set(given)
    assert len(kept) == FINAL_SIZE
    assert {tuple(row) for row in kept} <= {tuple(row) for row in F}
    assert len(final_set(np.empty((0, 2)))) == 0
