"""The titles of a table of text: on which line they stand, what separates them, and their units."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from pymoo_hdte.checks import InvalidInput

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": None}
"""What separates cells, by name; ``space`` is any white space."""

MOST_LINES_ABOVE = 200
"""Number of lines in which the titles are sought."""

AROUND = ' \t"'
"""Characters that may stand around a number or a title in its cell."""


@dataclass(frozen=True)
class Header:
    """What is known of a table before its rows are read.

    ``line`` is that of the titles, from 1; ``skip`` counts the rows below it that hold no numbers,
    ``units`` has the cells of a row of units by title.
    """

    titles: list[Any]
    line: int
    mark: str | None
    skip: int
    units: dict[str, str] = field(default_factory=dict)


def plain_header(
    numbers: Sequence[int], lines: Sequence[str], delimiter: str | None, skip_rows: int
) -> Header:
    """Return the numbers of the columns of a table without titles, by its first row."""
    top, line = (lines[0], numbers[0]) if lines else ("", 1)
    mark = next((character for character in ",;" if character in top), None)
    mark = mark if delimiter is None else DELIMITERS[delimiter]
    return Header(list(range(len(top.split(mark)))), line, mark, skip_rows)


def numbered_header(
    numbers: Sequence[int],
    lines: Sequence[str],
    delimiter: str | None,
    skip_rows: int,
    columns: Sequence[int],
) -> Header:
    """Return made titles, `numbered`, of a CSV file whose columns are called by numbers.

    Its rows begin with the first line that has a number in each of these columns, counted from 0;
    titles above it, if any, are not read.
    """
    for line, text in zip(numbers, lines[:MOST_LINES_ABOVE], strict=False):
        # A comma may be that of decimals: it separates cells only where nothing else does.
        present: list[str | None] = [mark for mark in ";\t," if mark in text]
        for mark in _marks(text, delimiter) if delimiter is not None else present[:1] or [","]:
            cells = [cell.strip(AROUND) for cell in text.split(mark)]
            if max(columns) < len(cells) and all(begins_as_number(cells[at]) for at in columns):
                titles = [numbered(at) for at in range(len(cells))]
                return Header(titles, line - 1, mark, skip_rows)
    top = lines[0] if lines else ""
    mark = _marks(top, delimiter)[0]
    return Header([numbered(at) for at in range(len(top.split(mark)))], 0, mark, skip_rows)


def numbered(column: int) -> str:
    """Return the title of a column without one."""
    return f"column {column}"


def titled_header(
    file: str,
    numbers: Sequence[int],
    lines: Sequence[str],
    delimiter: str | None,
    skip_rows: int,
    wanted: Sequence[str],
) -> Header:
    """Return the titles of a CSV file among its first lines.

    They are on the first line that has each of the wanted once; without such a line on the one that
    has most of them, of these on the one with most words, so that an error can show it; without
    wanted ones on the first line.

    Raises
    ------
    InvalidInput
        For a line that is no CSV text.
    """
    best, at = Header([], 1, ",", skip_rows), 0
    most = (-1, -1)  # Titles that are wanted, words.
    for place in range(min(len(lines), MOST_LINES_ABOVE if wanted else 1)):
        for mark in _marks(lines[place], delimiter):
            titles = cells_of(file, numbers[place], lines[place], mark)
            words = sum(bool(cell) and not begins_as_number(cell) for cell in titles)
            score = sum(titles.count(name) == 1 for name in wanted), words
            if score > most:
                most, at = score, place
                best = Header(titles, numbers[place], mark, skip_rows)
        if wanted and most[0] == len(wanted):
            break
    units = _units(best, lines[at + 1], wanted, file) if wanted and at + 1 < len(lines) else {}
    # A row of units is the first of the rows to be skipped, if any are.
    return Header(best.titles, best.line, best.mark, max(skip_rows, bool(units)), units)


def cells_of(file: str, line: int, text: str, mark: str | None) -> list[str]:
    """Return the cells of one line without white space and quotes around them."""
    if mark is None:
        return text.split()
    try:
        rows = list(csv.reader([text], delimiter=mark, skipinitialspace=True))
    except csv.Error as error:
        allowed = "titles separated by commas, semicolons or tabs"
        raise InvalidInput(f"{file}, line {line}", str(error), allowed) from None
    return [cell.strip() for cell in (rows[0] if rows else [])]


def _marks(text: str, delimiter: str | None) -> list[str | None]:
    """Return what may separate the cells of a line, the likeliest first."""
    if delimiter is not None:
        return [DELIMITERS[delimiter]]
    counts: dict[str | None, int] = {mark: text.count(mark) for mark in ",;\t"}
    return sorted(counts, key=lambda mark: -counts[mark])


def _units(header: Header, below: str, wanted: Sequence[str], file: str) -> dict[str, str]:
    """Return the cells of the row below the titles if it has units, not numbers, by title."""
    cells = cells_of(file, header.line + 1, below, header.mark)
    if len(cells) != len(header.titles) or any(name not in header.titles for name in wanted):
        return {}
    of_wanted = [cells[header.titles.index(name)].strip(AROUND) for name in wanted]
    if not any(of_wanted) or any(map(begins_as_number, of_wanted)):
        return {}
    return dict(zip(header.titles, cells, strict=True))


def begins_as_number(cell: str) -> bool:
    """Tell whether a cell is a number, or meant to be one: 0_002, 1,5 or nan."""
    return cell[:3].lower() in ("nan", "inf") or cell.lstrip("+-.,")[:1].isdigit()
