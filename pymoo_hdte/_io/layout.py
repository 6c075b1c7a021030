"""Layouts: which column of a measured table is which channel, in which unit, sign and zero.

A campaign and a rig of any other machine state it in the same words, in ``[table]``.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pymoo_hdte._io.csv_table import LARGEST
from pymoo_hdte._io.encodings import ENCODINGS
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.text_columns import DECIMALS
from pymoo_hdte._io.text_header import DELIMITERS
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.units import ORIGINS, UNITS, suggestion, usual_spelling

TEXTS = ("csv", "plain")
"""Formats of text."""
FORMATS = ("matlab", *TEXTS, "json_lines", "npz", "xlsx", "hdf5", "rosbag2", "mcap")
MEASURED = (
    *("time", "angle", "length", "speed", "linear speed", "acceleration", "linear acceleration"),
    *("force", "torque", "current", "voltage", "temperature", "ratio"),
)
"""Quantities, among those of `pymoo_hdte.units`, that a channel may hold."""
CHANNEL_UNITS = {unit: size for quantity in MEASURED for unit, size in UNITS[quantity].items()}
"""Every unit a channel may have, with its factor to SI."""

COUNTS = "counts"
"""Unit of an angle that is counted by an encoder, which says how many counts a turn has."""


@dataclass(frozen=True)
class Channel:
    """A column with its unit; a value in SI is ``(reading - zero) * factor * scale + origin``.

    Attributes
    ----------
    column : str or int
        Its title, or in a table of text its number from 0. An empty title stands for no column.
    unit : str
        One of `CHANNEL_UNITS`, or `COUNTS`.
    scale : float
        A factor after the unit; -1 turns the sign. In a file ``divided_by``, such as a gear ratio,
        divides it.
    unwrap : bool
        For angles that jump by a turn.
    wraps : float, optional
        Interval, in the unit, after which the readings of an overflowing counter begin anew.
    counts_per_turn : float, optional
        Counts of a turn of the encoder, for the unit `COUNTS` only.
    zero : float
        Reading where the channel is zero, in the unit.
    integrated : bool
        Whether the readings are the rates of what is wanted, which is zero in the first row.

    Raises
    ------
    InvalidInput
        For an unknown unit, or a field that does not go with the unit.
    """

    column: str | int
    unit: str
    scale: float = 1.0
    unwrap: bool = False
    wraps: float | None = None
    counts_per_turn: float | None = None
    zero: float = 0.0
    integrated: bool = False

    def __post_init__(self) -> None:
        units = (COUNTS, *(UNITS["angle"] if self.unwrap else CHANNEL_UNITS))
        one_of("unit", self.unit, units)
        if (self.unit == COUNTS) != (self.counts_per_turn is not None):
            allowed = f"a number with unit {COUNTS!r}, absent with any other"
            raise InvalidInput("counts_per_turn", self.counts_per_turn, allowed)
        if self.counts_per_turn is not None:
            real_number("counts_per_turn", self.counts_per_turn, above=0.0, at_most=LARGEST)
        if self.wraps is not None:
            real_number("wraps", self.wraps, above=0.0, at_most=LARGEST)
            if self.unwrap:
                raise InvalidInput("wraps", self.wraps, "absent if unwrap is true")

    @property
    def factor(self) -> float:
        """Factor of the unit to SI."""
        if self.counts_per_turn is not None:
            return 2.0 * math.pi / self.counts_per_turn
        return CHANNEL_UNITS[self.unit]

    @property
    def origin(self) -> float:
        """Value in SI at zero of the unit: 0 but for degrees Celsius."""
        return ORIGINS.get(self.unit, 0.0)

    @property
    def period(self) -> float | None:
        """Interval in SI after which the readings begin anew, or None."""
        if self.unwrap:
            return 2.0 * math.pi * abs(self.scale)
        return None if self.wraps is None else abs(self.wraps * self.factor * self.scale)


@dataclass(frozen=True)
class TableLayout:
    """What `layout_from_fields` reads: a time column or a sample rate in Hz, never both.

    ``skip_rows`` rows at the start are left out unread: a start-up, or remarks in a plain table.
    ``delimiter``, ``decimal`` and ``encoding`` are as in `read_text_table`.
    """

    format: str
    channels: dict[str, Channel]
    time: Channel | None
    sample_rate: float | None
    skip_rows: int
    delimiter: str | None = None
    decimal: str | None = None
    encoding: str | None = None


def layout_from_fields(table: Fields, usual: TableLayout | None = None) -> TableLayout:
    """Return the layout in a table ``[table]``.

    Without a format it is a CSV file, or a plain one if columns are called by numbers.

    Parameters
    ----------
    table : Fields
    usual : TableLayout, optional
        Layout that holds for whatever the table leaves out. The table may then name only its
        channels, in units of the same quantities.

    Raises
    ------
    InvalidInput
        With the name of the faulty field.
    """
    form = usual.format if usual else None
    form = table.choice("format", FORMATS) if table.has("format") else form
    mapped = _channels(table, form, usual)
    time = usual.time if usual else None
    if table.has("time"):
        time = _channel(table.table("time"), form, UNITS["time"])
        if table.has("sample_rate"):
            raise InvalidInput(table.name_of("time"), time.column, "absent if sample_rate is given")
    form = form or _form_of(table, [*mapped.values(), *([time] if time else [])])
    rate = usual.sample_rate if usual else None
    if table.has("sample_rate") or (time is None and rate is None):
        time, rate = None, table.number("sample_rate", at_least=1e-3, at_most=1e9)
    skip_rows = usual.skip_rows if usual else 0
    skip_rows = table.whole("skip_rows", 0) if table.has("skip_rows") else skip_rows
    marks = [
        table.choice(name, words) if table.has(name) else (getattr(usual, name) if usual else None)
        for name, words in (
            ("delimiter", DELIMITERS),
            ("decimal", DECIMALS),
            ("encoding", ENCODINGS),
        )
    ]
    table.finish()
    return TableLayout(form, mapped, time, rate if time is None else None, skip_rows, *marks)


def with_zeros(table: Fields, layout: TableLayout) -> TableLayout:
    """Return a layout with the zeros of a table, a reading for each channel named.

    Raises
    ------
    InvalidInput
        For a channel that the layout does not have, or a reading that is no number.
    """
    channels = dict(layout.channels)
    there = [name for name, channel in channels.items() if channel.column != ""]
    for name in table.names():
        one_of(table.name_of("channel"), name, there)
        zero = table.number(name, at_least=-LARGEST, at_most=LARGEST)
        channels[name] = replace(channels[name], zero=zero)
    return replace(layout, channels=channels)


def _form_of(table: Fields, channels: Sequence[Channel]) -> str:
    """Return the format of a file whose columns have titles, or numbers."""
    numbered = {isinstance(channel.column, int) for channel in channels}
    if len(numbered) > 1:
        columns = [channel.column for channel in channels]
        raise InvalidInput(table.name_of("columns"), columns, "titles for all, or numbers for all")
    return "plain" if True in numbered else "csv"


def _channels(table: Fields, form: str | None, usual: TableLayout | None) -> dict[str, Channel]:
    known = usual.channels if usual else {}
    if usual and not table.has("channels"):
        return dict(known)
    channels = table.table("channels")
    # Fields does not tell its names, because its other users know theirs beforehand.
    names = channels.names()
    if not names:
        raise InvalidInput(table.name_of("channels"), {}, "at least one channel")
    mapped = dict(known)
    for name in names:
        if usual:
            one_of(channels.name_of("name"), name, tuple(known))
        units = _units_beside(known[name]) if name in known else CHANNEL_UNITS
        mapped[name] = _channel(channels.table(name), form, units)
    return mapped


def _units_beside(channel: Channel) -> Collection[str]:
    """Return the units of the quantity of a channel."""
    if channel.unit == COUNTS:
        return UNITS["angle"]
    return next(UNITS[quantity] for quantity in MEASURED if channel.unit in UNITS[quantity])


def _channel(table: Fields, form: str | None, units: Collection[str]) -> Channel:
    # A CSV file whose titles are missing, or twice there, has columns by number all the same.
    numbered = form == "plain" or (form in (None, "csv") and table.is_number("column"))
    column = table.whole("column", 0) if numbered else table.text("column")
    unwrap = table.truth("unwrap") if table.has("unwrap") else False
    units = UNITS["angle"] if unwrap else units
    unit = _unit(table, (COUNTS, *units) if set(UNITS["angle"]) <= set(units) else tuple(units))
    options: dict[str, Any] = {
        name: table.number(name, at_least=-LARGEST, at_most=LARGEST)
        for name in ("scale", "wraps", "counts_per_turn", "zero")
        if table.has(name)
    }
    if table.has("divided_by"):
        divisor = table.number("divided_by", at_least=-LARGEST, at_most=LARGEST)
        if divisor == 0.0:
            raise InvalidInput(table.name_of("divided_by"), divisor, "another number than 0")
        options["scale"] = options.get("scale", 1.0) / divisor
    table.finish()
    try:
        return Channel(column, unit, unwrap=unwrap, **options)
    except InvalidInput as error:
        raise InvalidInput(table.name_of(error.field), error.value, error.allowed) from None


def _unit(table: Fields, units: tuple[str, ...]) -> str:
    """Take the unit; one of another quantity is refused with what it is a unit of."""
    stated = table.take("unit", f"one of {', '.join(units)}")
    unit = usual_spelling(stated) if isinstance(stated, str) else ""
    if unit in units:
        return unit
    known = ", ".join(map(repr, units))
    allowed = f"one of {known}{suggestion(str(stated), units)}"
    if unit in CHANNEL_UNITS:
        kind = next(quantity for quantity in MEASURED if unit in UNITS[quantity])
        allowed = f"no unit of {kind}, which this column does not hold, but one of {known}"
    raise InvalidInput(table.name_of("unit"), stated, allowed)
