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
"""A row as it stands, or cut into cells where any is quoted."""
Block = tuple[Sequence[int], list[Row]]
"""The numbers of the lines on which rows begin, and the rows."""
Seen = Callable[[int], None]
"""Is told how many further bytes of a file have been read."""
Progress = Callable[[int, int], None]
"""Is told how many bytes of all files have been read, and how many there are."""

_NO_TEXT = re.compile("[\0\udc80-\udcff]")
"""NUL, or a byte that is no UTF-8, as Python hands it on."""


def told(progress: Progress | None, paths: Sequence[Path]) -> Seen | None:
    """Return what adds up the bytes that are read and tells them, with those of all files."""
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
        Of a file that is compressed if its name ends in ``.gz``.
    kind : str
        Of text that it should be, for errors.
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
            kept = len(lines)
            while kept and not lines[kept - 1].strip():
                kept -= 1
            if seen:
                seen(raw.tell() - done)
                done = raw.tell()
            further = lines[kept:]
            if kept:
                lines = blank + lines[:kept]
                budget.check("rows", start + len(lines) - 1, f"{path.name}: lines")
                yield range(start, start + len(lines)), lines
                start += len(lines)
                blank, characters = [], 0
            blank += further
            characters += sum(map(len, further)) + len(further)
            budget.check("characters", characters, f"{path.name}, line {start}: blank lines")


def lines_below(blocks: Iterable[Lines], line: int, skip: int) -> Iterator[Lines]:
    """Yield the lines below a line, without the first so many of them."""
    for numbers, lines in blocks:
        first = bisect_right(numbers, line)
        first, skip = min(first + skip, len(lines)), max(skip - (len(lines) - first), 0)
        if first < len(lines):
            yield numbers[first:], lines[first:]


def unquoted_rows(file: str, blocks: Iterator[Lines], mark: str) -> Iterator[Block]:
    """Yield rows, cut into cells in blocks with quotes; a quoted cell may have several lines."""
    most = Budget.now().characters
    rest: Lines | None = None
    while block := rest or next(blocks, None):
        rest = None
        numbers, lines = block
        quotes = _quotes(lines)
        if not quotes:
            yield numbers, cast("list[Row]", lines)
            continue
        if quotes % 2:
            # A cell that begins in this block may end in another.
            further, ends = _to_the_end(blocks, most)
            numbers, lines = [*numbers, *further[0][:ends]], [*lines, *further[1][:ends]]
            rest = (further[0][ends:], further[1][ends:]) if ends < len(further[1]) else None
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
    text, rest, done = None, "", 0

    def long(length: int, line: int) -> None:
        budget.check("characters", length, f"{path.name}, line {line}: a line")

    try:
        start = cast("io.BufferedReader", binary).peek(PROBE)[:PROBE]
        coded = encoding_of(start, encoding)
        # With the surrogates of bytes that are no text, so that their line can be told.
        text = io.TextIOWrapper(binary, coded, "surrogateescape")
        mixed = encoding is None and coded == ENCODINGS["utf-8"]
        while found := text.read(size):
            found = with_cp1252(found) if mixed else found
            budget.check("bytes", binary.tell(), f"{path.name}, expanded")
            whole, end, rest = (rest + found).rpartition("\n")
            if end:
                _check(path, kind, whole, done)
                lines = whole.split("\n")
                lengths = list(map(len, lines))
                longest = max(lengths)
                long(longest + 1, done + lengths.index(longest) + 1)
                done += len(lines)
                yield lines
            long(len(rest), done + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InvalidInput(path.name, str(error), f"gzip-compressed {kind} in UTF-8") from None
    except UnicodeError as error:
        allowed = f"{kind} in {encoding or 'UTF-8, cp1252 or UTF-16'}"
        raise InvalidInput(path.name, str(error), allowed) from None
    finally:
        if text is not None:
            text.detach()
    _check(path, kind, rest, done)
    yield [rest]


def _check(path: Path, kind: str, text: str, done: int) -> None:
    """Raise `InvalidInput` for what is no text, below so many lines."""
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
    found: list[Row] = []
    lines, start = [], 0
    try:
        for cells in reader:
            found.append(cells)
            lines.append(numbers[start])
            start = reader.line_num
    except csv.Error as error:
        allowed = "quoted cells that end, separated by commas, semicolons or tabs"
        raise InvalidInput(f"{file}, line {numbers[start]}", str(error), allowed) from None
    return lines, found
