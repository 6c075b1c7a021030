"""The glossary has the words that reports use, once, and every report ends with those it needs."""

import re
from itertools import chain

import pytest
from places import PACKAGE

from pymoo_hdte._reports.glossary import GLOSSARY, terms_of
from pymoo_hdte._reports.html import page
from pymoo_hdte.discrepancy._selection.verdict import STATUSES

REPORTS = {
    path.name: path.read_text(encoding="utf-8")
    for path in PACKAGE.rglob("*.html.j2")
    if "<html" in path.read_text(encoding="utf-8")
}
WORDS = {
    *("adequate", "base", "nominal", "box", "class", "fading", "front", "IGD", "locked stiffness"),
    *("partial", "Spacing", "surrogate", "unlisted", "utopia distance"),
}


def test_a_term_stands_in_one_chapter_and_in_order():
    for terms in GLOSSARY.values():
        assert list(terms) == sorted(terms, key=str.lower)
    every = [*chain(*GLOSSARY.values())]
    assert len(every) == len({*every})
    assert list(terms_of(*GLOSSARY)) == sorted(every, key=str.lower)


def test_the_words_that_readers_stumbled_over_are_there():
    assert {*terms_of(*GLOSSARY)} >= WORDS


def test_every_status_has_a_meaning():
    for status in STATUSES:
        assert terms_of("Verdicts on a model")[status].startswith("a verdict: ")


def test_every_report_ends_with_a_glossary():
    assert len(REPORTS) == 8
    for text in REPORTS.values():
        end = re.search(r"{% set chapters = \[(.*)\] %}\n{% include \"glossary", text)
        assert end
        assert {*re.findall('"(.*?)"', end[1])} <= {*GLOSSARY}


@pytest.mark.parametrize("chapter", GLOSSARY)
def test_a_page_that_says_everything_has_every_term(chapter):
    said = " ".join([*terms_of(chapter), *(f"Verdict: {status}." for status in STATUSES)])
    drawn = page("pymoo_hdte._reports", "glossary.html.j2", chapters=[chapter], body=said)
    assert re.findall("<dt>(.*?)</dt>", drawn) == list(terms_of(chapter))


@pytest.mark.parametrize(
    ("text", "terms"),
    [
        ("Nothing.", []),
        ("Named.", []),
        ("<i class='misfit'>Records</i>", ["record"]),
        ("recording", []),
        ("<b>Verdict: class</b>The rest.", ["class", "record"]),
    ],
)
def test_a_page_has_the_terms_it_uses_and_those_of_their_meanings(text, terms):
    chapters = ["Drives and mechanisms", "Verdicts on a model"]
    drawn = page("pymoo_hdte._reports", "glossary.html.j2", chapters=chapters, body=text)
    found = re.findall("<dt>(.*?)</dt>", drawn)
    assert found == terms
