"""Peers are run as their users run them, and their evaluations counted truly."""

import numpy as np
import pytest
from moocore import is_nondominated
from swarm_problems import Parabolas

from experiments.comparing.contestants import CONTESTANTS
from experiments.studies.contest.peers_data import ContestRun, front_among
from experiments.studies.contest.problems import problem_of
from experiments.studies.contest.reduced_swarms import SWARM_VARIANTS

BUDGETS = (400, 700)


LONG = ["AGE-MOEA-II"]
"""pymoo compiles it for seconds in every process; nightly runs test it as the others are here."""


@pytest.fixture(
    params=[
        pytest.param(name, marks=pytest.mark.nightly if name in LONG else ())
        for name in CONTESTANTS
    ]
)
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
    # NSGA-III's population is that of its directions; none spends more than allowed.
    assert 600 < Counting.rows - before <= 700


def test_a_larger_budget_does_not_change_what_a_smaller_one_gives(contestant):
    if contestant.starts_anew:
        pytest.skip("every budget is a run of its own")
    early, _ = contestant.run(problem_of("ZDT1"), BUDGETS, seed=3)
    (alone,) = contestant.run(problem_of("ZDT1"), BUDGETS[:1], seed=3)
    np.testing.assert_array_equal(early.F, alone.F)


def test_the_seed_decides(contestant):
    one, again, other = (contestant.run(problem_of("ZDT4"), (700,), s)[0].F for s in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or not np.array_equal(one, other)


def test_what_is_offered_is_feasible(contestant):
    if not contestant.takes_constraints:
        pytest.skip("it does not take constraints")
    tnk = problem_of("TNK")
    F = contestant.run(tnk, (2000,), seed=1)[0].F
    # The objectives of TNK are its variables, so that what is offered can be judged.
    assert np.all(tnk.evaluate(F, return_values_of=["G"]) <= 0.0)
    assert len(F) or contestant is CONTESTANTS["MOPSO-CD"]


@pytest.mark.parametrize("name", ["AMP-MOPSO", "OMOPSO"])
def test_those_who_follow_a_schedule_move_otherwise_with_more_to_spend(name):
    if not CONTESTANTS[name].available:
        pytest.skip("its library is not installed (extra 'peers')")
    short, of_long = (
        CONTESTANTS[name].run(problem_of("ZDT1"), budgets, seed=3)[0].F
        for budgets in (BUDGETS[:1], BUDGETS)
    )
    assert not np.array_equal(short, of_long)


@pytest.mark.parametrize("name", SWARM_VARIANTS)
def test_every_variant_of_the_swarm_differs_from_the_whole(name):
    whole = CONTESTANTS["ElitistSwarm"].run(problem_of("ZDT1"), (700,), 1)[0].F
    variant = SWARM_VARIANTS[name].run(problem_of("ZDT1"), (700,), 1)[0].F
    assert whole.shape != variant.shape or not np.array_equal(whole, variant)


def test_a_job_keeps_the_front_of_what_is_offered_and_the_budgets_apart():
    run = ContestRun("ZDT1", "NSGA-II", 1, (5000, 10_000)).execute()
    assert run.columns == ("evaluations", "spent", "f1", "f2")
    for budget in (5000, 10_000):
        rows = run.values[run.values[:, 0] == budget]
        assert set(rows[:, 1]) == {budget}
        F = rows[:, 2:]
        assert is_nondominated(F).all()
        assert np.all(np.diff(F[:, 0]) > 0)
    assert len(F) > 50


def test_a_front_has_no_copies_no_dominated_and_nothing_that_is_not_a_number():
    line = np.linspace(0.0, 1.0, 101)
    F = np.column_stack([line, 1.0 - line])
    given = np.vstack([F[::-1], F + 0.1, F[:5], [[np.nan, 0.0]], [[np.inf, -1.0]]])
    np.testing.assert_array_equal(front_among(given), F)
    assert len(front_among(np.empty((0, 2)))) == 0


def test_nothing_feasible_is_told_from_nothing_run():
    run = ContestRun("OSY", "random search", 1, (2,)).execute()
    np.testing.assert_array_equal(run.values, [[2.0, 2.0, np.nan, np.nan]])


class Narrow(Parabolas):
    """A box of one point, in which no algorithm finds a second design."""

    def __init__(self):
        super().__init__(xl=0.5, xu=0.5)


def test_a_peer_that_finds_no_new_design_ends():
    (offer,) = CONTESTANTS["NSGA-II"].run(Narrow(), (1000,), seed=1)
    assert offer.spent < 1000
    assert len(offer.F) == 1
