"""A swarm's state is in the population, which callbacks, wrappers and users of ask may change."""

from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.constraints.eps import AdaptiveEpsilonConstraintHandling
from pymoo.core.callback import Callback
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from swarm_problems import Parabolas, assert_clean_front, digest, run

from experiments.studies.suites.limits import NoisyZDT1
from pymoo_hdte.algorithms import AMPMOPSO, MOPSO, CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.elitist import averaged, replaced
from pymoo_hdte.algorithms.moves import Difference
from pymoo_hdte.checks import InvalidInput

ELITIST = {"pop_size": 20}
SMALL = {"pop_size": 20, "archive_size": 10}
SWARMS = {
    "CompactSwarm": lambda: CompactSwarm(20, n_result=20),
    "ElitistSwarm": lambda: ElitistSwarm(**ELITIST),
    "AMPMOPSO": lambda: AMPMOPSO(**SMALL),
    "MOPSO": lambda: MOPSO(**SMALL),
}


@pytest.fixture(params=SWARMS)
def swarm(request):
    return SWARMS[request.param]()


class Each(Callback):
    """Call a function with the algorithm, in every generation or in one of them."""

    def __init__(self, change, generation=None):
        super().__init__()
        self.change, self.generation = change, generation

    def update(self, algorithm):
        if self.generation in (None, algorithm.n_iter):
            self.change(algorithm)


def in_order_of_the_first_objective(algorithm):
    algorithm.pop = algorithm.pop[np.argsort(algorithm.pop.get("F")[:, 0])]


def shuffled_in_place(algorithm):
    np.random.default_rng(algorithm.n_iter).shuffle(algorithm.pop)


@pytest.mark.parametrize("change", [in_order_of_the_first_objective, shuffled_in_place])
@pytest.mark.parametrize("problem", ["zdt1", "tnk"])
def test_a_callback_may_change_the_order_of_the_population(swarm, problem, change):
    result = run(swarm, problem, n_gen=40, callback=Each(change))
    assert np.all(result.CV == 0.0)
    assert_clean_front(result)
    np.testing.assert_array_equal(
        result.problem.evaluate(result.X, return_values_of=["F"]), result.F
    )


def test_particles_keep_velocity_and_own_best_in_another_order():
    def turned(algorithm):
        algorithm.pop = algorithm.pop[::-1]

    plain, turned_once = (
        run(MOPSO(**SMALL), Parabolas(), n_gen=12, save_history=True, callback=callback).history
        for callback in (Callback(), Each(turned, 10))
    )
    for attribute in ("X", "V"):
        expected = plain[9].pop.get(attribute)
        np.testing.assert_array_equal(turned_once[9].pop.get(attribute), expected)
    followers = turned_once[10].pop
    # A particle that was its own best remembers where it stood, in the reverse order.
    stood = plain[9].pop.get("X")[::-1]
    own = [one.data["best"] for one in plain[9].pop[::-1]]
    remembered = [one.data["best"] for one in followers]
    checked = 0
    for before, place, after in zip(own, stood, remembered, strict=True):
        if after is not None:
            np.testing.assert_array_equal(after.X, place if before is None else before.X)
            checked += 1
    assert checked > 3


@pytest.mark.parametrize("rows", [slice(0, 7), list(range(20)) * 2])
def test_a_population_of_another_length_grows_back(swarm, rows):
    def cut(algorithm):
        algorithm.pop = algorithm.pop[rows]

    result = run(swarm, "tnk", n_gen=20, save_history=True, callback=Each(cut, 10))
    assert [len(step.pop) for step in result.history] == [20] * 20
    assert result.algorithm.evaluator.n_eval == 400
    assert_clean_front(result)


def test_what_a_callback_puts_in_is_found_and_followed(swarm):
    """The middle of the known front: nothing can dominate it, and few equal it."""
    middle = np.append(0.5, np.zeros(29))

    def put_in(algorithm):
        guest = Population.new("X", middle[np.newaxis])
        Evaluator().eval(algorithm.problem, guest)
        algorithm.pop[3] = guest[0]

    def append(algorithm):
        put_in(algorithm)
        algorithm.pop = Population.merge(algorithm.pop, algorithm.pop[3:4])

    for change in (put_in, append):
        results = [run(swarm, "zdt1", n_gen=n_gen, callback=Each(change, 10)) for n_gen in (11, 25)]
        assert np.all(middle == results[0].X, axis=1).any()
        # The front is f2 = 1 - sqrt(f1); without help the swarms are far from it by then.
        distance = results[1].F[:, 1] - (1.0 - np.sqrt(results[1].F[:, 0]))
        assert np.median(distance) < 0.1


