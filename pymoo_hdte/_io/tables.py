"""Measured tables in files of text or of arrays, mapped to channels in SI by a layout."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from pymoo_hdte._io.array_files import READERS, format_of, read_arrays
from pymoo_hdte._io.budget import refused_if_too_large, regular_file
from pymoo_hdte._io.csv_table import LARGEST, read_text_table
from pymoo_hdte._io.even_steps import LONGEST_STEP, even_steps, is_even
from pymoo_hdte._io.layout import CHANNEL_UNITS, Channel, TableLayout, layout_from_fields
from pymoo_hdte._io.parts import Part
from pymoo_hdte._io.text_columns import TextTable, column_label
from pymoo_hdte._io.text_header import numbered
from pymoo_hdte._io.text_lines import Seen
from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.units import ORIGINS, usual_spelling

__all__ = ["CHANNEL_UNITS", "LARGEST", "Channel", "TableLayout", "layout_from_fields"]

FEWEST_ROWS = 16
ROWS_PER_FILLED = 100  # Interpolated values may stand in fewer than one row in this many.
LONGEST_GAP = 2  # Rows: across more of them a straight line is no motion.


@dataclass(frozen=True, eq=False)
class Columns:
    """Mapped columns as they stand in a file, without the rows to be skipped.

    Attributes
    ----------
    path : Path
    layout : TableLayout
    raw : dict of str or int to ndarray, shape (n,)
        By title, or by number in a plain table.
    text : TextTable or None
        None for a file of arrays.
    length : int
        Number of rows.
    above : int
        Rows of a file without text that stand above the first of numbers.
    """

    path: Path
    layout: TableLayout
    raw: dict[Any, NDArray[np.float64]]
    text: TextTable | None
    length: int
    above: int = 0

    def si(self, channel: Channel) -> NDArray[np.float64]:
        """Return a channel in SI, shape (n,); values that are not finite are interpolated."""
        raw = self.raw[channel.column]
        at = np.flatnonzero(np.isfinite(raw))
        if at.size == 0:
            return np.full(raw.size, np.nan)
        # Unwrapped before interpolation, which is invalid across a jump of the angle.
        values = raw if at.size == raw.size else raw[at]
        if channel.wraps is not None:
            values = np.unwrap(values, period=channel.wraps)
        values = (values - channel.zero if channel.zero else values) * channel.factor
        values = (np.unwrap(values) if channel.unwrap else values) * channel.scale + channel.origin
        return values if at.size == raw.size else np.interp(np.arange(raw.size), at, values)

    def sum_before(self, channel: Channel, row: int) -> float:
        """Return what a rate adds up to from the first row of the file to this one, SI."""
        rows = slice(row + 1)
        return float(np.trapezoid(self.si(channel)[rows], self.time[rows]))

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Time of each row, s, shape (n,): as measured, or row of the file / sample rate."""
        if self.layout.time:
            return self.si(self.layout.time)
        rate = real_number("sample_rate", self.layout.sample_rate, above=0.0)
        return (self.layout.skip_rows + np.arange(self.length)) / rate

    def place(self, row: int, what: str | None = None) -> str:
        """Return where in the file a row stands, for errors about it or about one of its cells."""
        row_of_file = row + self.above + self.layout.skip_rows + 1
        place = f"line {self.text.lines[row]}" if self.text else f"row {row_of_file}"
        return f"{self.path.name}, {place}" + ("" if what is None else f": {what}")

    @property
    def span(self) -> str:
        """Lines or rows of the file where the rows stand, for errors."""
        if self.text:
            return f"{self.path.name}, lines {self.text.lines[0]} to {self.text.lines[-1]}"
        first_row = self.above + self.layout.skip_rows + 1
        last_row = first_row + self.length - 1
        return f"{self.path.name}, rows {first_row} to {last_row}"


@dataclass(frozen=True, eq=False)
class Table:
    """A measured record: uniform time in s and finite channels in SI, each of shape (n,).

    Time is as measured, or row / sample rate counted from the first row of the file. ``dropped``
    counts rows with mapped values that were not finite: left out at the ends, interpolated inside.
    ``remark`` says what else was done to the rows, empty if they are as they were measured, and
    ``interpolated`` whether they stand where none was measured, as in `EvenRows`.
    """

    time: NDArray[np.float64]
    channels: dict[str, NDArray[np.float64]]
    dropped: int
    remark: str = ""
    interpolated: bool = False


def read_table(
    path: Path, layout: TableLayout, seen: Seen | None = None, part: Part | None = None
) -> Table:
    """Read the mapped columns; a constant one is allowed, since the caller knows which must vary.

    Rows at uneven times are brought to even steps, as `even_steps` has it.

    Raises `OSError` if the file cannot be read and `InvalidInput`, with file and line (MATLAB:
    row), if it is damaged, larger than its `Budget` or the memory allows, a column is missing,
    ragged or holds text or a huge number, too few rows are finite or too many at a time are not, or
    time does not rise or leaves a gap.
    """
    return _tables(path, layout, seen, part, split=False)[0]


