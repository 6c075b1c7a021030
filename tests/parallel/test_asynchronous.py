"""Swarms without generations, and the queue in virtual time on which they are measured."""

import numpy as np
import pytest
from costly_problems import Parabolas
from pymoo.indicators.hv import HV
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from pymoo_hdte.algorithms import AMPMOPSO, CompactSwarm, ElitistSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.parallel import ExecutorParallelization, VirtualWorkers, minimize_asynchronously
from pymoo_hdte.problems import SimulatorFailed

OPTIMISERS = {"generations": minimize, "asynchronous": minimize_asynchronously}
ALL_HYPERVOLUME = HV(ref_point=[3.0, 3.0])


def lognormal(seed):
    random_state = np.random.default_rng(seed)
    return lambda: random_state.lognormal()


def on(virtual, mishaps=None):
    return Parabolas(mishaps, elementwise_runner=ExecutorParallelization(virtual, tries=1))


def test_the_earliest_free_worker_takes_the_next_of_the_queue():
    times = iter([3.0, 1.0, 1.0, 4.0, np.inf])
    queue = VirtualWorkers(2, lambda: next(times), time_limit=10.0)
    for name in "abcde":
        queue.start(name, str.upper, name)
    ends = [(queue.next(), queue.now) for _ in range(4)]
    # By hand: a 0-3, b 0-1, c 1-2, d 2-6, e from 3 on, without end.
    assert ends == [(("b", "B"), 1.0), (("c", "C"), 2.0), (("a", "A"), 3.0), (("d", "D"), 6.0)]
    key, failure = queue.next()
    assert (key, failure.kind, queue.now) == ("e", "over the time limit", 13.0)
    assert queue.efficiency == (3.0 + 1.0 + 1.0 + 4.0 + 10.0) / (2 * 13.0)


def test_what_would_never_end_is_refused():
    with pytest.raises(InvalidInput, match="with a time_limit"):
        VirtualWorkers(2, lambda: np.inf).start("a", str.upper, "a")


def test_generations_wait_for_their_slowest_and_give_the_same_on_any_times():
    queue = VirtualWorkers(16, lognormal(1))
    found = minimize(on(queue), CompactSwarm(pop_size=16), ("n_eval", 160), seed=1)
    expected = minimize(Parabolas(), CompactSwarm(pop_size=16), ("n_eval", 160), seed=1)
    assert np.array_equal(found.F, expected.F)
    random_state = np.random.default_rng(1)
    assert queue.now == pytest.approx(random_state.lognormal(size=(10, 16)).max(axis=1).sum())


@pytest.mark.parametrize("at_once", [3, 16, 40])
def test_without_generations_workers_are_busy_until_the_last_are_waited_for(at_once):
    queue, times = VirtualWorkers(at_once, lognormal(1)), []
    problem = on(queue)
    problem.callback = lambda X, out: times.append(queue.now)
    swarm = ElitistSwarm(pop_size=16)
    result = minimize_asynchronously(problem, swarm, ("n_eval", 200), seed=1)
    assert result.algorithm.evaluator.n_eval == result.evaluations.made == 200
    # Where the last evaluation begins, another one has just ended, and nobody has ever waited.
    last_begins = times[200 - at_once - 1]
    random_state = np.random.default_rng(1)
    work = random_state.lognormal(size=200)
    assert queue.busy == pytest.approx(work.sum())
    assert queue.busy >= at_once * last_begins
    assert queue.now - last_begins <= work.max()
    again = VirtualWorkers(at_once, lognormal(1))
    same = minimize_asynchronously(on(again), swarm, ("n_eval", 200), seed=1)
    assert np.array_equal(same.F, result.F)


@pytest.mark.parametrize("optimise", OPTIMISERS)
def test_a_fifth_lost_costs_no_more_than_its_evaluations(optimise):
    """At the same number of good evaluations, at most 2 % of the hypervolume; 20 % fail or hang."""
    lost = []
    for seed in range(3):
        calm, rough = VirtualWorkers(8, lognormal(seed)), VirtualWorkers(8, hanging(seed), 20.0)
        swarm = ElitistSwarm(20)
        whole = OPTIMISERS[optimise](on(calm), swarm, ("n_eval", 240), seed=seed)
        problem = on(rough, {"raises": 0.06, "gives NaN": 0.05})
        with pytest.warns(RuntimeWarning, match="designs were lost"):
            found = OPTIMISERS[optimise](problem, swarm, ("n_eval", 300), seed=seed)
        assert found.evaluations.n_lost == pytest.approx(60, abs=25)
        assert np.isfinite(found.F).all()
        volumes = [ALL_HYPERVOLUME(one.F) for one in (found, whole)]
        lost.append(1.0 - volumes[0] / volumes[1])
    assert np.mean(lost) <= 0.02


def hanging(seed):
    random_state = np.random.default_rng(seed)
    return lambda: random_state.lognormal() if random_state.random() < 0.9 else np.inf


@pytest.mark.parametrize("swarm", [CompactSwarm(), ElitistSwarm(pop_size=16)])
def test_a_run_shorter_than_its_first_swarm_gives_the_best_of_what_it_evaluated(swarm):
    problem = on(VirtualWorkers(3, lognormal(1)), {"raises": 0.2})
    seen = []
    problem.callback = lambda X, out: seen.append((*out["F"][0], out["G"][0, 0]))
    with pytest.warns(RuntimeWarning, match="designs were lost"):
        result = minimize_asynchronously(problem, swarm, ("n_eval", 7), seed=1)
    assert len(seen) == 7
    allowed = np.array([row[:2] for row in seen if row[2] <= 0.0])
    front = allowed[NonDominatedSorting().do(allowed, only_non_dominated_front=True)]
    assert sorted(result.F.tolist()) == sorted(front.tolist())


def test_nothing_but_failures_ends_the_run():
    problem = Parabolas({"raises": 1.0}, elementwise_runner=ExecutorParallelization())
    with pytest.raises(SimulatorFailed, match="no convergence"):
        minimize_asynchronously(problem, CompactSwarm(), ("n_eval", 100), seed=1)


def test_what_cannot_go_without_generations_is_refused():
    runner = ExecutorParallelization()
    for problem, algorithm, field in (
        (Parabolas(), CompactSwarm(), "elementwise_runner of problem"),
        (Parabolas(elementwise_runner=runner), AMPMOPSO(), "algorithm"),
    ):
        with pytest.raises(InvalidInput) as refusal:
            minimize_asynchronously(problem, algorithm, ("n_eval", 100))
        assert refusal.value.field == field
