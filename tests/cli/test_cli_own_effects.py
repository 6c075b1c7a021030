"""Effects of a user's own enter from a file that the command line names."""

import json

import numpy as np
import pytest
from measured_oscillator import EYRING_DRAG, OF_ROTOR, ROTOR, rotor_record
from places import DOCS

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli.own_effects import own_effects
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse, read_rig
from pymoo_hdte.discrepancy._records.rig_model import model_text
from pymoo_hdte.effects import known_effects, registered

EXAMPLE = DOCS / "examples" / "eyring_drag.py"
TABLE = """
[table]
format = "csv"
time = { column = "time", unit = "s" }
channels.angle = { column = "angle", unit = "rad" }
channels.torque = { column = "torque", unit = "N.m" }
[[records]]
file = "train.csv"
role = "train"
[[records]]
file = "held_out.csv"
role = "held_out"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The records of a rotor with Eyring's drag, as a rig of one's own."""
    folder = tmp_path_factory.mktemp("rotor")
    with registered(EYRING_DRAG):
        records = [rotor_record(seed, role) for seed, role in ((1, "train"), (2, "held_out"))]
    for one in records:
        rows = np.column_stack([one.time, one.channels["angle"], one.channels["torque"]])
        file = folder / f"{one.role}.csv"
        np.savetxt(file, rows, "%.12g", ",", header="time,angle,torque", comments="")
    believed = model_text(MeasuredMechanism(ROTOR, [], title="rotor").model)
    (folder / "rig.toml").write_text(believed + TABLE)
    return folder


def run(folder, out, *options):
    return cli.main(["discrepancy", str(folder), "--out", str(out), "--quiet", *map(str, options)])


@pytest.mark.nightly
def test_the_effect_of_a_file_is_named_believed_and_forgotten(folder, tmp_path):
    before = known_effects()
    assert run(folder, tmp_path / "out", "--effects", EXAMPLE) == 0
    assert known_effects() == before
    document = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert document["status"] == "named"
    (effect,) = document["effects"]
    assert (effect["name"], effect["port"]) == ("eyring_drag", "bearing")
    for name in ("level", "knee"):
        low, high = effect["parameters"][name]["interval95"]
        assert low < getattr(OF_ROTOR, name) < high
    model = tmp_path / "out" / "revised_model.toml"
    again = tmp_path / "again"
    assert run(folder, again, "--effects", EXAMPLE, "--believed", model) == 0
    assert json.loads((again / "verdict.json").read_text())["status"] == "adequate"


@pytest.mark.nightly
def test_without_the_file_nothing_else_explains_it(folder):
    assert analyse(read_rig(folder)).verdict.status != "named"


OF_PACKAGE = "from pymoo_hdte.effects import effect_named; THERE = effect_named('backlash')"
REGISTERS = """
from pymoo_hdte.effects import register
register(EYRING_DRAG)
"""


def test_a_file_may_register_its_effect_itself(tmp_path):
    file, before = tmp_path / "my effects.py", known_effects()
    file.write_text(EXAMPLE.read_text() + REGISTERS)
    with registered():
        (effect,) = own_effects(file)
        assert known_effects() == (*before, effect)
    assert known_effects() == before


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "a Python file that is there"),
        (OF_PACKAGE, "in which an Effect"),
        ("\n1 / 0\n", "line 2: ZeroDivisionError: division by zero"),
        ("import numpy\ndef of:\n", "SyntaxError"),
        ("import no_such_module_here\n", "line 1: ModuleNotFoundError"),
        ("raise SystemExit(0)\n", "line 1: SystemExit"),
        (EXAMPLE.read_text().replace('name="eyring_drag"', 'name="backlash"'), "no other effect"),
    ],
)
def test_a_file_that_gives_no_effect_is_one_line(text, words, folder, tmp_path, capsys):
    file, before = tmp_path / "mine.py", known_effects()
    if text is not None:
        file.write_text(text)
    assert run(folder, tmp_path / "out", "--effects", file) == cli.MISTAKE
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert known_effects() == before


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("self.level * np.arcsinh(share)", "np.nan * share", "torque of eyring_drag"),
        ("self.level * np.arcsinh(share)", "np.ones(3)", "torque of eyring_drag"),
        ("self.level * np.arcsinh(share)", "share / no_such", "line {}: NameError: name 'no_such'"),
        ("force, speed = sizes.force", "force, speed = sizes.no_such", "line {}: AttributeError"),
    ],
)
def test_an_effect_that_gives_no_numbers_is_refused_by_name_or_line(
    folder, tmp_path, capsys, old, new, told
):
    """It was listed among what was tried, or ended the command with a traceback."""
    text = EXAMPLE.read_text()
    assert text.count(old) == 1
    file = tmp_path / "own.py"
    file.write_text(text.replace(old, new))
    line = text[: text.index(old)].count("\n") + 1
    assert run(folder, tmp_path / "out", "--effects", file) == 2
    assert told.format(line) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
