"""Problems and swarms work with the other parts of pymoo 0.6.2, none of which is changed."""

import io
import pickle
import subprocess
import sys
import time
from contextlib import redirect_stdout
from importlib import import_module
from importlib.metadata import version
from multiprocessing.pool import ThreadPool

import numpy as np
import pytest
from night import others_at_night
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.callback import Callback
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import ElementwiseProblem
from pymoo.decomposition.asf import ASF
from pymoo.indicators.gd import GD
from pymoo.indicators.gd_plus import GDPlus
from pymoo.indicators.hv import HV
from pymoo.indicators.igd import IGD
from pymoo.indicators.igd_plus import IGDPlus
from pymoo.mcdm.pseudo_weights import PseudoWeights
from pymoo.optimize import minimize
from pymoo.parallelization import JoblibParallelization, StarmapParallelization
from pymoo.problems import get_problem
from pymoo.termination.ftol import MultiObjectiveSpaceTermination
from pymoo.termination.max_time import TimeBasedTermination
from pymoo.termination.robust import RobustTermination
from pymoo.util.display.column import Column
from pymoo.util.display.multi import MultiObjectiveOutput
from swarm_problems import digest

import pymoo_hdte
from pymoo_hdte.algorithms import AMPMOPSO, MOPSO, ElitistSwarm
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems import RobustDTE, RobustDTETolerance, RobustToy

SWARMS = {
    "AMPMOPSO": lambda: AMPMOPSO(pop_size=20, archive_size=10, n_max_gen=12),
    "MOPSO": lambda: MOPSO(pop_size=20, archive_size=10, n_max_gen=12),
    "ElitistSwarm": lambda: ElitistSwarm(pop_size=20),
}
PROBLEMS = {
    "RobustDTE": lambda: RobustDTE(order=2),
    "RobustDTETolerance": lambda: RobustDTETolerance(order=1),
    "RobustToy": RobustToy,
}


@pytest.fixture(params=SWARMS)
def swarm(request):
    return SWARMS[request.param]()


@pytest.fixture(scope="module", params=PROBLEMS)
def problem(request):
    return PROBLEMS[request.param]()


@pytest.fixture(scope="module")
def dte():
    return RobustDTE()


# --- import -----------------------------------------------------------------------------------

IMPORTED = """
import sys
before = set(sys.modules)
import pymoo_hdte
print(*set(sys.modules) - before)
"""


def test_the_package_s_name_imports_nothing_else():
    """As `import pymoo`, which takes hardly longer than Python's own start."""
    command = [sys.executable, "-c", IMPORTED]
    done = subprocess.run(command, check=True, timeout=60, capture_output=True, text=True)
    assert done.stdout.split() == ["pymoo_hdte"]


@pytest.mark.nightly
def test_problem_and_swarm_load_only_those_parts_of_scipy_that_they_use():
    """SciPy's signals and statistics alone take longer to load than all of a pymoo study."""
    code = (
        "import sys; from pymoo_hdte.algorithms import ElitistSwarm; "
        "from pymoo_hdte.problems import RobustDTE; print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, timeout=120, capture_output=True, text=True
    )
    unused = {"scipy.signal", "scipy.stats", "scipy.interpolate", "scipy.integrate"}
    assert not {*unused, "matplotlib", "chaospy"} & set(done.stdout.split())


def test_the_version_is_that_of_the_installed_package():
    assert pymoo_hdte.__version__ == version("pymoo-hdte")
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = pymoo_hdte.nonsense


# --- minimize ---------------------------------------------------------------------------------


def test_every_field_of_a_result_is_right(problem, swarm):
    result = minimize(problem, swarm, ("n_gen", 8), seed=1, save_history=True)
    assert result.problem is problem
    assert result.algorithm is not swarm
    assert swarm.problem is None
    # A sum over another number of rows may be rounded otherwise.
    np.testing.assert_allclose(problem.evaluate(result.X), result.F, rtol=1e-14)
    np.testing.assert_array_equal(result.opt.get("X"), result.X)
    np.testing.assert_array_equal(result.opt.get("F"), result.F)
    assert result.G.shape == result.H.shape == (len(result.F), 0)
    np.testing.assert_array_equal(result.CV, np.zeros((len(result.F), 1)))
    assert len(result.pop) == 20
    assert result.algorithm.evaluator.n_eval == 160
    assert [step.n_iter for step in result.history] == list(range(1, 9))
    assert [step.evaluator.n_eval for step in result.history] == list(range(20, 161, 20))
    assert 0.0 < result.exec_time == result.end_time - result.start_time < 60.0


