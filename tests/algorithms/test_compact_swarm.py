"""The compact swarm as a pymoo algorithm: result, archive, constraints, habits of pymoo."""

import copy
import pickle
import tracemalloc

import numpy as np
import pytest
from moocore import is_nondominated
from night import others_at_night
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.core.variable import Integer, Real
from pymoo.indicators.hv import HV
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.operators.repair.rounding import RoundingRepair
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from scipy.stats import binomtest, kstest
from swarm_problems import Cliff, Parabolas, Unreachable, assert_clean_front, digest

from experiments.studies.contest.problems import MovedZDT
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.compact import size_for
from pymoo_hdte.algorithms.moves import Attraction
from pymoo_hdte.algorithms.points import Points
from pymoo_hdte.algorithms.quadratic import ModelStep
from pymoo_hdte.checks import InvalidInput


def run(problem, n_eval, seed=1, make=CompactSwarm, **kwargs):
    problem = get_problem(problem) if isinstance(problem, str) else problem
    return minimize(problem, make(**kwargs), ("n_eval", n_eval), seed=seed)


def test_models_of_objectives_take_no_part_with_constraints_unless_asked():
    def has_models(problem, **kwargs):
        moves = run(problem, 100, **kwargs).algorithm.moves
        return any(isinstance(move, ModelStep) for move in moves)

    assert has_models("zdt1")
    assert not has_models("tnk")
    assert has_models("tnk", moves=(Attraction(), ModelStep()))


def test_a_model_that_has_no_step_yet_does_not_evaluate_the_same_again():
    found = run("zdt1", 8, pop_size=2, moves=(ModelStep(),), save_history=True)
    visited = np.vstack([one.off.get("X") for one in found.history if one.off is not None])
    assert len(np.unique(visited, axis=0)) == len(visited) == 8


class Noted(Parabolas):
    """A problem that notes where it was evaluated."""

    def __init__(self):
        super().__init__()
        self.asked = []

    def _evaluate(self, x, out, *args, **kwargs):
        self.asked.append(np.array(x))
        super()._evaluate(x, out, *args, **kwargs)


@pytest.mark.parametrize("kwargs", [{}, {"pop_size": 12, "n_offsprings": 5}])
def test_models_learn_every_evaluated_point_once_and_in_its_turn(kwargs):
    problem = Noted()
    algorithm = run(problem, 300, **kwargs).algorithm
    (model,) = (move for move in algorithm.moves if isinstance(move, ModelStep))
    asked = np.vstack(algorithm.problem.asked)
    first, *others = model._known()
    known = first.followed_by(*others)
    np.testing.assert_array_equal(known.X, asked)
    np.testing.assert_array_equal(known.F, Parabolas().evaluate(asked))


# --- result and archive ---------------------------------------------------------------------------


@pytest.mark.nightly
def test_few_evaluations_are_spent_better_than_by_a_large_swarm():
    problem = MovedZDT("zdt1", rotated=True, seed=1)
    distance = IGDPlus(problem.pareto_front(1000))
    ours, theirs = (
        [distance(run(problem, 2000, seed, make).F) for seed in range(3)]
        for make in (CompactSwarm, ElitistSwarm)
    )
    assert np.mean(ours) < 0.9 * np.mean(theirs)


@pytest.mark.parametrize("name", others_at_night(["zdt1", "dtlz2", "tnk"], "zdt1", "tnk"))
def test_the_result_comes_from_all_that_was_found(name):
    result = run(name, 3000)
    swarm, everything = result.algorithm, result.algorithm.archive_all()
    # With constraints the size stays, of the 3,000 evaluations that the termination allows.
    size = size_for(3000 if name == "tnk" else swarm.evaluator.n_eval)
    assert len(swarm.pop) == swarm.pop_size == size
    assert len(result.F) == min(100, len(everything))
    assert_clean_front(result)
    F = everything.get("F")
    assert is_nondominated(F).all()
    # What is left of the volume of all: a hundred of several hundred lose little.
    scale = np.ptp(F, axis=0)
    volume = HV(np.full(F.shape[1], 1.1))
    of_all = volume((F - F.min(axis=0)) / scale)
    assert volume((result.F - F.min(axis=0)) / scale) > (0.95 if F.shape[1] == 3 else 0.99) * of_all


def test_the_archive_has_every_front_solution_that_was_evaluated():
    problem, seen = Parabolas(), []
    swarm = CompactSwarm().setup(problem, termination=("n_eval", 600), seed=2)
    while swarm.has_next():
        infills = swarm.ask()
        swarm.evaluator.eval(problem, infills)
        seen.append(infills.get("F"))
        swarm.tell(infills=infills)
        front = np.concatenate(seen)
        front = front[is_nondominated(front)]
        found = swarm.archive_all().get("F")
        assert sorted(map(tuple, found)) == sorted(map(tuple, front))
    assert swarm.archive is None


