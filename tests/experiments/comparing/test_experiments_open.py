"""Table 7 and the ablation with other problems, algorithms, seeds and budgets."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from experiments.command_line import main
from pymoo_hdte._comparing.named import OpenRun, algorithm_named, problem_named
from pymoo_hdte._comparing.paired import compare
from pymoo_hdte._comparing.quality import TrueFront
from pymoo_hdte._comparing.references import reference
from pymoo_hdte._comparing.runs import ALGORITHMS, OptimisationRun
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.provenance import fingerprint
from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.checks import InvalidInput

STRANGER = """
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.mutation.pm import PM


class MyAlgorithm(NSGA2):
    def __init__(self, **kwargs):
        super().__init__(mutation=PM(eta={eta}), **kwargs)


class MyProblem(Problem):
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.column_stack([np.sum(x**2, axis=1), np.sum((x - 1.0) ** 2, axis=1)])
        out["G"] = {limit} - x[:, :1]


def needs_more(size):
    return MyAlgorithm(pop_size=size)
"""
SMALL = ("--evaluations", "100", "--pop", "20")


def write_stranger(folder: Path, eta: float = 20.0, limit: float = 0.5) -> None:
    (folder / "my_module.py").write_text(STRANGER.format(eta=eta, limit=limit))


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    """A module of somebody else, importable as it is from the folder one works in."""
    write_stranger(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    problem_named.cache_clear()
    yield tmp_path
    sys.modules.pop("my_module", None)
    problem_named.cache_clear()


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def open_table(out: Path, *arguments: str, experiment: str = "table7") -> Path:
    assert main([experiment, *arguments, "--workers", "1", "--out", str(out)]) == 0
    return out / experiment


def test_a_stranger_s_algorithm_runs_in_one_command(stranger):
    found = open_table(
        stranger / "out",
        *("--seeds", "21-22", *SMALL, "--problems", "resonant,zdt1,my_module:MyProblem"),
        *("--algorithms", "my_module:MyAlgorithm,NSGA2"),
    )
    runs = rows_of(found / "runs.csv")
    assert len(runs) == 3 * 2 * 2
    assert {run["seed"] for run in runs} == {"21", "22"}
    assert {run["evaluations"] for run in runs} == {"100"}
    mine = "my_module:MyAlgorithm"
    assert {run["algorithm"] for run in runs} == {mine, "NSGA2"}
    assert f"A12: {mine} better" in rows_of(found / "tests.csv")[0]
    assert not any("paper" in name for name in rows_of(found / "quality.csv")[0])
    described = json.loads((found / "result.json").read_text())
    words = " ".join(described["paragraphs"])
    for differing in ("resonant, zdt1", mine, "population of 20", "100 evaluations"):
        assert differing in words
    assert "my_module:MyProblem: the union of all runs" in words
    assert described["command"].endswith(f"--algorithms {mine},NSGA2")
    assert {table["name"]: table["findings"] for table in described["tables"]}["quality"] == []
    assert mine in (stranger / "out" / "index.html").read_text()


def test_an_open_run_is_the_run_of_its_algorithm(tmp_path):
    found = minimize(get_problem("zdt1"), NSGA2(pop_size=20), ("n_gen", 5), seed=21)
    folder = open_table(
        tmp_path, "--seeds", "21-21", *SMALL, "--problems", "zdt1", "--algorithms", "NSGA2"
    )
    (run,) = rows_of(folder / "runs.csv")
    front = TrueFront(reference("zdt1", [])[0].F)
    expected = front.quality(found.F[least_crowded(found.F, 50)])
    assert float(run["IGD"]) == expected.igd
    assert float(run["Spacing"]) == expected.spacing


@pytest.mark.nightly
def test_a_changed_file_of_a_stranger_gives_new_runs(stranger):
    arguments = ("--seeds", "1", *SMALL, "--problems", "zdt1", "--algorithms")
    before = rows_of(open_table(stranger / "out", *arguments, "my_module:MyAlgorithm") / "runs.csv")
    write_stranger(stranger, eta=1.0)
    sys.modules.pop("my_module")
    # A new process would not remember the former file.
    fingerprint.cache_clear()
    after = rows_of(open_table(stranger / "out", *arguments, "my_module:MyAlgorithm") / "runs.csv")
    assert before != after


@pytest.mark.nightly
def test_the_ablation_is_open_as_well(tmp_path):
    found = open_table(
        tmp_path, "--seeds", "2", *SMALL, "--problems", "calibrated", experiment="ablation"
    )
    runs = rows_of(found / "runs.csv")
    assert len(runs) == 4 * 2
    job = OptimisationRun("calibrated", "MP-MOPSO", 2, population=20, generations=5)
    front, _ = reference("calibrated", [])
    (same,) = (r for r in runs if (r["algorithm"], r["seed"]) == ("MP-MOPSO", "2"))
    assert float(same["IGD"]) == front.quality(job.execute().values[:, -2:]).igd


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--algorithms", "NSGA9"], ["--algorithms", "NSGA9", "module:name"]),
        (["--algorithms", "no_module:A"], ["no_module:A", "can be imported"]),
        (["--algorithms", "my_module:Other"], ["my_module:Other", "has no 'Other'"]),
        (["--algorithms", "my_module:np"], ["my_module:np", "a class or a function"]),
        (["--algorithms", "my_module:MyProblem"], ["my_module:MyProblem", "pymoo Algorithm"]),
        (["--algorithms", "my_module:needs_more"], ["my_module:needs_more", "size"]),
        (["--problems", "zdt99"], ["--problems", "zdt99", "not found"]),
        (["--problems", "rastrigin"], ["rastrigin", "two objectives"]),
        (["--problems", "wfg1"], ["wfg1", "n_obj"]),
        (["--problems", "my_module:MyAlgorithm"], ["my_module:MyAlgorithm", "two objectives"]),
        (["--problems", "zdt1,zdt1"], ["zdt1,zdt1", "every name once"]),
        (["--problems", "zdt1,"], ["'zdt1,'", "list of names"]),
        (["--evaluations", "2000", "--pop", "30"], ["--evaluations", "2000", "--pop 30"]),
        (["--seeds", "40-21"], ["'40-21'", "21-40"]),
        (["--seeds", "0-3"], ["'0'", "at least 1"]),
    ],
)
def test_bad_names_and_numbers_are_named_before_anything_runs(arguments, words, stranger, capsys):
    out = stranger / "out"
    with pytest.raises(SystemExit) as stopped:
        main(["table7", *arguments, "--out", str(out)])
    assert stopped.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert all(word in line for word in words), line
    assert not out.exists()


@pytest.mark.parametrize("name", [["table5"], []])
@pytest.mark.parametrize("option", ["--pop", "--evaluations", "--problems", "--algorithms"])
def test_the_options_are_refused_where_they_would_change_nothing(name, option, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([*name, option, "20", "--out", str(tmp_path / "out")])
    assert stopped.value.code == 2
    assert f"{option} is for table7, ablation" in capsys.readouterr().err


def test_other_seeds_are_still_the_setting_of_the_paper():
    assert Setting(first_seed=21).is_stated
    for change in (
        {"population": 50},
        {"evaluations": 500},
        {"problems": ("calibrated",)},
        {"algorithms": ("NSGA-II",)},
    ):
        setting = Setting(**change)
        assert not setting.is_stated
        assert len(setting.options()) == 2


def test_the_command_of_a_page_gives_the_same_setting_again(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(
        "experiments.command_line._run", lambda chosen, context: asked.append(context)
    )
    given = "--seeds 21-40 --evaluations 200 --pop 20 --problems zdt1 --algorithms NSGA2"
    main(["table7", *given.split(), "--workers", "1", "--out", str(tmp_path)])
    command = asked[0].comparison_command("table7")
    main([*command.split()[3:], "--workers", "1", "--out", str(tmp_path)])
    assert asked[0].setting == asked[1].setting
    assert asked[0].seeds_to_run == asked[1].seeds_to_run == range(21, 41)


@pytest.mark.parametrize(
    ("name", "kind", "size"),
    [
        pytest.param("NSGA3", NSGA3, 20, marks=pytest.mark.nightly),
        ("ElitistSwarm", ElitistSwarm, 20),
        ("CompactSwarm", CompactSwarm, 100),
        ("NSGA-II", NSGA2, 20),
    ],
)
def test_algorithms_get_the_population_that_was_asked_for_or_choose_it(name, kind, size):
    algorithm = algorithm_named(name, 20, "dtlz2")
    assert isinstance(algorithm, kind)
    assert algorithm.pop_size == size


@pytest.mark.nightly
def test_three_objectives_are_compared_too(tmp_path):
    setting = Setting(("dtlz2",), ("NSGA2", "NSGA3"), 1, 20, 200)
    (one,) = compare(setting, range(1, 3), Campaign(tmp_path), (), "open")
    assert one.is_true
    assert one.median_front("NSGA3").shape[1] == 3
    assert np.isfinite(one.values("NSGA2", "igd")).all()


def test_a_run_without_a_feasible_design_is_the_worst_there_is(stranger):
    write_stranger(stranger, limit=2.0)
    problem_named.cache_clear()
    setting = Setting(("my_module:MyProblem",), ("NSGA2",), 1, 20, 100)
    run = OpenRun("my_module:MyProblem", "NSGA2", 1, 20, 100).execute()
    assert run.values[0, 0] == 100
    assert np.isnan(run.values[:, 1:]).all()
    with pytest.raises(InvalidInput, match="two different optima"):
        compare(setting, range(1, 2), Campaign(stranger), (), "open")


def test_the_standard_algorithms_are_the_same_by_name():
    for name in ALGORITHMS:
        assert type(algorithm_named(name, 20, "zdt1")) is type(ALGORITHMS[name](20, 50))


@pytest.mark.nightly
def test_a_stranger_s_algorithm_reaches_other_processes(tmp_path):
    write_stranger(tmp_path)
    command = [sys.executable, "-m", "experiments", "table7", "--seeds", "2", *SMALL]
    command += ["--problems", "zdt1", "--algorithms", "my_module:MyAlgorithm", "--workers", "2"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert len(rows_of(tmp_path / "results" / "table7" / "runs.csv")) == 2


def test_a_module_of_pymoo_that_lacks_a_library_hides_no_other(monkeypatch):
    """Without scikit-learn one module cannot be imported, which comes before that of NSGA-III."""
    monkeypatch.setitem(sys.modules, "sklearn", None)
    monkeypatch.setitem(sys.modules, "sklearn.naive_bayes", None)
    monkeypatch.delitem(sys.modules, "pymoo.algorithms.moo.kgb", raising=False)
    assert isinstance(algorithm_named("NSGA3", 20, "zdt1"), NSGA3)