class Shifting(Parabolas):
    """All objectives grow by the shift."""

    shift = 0.0

    def _evaluate(self, X, out, *args, **kwargs):
        super()._evaluate(X, out)
        out["F"] += self.shift


def test_a_population_evaluated_again_replaces_what_was_true_before(swarm):
    def evaluate_again(algorithm):
        algorithm.problem.shift = 5.0
        known = [algorithm.pop]
        if isinstance(algorithm, MOPSO | AMPMOPSO):
            bests = [one.data["best"] for one in algorithm.pop if one.data["best"] is not None]
            known += [algorithm.leaders.members, Population(bests)]
        for one in known:
            Evaluator(skip_already_evaluated=False).eval(algorithm.problem, one)

    problem = Shifting()
    result = run(swarm, problem, n_gen=40, callback=Each(evaluate_again, 20))
    np.testing.assert_allclose(result.F, problem.evaluate(result.X), rtol=1e-14)
    assert np.mean(result.opt.get("n_gen") > 20) > 0.5


# --- wrappers ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "name"),
    [
        pytest.param(ElitistSwarm, "bnh", marks=pytest.mark.nightly),
        pytest.param(ElitistSwarm, "tnk", marks=pytest.mark.nightly),
        (ElitistSwarm, "dascmop1"),
        pytest.param(AMPMOPSO, "bnh", marks=pytest.mark.nightly),
    ],
)
def test_pymoo_s_adaptive_constraint_handling_takes_our_swarms(make, name):
    problem = get_problem(name, 5) if name == "dascmop1" else get_problem(name)

    def feasible_or_least_infeasible(algorithm):
        violation = algorithm.opt.get("CV")
        assert np.all(violation == 0.0) or len(violation) == 1

    wrapped = AdaptiveEpsilonConstraintHandling(make(pop_size=40), perc_eps_until=0.5)
    callback = Each(feasible_or_least_infeasible)
    result = minimize(problem, wrapped, ("n_gen", 120), seed=1, callback=callback)
    assert len(result.F) >= 20
    assert_clean_front(result)


def test_a_wrapped_swarm_still_looks_at_its_problem():
    with pytest.raises(InvalidInput, match="n_obj"):
        minimize(
            Parabolas(n_obj=1),
            AdaptiveEpsilonConstraintHandling(ElitistSwarm(**ELITIST)),
            ("n_gen", 2),
        )


# --- setup, ask and tell ------------------------------------------------------------------------


def test_a_second_setup_of_a_running_swarm_loses_nothing(swarm):
    problem = get_problem("zdt1")
    swarm.setup(problem, termination=("n_gen", 60), seed=1)
    swarm.run()
    before = swarm.opt.get("F")
    swarm.setup(problem, termination=("n_gen", 61), seed=1)
    swarm.next()
    after = swarm.opt.get("F")
    # Every former solution is still there or a crowded neighbour has replaced it.
    assert len(after) >= len(before) - 2
    assert np.isin(before[:, 0], after[:, 0]).mean() > 0.5


def test_a_swarm_asked_twice_flies_with_the_velocities_that_come_back():
    expected = run(MOPSO(**SMALL), n_gen=1).algorithm.setup(
        get_problem("zdt1"), termination=("n_gen", 9), seed=5
    )
    twice = MOPSO(**SMALL).setup(get_problem("zdt1"), termination=("n_gen", 9), seed=1)
    first, second = twice.ask(), twice.ask()
    assert not np.array_equal(first.get("V"), second.get("V"))
    twice.evaluator.eval(twice.problem, first)
    twice.tell(infills=first)
    twice.setup(twice.problem, termination=("n_gen", 9), seed=5)
    for swarm in (expected, twice):
        swarm.next()
    assert digest(expected.result()) == digest(twice.result())
    np.testing.assert_array_equal(expected.pop.get("V"), twice.pop.get("V"))


def test_first_positions_a_rounding_beyond_the_bounds_are_put_on_them():
    lower, upper = np.array([-1.0, 0.1, 0.3]), np.array([2.0, 0.7, 0.9])
    corners = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, -1).T
    X = lower + corners * (upper - lower)
    problem = Parabolas(xl=lower, xu=upper)
    assert (X - upper).max() > 0.0
    population = Evaluator().eval(problem, Population.new("X", X))
    for given in (X, population):
        result = run(ElitistSwarm(8, sampling=given), problem, n_gen=1)
        on_the_bounds = np.where(corners == 1.0, upper, lower)
        np.testing.assert_array_equal(result.pop.get("X"), on_the_bounds)
        np.testing.assert_array_equal(result.pop.get("F"), problem.evaluate(on_the_bounds))
    np.testing.assert_array_equal(population.get("X"), X)


