"""A rig in a folder: ``rig.toml`` has its mechanism and lists its records, all without code.

``docs/rig_format.md`` has every key. The believed model has coordinates, ports, inputs, loops and
effects, each value with its tolerance; the ``revised_model.toml`` of a report is one. Numbers of
the mechanism are in SI; the columns of the records have units of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import COUNTS, layout_from_fields
from pymoo_hdte._io.text_lines import Progress, byte_counter
from pymoo_hdte._io.toml import toml_with_lines
from pymoo_hdte.checks import InvalidInput, one_of
from pymoo_hdte.discrepancy._records.rig_model import (
    MechanismModel,
    model_from_fields,
    read_mechanism_model,
)
from pymoo_hdte.discrepancy._records.rig_records import (
    ListedRecord,
    divided,
    listed_record,
    read_records,
)
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.units import UNITS

RIG_FILE = "rig.toml"


@dataclass(frozen=True, eq=False)
class MeasuredMechanism:
    """A mechanism as it is believed, and its records.

    Attributes
    ----------
    mechanism : Mechanism
        The mechanism, without the effects that are to be found.
    records : sequence of Record
        At least one of them of role ``train``; others, ``held_out``, to validate the result.
    cutoff : float, optional
        Frequency up to which the motion is known, Hz; by default where it falls below its noise.
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
    >>> time = np.arange(0.0, 6.0, 0.002)
    >>> angle = np.sin(4.4 * time)
    >>> record = Record("one", "train", time, {"q": angle, "torque": np.gradient(angle, time)})
    >>> analyse(MeasuredMechanism(joint, [record])).verdict.status  # doctest: +SKIP
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
        Called with the number of bytes of the records read so far, and of all.

    Raises
    ------
    InvalidInput
        With file and line, for a field that is missing, unknown or impossible, a name that refers
        to nothing, a record that is missing, named twice or outside the folder, and whatever
        `read_table`, `check_sha256`, `Record` and `Mechanism` refuse.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> rig = read_rig("my_rig")  # doctest: +SKIP
    >>> rig.mechanism.coordinates, len(rig.records)  # doctest: +SKIP
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
        listed = [
            listed_record(entry, f"{path.name}.records[{index}]", files, shared)
            for index, entry in enumerate(entries)
        ]
        _check_names(listed)
        mechanism = _with_angles(model.mechanism, listed)
        coordinates = mechanism.coordinates
        listed = [divided(listing, mechanism, noise, model.cutoff) for listing in listed]
        _check_names(listed)
        # Each part is read on its own, so that a fault outside of it does no harm.
        seen = byte_counter(
            progress, [file for listing in listed for _ in listing.parts for file in listing.paths]
        )
        records: dict[str, Record] = {}
        for listing in listed:
            for record in read_records(listing, coordinates, noise, seen):
                if record.name in records:
                    allowed = "another name: a record that was divided at a gap has it"
                    raise InvalidInput(f"{listing.place}: name", record.name, allowed)
                records[record.name] = record
        _check_noise(noise, records, path.name)
    return MeasuredMechanism(
        mechanism,
        tuple(records.values()),
        model.cutoff,
        model.effects,
        model.title,
        str(path),
    )


def _model(top: Fields, path: Path) -> MechanismModel:
    """Take the believed model out of a rig's file, or out of the file that it names."""
    if not top.has("model"):
        model = model_from_fields(top, path.name)
        for signal in model.mechanism.inputs if model.effects else ():
            if not signal.scaled:
                allowed = (
                    "a number, with a tolerance or factor: a known effect has a scale of its own; "
                    "one in units of the signal belongs into a model file, model = ..."
                )
                raise InvalidInput(f"{path.name}.inputs.{signal.name}.gain", None, allowed)
        return model
    model = read_mechanism_model(path.parent / top.text("model"))
    cutoff = top.number("cutoff", above=0.0) if top.has("cutoff") else model.cutoff
    return replace(model, title=top.text("title"), cutoff=cutoff)


def _with_angles(mechanism: Mechanism, listed: Sequence[ListedRecord]) -> Mechanism:
    """Return a mechanism that knows its angles, from its file or else from the units of columns.

    A coordinate without either is no angle and no length.
    """
    stated = [*(mechanism.angles or ()), *(mechanism.lengths or ())]
    turning = {COUNTS, *UNITS["angle"], *UNITS["speed"]}
    sliding = {*UNITS["length"], *UNITS["linear speed"]}
    tables = [listing.layout.channels for listing in listed]

    def all_in(units: set[str]) -> list[str]:
        return [
            name
            for name in mechanism.coordinates
            if name not in stated
            and all(name in table and table[name].unit in units for table in tables)
        ]

    angles = [*(mechanism.angles or ()), *all_in(turning)]
    lengths = [*(mechanism.lengths or ()), *all_in(sliding)]
    return replace(mechanism, angles=angles, lengths=lengths) if angles or lengths else mechanism


def _check_names(listed: Sequence[ListedRecord]) -> None:
    taken = set[str]()
    for listing in listed:
        for name, _, _ in listing.parts:
            if name in taken:
                raise InvalidInput(
                    f"{listing.place}.name", name, "a name of its own for each record"
                )
            taken.add(name)


def _noise(top: Fields) -> dict[str, float]:
    if not top.has("noise"):
        return {}
    table = top.table("noise")
    return {name: table.number(name, above=0.0) for name in table.names()}


def _check_noise(noise: Mapping[str, float], records: Mapping[str, Record], file: str) -> None:
    channels = {channel for record in records.values() for channel in record.channels}
    for name in noise:
        one_of(f"{file}: name in noise", name, sorted(channels))
