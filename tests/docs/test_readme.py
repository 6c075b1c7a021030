"""Python of README and its pages runs as printed; pictures are of the runs that print the text."""

import contextlib
import io
import re

import matplotlib
import numpy as np
import pytest
from PIL import Image
from places import DOCS, PAGES, README, ROOT
from printed_text import assert_shows
from readme_examples import example

SNIPPETS = re.findall(r"```python\n(.*?)```", README + PAGES, flags=re.DOTALL)
COMPARED, VERDICT = re.findall(r"```text\n(.*?)```", README, flags=re.DOTALL)
SHOWN = {
    "beam.png": re.findall(r"prints `(.*?)`", README),
    "fronts.png": COMPARED.splitlines(),
    "verdict.png": VERDICT.splitlines(),
}
"""Lines that the README says are printed, by the picture that the same run gives."""


def named_examples():
    """Return the pictures' names; a swarm goes other ways where another NumPy rounds otherwise."""
    older = np.lib.NumpyVersion(np.__version__) < "2.4.0"
    skip = pytest.mark.skipif(older, reason="printed with NumPy 2.4 or later")
    return [pytest.param(name, marks=[skip] * (name == "fronts.png")) for name in sorted(SHOWN)]


def output_of(snippet: str) -> str:
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        exec(compile(snippet, "README.md", "exec"), {})
    return text.getvalue().strip()


@pytest.mark.slow
@pytest.mark.parametrize("name", named_examples())
def test_an_example_prints_what_the_readme_says(name):
    printed, _ = example(name)
    assert SHOWN[name]
    for line in SHOWN[name]:
        assert line in printed.splitlines(), printed


@pytest.mark.parametrize("name", named_examples())
def test_a_picture_is_of_the_run_that_prints_the_text(name):
    """The picture of a report was once older than the report, and kinder."""
    printed, drawn = example(name)
    stored = Image.open(DOCS / name)
    assert_shows(stored.text["Description"], printed)
    if matplotlib.__version_info__ >= (3, 11):  # Before, it lays pictures out otherwise.
        pixels = [np.asarray(image, float) for image in (stored, Image.open(io.BytesIO(drawn)))]
        assert np.mean(np.abs(pixels[0] - pixels[1])) < 0.5


def test_an_example_is_short():
    for block in SNIPPETS[:2]:
        assert len([line for line in block.splitlines() if line]) <= 12


def test_the_friction_of_another_machine_is_named():
    printed = output_of(SNIPPETS[2])
    beginning, _ = re.search(r"prints `(.*?)`", PAGES)[1].split("...")
    assert printed.startswith(beginning)
    assert float(beginning.split("=")[1]) == pytest.approx(0.3, rel=0.01)


def test_every_snippet_is_run_here():
    assert len(SNIPPETS) == 3


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 100


def test_pictures_of_the_readme_exist_and_are_small():
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README)
    assert sorted(pictures) == sorted(f"docs/{name}" for name in SHOWN)
    assert sum((ROOT / name).stat().st_size for name in pictures) < 300_000


def test_links_lead_to_files_and_headings():
    titles = re.findall(r"^## (.+)$", README, flags=re.MULTILINE)
    headings = {re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles}
    for target in re.findall(r"\]\((?!http)(.*?)\)", README):
        assert target.removeprefix("#") in headings or (ROOT / target).exists()
