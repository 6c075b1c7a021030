"""``pymoo-hdte simulate``: files that agree with the model and with each other."""

import csv
import json
import re
import shutil

import numpy as np
import pytest
from night import others_at_night
from places import DOCS

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.drive import hs_20_100, preset
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml
from pymoo_hdte.units import REVOLUTION_PER_MINUTE


def simulate(*arguments):
    return cli.main(["simulate", *map(str, arguments)])


def table(path):
    with path.open() as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=float)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("simulate") / "report"
    assert simulate("hs_20_100", "--speed", 1500, "--load", 20, "--out", out, "--quiet") == 0
    return out


@pytest.fixture(scope="module")
def document(written):
    return json.loads((written / "simulation.json").read_text())


@pytest.mark.slow
def test_the_dte_is_that_of_the_model_there(document):
    model = preset("calibrated").at(1500.0 * REVOLUTION_PER_MINUTE, 20.0)
    (expected,) = model.dte_arcsec(model.nominal[None])
    assert document["dte_arcsec"]["steady_state"] == expected
    assert document["dte_arcsec"]["integrated"] == pytest.approx(expected, rel=0.01)
    assert document["input_speed_r_min"] == pytest.approx(1500.0)


@pytest.mark.slow
def test_the_turn_has_the_dte_and_the_order_lines(written, document):
    _, turn = table(written / "transmission_error.csv")
    angle, error = turn[:, 1], turn[:, 3]
    span = (angle >= 0.0) & (angle <= 2.0 * np.pi * 101.0)
    assert np.ptp(error[span]) == pytest.approx(document["dte_arcsec"]["integrated"], rel=0.01)
    header, lines = table(written / "order_lines.csv")
    assert header == ["order", "amplitude_arcsec"]
    moving = lines[lines[:, 0] > 0.0]
    order, amplitude = moving[moving[:, 1].argmax()]
    even = np.linspace(0.0, 2.0 * np.pi * 101.0, 20201)[:-1]
    signal = np.interp(even, angle, error)
    projected = 2.0 * np.abs(np.mean(signal * np.exp(-1j * order * even)))
    assert projected == pytest.approx(amplitude, rel=0.01)


@pytest.mark.slow
def test_the_speeds_hold_this_one_and_the_resonances_their_peaks(written, document):
    _, speeds = table(written / "speeds.csv")
    at = np.abs(speeds[:, 0] - 1500.0).argmin()
    assert speeds[at, 1] == pytest.approx(document["dte_arcsec"]["steady_state"], rel=1e-9)
    first = next(one for one in document["resonances"] if one["order"] == 1.0)
    near = np.abs(speeds[:, 0] - first["input_speed_r_min"]) < 100.0
    far = np.abs(speeds[:, 0] - 0.8 * first["input_speed_r_min"]) < 50.0
    assert speeds[near, 1].min() > speeds[far, 1].max()


def test_without_options_the_rated_condition(tmp_path, capsys):
    assert simulate("hs_20_100", "--out", tmp_path / "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["input_speed_r_min"] == pytest.approx(2000.0)
    assert found["load_torque_Nm"] == 40.0
    assert any("differs" in one for one in found["limits"]) is False


@pytest.mark.parametrize("speed", others_at_night([300, 100, 20]))
def test_slow_motion_has_its_turn_too(speed, tmp_path, capsys):
    assert simulate("hs_20_100", "--speed", speed, "--out", tmp_path / "out", "--json") == 0
    dte = json.loads(capsys.readouterr().out)["dte_arcsec"]
    assert dte["integrated"] == pytest.approx(dte["steady_state"], rel=1e-3)


def test_a_resonance_nearby_is_said(tmp_path, capsys):
    assert simulate("hs_20_100", "--speed", 2500, "--out", tmp_path / "out") == 0
    printed = capsys.readouterr().out
    assert "of the resonance of order 1" in printed
    assert "DTE" in printed.split("\n")[0]


@pytest.mark.slow
def test_files_of_a_drive_are_taken(written, tmp_path):
    (tmp_path / "sheet.toml").write_text(sheet_toml(hs_20_100()))
    (tmp_path / "model.toml").write_text(model_toml(preset("calibrated")))
    files = (tmp_path / "sheet.toml", "--model", tmp_path / "model.toml")
    condition = ("--speed", 1500, "--load", 20)
    assert simulate(*files, *condition, "--out", tmp_path / "files", "--quiet") == 0
    names = ("transmission_error.csv", "order_lines.csv", "speeds.csv")
    for name in names:
        assert (tmp_path / "files" / name).read_bytes() == (written / name).read_bytes()


@pytest.mark.slow
def test_the_ratio_of_a_sheet_that_does_not_say_which_member_is_held_is_said(tmp_path):
    sheet, model = tmp_path / "sheet.toml", tmp_path / "model.toml"
    said = (DOCS / "examples" / "my_drive.toml").read_text(encoding="utf-8")
    shutil.copy(DOCS / "examples" / "my_drive_model.toml", model)
    limits = []
    for text in (said, re.sub("held = .*", "", said)):
        sheet.write_text(text, encoding="utf-8")
        assert simulate(sheet, "--model", model, "--out", tmp_path / "report", "--quiet") == 0
        limits.append(json.loads((tmp_path / "report" / "simulation.json").read_text())["limits"])
    (added,) = set(limits[1]) - set(limits[0])
    assert "teeth.held" in added
    assert re.findall(r"\d+", added) == ["80", "81"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--speed", "0"), "--speed is 0.0"),
        (("--speed", "inf"), "--speed is inf"),
        (("--load", "-2000000"), "--load is -2000000.0"),
        (("--load", "1e300"), "--load is 1e+300"),
        (("--speed", "1e6"), "--speed is 1000000.0"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(options, words, tmp_path, capsys):
    assert simulate("hs_20_100", "--out", tmp_path / "out", *options, "--quiet") == cli.MISTAKE
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_drive_without_a_steady_state_is_refused_in_words(tmp_path, capsys):
    deep = model_toml(preset("calibrated")).replace("depth = 0.03006", "depth = 0.95")
    (tmp_path / "deep.toml").write_text(deep.replace("factor = 4.011", "factor = 0.001"))
    arguments = ("--model", tmp_path / "deep.toml", "--speed", 2517, "--quiet")
    assert simulate("hs_20_100", *arguments, "--out", tmp_path / "out") == cli.MISTAKE
    assert "Floquet multiplier" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
