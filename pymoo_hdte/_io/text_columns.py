"""Columns of a table of text as numbers: fast where all is right, cell by cell where it is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from itertools import repeat
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.text_header import AROUND, begins_as_number
from pymoo_hdte._io.text_lines import Block, Row
from pymoo_hdte.checks import InvalidInput

DECIMALS = {"point": ".", "comma": ","}
"""Decimal marks by their names in a layout."""

_MOST_COMPARED = 1000
"""Largest number of titles among which one like a missing title is sought: each takes a while."""


@dataclass(frozen=True, eq=False)
class TextTable:
    """A text file with rows, which are read when they are asked for, in blocks.

    Attributes
    ----------
    file : str
        Name, for error messages.
    titles : list of str, or of int
        Titles of the columns; their numbers from 0 if the file has none.
    title_line : int
        The number of the line of titles, from 1.
    mark : str or None
        What separates the cells of a row; None for any white space.
    units : dict of str to str
        Units of the columns, from a row below the titles; empty without such a row.
    decimal : {".", ","} or None
        What stands before decimals; None to find out.
    blocks : callable
        Gives the rows from the start, each time that it is called.
    """

    file: str
    titles: list[Any]
    title_line: int
    mark: str | None
    units: dict[str, str]
    decimal: str | None
    blocks: Callable[[], Iterator[Block]] = field(repr=False)

    @cached_property
    def lines(self) -> Sequence[int]:
        """The number of the line on which each row begins, from 1."""
        return [line for lines, _ in self.blocks() for line in lines]

    def require(self, names: Sequence[Any], *, no_others: bool = False) -> None:
        """Raise `InvalidInput` unless these columns are there once each, and others if allowed."""
        there = all(self.titles.count(name) == 1 for name in names)
        if not there or (no_others and len(self.titles) != len(names)):
            field = f"{self.file}, line {self.title_line}: columns"
            allowed = f"{', '.join(map(str, names))}, each once{self._hint(names)}"
            raise InvalidInput(field, self.titles, allowed)

    def _hint(self, names: Sequence[Any]) -> str:
        """Return a hint about missing columns, as the end of a sentence."""
        missing = [name for name in names if name not in self.titles]
        titles = [title for title in self.titles if isinstance(title, str)]
        if titles and all(map(begins_as_number, titles)):
            return "; a file without titles has columns that are called by numbers, from 0"
        if len(titles) > _MOST_COMPARED:
            return ""
        similar = [(name, get_close_matches(str(name), titles, 1, 0.4)) for name in missing]
        questions = [f"is {name} {matches[0]!r}?" for name, matches in similar if matches]
        return f"; {' '.join(questions)}" if questions else ""

    def numbers(
        self, names: Sequence[Any], *, gaps: bool = False
    ) -> dict[Any, NDArray[np.float64]]:
        """Return columns of numbers, each of shape (n_rows,), in the units of the file.

        Parameters
        ----------
        names : sequence of str, or of int
            Titles, or numbers of columns where there are no titles.
        gaps : bool
            Whether a value may be missing, as an empty cell (NaN), NaN or infinity, and all rows.

        Raises
        ------
        InvalidInput
            For a column that is not there once, no rows, a row with another number of cells than
            the titles, text in the place of a number, or a gap.
        """
        tables: list[NDArray[np.float64]] = []
        decimal = self.decimal or ("." if self.mark == "," else None)
        for lines, rows in self.blocks():
            if not tables:
                self.require(names)
            decimal = decimal or self._decimal_of(rows, names)
            # All at once is fast; cell by cell locates errors.
            table = self._all_at_once(rows, names, decimal)
            if table is None or not (gaps or np.all(np.isfinite(table))):
                table = self._cell_by_cell(lines, rows, names, gaps, decimal or ".")
            tables.append(table)
        if not tables and gaps:
            return {name: np.empty(0) for name in names}
        self.require(names)
        if not tables:
            field = f"{self.file}, line {self.title_line}: rows below the header"
            raise InvalidInput(field, 0, "at least 1")
        return {
            name: np.concatenate([table[:, at] for table in tables])
            for at, name in enumerate(names)
        }

    def texts(self) -> list[dict[Any, str]]:
        """Return each row as its cells by title; raises `InvalidInput` for a ragged row."""
        return [
            dict(zip(self.titles, self._cells(row, line), strict=True))
            for lines, rows in self.blocks()
            for line, row in zip(lines, rows, strict=True)
        ]

    @property
    def _titled(self) -> bool:
        return not self.titles or isinstance(self.titles[0], str)

    def _places(self, names: Sequence[Any]) -> list[int]:
        return [self.titles.index(name) for name in names]

    def _decimal_of(self, rows: list[Row], names: Sequence[Any]) -> str | None:
        """Return what the first number with decimals has before them, None if all are whole."""
        for row in rows:
            cells = row.split(self.mark) if isinstance(row, str) else row
            for at in self._places(names):
                for mark in DECIMALS.values():
                    if at < len(cells) and mark in cells[at]:
                        return mark
        return None

    def _all_at_once(
        self, rows: list[Row], names: Sequence[Any], decimal: str | None
    ) -> NDArray[np.float64] | None:
        """Return columns, shape (n_rows, n_names), or None if any of their cells is no number."""
        if not isinstance(rows[0], str) or not rows[0]:
            return None
        texts = cast("list[str]", rows)
        if decimal == ",":
            # A comma may only be before decimals, and a point would be one of thousands.
            if self.mark == "," or any("." in row for row in texts):
                return None
            texts = [row.replace(",", ".") for row in texts]
        places = self._places(names)
        read = None
        if self.mark is not None and self._titled and len(places) < len(self.titles):
            # The other columns may be text, but their number has to be right.
            if set(map(str.count, texts, repeat(self.mark))) != {len(self.titles) - 1}:
                return None
            read = places
        try:
            table = np.loadtxt(texts, delimiter=self.mark, comments=None, usecols=read, ndmin=2)
        except ValueError:
            return None
        if table.shape != (len(rows), len(self.titles if read is None else read)):
            return None
        return table[:, places] if read is None else table

    def _cell_by_cell(
        self, lines: Sequence[int], rows: list[Row], names: Sequence[Any], gaps: bool, decimal: str
    ) -> NDArray[np.float64]:
        # A decimal comma would pass for a separator where there are no titles to count.
        read = names if self._titled else self.titles
        places = self._places(read)
        table = np.empty((len(rows), len(read)))
        for at, (line, row) in enumerate(zip(lines, rows, strict=True)):
            cells = self._cells(row, line)
            for to, (name, place) in enumerate(zip(read, places, strict=True)):
                table[at, to] = self._number(line, name, cells[place], gaps, decimal)
        return table[:, [read.index(name) for name in names]]

    def _number(self, line: int, name: Any, cell: str, gaps: bool, decimal: str) -> float:
        cell = cell.strip(AROUND)
        # Python would read 1_000 as a thousand; 1.000 is one where a comma is before decimals.
        text = cell.replace("_", "?")
        text = text if decimal == "." else text.replace(".", "?").replace(",", ".")
        try:
            number = float(text or ("nan" if gaps else ""))
        except ValueError:
            number = None
        if number is None or not (gaps or np.isfinite(number)):
            field = f"{self.file}, line {line}: {column_label(name)}"
            mark = "point" if decimal == "." else "comma"
            raise InvalidInput(
                field, cell, f"a {'' if gaps else 'finite '}number (with a decimal {mark})"
            )
        return number

    def _cells(self, row: Row, line: int) -> list[str]:
        cells = row.split(self.mark) if isinstance(row, str) else row
        if len(cells) != len(self.titles):
            field = f"{self.file}, line {line}: number of cells"
            reference = "header" if self._titled else "first line"
            raise InvalidInput(field, len(cells), f"{len(self.titles)}, as in the {reference}")
        return cells


def column_label(name: Any) -> str:
    """Return the name of a column in errors: its title, or its number from 0."""
    return name if isinstance(name, str) else f"column {name}"
