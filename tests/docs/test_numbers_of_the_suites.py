"""Numbers of README and its pages about suites of test problems."""

from itertools import product

import matplotlib
import numpy as np
import pytest
from PIL import Image
from places import PAGES, ROOT, WORDS

from experiments.runner.campaign import Campaign
from experiments.runner.registry import Context
from experiments.runner.result import MISSED
from experiments.studies.suites import data as suites
from experiments.studies.suites.bbob_tables import CITED, reached
from experiments.studies.suites.demands import demands
from experiments.studies.suites.own_time import own_time_table
from experiments.studies.suites.parts import part_tests
from experiments.studies.suites.protocol import BUDGETS
from experiments.studies.suites.suite_tables import (
    feasible_runs,
    in_short,
    ranks_together,
    signs_together,
)
from experiments.studies.suites.suite_tables import ranks as suite_ranks
from experiments.studies.suites.suite_tables import tests as rival_tests


def place_of_ours(ranks):
    others = [rank for name, rank in ranks.items() if name != "CompactSwarm"]
    place = 1 + sum(rank < ranks["CompactSwarm"] for rank in others)
    return f"{place} (shared)" if ranks["CompactSwarm"] in others else str(place)


class TestNumbersOfTheSuites:
    @pytest.fixture(scope="class")
    @classmethod
    def outcome(cls, tmp_path_factory):
        folder = tmp_path_factory.mktemp("suites")
        return suites.outcome_for(Context(1, folder, Campaign(folder)))

    def test_the_held_out_table_is_that_of_the_stored_outcome(self, outcome):
        for row in in_short(outcome).rows:
            line = " | ".join("—" if cell is None else str(cell) for cell in row)
            assert f"| {line} |" in PAGES
        for place, cited in CITED.items():
            ahead = reached(outcome, *place) - cited
            assert -0.02 < ahead < 0.0 if place[1] >= 25_000 else -0.01 < ahead < 0.03
        said = "is about level with the best published on COCO's bbob-biobj to 10,000 evaluations"
        assert f"{said}, and below it after 25,000" in WORDS
        states = {d.state for d in demands(outcome) if "share of targets" in d.asked}
        assert states == {MISSED}

    def test_the_two_swarms_side_by_side(self, outcome):
        assert "best average rank of five by hypervolume and by IGD+ after 500 and 2,000" in WORDS
        for budget in BUDGETS:
            volume, distance = (
                suite_ranks(outcome, "ZCAT", budget, measure)
                for measure in ("hypervolume", "igd_plus")
            )
            if budget <= 2000:
                first = min(volume, key=volume.get), min(distance, key=distance.get)
                assert first == ("CompactSwarm", "CompactSwarm")
            else:
                assert abs(volume["CompactSwarm"] - volume["ElitistSwarm"]) < 0.1
                assert distance["CompactSwarm"] > distance["ElitistSwarm"]
        assert "`ElitistSwarm` is about level with it by hypervolume and ahead by IGD+" in WORDS
        assert "while on bbob-biobj, RE and IMOP `CompactSwarm` stays ahead of it" in WORDS
        for budget, suite in product((10_000, 25_000), ("RE", "IMOP")):
            found = suite_ranks(outcome, suite, budget, "hypervolume")
            assert found["CompactSwarm"] < found["ElitistSwarm"]
        for budget, dimension in product((10_000, 25_000), (10, 20)):
            theirs = outcome.shares(dimension, "ElitistSwarm", 25_000)[budget]
            assert reached(outcome, dimension, budget) > theirs

    def test_places_on_the_suite_that_nothing_had_been_run_on(self, outcome):
        for measure, name in (("hypervolume", "hypervolume"), ("igd_plus", "IGD+")):
            found = [suite_ranks(outcome, "ZCAT", budget, measure) for budget in BUDGETS]
            places = " | ".join(map(place_of_ours, found))
            assert f"| place by {name} | {places} |" in PAGES
            tested = [rival_tests(outcome, "ZCAT", budget, measure) for budget in BUDGETS]
            beaten = " | ".join(str(sum(one.beaten for one in tests)) for tests in tested)
            assert f"| others beaten beyond chance by {name} | {beaten} |" in PAGES
        none = " | ".join(
            str(int(np.sum(~np.any(volumes, axis=1))))
            for volumes in (
                outcome.medians("ZCAT", n, "hypervolume", outcome.algorithms("ZCAT", n))
                for n in BUDGETS
            )
        )
        assert f"finds any hypervolume, so that all are equal | {none} |" in PAGES

    def test_ranks_on_the_suite_that_showed_what_truncation_lacked(self, outcome):
        ours, distance = (
            ", ".join(
                f"{suite_ranks(outcome, 'IMOP', budget, measure)['CompactSwarm']:.2f}"
                for budget in BUDGETS
            )
            for measure in ("hypervolume", "igd_plus")
        )
        assert f"among up to 16 is {ours} by hypervolume and {distance} by IGD+" in WORDS

    def test_the_two_qualities(self, outcome):
        names = ["CompactSwarm", "with quality=spread"]
        medians = [
            outcome.medians("IMOP", budget, "hypervolume", names)
            for budget in (500, 2000, 10_000, 25_000)
        ]
        first, *rest = (int(np.sum(one[:, 0] > one[:, 1])) for one in medians)
        said = "on {} after 2,000, on {} after 10,000 and on {} after 25,000"
        assert f"on {first} of the eight problems after 500 evaluations" in WORDS
        assert said.format(*rest) in WORDS

    def test_all_held_out_suites_together(self, outcome):
        found = [ranks_together(outcome, budget) for budget in (500, 2000, 10_000, 25_000)]
        ours, theirs = (
            ", ".join(f"{one[name]:.2f}" for one in found)
            for name in ("CompactSwarm", "ElitistSwarm")
        )
        assert f"after the four budgets are {ours} (`ElitistSwarm` {theirs})" in WORDS
        assert all(
            test.beaten for n in (500, 2000, 10_000, 25_000) for test in signs_together(outcome, n)
        )

    def test_on_the_engineering_suite(self, outcome):
        found = {
            budget: next(
                one
                for one in rival_tests(outcome, "RE", budget, "hypervolume")
                if one.rival == "SMS-EMOA"
            )
            for budget in (500, 2000, 10_000, 25_000)
        }
        said = "; ".join(f"{one.better}-{one.worse} after {n:,}" for n, one in found.items())
        assert f"{said} (better-worse of 8 problems; none beyond chance but the first)" in WORDS
        assert [one.p < 0.05 for one in found.values()] == [True, False, False, False]

    def test_what_the_parts_are_shown_to_bring(self, outcome):
        found = {(one.part, one.where[:4], one.evaluations): one for one in part_tests(outcome)}
        assert {one.part for one in found.values() if one.helps} == {
            "without ModelStep",
            "with 50 particles",
            "without NeighbourDifference",
            "with one leader",
            "without mutation",
        }
        assert not found["with 50 particles", "bbob", 10_000].helps

    def test_own_time(self):
        rows = {(row[0], row[1]): row[3:] for row in own_time_table().rows}
        ours = [rows[name, "CompactSwarm"] for name in ("ZDT1", "DTLZ2")]
        assert (
            f"costs `CompactSwarm` {ours[0][1]:.2f} times NSGA-II's own time on ZDT1 and "
            f"{ours[1][1]:.2f} times on DTLZ2"
        ) in WORDS
        assert min(one[0] for one in ours) > 0.5

    @pytest.mark.parametrize("suite", ["MW", "DAS-CMOP"])
    def test_constraints(self, outcome, suite):
        found = suite_ranks(outcome, suite, 10_000, "hypervolume")
        feasible = {name: feasible_runs(outcome, suite, 10_000, name) for name in found}
        ours, runs = feasible["CompactSwarm"]
        assert (
            f"{suite}: feasible in {ours} of {runs} runs (NSGA-II {feasible['NSGA-II'][0]}, C-TAEA "
            f"{feasible['C-TAEA'][0]}) | average rank by hypervolume {found['CompactSwarm']:.2f} "
            f"(`ElitistSwarm` {found['ElitistSwarm']:.2f}, C-TAEA {found['C-TAEA']:.2f}, NSGA-II "
            f"{found['NSGA-II']:.2f})"
        ) in WORDS

    def test_what_was_not_run_is_told(self, outcome):
        assert "ZCAT, IMOP and LZ09 have 3 seeds, RE, MW and DAS-CMOP 5," in WORDS
        names = ("ZCAT", "IMOP", "LZ09", "RE", "MW", "DAS-CMOP")
        assert [outcome.seeds(name) for name in names] == [3, 3, 3, 5, 5, 5]

    @pytest.mark.skipif(
        matplotlib.__version_info__ < (3, 11), reason="matplotlib lays it out otherwise before 3.11"
    )
    def test_the_picture_of_how_to_choose_is_drawn_by_its_script(self, tmp_path):
        script = ROOT / "docs" / "which_algorithm_picture.py"
        scope = {"__file__": str(script), "__name__": "picture"}
        exec(compile(script.read_text(), str(script), "exec"), scope)
        scope["draw"](tmp_path / "drawn.png")
        drawn, stored = (
            np.asarray(Image.open(path), float)
            for path in (tmp_path / "drawn.png", scope["PICTURE"])
        )
        assert np.mean(np.abs(drawn - stored)) < 0.5
