"""Parts that leave the swarm by the protocol's rule, and the swarms that lack them."""

from itertools import product

import numpy as np
import pytest

from experiments.studies.suites.data import Outcome
from experiments.studies.suites.jobs import BbobRun
from experiments.studies.suites.problems import PROBLEMS, SUITES, TUNING, problem_of
from experiments.studies.suites.protocol import where_parts_leave
from experiments.studies.suites.reduced import LESS, WHOLE, guests, without_all
from experiments.studies.suites.rule import order, steps, steps_table
from pymoo_hdte.algorithms.points import Points


def plant(outcome, name, gain):
    """Let a swarm differ from the whole one by a gain, beside chance that cancels in pairs."""

    def chance(number):
        return 0.0 if name == WHOLE else 0.001 * (2 + number // 2) * (-1) ** number

    jobs = [job for place in where_parts_leave(name) for part in place for job in part.jobs()]
    for number, job in enumerate(jobs):
        if isinstance(job, BbobRun):
            outcome.bbob[job] = dict.fromkeys((500, 2000, 10_000), 0.4 + gain + chance(number))
            continue
        (budget,) = job.budgets
        volume = 0.4 + gain + chance([*PROBLEMS].index(job.problem))
        outcome.suites[job.problem, name, budget, job.seed] = float(budget), volume, 0.1, 9.0


def replant(outcome, name, volume):
    """Set the hypervolumes of a swarm on the problems of tuning."""
    for one, seed in product(SUITES[TUNING], range(1, 11)):
        outcome.suites[one.name, name, 2000, seed] = 2000.0, volume, 0.1, 9.0


@pytest.fixture
def outcome():
    found = Outcome()
    for name, gain in {
        WHOLE: 0.0,
        "without ModelStep": -0.2,
        "without Attraction": 0.001,
        "without tolerance": 0.0001,
        "without guests": -0.0001,
        "without Exchange": -0.001,
    }.items():
        plant(found, name, gain)
    plant(found, without_all(["Attraction", "tolerance"]), 0.0)
    return found


def test_the_part_that_is_missed_least_leaves_first_and_one_that_helps_is_not_tried(outcome):
    assert order(outcome) == ["Attraction", "tolerance", "guests", "Exchange"]


def test_a_part_without_which_the_swarm_is_worse_anywhere_stays(outcome):
    plant(outcome, without_all(["Attraction", "tolerance", "guests"]), 0.0)
    replant(outcome, without_all(["Attraction", "tolerance", "guests"]), 0.2)
    plant(outcome, without_all(["Attraction", "tolerance", "Exchange"]), 0.0)
    found = steps(outcome)
    assert [(step.part, step.leaves) for step in found] == [
        ("Attraction", True),
        ("tolerance", True),
        ("guests", False),
        ("Exchange", True),
    ]
    (worse,) = found[2].worse
    assert (worse.where, worse.evaluations) == (TUNING, 2000)
    assert len(steps_table(outcome).rows) == 6 * 4


def test_the_rule_waits_for_runs_that_lack(outcome):
    plant(outcome, without_all(["Attraction", "tolerance", "guests"]), 0.0)
    del outcome.suites["MW4", without_all(["Attraction", "tolerance", "guests"]), 10_000, 2]
    assert [step.part for step in steps(outcome)] == ["Attraction", "tolerance"]


def test_swarms_that_are_alike_without_constraints_are_run_once_there(outcome):
    less = without_all(["Attraction", "tolerance", "guests"])
    plant(outcome, less, 0.0)
    for job in [run for run in outcome.bbob if run.algorithm == less]:
        del outcome.bbob[job]
    alike = steps(outcome)[:3]
    assert [len(step.tests) for step in alike] == [6, 6, 6]
    assert alike[2].tests[-1].test.p == alike[0].tests[-1].test.p


@pytest.mark.parametrize("name", LESS)
def test_swarms_that_lack_parts_run(name):
    for problem in map(problem_of, ("MW1", "LZ09-F1")):
        algorithm = LESS[name](problem)
        algorithm.setup(problem, termination=("n_eval", 60), seed=1).run()
        assert np.isfinite(algorithm.pop.get("F")).all()


def test_what_is_left_out_is_not_there():
    problem = problem_of("MW1")
    algorithm = LESS["without Attraction and tolerance and guests and Exchange"](problem)
    algorithm.setup(problem, termination=("n_eval", 60), seed=1).run()
    assert [type(move).__name__ for move in algorithm.moves] == [
        "Difference",
        "NeighbourDifference",
    ]
    assert (algorithm.TOLERATED, algorithm.INVITED) == (0.0, 0.0)
    algorithm = LESS["with equal shares of moves"](problem)
    algorithm.setup(problem, termination=("n_eval", 400), seed=1).run()
    np.testing.assert_array_equal(algorithm.success.shares, 0.25)


def points(F, violation):
    F = np.asarray(F, dtype=float)
    return Points(np.zeros((len(F), 1)), F, np.asarray(violation, dtype=float))


def test_guests_are_infeasible_and_best_in_objectives_and_violation():
    swarm = points([[0, 0], [1, 1], [2, 2], [0, 3], [3, 3], [9, 9]], [5.0, 2.0, 1.0, 2.0, 2.0, 0.0])
    # The fifth is worse than the third in everything; the last one is feasible.
    np.testing.assert_array_equal(guests(swarm, 4), [0, 1, 2, 3])
    np.testing.assert_array_equal(guests(swarm, 9), [0, 1, 2, 3, 4])
    assert len(guests(swarm, 0)) == 0


def test_whoever_cannot_be_judged_is_no_guest():
    swarm = points([[0, 0], [1, 1], [np.nan, 0]], [np.inf, 1.0, np.inf])
    np.testing.assert_array_equal(guests(swarm, 3), [1])
    assert len(guests(points([[0, 0]], [np.inf]), 1)) == 0
