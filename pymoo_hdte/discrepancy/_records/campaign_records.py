"""Records of a campaign on disk: the columns of a file become channels in SI, and back."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte._io.array_files import READERS
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import Channel, TableLayout, layout_from_fields, with_zeros
from pymoo_hdte._io.tables import Columns, read_columns
from pymoo_hdte._io.text_lines import Seen
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.campaign_keys import (
    CAMPAIGN_FILE,
    ENDING,
    LAYOUT,
    PLAIN_ENDING,
    RANGES,
    RUNNING,
    SERIES,
    TEMPERATURE,
    TEMPERATURE_FIELD,
    TORSION,
    TRANSMISSION_ERROR,
    build,
    in_units,
)
from pymoo_hdte.discrepancy._records.records import (
    ROLES,
    RunningRecord,
    TorsionRecord,
    is_record_name,
)
from pymoo_hdte.units import ORIGINS

_ENDINGS = (
    *(ENDING, PLAIN_ENDING, ".txt.gz", ".txt"),
    *(ending for endings, _ in READERS.values() for ending in endings),
)
"""Endings of the files of records."""

Channels = dict[str, Any]
"""Values by attribute of the record: arrays (n,), and a number for the temperature."""


@dataclass(frozen=True)
class FileOfRecord:
    """A record and the name of its file; ``span()`` says where in the file its rows stand."""

    record: RunningRecord | TorsionRecord
    file: str
    span: Callable[[], str]


def record_path(entry: Fields, place: str, folder: Path) -> Path:
    """Take the path of a record's file out of its table.

    Raises
    ------
    InvalidInput
        For a name that a record cannot have, or no such file in the folder.
    """
    file = entry.text("file")
    if not _name_of(file):
        allowed = f"a name without folders, ending in {', '.join(_ENDINGS)}"
        raise InvalidInput(f"{place}.file", file, allowed)
    if not (folder / file).is_file():
        raise InvalidInput(f"{place}.file", file, f"a file in {folder}")
    return folder / file


def read_record(
    entry: Fields,
    place: str,
    path: Path,
    ratio: float,
    shared: TableLayout = LAYOUT,
    seen: Seen | None = None,
) -> FileOfRecord:
    """Read the record of a table ``[[record]]``.

    Parameters
    ----------
    entry : Fields
        The table, from which `record_path` has taken the file.
    place : str
        Where the table stands.
    path : Path
        File of the record, from `record_path`.
    ratio : float
        Transmission ratio N, for angles that wrap.
    shared : TableLayout
        Layout of the campaign's files, which the record may change.
    seen : callable, optional
        Called with the number of bytes read since the last call.

    Raises
    ------
    InvalidInput
        With file and line, for a field or a value that is missing, unknown or impossible.
    OSError
        If the file cannot be read.
    """
    role = entry.choice("role", ROLES)
    running = entry.choice("test", ("running", "torsion")) == "running"
    kind: type[RunningRecord | TorsionRecord] = RunningRecord if running else TorsionRecord
    names = RUNNING if running else TORSION
    layout = layout_from_fields(entry.table("table"), shared) if entry.has("table") else shared
    channels = {name: channel for name, channel in layout.channels.items() if channel.column != ""}
    shows_error = running and TRANSMISSION_ERROR in channels
    if shows_error:
        del channels[_computed_angle(channels, place)]
    layout = replace(layout, channels=channels)
    layout = with_zeros(entry.table("zero"), layout) if entry.has("zero") else layout
    stated = layout.channels
    needed = [field.name for field in fields(kind) if field.name in stated]
    needed += [TRANSMISSION_ERROR] * shows_error
    layout = replace(layout, channels={name: stated[name] for name in needed})
    known = _ranges(entry, place) | _temperature(entry, place, layout) if running else {}
    if running and entry.has(SERIES):
        known[SERIES] = entry.whole(SERIES, 1)
    columns = read_columns(path, layout, seen=seen)
    measured = _in_si(columns, ratio)
    with _errors_name_file(columns, place):
        record: RunningRecord | TorsionRecord = build(
            kind, names, entry, place, name=_name_of(path.name), role=role, **known, **measured
        )
    # The record has the numbers in SI, so that those of the file need not be kept.
    empty = replace(columns, raw={})
    return FileOfRecord(record, path.name, lambda: empty.span)


def record_table(record: RunningRecord | TorsionRecord) -> dict[str, Any]:
    """Return the table ``[[record]]`` of a record, without any layout."""
    running = isinstance(record, RunningRecord)
    table = in_units(record, RUNNING if running else TORSION)
    for name, (nominal, spread) in RANGES.items() if running else ():
        if getattr(record, spread):
            del table[RUNNING[nominal][0]]
            table |= in_units(record, {spread: (name, RUNNING[nominal][1])})
    if isinstance(record, RunningRecord) and record.temperature is not None:
        table[TEMPERATURE_FIELD] = round(record.temperature - ORIGINS["C"], 9)
    if isinstance(record, RunningRecord) and record.series != 1:
        table[SERIES] = record.series
    test = "running" if running else "torsion"
    return {"file": f"{record.name}{ENDING}", "test": test} | table | {"role": record.role}


def _name_of(file: str) -> str:
    """Return the name of the record in a file, which stands before its ending; empty for none."""
    stem = next((file.removesuffix(ending) for ending in _ENDINGS if file.endswith(ending)), "")
    return stem if is_record_name(stem) else ""


def _ranges(entry: Fields, place: str) -> dict[str, Any]:
    """Take ranges of speed and load out of a record's table, with their middles as conditions."""
    known: dict[str, Any] = {}
    for name, (nominal, spread) in RANGES.items():
        if not entry.has(name):
            continue
        key, factor = RUNNING[nominal]
        if entry.has(key):
            raise InvalidInput(f"{place}.{name}", entry.numbers(name), f"absent beside {key}")
        limits = entry.numbers(name)
        crosses = nominal == "input_speed" and len(limits) == 2 and limits[0] * limits[1] <= 0.0
        if len(limits) != 2 or not limits[0] < limits[1] or crosses:
            allowed = "[lowest, highest]" + (", without zero" if nominal == "input_speed" else "")
            raise InvalidInput(f"{place}.{name}", limits, allowed)
        known[spread] = (limits[0] * factor, limits[1] * factor)
        known[nominal] = sum(known[spread]) / 2.0
    return known


