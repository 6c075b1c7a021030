"""The README's Python runs as printed, and prints what it says."""

import contextlib
import io
import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def output_of(snippet: str) -> str:
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        exec(compile(snippet, "README.md", "exec"), {})
    return text.getvalue().strip()


def test_study_prints_what_the_readme_says():
    printed = output_of(SNIPPETS[0])
    assert re.search(r"prints `(.*?)`", README).group(1) == printed


def test_the_swarm_to_use_prints_what_the_readme_says():
    assert re.findall(r"prints `(.*?)`", README)[1] == output_of(SNIPPETS[1])


def test_both_solvers_of_the_drive_snippet_agree():
    steady, integrated = (float(line.strip("[]")) for line in output_of(SNIPPETS[2]).split("\n"))
    assert integrated == pytest.approx(steady, rel=5e-3)
    assert integrated != pytest.approx(steady, rel=1e-4)


def test_the_friction_of_another_machine_is_named():
    printed = output_of(SNIPPETS[3])
    assert printed.startswith("named")
    level = float(re.search(r"CoulombFriction\(level=([\d.]+)\)", printed).group(1))
    assert level == pytest.approx(0.3, rel=0.01)


def test_every_snippet_is_run_here():
    assert len(SNIPPETS) == 4
