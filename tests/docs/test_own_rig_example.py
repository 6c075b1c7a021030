"""The example of a rig of one's own finds what it hides, and its page shows that output."""

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
from scipy.integrate import solve_ivp

from pymoo_hdte.cli import __main__ as cli
from pymoo_hdte.discrepancy.mechanism.files import read_rig
from pymoo_hdte.mechanism.effects import law_effects

EXAMPLE = DOCS / "examples" / "own_rig.py"
PAGE = (DOCS / "bring_your_own_rig.md").read_text(encoding="utf-8")
HIDDEN = "hardening_stiffness: coefficient"
CUT = "..."
"""End of a line of the page that leaves out the rest of what is printed."""
JOINT = {"inertia": 0.4, "damping": 2.0, "friction": 1.5, "gain": 7.6}


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


def run_example(folder):
    """Return what the example prints, and the names it defines."""
    text = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(text):
        patch.setattr(sys, "argv", [str(EXAMPLE), str(folder)])
        names = runpy.run_path(str(EXAMPLE), run_name="__main__")
    return text.getvalue(), names


@kept
def example():
    """Return what the example prints, two of the names it defines and its files, by their path."""
    with TemporaryDirectory() as top:
        folder = Path(top) / "my_rig"
        printed, names = run_example(folder)
        files = {
            path.relative_to(folder): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file()
        }
    names = {name: names[name] for name in ("TRUTH", "RIG")}
    return printed.replace(str(folder), "my_rig"), names, files


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """The folder of the example, what it printed, its names and its verdict."""
    folder = tmp_path_factory.mktemp("example") / "my_rig"
    printed, names, files = example()
    put_files(files, folder)
    verdict = json.loads((folder / "report" / "verdict.json").read_text(encoding="utf-8"))
    return folder, printed, names, verdict


@pytest.fixture
def at_the_rig(rig, monkeypatch):
    """The folder of the example as the working directory, with the record of a joint."""
    monkeypatch.chdir(rig[0])
    if not Path("joint.csv").exists():
        np.savetxt(
            "joint.csv", joint_record(), "%.5f", ",", header="time_s,current_A,angle_deg",
            comments="",
        )  # fmt: skip
    return rig[0]


def read_block(folder, block):
    """Return the rig of a block of the page, with the records of a folder."""
    path = folder / "block.toml"
    path.write_text(block, encoding="utf-8")
    try:
        return read_rig(path)
    finally:
        path.unlink()


def joint_record():
    """Return s, A and degrees, (n, 3), of a joint with dry friction that moves both ways."""
    generator = np.random.default_rng(2)
    time, orders = np.arange(6000) / 500.0, np.arange(1, 31)
    phases = generator.uniform(0.0, 2.0 * np.pi, orders.size)

    def current(t):
        return 0.35 * np.cos(2.0 * np.pi * 0.1 * orders * t + phases).sum()

    def motion(t, state):
        friction = JOINT["friction"] * np.tanh(state[1] / 1e-3)
        torque = JOINT["gain"] * current(t) - JOINT["damping"] * state[1] - friction
        return state[1], torque / JOINT["inertia"]

    angle = solve_ivp(motion, time[[0, -1]], (0, 0), "LSODA", time, rtol=1e-8, atol=1e-10).y[0]
    rows = np.column_stack([time, [current(t) for t in time], np.rad2deg(angle)])
    return rows + [0.0, 0.01, 0.001] * generator.standard_normal(rows.shape)


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
        assert gap["before"] > 10.0 * gap["noise_floor"]
        assert gap["after"] < 0.2 * gap["before"]
        assert gap["shrinkage"] > 0.8


def test_a_folder_with_files_is_left_alone(rig):
    before = {path: path.stat().st_mtime_ns for path in rig[0].rglob("*")}
    with pytest.raises(SystemExit, match="is not empty"):
        run_example(rig[0])
    assert before == {path: path.stat().st_mtime_ns for path in rig[0].rglob("*")}


def test_page_shows_what_the_example_prints(rig):
    (shown,) = blocks("text")
    shown, printed = (text.strip().split("\n") for text in (shown, rig[1]))
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


def test_page_prints_the_rig_of_the_example(rig):
    assert blocks("toml")[0] == rig[2]["RIG"] == (rig[0] / "rig.toml").read_text(encoding="utf-8")


def test_every_toml_block_is_read(at_the_rig):
    table, joint = (read_block(at_the_rig, block) for block in blocks("toml"))
    found = {record.name: record.role for record in table.records}
    assert found == {"multisine": "train", "sweep": "held_out"}
    # Millimetres have become metres, degrees radians.
    assert 0.01 < np.abs(table.records[0].channels["position"]).max() < 0.1
    (record,) = joint.records
    degrees = np.loadtxt("joint.csv", delimiter=",", skiprows=1)[:, 2]
    np.testing.assert_allclose(record.channels["angle"], np.deg2rad(degrees))


@pytest.mark.nightly
def test_every_python_block_runs_and_prints_what_the_page_says(at_the_rig):
    names, printed = {}, []
    for block in blocks("python"):
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            exec(compile(block, "bring_your_own_rig.md", "exec"), names)
        printed.append(text.getvalue().strip())
    assert printed == re.findall(r"prints\s`(.*?)`", PAGE)
    for name, block in zip(("table", "joint"), blocks("toml"), strict=True):
        assert read_block(at_the_rig, block).mechanism == names[name], name
    # The second block is left with the joint.
    (friction,) = names["analysis"].verdict.accepted.effects
    assert friction.name == "coulomb_friction"
    assert friction.law.level == pytest.approx(JOINT["friction"], rel=0.03)


def test_page_lists_the_library():
    rows = re.findall(r"^\| (`\w+`.*?) \|", PAGE.split("| effect |")[1], flags=re.MULTILINE)
    listed = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    # A clearance that varies belongs to the mesh of a drive, and is looked for there only.
    assert sorted(listed) == sorted({one.name for one in law_effects()} - {"clearance_variation"})


def test_every_block_is_checked_here():
    languages = re.findall(r"^```(\w+)\n", PAGE, flags=re.MULTILINE)
    assert sorted(languages) == [*["python"] * 2, *["sh"] * 2, "text", *["toml"] * 2]
    example, command = (shlex.split(block) for block in blocks("sh"))
    assert example == ["python", "docs/examples/own_rig.py", "my_rig"]
    options = cli._parser().parse_args(command[1:])
    assert (command[0], options.campaign, options.out) == (
        "pymoo-hdte", Path("my_rig"), Path("my_rig/report"),
    )  # fmt: skip