def read_unbroken_tables(
    path: Path, layout: TableLayout, seen: Seen | None = None, part: Part | None = None
) -> list[Table]:
    """Read the mapped columns as `read_table` does; a gap in time begins another table.

    A file with more than one gap per `ROWS_PER_FILLED` rows is refused, as by `read_table`. Tables
    with less than that share of the rows are left out.

    Returns
    -------
    list of Table
        At least one; each remark says how the file was divided.
    """
    return _tables(path, layout, seen, part, split=True)


def _tables(
    path: Path, layout: TableLayout, seen: Seen | None, part: Part | None, split: bool
) -> list[Table]:
    read = read_columns(path, layout, gaps=True, seen=seen)
    rows = _part_of(read, part)
    columns = {name: raw[rows] for name, raw in read.raw.items()}

    def refuse(row: int, column: str | int, allowed: str) -> InvalidInput:
        field = read.place(rows.start + row, column_label(column))
        return InvalidInput(field, float(columns[column][row]), allowed)

    for column, raw in columns.items():
        for row in np.flatnonzero(np.isfinite(raw) & (np.abs(raw) > LARGEST))[:1]:
            raise refuse(row, column, f"at most {LARGEST:g} in size")
    finite = np.all([np.isfinite(raw) for raw in columns.values()], axis=0)
    whole = np.flatnonzero(finite)
    if whole.size < FEWEST_ROWS:
        of = f" in {part.by} = {[part.start, part.stop]}" if part else ""
        place = f"{path.name}: finite rows after skip_rows = {layout.skip_rows}{of}"
        raise InvalidInput(place, whole.size, f"at least {FEWEST_ROWS}")

    def missing(row: int, allowed: str) -> InvalidInput:
        column = next(name for name, raw in columns.items() if not np.isfinite(raw[row]))
        return refuse(row, column, f"finite, but for {allowed}")

    start, stop, gaps = int(whole[0]), int(whole[-1]) + 1, np.diff(whole) - 1
    filled = int(gaps.sum())
    if filled and filled * ROWS_PER_FILLED >= stop - start:
        row = start + int(np.argmin(finite[start:stop]))
        raise missing(row, f"fewer than 1 % of rows; here {filled} are not")
    for at in np.flatnonzero(gaps > LONGEST_GAP)[:1]:
        allowed = f"gaps of at most {LONGEST_GAP} rows; here are {gaps[at]}"
        raise missing(int(whole[at]) + 1, allowed)
    record_rows = slice(rows.start + start, rows.start + stop)
    time, dropped = read.time[record_rows], int(np.count_nonzero(~finite))
    steps = np.diff(time)
    mean, usual = float(np.mean(steps)), float(np.median(steps))
    falls, leaps = steps <= 0.0, steps > LONGEST_STEP * mean
    # Over a gap nobody knows how many turns an angle made, or what a rate added up to.
    counts = any(
        channel.unwrap or channel.wraps is not None or channel.integrated
        for channel in layout.channels.values()
    )
    divided = split and leaps.any() and not falls.any() and not counts
    pieces = _pieces(steps, usual) if divided else []
    for row in np.flatnonzero(falls | leaps)[:1] if not pieces else ():
        allowed = (
            f"rising by the median step, {usual:g} s, within 1 %, or unevenly, by at most "
            f"{LONGEST_STEP * mean:.4g} s, {LONGEST_STEP:g} mean steps; or take a sample_rate, or "
            "a record for each part"
        )
        column = layout.time.column if layout.time else next(iter(columns))
        raise refuse(start + int(row) + 1, column, allowed)
    if not pieces:
        return [_even_table(read, record_rows, dropped)]
    gap_row = record_rows.start + int(np.argmax(steps > LONGEST_STEP * usual))
    out = len(time) - sum(piece.stop - piece.start for piece in pieces)
    said = (
        f"{path.name} leaves gaps of up to {1e3 * float(steps.max()):.4g} ms between rows that are "
        f"{1e3 * usual:.4g} ms apart, the first after {read.place(gap_row)}. The rows "
        f"between gaps are records of their own, {len(pieces)} in number."
    ) + (f" Rows of shorter parts are left out: {out}." if out else "")
    tables = [
        _even_table(
            read,
            slice(record_rows.start + piece.start, record_rows.start + piece.stop),
            0 if number else dropped,
        )
        for number, piece in enumerate(pieces)
    ]
    return [replace(table, remark=f"{said} {table.remark}".strip()) for table in tables]


