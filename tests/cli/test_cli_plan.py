"""``pymoo-hdte plan`` as a user calls it, with the documented file of limits, at fewer speeds."""

import json
import re
import tomllib

import pytest
from places import DOCS

from pymoo_hdte.cli.command_line import main
from pymoo_hdte.cli.plan_report import braking
from pymoo_hdte.discrepancy._plan import changes
from pymoo_hdte.drive import hs_20_100, preset
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml

PAGE = (DOCS / "command_line.md").read_text(encoding="utf-8")
(EXAMPLE,) = (one for one in re.findall(r"```toml\n(.*?)```", PAGE, re.S) if "[rig]" in one)


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A model and limits; of the library three effects, since hysteresis takes seconds."""
    candidates = changes.drive_candidates
    names = ("coulomb_friction", "stribeck_friction", "soft_windup")
    few = lambda *given: [one for one in candidates(*given) if one.name in names]  # noqa: E731
    monkeypatch.setattr(changes, "drive_candidates", few)
    model, limits = tmp_path / "joint.toml", tmp_path / "bench.toml"
    model.write_text(model_toml(preset("calibrated")), encoding="utf-8")
    (tmp_path / "joint_sheet.toml").write_text(sheet_toml(hs_20_100()), encoding="utf-8")
    fewer = EXAMPLE.replace("[50, 500, 1500]", "[500, 1500]").replace("[0, 20, 40]", "[0, 40]")
    limits.write_text(fewer.replace("session_s = 3600", "session_s = 0"), encoding="utf-8")
    return str(model), limits, tmp_path / "out"


def test_the_documented_limits_give_a_plan(files, capsys):
    model, limits, out = files
    arguments = ["plan", model, "--limits", str(limits), "--out", str(out)]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert "coulomb_friction:input" in said
    assert {path.name for path in out.iterdir()} == {"report.html", "plan.json", "plan.toml"}
    document = json.loads((out / "plan.json").read_text(encoding="utf-8"))
    assert document == tomllib.loads((out / "plan.toml").read_text(encoding="utf-8"))
    roles = [one["role"] for one in document["test"]]
    assert roles.count("held_out") == 2
    assert 3 <= roles.count("train") <= 14
    assert [one["effect"] for one in document["effect"]] == ["coulomb_friction:input"]
    assert {one["rival"] for one in document["pair"]} >= {"soft_windup:mesh"}
    # The same input gives the same bytes.
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    assert main([*arguments, "--quiet"]) == 0
    assert {path.name: path.read_bytes() for path in out.iterdir()} == first


def test_a_load_that_brakes_is_positive_in_both_directions():
    test = {"test": "running", "load_torque_Nm": -52.0}
    assert braking(test | {"direction": "reverse"}) == 52.0
    assert braking(test | {"direction": "forward"}) == -52.0


def test_a_wrong_limit_is_one_line(files, capsys):
    model, limits, out = files
    limits.write_text(EXAMPLE.replace("most_records = 16", "most_records = 0"), encoding="utf-8")
    assert main(["plan", model, "--limits", str(limits), "--out", str(out)]) == 2
    assert "bench.toml, line 6: most_records" in capsys.readouterr().err
    assert not out.exists()
