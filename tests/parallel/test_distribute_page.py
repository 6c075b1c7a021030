"""The snippet of the page on several machines runs as printed, and goes on from its file."""

import re
import subprocess
import sys

from places import ROOT


def test_the_snippet_runs_as_printed_and_goes_on_from_its_file(tmp_path):
    page = (ROOT / "docs" / "distribute.md").read_text(encoding="utf-8")
    (snippet,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    assert len([line for line in snippet.splitlines() if line]) <= 10
    (tmp_path / "study.py").write_text(snippet)
    said = [
        subprocess.run(
            [sys.executable, "study.py"], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout
        for _ in range(2)
    ]
    # Two designs may be the same: then the second one is known.
    counts = [
        tuple(map(int, re.findall(r"(\d+) (?:designs evaluated|taken)", one))) for one in said
    ]
    assert sum(counts[0]) == 100
    assert counts[0][0] > 90
    assert counts[1] == (0, 100)
