"""Texts of pages from templates."""

import re

import pytest
from jinja2 import UndefinedError
from places import ROOT

from experiments.runner.texts import paragraphs

EXPERIMENTS = ROOT / "experiments"


def test_paragraphs_stand_on_one_line_each_with_their_blanks_filled():
    setting, left_out = paragraphs("cards", direct="This", of_direct="a, b", gap=0.5)
    assert left_out.startswith("This takes 20 ms a design: it has the least budget only, and a, b.")
    for text in (setting, left_out):
        assert not re.search(r"\n|  |[{}]", text)


def test_a_blank_without_a_value_is_refused():
    with pytest.raises(UndefinedError, match="of_direct"):
        paragraphs("cards", direct="This", gap=0.5)


def test_every_text_is_read_by_one_module():
    sources = [path.read_text() for path in EXPERIMENTS.rglob("*.py")]
    for text in (EXPERIMENTS / "templates" / "texts").glob("*.txt"):
        call = re.compile(rf'paragraphs\(\s*"{text.stem}"')
        assert sum(bool(call.search(source)) for source in sources) == 1, text.name
