"""Python and commands of README and its pages run as printed; pictures come out."""

import contextlib
import io
import json
import re
import shlex
from itertools import product
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from drawn_pictures import drawn_and_stored
from places import PAGES, README, ROOT, WORDS

from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import optimum_report
from pymoo_hdte.drive import harmonic_balance
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.units import ARCSEC

SNIPPETS = re.findall(r"```python\n(.*?)```", README + PAGES, flags=re.DOTALL)
COMMANDS = re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)


def output_of(snippet: str) -> str:
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        exec(compile(snippet, "README.md", "exec"), {})
    return text.getvalue().strip()


SAID = re.findall(r"prints `(.*?)`", README + PAGES)


def test_anyones_simulator_prints_what_the_readme_says():
    assert SAID[0] == output_of(SNIPPETS[0])
    assert len([line for line in SNIPPETS[0].splitlines() if line]) <= 12


def test_study_prints_what_the_readme_says():
    assert SAID[1] == output_of(SNIPPETS[1])


def test_the_friction_of_another_machine_is_named():
    printed = output_of(SNIPPETS[2])
    beginning, _ = SAID[2].split("...")
    assert printed.startswith(beginning)
    assert float(beginning.split("=")[1]) == pytest.approx(0.3, rel=0.01)


def test_both_solvers_of_the_drive_snippet_agree():
    steady, integrated = (float(line.strip("[]")) for line in output_of(SNIPPETS[3]).split("\n"))
    assert integrated == pytest.approx(steady, rel=5e-3)
    assert integrated != pytest.approx(steady, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "words"), [("calibrated", "up to {} % over"), ("resonant", "({} % in `resonant`)")]
)
def test_how_much_the_input_angle_fluctuates(name, words):
    problem = RobustDTE(name)
    model = problem.model
    corners = np.array(list(product(*zip(problem.xl, problem.xu, strict=True))))
    inside = np.random.default_rng(1).uniform(problem.xl, problem.xu, (100, 4))
    rows = np.vstack([problem.nominal, corners, inside])
    designs = np.column_stack([np.full(len(rows), model.nominal[0]), rows])
    free = harmonic_balance(model.coefficients(designs)).spectrum()
    above = free.peak_to_peak(model.sheet.ratio) / ARCSEC / model.dte_arcsec(designs) - 1.0
    assert words.format(f"{100.0 * np.abs(above).max():.2f}") in WORDS
    assert name != "calibrated" or f"differ by {100.0 * above[0]:.2f} % here" in WORDS


def test_every_snippet_is_run_here():
    assert len(SNIPPETS) == 4


def commands_for_a_design():
    """Return the arguments of the commands that optimise a drive and simulate the optimum."""
    lines = [line for block in COMMANDS for line in block.splitlines()]
    return [
        shlex.split(line)[1:]
        for line in lines
        if "pymoo-hdte optimise" in line or "simulate" in line
    ]


def test_the_simulation_takes_what_the_optimisation_wrote():
    optimise, simulate = commands_for_a_design()
    out = Path(cli._parser().parse_args(optimise).out)
    sheet, _, model = simulate[1:4]
    assert {Path(sheet), Path(model)} <= {out / name for name in optimum_report.FOLDER.files}
    cli._parser().parse_args(simulate)


@pytest.mark.nightly
def test_the_commands_for_a_design_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for arguments in commands_for_a_design():
        assert cli.main(arguments) == 0
    found = json.loads((tmp_path / "reports" / "optimum" / "optimum.json").read_text())
    before, after = found["initial"], found["designs"]["balanced"]
    for name in ("mean_dte_arcsec", "std_dte_arcsec"):
        assert after[name] < before[name]
    assert (tmp_path / "reports" / "simulation" / "report.html").is_file()


def campaign_to_try():
    """Return the script that makes the campaign, its folder and the arguments of the command."""
    make, look = next(block for block in COMMANDS if "virtual_campaign" in block).splitlines()
    (_, script, folder), (_, *arguments) = shlex.split(make), shlex.split(look)
    return script, folder, arguments


def test_the_command_looks_at_the_campaign_that_is_made():
    script, folder, arguments = campaign_to_try()
    compile((ROOT / script).read_text(), script, "exec")
    assert cli._parser().parse_args(arguments).campaign == Path(folder)


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 100


@pytest.mark.nightly
def test_the_picture_of_the_beams_is_drawn_by_its_script(tmp_path):
    pictures = drawn_and_stored(ROOT / "docs" / "beam_picture.py", tmp_path)
    drawn, stored = (np.asarray(picture, float) for picture in pictures)
    assert np.mean(np.abs(drawn - stored)) < 0.5


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """The picture of the drive, drawn now and as it is stored."""
    script = ROOT / "docs" / "robust_design_picture.py"
    return drawn_and_stored(script, tmp_path_factory.mktemp("picture"))


def _parted(text):
    """The words of a description, and its numbers."""
    numbers = r"\d+\.\d+"
    return re.sub(numbers, "", text), [float(one) for one in re.findall(numbers, text)]


def test_the_picture_of_the_drive_says_what_its_script_finds(pictures):
    drawn, stored = pictures
    words, values = zip(*(_parted(one.text["Description"]) for one in pictures), strict=True)
    assert words[0] == words[1]
    # Another processor rounds otherwise, so that the search ends at a design beside the stored one.
    np.testing.assert_allclose(*values, rtol=0.02)
    assert drawn.size == stored.size


@pytest.mark.skipif(
    matplotlib.__version_info__ < (3, 11), reason="matplotlib lays it out otherwise before 3.11"
)
def test_the_picture_of_the_drive_is_drawn_by_its_script(pictures):
    drawn, stored = (np.asarray(picture, float) for picture in pictures)
    assert np.mean(np.abs(drawn - stored)) < 0.5


def test_pictures_of_the_readme_exist_and_are_small():
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README)
    assert len(pictures) == 3
    assert sum((ROOT / name).stat().st_size for name in pictures) < 300_000


def test_links_lead_to_files():
    for target in re.findall(r"\]\((?!http)(.*?)\)", README):
        assert (ROOT / target).exists()
