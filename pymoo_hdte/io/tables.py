"""Measured tables in MATLAB files, CSV and plain text, mapped to channels in SI by a layout."""

from __future__ import annotations

import hashlib
import re
import struct
import zlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.units import UNITS

MEASURED = (
    *("time", "angle", "length", "speed", "linear speed", "acceleration", "linear acceleration"),
    *("force", "torque", "current", "voltage", "ratio"),
)
"""Quantities, among those of `pymoo_hdte.units`, that a channel may hold."""
CHANNEL_UNITS = {unit: size for one in MEASURED for unit, size in UNITS[one].items()}
"""Every unit a channel may have, with its factor to SI."""

FEWEST_ROWS = 16
STEP_SPREAD = 0.01  # Relative, of a time step from the median step.
ROWS_PER_FILLED = 100  # Interpolated values may stand in fewer than one row in this many.
LONGEST_GAP = 2  # Rows: across more of them a straight line is no motion.
LARGEST = 1e15  # A double beyond it no longer holds tenths: it marks a fault, nobody measured it.
COMPRESSED, COMPLEX, NUMERIC = 15, 0x800, range(6, 16)  # Codes of MATLAB v5, as are these:
NUMBERS = dict(zip((1, 2, 3, 4, 5, 6, 7, 9, 12, 13), "bBhHiIfdqQ", strict=True))
RawColumns = dict[str | int, NDArray[np.float64]]


@dataclass(frozen=True)
class Channel:
    """A column (in a plain table its number from 0) and its unit, one of `CHANNEL_UNITS`.

    Another unit raises `InvalidInput`. ``scale`` is a factor after the unit; ``unwrap`` is for
    angles that jump by a turn.
    """

    column: str | int
    unit: str
    scale: float = 1.0
    unwrap: bool = False

    def __post_init__(self) -> None:
        one_of("unit", self.unit, UNITS["angle"] if self.unwrap else CHANNEL_UNITS)


@dataclass(frozen=True)
class TableLayout:
    """What `layout_from_fields` reads: a time column or a sample rate in Hz, never both.

    ``skip_rows`` rows at the start are left out unread: a start-up, or remarks in a plain table.
    """

    format: str
    channels: dict[str, Channel]
    time: Channel | None
    sample_rate: float | None
    skip_rows: int


@dataclass(frozen=True, eq=False)
class Table:
    """A measured record: uniform time in s and finite channels in SI, each of shape (n,).

    Time is as measured, or row / sample rate counted from the first row of the file. ``dropped``
    counts rows with mapped values that were not finite: left out at the ends, interpolated inside.
    """

    time: NDArray[np.float64]
    channels: dict[str, NDArray[np.float64]]
    dropped: int


def layout_from_fields(table: Fields) -> TableLayout:
    """Return the layout in ``[table]`` of a rig's file, or raise `InvalidInput` with the field."""
    form = table.choice("format", ("matlab", "csv", "plain"))
    channels = table.table("channels")
    # Fields does not tell its names, because its other users know theirs beforehand.
    names = list(channels.names())
    if not names:
        raise InvalidInput(table._name("channels"), {}, "at least one channel")
    mapped = {name: _channel(channels.table(name), form, CHANNEL_UNITS) for name in names}
    time = _channel(table.table("time"), form, UNITS["time"]) if table.has("time") else None
    if time and table.has("sample_rate"):
        raise InvalidInput(table._name("time"), time.column, "absent if sample_rate is given")
    rate = None if time else table.number("sample_rate", at_least=1e-3, at_most=1e9)
    skip_rows = table.whole("skip_rows", 0) if table.has("skip_rows") else 0
    table.finish()
    return TableLayout(form, mapped, time, rate, skip_rows)


