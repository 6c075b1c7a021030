"""The page on other tools: its study runs on the log of the example and finds what that hides."""

import re
import runpy

import numpy as np
import pytest
from places import DOCS

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.discrepancy._records.rig_model import model_text
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port

(STUDY,) = re.findall(r"```python\n(.*?)```", (DOCS / "other_tools.md").read_text(), re.S)


def test_the_study_starts_from_the_exported_joint(tmp_path, monkeypatch):
    reason = "mujoco with its extra sysid is not installed"
    sysid = pytest.importorskip("mujoco.sysid", reason=reason)
    if not hasattr(sysid, "optimize"):
        pytest.skip(reason)
    example = runpy.run_path(str(DOCS / "examples" / "own_joint.py"))
    folder = tmp_path / "my_joint"
    (folder / "report").mkdir(parents=True)
    np.savetxt(folder / "log.csv", example["log"](), "%.6f", ",")
    port = Port("bearing", {"joint": 1.0}, damping=BelievedValue(2.4))
    mechanism = Mechanism(
        {"joint": BelievedValue(0.36)},
        [port],
        [Input("current", {"joint": 1.0}, BelievedValue(example["GAIN"]))],
        angles=["joint"],
    )
    effects = (
        LawAt("gravity", "bearing", Gravity(example["TRUTH"]["gravity"], 0.4)),
        LawAt("coulomb_friction", "bearing", CoulombFriction(1.3)),
    )
    text = model_text(MechanismModel("A joint", mechanism, effects))
    (folder / "report" / "revised_model.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(STUDY, "other_tools.md", "exec"), names)
    fitted = {name: names["fitted"][name].value[0] for name in ("damping", "frictionloss")}
    expected = {"damping": example["VISCOUS"], "frictionloss": example["TRUTH"]["coulomb_friction"]}
    assert fitted == pytest.approx(expected, rel=0.03)