def _pieces(steps: NDArray[np.float64], usual: float) -> list[slice]:
    """Return the rows between gaps in time that are long enough to use; none if gaps are many."""
    ends = np.flatnonzero(steps > LONGEST_STEP * usual) + 1
    rows = len(steps) + 1
    if len(ends) * ROWS_PER_FILLED >= rows:
        return []
    limits = [0, *ends.tolist(), rows]
    least = max(FEWEST_ROWS, rows // ROWS_PER_FILLED)
    return [slice(start, stop) for start, stop in pairwise(limits) if stop - start >= least]


def _even_table(read: Columns, rows: slice, dropped: int) -> Table:
    """Return rows without a gap in time, at even steps."""
    layout, time = read.layout, read.time[rows]
    # Turns of an angle that wraps, and rates, count from the first row of the file.
    signals = {name: read.si(channel)[rows] for name, channel in layout.channels.items()}
    remark, interpolated = "", False
    if layout.time is not None and not is_even(time):
        even = even_steps(time, signals)
        time, signals = even.time, even.signals
        remark, interpolated = even.remark, even.interpolated
    for name, channel in layout.channels.items():
        # Only now: the integral over stamps that are wrong is smooth over them, and hides it.
        if channel.integrated:
            sums = make_interp_spline(time, signals[name], 3).antiderivative()(time)
            signals[name] = sums - sums[0] + read.sum_before(channel, rows.start)
    return Table(time, signals, dropped, remark, interpolated)


def _part_of(read: Columns, part: Part | None) -> slice:
    """Return the rows of a part of a file."""
    return slice(0, read.length) if part is None else part.rows_of(read.time)


def check_sha256(path: Path, expected: str) -> None:
    """Raise `InvalidInput` unless the sha256 of a file begins with these 8 or more digits."""
    if not isinstance(expected, str) or not re.fullmatch("[0-9a-fA-F]{8,64}", expected):
        raise InvalidInput("expected sha256", expected, "8 to 64 hexadecimal digits")
    regular_file(path)
    with path.open("rb") as file:
        actual = hashlib.file_digest(file, "sha256").hexdigest()
    if not actual.startswith(expected.lower()):
        raise InvalidInput(f"{path.name}: sha256", actual, f"one that begins with {expected}")


def read_columns(
    path: Path, layout: TableLayout, *, gaps: bool = False, seen: Seen | None = None
) -> Columns:
    """Read the mapped columns.

    Parameters
    ----------
    path : Path
    layout : TableLayout
    gaps : bool
        Whether values may be missing or not finite.
    seen : callable, optional
        Called with the number of further bytes read.

    Raises
    ------
    InvalidInput
        As `read_table`, except that neither values nor the number of rows nor times are checked.
    OSError
        If the file cannot be read.
    """
    with refused_if_too_large(path):
        return _columns(path, layout, gaps, seen)


def _columns(path: Path, layout: TableLayout, gaps: bool, seen: Seen | None) -> Columns:
    mapped = [*([layout.time] if layout.time else []), *layout.channels.values()]
    names: list[Any] = list(dict.fromkeys(channel.column for channel in mapped))
    form = format_of(path, layout.format)
    if form in READERS:
        arrays = read_arrays(path, form, [str(name) for name in names])
        if seen:
            seen(path.stat().st_size)
        raw = {name: arrays.vectors[str(name)][layout.skip_rows :] for name in names}
        read = Columns(path, layout, raw, None, len(raw[names[0]]), arrays.above)
        for name in names if not gaps else ():
            for row in np.flatnonzero(~np.isfinite(raw[name]))[:1]:
                place = read.place(int(row), column_label(name))
                raise InvalidInput(place, float(raw[name][row]), "a finite number")
        return read
    titled = form == "csv"
    counted = titled and any(isinstance(name, int) for name in names)
    if counted and not all(isinstance(name, int) for name in names):
        raise InvalidInput(f"{path.name}: columns", names, "titles for all, or numbers for all")
    table = read_text_table(
        path,
        titled=titled,
        skip_rows=layout.skip_rows,
        wanted=names if titled else (),
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        encoding=layout.encoding,
        seen=seen,
    )
    if counted:
        titles = {name: numbered(name) for name in names}
        columns = table.numbers(list(titles.values()), gaps=gaps)
        raw = {name: columns[title] for name, title in titles.items()}
        return Columns(path, layout, raw, table, len(raw[names[0]]))
    for channel in mapped:
        _check_unit(table, channel)
    raw = table.numbers(names, gaps=gaps)
    return Columns(path, layout, raw, table, len(raw[names[0]]))


def _check_unit(table: TextTable, channel: Channel) -> None:
    """Refuse a channel whose unit differs from that in the row of units of the file."""
    unit = usual_spelling(table.units.get(str(channel.column), "").strip("[]() "))
    stated = CHANNEL_UNITS.get(unit), ORIGINS.get(unit, 0.0)
    if unit in CHANNEL_UNITS and stated != (channel.factor, channel.origin):
        field = f"{table.file}, line {table.title_line + 1}: unit of {channel.column}"
        raise InvalidInput(field, unit, f"{channel.unit}, as the layout says")
