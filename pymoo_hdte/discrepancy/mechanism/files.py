"""A rig in a folder: ``rig.toml`` has its mechanism and lists its records, all without code.

The believed model has coordinates, ports, inputs, loops and effects, each value with its tolerance.
The ``revised_model.toml`` of a report is one. Numbers of the mechanism are in SI; the columns of
the records have units of their own::

    title = "An electro-mechanical positioning system"
    cutoff = 40.0                                  # optional, Hz

    [coordinates.q]
    inertia = { value = 100.0, tolerance = 0.5 }   # relative tolerance, 0 to 1; absent: known
    [ports.joint]
    motion = { q = 1.0 }                           # share of each coordinate
    damping = { value = 300.0, tolerance = 1.0 }   # optional, as stiffness
    read = false                                   # optional; true for a force sensor
    load = { brake = 1.0 }                         # optional: share of inputs in its load
    gear = { ratio = 101, kind = "harmonic drive" }  # optional, as `Gear`: its output is the port
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
    [[effects]]                                    # optional: known laws
    name = "coulomb_friction"                      # of a registered effect, with all its numbers
    port = "joint"
    level = 20.4

    model = "revised_model.toml"                   # instead of all tables above: a file with them

    [noise]                                        # optional: standard deviations, SI
    q = 1e-6

    [table]                                        # as `layout_from_fields` has it
    ...
    [[records]]
    file = "DATA_EMPS.mat"                         # in the folder of the data
    role = "train"                                 # or "held_out"
    name = "trapezoids"                            # optional: without it the name of the file
    sha256 = "6cf6814ae14618"                      # optional: first 8 or more digits
    zero = { q = 12.5 }                            # optional: readings at zero, unit of the column
    [records.table]                                # optional: a layout of its own
    ...
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath

from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.discrepancy.mechanism.models import (
    MechanismModel,
    model_from_fields,
    read_mechanism_model,
)
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.io.layout import TableLayout, layout_from_fields, with_zeros
from pymoo_hdte.io.tables import check_sha256, read_table
from pymoo_hdte.io.text_lines import Progress, Seen, told
from pymoo_hdte.io.toml import toml_with_lines
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.records import ROLES

RIG_FILE = "rig.toml"


@dataclass(frozen=True, eq=False)
class MeasuredMechanism:
    """A mechanism as it is believed, and its records.

    Attributes
    ----------
    mechanism : Mechanism
        Without the effects that are to be found.
    records : sequence of Record
        At least one of them of role ``train``; others, ``held_out``, to validate the result.
    cutoff : float, optional
        Hz, up to which the motion is known; by default where it falls below its noise.
    effects : sequence of LawAt
        Laws that the mechanism is known to have.
    title : str
    source : str
        Path of the file that it was read from.

    Examples
    --------
    >>> joint = Mechanism(
    ...     {"q": BelievedValue(0.06, tolerance=0.5)},
    ...     [Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, tolerance=0.5))],
    ...     [Input("torque", {"q": 1.0})],
    ... )
    >>> record = Record("one", "train", time, {"q": angle, "torque": torque})
    >>> analyse(MeasuredMechanism(joint, [record])).verdict.status
    'named'
    """

    mechanism: Mechanism
    records: Sequence[Record]
    cutoff: float | None = None
    effects: Sequence[LawAt] = ()
    title: str = "A mechanism"
    source: str = ""

    @property
    def model(self) -> MechanismModel:
        """The believed model, which `model_text` writes to a file."""
        return MechanismModel(self.title, self.mechanism, tuple(self.effects), self.cutoff)

    def believing(self, model: MechanismModel) -> MeasuredMechanism:
        """Return the same records with another believed model.

        Parameters
        ----------
        model : MechanismModel
            From `read_mechanism_model` or `MechanismAnalysis.revised_model`; its cutoff holds if it
            has one.
        """
        cutoff = self.cutoff if model.cutoff is None else model.cutoff
        return replace(self, mechanism=model.mechanism, effects=model.effects, cutoff=cutoff)


def read_rig(
    folder: str | Path, data: str | Path | None = None, progress: Progress | None = None
) -> MeasuredMechanism:
    """Read and check a rig.

    Parameters
    ----------
    folder : str or Path
        Where `RIG_FILE` is, or the path of a file like it.
    data : str or Path, optional
        Folder of the files of the records; by default the folder of the rig's file.
    progress : callable, optional
        Is told how many bytes of the records have been read, and how many there are.

    Raises
    ------
    InvalidInput
        With file and line, for a field that is missing, unknown or impossible, a name that refers
        to nothing, a record that is missing, named twice or outside the folder, and whatever
        `read_table`, `check_sha256`, `Record` and `Mechanism` refuse.
    OSError
        If a file cannot be read.
    """
    path = Path(folder)
    path = path / RIG_FILE if path.is_dir() else path
    files = path.parent if data is None else Path(data)
    with toml_with_lines(path) as top:
        model = _model(top, path)
        shared = layout_from_fields(top.table("table")) if top.has("table") else None
        noise = _noise(top)
        entries = top.tables("records")
        top.finish()
        records: dict[str, Record] = {}
        places = [f"{path.name}.records[{index}]" for index in range(len(entries))]
        pairs = list(zip(entries, places, strict=True))
        paths = [_path(entry, place, files) for entry, place in pairs]
        seen = told(progress, paths)
        for (entry, place), of_record in zip(pairs, paths, strict=True):
            record = _record(entry, place, of_record, shared, records, noise, seen)
            records[record.name] = record
        _check_noise(noise, records, path.name)
    return MeasuredMechanism(
        model.mechanism,
        tuple(records.values()),
        model.cutoff,
        model.effects,
        model.title,
        str(path),
    )


def _model(top: Fields, path: Path) -> MechanismModel:
    """Take the believed model out of a rig's file, or out of the file that it names."""
    if not top.has("model"):
        return model_from_fields(top, path.name)
    model = read_mechanism_model(path.parent / top.text("model"))
    cutoff = top.number("cutoff", above=0.0) if top.has("cutoff") else model.cutoff
    return replace(model, title=top.text("title"), cutoff=cutoff)


def _path(entry: Fields, place: str, folder: Path) -> Path:
    file = entry.text("file")
    # As a Windows path, which accepts both separators and drive letters.
    parts = PureWindowsPath(file)
    if parts.anchor or ".." in parts.parts or not (folder / file).is_file():
        raise InvalidInput(f"{place}.file", file, f"a file inside {folder}")
    return folder / file


def _record(
    entry: Fields,
    place: str,
    path: Path,
    shared: TableLayout | None,
    taken: Collection[str],
    noise: Mapping[str, float],
    seen: Seen | None,
) -> Record:
    role = entry.choice("role", ROLES)
    name = entry.text("name") if entry.has("name") else path.stem
    if name in taken:
        raise InvalidInput(f"{place}.name", name, "a name of its own for each record")
    layout = layout_from_fields(entry.table("table")) if entry.has("table") else shared
    if layout is None:
        raise InvalidInput(f"{place}.table", None, "a layout here, or [table] for all records")
    if entry.has("zero"):
        layout = with_zeros(entry.table("zero"), layout)
    expected = entry.text("sha256") if entry.has("sha256") else None
    entry.finish()
    if expected is not None:
        _check_sha256(path, expected, place)
    table = read_table(path, layout, seen)
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
        # The digits themselves are invalid, and they are in the rig's file.
        raise InvalidInput(f"{place}.sha256", error.value, error.allowed) from None
