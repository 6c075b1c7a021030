"""Every public name has an example in its docstring, which prints what it says."""

import doctest
import inspect
import re
import shutil
import warnings
from importlib import import_module

import numpy as np
import pytest
from places import DOCS
from public_names import PACKAGES, public_constants, public_objects
from small_campaigns import small_campaign

from pymoo_hdte.discrepancy import write_campaign

CONSTANTS = public_constants()
NAMES = sorted({".".join(name.split(".")[:2]) for name in public_objects()} | {*CONSTANTS})
PUBLIC = {
    name: getattr(module, name)
    for module in map(import_module, (f"pymoo_hdte.{package}" for package in PACKAGES))
    for name in module.__all__
}


def examples_of(name):
    # Python 3.13 takes the indentation of docstrings away, older ones leave it.
    text = inspect.cleandoc(CONSTANTS.get(name) or public_objects()[name].__doc__)
    return text.partition("\nExamples\n")[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files that examples read: the drive of the guides, limits of a rig and a campaign."""
    place = tmp_path_factory.mktemp("examples")
    for file in ("my_drive.toml", "my_drive_model.toml"):
        shutil.copy(DOCS / "examples" / file, place)
    page = (DOCS / "command_line.md").read_text(encoding="utf-8")
    (place / "bench.toml").write_text(re.search(r"```toml\n(input_speeds.*?)```", page, re.S)[1])
    write_campaign(small_campaign(), place / "campaign")
    return place


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_example_of(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    text = examples_of(name)
    assert ">>> " in text
    found = doctest.DocTestParser().get_doctest(text, {"np": np} | PUBLIC, name, None, 0)
    for example in found.examples:
        compile(example.source, name, "single")
    printed = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runner = doctest.DocTestRunner(verbose=False)
        failed, _ = runner.run(found, out=printed.append)
    assert not failed, "".join(printed)


def test_few_examples_are_not_run():
    """Those that take long or begin with files of the reader's."""
    skipped = [name for name in NAMES if "# doctest: +SKIP" in examples_of(name)]
    assert len(skipped) <= 16
