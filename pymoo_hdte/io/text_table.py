"""Tables as text: CSV, compressed by gzip or plain, and columns of numbers without titles.

This is the only reader of such files in the package; an error names the file, its line and the
column by its title. A CSV file is in UTF-8 and has its titles in the first line; cells are
separated by commas or semicolons and may be quoted; numbers have a decimal point.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput

LARGEST = 1e15
"""In any unit: a double beyond it no longer holds tenths, so it marks a fault; nobody measured it,
and the squares of a fit would overflow."""

_AROUND = ' \t"'
"""What may stand around a number in its cell."""


def line_of_row(row: int) -> int:
    """Return the line of a row below one line of titles: rows count from 0, lines from 1."""
    return row + 2


@dataclass(frozen=True, eq=False)
class TextTable:
    """A text file split into rows; only requested columns are converted.

    Attributes
    ----------
    file : str
        Name, for error messages.
    titles : list of str, or of int
        Of the columns; their numbers from 0 if the file has no titles.
    lines : sequence of int
        The number of the line on which each row begins, from 1.
    title_line : int
        That of the titles.
    mark : str or None
        What separates the cells of a row; None for any white space.
    rows : list of str, or of list of str
        Each row as it stands, or cut into cells where any is quoted.
    """

    file: str
    titles: list[Any]
    lines: Sequence[int]
    title_line: int
    mark: str | None
    rows: list[str] | list[list[str]]

    def require(self, names: Sequence[Any], *, no_others: bool = False) -> None:
        """Raise `InvalidInput` unless each of these columns is there once, and no others if so."""
        there = all(self.titles.count(name) == 1 for name in names)
        if not there or (no_others and len(self.titles) != len(names)):
            field = f"{self.file}, line {self.title_line}: columns"
            raise InvalidInput(field, self.titles, f"{', '.join(map(str, names))}, each once")

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
        if not self.rows and gaps:
            return {name: np.empty(0) for name in names}
        self.require(names)
        if not self.rows:
            field = f"{self.file}, line {self.title_line}: rows below the header"
            raise InvalidInput(field, 0, "at least 1")
        # All at once is fast; cell by cell locates errors, or skips a column of text.
        found = self._all_at_once(names)
        if found is None or not (gaps or np.all(np.isfinite(found))):
            found = self._cell_by_cell(names, gaps)
        return {name: found[:, at].copy() for at, name in enumerate(names)}

    def texts(self) -> list[dict[Any, str]]:
        """Return each row as its cells by title; raises `InvalidInput` for a ragged row."""
        return [
            dict(zip(self.titles, self._cells(row), strict=True)) for row in range(len(self.rows))
        ]

    @property
    def _titled(self) -> bool:
        return isinstance(self.titles[0], str)

    def _all_at_once(self, names: Sequence[Any]) -> NDArray[np.float64] | None:
        """Return columns, shape (n_rows, n_names), or None if any cell is no number."""
        rows = cast("list[str]", self.rows)
        if not isinstance(rows[0], str):
            return None
        try:
            table = np.loadtxt(rows, delimiter=self.mark, comments=None, ndmin=2)
        except ValueError:
            return None
        if table.shape != (len(rows), len(self.titles)):
            return None
        return table[:, [self.titles.index(name) for name in names]]

    def _cell_by_cell(self, names: Sequence[Any], gaps: bool) -> NDArray[np.float64]:
        # A decimal comma would pass for a separator where there are no titles to count.
        read = names if self._titled else self.titles
        places = [(name, self.titles.index(name)) for name in read]
        table = np.empty((len(self.rows), len(read)))
        for row in range(len(self.rows)):
            cells = self._cells(row)
            table[row] = [self._number(row, name, cells[at], gaps) for name, at in places]
        return table[:, [read.index(name) for name in names]]

    def _number(self, row: int, name: Any, cell: str, gaps: bool) -> float:
        cell = cell.strip(_AROUND)
        try:
            # Python would read 1_000 as a thousand.
            number = float(cell.replace("_", "?") or ("nan" if gaps else ""))
        except ValueError:
            number = None
        if number is None or not (gaps or np.isfinite(number)):
            field = f"{self.file}, line {self.lines[row]}: {column_label(name)}"
            allowed = f"a {'' if gaps else 'finite '}number (with a decimal point)"
            raise InvalidInput(field, cell, allowed)
        return number

    def _cells(self, row: int) -> list[str]:
        text = self.rows[row]
        cells = text.split(self.mark) if isinstance(text, str) else text
        if len(cells) != len(self.titles):
            field = f"{self.file}, line {self.lines[row]}: number of cells"
            first = "header" if self._titled else "first line"
            raise InvalidInput(field, len(cells), f"{len(self.titles)}, as in the {first}")
        return cells


def column_label(name: Any) -> str:
    """Return the name of a column in errors: its title, or its number from 0."""
    return name if isinstance(name, str) else f"column {name}"


def read_text_table(
    path: Path,
    *,
    titled: bool = True,
    skip_rows: int = 0,
    by_hand: bool = False,
    origin: str | None = None,
) -> TextTable:
    """Read a table of text, of which nothing is converted yet.

    Parameters
    ----------
    path : Path
        Of a file in UTF-8; it is compressed if its name ends in ``.gz``.
    titled : bool
        Whether it is CSV. Else it has no titles, and white space or commas separate its cells.
    skip_rows : int
        Rows below the titles that are left out unread.
    by_hand : bool
        Whether to leave out blank lines and those that begin with ``#``, as people write them. In
        a record of an instrument, where each row is an instant, a blank line is a fault.
    origin : str, optional
        A first line that begins with this is left out.

    Raises
    ------
    InvalidInput
        For a file that is no such text, or not compressed as its name says.
    OSError
        If it cannot be read.
    """
    lines = _text(path, "CSV text" if titled else "text").split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    numbers: Sequence[int] = range(1, len(lines) + 1)
    if origin and lines and lines[0].startswith(origin):
        lines, numbers = lines[1:], numbers[1:]
    if by_hand:
        kept = [at for at, line in enumerate(lines) if line.strip() and line.lstrip()[0] != "#"]
        lines, numbers = [lines[at] for at in kept], [numbers[at] for at in kept]
    if not titled:
        lines, numbers = lines[skip_rows:], numbers[skip_rows:]
    top, title_line = (lines[0], numbers[0]) if lines else ("", 1)
    if not titled:
        separator = "," if "," in top else None
        columns = list(range(len(top.split(separator))))
        return TextTable(path.name, columns, numbers, title_line, separator, lines)
    mark = ";" if top.count(";") > top.count(",") else ","
    cells, _ = _quoted(path.name, lines[:1], numbers, mark)
    titles = [cell.strip() for cell in (cells[0] if cells else [])]
    rows, numbers = lines[1 + skip_rows :], numbers[1 + skip_rows :]
    if not any('"' in row for row in rows):
        return TextTable(path.name, titles, numbers, title_line, mark, rows)
    quoted, numbers = _quoted(path.name, rows, numbers, mark)
    return TextTable(path.name, titles, numbers, title_line, mark, quoted)


def csv_text(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return a table with its heading as CSV; a float keeps all its digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue()


def write_columns(path: Path, columns: dict[str, tuple[NDArray[np.float64], int]]) -> None:
    """Write columns, compressed, each with its number of decimals; equal columns give equal bytes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    table = np.column_stack([values for values, _ in columns.values()])
    row = ",".join(f"%.{decimals}f" for _, decimals in columns.values()) + "\n"
    text = ",".join(columns) + "\n" + row * len(table) % tuple(table.ravel().tolist())
    path.write_bytes(gzip.compress(text.encode(), compresslevel=6, mtime=0))