def test_the_object_itself_runs_if_it_is_not_to_be_copied(problem, swarm):
    copied = minimize(problem, swarm, ("n_gen", 6), seed=1)
    result = minimize(problem, swarm, ("n_gen", 6), seed=1, copy_algorithm=False)
    assert result.algorithm is swarm
    assert digest(result) == digest(copied)
    # A run that has ended has nothing left to do.
    again = minimize(problem, swarm, copy_algorithm=False)
    assert digest(again) == digest(copied)
    assert swarm.evaluator.n_eval == 120


def test_ask_and_tell_is_minimize_step_by_step(problem, swarm):
    expected = minimize(problem, swarm, ("n_gen", 6), seed=1)
    swarm.setup(problem, termination=("n_gen", 6), seed=1)
    while swarm.has_next():
        asked = swarm.ask()
        # Evaluated elsewhere: only numbers come back.
        told = Population.new("X", asked.get("X"), "F", problem.evaluate(asked.get("X")))
        swarm.tell(infills=told)
    assert digest(swarm.result()) == digest(expected)


def test_a_callback_reads_and_ends_a_run(swarm):
    class EndsIt(Callback):
        def update(self, algorithm):
            self.data.setdefault("best", []).append(algorithm.opt.get("F").min(axis=0))
            if algorithm.n_iter == 5:
                algorithm.termination.terminate()

    toy = RobustToy()
    result = minimize(toy, swarm, ("n_gen", 12), seed=1, callback=EndsIt())
    # pymoo asks the termination before the callback, so one more generation runs.
    assert len(result.algorithm.callback.data["best"]) == 6
    np.testing.assert_array_equal(result.algorithm.callback.data["best"][-1], result.F.min(axis=0))


# --- checkpoints ------------------------------------------------------------------------------

CONTINUED = """
import sys
from pymoo.optimize import minimize
from pymoo.termination.max_gen import MaximumGenerationTermination
store = __import__(sys.argv[1])

with open(sys.argv[2], "rb") as file:
    checkpoints = store.load(file)
for algorithm in checkpoints.values():
    # As in pymoo's tutorial: a run that had ended gets further generations.
    algorithm.termination = MaximumGenerationTermination(12)
    minimize(algorithm.problem, algorithm, copy_algorithm=False, verbose=False)
results = {name: algorithm.result() for name, algorithm in checkpoints.items()}
with open(sys.argv[2], "wb") as file:
    store.dump({name: (one.X.tobytes(), one.F.tobytes()) for name, one in results.items()}, file)
"""


@pytest.mark.parametrize("store", others_at_night(["pickle", "dill"], "pickle"))
def test_checkpoints_go_on_in_another_process_as_if_never_stopped(store, tmp_path):
    module = import_module(store)
    # Every swarm, on every problem.
    problems = dict(zip(SWARMS, (make() for make in PROBLEMS.values()), strict=True))
    expected, stopped = {}, {}
    for name, problem in problems.items():
        whole = minimize(problem, SWARMS[name](), ("n_gen", 12), seed=3)
        expected[name] = whole.X.tobytes(), whole.F.tobytes()
        if name == "ElitistSwarm":
            part = minimize(problem, SWARMS[name](), ("n_gen", 5), seed=3, save_history=True)
            stopped[name] = part.algorithm
        else:
            # Schedules are as long as the run is said to be: these stop on the way.
            swarm = SWARMS[name]().setup(problem, termination=("n_gen", 12), seed=3)
            for _ in range(5):
                swarm.next()
            stopped[name] = swarm
        assert digest(stopped[name].result()) != digest(whole)
    path = tmp_path / "checkpoint"
    path.write_bytes(module.dumps(stopped))
    subprocess.run([sys.executable, "-c", CONTINUED, store, str(path)], check=True, timeout=120)
    assert pickle.loads(path.read_bytes()) == expected


# --- display ----------------------------------------------------------------------------------


