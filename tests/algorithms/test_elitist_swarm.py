"""The elitist swarm as a pymoo algorithm: runs, reproducibility, constraints, bad input."""

import copy
import pickle

import numpy as np
import pytest
from pymoo.core.termination import NoTermination
from pymoo.indicators.igd import IGD
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from swarm_problems import Cliff, Parabolas, Unreachable, assert_clean_front, digest, run

from experiments.studies.contest.problems import MovedZDT
from pymoo_hdte.algorithms import AMPMOPSO, ElitistSwarm
from pymoo_hdte.algorithms.moves import Attraction
from pymoo_hdte.checks import InvalidInput

SMALL = {"pop_size": 20}


@pytest.mark.parametrize("name", ["zdt1", "zdt2", "zdt3", "zdt6"])
def test_zdt_is_solved_in_ten_thousand_evaluations(name):
    result = run(ElitistSwarm(), name, n_gen=100)
    assert IGD(get_problem(name).pareto_front(1000))(result.F) < 0.008
    assert_clean_front(result)


def test_an_interior_optimum_is_no_harder_than_one_on_the_bound():
    problem = MovedZDT("zdt1", rotated=False, seed=1)
    distance = IGD(problem.pareto_front(1000))
    assert distance(run(ElitistSwarm(), problem, n_gen=100).F) < 0.012
    # AMP-MOPSO, as printed, relies on optima that lie on the bounds.
    assert distance(run(AMPMOPSO(), problem, n_gen=100).F) > 0.1


def test_three_objectives():
    result = run(ElitistSwarm(), "dtlz2", n_gen=60)
    assert np.linalg.norm(result.F, axis=1) == pytest.approx(1.0, abs=0.05)
    directions = get_problem("dtlz2").pareto_front()
    assert IGD(directions)(result.F) < 0.065


@pytest.mark.parametrize("name", ["tnk", "bnh", "srn", "osy"])
def test_constrained_fronts_are_feasible_and_free_of_duplicates(name):
    result = run(ElitistSwarm(), name, n_gen=40)
    assert len(result.F) > 30
    assert np.all(result.G <= 0.0)
    assert_clean_front(result)


def test_the_front_never_gets_worse_at_either_end():
    """Elitism: the least value of an objective that was ever found stays in the swarm.

    A front's ends have neighbours on one side only, and thinning out takes those between.
    """
    history = run(ElitistSwarm(**SMALL), Parabolas(), n_gen=60, save_history=True).history
    least = np.array([step.opt.get("F").min(axis=0) for step in history])
    assert np.all(np.diff(least, axis=0) <= 1e-12)


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
@pytest.mark.parametrize("problem", ["zdt1", "tnk"])
def test_a_copy_taken_anywhere_goes_on_alike(problem, clone):
    uninterrupted = run(ElitistSwarm(**SMALL), problem, n_gen=12, seed=3)
    swarm = ElitistSwarm(**SMALL).setup(get_problem(problem), termination=("n_gen", 12), seed=3)
    while swarm.has_next():
        swarm = clone(swarm)
        swarm.next()
    assert digest(swarm.result()) == digest(uninterrupted)


def test_seed_zero_is_a_seed_like_any_other_and_the_global_generator_plays_no_part():
    zero, one = (digest(run(ElitistSwarm(**SMALL), seed=seed)) for seed in (0, 1))
    np.random.seed(99)  # noqa: NPY002
    assert digest(run(ElitistSwarm(**SMALL), seed=0)) == zero != one


def test_every_evaluation_is_counted_and_none_happens_in_ask():
    problem = Parabolas()
    swarm = ElitistSwarm(**SMALL).setup(problem, termination=("n_gen", 10), seed=1)
    while swarm.has_next():
        before = problem.n_rows
        infills = swarm.ask()
        assert problem.n_rows == before
        swarm.evaluator.eval(problem, infills)
        swarm.tell(infills=infills)
    assert problem.n_rows == swarm.evaluator.n_eval == 200


def test_a_run_stopped_early_is_the_beginning_of_a_longer_one():
    """No part follows a schedule, so the length of a run need not be known in advance."""
    short = run(ElitistSwarm(**SMALL), n_gen=8)
    long = run(ElitistSwarm(**SMALL), n_gen=20, save_history=True)
    np.testing.assert_array_equal(long.history[7].opt.get("F"), short.opt.get("F"))
    swarm = ElitistSwarm(**SMALL).setup(Parabolas(), termination=NoTermination(), seed=1)
    for _ in range(5):
        swarm.next()
    assert swarm.evaluator.n_eval == 100


def test_result_is_the_best_front_of_the_swarm():
    result = run(ElitistSwarm(**SMALL), Parabolas())
    assert len(result.pop) == 20
    assert {tuple(row) for row in result.F} <= {tuple(row) for row in result.pop.get("F")}


def test_infeasible_problem_reports_like_pymoo():
    result = run(ElitistSwarm(**SMALL), Unreachable(), n_gen=60, save_history=True)
    assert result.F is None
    violations = [step.pop.get("CV").min() for step in result.history]
    assert result.algorithm.opt[0].CV[0] == min(violations)
    np.testing.assert_allclose(result.algorithm.opt[0].X, -1.0, atol=0.02)


@pytest.mark.parametrize("edge", [0.5, 1.9])
def test_not_a_number_never_reaches_the_front(edge):
    result = run(ElitistSwarm(**SMALL), Cliff(edge), n_gen=60)
    assert np.isfinite(result.F).all()
    assert np.all(result.X[:, 0] >= edge)
    assert result.F[:, 0].min() == pytest.approx(edge**2, abs=0.05)


def test_a_problem_without_any_number_does_not_break_the_run():
    assert len(run(ElitistSwarm(**SMALL), Cliff(3.0), n_gen=5).opt) == 1


def test_moves_can_be_exchanged():
    class Nowhere(Attraction):
        STRENGTH = 0.0

    result = run(ElitistSwarm(moves=[Nowhere()], **SMALL), Parabolas(), n_gen=5)
    np.testing.assert_array_equal(result.algorithm.success.shares, [1.0])


def test_a_move_whose_particles_never_survive_loses_its_share():
    class ToTheCorner(Attraction):
        def __call__(self, X, leaders, swarm, random_state):
            return np.full_like(X, 10.0)

    # Were the parents counted, both moves would have half.
    result = run(ElitistSwarm(moves=[ToTheCorner(), Attraction()], **SMALL), Parabolas(), n_gen=40)
    assert result.algorithm.success.shares[0] < 0.3


@pytest.mark.parametrize("n_moves", [0, 20])
def test_the_number_of_moves_is_checked(n_moves):
    with pytest.raises(InvalidInput, match="number of moves"):
        ElitistSwarm(moves=[Attraction()] * n_moves)


@pytest.mark.parametrize("pop_size", [1, 10.0, None])
def test_sizes_are_checked(pop_size):
    with pytest.raises(InvalidInput, match="pop_size"):
        ElitistSwarm(pop_size=pop_size)


def test_misspelt_arguments_are_refused():
    with pytest.raises(TypeError, match="ElitistSwarm has no argument archive_size"):
        ElitistSwarm(archive_size=50)


def test_problems_that_do_not_fit_are_refused():
    with pytest.raises(InvalidInput, match="n_obj"):
        minimize(Parabolas(n_obj=1), ElitistSwarm(**SMALL), ("n_gen", 2))
    with pytest.raises(InvalidInput, match="bounds"):
        minimize(Parabolas(xl=None), ElitistSwarm(**SMALL), ("n_gen", 2))