def _text(path: Path, kind: str) -> str:
    """Return the text of a file with lines that end in a line feed."""
    data = path.read_bytes()
    if path.suffix == ".gz":
        try:
            data = gzip.decompress(data)
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise InvalidInput(path.name, str(error), f"gzip-compressed {kind} in UTF-8") from None
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode("utf-8")
        bad = text.find("\0")
    except UnicodeDecodeError as error:
        text = data.decode("utf-8", "replace")
        bad = len(data[: error.start].decode("utf-8"))
    if bad >= 0:
        # A file whose first line is no text is refused as a whole.
        line = len(re.findall("\r\n?|\n", text[:bad]))
        field = f"{path.name}, line {line + 1}" if line else path.name
        shown = re.split("\r\n?|\n", text)[line]
        raise InvalidInput(field, shown, f"{kind} in UTF-8 without NUL bytes")
    return re.sub("\r\n?", "\n", text) if "\r" in text else text


def _quoted(
    file: str, rows: list[str], numbers: Sequence[int], mark: str
) -> tuple[list[list[str]], list[int]]:
    """Return the cells of rows of which some are quoted, and the line where each row begins."""
    reader = csv.reader((f"{row}\n" for row in rows), delimiter=mark, skipinitialspace=True)
    found, lines, start = [], [], 0
    try:
        for cells in reader:
            found.append(cells)
            lines.append(numbers[start])
            start = reader.line_num
    except csv.Error as error:
        allowed = "quoted cells that end, separated by commas or semicolons"
        raise InvalidInput(f"{file}, line {numbers[start]}", str(error), allowed) from None
    return found, lines
