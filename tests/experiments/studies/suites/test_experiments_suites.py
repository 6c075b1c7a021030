"""Outcome on disk, demands judged, duels, published curves, and the report of what is stored."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from experiments.runner.registry import Context
from experiments.studies.suites import experiment
from experiments.studies.suites.bbob_tables import BEST, CITED, curves, duels, reached
from experiments.studies.suites.coco import MARKS
from experiments.studies.suites.data import (
    Outcome,
    bbob_text,
    outcome_for,
    read_outcome,
    suites_text,
)
from experiments.studies.suites.demands import demands, in_one_sentence
from experiments.studies.suites.experiment import SUITE_RUNS, anew_table
from experiments.studies.suites.jobs import BbobRun
from experiments.studies.suites.parts import part_tests, parts_table
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.problems import SUITES
from experiments.studies.suites.protocol import BESIDE_BEST, BESIDE_PEERS, DIMENSIONS, OF_PARTS
from experiments.studies.suites.reduced import WHOLE
from experiments.studies.suites.suite_tables import (
    feasible_beside,
    feasible_runs,
    ranks,
    ranks_together,
    signs_together,
)
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import MISSED, NOT_SHOWN, SHOWN

RIVALS = ("NSGA-II", "SMS-EMOA", "C-TAEA")


def planted(gain):
    """Return an outcome in which ours is better than every rival by a gain, everywhere."""
    outcome, rng = Outcome(), np.random.default_rng(1)
    for suite, seed in product(SUITES, (1, 2)):
        for one, name in product(SUITES[suite], (OURS, *RIVALS)):
            value = 0.5 + 0.1 * rng.random() + gain * (name == OURS)
            solutions = 100.0 if gain > 0 or name != OURS else 0.0
            row = (10_000.0, round(value, 4), round(1.0 - value, 4), solutions)
            outcome.suites[one.name, name, 10_000, seed] = row
    for dimension, function, name in product((10, 20), range(1, 56), (OURS, "NSGA-II")):
        share = 0.35 + 0.01 * rng.random() + gain * (name == OURS)
        run = BbobRun(function, dimension, BESIDE_PEERS, name, 25_000)
        outcome.bbob[run] = {mark: round(share, 4) for mark in MARKS if mark <= 25_000}
        if name == OURS:
            outcome.bbob[replace(run, instance=BESIDE_BEST)] = outcome.bbob[run]
    return outcome


def test_an_outcome_comes_back_from_its_files(tmp_path):
    outcome = planted(0.2)
    for name, text in (("a", suites_text(outcome)), ("b", bbob_text(outcome))):
        (tmp_path / name).write_text(text)
    assert read_outcome(tmp_path / "a", tmp_path / "b") == outcome


def test_demands_are_shown_by_one_who_leads_and_missed_by_one_who_trails():
    leading = {demand.asked: demand.state for demand in demands(planted(0.2))}
    trailing = {demand.asked: demand.state for demand in demands(planted(-0.2))}
    shares = [asked for asked in leading if "share of targets" in asked]
    assert len(shares) == len(DIMENSIONS) + 1
    for asked in [*shares, "RE: no worse than SMS-EMOA, hypervolume", "MW: first by hypervolume"]:
        assert leading[asked] == SHOWN
        assert trailing[asked] == MISSED
    states = [d.state for d in demands(planted(0.2)) if d.asked.startswith("ZCAT") and d.state]
    assert states == [SHOWN] * 4
    feasible = next(asked for asked in leading if "feasible in as many" in asked)
    # Where both are feasible in all runs, none of these says who is more often.
    assert (leading[feasible], trailing[feasible]) == (NOT_SHOWN, MISSED)


def test_a_slight_lead_that_may_be_chance_is_not_shown():
    few = planted(0.2)
    for one in SUITES["RE"][4:]:
        for name, seed in product((OURS, *RIVALS), (1, 2)):
            del few.suites[one.name, name, 10_000, seed]
    asked = "RE: no worse than SMS-EMOA, hypervolume"
    (found,) = [one for one in demands(few) if one.asked == asked and one.state]
    # Four problems that all agree come about once in sixteen times without any difference.
    assert found.measured.startswith("4 better, 0 worse")
    assert found.state == NOT_SHOWN


def test_a_first_place_that_is_shared_is_told_and_not_met():
    outcome = planted(0.2)
    for key in [*outcome.suites]:
        if key[1] == "NSGA-II":
            outcome.suites[key] = outcome.suites[key[0], OURS, *key[2:]]
    asked = "MW: first by hypervolume"
    (found,) = [one for one in demands(outcome) if one.asked == asked]
    assert (found.state, found.measured) == (MISSED, "place 1 of 4, shared, rank 1.50")
    assert "is 1 (shared) by hypervolume and 1 (shared) by IGD+" in in_one_sentence(outcome)


def test_what_did_not_run_is_neither_met_nor_missed():
    assert {demand.state for demand in demands(Outcome())} == {None}
    assert in_one_sentence(Outcome()) == "Nothing was run."


def test_what_falls_short_comes_first():
    said = in_one_sentence(planted(-0.2))
    assert said.startswith(f"On the held-out bbob-biobj {OURS} falls short")
    assert "in 0 of 8 cases" in in_one_sentence(planted(0.2))


def test_duels_compare_the_same_problems():
    outcome = planted(0.2)
    del outcome.bbob[BbobRun(7, 10, BESIDE_PEERS, "NSGA-II", 25_000)]
    (duel,) = duels(outcome, 10_000)
    assert (duel.rival, duel.problems, duel.test.better, duel.test.worse) == (
        "NSGA-II",
        109,
        109,
        0,
    )
    assert duel.ours - duel.theirs == pytest.approx(0.2, abs=0.01)
    assert duel.test.beaten
    assert not duels(planted(-0.2), 10_000)[0].test.ahead


def test_ranks_and_feasible_runs():
    outcome = planted(0.2)
    found = ranks(outcome, "IMOP", 10_000, "igd_plus")
    assert found[OURS] == 1.0
    assert np.sum(list(found.values())) == pytest.approx(10.0)
    assert feasible_runs(planted(-0.2), "MW", 10_000, OURS) == (0, 28)


def test_published_curves_are_those_that_are_cited(tmp_path):
    for (dimension, evaluations), share in CITED.items():
        assert curves(dimension, tmp_path / "none")[BEST][evaluations] == share
        # Beside the repository lie the whole curves, on some machines.
        assert curves(dimension)[BEST][evaluations] == share


def test_published_curves_are_read(tmp_path):
    (tmp_path / "a.csv").write_text(
        "algorithm,dimension,year,share_at_100,share_at_25000\n"
        "HMO-CMA-ES Loshc,10,2016,0.1,0.4\n"
        "SMS-EMOA-PM Auge,10,2016,0.0,0.2\n"
        "SMS-EMOA-,10,2017,0.1,\n"
        "best 2016,20,2016,0.1,0.2\n"
    )
    assert curves(10, tmp_path / "a.csv") == {
        "HMO-CMA-ES": {100: 0.1, 25_000: 0.4},
        "SMS-EMOA-SA": {100: 0.1},
    }


def test_a_rival_with_more_seeds_is_compared_on_those_of_ours():
    outcome = planted(0.2)
    before = outcome.medians("MW", 10_000, "hypervolume", RIVALS)
    for one in SUITES["MW"]:
        outcome.suites[one.name, "NSGA-II", 10_000, 3] = 10_000.0, 9.0, 0.0, 100.0
        outcome.suites[one.name, "NSGA-II", 25_000, 3] = 25_000.0, 9.0, 0.0, 100.0
    np.testing.assert_array_equal(outcome.medians("MW", 10_000, "hypervolume", RIVALS), before)
    assert feasible_beside(outcome, "MW", 10_000, "NSGA-II") == (28, 28, 0, 28)
    # Nobody is compared where ours was not run.
    assert outcome.budgets("MW") == [10_000]
    assert outcome.seeds("MW") == 2


def test_ours_is_counted_on_the_seeds_of_a_rival_that_has_fewer():
    outcome = planted(-0.2)
    for one in SUITES["MW"]:
        del outcome.suites[one.name, "C-TAEA", 10_000, 2]
    assert feasible_beside(outcome, "MW", 10_000, "C-TAEA") == (0, 14, 0, 14)


def test_a_rival_that_was_not_run_is_neither_beaten_nor_not():
    outcome = planted(0.2).without(["SMS-EMOA", "C-TAEA"])
    found = {demand.asked: demand.state for demand in demands(outcome)}
    assert found["RE: no worse than SMS-EMOA, hypervolume"] is None
    assert found["MW: feasible in as many runs as C-TAEA"] is None
    assert found["MW: feasible in as many runs as NSGA-II"] == NOT_SHOWN
    alone = {demand.asked: demand.state for demand in demands(outcome.without(["NSGA-II"]))}
    assert alone["MW: first by hypervolume"] is None


def test_all_held_out_suites_together():
    outcome = planted(0.2)
    assert ranks_together(outcome, 10_000) == {OURS: 1.0, "NSGA-II": 2.0}
    (test,) = signs_together(outcome, 10_000)
    assert (test.better, test.worse, test.beaten) == (150, 0, True)
    (test,) = signs_together(planted(-0.2), 10_000)
    assert (test.better, test.worse, test.beaten) == (0, 150, False)
    # ZCAT was not run there.
    assert signs_together(outcome, 500) == []
    # One that lacks a problem of either suite is not ranked over the others.
    del outcome.bbob[BbobRun(7, 10, BESIDE_PEERS, "NSGA-II", 25_000)]
    assert ranks_together(outcome, 10_000) == {}


def test_one_that_was_not_run_on_a_problem_is_not_ranked_last_there():
    outcome = planted(0.2)
    for seed in (1, 2):
        del outcome.suites["IMOP3", "NSGA-II", 10_000, seed]
    assert "NSGA-II" not in ranks(outcome, "IMOP", 10_000, "hypervolume")


def test_parts_that_help_are_told_from_those_that_do_not(rng):
    outcome = Outcome()
    for dimension, function in product((10, 20), range(1, 56)):
        whole = dict.fromkeys((500, 2000, 10_000), rng.random())
        less = {mark: share - 0.1 * (mark == 500) for mark, share in whole.items()}
        other = {mark: share + 0.1 * rng.standard_normal() for mark, share in whole.items()}
        for name, shares in (
            (WHOLE, whole),
            ("without ModelStep", less),
            ("without mutation", other),
        ):
            outcome.bbob[BbobRun(function, dimension, OF_PARTS, name, 10_000)] = shares
    # Whether ours ran there does not matter.
    for one, name in product(SUITES["MW"], (WHOLE, "without guests")):
        outcome.suites[one.name, name, 10_000, 1] = 10_000.0, 0.5 + 0.1 * (name == WHOLE), 0.1, 9.0
    helps = {(one.part, one.evaluations): one.helps for one in part_tests(outcome)}
    assert helps == {
        **{("without ModelStep", n): n == 500 for n in (500, 2000, 10_000)},
        **{("without mutation", n): False for n in (500, 2000, 10_000)},
        ("without guests", 10_000): True,
    }
    assert len(parts_table(outcome).rows) == len(helps)


@pytest.mark.nightly
def test_the_stored_outcome_gives_the_report_and_repeats(tmp_path):
    result = experiment.run(Context(1, tmp_path, Campaign(tmp_path)))
    assert result.answer
    anew = result.tables[-1]
    assert {row[0] for row in anew.rows} >= {run.problem for run in SUITE_RUNS}
    for *_, stored, now in anew.rows:
        # Another processor may round otherwise, which a search amplifies.
        assert now == pytest.approx(stored, abs=0.1)


def test_two_zeros_beside_each_other_check_nothing(tmp_path, monkeypatch):
    # On ZCAT1 with three objectives so short a run reaches no hypervolume, stored and anew.
    run = next(one for one in SUITE_RUNS if one.problem == "ZCAT1_3")
    monkeypatch.setattr(experiment, "SUITE_RUNS", (run,))
    monkeypatch.setattr(experiment, "find_spec", lambda _: None)
    outcome = outcome_for(Context(1, None, None))
    place = run.problem, run.algorithm, *run.budgets, run.seed
    spent, hypervolume, distance, solutions = outcome.suites[place]
    assert hypervolume == 0.0
    table = anew_table(Campaign(tmp_path), outcome)
    assert all(stored or now for *_, stored, now in table.rows)
    assert [one.agrees for one in table.findings] == [True]
    outcome.suites[place] = spent, hypervolume, 1.01 * distance, solutions
    (finding,) = anew_table(Campaign(tmp_path), outcome).findings
    assert finding.verdict == "Fails"
    # Without anything to compare, nothing is found.
    assert not anew_table(Campaign(tmp_path), Outcome()).findings


def test_shares_of_the_stored_outcome_are_of_all_functions():
    outcome = outcome_for(Context(1, None, None))
    problems = set(product(range(1, 56), (BESIDE_PEERS, BESIDE_BEST)))
    for dimension in (10, 20):
        place = dimension, OURS, 25_000
        ran = [run for run in outcome.bbob if (run.dimension, run.algorithm, run.told) == place]
        assert {(run.function, run.instance) for run in ran} >= problems
        assert 0.0 < reached(outcome, dimension, 10_000) < 1.0
