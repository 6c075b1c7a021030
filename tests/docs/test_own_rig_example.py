"""The examples of rigs of one's own find what they hide, and their page shows that output."""

import contextlib
import io
import json
import re
import runpy
import shlex
import sys
from decimal import Decimal
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from kept_results import kept, put_files
from places import DOCS

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.mechanism.effects import law_effects

TABLE, JOINT = "own_rig", "own_joint"
FOLDERS = {TABLE: "my_rig", JOINT: "my_joint"}
PAGE = (DOCS / "bring_your_own_rig.md").read_text(encoding="utf-8")
HIDDEN = "hardening_stiffness: coefficient"
CUT = "..."
"""End of a line of the page that leaves out the rest of what is printed."""


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


def run_example(name, folder):
    """Return what an example prints, and the names it defines."""
    script = str(DOCS / "examples" / f"{name}.py")
    text = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(text):
        patch.setattr(sys, "argv", [script, str(folder)])
        names = runpy.run_path(script, run_name="__main__")
    return text.getvalue(), names


@kept
def example(name):
    """Return what an example prints, what it hides or believes and its files, by their path."""
    with TemporaryDirectory() as top:
        folder = Path(top) / FOLDERS[name]
        printed, names = run_example(name, folder)
        files = {
            path.relative_to(folder): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file()
        }
    names = {name: names[name] for name in ("TRUTH", "RIG")}
    return printed.replace(str(folder), folder.name), names, files


def put_example(name, top):
    """Return the folder of an example, what it printed, its names and its verdict."""
    folder = top / FOLDERS[name]
    printed, names, files = example(name)
    put_files(files, folder)
    verdict = json.loads((folder / "report" / "verdict.json").read_text(encoding="utf-8"))
    return folder, printed, names, verdict


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """The example with a table on a leaf spring."""
    return put_example(TABLE, tmp_path_factory.mktemp("example"))


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    """The example with a joint of a robot."""
    return put_example(JOINT, tmp_path_factory.mktemp("example"))


@pytest.fixture
def at_the_rig(rig, monkeypatch):
    """The folder of the example as the working directory."""
    monkeypatch.chdir(rig[0])
    return rig[0]


def size_of(effect):
    """Return the torque of an effect with its interval."""
    (size,) = {"torque", "level", "amplitude"} & set(effect["parameters"])
    return effect["parameters"][size]


def numbers_and_words(line):
    """Return the numbers of a line as texts, and the line without them and without its spacing."""
    number = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\w)"
    return re.findall(number, line), " ".join(re.sub(number, " # ", line).split())


def last_digit(number):
    """Return what one more in its last digit adds to a number."""
    return float(Decimal(1).scaleb(Decimal(number).as_tuple().exponent))


def test_hidden_effect_is_named_and_its_interval_holds_the_truth(rig):
    _, _, names, verdict = rig
    assert verdict["status"] == "named"
    (effect,) = verdict["effects"]
    assert f"{effect['name']}: {next(iter(effect['parameters']))}" == HIDDEN
    found = {HIDDEN: effect["parameters"]["coefficient"]} | verdict["base"]
    assert set(found) == set(names["TRUTH"])
    for name, truth in names["TRUTH"].items():
        lower, upper = found[name]["interval95"]
        assert lower <= truth <= upper, name
        assert upper - lower < 0.02 * truth, name


def test_gap_of_the_held_out_record_is_gone(rig):
    gaps = rig[3]["held_out"]
    assert {gap["kind"] for gap in gaps} == {"simulation", "balance"}
    for gap in gaps:
        assert gap["record"] == "sweep"
        assert gap["unit"] == {"simulation": "m", "balance": "N"}[gap["kind"]]
        assert gap["before"] > 10.0 * gap["noise_floor"]
        assert gap["after"] < 0.2 * gap["before"]
        assert gap["shrinkage"] > 0.8


def test_a_folder_with_files_is_left_alone(rig):
    before = {path: path.stat().st_mtime_ns for path in rig[0].rglob("*")}
    with pytest.raises(SystemExit, match="is not empty"):
        run_example(TABLE, rig[0])
    assert before == {path: path.stat().st_mtime_ns for path in rig[0].rglob("*")}