def test_the_display_knows_the_stored_front(dte, swarm):
    with redirect_stdout(io.StringIO()) as text:
        result = minimize(dte, swarm, ("n_gen", 3), seed=1, verbose=True)
    heading, *rows = (
        [word.strip() for word in line.split("|")]
        for line in text.getvalue().splitlines()
        if "|" in line
    )
    assert heading == ["n_gen", "n_eval", "n_nds", "igd", "gd", "hv"]
    assert [row[:2] for row in rows] == [["1", "20"], ["2", "40"], ["3", "60"]]
    last = dict(zip(heading, rows[-1], strict=True))
    assert int(last["n_nds"]) == len(result.F)
    distance = IGD(dte.pareto_front(), zero_to_one=True)(result.F)
    assert float(last["igd"]) == pytest.approx(distance, rel=1e-6)


def test_without_a_stored_front_the_display_shows_progress_and_takes_columns():
    class Spread(MultiObjectiveOutput):
        def __init__(self):
            super().__init__()
            self.spread = Column("spread")
            self.columns += [self.spread]

        def update(self, algorithm):
            super().update(algorithm)
            self.spread.set(np.ptp(algorithm.opt.get("F"), axis=0).max())

    with redirect_stdout(io.StringIO()) as text:
        minimize(
            RobustDTE(order=1),
            ElitistSwarm(pop_size=20),
            ("n_gen", 3),
            seed=1,
            verbose=True,
            output=Spread(),
        )
    heading = text.getvalue().splitlines()[1]
    names = {name.strip() for name in heading.split("|")}
    assert {"eps", "indicator", "spread"} < names
    assert not {"igd", "gd", "hv"} & names


# --- termination ------------------------------------------------------------------------------


def test_a_run_ends_when_its_time_is_up():
    before = time.monotonic()
    swarm = ElitistSwarm(pop_size=20)
    result = minimize(RobustToy(), swarm, TimeBasedTermination(0.2), seed=1)
    assert 0.2 <= result.exec_time <= time.monotonic() - before < 10.0
    assert result.algorithm.n_iter > 2
    # A swarm with schedules wants to know how long they are.
    with pytest.warns(UserWarning, match="n_max_gen"):
        unknown = minimize(RobustToy(), AMPMOPSO(pop_size=20), ("time", 0.2), seed=1)
    assert unknown.algorithm.generations == 1000
    scheduled = AMPMOPSO(pop_size=20, n_max_gen=30)
    assert minimize(RobustToy(), scheduled, ("time", 0.2), seed=1).exec_time >= 0.2


@pytest.mark.parametrize("make", [*SWARMS.values(), lambda: NSGA2(pop_size=20)])
def test_a_front_that_moves_no_longer_ends_the_run(make):
    """Of what pymoo's default termination is made, with less patience; NSGA-II for comparison."""
    slack = RobustTermination(MultiObjectiveSpaceTermination(tol=0.1, only_feas=True), period=5)
    result = minimize(RobustToy(), make(), slack, seed=1)
    assert 5 < result.algorithm.n_iter < 200


# --- evaluation -------------------------------------------------------------------------------


class OneByOne(ElementwiseProblem):
    """Parabolas of one design at a time, as simulations are written."""

    def __init__(self, **kwargs):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=-1.0, xu=2.0, **kwargs)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [float(x @ x), float((x - 1.0) @ (x - 1.0))]
        out["G"] = [0.25 - x[0]]


def test_pymoo_s_runners_evaluate_for_our_swarms(swarm):
    expected = minimize(OneByOne(), swarm, ("n_gen", 5), seed=1)
    assert np.all(expected.X[:, 0] >= 0.25)
    with ThreadPool(2) as pool:
        threads = OneByOne(elementwise_runner=StarmapParallelization(pool.starmap))
        assert digest(minimize(threads, swarm, ("n_gen", 5), seed=1)) == digest(expected)


def test_joblib_evaluates_for_our_swarms():
    swarm = ElitistSwarm(pop_size=10)
    parallel = OneByOne(elementwise_runner=JoblibParallelization(n_jobs=2, prefer="threads"))
    found, expected = (minimize(one, swarm, ("n_gen", 3), seed=1) for one in (parallel, OneByOne()))
    assert digest(found) == digest(expected)


def test_a_runner_is_not_asked_for_what_is_evaluated_at_once(problem):
    def never(f, X):
        raise AssertionError("one design at a time")

    expected = minimize(problem, ElitistSwarm(pop_size=20), ("n_gen", 3), seed=1)
    former, problem.elementwise_runner = problem.elementwise_runner, never
    try:
        found = minimize(problem, ElitistSwarm(pop_size=20), ("n_gen", 3), seed=1)
    finally:
        problem.elementwise_runner = former
    assert digest(found) == digest(expected)


