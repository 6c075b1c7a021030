"""A rig in a folder: ``rig.toml`` has its mechanism and lists its records, all without code.

Numbers of the mechanism are in SI; the columns of the records have units of their own::

    title = "An electro-mechanical positioning system"
    cutoff = 40.0                                  # optional, Hz

    [coordinates.q]
    inertia = { value = 100.0, tolerance = 0.5 }   # relative tolerance, 0 to 1; absent: known
    [ports.joint]
    motion = { q = 1.0 }                           # share of each coordinate
    damping = { value = 300.0, tolerance = 1.0 }   # optional, as stiffness
    read = false                                   # optional; true for a force sensor
    [[ports.joint.error]]                          # optional: kinematic error, as `ErrorLine`
    coordinate = "q"
    order = 2.0
    amplitude = 1e-4
    phase = 0.0
    [inputs.vir]
    acts = { q = 1.0 }
    gain = { value = 35.15 }
    [[loops]]                                      # optional, as `Loop`
    input = "vir"
    reference = "qg"
    coordinate = "q"
    position_gain = 38995.8
    speed_gain = 243.45
    limit = 10.0                                   # optional
    [[effects]]                                    # optional: laws that are known to be there
    name = "coulomb_friction"                      # registered, with all its numbers
    port = "joint"
    level = 20.4

    [noise]                                        # optional: standard deviations, SI
    q = 1e-6

    [table]                                        # as `layout_from_fields` has it
    ...
    [[records]]
    file = "DATA_EMPS.mat"                         # in the folder of the data
    role = "train"                                 # or "held_out"
    name = "trapezoids"                            # optional: without it the name of the file
    sha256 = "6cf6814ae14618"                      # optional: first 8 or more digits
    [records.table]                                # optional: a layout of its own
    ...
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.discrepancy.mechanism.models import model_from_fields, read_model, rig_toml
from pymoo_hdte.io.fields import Fields, toml_with_lines
from pymoo_hdte.io.tables import TableLayout, check_sha256, layout_from_fields, read_table
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.records import ROLES

__all__ = ["RIG_FILE", "Rig", "read_model", "read_rig", "rig_toml"]

RIG_FILE = "rig.toml"


@dataclass(frozen=True, eq=False)
class Rig:
    """A mechanism and its records.

    Attributes
    ----------
    title : str
    mechanism : Mechanism
    effects : tuple of LawAt
        Laws that are known to be there.
    records : tuple of Record
    cutoff : float or None
        Hz, up to which the motion is known; None if the file leaves that open.
    source : str
        Path of the file.
    """

    title: str
    mechanism: Mechanism
    effects: tuple[LawAt, ...]
    records: tuple[Record, ...]
    cutoff: float | None
    source: str


def read_rig(folder: str | Path, data: str | Path | None = None) -> Rig:
    """Read and check a rig.

    Parameters
    ----------
    folder : str or Path
        Where `RIG_FILE` is, or the path of a file like it.
    data : str or Path, optional
        Folder of the files of the records; without it the folder of the rig's file.

    Raises
    ------
    InvalidInput
        With file and line, for a field that is missing, unknown or impossible, a name that stands
        for nothing, a record that is missing, named twice or outside the folder, and whatever
        `read_table`, `check_sha256`, `Record` and `Mechanism` refuse.
    OSError
        If a file cannot be read.
    """
    path = Path(folder)
    path = path / RIG_FILE if path.is_dir() else path
    files = path.parent if data is None else Path(data)
    with toml_with_lines(path) as top:
        (title, mechanism, effects), cutoff = model_from_fields(top, path.name)
        shared = layout_from_fields(top.table("table")) if top.has("table") else None
        noise = _noise(top)
        entries = top.tables("records")
        top.finish()
        records: dict[str, Record] = {}
        for index, entry in enumerate(entries):
            record = _record(entry, f"{path.name}.records[{index}]", files, shared, records, noise)
            records[record.name] = record
        _check_noise(noise, records, path.name)
    return Rig(title, mechanism, effects, tuple(records.values()), cutoff, str(path))


def _record(
    entry: Fields,
    place: str,
    folder: Path,
    shared: TableLayout | None,
    taken: Collection[str],
    noise: Mapping[str, float],
) -> Record:
    file = entry.text("file")
    # As Windows has paths, because it takes both separators and knows drives.
    parts = PureWindowsPath(file)
    if parts.anchor or ".." in parts.parts or not (folder / file).is_file():
        raise InvalidInput(f"{place}.file", file, f"a file inside {folder}")
    path, role = folder / file, entry.choice("role", ROLES)
    name = entry.text("name") if entry.has("name") else path.stem
    if name in taken:
        raise InvalidInput(f"{place}.name", name, "a name of its own for each record")
    layout = layout_from_fields(entry.table("table")) if entry.has("table") else shared
    if layout is None:
        raise InvalidInput(f"{place}.table", None, "a layout here, or [table] for all records")
    expected = entry.text("sha256") if entry.has("sha256") else None
    entry.finish()
    if expected is not None:
        _check_sha256(path, expected, place)
    table = read_table(path, layout)
    try:
        of_channels = {one: noise[one] for one in noise if one in table.channels}
        return Record(name, role, table.time, table.channels, of_channels, table.dropped)
    except InvalidInput as error:
        raise InvalidInput(f"{path.name}: {error.field}", error.value, error.allowed) from None


def _noise(top: Fields) -> dict[str, float]:
    if not top.has("noise"):
        return {}
    table = top.table("noise")
    return {name: table.number(name, above=0.0) for name in table.names()}


def _check_noise(noise: Mapping[str, float], records: Mapping[str, Record], file: str) -> None:
    channels = {channel for record in records.values() for channel in record.channels}
    for name in noise:
        one_of(f"{file}: name in noise", name, sorted(channels))


def _check_sha256(path: Path, expected: str, place: str) -> None:
    try:
        check_sha256(path, expected)
    except InvalidInput as error:
        if error.field.startswith(path.name):
            raise
        # The digits themselves are wrong, and they stand in the rig's file.
        raise InvalidInput(f"{place}.sha256", error.value, error.allowed) from None
