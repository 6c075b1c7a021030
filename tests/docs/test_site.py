"""The site: public names in groups of the reference, examples of the README, how to cite."""

import re
import sys
from collections import Counter
from importlib import import_module
from typing import get_type_hints

import pytest
from places import DOCS, PACKAGE, ROOT
from public_names import PACKAGES

import pymoo_hdte
from pymoo_hdte.algorithms import ParticleSwarm

PAGES = {path.stem: path.read_text(encoding="utf-8") for path in (DOCS / "reference").glob("*.md")}
LISTED = Counter(
    name
    for page in PAGES.values()
    for block in re.findall(r"autosummary::\n   :toctree: names\n\n(.*?)```", page, re.DOTALL)
    for name in block.replace("~", "").split()
)
PUBLIC = {
    f"{package}.{name}"
    for package in PACKAGES
    for name in import_module(f"pymoo_hdte.{package}").__all__
}


def as_public(name):
    """Return the name by package: a constant is listed by the module that has its docstring."""
    parts = name.split(".")
    return f"{parts[1]}.{parts[-1]}"


def test_every_public_name_is_in_exactly_one_group():
    assert {as_public(name) for name in LISTED} == PUBLIC
    assert {*Counter(map(as_public, LISTED.elements())).values()} == {1}


def test_every_package_for_users_is_in_the_reference():
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    # Those serve the command line and extensions, which have pages of their own.
    assert packages - {"cli", "_io", "effects", "_reports", "_runner", "_comparing"} <= {*PACKAGES}


@pytest.mark.parametrize("name", sorted(LISTED))
def test_a_listed_name_is_imported_from_where_its_page_says(name):
    module, _, last = name.rpartition(".")
    package, public = as_public(name).split(".")
    shown = getattr(import_module(module), last)
    assert shown is getattr(import_module(f"pymoo_hdte.{package}"), public)


def test_what_a_part_of_the_swarm_must_offer_is_in_the_reference():
    hints = get_type_hints(ParticleSwarm.__init__)
    types = {kind for hint in hints.values() for kind in (hint, *getattr(hint, "__args__", ()))}
    protocols = {kind for kind in types if getattr(kind, "_is_protocol", False)}
    assert len(protocols) == 3
    for kind in protocols:
        shown = f".. autoclass:: {kind.__module__}.{kind.__name__}\n"
        assert sum(page.count(shown) for page in PAGES.values()) == 1


def test_every_group_has_its_task_on_the_front_page_of_the_reference():
    for page in {*PAGES} - {"index"}:
        assert re.search(rf"^\| .+ \| \[.+\]\({page}\.md\) \|$", PAGES["index"], re.MULTILINE)
        assert f"\n{page}\n" in PAGES["index"]


@pytest.fixture
def readme_code(monkeypatch):
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(DOCS / "_extensions")
    monkeypatch.delitem(sys.modules, "readme_code", raising=False)
    return import_module("readme_code")


def test_the_front_page_shows_the_tested_examples_of_the_readme(readme_code):
    front = (DOCS / "index.md").read_text(encoding="utf-8")
    words = re.findall(r"```{readme-code} (.*)\n", front)
    readme = readme_code.README.read_text(encoding="utf-8")
    languages = [readme_code.block_with(word, readme)[0] for word in words]
    assert languages == ["python", "python", "sh"]
    assert all(readme_code.block_with(word, readme)[2] for word in words)
    shown = re.findall(r"^```{image} (\w+\.png)$", front, re.MULTILINE)
    assert shown == re.findall(r"\(docs/(\w+\.png)\)", readme)


def test_a_word_of_no_block_or_of_two_is_an_error(readme_code):
    text = "```sh\none\n```\n\n```sh\none two\n```\n"
    assert readme_code.block_with("two", text) == ("sh", "one two", "")
    for word in ("one", "three"):
        with pytest.raises(ValueError, match="unpack"):
            readme_code.block_with(word, text)


def test_the_citation_is_that_of_this_version():
    page = (DOCS / "cite.md").read_text(encoding="utf-8")
    cff = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    for version in (
        re.search("version = {(.*)}", page)[1],
        re.search("(?m)^version: (.*)", cff)[1],
    ):
        assert version == pymoo_hdte.__version__
    assert re.search("doi: (.*)", cff)[1] in page
