"""The command ``table7``: its files, going on after an end, and what it refuses."""

import json
import sys
from importlib.metadata import PackageNotFoundError

import pytest

from pymoo_hdte._comparing.named import OpenRun
from pymoo_hdte._interrupts import INTERRUPTED
from pymoo_hdte._runner import provenance
from pymoo_hdte.cli.command_line import MISTAKE, main

SMALL = ["--evaluations", "60", "--pop", "20", "--seeds", "2", "--workers", "1"]
OTHER = ["--problems", "zdt1", "--algorithms", "NSGA2,NSGA-II"]


def table7(out, *more):
    return main(["table7", *SMALL, *OTHER, "--out", str(out), *more])


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("table7") / "out"
    assert table7(folder) == 0
    return folder


def test_the_page_names_only_files_that_are_there(out):
    page = (out / "report.html").read_text(encoding="utf-8")
    links = [part.partition('"')[0] for part in page.replace('src="', 'href="').split('href="')[1:]]
    files = [link for link in links if not link.startswith("#")]
    assert {"table7/runs.csv", "table7/fronts_zdt1.png", "times/table7/times.csv"} <= {*files}
    assert all((out / link).is_file() for link in files)


def test_it_goes_on_from_finished_runs(out, monkeypatch, capsys):
    before = (out / "table7" / "runs.csv").read_bytes()
    monkeypatch.setattr(OpenRun, "execute", None)
    capsys.readouterr()
    assert table7(out, "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert document["sentences"]
    assert {table["name"] for table in document["tables"]} >= {"quality", "tests", "runs"}
    assert (out / "table7" / "runs.csv").read_bytes() == before


def test_an_interrupt_keeps_what_is_finished(tmp_path, monkeypatch, capsys):
    begun = []

    def execute(job, whole=OpenRun.execute):
        if begun:
            raise KeyboardInterrupt
        begun.append(job)
        return whole(job)

    monkeypatch.setattr(OpenRun, "execute", execute)
    assert table7(tmp_path / "out") == INTERRUPTED
    assert str(tmp_path / "out") in capsys.readouterr().err
    assert len([*(tmp_path / "out").rglob("zdt1_*.csv")]) == 1


def test_versions_are_told_where_a_package_has_no_wheel(monkeypatch):
    """On some processors there is no finufft."""

    def version(package, whole=provenance.version):
        if package == "finufft":
            raise PackageNotFoundError(package)
        return whole(package)

    everywhere = provenance.environment()
    monkeypatch.setattr(provenance, "version", version)
    expected = {name: value for name, value in everywhere.items() if name != "finufft"}
    assert provenance.environment() == expected


def test_a_folder_with_anything_else_is_refused(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("precious")
    assert table7(tmp_path) == MISTAKE
    assert str(tmp_path) in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_wrong_name_makes_no_folder(tmp_path, capsys):
    assert main(["table7", "--problems", "zdt99", "--out", str(tmp_path / "out")]) == MISTAKE
    assert "zdt99" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "name", "words"),
    [
        ("--algorithms", "builtins:dict", "no signature found"),
        ("--algorithms", "ends_of_a_test:end", "SystemExit: 3"),
        ("--algorithms", "ends_when_it_is_read:MyAlgorithm", "SystemExit: 4"),
        ("--problems", "ends_when_it_is_read:MyProblem", "SystemExit: 4"),
    ],
)
def test_modules_that_fail_in_any_way_are_named(option, name, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "ends_of_a_test.py").write_text("def end():\n    raise SystemExit(3)\n")
    (tmp_path / "ends_when_it_is_read.py").write_text("raise SystemExit(4)\n")
    assert main(["table7", option, name, "--out", str(tmp_path / "out")]) == MISTAKE
    printed = capsys.readouterr().err
    assert f"{option} is {name!r}" in printed
    assert words in printed