@pytest.mark.parametrize("n_result", [1, 15, 300])
def test_the_size_of_the_result_is_the_user_s(n_result):
    assert len(run(Parabolas(), max(300, 5 * n_result), n_result=n_result).F) == n_result


@pytest.mark.nightly
def test_quality_decides_what_is_offered():
    problem = get_problem("zdt1")
    volume = HV(np.array([1.1, 1.1]))
    found = {
        quality: run(problem, 3000, quality=quality, n_result=20).F
        for quality in ("spread", "hypervolume")
    }
    assert volume(found["hypervolume"]) > volume(found["spread"])


@pytest.mark.parametrize(
    ("kwargs", "first", "last"),
    [
        ({}, 10, 22),
        pytest.param({"n_offsprings": 1}, 10, 22, marks=pytest.mark.nightly),
        ({"pop_size": 40}, 40, 40),
        pytest.param({"sampling": np.zeros((7, 3))}, 7, 7, marks=pytest.mark.nightly),
    ],
)
def test_the_swarm_grows_unless_its_size_is_given(kwargs, first, last):
    swarm = CompactSwarm(**kwargs).setup(Parabolas(), termination=("n_eval", 2000), seed=1)
    swarm.next()
    assert len(swarm.pop) == first
    swarm.run()
    assert len(swarm.pop) == swarm.pop_size == last


@pytest.mark.parametrize(("termination", "size"), [(("n_eval", 2000), 22), (("n_gen", 4), 100)])
def test_with_constraints_the_size_follows_from_the_budget(termination, size):
    swarm = CompactSwarm().setup(get_problem("tnk"), termination=termination, seed=1)
    for _ in range(3):
        swarm.next()
        assert len(swarm.pop) == swarm.pop_size == size


def test_a_run_does_not_depend_on_the_budget_it_was_told():
    short, long = (
        CompactSwarm().setup(get_problem("zdt1"), termination=("n_eval", told), seed=1)
        for told in (400, 4000)
    )
    short.run()
    while long.evaluator.n_eval < short.evaluator.n_eval:
        long.next()
    assert digest(short.result()) == digest(long.result())


# --- constraints ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", others_at_night(["mw9", "mw12", "mw1"]))
def test_gaps_between_feasible_regions_are_crossed(name):
    """Where one leader and nobody infeasible left a part of the front, or all of it, unfound."""
    problem = get_problem(name)
    volume = HV(np.array([1.2, 1.2]))
    n_eval = 10_000 if name == "mw1" else 6000
    ours, theirs = (
        [run(problem, n_eval, seed, make) for seed in (0, 1)]
        for make in (CompactSwarm, ElitistSwarm)
    )
    reached = [
        np.mean([0.0 if one.F is None else volume(one.F) for one in results])
        for results in (ours, theirs)
    ]
    assert reached[0] > 1.2 * reached[1]


class OnASphere(Parabolas):
    """One equality constraint, which pymoo counts as met on a shell 1e-4 thin."""

    def __init__(self):
        super().__init__(n_var=10, n_eq_constr=1)

    def _evaluate(self, X, out, *args, **kwargs):
        out["F"] = np.column_stack([1.0 + X[:, 0], ((X - 1.0) ** 2).sum(axis=1) - 4.0])
        out["H"] = (X**2).sum(axis=1, keepdims=True) - 1.0


def test_an_equality_constraint_is_met_and_followed():
    results = [run(OnASphere(), 4000, seed) for seed in range(6)]
    assert all(np.abs(result.H).max() <= 1e-4 for result in results)
    # A front within the shell, without a move along it, would be as wide as the shell is thick.
    assert max(np.ptp(result.X, axis=0).max() for result in results) > 100 * 1e-4


class TwoBars(Problem):
    """CRE21 of R. Tanabe, H. Ishibuchi (2020): cross-sections, feasible below 1e-4 of the box."""

    def __init__(self):
        super().__init__(
            n_var=3, n_obj=2, n_ieq_constr=3, xl=[1e-5, 1e-5, 1.0], xu=[100.0, 100.0, 3.0]
        )

    def _evaluate(self, X, out, *args, **kwargs):
        first, second, y = X.T
        lengths = np.sqrt(16.0 + y**2), np.sqrt(1.0 + y**2)
        volume = first * lengths[0] + second * lengths[1]
        stresses = 20.0 * lengths[0] / (first * y), 80.0 * lengths[1] / (second * y)
        out["F"] = np.column_stack([volume, stresses[0]])
        out["G"] = np.column_stack([volume - 0.1, *(stress - 1e5 for stress in stresses)])


