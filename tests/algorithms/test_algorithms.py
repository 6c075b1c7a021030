"""The swarm family as pymoo algorithms: moves, runs, reproducibility, constraints, bad input."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
from pymoo.core.callback import Callback
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.indicators.igd import IGD
from pymoo.operators.sampling.lhs import LHS
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from swarm_problems import Bowl, Cliff, Parabolas, Unreachable, assert_clean_front, digest, run

from pymoo_hdte.algorithms import (
    AMOPSO,
    AMPMOPSO,
    MOPSO,
    MPMOPSO,
    EntropyWeight,
    FirstStepWithinBounds,
    Flat,
    LinearDecrease,
    ParticleSwarm,
    Pyramid,
)
from pymoo_hdte.checks import InvalidInput

FAMILY = [MOPSO, AMPMOPSO, AMOPSO, MPMOPSO]
SMALL = {"pop_size": 20, "archive_size": 10}


class Still:
    """A hierarchy without any pull that shifts every particle by a constant."""

    def __init__(self, shift=0.0):
        self.shift = shift

    def acceleration(self, ranks):
        return np.zeros(len(ranks)), np.zeros(len(ranks))

    def mutation(self, ranks, progress, span, random_state):
        return np.full((len(ranks), len(span)), self.shift)


# --- one move ---------------------------------------------------------------------------------


def test_without_pull_particles_fly_straight_and_stop_at_the_bounds():
    law = FirstStepWithinBounds()
    swarm = ParticleSwarm(LinearDecrease(1.0, 1.0), Still(), initial_velocity=law, **SMALL)
    result = run(swarm, Parabolas(), n_gen=3, save_history=True)
    before, after, last = (step.pop for step in result.history)
    np.testing.assert_array_equal(before.get("V"), last.get("V"))
    np.testing.assert_allclose(after.get("X"), before.get("X") + before.get("V"))
    expected = np.clip(after.get("X") + after.get("V"), -1.0, 2.0)
    np.testing.assert_array_equal(last.get("X"), expected)
    assert np.any(expected == 2.0)


def test_mutation_moves_the_position_and_not_the_velocity():
    swarm = ParticleSwarm(LinearDecrease(0.0, 0.0), Still(shift=0.25), **SMALL)
    result = run(swarm, Parabolas(), n_gen=2, save_history=True)
    before, after = (step.pop for step in result.history)
    np.testing.assert_array_equal(after.get("V"), np.zeros((20, 3)))
    np.testing.assert_allclose(after.get("X"), np.minimum(before.get("X") + 0.25, 2.0))


def test_leaders_pull_by_twice_a_random_share_in_every_dimension():
    class Social(Still):
        def acceleration(self, ranks):
            return np.zeros(len(ranks)), np.full(len(ranks), 2.0)

    # The archive of a problem with one minimum holds one leader, so the pull has one direction.
    swarm = ParticleSwarm(LinearDecrease(0.0, 0.0), Social(), pop_size=2000)
    swarm.setup(Bowl(), termination=("n_gen", 2), seed=0)
    swarm.next()
    start, leader = swarm.pop.get("X"), swarm.opt[0].X
    others = (start != leader).all(axis=1)
    share = (swarm.ask().get("V")[others]) / (leader - start[others])
    assert share.min() >= 0.0
    assert share.max() <= 2.0
    # 2 r with r uniform has mean 1 and variance 1/3, independently in every dimension.
    np.testing.assert_allclose(share.mean(axis=0), 1.0, atol=4 / np.sqrt(3 * 2000))
    correlation = np.corrcoef(share.T)[np.triu_indices(3, 1)]
    np.testing.assert_allclose(correlation, 0.0, atol=4 / np.sqrt(2000))


def test_own_best_pulls_back_those_who_left_it():
    class Nostalgic(Still):
        def acceleration(self, ranks):
            return np.full(len(ranks), 2.0), np.zeros(len(ranks))

    swarm = ParticleSwarm(LinearDecrease(0.0, 0.0), Nostalgic(shift=0.25), pop_size=200)
    result = run(swarm, Bowl(), n_gen=3, save_history=True)
    first, second, third = (step.pop for step in result.history)
    improved = (second.get("F") < first.get("F")).all(axis=1)
    assert 0 < improved.sum() < 200
    back = first.get("X") - second.get("X")
    share = third.get("V")[~improved] / back[~improved]
    assert not third.get("V")[improved].any()
    assert share.min() >= 0.0
    assert share.max() <= 2.0
    np.testing.assert_allclose(share.mean(), 1.0, atol=4 / np.sqrt(3 * share.size))


def test_asking_again_does_not_move_twice():
    swarm = ParticleSwarm(LinearDecrease(0.5, 0.5), Still(), **SMALL)
    swarm.setup(Parabolas(), termination=("n_gen", 5), seed=1)
    swarm.next()
    once, twice = swarm.ask(), swarm.ask()
    np.testing.assert_array_equal(once.get("V"), 0.5 * swarm.pop.get("V"))
    np.testing.assert_array_equal(twice.get("V"), once.get("V"))


def test_schedules_see_the_generation_that_moves():
    class Recorder(LinearDecrease):
        seen = ()

        def __call__(self, progress, front):
            self.seen = (*self.seen, progress)
            return super().__call__(progress, front)

    result = run(ParticleSwarm(Recorder(), Flat(), **SMALL), n_gen=5)
    np.testing.assert_allclose(result.algorithm.inertia.seen, [0.2, 0.4, 0.6, 0.8])


@pytest.mark.parametrize(
    ("algorithm", "inertia", "hierarchy"),
    [
        (MOPSO, LinearDecrease, Flat),
        (AMOPSO, EntropyWeight, Flat),
        (MPMOPSO, LinearDecrease, Pyramid),
        (AMPMOPSO, EntropyWeight, Pyramid),
    ],
)
def test_the_family_is_made_of_its_parts(algorithm, inertia, hierarchy):
    composed = ParticleSwarm(inertia(), hierarchy(), **SMALL)
    assert digest(run(algorithm(**SMALL))) == digest(run(composed))


def test_ablations_differ_from_one_another():
    assert len({digest(run(algorithm(**SMALL), n_gen=10)) for algorithm in FAMILY}) == 4


# --- convergence ------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", FAMILY)
def test_zdt1_is_solved(algorithm):
    # Medians over nine seeds are 0.0076..0.0083; 10,000 random points give more than 1.
    problem = get_problem("zdt1")
    result = run(algorithm(), n_gen=100)
    assert len(result.F) == 50
    assert_clean_front(result)
    assert IGD(problem.pareto_front())(result.F) < 0.011


def test_segment_between_two_minima_is_found():
    result = run(AMPMOPSO(), Parabolas(), n_gen=100)
    t = np.linspace(0.0, 1.0, 500)[:, np.newaxis]
    assert IGD(3.0 * np.column_stack([t**2, (1.0 - t) ** 2]))(result.F) < 0.05


def test_three_objectives():
    result = run(AMPMOPSO(), "dtlz2", n_gen=80)
    assert len(result.F) == 50
    assert_clean_front(result)
    # The front is the unit sphere.
    assert np.median(np.linalg.norm(result.F, axis=1)) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("name", ["tnk", "bnh", "srn"])
@pytest.mark.parametrize("algorithm", [MOPSO, AMPMOPSO])
def test_constrained_fronts_are_feasible_and_free_of_duplicates(algorithm, name):
    problem = get_problem(name)
    result = run(algorithm(initial_velocity=FirstStepWithinBounds()), problem, n_gen=60)
    F, G = problem.evaluate(result.X, return_values_of=["F", "G"])
    np.testing.assert_array_equal(F, result.F)
    assert np.all(G <= 0.0)
    assert len(result.F) >= 40
    assert_clean_front(result)


def test_bnh_front_is_the_known_one():
    # Chankong and Haimes: x1 = x2 in [0, 3], then x1 in [3, 5] with x2 = 3.
    x1 = np.linspace(0.0, 5.0, 500)
    front = get_problem("bnh").evaluate(
        np.column_stack([x1, np.minimum(x1, 3.0)]), return_values_of=["F"]
    )
    result = run(AMPMOPSO(), "bnh", n_gen=100)
    scaled = IGD(front, zero_to_one=True)
    assert scaled(result.F) < 0.01


# --- reproducibility --------------------------------------------------------------------------

IN_ANOTHER_PROCESS = """
import pickle, sys
from pymoo.problems import get_problem
from pymoo.optimize import minimize
from pymoo_hdte.algorithms import AMPMOPSO

