"""Every report in headless Chromium, wide and narrow: all visible, nothing from outside."""

import json

import measured_oscillator as rig
import numpy as np
import pytest
from bench_records import write_series
from browser import CHROMIUM, probe
from example_result import example
from quick_campaigns import put_ripple_report

from experiments.runner.report import write_report
from experiments.runner.store import save
from pymoo_hdte.cli import __main__ as cli
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
WIDTHS = (1280, 500)


def looked_at(page, tmp_path, width, script="null"):
    """Open a page and assert what holds for all of them; return the rest."""
    seen = probe(page, tmp_path, width=width, script=script)
    assert seen["errors"] == []
    assert seen["loaded"] == []
    assert seen["broken_anchors"] == []
    assert seen["wider_than_window"] <= 0
    assert all(natural > 0 and visible for _, natural, visible in seen["images"])
    assert all(alt for alt, _, _ in seen["images"])
    assert all(rows > 1 and visible for rows, visible in seen["tables"])
    for link in seen["links"]:
        if not link.startswith(("#", "http")):
            assert (page.parent / link).is_file()
    return seen


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """One report of every kind."""
    top = tmp_path_factory.mktemp("reports")
    write_series(top / "series-1")
    put_ripple_report(top / "discrepancy")
    quick = ("--order", "2", "--evaluations", "1000")
    commands = {
        "optimise": ("hs_20_100", *quick),
        "simulate": ("hs_20_100",),
        "identify": (str(top / "series-1"), "--datasheet", "hs_20_100"),
    }
    for name, arguments in commands.items():
        assert cli.main([name, *arguments, "--out", str(top / name), "--quiet"]) == 0
    oscillator = Mechanism(
        inertias={"x": BelievedValue(1.0, 0.1)},
        ports=[Port("spring", {"x": 1.0}, BelievedValue(4100.0, 0.1), BelievedValue(5.0, 0.5))],
        inputs=[Input("force", {"x": 1.0})],
    )
    runs = [rig.record_of(rig.cubic), rig.record_of(rig.cubic, "held_out", seed=3)]
    analyse(MeasuredMechanism(oscillator, runs, title="oscillator")).report(top / "measured")
    found = {name: top / name / "report.html" for name in (*commands, "discrepancy", "measured")}
    save(top / "results", "table7", example())
    return found | {"experiments": write_report(top / "results")}


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize(
    ("name", "images", "tables"),
    [
        ("optimise", 0, 5),
        ("simulate", 3, 1),
        ("identify", 5, 3),
        ("discrepancy", 5, 4),
        ("measured", 3, 3),
        ("experiments", 1, 1),
    ],
)
def test_a_reader_sees_everything(name, images, tables, width, pages, tmp_path):
    seen = looked_at(pages[name], tmp_path, width)
    assert len(seen["images"]) >= images
    assert len(seen["tables"]) >= tables


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


@pytest.fixture(scope="module")
def front(pages):
    text = (pages["optimise"].parent / "front.csv").read_text().splitlines()[1:]
    return np.array([line.split(",") for line in text], dtype=float)


@pytest.mark.parametrize("place", ["first", "last"])
def test_the_design_under_the_pointer_is_shown(place, pages, front, tmp_path):
    row = 0 if place == "first" else len(front) - 1
    shown = probe(pages["optimise"], tmp_path, script=_POINT_AT.replace("ROW", str(row)))["answer"]
    assert float(shown[0]) == pytest.approx(front[row, 0], abs=6e-4)
    assert float(shown[1]) == pytest.approx(front[row, 1], abs=6e-5)
    assert float(shown[2].split()[0]) == pytest.approx(front[row, 2], rel=1e-3)


def test_arrow_keys_step_along_the_front_from_the_chosen_design(pages, front, tmp_path):
    document = json.loads((pages["optimise"].parent / "optimum.json").read_text())
    row = document["designs"]["balanced"]["row_of_front"]
    keys = '["ArrowRight", "ArrowRight", "ArrowLeft", "ArrowRight"]'
    shown = probe(pages["optimise"], tmp_path, script=_PRESS.replace("KEYS", keys))["answer"]
    assert float(shown[0]) == pytest.approx(front[row + 2, 0], abs=6e-4)