def _channel(table: Fields, form: str, units: Collection[str]) -> Channel:
    column = table.whole("column", 0) if form == "plain" else table.text("column")
    unwrap = table.take("unwrap", "") if table.has("unwrap") else False
    if not isinstance(unwrap, bool):
        raise InvalidInput(table._name("unwrap"), unwrap, "true or false")
    unit = table.choice("unit", UNITS["angle"] if unwrap else units)
    has_scale = table.has("scale")
    scale = table.number("scale", at_least=-LARGEST, at_most=LARGEST) if has_scale else 1.0
    table.finish()
    return Channel(column, unit, scale, unwrap)


def read_table(path: Path, layout: TableLayout) -> Table:
    """Read the mapped columns; a constant one is allowed, the caller knows which must move.

    Raises `OSError` if the file cannot be read and `InvalidInput`, with file and line (MATLAB:
    row), if it is damaged, a column is missing, ragged or holds text or a huge number, too few
    rows are finite or too many at a time are not, or time does not rise in equal steps.
    """
    mapped = [*([layout.time] if layout.time else []), *layout.channels.values()]
    names = list(dict.fromkeys(channel.column for channel in mapped))
    columns = (_read_matlab if layout.format == "matlab" else _read_text)(path, layout, names)

    def refuse(row: int, column: str | int, allowed: str) -> InvalidInput:
        field = _place(path, layout, row, f"column {column}")
        return InvalidInput(field, float(columns[column][row]), allowed)

    for column, raw in columns.items():
        for row in np.flatnonzero(np.isfinite(raw) & (np.abs(raw) > LARGEST))[:1]:
            raise refuse(row, column, f"at most {LARGEST:g} in size")
    finite = np.all([np.isfinite(raw) for raw in columns.values()], axis=0)
    whole = np.flatnonzero(finite)
    if whole.size < FEWEST_ROWS:
        place = f"{path.name}: finite rows after skip_rows = {layout.skip_rows}"
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
    kept = {name: raw[start:stop] for name, raw in columns.items()}
    if layout.time:
        time = _si(layout.time, kept)
        steps = np.diff(time)
        step = float(np.median(steps))
        for row in start + 1 + np.flatnonzero(np.abs(steps - step) >= STEP_SPREAD * step)[:1]:
            allowed = f"rising by the median step, {step:g} s, within 1 %; or take a sample_rate"
            raise refuse(row, layout.time.column, allowed)
    else:
        rate = real_number("sample_rate", layout.sample_rate, above=0.0)
        time = (layout.skip_rows + np.arange(start, stop)) / rate
    channels = {name: _si(channel, kept) for name, channel in layout.channels.items()}
    return Table(time, channels, int(np.count_nonzero(~finite)))


def check_sha256(path: Path, expected: str) -> None:
    """Raise `InvalidInput` unless the sha256 of a file begins with these 8 or more digits."""
    if not isinstance(expected, str) or not re.fullmatch("[0-9a-fA-F]{8,64}", expected):
        raise InvalidInput("expected sha256", expected, "8 to 64 hexadecimal digits")
    actual = hashlib.sha256(path.read_bytes()).hexdigest()
    if not actual.startswith(expected.lower()):
        raise InvalidInput(f"{path.name}: sha256", actual, f"one that begins with {expected}")


def _si(channel: Channel, kept: Mapping[str | int, NDArray[np.float64]]) -> NDArray[np.float64]:
    raw = kept[channel.column]
    at = np.flatnonzero(np.isfinite(raw))
    values = raw[at] * CHANNEL_UNITS[channel.unit]
    # Unwrapped before anything is interpolated: halfway across a jump there is no angle.
    values = (np.unwrap(values) if channel.unwrap else values) * channel.scale
    return values if at.size == raw.size else np.interp(np.arange(raw.size), at, values)


def _place(path: Path, layout: TableLayout, row: int, what: str) -> str:
    number = row + layout.skip_rows + (2 if layout.format == "csv" else 1)
    return f"{path.name}, {'row' if layout.format == 'matlab' else 'line'} {number}: {what}"


