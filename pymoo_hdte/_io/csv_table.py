"""Tables as text: CSV, compressed by gzip or plain, and columns of numbers without titles.

This is the only reader of such files in the package; an error names the file, its line and the
column by its title. A CSV file has its titles in one line, the first or the one
with the names that are looked for; cells are separated by commas, semicolons or tabs and may be
quoted. Numbers have a decimal point, or a decimal comma where commas do not separate cells.
"""

from __future__ import annotations

import csv
import gzip
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.text_columns import DECIMALS, TextTable
from pymoo_hdte._io.text_header import numbered_header, plain_header, titled_header
from pymoo_hdte._io.text_lines import (
    BLOCK,
    FIRST_LINES,
    Block,
    Lines,
    Seen,
    line_blocks,
    lines_below,
    unquoted_rows,
)

LARGEST = 1e15
"""Largest value in any unit. A double beyond it no longer holds tenths, so it was not measured,
and the squares of a fit would overflow."""


def read_text_table(
    path: Path,
    *,
    titled: bool = True,
    skip_rows: int = 0,
    by_hand: bool = False,
    origin: str | None = None,
    wanted: Sequence[str] | Sequence[int] = (),
    delimiter: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
    seen: Seen | None = None,
) -> TextTable:
    """Read the titles of a table of text; its rows are read on demand.

    Parameters
    ----------
    path : Path
        It is compressed if its name ends in ``.gz``.
    titled : bool
        Whether it is CSV. Else it has no titles, and white space, commas or semicolons separate
        its cells.
    skip_rows : int
        Rows below the titles that are left out unread.
    by_hand : bool
        Whether to leave out blank lines and those that begin with ``#``, as people write them. In
        a record of an instrument, where each row is an instant, a blank line is a fault.
    origin : str, optional
        A first line that begins with this is left out.
    wanted : sequence of str, or of int
        Titles. Lines above the first line that has them all are left out, and so is a row of units
        below it. Or numbers of columns, from 0, whose titles are then made by `numbered`.
    delimiter, decimal : str, optional
        Among `text_header.DELIMITERS` and `DECIMALS`; found out by default.
    encoding : str, optional
        One of `encodings.ENCODINGS`; found out by default.
    seen : callable, optional
        Called with the number of further bytes read.

    Raises
    ------
    InvalidInput
        For a file that is no such text, or not compressed as its name says; so do the methods of
        the table.
    OSError
        If it cannot be read.
    """
    kind = "CSV text" if titled else "text"

    def lines(size: int = FIRST_LINES, counter: Seen | None = None) -> Iterator[Lines]:
        for numbers, block in line_blocks(path, kind, counter, size, encoding):
            if numbers[0] == 1 and origin and block[0].startswith(origin):
                numbers, block = numbers[1:], block[1:]
            if by_hand:
                indices = [
                    at for at, line in enumerate(block) if line.strip() and line.lstrip()[0] != "#"
                ]
                numbers, block = [numbers[at] for at in indices], [block[at] for at in indices]
            yield numbers, block

    if titled:
        top = next(lines(), (range(0), []))
        columns = [column for column in wanted if isinstance(column, int)]
        if columns:
            header = numbered_header(*top, delimiter, skip_rows, columns)
        else:
            titles = [str(title) for title in wanted]
            header = titled_header(path.name, *top, delimiter, skip_rows, titles)
    else:
        top = next(lines_below(lines(), 0, skip_rows), (range(0), []))
        header = plain_header(*top, delimiter, skip_rows)

    def blocks() -> Iterator[Block]:
        below = lines_below(lines(BLOCK, seen), header.line if titled else 0, header.skip)
        if titled and header.mark is not None:
            return unquoted_rows(path.name, below, header.mark)
        return cast("Iterator[Block]", below)

    stated = None if decimal is None else DECIMALS[decimal]
    return TextTable(
        path.name, header.titles, header.line, header.mark, header.units, stated, blocks
    )


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
