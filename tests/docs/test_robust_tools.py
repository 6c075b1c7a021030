"""The table of other tools: its rows are whole, its links are defined, and its tests exist."""

import re

from places import DOCS, ROOT

PAGE = (DOCS / "robust_tools.md").read_text(encoding="utf-8")
HEAD, _, *ROWS = [
    [cell.strip() for cell in line.strip("|").split(" | ")]
    for line in re.findall(r"^\|.*\|$", PAGE, re.M)
]


def test_every_cell_of_the_table_is_filled():
    assert len(ROWS) > 20
    for row in ROWS:
        assert len(row) == len(HEAD)
        assert all(row[:-1])


def test_every_link_is_defined_once_and_used():
    defined = re.findall(r"^\[([a-z-]+)\]: https://", PAGE, re.M)
    assert len(set(defined)) == len(defined)
    assert set(re.findall(r"\]\[([a-z-]+)\]", PAGE)) == set(defined)


def test_what_others_offer_has_a_link_or_is_a_dash():
    for row in ROWS[:-1]:
        assert all(cell == "\N{EN DASH}" or "][" in cell for cell in row[2:-1])


def test_what_is_here_has_a_test_that_exists():
    for row in ROWS[:-1]:
        (path,) = re.findall(r"`(\S+)`", row[-1]) or [None]
        assert path is None or (ROOT / path).exists()
        assert row[1].startswith("no") == (path is None)
