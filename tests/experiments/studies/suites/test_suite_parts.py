"""Swarms that lack a part."""

import numpy as np
import pytest

from experiments.studies.suites.problems import problem_of
from experiments.studies.suites.reduced import LESS, guests
from pymoo_hdte.algorithms.points import Points


@pytest.mark.parametrize("name", LESS)
def test_swarms_that_lack_parts_run(name):
    for problem in map(problem_of, ("MW1", "LZ09-F1")):
        algorithm = LESS[name](problem)
        algorithm.setup(problem, termination=("n_eval", 60), seed=1).run()
        assert np.isfinite(algorithm.pop.get("F")).all()


ALL = ("Attraction", "Exchange", "Difference", "NeighbourDifference")


def test_what_is_left_out_is_not_there():
    problem = problem_of("MW1")
    for name, moves, parts in (
        ("without Exchange", ["Attraction", "Difference", "NeighbourDifference"], (0.9, 0.2)),
        ("without tolerance", [*ALL], (0.0, 0.2)),
        ("without guests", [*ALL], (0.9, 0.0)),
    ):
        algorithm = LESS[name](problem)
        algorithm.setup(problem, termination=("n_eval", 60), seed=1).run()
        assert [type(move).__name__ for move in algorithm.moves] == moves
        assert parts == (algorithm.TOLERATED, algorithm.INVITED)
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
