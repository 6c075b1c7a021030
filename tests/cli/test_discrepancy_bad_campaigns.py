"""The whole command on bad campaigns and on good ones: a clear line or a verdict, never half."""

import gzip
import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kept_results import put_files
from quick_campaigns import (
    quick_analysis,
    quick_campaign,
    ripple_analysis_and_report,
    ripple_campaign,
)

from pymoo_hdte._reports import folder as reports_folder
from pymoo_hdte._reports.folder import PAGE_FILE
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.discrepancy import analysis as api
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.discrepancy._report import write as report
from pymoo_hdte.discrepancy._report.folder import FOLDER
from pymoo_hdte.drive import load_datasheet, load_model, simulate_drive

ROW = "run_2000rpm_40Nm.csv.gz"
IDLE = "run_2000rpm_00Nm.csv.gz"
SWEEP = "torsion_locked_input.csv.gz"


@pytest.fixture(scope="module")
def clean():
    return quick_campaign(1)


@pytest.fixture(scope="module")
def stored(clean, tmp_path_factory):
    """The records that faults are put into, with as few others, and no long ones, as it takes."""
    folder = tmp_path_factory.mktemp("clean") / "rig"
    fast = tuple(one for one in clean.running if one.input_speed > 140.0)
    write_campaign(replace(clean, running=fast), folder)
    return folder


@pytest.fixture
def folder(stored, tmp_path):
    return shutil.copytree(stored, tmp_path / "rig")


def run(folder, out, *options):
    return cli.main(["discrepancy", str(folder), "--out", str(out), *options])


def text_of(path):
    packed = path.read_bytes()
    return (gzip.decompress(packed) if path.suffix == ".gz" else packed).decode()


def put(path, text):
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())


def toml(old, new):
    """Return a fault that replaces one place of the campaign's table."""

    def spoil(folder):
        path = folder / "campaign.toml"
        assert path.read_text().count(old) >= 1
        path.write_text(path.read_text().replace(old, new, 1))

    return spoil


def column(file, name, change):
    """Return a fault that changes a column of numbers."""

    def spoil(folder):
        header, *rows = text_of(folder / file).strip().split("\n")
        names = header.split(",")
        table = np.array([row.split(",") for row in rows], dtype=float)
        table[:, names.index(name)] = change(table[:, names.index(name)])
        lines = [",".join(f"{number:.11g}" for number in row) for row in table]
        put(folder / file, "\n".join([header, *lines]) + "\n")

    return spoil


def rows(change):
    """Return a fault that changes the list of the lines of a record, its header first."""

    def spoil(folder):
        put(folder / ROW, "\n".join(change(text_of(folder / ROW).strip().split("\n"))) + "\n")

    return spoil


def cell(text):
    """Return a fault that writes something in the place of a number."""
    return rows(lambda lines: [*lines[:5], text + lines[5][lines[5].index(",") :], *lines[6:]])


def kept(*words):
    """Return a fault that keeps only the records of the table that hold one of the words."""

    def spoil(folder):
        path = folder / "campaign.toml"
        top, *records = path.read_text().split("\n[[record]]")
        chosen = [record for record in records if any(word in record for word in words)]
        path.write_text("\n[[record]]".join([top, *chosen]))

    return spoil


def scaled(factor):
    return lambda values: factor * values


def dead(values):
    return np.full_like(values, values[0])


