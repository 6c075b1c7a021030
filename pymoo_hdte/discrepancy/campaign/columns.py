"""Columns of numbers in CSV, compressed by gzip or plain; an error names the file and its line.

Line 1 is the header. Columns come in any order and others are ignored.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number

HEADER_LINES = 1


def line_of_row(row: int) -> int:
    """Return the number of the line on which a row of numbers stands, both counted as usual."""
    return row + HEADER_LINES + 1


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of a ``.csv`` or ``.csv.gz`` file, each of shape (n_rows,).

    Raises
    ------
    InvalidInput
        For a file that is no text, or not compressed as its name says, a missing column, a row of
        another length, an empty cell, text, or a value that is not finite.
    OSError
        If the file cannot be read.
    """
    header, *rows = _lines(path)
    columns = [cell.strip() for cell in header.split(",")]
    if any(columns.count(name) != 1 for name in names):
        allowed = f"the columns {', '.join(names)}, each once"
        raise InvalidInput(f"{path.name}, line 1: columns", header[:200], allowed)
    if not rows:
        raise InvalidInput(f"{path.name}, line 1: rows below the header", 0, "at least one")
    # The whole text at once is fast; it is read line by line only to find what is wrong with it.
    try:
        table = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        table = np.empty((0, 0))
    if table.shape != (len(rows), len(columns)) or not np.all(np.isfinite(table)):
        table = _row_by_row(path, rows, columns, names)
    return {name: table[:, columns.index(name)].copy() for name in names}


def write_columns(path: Path, columns: dict[str, tuple[NDArray[np.float64], int]]) -> None:
    """Write columns, each with its number of decimals; equal columns give equal bytes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    table = np.column_stack([values for values, _ in columns.values()])
    row = ",".join(f"%.{decimals}f" for _, decimals in columns.values()) + "\n"
    text = ",".join(columns) + "\n" + row * len(table) % tuple(table.ravel().tolist())
    path.write_bytes(gzip.compress(text.encode(), compresslevel=6, mtime=0))


def _lines(path: Path) -> list[str]:
    compressed = path.suffix == ".gz"
    try:
        with (gzip.open if compressed else open)(path, "rt", encoding="utf-8-sig") as file:
            return file.read().rstrip().split("\n")
    except (gzip.BadGzipFile, EOFError, zlib.error, UnicodeDecodeError) as error:
        allowed = f"{'gzip-compressed ' if compressed else ''}CSV text in UTF-8"
        raise InvalidInput(path.name, str(error), allowed) from None


def _row_by_row(
    path: Path, rows: Sequence[str], columns: Sequence[str], names: Sequence[str]
) -> NDArray[np.float64]:
    """Return the table with NaN in the columns that nobody asked for, or name the bad cell."""
    table = np.full((len(rows), len(columns)), np.nan)
    for index, row in enumerate(rows):
        place = f"{path.name}, line {line_of_row(index)}"
        cells = row.split(",")
        if len(cells) != len(columns):
            allowed = f"{len(columns)}, as in the header"
            raise InvalidInput(f"{place}: number of cells", len(cells), allowed)
        for name in names:
            at = columns.index(name)
            table[index, at] = _number(f"{place}: {name}", cells[at])
    return table


def _number(field: str, cell: str) -> float:
    try:
        return real_number(field, float(cell))
    except ValueError:
        raise InvalidInput(field, cell, "a finite number") from None
