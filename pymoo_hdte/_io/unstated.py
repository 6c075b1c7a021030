"""Every column of numbers in a file of which nobody has said how it is laid out.

What separates cells, what stands before decimals and where the titles are is found out from the
first lines; the columns are then read by the readers that read them once a layout is stated.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.array_files import READERS, format_of, read_arrays, vector_names
from pymoo_hdte._io.budget import refused_if_too_large
from pymoo_hdte._io.csv_table import read_text_table
from pymoo_hdte._io.layout import CHANNEL_UNITS, COUNTS
from pymoo_hdte._io.text_header import (
    AROUND,
    DELIMITERS,
    MOST_LINES_ABOVE,
    begins_as_number,
    cells_of,
    numbered,
)
from pymoo_hdte._io.text_lines import FIRST_LINES, line_blocks
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.units import usual_spelling

TEXT_ENDINGS = (".csv", ".txt", ".dat", ".tsv", ".log", ".asc")
ENDINGS = (
    *TEXT_ENDINGS,
    *(f"{ending}.gz" for ending in TEXT_ENDINGS),
    *(ending for endings, _ in READERS.values() for ending in endings),
)
"""Of files that may hold measured data."""

_SAMPLED = 8
"""Lines in a row, if there are so many, that must have the same cells to be rows of a table."""
_NUMBERS = {
    "point": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE),
    "comma": re.compile(r"[+-]?(\d+(,\d+)?|,\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE),
}


@dataclass(frozen=True, eq=False)
class UnstatedTable:
    """Columns of a file, and what a layout must say to have them read.

    Attributes
    ----------
    path : Path
    format : str
        One of `layout.FORMATS`.
    columns : dict of str or int to ndarray, shape (n,)
        By title, or by number from 0 in a text without titles, as they stand in the file; a value
        that is missing is NaN.
    titles : dict of str or int to str
        What stands above each column; empty where nothing does.
    units : dict of str or int to str
        From a row of units; empty without one.
    delimiter, decimal : str or None
        Among `DELIMITERS` and `DECIMALS`; None without text, or where it does not matter.
    skip_rows : int
        Lines above the first row that a text without titles has.
    """

    path: Path
    format: str
    columns: dict[str | int, NDArray[np.float64]]
    titles: dict[str | int, str]
    units: dict[str | int, str]
    delimiter: str | None = None
    decimal: str | None = None
    skip_rows: int = 0

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()), ()))


def read_unstated(path: Path) -> UnstatedTable:
    """Read every column of numbers of a file.

    Parameters
    ----------
    path : Path
        With one of `ENDINGS`; another is taken for text.

    Raises
    ------
    InvalidInput
        For a file that has no columns of numbers, is damaged, or is larger than its `Budget` or the
        memory allows.
    OSError
        If it cannot be read.
    """
    form = format_of(path, "csv")
    with refused_if_too_large(path):
        if form not in READERS:
            return _read_text(path)
        names = vector_names(path, form)
        if not names:
            raise InvalidInput(path.name, "no vectors of numbers", "columns of one length")
        vectors = read_arrays(path, form, names).vectors
    columns: dict[str | int, NDArray[np.float64]] = {name: vectors[name] for name in names}
    return UnstatedTable(path, form, columns, {name: name for name in names}, {})


@dataclass(frozen=True)
class _Shape:
    """Which line is the first row of a text, how its cells are cut, and which are numbers."""

    first: int
    delimiter: str
    decimal: str
    cells: int
    numbers: tuple[int, ...]


def _read_text(path: Path) -> UnstatedTable:
    _, lines = next(line_blocks(path, "text", size=FIRST_LINES), (range(0), []))
    # The last line of a block may be cut, that of a file is whole.
    shape = _shape(path.name, lines[: MOST_LINES_ABOVE + _SAMPLED])
    if shape is None:
        shown = lines[0] if lines else ""
        allowed = "rows of numbers, in columns separated by commas, semicolons, tabs or spaces"
        raise InvalidInput(f"{path.name}, its first {MOST_LINES_ABOVE} lines", shown, allowed)
    titles, units, exact = _titles(path.name, lines, shape)
    wanted = [titles[at] for at in shape.numbers]
    by_title = exact and all(titles.count(one) == 1 and one for one in wanted)
    # Comment lines in front of the first row are no rows of a plain table.
    form = "csv" if by_title or shape.first else "plain"
    mark = DELIMITERS[shape.delimiter]
    if form == "csv" and not by_title and mark is None:
        form = "plain"
    single = shape.cells == 1
    table = read_text_table(
        path,
        titled=form == "csv",
        skip_rows=0 if form == "csv" else shape.first,
        wanted=wanted if by_title else list(shape.numbers) if form == "csv" else (),
        delimiter=None if single else shape.delimiter,
        decimal=shape.decimal,
    )
    names: list[Any] = list(wanted) if by_title else list(shape.numbers)
    asked = [numbered(at) for at in names] if form == "csv" and not by_title else names
    values = table.numbers(asked, gaps=True)
    columns = {name: values[one] for name, one in zip(names, asked, strict=True)}
    if not columns or not len(next(iter(columns.values()))):
        raise InvalidInput(f"{path.name}: rows", 0, "at least 1")
    return UnstatedTable(
        path,
        form,
        columns,
        {name: titles[at] for name, at in zip(names, shape.numbers, strict=True)},
        {name: units[at] for name, at in zip(names, shape.numbers, strict=True) if units[at]},
        None if single else shape.delimiter,
        shape.decimal,
        0 if form == "csv" else shape.first,
    )


def _shape(file: str, lines: Sequence[str]) -> _Shape | None:
    """Return how rows are cut: as most cells are numbers, and then as there are most of them."""
    best, most = None, (0.0, 0)
    for delimiter in ("semicolon", "tab", "comma", "space"):
        for decimal in ("point",) if delimiter == "comma" else ("point", "comma"):
            shape = _cut_as(file, lines, delimiter, decimal)
            if shape is None:
                continue
            score = len(shape.numbers) / shape.cells, len(shape.numbers)
            if score > most:
                best, most = shape, score
    return best


def _cut_as(file: str, lines: Sequence[str], delimiter: str, decimal: str) -> _Shape | None:
    """Return the first run of lines that have the same cells and numbers, None without one."""
    rows: list[tuple[int, tuple[int, ...]]] = []
    for line, text in enumerate(lines, 1):
        try:
            cells = cells_of(file, line, text, DELIMITERS[delimiter])
        except InvalidInput:
            cells = []
        # A cell may be empty where a value is missing, but not in every row.
        numbers = tuple(
            at for at, cell in enumerate(cells) if _NUMBERS[decimal].fullmatch(cell.strip(AROUND))
        )
        rows.append((len(cells), numbers))
    for first in range(len(rows)):
        run = rows[first : first + _SAMPLED]
        count = run[0][0]
        anywhere = {at for _, numbers in run for at in numbers}
        if len(run) > 1 and run[0][1] and all(cells == count for cells, _ in run):
            texts = {
                at
                for at in anywhere
                for line, (_, numbers) in zip(lines[first:], run, strict=False)
                if at not in numbers
                and cells_of(file, 1, line, DELIMITERS[delimiter])[at].strip(AROUND)
            }
            if columns := tuple(sorted(anywhere - texts)):
                return _Shape(first, delimiter, decimal, count, columns)
    return None


def _titles(file: str, lines: Sequence[str], shape: _Shape) -> tuple[list[str], list[str], bool]:
    """Return titles and units of all columns, and whether a reader finds the titles as they are."""
    blank = [""] * shape.cells
    above = [
        cells_of(file, at + 1, lines[at], DELIMITERS[shape.delimiter])
        for at in range(max(0, shape.first - 2), shape.first)
    ]
    above = [cells for cells in above if _are_words(cells, shape)]
    if above:
        units = above[-1]
        if len(above) > 1 and all(map(_is_unit, units)) and any(units):
            return above[-2], units, True
        return above[-1], blank, True
    if shape.first:
        # As NumPy writes titles, behind a mark of comments.
        text = lines[shape.first - 1].lstrip().lstrip("#%;").strip()
        cells = cells_of(file, shape.first, text, DELIMITERS[shape.delimiter])
        if _are_words(cells, shape):
            return cells, blank, False
    return blank, blank, False


def _are_words(cells: Sequence[str], shape: _Shape) -> bool:
    """Tell whether cells may be titles or units: words, as many as there are columns."""
    return len(cells) == shape.cells and not any(begins_as_number(one) for one in cells if one)


def _is_unit(cell: str) -> bool:
    return not cell or usual_spelling(cell.strip("[]() ")) in (COUNTS, *CHANNEL_UNITS)
