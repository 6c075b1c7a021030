"""The snippet of the page on several machines runs as printed, and goes on from its file."""

import re
import subprocess
import sys

import pytest
from places import ROOT

TWICE = "import runpy\nfor _ in range(2):\n    runpy.run_path('study.py', run_name='__main__')"


def said(*arguments, folder):
    page = (ROOT / "docs" / "distribute.md").read_text(encoding="utf-8")
    (snippet,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    assert len([line for line in snippet.splitlines() if line]) <= 10
    (folder / "study.py").write_text(snippet)
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def assert_gone_on(first, second):
    counts = [
        tuple(map(int, re.findall(r"(\d+) (?:designs evaluated|taken)", one)))
        for one in (first, second)
    ]
    # Two designs may be the same: then the second one is known.
    assert sum(counts[0]) == 100
    assert counts[0][0] > 90
    assert counts[1] == (0, 100)


@pytest.mark.slow
def test_the_snippet_runs_as_printed_and_goes_on_from_its_file(tmp_path):
    assert_gone_on(*said("-c", TWICE, folder=tmp_path).splitlines())


@pytest.mark.nightly
def test_the_snippet_goes_on_in_another_process(tmp_path):
    assert_gone_on(*[said("study.py", folder=tmp_path) for _ in range(2)])
