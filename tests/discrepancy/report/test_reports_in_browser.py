"""Every report in headless Chromium, wide and narrow: all visible, nothing from outside."""

import json
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from bench_records import write_series
from browser import CHROMIUM, probe
from example_result import example
from kept_results import kept, put_files
from measured_oscillator import cubic_analysis
from places import DOCS
from quick_campaigns import ripple_analysis_and_report, study_and_report

from experiments.runner.report import report_fingerprint, write_report
from pymoo_hdte._runner.store import save
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.drive import hs_20_100, preset
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
WIDE, NARROW = 1280, 500


def looked_at(page, tmp_path, width, script="null"):
    """Open a page and assert what holds for all of them; return the rest."""
    seen = probe(page, tmp_path, width=width, script=script)
    assert seen["errors"] == []
    assert seen["loaded"] == []
    assert seen["broken_anchors"] == []
    assert seen["wider_than_window"] <= 0
    assert all(natural > 0 and visible for _, natural, visible in seen["images"])
    assert all(alt for alt, _, _ in seen["images"])
    # A picture that is wider than its place says that it scrolls, and no other one does.
    assert all(scrolls == said for scrolls, said in seen["pictures"])
    assert all(rows > 1 and visible for rows, visible in seen["tables"])
    for link in seen["links"]:
        if not link.startswith(("#", "http")):
            assert (page.parent / link.partition("#")[0]).is_file()
    return seen


@kept
def files_of(name):
    """Return the files of one report of every kind, by their path."""
    with TemporaryDirectory() as top:
        series, out = Path(top) / "series-1", Path(top) / name
        if name == "simulate":
            assert cli.main([name, "hs_20_100", "--out", str(out), "--quiet"]) == 0
        elif name == "identify":
            write_series(series)
            arguments = (str(series), "--datasheet", "hs_20_100", "--out", str(out), "--quiet")
            assert cli.main([name, *arguments]) == 0
        elif name == "plan":
            page = (DOCS / "command_line.md").read_text(encoding="utf-8")
            (limits,) = re.findall(r"```toml\n(input_speeds_rpm.*?)```", page, re.S)
            (Path(top) / "limits.toml").write_text(limits)
            (Path(top) / "joint.toml").write_text(model_toml(preset("calibrated")))
            (Path(top) / "joint_sheet.toml").write_text(sheet_toml(hs_20_100()))
            arguments = (f"{top}/joint.toml", "--limits", f"{top}/limits.toml", "--out", str(out))
            assert cli.main([name, *arguments, "--quiet"]) == 0
        else:
            save(out, "table7", example(), report_fingerprint())
            write_report(out)
        files = [path for path in out.rglob("*") if path.is_file()]
        return {path.relative_to(out): path.read_bytes() for path in files}


@pytest.fixture
def page(name, tmp_path):
    """The page of a report."""
    if name == "discrepancy":
        files = ripple_analysis_and_report()[1]
    elif name == "measured":
        files = cubic_analysis()[1]
    elif name == "optimise":
        files = study_and_report()[1]
    else:
        files = files_of(name)
    put_files(files, tmp_path / name)
    if name == "experiments":
        return tmp_path / name / "table7" / "index.html"
    return tmp_path / name / "report.html"


@pytest.mark.parametrize("width", [NARROW, pytest.param(WIDE, marks=pytest.mark.nightly)])
@pytest.mark.parametrize(
    ("name", "images", "tables"),
    [
        pytest.param("optimise", 0, 5, marks=pytest.mark.nightly),
        pytest.param("simulate", 3, 1, marks=pytest.mark.nightly),
        pytest.param("identify", 5, 3, marks=pytest.mark.nightly),
        pytest.param("plan", 0, 2, marks=pytest.mark.nightly),
        ("discrepancy", 5, 4),
        pytest.param("measured", 3, 3, marks=pytest.mark.nightly),
        ("experiments", 1, 1),
    ],
)
def test_a_reader_sees_everything(name, images, tables, width, page, tmp_path):
    seen = looked_at(page, tmp_path, width)
    assert len(seen["images"]) >= images
    assert len(seen["tables"]) >= tables


def test_a_reader_sees_everything_on_a_wide_page(tmp_path):
    put_files(ripple_analysis_and_report()[1], tmp_path / "discrepancy")
    assert looked_at(tmp_path / "discrepancy" / "report.html", tmp_path, WIDE)["images"]


_POINT_AT = """(() => {
  const box = document.getElementById("front-point-ROW").getBoundingClientRect();
  const place = { clientX: box.x + box.width / 2, clientY: box.y + box.height / 2, bubbles: true };
  document.querySelector("figure.front svg").dispatchEvent(new PointerEvent("pointermove", place));
  return [...document.querySelectorAll("#front-shown td")].map((one) => one.textContent);
})()"""
_PRESS = """(() => {
  const figure = document.querySelector("figure.front svg");
  KEYS.forEach((key) => figure.dispatchEvent(new KeyboardEvent("keydown", { key })));
  return [...document.querySelectorAll("#front-shown td")].map((one) => one.textContent);
})()"""


@pytest.mark.parametrize("name", ["index", "models", "comparisons"])
def test_a_reader_sees_the_pages_around_the_experiments(name, tmp_path):
    put_files(files_of("experiments"), tmp_path)
    looked_at(tmp_path / f"{name}.html", tmp_path, 360)


@pytest.fixture
def optimum(tmp_path):
    put_files(study_and_report()[1], tmp_path / "optimise")
    return tmp_path / "optimise" / "report.html"


@pytest.fixture
def front(optimum):
    text = (optimum.parent / "front.csv").read_text().splitlines()[1:]
    return np.array([line.split(",") for line in text], dtype=float)


@pytest.mark.parametrize("place", ["first", pytest.param("last", marks=pytest.mark.nightly)])
def test_the_design_under_the_pointer_is_shown(place, optimum, front, tmp_path):
    row = 0 if place == "first" else len(front) - 1
    shown = probe(optimum, tmp_path, script=_POINT_AT.replace("ROW", str(row)))["answer"]
    assert float(shown[0]) == pytest.approx(front[row, 0], abs=6e-4)
    assert float(shown[1]) == pytest.approx(front[row, 1], abs=6e-5)
    assert float(shown[2].split()[0]) == pytest.approx(front[row, 2], rel=1e-3)


@pytest.mark.nightly
def test_arrow_keys_step_along_the_front_from_the_chosen_design(optimum, front, tmp_path):
    document = json.loads((optimum.parent / "optimum.json").read_text())
    row = document["designs"]["balanced"]["row_of_front"]
    keys = '["ArrowRight", "ArrowRight", "ArrowLeft", "ArrowRight"]'
    shown = probe(optimum, tmp_path, script=_PRESS.replace("KEYS", keys))["answer"]
    assert float(shown[0]) == pytest.approx(front[row + 2, 0], abs=6e-4)
