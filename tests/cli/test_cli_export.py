"""``pymoo-hdte export`` as a user calls it."""

import json
from xml.etree import ElementTree

import pytest
from places import DOCS

from pymoo_hdte.cli.command_line import main

MODEL = """
title = "A joint"
[coordinates.joint]
inertia = { value = 0.5 }
angle = true
[ports.bearing]
motion = { joint = 1.0 }
damping = { value = 3.0 }
[inputs.current]
acts = { joint = 1.0 }
gain = { value = 7.6 }
[[effects]]
name = "coulomb_friction"
port = "bearing"
level = 1.5
[[effects]]
name = "torque_ripple"
port = "bearing"
order = 202.0
amplitude = 0.3
phase = 0.1
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(MODEL, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("target", ["mujoco", "urdf", "modelica", "python"])
def test_a_model_is_exported_and_what_is_missing_is_printed(model, target, tmp_path, capsys):
    out = tmp_path / "file"
    arguments = ["export", model, "--to", target, "--out", str(out)]
    assert main(arguments) == 0
    text, said = out.read_text(encoding="utf-8"), capsys.readouterr().out
    assert ("torque_ripple" in said) is (target in ("mujoco", "urdf"))
    if target in ("mujoco", "urdf"):
        assert ElementTree.fromstring(text).find(".//joint").get("name") == "joint"
    assert main([*arguments, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["file"], document["to"]) == (str(out), target)
    assert out.read_text(encoding="utf-8") == text


@pytest.mark.parametrize("kind", ["file", "folder", "link", "model"])
def test_anything_but_an_export_is_never_replaced(model, kind, tmp_path, capsys):
    out = tmp_path / "out"
    if kind == "folder":
        out.mkdir()
    elif kind == "link":
        out.symlink_to(tmp_path / "elsewhere")
    elif kind == "file":
        out.write_text("mine", encoding="utf-8")
    else:
        out = tmp_path / "model.toml"
    assert main(["export", model, "--to", "urdf", "--out", str(out)]) == 2
    assert "--out" in capsys.readouterr().err
    assert (tmp_path / "model.toml").read_text(encoding="utf-8") == MODEL
    assert not (tmp_path / "elsewhere").exists()


def test_an_effect_of_ones_own_that_states_no_equations_is_told(model, tmp_path, capsys):
    own = 'name = "eyring_drag"\nport = "bearing"\nlevel = 1.0\nknee = 0.1\n'
    text = MODEL.partition("[[effects]]")[0] + f"[[effects]]\n{own}"
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")
    arguments = ["--to", "modelica", "--effects", str(DOCS / "examples" / "eyring_drag.py")]
    assert main(["export", model, *arguments, "--out", str(tmp_path / "out")]) == 0
    assert "eyring_drag at bearing" in capsys.readouterr().out


def test_a_mistake_in_the_model_is_one_line_and_writes_nothing(model, tmp_path, capsys):
    (tmp_path / "model.toml").write_text(MODEL.replace("level = 1.5", 'level = "a"'))
    out = tmp_path / "out"
    assert main(["export", model, "--to", "python", "--out", str(out)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()
