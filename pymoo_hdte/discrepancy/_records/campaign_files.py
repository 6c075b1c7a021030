"""Campaigns on disk: a folder as `format` describes it, read, checked and written."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pymoo_hdte._io.csv_table import write_columns
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import layout_from_fields
from pymoo_hdte._io.text_lines import Progress, byte_counter
from pymoo_hdte._io.toml import toml_text, toml_with_lines
from pymoo_hdte.checks import Complaints, InvalidInput, complaints_of, whole_number
from pymoo_hdte.discrepancy._records.believed import SENSOR_PLACES, BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.believed_model import (
    believed_from_fields,
    single_tolerances,
)
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.campaign_keys import (
    BELIEVED,
    CAMPAIGN_FILE,
    COLUMNS,
    CONTROL,
    ENDING,
    GOOD_ENOUGH,
    LAYOUT,
    MOTOR,
    RIG,
    SENSOR_PLACE,
    build,
    in_units,
    placed_in_table,
)
from pymoo_hdte.discrepancy._records.campaign_records import (
    FileOfRecord,
    read_record,
    record_path,
    record_table,
)
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.drive._effects import effect_from_fields


def read_campaign(folder: str | Path, progress: Progress | None = None) -> Campaign:
    """Read and check a campaign.

    Parameters
    ----------
    folder : str or Path
        With ``campaign.toml`` and a file for each record, as ``docs/campaign_format.md`` says; or
        the path of its ``campaign.toml``.
    progress : callable, optional
        Called with the number of bytes of the records read so far, and of all.

    Returns
    -------
    Campaign
        SI units.

    Raises
    ------
    InvalidInput
        With file and line, for a missing, unknown, misspelt or impossible field, a record that is
        missing, listed twice, incomplete or not finite, and whatever `Campaign` refuses.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> read_campaign("campaign").believed.ratio
    50
    """
    folder = Path(folder)
    if folder.name == CAMPAIGN_FILE and folder.is_file():
        folder = folder.parent
    complaints = Complaints()
    with toml_with_lines(folder / CAMPAIGN_FILE) as top:
        title, drive = top.text("title"), top.text("drive")
        believed = believed_from_fields(top, folder) if top.has("model") else _believed(top)
        rig = rig_from_fields(top.table("rig"), f"{CAMPAIGN_FILE}.rig")
        enough = {
            name: top.number(key, above=0.0) * factor
            for name, (key, factor) in GOOD_ENOUGH.items()
            if top.has(key)
        }
        entries = top.tables("record")
        table = top.table("table") if top.has("table") else None
        top.finish()
        shared = layout_from_fields(table, LAYOUT) if table else LAYOUT
        places = [f"{CAMPAIGN_FILE}.record[{index}]" for index in range(len(entries))]
        pairs = list(zip(entries, places, strict=True))
        paths: list[Path] = []
        for entry, place in pairs:
            with complaints.noted():
                paths.append(record_path(entry, place, folder))
        complaints.finish()
        seen = byte_counter(progress, paths)
        files: list[FileOfRecord] = []
        for (entry, place), path in zip(pairs, paths, strict=True):
            with complaints.noted():
                files.append(read_record(entry, place, path, believed.ratio, shared, seen))
        complaints.finish()
        records = [file.record for file in files]
        running = tuple(record for record in records if isinstance(record, RunningRecord))
        torsion = tuple(record for record in records if isinstance(record, TorsionRecord))
        try:
            campaign = Campaign(title, drive, believed, rig, running, torsion, RULES, **enough)
        except InvalidInput as error:
            for complaint in complaints_of(error):
                with complaints.noted():
                    raise _placed_in_files(complaint, files) from None
        complaints.finish()
        return campaign


def write_campaign(campaign: Campaign, folder: str | Path) -> None:
    """Write a campaign to a new or empty folder, completely or not at all.

    Parameters
    ----------
    campaign : Campaign
        In SI units; the files use the units in the names of their fields, and equal campaigns give
        equal bytes.
    folder : str or Path
        Where `read_campaign` can read it.

    Raises
    ------
    InvalidInput
        If the folder is a file, or is not empty.
    OSError
        If it cannot be written.

    Examples
    --------
    >>> campaign = read_campaign("campaign")
    >>> write_campaign(campaign, "copy_of_campaign")
    >>> read_campaign("copy_of_campaign").title == campaign.title
    True
    """
    folder = Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidInput("folder", str(folder), "a folder that is new or empty")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".campaign-", dir=folder.parent) as workshop:
        draft = Path(workshop) / "campaign"
        draft.mkdir()
        text = toml_text(_table(campaign))
        (draft / CAMPAIGN_FILE).write_text(text, encoding="utf-8", newline="\n")
        records: list[RunningRecord | TorsionRecord] = [*campaign.running, *campaign.torsion]
        for record in records:
            columns = {
                column: (getattr(record, channel), decimals)
                for channel, (column, decimals) in COLUMNS.items()
                if hasattr(record, channel)
            }
            write_columns(draft / f"{record.name}{ENDING}", columns)
        draft.replace(folder)


def _table(campaign: Campaign) -> dict[str, Any]:
    records: list[RunningRecord | TorsionRecord] = [*campaign.running, *campaign.torsion]
    stated = {
        name: entry for name, entry in GOOD_ENOUGH.items() if getattr(campaign, name) is not None
    }
    return {
        "title": campaign.title,
        "drive": campaign.drive,
        **in_units(campaign, stated),
        "believed": _believed_table(campaign.believed),
        "rig": in_units(campaign.rig, RIG) | _further_of_rig(campaign.rig),
        "record": [record_table(record) for record in records],
    }


def _further_of_rig(rig: Rig) -> dict[str, Any]:
    """Return the place of the output's torque sensor unless it is the usual one, and the motor."""
    place = {} if rig.output_torque_at == "drive" else {SENSOR_PLACE: rig.output_torque_at}
    return place | {name: getattr(rig, name) for name in MOTOR if getattr(rig, name)}