fresh = minimize(get_problem("zdt1"), AMPMOPSO(), ("n_gen", 120), seed=7)
with open(sys.argv[1], "rb") as file:
    resumed = pickle.load(file).run()
with open(sys.argv[1], "wb") as file:
    pickle.dump([(r.X.tobytes(), r.F.tobytes()) for r in (fresh, resumed)], file)
"""


@pytest.mark.nightly
def test_same_bytes_in_another_process_and_after_pickling_halfway(tmp_path):
    uninterrupted = run(AMPMOPSO(), n_gen=120, seed=7)
    expected = uninterrupted.X.tobytes(), uninterrupted.F.tobytes()

    algorithm = AMPMOPSO().setup(get_problem("zdt1"), termination=("n_gen", 120), seed=7)
    for _ in range(60):
        algorithm.next()
    stored = tmp_path / "algorithm"
    stored.write_bytes(pickle.dumps(algorithm))
    resumed = algorithm.run()
    assert (resumed.X.tobytes(), resumed.F.tobytes()) == expected

    command = [sys.executable, "-c", IN_ANOTHER_PROCESS, str(stored)]
    subprocess.run(command, check=True, timeout=120)
    assert pickle.loads(stored.read_bytes()) == [expected, expected]


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
@pytest.mark.parametrize("algorithm", FAMILY)
@pytest.mark.parametrize("problem", ["zdt1", "tnk"])
def test_a_copy_taken_anywhere_goes_on_alike(problem, algorithm, clone):
    expected = digest(run(algorithm(**SMALL), problem, n_gen=12, seed=3))
    travelling = clone(algorithm(**SMALL))
    travelling.setup(get_problem(problem), termination=("n_gen", 12), seed=3)
    while travelling.has_next():
        travelling = clone(travelling)
        infills = travelling.ask()
        travelling, infills = clone((travelling, infills))
        travelling.evaluator.eval(travelling.problem, infills)
        travelling.tell(infills)
    assert digest(travelling.result()) == expected


def test_seed_zero_is_a_seed_like_any_other():
    zero, again, one = (digest(run(AMPMOPSO(**SMALL), seed=seed)) for seed in (0, 0, 1))
    assert zero == again
    assert zero != one


def test_seed_may_be_given_to_the_constructor():
    by_constructor = minimize(get_problem("zdt1"), AMPMOPSO(seed=5, **SMALL), ("n_gen", 9))
    assert digest(by_constructor) == digest(run(AMPMOPSO(**SMALL), n_gen=9, seed=5))


def test_one_object_can_run_twice():
    algorithm = AMPMOPSO(**SMALL)
    assert digest(run(algorithm)) == digest(run(algorithm))


def test_the_global_generator_plays_no_part():
    first = digest(run(AMPMOPSO(**SMALL)))
    np.random.seed(99)  # noqa: NPY002
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    assert digest(run(AMPMOPSO(**SMALL))) == first
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002


# --- pymoo's interface ------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", FAMILY)
def test_every_evaluation_is_counted_and_none_happens_in_ask(algorithm):
    problem = Parabolas()
    swarm = algorithm(**SMALL).setup(problem, termination=("n_gen", 6), seed=1)
    while swarm.has_next():
        before = problem.n_rows
        infills = swarm.ask()
        assert problem.n_rows == before
        swarm.evaluator.eval(problem, infills)
        swarm.tell(infills=infills)
    assert swarm.evaluator.n_eval == problem.n_rows == 6 * 20


@pytest.mark.parametrize("rebuilt", [False, True])
def test_evaluation_outside_gives_the_same_run(rebuilt):
    problem = get_problem("tnk")
    swarm = AMPMOPSO(**SMALL).setup(problem, termination=("n_gen", 15), seed=4)
    while swarm.has_next():
        infills = swarm.ask()
        out = problem.evaluate(infills.get("X"), return_as_dictionary=True)
        if rebuilt:
            infills = Population.new("X", infills.get("X"), "F", out["F"], "G", out["G"])
        else:
            infills.set("F", out["F"], "G", out["G"])
        swarm.tell(infills=infills)
    assert digest(swarm.result()) == digest(run(AMPMOPSO(**SMALL), "tnk", n_gen=15, seed=4))


def test_evaluation_limit_terminates_and_sets_the_schedules():
    swarm = AMPMOPSO(**SMALL)
    by_evaluations = minimize(get_problem("zdt1"), swarm, ("n_eval", 400), seed=1)
    assert by_evaluations.algorithm.evaluator.n_eval == 400
    assert digest(by_evaluations) == digest(run(swarm, n_gen=20))


@pytest.mark.nightly
def test_default_termination_works():
    result = minimize(Parabolas(), AMPMOPSO(**SMALL), seed=1)
    assert result.algorithm.generations == 1000
    assert_clean_front(result)


def test_history_callback_and_display_see_every_generation(capsys):
    class Count(Callback):
        def update(self, algorithm):
            self.data.setdefault("front", []).append(algorithm.opt.get("F"))

    callback = Count()
    result = run(AMPMOPSO(**SMALL), n_gen=8, save_history=True, callback=callback, verbose=True)
    fronts = result.algorithm.callback.data["front"]
    assert len(result.history) == len(fronts) == 8
    for step, front in zip(result.history, fronts, strict=True):
        np.testing.assert_array_equal(step.opt.get("F"), front)
        np.testing.assert_array_equal(step.leaders.points.F, front)
    lines = capsys.readouterr().out.splitlines()
    assert [word in lines[1] for word in ("n_gen", "n_eval", "n_nds", "igd")] == [True] * 4
    assert len(lines) == 3 + 8
    assert digest(result) == digest(run(AMPMOPSO(**SMALL), n_gen=8))


def test_result_is_the_archive_and_the_population_the_swarm():
    result = run(AMPMOPSO(pop_size=30, archive_size=5))
    assert result.F.shape == (5, 2)
    assert len(result.pop) == 30
    assert result.pop.get("V").shape == (30, 30)


def test_user_archive_of_pymoo_does_not_disturb_the_leaders():
    from pymoo.util.archive import MultiObjectiveArchive

    with_archive = run(AMPMOPSO(archive=MultiObjectiveArchive(), **SMALL))
    assert digest(with_archive) == digest(run(AMPMOPSO(**SMALL)))


@pytest.mark.parametrize("kind", ["array", "population", "evaluated", "sampling"])
def test_first_positions_may_be_given(kind):
    problem = Parabolas()
    X = np.random.default_rng(0).uniform(-1.0, 2.0, (20, 3))
    population = Population.new("X", X)
    if kind == "evaluated":
        Evaluator().eval(problem, population)
    given = {"array": X, "population": population, "evaluated": population, "sampling": LHS()}
    result = run(AMPMOPSO(sampling=given[kind], **SMALL), problem, n_gen=4, save_history=True)
    start = result.history[0].pop.get("X")
    if kind == "sampling":
        # One point in each of the 20 strata of every dimension.
        strata = np.sort(np.floor((start + 1.0) / 3.0 * 20), axis=0)
        np.testing.assert_array_equal(strata, np.tile(np.arange(20.0)[:, np.newaxis], 3))
    else:
        np.testing.assert_array_equal(start, X)
    expected = 60 if kind == "evaluated" else 80
    assert result.algorithm.evaluator.n_eval == expected


# --- what cannot be judged ----------------------------------------------------------------------


def test_infeasible_problem_reports_like_pymoo():
    result = run(AMPMOPSO(**SMALL), Unreachable(), save_history=True)
    assert result.F is None
    swarm = result.algorithm
    assert len(swarm.opt) == 1
    violations = [step.pop.get("CV").min() for step in result.history]
    assert swarm.opt[0].CV[0] == min(violations)
    # The swarm has come down to the corner of least violation.
    np.testing.assert_allclose(swarm.opt[0].X, -1.0, atol=0.01)


def test_least_infeasible_solution_on_request():
    result = run(AMPMOPSO(return_least_infeasible=True, **SMALL), Unreachable())
    assert result.F.shape == (1, 2)


@pytest.mark.parametrize("edge", [0.5, 1.9])
def test_not_a_number_never_reaches_the_front(edge):
    swarm = AMPMOPSO(initial_velocity=FirstStepWithinBounds(), **SMALL)
    result = run(swarm, Cliff(edge), n_gen=60)
    assert np.isfinite(result.F).all()
    assert np.all(result.X[:, 0] >= edge)
    assert_clean_front(result)
    # The best reachable point of the first objective is on the edge.
    assert result.F[:, 0].min() == pytest.approx(edge**2, abs=0.05)


def test_a_problem_without_any_number_does_not_break_the_run():
    result = run(AMPMOPSO(**SMALL), Cliff(3.0), n_gen=5)
    assert len(result.opt) == 1
    assert len(result.algorithm.leaders) == 0


# --- bad input ----------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", FAMILY)
@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"pop_size": 1}, "pop_size"),
        ({"pop_size": 10.0}, "pop_size"),
        ({"archive_size": 1}, "archive_size"),
        ({"archive_size": None}, "archive_size"),
        ({"n_max_gen": 0}, "n_max_gen"),
    ],
)
def test_sizes_are_checked(algorithm, arguments, field):
    with pytest.raises(InvalidInput, match=field):
        algorithm(**arguments)


def test_misspelt_arguments_are_refused():
    with pytest.raises(TypeError, match="AMPMOPSO has no argument popsize"):
        AMPMOPSO(popsize=50)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"xl": None}, "bounds"),
        ({"xu": np.inf}, "bounds"),
        ({"xl": 3.0}, "bounds"),
        ({"vtype": int}, "vtype"),
        ({"vtype": bool}, "vtype"),
        ({"n_obj": 1}, "n_obj"),
    ],
)
def test_problems_that_do_not_fit_are_refused(changes, field):
    with pytest.raises(InvalidInput, match=field):
        run(AMPMOPSO(**SMALL), Parabolas(**changes))


def test_mixed_variables_are_refused():
    from pymoo.core.variable import Integer, Real

    variables = {"x": Real(bounds=(0.0, 1.0)), "n": Integer(bounds=(0, 3))}
    with pytest.raises(InvalidInput, match="vtype"):
        run(AMPMOPSO(**SMALL), Problem(vars=variables, n_obj=2))


@pytest.mark.parametrize(
    "bad", [np.zeros((19, 3)), np.zeros((20, 2)), np.full((20, 3), 2.1), np.full((20, 3), np.nan)]
)
def test_first_positions_are_checked(bad):
    with pytest.raises(InvalidInput, match="sampling"):
        run(AMPMOPSO(sampling=bad, **SMALL), Parabolas())


def test_a_run_may_go_on_beyond_its_schedules():
    swarm = AMPMOPSO(n_max_gen=40, **SMALL).setup(Parabolas(), termination=NoTermination(), seed=1)
    for _ in range(50):
        swarm.next()
    assert swarm.evaluator.n_eval == 50 * 20


def test_tell_refuses_an_incomplete_swarm():
    swarm = AMPMOPSO(**SMALL).setup(Parabolas(), termination=("n_gen", 3), seed=1)
    infills = swarm.ask()
    with pytest.raises(InvalidInput, match="shape of F"):
        swarm.tell(infills=infills)
    swarm.evaluator.eval(swarm.problem, infills)
    with pytest.raises(InvalidInput, match="number of infills"):
        swarm.tell(infills=infills[:-1])
