"""Measured tables in MATLAB files, CSV and plain text, mapped to channels in SI by a layout."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.io.matlab import read_vectors
from pymoo_hdte.io.text_table import LARGEST, column_label, line_of_row, read_text_table
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
RawColumns = dict[Any, NDArray[np.float64]]


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
    """Read the mapped columns; a constant one is allowed, since the caller knows which must vary.

    Raises `OSError` if the file cannot be read and `InvalidInput`, with file and line (MATLAB:
    row), if it is damaged, a column is missing, ragged or holds text or a huge number, too few
    rows are finite or too many at a time are not, or time does not rise in equal steps.
    """
    mapped = [*([layout.time] if layout.time else []), *layout.channels.values()]
    names = list(dict.fromkeys(channel.column for channel in mapped))
    columns = _columns(path, layout, names)

    def refuse(row: int, column: str | int, allowed: str) -> InvalidInput:
        field = _place(path, layout, row, column_label(column))
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


def _columns(path: Path, layout: TableLayout, names: list[Any]) -> RawColumns:
    """Return columns as they stand in the file, without the rows to be skipped."""
    if layout.format == "matlab":
        found = read_vectors(path, names)
        return {name: found[name][layout.skip_rows :] for name in names}
    csv = layout.format == "csv"
    table = read_text_table(path, titled=csv, skip_rows=layout.skip_rows)
    return table.numbers(names, gaps=True)


def _si(channel: Channel, kept: Mapping[str | int, NDArray[np.float64]]) -> NDArray[np.float64]:
    raw = kept[channel.column]
    at = np.flatnonzero(np.isfinite(raw))
    values = raw[at] * CHANNEL_UNITS[channel.unit]
    # Unwrapped before interpolation, which is invalid across a jump of the angle.
    values = (np.unwrap(values) if channel.unwrap else values) * channel.scale
    return values if at.size == raw.size else np.interp(np.arange(raw.size), at, values)


def _place(path: Path, layout: TableLayout, row: int, what: str) -> str:
    row += layout.skip_rows
    number = line_of_row(row) if layout.format == "csv" else row + 1
    return f"{path.name}, {'row' if layout.format == 'matlab' else 'line'} {number}: {what}"
