"""Runs of some algorithms, and the stored outcome gathered from them and from what was there."""

import pytest

from experiments.studies.suites import gather, only
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.protocol import BbobPart, SuitePart
from pymoo_hdte.checks import InvalidInput

PART = SuitePart("IMOP", (OURS, "random search", "NSGA-II"), (100, 200), seeds=2)
ROW = (200.0, 0.5, 0.1, 10.0)


@pytest.fixture
def protocol(monkeypatch):
    """A small protocol in place of the stored one."""
    for module in (gather, only):
        monkeypatch.setattr(module, "STORED", (PART, BbobPart(OURS, (500, 2000), (6,))))


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
def test_only_whole_groups_are_gathered(tmp_path):
    _, second = gather.STORED
    whole, lacking, *_ = second.groups()
    for job in [*whole, *lacking[1:]]:
        (tmp_path / f"{job.key}.csv").write_text("evaluations,share\n100,0.5\n")
    assert set(gather.gathered([tmp_path], Outcome()).bbob) == set(whole)


@pytest.mark.usefixtures("protocol")
def test_what_is_stored_is_completed_and_kept(tmp_path):
    ours, *_, rival, other = PART.groups()
    before = outcome_of([*ours, *rival, *other[1:]])
    before.suites["IMOP1", "NSGA-II", 77, 1] = ROW
    job = other[0]
    text = "evaluations,spent,hypervolume,igd_plus,solutions\n100,100,0.6,,4\n200,200,0.7,,4\n"
    (tmp_path / f"{job.key}.csv").write_text(text)
    found = gather.gathered([tmp_path / "none", tmp_path], before)
    # What is of no part of the protocol is left out, the group that lacked one run is whole.
    assert all(map(found.has, [*ours, *rival, *other]))
    assert len(found.suites) == 8 * (1 + 2 + 2)
    assert found.suites[job.problem, job.algorithm, 200, job.seed][1] == 0.7
    anew = gather.gathered([tmp_path], before.without([OURS]))
    assert not any(map(anew.has, ours))
    assert all(map(anew.has, rival))


@pytest.mark.usefixtures("protocol")
def test_runs_from_before_and_after_a_change_are_not_mixed(tmp_path):
    ours, *_ = PART.groups()
    before, job = outcome_of(ours), ours[3]
    text = f"evaluations,spent,hypervolume,igd_plus,solutions\n{job.budgets[0]},200,{{}},0.1,10\n"
    (tmp_path / f"{job.key}.csv").write_text(text.format(0.5))
    assert gather.gathered([tmp_path], before).suites == before.suites
    (tmp_path / f"{job.key}.csv").write_text(text.format(0.6))
    with pytest.raises(InvalidInput, match=f"--anew {OURS}"):
        gather.gathered([tmp_path], before)
    assert not gather.gathered([tmp_path], before.without([OURS])).suites


@pytest.mark.usefixtures("protocol")
def test_some_algorithms_are_run_and_what_is_stored_is_passed_over(tmp_path, monkeypatch):
    stored, *_ = [one for one in PART.groups() if one[0].algorithm == "random search"]
    monkeypatch.setattr(only, "stored", lambda: outcome_of(stored))
    assert {one[0].algorithm for one in only.groups_of(["random search"])} == {"random search"}
    only.main([str(tmp_path), "random search", "--missing"])
    (folder,) = (tmp_path / "runs").iterdir()
    found = gather.gathered([folder], Outcome())
    seeds = {key[3] for key in found.suites}
    assert seeds == {1, 2} - {stored[0].seed}
    assert {key[2] for key in found.suites} == {100, 200}


def test_a_name_of_nobody_is_refused():
    with pytest.raises(InvalidInput, match="'NSGA-IV'"):
        [*only.groups_of(["NSGA-IV"])]