def test_a_feasible_region_far_thinner_than_the_box_is_found_along_its_bounds():
    assert sum(run(TwoBars(), 500, seed).F is not None for seed in range(10)) >= 9


def test_what_would_pass_a_bound_stops_on_the_way_in_half_only_as_long_as_nothing_is_feasible():
    swarm = CompactSwarm()
    swarm.setup(TwoBars(), termination=("n_eval", 500), seed=1)
    lowest, highest = swarm.problem.bounds()
    X = np.random.default_rng(1).uniform(lowest, highest, (1000, 3))
    aims = X + (highest - lowest) * [-2.0, 2.0, 0.0]
    points = Points(X, np.ones((1000, 2)), np.ones(1000))
    reached = swarm._within(X, aims, points)
    assert np.all((lowest <= reached) & (reached <= highest))
    np.testing.assert_array_equal(reached[:, 2], X[:, 2])
    for column, bound in enumerate((lowest, highest)):
        share = (reached - X)[:, column] / (bound[column] - X[:, column])
        on_it = reached[:, column] == bound[column]
        assert binomtest(int(on_it.sum()), 1000, 0.5).pvalue > 0.01
        assert kstest(share[~on_it], "uniform").pvalue > 0.01
    found = Points(X, points.F, np.append(0.0, np.ones(999)))
    np.testing.assert_array_equal(swarm._within(X, aims, found), np.clip(aims, lowest, highest))


def test_an_infeasible_problem_reports_like_pymoo():
    result = run(Unreachable(), 2000)
    assert result.F is None
    assert len(result.algorithm.archive_all()) == 0
    np.testing.assert_allclose(result.algorithm.opt[0].X, -1.0, atol=0.05)


# --- habits of pymoo ------------------------------------------------------------------------------


class Lattice(Problem):
    """Integers; the best compromises lie between (3, 7) and (6, 2)."""

    def __init__(self, **kwargs):
        super().__init__(**{"n_var": 2, "n_obj": 2, "xl": 0, "xu": 20, "vtype": int, **kwargs})

    def _evaluate(self, X, out, *args, **kwargs):
        assert np.issubdtype(X.dtype, np.integer)
        distances = [((X - corner) ** 2).sum(axis=1) for corner in ([3, 7], [6, 2])]
        out["F"] = np.column_stack(distances)


@pytest.mark.parametrize("make", [CompactSwarm, ElitistSwarm])
def test_integers_by_a_repair(make):
    problem = Lattice()
    grid = np.array(np.meshgrid(np.arange(21), np.arange(21))).reshape(2, -1).T
    F = problem.evaluate(grid)
    front = F[is_nondominated(F)]
    result = run(problem, 1000, make=make, repair=RoundingRepair())
    np.testing.assert_array_equal(np.unique(result.F, axis=0), np.unique(front, axis=0))
    with pytest.raises(InvalidInput, match="RoundingRepair"):
        run(problem, 100, make=make)


def test_mixed_variables_are_refused_with_a_word_on_what_is_possible():
    class Mixed(Problem):
        def __init__(self):
            super().__init__(vars={"a": Integer(bounds=(0, 3)), "b": Real(bounds=(0, 1))}, n_obj=2)

    with pytest.raises(InvalidInput, match="mixed"):
        run(Mixed(), 100, repair=RoundingRepair())


@pytest.mark.parametrize("make", [CompactSwarm, ElitistSwarm])
@pytest.mark.parametrize("n_offsprings", others_at_night([1, 7, 45], 7, 45))
def test_any_number_of_offspring(make, n_offsprings):
    problem = Parabolas()
    swarm = make(20, n_offsprings=n_offsprings)
    result = minimize(problem, swarm, ("n_eval", 400), seed=1)
    assert problem.n_rows == result.algorithm.evaluator.n_eval
    assert 400 <= problem.n_rows < 400 + n_offsprings
    assert len(result.pop) == 20


def test_a_problem_without_any_number_ends_empty_and_with_a_warning():
    with pytest.warns(RuntimeWarning, match="no objective was finite"):
        result = run(Cliff(3.0), 200)
    assert result.F is result.X is None


class NoConstraint(Parabolas):
    """Whose constraint is never a number."""

    def __init__(self):
        super().__init__(n_ieq_constr=1)

    def _evaluate(self, X, out, *args, **kwargs):
        super()._evaluate(X, out)
        out["G"] = np.full((len(X), 1), np.nan)


def test_the_warning_does_not_blame_objectives_alone():
    with pytest.warns(RuntimeWarning, match="or no constraint"):
        result = run(NoConstraint(), 200)
    assert result.F is None


