"""What "Bring your own rig" tells one to type finds what its example hides, as the page shows."""

import contextlib
import io
import json
import re
import runpy
import shlex
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from kept_results import kept, put_files
from places import DOCS
from printed_text import assert_shows

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.mechanism.effects import law_effects

PAGE = (DOCS / "bring_your_own_rig.md").read_text(encoding="utf-8")
SCRIPT = DOCS / "examples" / "own_joint.py"
FOLDER = "my_joint"


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


def run_script(folder):
    """Write the log of the example."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [str(SCRIPT), str(folder)])
        runpy.run_path(str(SCRIPT), run_name="__main__")


def corrected(draft):
    """Return a draft in which the lines of the page replace those that are commented out."""
    (lines,) = blocks("toml")
    for line in lines.splitlines():
        key = line.split(" = ")[0]
        draft, count = re.subn(rf"^# {key} = .*$", line, draft, flags=re.MULTILINE)
        assert count == 1, key
    return draft


@kept
def typed():
    """Return what each command of the page prints, and the files that they leave, by their path."""
    printed = []
    with TemporaryDirectory() as top, contextlib.chdir(top):
        for block in blocks("sh"):
            for line in block.splitlines():
                program, *arguments = shlex.split(line)
                text = io.StringIO()
                with contextlib.redirect_stdout(text):
                    if program == "python":
                        run_script(arguments[-1])
                    else:
                        assert cli.main(arguments) == 0, line
                printed.append(text.getvalue())
            if len(printed) == 2:
                rig = Path(FOLDER, "rig.toml")
                rig.write_text(corrected(rig.read_text(encoding="utf-8")), encoding="utf-8")
        files = {
            path.relative_to(FOLDER): path.read_bytes()
            for path in Path(FOLDER).rglob("*")
            if path.is_file()
        }
    return printed, files


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    """Folder of the example, what was printed, and the verdict."""
    printed, files = typed()
    folder = tmp_path_factory.mktemp("example") / FOLDER
    put_files(files, folder)
    verdict = json.loads((folder / "report" / "verdict.json").read_text(encoding="utf-8"))
    return folder, printed, verdict


@pytest.fixture(scope="module")
def truth():
    """Sizes of the effects that the log hides, N.m."""
    return runpy.run_path(str(SCRIPT))["TRUTH"]


def size_of(effect):
    """Return the torque of an effect with its interval."""
    (size,) = {"torque", "level", "amplitude"} & set(effect["parameters"])
    return effect["parameters"][size]


@pytest.mark.slow
def test_a_folder_with_files_is_left_alone(joint):
    before = {path: path.stat().st_mtime_ns for path in joint[0].rglob("*")}
    with pytest.raises(SystemExit, match="is not empty"):
        run_script(joint[0])
    assert before == {path: path.stat().st_mtime_ns for path in joint[0].rglob("*")}


@pytest.mark.slow
def test_page_shows_what_its_commands_print(joint):
    outputs = [text for text in joint[1] if text]
    for block, output in zip(blocks("text"), outputs, strict=True):
        assert_shows(block, output)


@pytest.mark.slow
def test_raw_log_of_a_joint_shows_gravity_friction_and_ripple(joint, truth):
    folder, _, verdict = joint
    stamps = np.loadtxt(folder / "log.csv", delimiter=",")[:, 0]
    assert np.ptp(np.diff(stamps)) > 1e-3
    assert verdict["status"] == "named"
    sizes = {effect["name"]: size_of(effect) for effect in verdict["effects"]}
    assert list(sizes) == list(truth)
    for effect, true in truth.items():
        lower, upper = sizes[effect]["interval95"]
        assert lower <= true <= upper, effect


@pytest.mark.slow
def test_corrected_joint_predicts_what_was_held_out(joint):
    (balance,) = (error for error in joint[2]["held_out"] if error["kind"] == "balance")
    assert balance["before"] > 10.0 * balance["noise_floor"]
    assert balance["after"] < 0.05 * balance["before"]


def test_page_lists_the_library():
    rows = re.findall(r"^\| (`\w+`.*?) \|", PAGE.split("| effect |")[1], flags=re.MULTILINE)
    listed = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    # Some laws belong to a drive and its bench, and are looked for there only.
    of_drives = {
        *("clearance_variation", "shear_thinning_drag", "bouc_wen_hysteresis"),
        *("load_dependent_damping", "uneven_load_sharing"),
        *("brake_ripple", "cogging", "coupling_ripple", "warming"),
    }
    assert sorted(listed) == sorted({effect.name for effect in law_effects()} - of_drives)


def test_every_block_is_checked_here():
    languages = re.findall(r"^```(\w+)\n", PAGE, flags=re.MULTILINE)
    assert sorted(languages) == [*["sh"] * 2, *["text"] * 2, "toml"]