def _element(data: bytes, at: int, order: str) -> tuple[int, bytes, int]:
    kind, size = struct.unpack_from(f"{order}II", data, at)
    # Up to four bytes stand in the tag itself, their number in its upper half.
    if kind >> 16:
        return kind & 0xFFFF, data[at + 4 : at + 4 + (kind >> 16)], at + 8
    after = at + 8 + size
    return kind, data[at + 8 : after], after if kind == COMPRESSED else after + -size % 8


@np.errstate(invalid="ignore")  # Damaged bytes may be signalling NaNs of single precision.
def _read_matlab(path: Path, layout: TableLayout, names: list[Any]) -> RawColumns:
    # Not scipy.io.loadmat: in 1.17 a damaged type of number still crashes the interpreter.
    data, at = path.read_bytes(), 128
    found, columns = dict[str, str](), RawColumns()
    try:
        order = {b"\0\1IM": "<", b"\1\0MI": ">"}[data[124:128]]
        while at < len(data):
            kind, matrix, at = _element(data, at, order)
            matrix = zlib.decompress(matrix)[8:] if kind == COMPRESSED else matrix
            flags = struct.unpack_from(f"{order}8xI", matrix)[0]
            _, shape, start = _element(matrix, 16, order)
            _, title, start = _element(matrix, start, order)
            name, lengths = title.decode("latin-1"), np.frombuffer(shape, f"{order}i4")
            found[name] = f"MATLAB class {flags & 0xFFF:#x} of shape {lengths.tolist()}"
            if name in names and flags & 0xFF in NUMERIC and not flags & COMPLEX:
                kind, numbers, _ = _element(matrix, start, order)
                values = np.frombuffer(numbers, order + NUMBERS[kind]).reshape(lengths)
                if values.size == max(lengths):
                    columns[name] = values.ravel().astype(float)[layout.skip_rows :]
    except (KeyError, ValueError, struct.error, zlib.error) as error:
        allowed = "an intact MATLAB file (save v4 or v7.3, HDF5, as v5 or v7)"
        raise InvalidInput(path.name, repr(error)[:200], allowed) from None
    for name in names:
        if name not in columns or columns[name].size != columns[names[0]].size:
            allowed = f"a vector of real numbers, all of one length; there are {found}"
            raise InvalidInput(f"{path.name}: {name}", found.get(name), allowed[:500])
    return columns


def _read_text(path: Path, layout: TableLayout, names: list[Any]) -> RawColumns:
    text = re.sub("\r\n?", "\n", path.read_bytes().decode("utf-8-sig", "replace")).rstrip()
    lines, headed = text.split("\n"), layout.format == "csv"
    for number, line in enumerate(lines, start=1):
        if "\0" in line or "\ufffd" in line:
            raise InvalidInput(f"{path.name}, line {number}", line[:80], "UTF-8 without NUL bytes")
    rows = lines[headed + layout.skip_rows :]
    top = "".join(lines[:1] if headed else rows[:1])
    mark = ";" if headed and ";" in top else "," if headed or "," in top else None
    titles = [cell.strip(' \t"') for cell in top.split(mark)]
    header: list[Any] = titles if headed else list(range(len(titles)))
    for name in names:
        if rows and header.count(name) != 1:
            raise InvalidInput(f"{path.name}: column", name, f"one of {header}, there once"[:500])
    # Every cell of a plain table is read: a decimal comma would pass for a separator.
    columns = {name: np.empty(len(rows)) for name in (names if headed or not rows else header)}
    for row, line in enumerate(rows):
        cells = line.split(mark)
        if len(cells) != len(header):
            field = _place(path, layout, row, "number of cells")
            raise InvalidInput(field, len(cells), f"{len(header)}, as in the first line")
        for name, column in columns.items():
            cell = cells[header.index(name)].strip(' \t"')
            try:
                # Python would read 1_000 as a thousand.
                column[row] = float(cell.replace("_", "?") or "nan")
            except ValueError:
                field = _place(path, layout, row, f"column {name}")
                raise InvalidInput(field, cell[:80], "a number (decimal point)") from None
    return {name: columns[name] for name in names}