def _believed_table(believed: BelievedDrive) -> dict[str, Any]:
    """Return the believed drive as a table, with any tolerances of single values and effects."""
    effects = [effect.to_dict() for effect in believed.effects]
    further = {"tolerances": dict(believed.tolerances), "effect": effects}
    return in_units(believed, BELIEVED) | {
        name: content for name, content in further.items() if content
    }


def _believed(top: Fields) -> BelievedDrive:
    table = top.table("believed")
    rows = table.tables("effect") if table.has("effect") else []
    effects = tuple(effect_from_fields(row) for row in rows)
    single = single_tolerances(table.table("tolerances")) if table.has("tolerances") else {}
    place = f"{CAMPAIGN_FILE}.believed"
    known = {"effects": effects, "tolerances": single}
    try:
        return build(BelievedDrive, BELIEVED, table, place, **known)
    except InvalidInput as error:
        if error.field not in known:
            raise
        raise InvalidInput(f"{place}.{error.field}", error.value, error.allowed) from None


def rig_from_fields(table: Fields, place: str) -> Rig:
    """Return the rig of the table ``[rig]``, which stands at ``place``; errors name its field."""
    known: dict[str, Any] = {}
    if table.has(SENSOR_PLACE):
        known[SENSOR_PLACE] = table.choice(SENSOR_PLACE, SENSOR_PLACES)
    for name in MOTOR:
        if table.has(name):
            known[name] = whole_number(f"{place}.{name}", table.take(name, "a whole number"), 0)
    if not table.has("control"):
        return build(Rig, RIG, table, place, **known)
    sentence = table.text("control")
    match = CONTROL.search(sentence)
    try:
        proportional, integral = map(float, match.groups() if match else ())
    except ValueError:
        allowed = "'... T = P*(w_set - w) + I*integral(w_set - w) ...' with two numbers"
        raise InvalidInput(f"{place}.control", sentence, allowed) from None
    known |= {"proportional": proportional, "integral": integral}
    return build(Rig, RIG, table, place, **known)


def _placed_in_files(error: InvalidInput, files: Sequence[FileOfRecord]) -> InvalidInput:
    """Return an error of `Campaign` as one about its files."""
    table, _, attribute = error.field.partition(".")
    names = {"believed": BELIEVED, "rig": RIG}.get(table)
    if names is not None and attribute in names:
        return placed_in_table(error, attribute, names, f"{CAMPAIGN_FILE}.{table}")
    return InvalidInput(_place_in_files(error, files), error.value, error.allowed)


def _place_in_files(error: InvalidInput, files: Sequence[FileOfRecord]) -> str:
    name, _, channel = error.field.partition(": ")
    if channel:
        (span,) = (file.span for file in files if file.record.name == name)
        return f"{span()}: {channel}"
    numbers = [index for index, file in enumerate(files) if file.record.name == error.value]
    if numbers:
        return f"{CAMPAIGN_FILE}.record[{numbers[-1]}].file"
    return f"{CAMPAIGN_FILE}.{error.field}"