def _temperature(entry: Fields, place: str, layout: TableLayout) -> dict[str, float]:
    """Take the temperature out of a record's table, where no column has it; K."""
    if not entry.has(TEMPERATURE_FIELD):
        return {}
    celsius = entry.number(TEMPERATURE_FIELD)
    if TEMPERATURE in layout.channels:
        allowed = f"absent beside the column of the channel {TEMPERATURE}"
        raise InvalidInput(f"{place}.{TEMPERATURE_FIELD}", celsius, allowed)
    if not celsius > -ORIGINS["C"]:
        allowed = f"above {-ORIGINS['C']:g}, in degrees Celsius"
        raise InvalidInput(f"{place}.{TEMPERATURE_FIELD}", celsius, allowed)
    return {TEMPERATURE: celsius + ORIGINS["C"]}


def _computed_angle(stated: dict[str, Channel], place: str) -> str:
    """Return the angle that has no column because the transmission error is measured instead."""
    # By identity, because a file may state a channel that equals the default.
    own = [
        name
        for name in ("input_angle", "output_angle")
        if stated[name] is not LAYOUT.channels[name]
    ]
    if len(own) == 2:
        field = f"{place}.table.channels.{TRANSMISSION_ERROR}"
        allowed = "absent beside both input_angle and output_angle, which it follows from"
        raise InvalidInput(field, stated[TRANSMISSION_ERROR].column, allowed)
    return "input_angle" if own == ["output_angle"] else "output_angle"


def _in_si(columns: Columns, ratio: float) -> Channels:
    """Return time and channels of a file in SI, an angle that wraps on one turn with the other."""
    layout = columns.layout
    measured: Channels = {name: columns.si(channel) for name, channel in layout.channels.items()}
    if TEMPERATURE in measured:
        measured[TEMPERATURE] = float(np.mean(measured[TEMPERATURE]))
    if layout.time is not None:
        measured["time"] = columns.si(layout.time)
    elif layout.sample_rate is not None:
        measured["time"] = (layout.skip_rows + np.arange(columns.length)) / layout.sample_rate
    error = measured.pop(TRANSMISSION_ERROR, None)
    if error is not None and "input_angle" in measured:
        return measured | {"output_angle": measured["input_angle"] / ratio - error}
    if error is not None:
        return measured | {"input_angle": (measured["output_angle"] + error) * ratio}
    if "input_angle" not in measured:
        return measured
    # Turns before the first row are unknown, but the transmission error is far below one turn.
    middle = float(np.median(measured["input_angle"] / ratio - measured["output_angle"]))
    period = layout.channels["input_angle"].period
    if period is not None:
        measured["input_angle"] -= period * round(middle * ratio / period)
    elif (period := layout.channels["output_angle"].period) is not None:
        measured["output_angle"] += period * round(middle / period)
    return measured


@contextmanager
def _errors_name_file(columns: Columns, place: str) -> Iterator[None]:
    """Raise errors about the channels of a record as errors about its file."""
    try:
        yield
    except InvalidInput as error:
        if error.field.startswith(CAMPAIGN_FILE):
            raise
        if error.field == "role":
            raise InvalidInput(f"{place}.role", error.value, error.allowed) from None
        row = re.search(r"\[(\d+)]$", error.field)
        where = columns.place(int(row[1])) if row else columns.span
        raise InvalidInput(f"{where}: {error.field}", error.value, error.allowed) from None
