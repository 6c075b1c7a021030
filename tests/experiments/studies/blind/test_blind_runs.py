"""The list of all blind runs, which the pooled figures of the pages come from."""

from itertools import pairwise

import pytest

from experiments.runner.committed import DATA
from experiments.studies.blind.cases import all_cases
from experiments.studies.blind.data import read_outcomes
from experiments.studies.blind.experiment import OUTCOMES, SECONDS
from experiments.studies.blind.runs import (
    RUNS,
    SINCE,
    format_runs,
    read_runs,
    recent,
    run_of,
    total,
)

ALL = read_runs(DATA / RUNS)


def test_the_last_run_is_that_of_the_stored_outcome():
    outcomes = read_outcomes(DATA / OUTCOMES, DATA / SECONDS)
    first = all_cases().index(outcomes[0].case) + 1
    assert ALL[-1] == run_of(outcomes, first, ALL[-1].code)


def test_each_run_starts_where_the_one_before_it_ended():
    assert ALL[0].first == 1
    assert all(later.first == earlier.last + 1 for earlier, later in pairwise(ALL))


@pytest.mark.parametrize("run", ALL, ids=lambda run: str(run.first))
def test_no_more_came_out_than_was_run(run):
    counts = vars(run.counts)
    names = list(counts)
    assert all(counts[part] <= counts[of] for of, part in zip(names[::2], names[1::2], strict=True))
    hidden = sum(counts[name] for name in ("single", "pair", "triple", "clean"))
    assert hidden <= run.last - run.first + 1


def test_runs_are_read_as_they_are_written(tmp_path):
    (tmp_path / RUNS).write_text(format_runs(ALL))
    assert read_runs(tmp_path / RUNS) == ALL


def test_counts_of_runs_add_up():
    counts = vars(total(ALL))
    assert all(counts[name] == sum(vars(one.counts)[name] for one in ALL) for name in counts)


def test_figures_are_pooled_from_the_runs_of_about_this_code():
    pooled = recent(ALL)
    assert pooled[0].first == SINCE
    assert pooled[-1] is ALL[-1]
    assert recent(ALL[:3]) == [ALL[2]]
