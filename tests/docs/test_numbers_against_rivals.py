"""Numbers of README and its pages about rivals, of the swarm and of the robust surrogate."""

import re

import numpy as np
import pytest
from places import PAGES, WORDS

from experiments.comparing.indicators import NAMES
from experiments.runner.campaign import Campaign
from experiments.runner.registry import Context
from experiments.studies.contest import swarm_parts
from experiments.studies.contest.peers_data import committed_scores
from experiments.studies.contest.peers_tables import (
    FAITHFUL,
    median_ranks,
    must_reach_table,
    nearest_rival_table,
    subsets_table,
)
from experiments.studies.robust.data import METHODS, OPENTURNS, OURS, ahead, outcome_for
from experiments.studies.robust.functions import FUNCTIONS


def test_runs_of_robust_surrogates_are_those_of_the_stored_outcome(tmp_path):
    outcome = outcome_for(Context(1, tmp_path, Campaign(tmp_path)))
    names = outcome.functions()
    fewer = [name for name in names if ahead(outcome, name)]
    kept_out = [one.name for one in FUNCTIONS if not one.tuned]
    assert f"on {len(fewer)} of {len(names)} functions, most of the literature" in WORDS
    assert f"({len({*fewer} & {*kept_out})} of the {len(kept_out)} kept out of" in WORDS
    assert {*names} - {*fewer} == {"kink", "robot arm"}
    rival, ours = (outcome.needed("kink", method) for method in (OPENTURNS, OURS))
    assert f"on a kink OpenTURNS takes {rival} and ours {ours}" in WORDS
    assert all(outcome.needed("robot arm", method) is None for method in METHODS)
    answered = [one for one in outcome.stops.values() if np.isfinite(one["runs"])]
    covered = [min(one["covered_mean"], one["covered_std"]) for one in answered]
    held = sum(share >= 0.95 for share in covered)
    assert f"covers 95 % of 200 designs in {held} of {len(covered)} surrogate builds" in WORDS
    assert f"({100.0 * min(covered):g} % in one of the kink)" in WORDS
    refused = {name for (name, _), one in outcome.stops.items() if not np.isfinite(one["runs"])}
    assert len(refused) == 3
    assert "three of the ten functions are refused after 1000 runs" in WORDS


class TestNumbersOfThePeers:
    @pytest.fixture(scope="class")
    @classmethod
    def scores(cls):
        return committed_scores("peers")

    def test_average_ranks(self, scores):
        head = next(line for line in PAGES.splitlines() if line.startswith("| | IGD "))
        names = {shown: measure for measure, shown in NAMES.items()}
        measures = [names[cell.strip()] for cell in head.split("|")[2:-1]]
        table = PAGES[PAGES.index(head) :].split("\n\n")[0].splitlines()[2:]
        assert len(table) == 5
        budgets = scores.budgets
        ranks = [
            [median_ranks(scores, measure, n, tuning=False) for n in budgets]
            for measure in measures
        ]
        for line in table:
            name, *cells = (cell.strip(" `") for cell in line.split("|")[1:-1])
            place = scores.algorithms.index(name)
            for cell, of_measure in zip(cells, ranks, strict=True):
                assert cell == ", ".join(f"{rank[place]:.2f}" for rank in of_measure)

    def test_where_ours_has_the_best_rank(self, scores):
        assert "it has the best average rank by IGD on 25 problems" in WORDS
        assert "but not by hypervolume and IGD+ after 25,000 evaluations" in WORDS
        others = set(scores.algorithms) - {"ElitistSwarm", "AMP-MOPSO", "random search"}
        assert (len(scores.algorithms), len(others)) == (12, 9)
        place = scores.algorithms.index("ElitistSwarm")
        first = {
            (measure, n): median_ranks(scores, measure, n, tuning=False).argmin() == place
            for measure in ("igd", "igd_plus", "hypervolume")
            for n in (10_000, 25_000)
        }
        assert {case for case, best in first.items() if not best} == {
            ("igd_plus", 25_000),
            ("hypervolume", 25_000),
        }

    def test_what_is_beaten_and_what_is_not(self, scores):
        rows = {(row[0], row[1]): row for row in must_reach_table(scores).rows}
        beaten = "better than every peer beyond chance, "
        for case in [("IGD", 10_000), ("IGD", 25_000), ("hypervolume", 10_000)]:
            assert rows[beaten + case[0], case[1]][-1] == "shown"
        missed = rows[beaten + "hypervolume", 25_000][3]
        assert missed == "not: SMS-EMOA (p = 0.11, 15:9)"
        assert (
            "larger hypervolume on 15, the smaller on 9, which is within chance (p = 0.11)" in WORDS
        )
        faithful = f"never worse than {FAITHFUL} beyond the noise"
        worse = rows[faithful, 10_000][2]
        assert re.findall(r"ZDT\d", worse) == ["ZDT2", "ZDT1", "ZDT2"]
        assert max(map(float, re.findall(r"([\d.]+) %", worse))) < 2.0
        assert rows[faithful, 25_000][-1] == "not shown"

    def test_where_the_best_rival_is_ahead(self, scores):
        rows = nearest_rival_table(scores).rows
        assert rows[0][0] == "WFG9"
        robust = [(gain, rival) for name, _, rival, gain, *_ in rows if "RobustDTE" in name]
        assert len(robust) == 4
        assert all(-0.0055 * rival < gain < 0.0 for gain, rival in robust)

    def test_ranks_without_wfg(self, scores):
        rows = [row for row in subsets_table(scores).rows if row[0] == "without WFG"]
        assert all(row[3] < row[5] for row in rows)
        assert [row[8] for row in rows] == ["SMS-EMOA", "SMS-EMOA"]
        assert f"SMS-EMOA leads with {rows[-1][9]:.2f} against {rows[-1][7]:.2f}" in WORDS

    def test_parts_that_are_shown_to_help(self, tmp_path):
        answer = swarm_parts.run(Context(20, tmp_path, Campaign(tmp_path))).answer
        shown = answer.rpartition(": ")[2]
        assert shown == "without exchange, equal shares of moves, with constant inertia."
        assert "the exchange of components and the shares by success are shown to help" in WORDS
