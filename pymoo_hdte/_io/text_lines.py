"""Lines of a text file in blocks, so that a file of any length takes the memory of a block.

The text is compressed by gzip or plain, with any kind of line end, in any of `ENCODINGS`.
"""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import repeat
from pathlib import Path
from typing import BinaryIO, cast

from pymoo_hdte._io.budget import Budget, regular_file
from pymoo_hdte._io.encodings import ENCODINGS, PROBE, encoding_of, with_cp1252
from pymoo_hdte.checks import InvalidInput

BLOCK = 1 << 22
"""Characters of a block."""

FIRST_LINES = 1 << 16
"""Characters of a block in which titles are looked for."""

Lines = tuple[Sequence[int], list[str]]
"""Lines with their numbers, from 1."""
Row = str | list[str]
"""A row as it stands in the file, or its cells in a block with quotes."""
Block = tuple[Sequence[int], list[Row]]
"""The numbers of the lines on which rows begin, and the rows."""
Seen = Callable[[int], None]
"""Called with the number of further bytes read of a file."""
Progress = Callable[[int, int], None]
"""Called with the bytes read of all files so far, and their total."""

_NO_TEXT = re.compile("[\0\udc80-\udcff]")
"""NUL, or a byte that is no UTF-8, as Python hands it on."""


def byte_counter(progress: Progress | None, paths: Sequence[Path]) -> Seen | None:
    """Return a counter that reports the bytes read so far, and those of all files."""
    if progress is None:
        return None
    total, done = sum(path.stat().st_size for path in paths), 0

    def seen(further: int) -> None:
        nonlocal done
        done += further
        progress(done, total)

    return seen


def line_blocks(
    path: Path,
    kind: str,
    seen: Seen | None = None,
    size: int = BLOCK,
    encoding: str | None = None,
) -> Iterator[Lines]:
    """Yield lines without their ends, with their numbers; no blank lines at the end.

    Parameters
    ----------
    path : Path
        A file, compressed if its name ends in ``.gz``.
    kind : str
        Kind of text that is expected, for errors.
    seen : callable, optional
        Called after each block.
    size : int
        Characters of a block, or more where lines are longer.
    encoding : str, optional
        One of `encodings.ENCODINGS`; found out by default.

    Raises
    ------
    InvalidInput
        For a file that is no such text, not compressed as its name says, or above its `Budget`.
    OSError
        If it cannot be read.
    """
    budget, size_of_file = Budget.now(), regular_file(path)
    if path.suffix != ".gz":
        budget.check("bytes", size_of_file, path.name)
    with path.open("rb") as raw:
        blank: list[str] = []
        start, done, characters = 1, 0, 0
        for lines in _lines(path, kind, raw, size, budget, encoding):
            end = len(lines)
            while end and not lines[end - 1].strip():
                end -= 1
            if seen:
                seen(raw.tell() - done)
                done = raw.tell()
            further = lines[end:]
            if end:
                lines = blank + lines[:end]
                budget.check("rows", start + len(lines) - 1, f"{path.name}: lines")
                yield range(start, start + len(lines)), lines
                start += len(lines)
                blank, characters = [], 0
            blank += further
            characters += sum(map(len, further)) + len(further)
            budget.check("characters", characters, f"{path.name}, line {start}: blank lines")


def lines_below(blocks: Iterable[Lines], line: int, skip: int) -> Iterator[Lines]:
    """Yield the lines below a line, without the first `skip` of them."""
    for numbers, lines in blocks:
        start = bisect_right(numbers, line)
        start, skip = min(start + skip, len(lines)), max(skip - (len(lines) - start), 0)
        if start < len(lines):
            yield numbers[start:], lines[start:]


def unquoted_rows(file: str, blocks: Iterator[Lines], mark: str) -> Iterator[Block]:
    """Yield rows, cut into cells in blocks with quotes; a quoted cell may have several lines."""
    most = Budget.now().characters
    remaining_lines: Lines | None = None
    while block := remaining_lines or next(blocks, None):
        remaining_lines = None
        numbers, lines = block
        quotes = _quotes(lines)
        if not quotes:
            yield numbers, cast("list[Row]", lines)
            continue
        if quotes % 2:
            # A cell that begins in this block may end in another.
            further, ends = _to_the_end(blocks, most)
            numbers, lines = [*numbers, *further[0][:ends]], [*lines, *further[1][:ends]]
            remaining_lines = (
                (further[0][ends:], further[1][ends:]) if ends < len(further[1]) else None
            )
        yield _cut(file, numbers, lines, mark)