@pytest.mark.parametrize("problem", [Parabolas(), Unreachable()])
@pytest.mark.parametrize("n_offsprings", [None, 1])
def test_a_callback_may_leave_a_single_particle(problem, n_offsprings):
    def leave_one(algorithm):
        algorithm.pop = algorithm.pop[:1]

    swarm = CompactSwarm(20, n_offsprings=n_offsprings, callback=leave_one)
    result = minimize(problem, swarm, ("n_eval", 100), seed=1)
    assert result.algorithm.evaluator.n_eval >= 100


def test_an_archive_is_empty_before_a_run():
    assert len(CompactSwarm().archive_all()) == 0


def test_pymoo_s_default_termination_ends_a_small_swarm():
    result = minimize(Parabolas(), CompactSwarm(15), seed=1)
    assert 50 < result.algorithm.n_iter < 500


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))])
@pytest.mark.parametrize("problem", others_at_night(["zdt1", "tnk"], "tnk"))
def test_a_copy_taken_anywhere_goes_on_alike(problem, clone):
    uninterrupted = run(problem, 600, seed=3)
    swarm = CompactSwarm().setup(get_problem(problem), termination=("n_eval", 600), seed=3)
    while swarm.has_next():
        swarm = clone(swarm)
        swarm.archive_all()
        swarm.next()
    assert digest(swarm.result()) == digest(uninterrupted)


def test_a_history_holds_each_generation_as_it_was():
    """Copies share arrays, but a callback may evaluate the particles of one of them again."""
    swarm = CompactSwarm(save_history=True)
    swarm.setup(get_problem("zdt1"), termination=("n_eval", 300), seed=3)
    fronts = []
    while swarm.has_next():
        swarm.next()
        fronts.append(swarm.opt.get("F"))
    for particle in (*swarm.pop, *swarm.opt):
        particle.F, particle.data["again"] = particle.F + 1.0, True
    for then, front in zip(swarm.history, fronts, strict=True):
        np.testing.assert_array_equal(then.opt.get("F"), front)
        assert not any("again" in particle.data for particle in then.pop)
    first, last = swarm.history[0].opt, swarm.history[-1].opt
    assert first[0] is not last[0]
    (model,) = (move for move in swarm.history[-2].moves if isinstance(move, ModelStep))
    (later,) = (move for move in swarm.history[-1].moves if isinstance(move, ModelStep))
    assert model._told[0].X is later._told[0].X


@pytest.mark.slow
def test_a_history_takes_at_most_three_times_the_memory_of_nsga2_s():
    """It has nine times as many generations, which share what does not change."""
    sizes = []
    for make in (CompactSwarm, NSGA2):
        run("zdt1", 100, make=make)  # what is loaded once is no part of a history
        tracemalloc.start()
        history = run("zdt1", 1000, make=make, save_history=True).history
        sizes.append(tracemalloc.get_traced_memory()[0] if history else 0)
        tracemalloc.stop()
    assert 0 < sizes[0] <= 3 * sizes[1]


def test_with_many_variables_no_matrix_has_them_all():
    n_var = 2000
    run("zdt1", 20)  # what is loaded once is no part of it
    tracemalloc.start()
    run(get_problem("zdt1", n_var=n_var), 100)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * n_var**2


def test_a_number_of_generations_is_told_in_evaluations():
    with pytest.warns(UserWarning, match=r"20 generations .* 200 evaluations"):
        result = minimize(Parabolas(), CompactSwarm(), ("n_gen", 20), seed=1)
    assert result.algorithm.evaluator.n_eval == 200
    # A size of one's own makes generations alike.
    minimize(Parabolas(), CompactSwarm(10), ("n_gen", 3), seed=1)


def test_many_objectives_are_not_claimed():
    with pytest.warns(UserWarning, match="5"):
        CompactSwarm().setup(get_problem("dtlz2", n_obj=5), termination=("n_eval", 100))
    CompactSwarm().setup(get_problem("dtlz2", n_obj=4), termination=("n_eval", 100))


def test_with_more_evaluations_the_swarm_goes_on_growing():
    first = run("zdt1", 500).algorithm
    first.setup(first.problem, termination=("n_eval", 2000), seed=1)
    first.run()
    assert first.evaluator.n_eval >= 2000
    assert first.pop_size == size_for(first.evaluator.n_eval)


@pytest.mark.parametrize("argument", ["n_result", "n_archive", "n_offsprings"])
def test_sizes_are_checked(argument):
    with pytest.raises(InvalidInput, match=argument):
        CompactSwarm(**{argument: 0})
    with pytest.raises(InvalidInput, match="n_archive"):
        CompactSwarm(n_result=100, n_archive=99)
