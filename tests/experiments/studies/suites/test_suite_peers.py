"""Runs on suites: budgets, seeds, COCO's shares, and extras that are missing."""

import time

import numpy as np
import pytest
from moocore import is_nondominated
from night import others_at_night
from pymoo.problems.multi.zdt import ZDT1

from experiments.runner import registry
from experiments.runner.registry import ExtraMissing
from experiments.studies.suites import coco, own_time
from experiments.studies.suites.coco import MARKS, TARGETS, shares
from experiments.studies.suites.jobs import BbobRun, SuiteRun, measured
from experiments.studies.suites.peers import BBOB_PEERS, OF_OUR_SIZE, OURS, PEERS, takes
from experiments.studies.suites.problems import front_of, problem_of
from pymoo_hdte.algorithms.compact import size_for
from pymoo_hdte.checks import InvalidInput


@pytest.fixture(
    params=[
        *(OURS, "GDE3", "MOEA/D-DE", "COMO-CMA-ES"),
        # pymoo spreads its directions for seconds.
        pytest.param("C-TAEA", marks=pytest.mark.nightly),
    ]
)
def peer(request):
    """Every peer that only suites have, as far as its library is installed."""
    entry = PEERS[request.param]
    if not entry.available:
        pytest.skip(f"{entry.library} is not installed (extra 'suites')")
    return entry


def test_the_budget_is_spent_and_the_seed_decides(peer):
    problem = problem_of("LZ09-F1")
    first, again, other = (peer.run(problem, (300,), seed)[0] for seed in (1, 1, 2))
    assert 250 < first.spent <= 300
    np.testing.assert_array_equal(first.F, again.F)
    assert first.F.shape != other.F.shape or not np.array_equal(first.F, other.F)


# pymoo compiles AGE-MOEA-II anew in every process, for ten seconds.
@pytest.mark.parametrize(
    "name", others_at_night(OF_OUR_SIZE, *(name for name in OF_OUR_SIZE if "AGE" not in name))
)
def test_rivals_of_our_size_offer_the_front_of_all_that_they_evaluated(name):
    evaluated = []

    class Watched(ZDT1):
        def _evaluate(self, x, out, *args, **kwargs):
            super()._evaluate(x, out, *args, **kwargs)
            evaluated.append(out["F"])

    (offer,) = OF_OUR_SIZE[name].run(Watched(), (400,), 1)
    everything = np.vstack(evaluated)
    assert {len(F) for F in evaluated} == {size_for(400)}
    assert offer.spent == len(everything) <= 400
    front = everything[is_nondominated(everything)]
    np.testing.assert_array_equal(np.sort(offer.F, axis=0), np.sort(front, axis=0))


def test_who_takes_what():
    three, two, constrained = (problem_of(name) for name in ("IMOP5", "IMOP1", "MW1"))
    assert takes("COMO-CMA-ES", two)
    assert not takes("COMO-CMA-ES", three)
    assert not takes("MOEA/D-DE", constrained)
    assert takes("C-TAEA", constrained)


def test_measures_of_a_front_itself_are_the_best_there_are():
    front = front_of("LZ09-F1")
    volume, distance, count = measured("LZ09-F1", front)
    # 1.21 less the area below 1 - sqrt(x), and what a hundred steps leave.
    assert volume == pytest.approx(1.21 - 1.0 / 3.0, abs=0.01)
    assert distance < 0.01
    assert count == 100
    behind = np.linalg.norm(2.0 - front, axis=1).mean()
    assert measured("LZ09-F1", np.full((1, 2), 2.0)) == (0.0, pytest.approx(behind), 1)
    assert measured("LZ09-F1", front[:0]) == (0.0, np.inf, 0)
    assert np.isnan(measured("RE21", np.array([[1300.0, 0.03]]))[1])


def test_shares_count_targets_once_they_are_reached():
    assert len(TARGETS) == 58
    log = "% header\n1 2.0 1.5\n150 0.5\n9000 1e-3\n10001 -1e-3\n"
    found = dict(zip(MARKS, shares(log), strict=True))
    assert found[100] == 0.0
    assert found[200] == found[5000] == np.mean(TARGETS >= 0.5)
    assert found[10_000] == np.mean(TARGETS >= 1e-3)
    assert found[25_000] == 1.0
    assert shares("% nothing\n").tolist() == [0.0] * 8


def test_every_evaluation_counts_on_bbob():
    pytest.importorskip("cocoex")
    spent = []

    def run(problem):
        (offer,) = BBOB_PEERS[OURS].run(problem, (400,), 1)
        spent.append((offer.spent, problem.problem.evaluations))

    found = coco.shares_of_run(1, 5, 1, run)
    assert spent[0][0] == spent[0][1] <= 400
    # Later marks have what was reached in the end; the first positions lie where COCO says.
    assert found[2:].tolist() == [found[2]] * 6
    assert 0.0 < found[0] <= found[2] < 1.0
    job = BbobRun(1, 5, 1, OURS, 500)
    np.testing.assert_array_equal(job.execute().values, job.execute().values)


def test_an_extra_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    with pytest.raises(ExtraMissing, match=r"cocoex is not installed: pip install '\.\[suites\]'"):
        coco.shares_of_run(1, 5, 1, lambda problem: None)


def test_a_run_is_judged_at_each_of_its_budgets():
    run = SuiteRun("LZ09-F1", "ElitistSwarm", 1, (200, 400)).execute()
    assert run.columns[:2] == ("evaluations", "spent")
    assert run.values[:, :2].tolist() == [[200, 200], [400, 400]]
    assert run.values[1, 2] >= run.values[0, 2]


def test_own_time_leaves_out_that_of_evaluations(monkeypatch):
    class Slow(ZDT1):
        def _evaluate(self, x, out, *args, **kwargs):
            begin = time.process_time()
            while time.process_time() < begin + 0.05:
                pass
            super()._evaluate(x, out, *args, **kwargs)

    monkeypatch.setattr(own_time, "EVALUATIONS", 500)
    monkeypatch.setattr(own_time, "get_problem", lambda name: Slow())
    begin = time.process_time()
    generations, seconds = own_time.own_seconds("any", own_time.MADE["NSGA-II"])
    whole = time.process_time() - begin
    assert generations == 5
    assert 0.0 < seconds <= whole - 0.05 * generations


def test_an_instance_without_targets_is_refused():
    pytest.importorskip("cocoex")
    with pytest.raises(InvalidInput, match="instance is 11"):
        coco.shares_of_run(1, 5, 11, lambda problem: None)