def test_page_shows_what_the_example_prints(joint):
    (block,) = blocks("text")
    shown, printed = (text.strip().split("\n") for text in (block, joint[1]))
    assert len(shown) == len(printed)
    for here, there in zip(shown, printed, strict=True):
        if here.endswith(CUT):
            assert there.startswith(here.removesuffix(CUT))
            continue
        (values, words), (truths, said) = numbers_and_words(here), numbers_and_words(there)
        assert words == said
        for value, truth in zip(values, truths, strict=True):
            # Another machine may round the last digit otherwise.
            assert abs(float(value) - float(truth)) <= 1.01 * last_digit(truth), here


def test_lines_are_compared_by_their_numbers():
    values, words = numbers_and_words("order_2, 95 %: 1.66e-05 to  -3.5, K1 is 2.")
    assert values == ["95", "1.66e-05", "-3.5", "2"]
    assert words == "order_2, # %: # to # , K1 is # ."
    assert [last_digit(one) for one in values] == pytest.approx([1.0, 1e-7, 0.1, 1.0])


def test_page_prints_the_rigs_of_the_examples(rig, joint):
    assert len(joint[2]["RIG"].splitlines()) <= 25
    for block, (folder, _, names, _) in zip(blocks("toml"), (joint, rig), strict=True):
        assert block == names["RIG"] == (folder / "rig.toml").read_text(encoding="utf-8")


def test_rig_of_the_page_is_read(at_the_rig):
    table = read_rig(at_the_rig / "rig.toml")
    found = {record.name: record.role for record in table.records}
    assert found == {"multisine": "train", "sweep": "held_out"}
    # Millimetres have become metres.
    assert 0.01 < np.abs(table.records[0].channels["position"]).max() < 0.1


def test_raw_log_of_a_joint_shows_gravity_friction_and_ripple(joint):
    folder, _, names, verdict = joint
    stamps = np.loadtxt(folder / "log.csv", delimiter=",")[:, 0]
    assert np.ptp(np.diff(stamps)) > 1e-3
    assert verdict["status"] == "named"
    found = {effect["name"]: size_of(effect) for effect in verdict["effects"]}
    assert list(found) == list(names["TRUTH"])
    for effect, truth in names["TRUTH"].items():
        lower, upper = found[effect]["interval95"]
        assert lower <= truth <= upper, effect
    (sentence,) = re.findall(r"gravity is (\S+), dry friction (\S+) and the ripple (\S+) N.m", PAGE)
    for shown, size in zip(sentence, found.values(), strict=True):
        assert float(shown) == pytest.approx(size["value"], abs=1.01 * last_digit(shown))


def test_corrected_joint_predicts_what_was_held_out(joint):
    (balance,) = (gap for gap in joint[3]["held_out"] if gap["kind"] == "balance")
    assert balance["before"] > 10.0 * balance["noise_floor"]
    assert balance["after"] < 0.05 * balance["before"]


def test_page_lists_the_library():
    rows = re.findall(r"^\| (`\w+`.*?) \|", PAGE.split("| effect |")[1], flags=re.MULTILINE)
    listed = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    # A clearance that varies belongs to the mesh of a drive, and is looked for there only; and what
    # is a form of another alone is tried in drives only.
    # So is damping by the load that a mesh passes on.
    of_drives = {
        *("clearance_variation", "shear_thinning_drag", "bouc_wen_hysteresis"),
        "load_dependent_damping",
    }
    assert sorted(listed) == sorted({one.name for one in law_effects()} - of_drives)


def test_every_block_is_checked_here():
    languages = re.findall(r"^```(\w+)\n", PAGE, flags=re.MULTILINE)
    assert sorted(languages) == [*["sh"] * 2, "text", *["toml"] * 2]
    joint, command = (shlex.split(block) for block in blocks("sh"))
    assert joint == ["python", "docs/examples/own_joint.py", "my_joint"]
    assert "`python docs/examples/own_rig.py my_rig`" in PAGE
    options = cli._parser().parse_args(command[1:])
    assert (command[0], options.campaign, options.out) == (
        "pymoo-hdte", Path("my_rig"), Path("my_rig/report"),
    )  # fmt: skip
