"""Numbers of the pages about blind campaigns."""

import re

import pytest
from places import DOCS, ROOT

from experiments.runner.committed import DATA
from experiments.studies.blind.experiment import found
from experiments.studies.blind.runs import RUNS, read_runs, recent, total
from experiments.studies.blind.targets import pooled_demands

PAGE = (DOCS / "model_and_measurements.md").read_text(encoding="utf-8")
POOLED = total(recent(read_runs(DATA / RUNS)))


def test_paper_says_what_came_of_the_blind_campaigns():
    words = found(POOLED, intervals=False)
    paper = (ROOT / "paper.md").read_text(encoding="utf-8")
    assert f"{words[0].upper()}{words[1:]}." in " ".join(paper.split())


def test_goals_and_states_are_those_of_the_pooled_runs():
    rows = re.findall(
        r"^\| (.+) \| (\d+) of (\d+) \| ([\d.]+) to ([\d.]+) % \| (.+) \|$", PAGE, re.MULTILINE
    )
    judged = list(pooled_demands(POOLED))
    assert len(rows) == len(judged)
    for (goal, hits, n, *ends, state), one in zip(rows, judged, strict=True):
        assert f"{100.0 * one.required:g} %" in goal
        assert int(n) == one.measured.n
        assert int(hits) / int(n) == pytest.approx(one.measured.value)
        measured = [100.0 * one.measured.low, 100.0 * one.measured.high]
        assert [float(end) for end in ends] == pytest.approx(measured, abs=0.06)
        assert state == one.verdict.lower()
