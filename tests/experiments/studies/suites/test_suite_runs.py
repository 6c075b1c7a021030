"""The stored outcome with some algorithms run anew beside what was there."""

import pytest

from experiments.studies.suites import renew
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.protocol import BbobPart, SuitePart
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.checks import InvalidInput

PART = SuitePart("IMOP", (OURS, "random search", "NSGA-II"), (100, 200), seeds=2)
ROW = (200.0, 0.5, 0.1, 10.0)


@pytest.fixture
def protocol(monkeypatch):
    """A small protocol in place of the stored one."""
    monkeypatch.setattr(renew, "STORED", (PART, BbobPart(OURS, (500, 2000), (6,))))


def outcome_of(jobs):
    outcome = Outcome()
    for job in jobs:
        for budget in job.budgets:
            outcome.suites[job.problem, job.algorithm, budget, job.seed] = ROW
    return outcome


def test_a_group_is_of_one_algorithm_and_seed_on_all_problems():
    groups = [*PART.groups()]
    assert all(len({(job.algorithm, job.seed, job.budgets) for job in one}) == 1 for one in groups)
    assert [len({job.problem for job in one}) for one in groups] == [8] * len(groups)
    # Ours starts anew for each budget, which is a group of its own.
    assert len(groups) == 2 * (2 + 1 + 1)
    assert len({job.key for job in PART.jobs()}) == 8 * len(groups)


def test_one_that_cannot_take_a_problem_has_a_smaller_group():
    (group,) = SuitePart("IMOP", ("COMO-CMA-ES",), (500,), seeds=1).groups()
    assert [job.problem for job in group] == ["IMOP1", "IMOP2", "IMOP3"]


@pytest.mark.usefixtures("protocol")
def test_some_algorithms_are_run_anew_and_whole_groups_of_the_others_are_kept(tmp_path):
    ours, _, _, whole, *_, lacking = PART.groups()
    before = outcome_of([*ours, *whole, *lacking[1:]])
    before.suites["IMOP1", "NSGA-II", 77, 1] = ROW
    found = renew.renewed(Campaign(tmp_path), ["random search"], before)
    assert all(map(found.has, [*ours, *whole]))
    anew = {key: row for key, row in found.suites.items() if key[1] == "random search"}
    assert {(key[2], key[3]) for key in anew} == {(100, 1), (200, 1), (100, 2), (200, 2)}
    assert all(row[0] == key[2] for key, row in anew.items())
    # What is of no part of the protocol is left out, and so is the group that lacks a run.
    assert len(found.suites) == len(anew) + 8 * (1 + 2)


def test_a_name_of_nobody_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="'NSGA-IV'"):
        renew.renewed(Campaign(tmp_path), ["NSGA-IV"], Outcome())
