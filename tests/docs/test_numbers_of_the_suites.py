"""Numbers of the page on the choice of an algorithm, which come from stored outcomes."""

from functools import partial

import matplotlib
import numpy as np
import pytest
from drawn_pictures import drawn_and_stored
from places import DOCS

from experiments.runner.registry import Context
from experiments.studies.suites import data as suites
from experiments.studies.suites.bbob_tables import CITED, reached
from experiments.studies.suites.limits import (
    AGAIN,
    NOISE,
    OBJECTIVES,
    SHARE,
    SIZES,
    limits_tables,
    stored,
)
from experiments.studies.suites.own_time import own_time_table
from experiments.studies.suites.peers import SIZED
from experiments.studies.suites.protocol import BOTH_SIZES, BUDGETS, LARGEST_SHORTFALL
from experiments.studies.suites.suite_tables import (
    feasible_runs,
    ranks_together,
    signs_together,
)
from experiments.studies.suites.suite_tables import ranks as suite_ranks
from experiments.studies.suites.suite_tables import tests as suite_tests
from pymoo_hdte._runner.campaign import Campaign

WORDS = " ".join((DOCS / "which_algorithm.md").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("suites")
    return suites.outcome_for(Context(1, folder, Campaign(folder)))


def test_the_page_is_short():
    assert len(WORDS.split()) <= 500


def test_ranks_on_all_held_out_suites(outcome):
    ranks = ", ".join(f"{ranks_together(outcome, n)['CompactSwarm']:.2f}" for n in BUDGETS)
    assert f"average ranks {ranks} of five" in WORDS
    assert all(test.beaten for n in BUDGETS for test in signs_together(outcome, n))


def test_bbob_biobj_beside_the_best_published(outcome):
    short = {place: cited for place, cited in CITED.items() if place[0] == 20 and place[1] > 2_000}
    for place, cited in CITED.items():
        assert (reached(outcome, *place) - cited < -LARGEST_SHORTFALL) == (place in short)
    ours = " and ".join(f"{reached(outcome, *place):.3f}" for place in short)
    theirs = " and ".join(f"{cited:.3f}" for cited in short.values())
    assert f"reaches {ours} of the targets" in WORDS
    assert f"(HMO-CMA-ES {theirs})" in WORDS


def test_even_fronts_by_the_other_swarm(outcome):
    for budget in BUDGETS:
        ranks = suite_ranks(outcome, "ZCAT", budget, "igd_plus")
        assert (ranks["ElitistSwarm"] < ranks["CompactSwarm"]) == (budget >= 10_000)


@pytest.mark.parametrize("suite", ["MW", "DAS-CMOP"])
def test_constraints(outcome, suite):
    feasible, runs = feasible_runs(outcome, suite, 10_000, "CompactSwarm")
    between = " runs on " if suite == "MW" else " on "
    assert f"{feasible} of {runs}{between}{suite}" in WORDS


def test_own_time():
    rows = {(row[0], row[1]): row[3:] for row in own_time_table().rows}
    on_zdt1, on_dtlz2 = (rows[name, "CompactSwarm"][1] for name in ("ZDT1", "DTLZ2"))
    assert f"is {on_zdt1:.2f} (ZDT1) and {on_dtlz2:.2f} (DTLZ2) times that of NSGA-II" in WORDS


def test_noise_and_many_objectives():
    values = stored()

    def both(question, algorithm, *cases, budget=10_000):
        return " and ".join(f"{values[question, case, budget, algorithm]:.3f}" for case in cases)

    noise, objectives = ("0.05", "0.2"), ("4", "6")
    few, some = (partial(both, NOISE, budget=budget) for budget in (500, 2_000))
    assert f"{few('CompactSwarm', *noise)} (NSGA-II {few('NSGA-II', *noise)})" in WORDS
    beside = f"(`CompactSwarm` {some('CompactSwarm', *noise)}), with `reevaluated={SHARE}` "
    swarm = "ElitistSwarm"
    assert f"{some(swarm, *noise)} {beside}{some(swarm + AGAIN, *noise)}" in WORDS
    swarms = [both(NOISE, name + AGAIN, *noise) for name in ("ElitistSwarm", "CompactSwarm")]
    assert f"{swarms[0]} (`CompactSwarm(reevaluated={SHARE})` {swarms[1]}, NSGA-II " in WORDS
    assert f"NSGA-II {both(NOISE, 'NSGA-II', *noise)})" in WORDS
    assert f"{both(OBJECTIVES, 'NSGA-III', *objectives)} (`CompactSwarm` " in WORDS
    assert f"`CompactSwarm` {both(OBJECTIVES, 'CompactSwarm', *objectives)})" in WORDS


def test_rivals_sized_to_the_budget():
    values = stored()

    def rank(measure, budget, algorithm):
        return f"{values[SIZES, measure, budget, algorithm]:.2f}"

    for measure in ("hypervolume", "igd_plus"):
        sentence = " and ".join(
            f"{rank(measure, n, 'SMS-EMOA' + SIZED)} against {rank(measure, n, 'CompactSwarm')}"
            + (" after 500 evaluations" if measure == "hypervolume" and n == 500 else "")
            for n in (500, 2_000)
        )
        assert sentence in WORDS


def test_rivals_of_both_sizes_on_a_suite_run_once(outcome):
    for measure, name in (("hypervolume", "by hypervolume"), ("igd_plus", "by IGD+")):
        ranks = [suite_ranks(outcome, BOTH_SIZES, n, measure) for n in BUDGETS]
        assert {len(of_all) for of_all in ranks} == {8}
        ours = ", ".join(f"{of_all['CompactSwarm']:.2f}" for of_all in ranks)
        assert f"{name} {ours}" in WORDS
        assert all(min(of_all, key=of_all.get) == "CompactSwarm" for of_all in ranks)
        against = [test for n in BUDGETS for test in suite_tests(outcome, BOTH_SIZES, n, measure)]
        assert all(test.beaten for test in against)
    problems = outcome.problems(BOTH_SIZES, 500)
    assert f"{len(problems)} problems, two runs each, one from 10,000 on" in WORDS
    for name in outcome.algorithms(BOTH_SIZES, 500):
        runs = [len(outcome.runs(problems[0], name, n, 0)) for n in BUDGETS]
        assert runs == [2, 2, 1, 1]


def test_tables_hold_all_that_is_stored():
    tables = list(limits_tables())
    assert sum(len(table.rows) * (len(table.columns) - 1) for table in tables) == len(stored())


@pytest.mark.skipif(
    matplotlib.__version_info__ < (3, 11), reason="matplotlib lays it out otherwise before 3.11"
)
def test_the_picture_of_how_to_choose_is_drawn_by_its_script(tmp_path):
    pictures = drawn_and_stored(DOCS / "which_algorithm_picture.py", tmp_path)
    drawn, kept = (np.asarray(picture, float) for picture in pictures)
    assert np.mean(np.abs(drawn - kept)) < 0.5
