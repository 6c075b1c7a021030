"""Records of a rig on disk: files and parts of files become records in SI."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PureWindowsPath

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.joined import read_unbroken
from pymoo_hdte._io.layout import Channel, TableLayout, layout_from_fields, with_zeros
from pymoo_hdte._io.parts import Part, part_from_fields
from pymoo_hdte._io.tables import check_sha256
from pymoo_hdte._io.text_lines import Seen
from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.discrepancy._records.split import DEFAULT, SPLIT, Block, Split, split_of
from pymoo_hdte.mechanism import Mechanism, Record
from pymoo_hdte.mechanism.records import ROLES
from pymoo_hdte.units import UNITS

_SPEEDS = {*UNITS["speed"], *UNITS["linear speed"]}
_OF_POSITIONS = {"position", "pos", "angle", "travel", "displacement"}
_OF_SPEEDS = {"speed", "velocity", "vel", "rate", "rpm", "omega"}
"""Words in the title of a column that name a speed."""
_ACCELERATIONS = {*UNITS["acceleration"], *UNITS["linear acceleration"]}


@dataclass(frozen=True)
class ListedRecord:
    """A table ``[[records]]``, whose files are not read yet.

    Attributes
    ----------
    place : str
        Where the table stands.
    files : dict of str to Path
        The file of each channel.
    layout : TableLayout
    parts : tuple of (str, str, Part or None)
        Name, role and part of the files of each record: one, or several of a table without a role.
    sha256 : tuple of (Path, str) or None
        A file, and the digits with which its sum begins.
    context : dict of str to (float, float)
        By name of a record the shares of its rows at both ends that belong to other records.
    remark : str
        How a table without a role was divided, if not by default; the first record repeats it.
    """

    place: str
    files: dict[str, Path]
    layout: TableLayout
    parts: tuple[tuple[str, str, Part | None], ...]
    sha256: tuple[Path, str] | None
    context: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    remark: str = ""

    @property
    def paths(self) -> tuple[Path, ...]:
        """Each of the files once."""
        return tuple(dict.fromkeys(self.files.values()))


def listed_record(
    entry: Fields, place: str, folder: Path, shared: TableLayout | None
) -> ListedRecord:
    """Take a record out of its table.

    Parameters
    ----------
    entry : Fields
    place : str
        Where the table stands.
    folder : Path
        With the files.
    shared : TableLayout or None
        Layout of records without one of their own.

    Raises
    ------
    InvalidInput
        For a field that is missing, unknown or impossible, or a file that is not in the folder.
    """
    main = None
    if entry.has("file") or not entry.has("files"):
        main = _path(entry.text("file"), f"{place}.file", folder)
    layout = layout_from_fields(entry.table("table")) if entry.has("table") else shared
    if layout is None:
        raise InvalidInput(f"{place}.table", None, "a layout here, or [table] for all records")
    if entry.has("zero"):
        layout = with_zeros(entry.table("zero"), layout)
    files = _files(entry, place, folder, layout, main)
    sha256 = (main, entry.text("sha256")) if main and entry.has("sha256") else None
    parts = _parts(entry, place, main or next(iter(files.values())))
    entry.finish()
    return ListedRecord(place, files, layout, parts, sha256)


def divided(
    listed: ListedRecord,
    mechanism: Mechanism,
    noise: Mapping[str, float],
    cutoff: float | None,
    seen: Seen | None = None,
) -> ListedRecord:
    """Return a table with the records that `split_of` makes of it; one with a role is unchanged.

    Parameters
    ----------
    listed : ListedRecord
    mechanism : Mechanism
    noise : mapping of str to float
        Standard deviations of channels that are known, SI.
    cutoff : float or None
        Hz, where it is stated.
    seen : callable, optional
        Called with the number of bytes read since the last call.

    Raises
    ------
    InvalidInput, OSError
        As `read_records`.
    """
    if len(listed.parts) < 2:
        return listed
    stem = listed.parts[0][0].removesuffix(f"_{ROLES[0]}")
    whole = replace(listed, parts=((stem, ROLES[0], None),))
    try:
        pieces = read_records(whole, mechanism.coordinates, noise, seen)
    except InvalidInput:
        # What is wrong is told where the parts are read.
        return listed
    if not all(name in pieces[0].channels for name in mechanism.coordinates):
        return listed
    split = split_of(mechanism, pieces, cutoff)
    if split.blocks == DEFAULT:
        return listed
    counts = dict.fromkeys(ROLES, 0)
    parts, context = [], {}
    for role, start, stop in split.blocks:
        counts[role] += 1
        several = sum(block.role == role for block in split.blocks) > 1
        name = f"{stem}_{role}" + (f"_{counts[role]}" if several else "")
        first, last = max(start - split.beside, 0.0), min(stop + split.beside, 1.0)
        parts.append((name, role, Part("share", first, last)))
        context[name] = (start - first) / (last - first), (last - stop) / (last - first)
    return replace(
        listed, parts=tuple(parts), context=context, remark=_division(split.blocks, split)
    )


def _division(blocks: Sequence[Block], split: Split) -> str:
    """Return a sentence on the blocks of a record."""
    held_out = " and ".join(
        f"{100.0 * block.start:.3g} to {100.0 * block.stop:.3g} %"
        for block in blocks
        if block.role == ROLES[1]
    )
    first = f"its first {100.0 * SPLIT:.0f} %"
    expected = (
        f"{first} hold nothing of some of it, or the others do"
        if math.isinf(split.by_default)
        else f"with {first} an error of {split.by_default:.2g} times the noise is to be expected "
        f"where a part is predicted from the other, with these rows {split.chosen:.2g} times"
    )
    return (
        f"Rows from {held_out} of the file are held out and the others are fitted, because both "
        f"parts then hold the directions, speeds and accelerations that occur: {expected}."
    )


def read_records(
    listed: ListedRecord,
    coordinates: Collection[str],
    noise: Mapping[str, float],
    seen: Seen | None = None,
) -> list[Record]:
    """Read the records of a table ``[[records]]``.

    Parameters
    ----------
    listed : ListedRecord
    coordinates : collection of str
        Names of coordinates, whose speeds are integrated.
    noise : mapping of str to float
        Standard deviations of channels that are known, SI.
    seen : callable, optional
        Called with the number of bytes read since the last call.

    Raises
    ------
    InvalidInput
        With file and line, for what `read_unbroken`, `check_sha256` and `Record` refuse, and for a
        coordinate of which only the acceleration was measured.
    OSError
        If a file cannot be read.
    """
    if listed.sha256 is not None:
        _check_sha256(*listed.sha256, listed.place)
    layout, notes = _with_positions(listed, coordinates)
    records: list[Record] = []
    tables = [
        (name if len(pieces) == 1 else f"{name}_{number}", role, table)
        for name, role, part in listed.parts
        for pieces in (read_unbroken(listed.files, layout, seen, part),)
        for number, table in enumerate(pieces, 1)
    ]
    for name, role, table in tables:
        channel_noise = {channel: noise[channel] for channel in noise if channel in table.channels}
        remarks = [*([table.remark] if table.remark else []), *notes]
        if listed.remark and not records:
            remarks.append(listed.remark)
        try:
            record = Record(
                name,
                role,
                table.time,
                table.channels,
                channel_noise,
                table.dropped,
                remarks,
                table.interpolated,
                _context(listed, name, len(table.time)),
            )
        except InvalidInput as error:
            place = f"{listed.paths[0].name}: {error.field}"
            raise InvalidInput(place, error.value, error.allowed) from None
        records.append(record)
    return records


def _context(listed: ListedRecord, name: str, rows: int) -> tuple[int, int]:
    before, after = listed.context.get(name, (0.0, 0.0))
    return round(before * rows), round(after * rows)


def _path(file: str, place: str, folder: Path) -> Path:
    # As a Windows path, which accepts both separators and drive letters.
    parts = PureWindowsPath(file)
    if parts.anchor or ".." in parts.parts or not (folder / file).is_file():
        raise InvalidInput(place, file, f"a file inside {folder}")
    return folder / file


def _files(
    entry: Fields, place: str, folder: Path, layout: TableLayout, main: Path | None
) -> dict[str, Path]:
    """Return the file of each channel."""
    stated: dict[str, Path] = {}
    if entry.has("files"):
        table = entry.table("files")
        for name in table.names():
            one_of(table.name_of("channel"), name, tuple(layout.channels))
            stated[name] = _path(table.text(name), table.name_of(name), folder)
    files: dict[str, Path] = {}
    for name in layout.channels:
        path = stated.get(name, main)
        if path is None:
            allowed = f"a file for {name} as well, or file = ... for all that are not here"
            raise InvalidInput(f"{place}.files", sorted(stated), allowed)
        files[name] = path
    return files


def _parts(entry: Fields, place: str, path: Path) -> tuple[tuple[str, str, Part | None], ...]:
    """Return name, role and part of each record."""
    part, stem = part_from_fields(entry), path.stem
    named = entry.text("name") if entry.has("name") else ""
    if entry.has("role"):
        role = entry.choice("role", ROLES)
        return ((named or (stem if part is None else f"{stem}_{role}"), role, part),)
    if part is not None:
        allowed = "one of 'train', 'held_out', for a part of a file"
        raise InvalidInput(f"{place}.role", None, allowed)
    return tuple(
        (f"{named or stem}_{role}", role, Part("share", start, stop))
        for role, start, stop in DEFAULT
    )


def _with_positions(
    listed: ListedRecord, coordinates: Collection[str]
) -> tuple[TableLayout, list[str]]:
    """Return the layout with positions for speeds of coordinates, and remarks about them."""
    channels, notes = dict(listed.layout.channels), []
    for name in coordinates:
        unit = channels[name].unit if name in channels else ""
        if unit in _ACCELERATIONS:
            allowed = (
                "that of a position or a speed: of an acceleration, integrated twice, the error of "
                "the sensor's zero grows with the square of time"
            )
            raise InvalidInput(f"unit of the coordinate {name}", unit, allowed)
        if unit in _SPEEDS:
            _check_title(name, channels[name])
            channels[name] = replace(channels[name], integrated=True)
            notes.append(
                f"The position {name} is its speed, integrated from the first row of the file: "
                "where it began is not known, and an error of the sensor's zero makes it drift. A "
                "constant force may be that of a spring, and phases over the position are relative."
            )
    return replace(listed.layout, channels=channels), notes


def _check_title(name: str, channel: Channel) -> None:
    """Refuse a speed in a column whose title says that it holds a position."""
    title = str(channel.column)
    words = set(re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title).lower()))
    if words & _OF_POSITIONS and not words & _OF_SPEEDS:
        allowed = (
            f"a unit of angle or length, as the title of its column {title!r} says: "
            f"{', '.join((*UNITS['angle'], *UNITS['length']))}. In a unit of speed its readings "
            "would be integrated; likely the unit of another column was put here"
        )
        raise InvalidInput(f"unit of the coordinate {name}", channel.unit, allowed)


def _check_sha256(path: Path, expected: str, place: str) -> None:
    try:
        check_sha256(path, expected)
    except InvalidInput as error:
        if error.field.startswith(path.name):
            raise
        # The digits themselves are invalid, and they are in the rig's file.
        raise InvalidInput(f"{place}.sha256", error.value, error.allowed) from None