@pytest.mark.parametrize("value", [2.0 + 1e-11, np.nan, -1.5])
def test_first_positions_beyond_the_bounds_are_named(value):
    X = np.zeros((20, 3))
    X[4, 1] = value
    with pytest.raises(InvalidInput, match=r"sampling\[4, 1\]") as error:
        run(ElitistSwarm(sampling=X, **ELITIST), Parabolas())
    np.testing.assert_equal(error.value.value, value)
    assert error.value.allowed == "-1.0 to 2.0, the bounds of the problem"


# --- noise ----------------------------------------------------------------------------------------


class Draws(Problem):
    """Two parabolas with noise in objectives and constraint, which notes every evaluation."""

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)
        self.generator, self.seen = np.random.default_rng(1), {}

    def _evaluate(self, X, out, *args, **kwargs):
        F = np.column_stack([(X**2).sum(axis=1), ((X - 1.0) ** 2).sum(axis=1)])
        values = np.column_stack([F, 0.1 - X[:, 0]])
        values += 0.05 * self.generator.standard_normal(values.shape)
        for x, value in zip(X, values, strict=True):
            self.seen.setdefault(x.tobytes(), []).append(value)
        out["F"], out["G"] = values[:, :2], values[:, 2:]


@pytest.mark.parametrize("make", [ElitistSwarm, CompactSwarm])
def test_what_is_evaluated_again_has_the_mean_of_all_its_evaluations(make):
    problem = Draws()
    # Nothing but a repeat comes to a place a second time.
    swarm = make(20, moves=(Difference(),), reevaluated=0.3)
    result = minimize(problem, swarm, ("n_eval", 1500), seed=1, save_history=True)
    everywhere = [*result.opt, *result.algorithm.pop]
    if make is CompactSwarm:
        everywhere += [*result.algorithm.archive_all()]
    for particle in everywhere:
        evaluations = problem.seen[particle.X.tobytes()]
        assert particle.data.get("n_evaluations", 1) == len(evaluations)
        mean = np.mean(evaluations, axis=0)
        np.testing.assert_allclose([*particle.F, *particle.G], mean, rtol=1e-12, atol=1e-12)
        assert particle.CV[0] == max(0.0, particle.G[0])
    counts = [particle.data.get("n_evaluations", 1) for particle in result.opt]
    assert np.mean(counts) > 2.0
    assert sum(map(len, problem.seen.values())) == result.algorithm.evaluator.n_eval <= 1500
    # What a history has is as it was.
    early = result.history[3].opt
    assert max(particle.data.get("n_evaluations", 1) for particle in early) <= 4


@pytest.mark.parametrize("lost", ["F", "G"])
def test_of_a_lost_evaluation_and_a_sound_one_the_sound_one_stays(lost):
    first, second = Draws(), Draws()
    X = np.full((1, 2), 0.7)
    groups = [Evaluator().eval(problem, Population.new(X=X)) for problem in (first, second)]
    for members, repeats in (groups, groups[::-1]):
        members, repeats = (Population([p.copy(deep=True) for p in g]) for g in (members, repeats))
        sound = repeats[0].get("F").copy()
        members[0].set(lost, np.full_like(members[0].get(lost), np.nan))
        (kept,) = replaced(members, averaged(members, repeats))
        np.testing.assert_array_equal(kept.F, sound)
        # The other way round the member stays as it is.
        members[0].set(lost, np.full_like(members[0].get(lost), np.nan))
        assert averaged(repeats, members) == {}


def test_evaluating_again_needs_a_share():
    for share in (-0.1, 1.0, np.nan):
        with pytest.raises(InvalidInput, match="reevaluated"):
            ElitistSwarm(reevaluated=share)


@pytest.mark.nightly
@pytest.mark.parametrize("make", [ElitistSwarm, CompactSwarm])
def test_with_noise_evaluating_again_brings_the_swarms_nearer_than_nsga2(make):
    exact = get_problem("zdt1")
    distance = IGDPlus(exact.pareto_front())
    for deviation in (0.05, 0.2):
        reached = []
        for algorithm in (partial(make, reevaluated=0.3), NSGA2):
            values = []
            for seed in range(1, 6):
                problem = NoisyZDT1(deviation, seed)
                X = minimize(problem, algorithm(), ("n_eval", 10_000), seed=seed).X
                values.append(distance(exact.evaluate(np.atleast_2d(X))))
            reached.append(values)
        assert max(reached[0]) < min(reached[1])