def test_one_design_is_evaluated_like_many(problem):
    designs = np.random.default_rng(1).uniform(problem.xl, problem.xu, (3, problem.n_var))
    F, dF = problem.evaluate(designs, return_values_of=["F", "dF"])
    one = problem.evaluate(designs[1], return_values_of=["F", "dF"], return_as_dictionary=True)
    assert one["F"] == pytest.approx(F[1], rel=1e-12)
    assert one["dF"] == pytest.approx(dF[1], rel=1e-9)


@pytest.mark.parametrize("make", [SWARMS["ElitistSwarm"], lambda: NSGA2(pop_size=20)])
def test_gradients_come_along_on_request(problem, make):
    seen = []
    evaluator = Evaluator(
        evaluate_values_of=["F", "dF"], callback=lambda pop: seen.append(len(pop))
    )
    result = minimize(problem, make(), ("n_gen", 4), seed=1, evaluator=evaluator)
    assert seen == [20] * 4
    assert evaluator.n_eval == 80
    expected = problem.evaluate(result.pop.get("X"), return_values_of=["dF"])
    assert result.pop.get("dF").shape == (20, problem.n_obj, problem.n_var)
    assert result.pop.get("dF") == pytest.approx(
        expected, rel=1e-9, abs=1e-12 * abs(expected).max()
    )


def test_one_budget_may_be_shared_by_two_algorithms(problem):
    """The evaluated swarm of the first is the start of the second, and costs nothing there."""
    evaluator = Evaluator()
    first = minimize(problem, NSGA2(pop_size=20), ("n_gen", 3), seed=1, evaluator=evaluator)
    second = ElitistSwarm(pop_size=20, sampling=first.pop)
    result = minimize(problem, second, ("n_gen", 3), seed=1, evaluator=evaluator)
    assert evaluator.n_eval == 20 * 3 + 20 * 2
    # An elitist swarm loses nothing of what it was given.
    assert np.all(result.F.min(axis=0) <= first.F.min(axis=0))


# --- fronts -----------------------------------------------------------------------------------


def test_indicators_take_our_fronts(dte):
    front = dte.pareto_front()
    for indicator in (IGD, GD, IGDPlus, GDPlus):
        assert indicator(front)(front) == pytest.approx(0.0, abs=1e-12)
        assert indicator(front)(front + 0.5) > 0.1
    worst = front.max(axis=0) + 1.0
    order = np.argsort(front[:, 0])
    steps = np.diff(np.append(front[order, 0], worst[0])) * (worst[1] - front[order, 1])
    assert HV(ref_point=worst)(front) == pytest.approx(steps.sum(), rel=1e-12)
    np.testing.assert_array_equal(dte.ideal_point(), front.min(axis=0))
    np.testing.assert_array_equal(dte.nadir_point(), front.max(axis=0))


def test_our_choice_stands_beside_pymoo_s(dte):
    """All three methods go along the front with the weights, each by its own definition."""
    front = dte.pareto_front()
    scaled = (front - front.min(axis=0)) / np.ptp(front, axis=0)
    chosen = []
    for weights in PREFERENCES.values():
        w = np.array(weights)
        rows = [WeightedUtopia(weights).do(front), PseudoWeights(w).do(scaled)]
        rows.append(int(ASF().do(scaled, 1.0 / w).argmin()))
        parts = w * scaled[rows]
        assert np.linalg.norm(parts, axis=1)[0] == np.linalg.norm(parts, axis=1).min()
        assert parts.max(axis=1)[2] == parts.max(axis=1).min()
        chosen.append(front[rows, 0])
    assert np.all(np.diff(chosen, axis=0) > 0.0)


def test_pymoo_s_problems_and_ours_share_the_swarm_object():
    swarm = ElitistSwarm(pop_size=20)
    alone = [
        digest(minimize(one, ElitistSwarm(pop_size=20), ("n_gen", 4), seed=1))
        for one in (get_problem("welded_beam"), RobustToy())
    ]
    shared = [
        digest(minimize(one, swarm, ("n_gen", 4), seed=1))
        for one in (get_problem("welded_beam"), RobustToy())
    ]
    assert shared == alone