FAULTS = {
    "no table": (lambda folder: (folder / "campaign.toml").unlink(), "a folder with campaign.toml"),
    "empty table": (lambda folder: (folder / "campaign.toml").write_text(""), "line 1: title"),
    "no file": (lambda folder: (folder / ROW).unlink(), f"record.2..file is '{ROW}'"),
    "empty file": (lambda folder: (folder / ROW).write_bytes(b""), f"{ROW}, line 1"),
    "header only": (rows(lambda lines: lines[:1]), f"{ROW}, line 1: rows"),
    "not packed": (lambda folder: (folder / ROW).write_text("time_s\n0\n"), f"{ROW} is .*gzip"),
    "cut off": (lambda folder: os.truncate(folder / ROW, 9999), f"{ROW} is .*gzip"),
    "cut row": (rows(lambda lines: [*lines[:-1], lines[-1][:20]]), f"{ROW}, line 3031"),
    "no column": (
        rows(lambda lines: [lines[0].replace("input_t", "t"), *lines[1:]]),
        "line 1: col",
    ),
    "text": (cell("soon"), f"{ROW}, line 6: time_s is 'soon'"),
    "NaN": (cell("nan"), f"{ROW}, line 6: time_s is 'nan'"),
    "time back": (rows(lambda lines: [*lines[:5], lines[6], lines[5], *lines[7:]]), "line 7: time"),
    "half a turn": (rows(lambda lines: lines[:1500]), f"{ROW}, .*one output turn"),
    "degrees": (column(ROW, "output_angle_rad", np.degrees), f"{ROW}, .*both angles in rad"),
    "degrees swept": (column(SWEEP, "output_angle_rad", np.degrees), f"{SWEEP}, .*slope"),
    "mN.m": (column(ROW, "input_torque_Nm", scaled(1e3)), f"{ROW}, .*mean of input_torque"),
    "mN.m, no load": (
        column(IDLE, "input_torque_Nm", scaled(1e3)),
        f"{IDLE}, .*overcomes friction",
    ),
    "rad/s": (toml("rpm = 2000", "rpm = 209.44"), "run_2000rpm_00Nm.*mean speed"),
    "g.cm2": (toml("input_inertia_kgm2 = 0.000197", "input_inertia_kgm2 = 1970"), "line 8: beli"),
    "noise in mN.m": (
        toml("torque_noise_Nm = 0.003", "torque_noise_Nm = 3"),
        "line 31: rig.input",
    ),
    "sign of motor": (column(ROW, "input_torque_Nm", np.negative), f"{ROW}, .*input_torque"),
    "sign of load": (column(ROW, "output_torque_Nm", np.negative), f"{ROW}, .*output_torque"),
    "one wild sample": (
        column(ROW, "output_torque_Nm", lambda values: np.r_[1e9, values[1:]]),
        f"{ROW}, .*mean of output_torque",
    ),
    "sign swept": (column(SWEEP, "output_torque_Nm", np.negative), f"{SWEEP}, .*backwards"),
    "dead input": (column(ROW, "input_angle_rad", dead), f"{ROW}, .*input_angle"),
    "dead output": (column(ROW, "output_angle_rad", dead), f"{ROW}, .*output_angle"),
    "dead motor": (column(ROW, "input_torque_Nm", dead), f"{ROW}, .*input_torque"),
    "dead load": (column(ROW, "output_torque_Nm", dead), f"{ROW}, .*output_torque"),
    "dead sweep": (column(SWEEP, "output_angle_rad", dead), f"{SWEEP}, .*output_angle"),
    "role": (toml('"held_out"', '"heldout"'), "role is 'heldout', allowed: one of 'train'"),
    "listed twice": (toml("2000rpm_00Nm", "2000rpm_40Nm"), f"record.2..file is '{ROW}'|each name"),
    "reversed sign": (toml("rpm = 2000", "rpm = -2000"), "mean speed of input_angle"),
    "frozen base": (toml("\ntolerance = 0.1", "\ntolerance = 0"), "believed.tolerance is 0"),
    "no record": (kept(), "record"),
    "sweep only": (kept("torsion"), "running records is 0"),
    "two records": (
        kept("2000rpm_00Nm", "2000rpm_40Nm"),
        "train records is 2, allowed: at least 3",
    ),
    "held out only": (kept('"held_out"'), "number of train records is 0"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_campaign_is_one_clear_line_and_nothing_is_written(fault, folder, tmp_path, capsys):
    spoil, message = FAULTS[fault]
    spoil(folder)
    assert run(folder, tmp_path / "deep" / "out") == cli.MISTAKE
    printed, error = capsys.readouterr()
    assert printed == ""
    assert re.search(message, error)
    assert error.startswith("pymoo-hdte: error: ")
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["rig"]


@pytest.fixture
def no_analysis(monkeypatch):
    def fail(campaign, effects):
        raise AssertionError("nobody should wait for this")

    monkeypatch.setattr(api, "examine_drive", fail)


@pytest.mark.parametrize("target", ["thesis", "thesis/text", "thesis/text/below", "rig", "."])
def test_a_foreign_target_is_refused_before_the_analysis(
    target, folder, tmp_path, no_analysis, capsys
):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "text").write_text("years of work")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert run(folder, tmp_path / target) == cli.MISTAKE
    refused = tmp_path / target
    assert str(refused.parent if refused.name == "below" else refused) in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_target_without_permission_is_refused_before_the_analysis(
    folder, tmp_path, no_analysis, monkeypatch, capsys
):
    # As root, who may write anywhere, the answer of the system has to be made up.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert run(folder, tmp_path / "out") == cli.MISTAKE
    assert f"{tmp_path}: Permission denied" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def analysed():
    return quick_analysis(1).finding


@pytest.mark.parametrize(
    ("module", "stage"),
    [
        (report, "_page"),
        (report, "_revision"),
        (reports_folder, "_write_all"),
    ],
)
@pytest.mark.nightly
def test_an_interrupted_run_leaves_nothing(
    module, stage, folder, analysed, tmp_path, monkeypatch, capsys
):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(api, "examine_drive", lambda campaign, effects: analysed)
    monkeypatch.setattr(module, stage, stop)
    assert run(folder, tmp_path / "deep" / "out") == cli.INTERRUPTED
    assert [path.name for path in tmp_path.iterdir()] == ["rig"]


def test_interrupted_in_the_last_step_the_earlier_report_stays(tmp_path, monkeypatch):
    FOLDER.write(tmp_path / "out", "earlier", {}, {})
    moved = Path.replace

    def stop(path, target):
        if path.name == "report":
            raise KeyboardInterrupt
        return moved(path, target)

    monkeypatch.setattr(Path, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        FOLDER.write(tmp_path / "out", "later", {}, {})
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert (tmp_path / "out" / PAGE_FILE).read_text() == "earlier"


@pytest.mark.nightly
def test_too_few_conditions_and_nothing_held_out_are_said(clean, tmp_path, capsys):
    fast = [replace(one, role="train") for one in clean.running if one.input_speed > 200.0]
    write_campaign(replace(clean, running=tuple(fast)), tmp_path / "rig")
    # A report inside the campaign leaves the measurement as it is.
    out = tmp_path / "rig" / "report"
    assert run(tmp_path / "rig", out) == 0
    printed = capsys.readouterr().out
    verdict = json.loads((out / "verdict.json").read_text())
    page = (out / "report.html").read_text()
    for words in ("not validated", "one speed"):
        (sentence,) = (one for one in verdict["limits"] if words in one)
        assert sentence in printed
        assert sentence in page
    assert "reason" in verdict["held_out"]
    assert not {"before", "after"} & verdict["held_out"].keys()
    assert [one.name for one in read_campaign(tmp_path / "rig").running] == [
        one.name for one in fast
    ]


def files_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """The folder of a report on a campaign with a ripple of the motor torque."""
    top = tmp_path_factory.mktemp("ripple")
    put_files(ripple_analysis_and_report()[1], top / "one")
    return top


@pytest.mark.slow
def test_every_file_is_there(reported):
    # The model that describes is one of mechanisms.
    assert files_of(reported / "one").keys() == {*FOLDER.files} - {"descriptive_model.toml"}


@pytest.mark.nightly
def test_the_command_writes_the_bytes_of_the_calls_in_python(reported, tmp_path):
    write_campaign(ripple_campaign(), tmp_path / "rig")
    assert run(tmp_path / "rig", tmp_path / "other", "--quiet") == 0
    assert files_of(tmp_path / "other") == files_of(reported / "one")


@pytest.mark.slow
def test_the_verdict_holds_what_was_promised(reported):
    verdict = json.loads((reported / "one" / "verdict.json").read_text())
    assert verdict["status"] == "named"
    # The rig's ripple has a second harmonic, which may be named beside it.
    found = verdict["effects"][0]
    assert {(one["name"], one["port"]) for one in verdict["effects"]} == {
        ("torque_ripple", "input")
    }
    assert found["order"] == pytest.approx(3.0)
    amplitude = found["parameters"]["amplitude"]
    assert amplitude["unit"] == "N.m"
    lower, upper = amplitude["interval95"]
    assert lower < amplitude["value"] < upper
    assert amplitude["value"] == pytest.approx(0.02, rel=0.1)
    for rival in verdict["alternatives"]:
        assert all({"name", "port"} <= one.keys() for one in rival["effects"])
        assert rival["chi_square"] > 0.0
        assert rival["equivalent"] is False
    held_out = verdict["held_out"]
    assert held_out["unit"] == "arcsec"
    torque = held_out["channels"]["input_torque"]
    assert 0.0 < torque["noise_floor"] < torque["before"]
    assert torque["after"] < 1.5 * torque["noise_floor"]
    assert verdict["next_experiment"]["description"].endswith(".")
    assert {"pymoo-hdte", "numpy", "scipy", "python"} <= verdict["versions"].keys()
    assert any("turn one way" in one for one in verdict["limits"])
    assert verdict["location"]["sentence"]
    assert verdict["revised_model"] == {"file": "revised_model.toml"}


@pytest.mark.slow
def test_the_revised_model_is_read_and_simulated(reported):
    out = reported / "one"
    sheet = load_datasheet(out / "revised_model_sheet.toml")
    model = load_model(out / "revised_model.toml", sheet)
    assert any("ripple" in str(one.to_dict()) for one in model.effects)
    solved = float(model.dte_arcsec(model.nominal[None])[0])
    assert simulate_drive(model, model.nominal).dte_arcsec() == pytest.approx(solved, rel=0.02)