def _to_the_end(blocks: Iterator[Lines], most: int) -> tuple[Lines, int]:
    """Return lines in which an open cell may end, and how many it takes: 0 if it does not end."""
    numbers: list[int] = []
    lines: list[str] = []
    characters = 0
    while characters <= most and (block := next(blocks, None)):
        for count, line in enumerate(block[1], len(lines) + 1):
            characters += len(line) + 1
            if line.count('"') % 2 or characters > most:
                ends = count if line.count('"') % 2 else 0
                return ([*numbers, *block[0]], [*lines, *block[1]]), ends
        numbers += block[0]
        lines += block[1]
    return (numbers, lines), len(lines)


def _quotes(lines: list[str]) -> int:
    return sum(map(str.count, lines, repeat('"')))


def _lines(
    path: Path, kind: str, raw: BinaryIO, size: int, budget: Budget, encoding: str | None
) -> Iterator[list[str]]:
    packed = path.suffix == ".gz"
    binary = cast("BinaryIO", gzip.GzipFile(fileobj=raw)) if packed else raw
    text, partial_line, done = None, "", 0

    def long(length: int, line: int) -> None:
        budget.check("characters", length, f"{path.name}, line {line}: a line")

    try:
        start = cast("io.BufferedReader", binary).peek(PROBE)[:PROBE]
        coded = encoding_of(start, encoding)
        # With the surrogates of bytes that are no text, so that their line can be told.
        text = io.TextIOWrapper(binary, coded, "surrogateescape")
        mixed = encoding is None and coded == ENCODINGS["utf-8"]
        while chunk := text.read(size):
            chunk = with_cp1252(chunk) if mixed else chunk
            budget.check("bytes", binary.tell(), f"{path.name}, expanded")
            whole, end, partial_line = (partial_line + chunk).rpartition("\n")
            if end:
                _check(path, kind, whole, done)
                lines = whole.split("\n")
                lengths = list(map(len, lines))
                longest = max(lengths)
                long(longest + 1, done + lengths.index(longest) + 1)
                done += len(lines)
                yield lines
            long(len(partial_line), done + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InvalidInput(path.name, str(error), f"gzip-compressed {kind} in UTF-8") from None
    except UnicodeError as error:
        allowed = f"{kind} in {encoding or 'UTF-8, cp1252 or UTF-16'}"
        raise InvalidInput(path.name, str(error), allowed) from None
    finally:
        if text is not None:
            text.detach()
    _check(path, kind, partial_line, done)
    yield [partial_line]


def _check(path: Path, kind: str, text: str, done: int) -> None:
    """Raise `InvalidInput` for bytes that are no text, in a block after `done` lines."""
    # Most files are of ASCII, which is faster to tell.
    bad = None if text.isascii() and "\0" not in text else _NO_TEXT.search(text)
    if bad is None:
        return
    above = text.count("\n", 0, bad.start())
    line = done + above
    # A file whose first line is no text is refused as a whole.
    field = f"{path.name}, line {line + 1}" if line else path.name
    shown = text.split("\n")[above].encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    allowed = f"{kind} in UTF-8, cp1252 or UTF-16 without NUL bytes"
    raise InvalidInput(field, shown, allowed)


def _cut(file: str, numbers: Sequence[int], rows: list[str], mark: str) -> Block:
    """Return the line where each row begins, and the cells of rows of which some are quoted."""
    reader = csv.reader((f"{row}\n" for row in rows), delimiter=mark, skipinitialspace=True)
    cell_rows: list[Row] = []
    lines, start = [], 0
    try:
        for cells in reader:
            cell_rows.append(cells)
            lines.append(numbers[start])
            start = reader.line_num
    except csv.Error as error:
        allowed = "quoted cells that end, separated by commas, semicolons or tabs"
        raise InvalidInput(f"{file}, line {numbers[start]}", str(error), allowed) from None
    return lines, cell_rows
