"""Campaigns on disk: a folder as `format` describes it, read, checked and written."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.discrepancy.campaign.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy.campaign.believed_model import believed_from_fields
from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.campaign.format import (
    BELIEVED,
    CAMPAIGN_FILE,
    COLUMNS,
    CONTROL,
    ENDING,
    GOOD_ENOUGH,
    PLAIN_ENDING,
    RIG,
    RUNNING,
    TORSION,
    Names,
)
from pymoo_hdte.discrepancy.campaign.records import ROLES, RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules
from pymoo_hdte.drive.effects import effect_from_fields
from pymoo_hdte.io.fields import Fields
from pymoo_hdte.io.text_table import line_of_row, read_text_table, write_columns
from pymoo_hdte.io.toml import toml_text, toml_with_lines

Checked = TypeVar("Checked", BelievedDrive, Rig, RunningRecord | TorsionRecord)


def read_campaign(folder: str | Path, rules: Rules = RULES) -> Campaign:
    """Read and check a campaign.

    Parameters
    ----------
    folder : str or Path
        With ``campaign.toml`` and a ``.csv.gz`` or plain ``.csv`` file for each record, whose
        fields and columns have their units in their names.
    rules : Rules
        Thresholds of what `Campaign` refuses.

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
    """
    folder = Path(folder)
    with toml_with_lines(folder / CAMPAIGN_FILE) as top:
        title, drive = top.text("title"), top.text("drive")
        believed = believed_from_fields(top, folder) if top.has("model") else _believed(top)
        rig = _rig(top.table("rig"))
        enough = {
            name: top.number(key, above=0.0) * factor
            for name, (key, factor) in GOOD_ENOUGH.items()
            if top.has(key)
        }
        entries = top.tables("record")
        top.finish()
        files = [entry.text("file") for entry in entries]
        records = [
            _record(entry, file, f"{CAMPAIGN_FILE}.record[{index}]", folder)
            for index, (entry, file) in enumerate(zip(entries, files, strict=True))
        ]
        running = tuple(record for record in records if isinstance(record, RunningRecord))
        torsion = tuple(record for record in records if isinstance(record, TorsionRecord))
        try:
            return Campaign(title, drive, believed, rig, running, torsion, rules, **enough)
        except InvalidInput as error:
            raise _placed_in_files(error, records, files) from None


def write_campaign(campaign: Campaign, folder: str | Path) -> None:
    """Write a campaign to a new or empty folder, completely or not at all, always with equal bytes.

    Parameters
    ----------
    campaign : Campaign
        In SI units; the files use the units in the names of their fields.
    folder : str or Path
        Where `read_campaign` can read it.

    Raises
    ------
    InvalidInput
        If the folder is a file or holds something.
    OSError
        If it cannot be written.
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
    tests = ((campaign.running, "running", RUNNING), (campaign.torsion, "torsion", TORSION))
    stated = {name: one for name, one in GOOD_ENOUGH.items() if getattr(campaign, name) is not None}
    return {
        "title": campaign.title,
        "drive": campaign.drive,
        **_in_units(campaign, stated),
        "believed": _believed_table(campaign.believed),
        "rig": _in_units(campaign.rig, RIG),
        "record": [
            {"file": f"{record.name}{ENDING}", "test": test}
            | _in_units(record, names)
            | {"role": record.role}
            for records, test, names in tests
            for record in records
        ],
    }


def _believed_table(believed: BelievedDrive) -> dict[str, Any]:
    """Return the believed drive as a table, with any tolerances of single values and effects."""
    effects = [effect.to_dict() for effect in believed.effects]
    further = {"tolerances": dict(believed.tolerances), "effect": effects}
    return _in_units(believed, BELIEVED) | {name: one for name, one in further.items() if one}


def _in_units(values: Any, names: Names) -> dict[str, Any]:
    """Return the attributes of an object under the names and in the units of the file."""

    def rounded(value: Any, factor: float) -> Any:
        if isinstance(value, tuple):
            return [rounded(item, factor) for item in value]
        # Twelve digits hide the rounding of the conversion and exceed the accuracy of any value.
        digits = f"{value / factor:.12g}"
        return int(digits) if digits.lstrip("-").isdigit() else float(digits)

    return {key: rounded(getattr(values, name), factor) for name, (key, factor) in names.items()}


def _believed(top: Fields) -> BelievedDrive:
    table = top.table("believed")
    rows = table.tables("effect") if table.has("effect") else []
    effects = tuple(effect_from_fields(row) for row in rows)
    single = table.table("tolerances") if table.has("tolerances") else Fields({}, "")
    tolerances = {name: single.number(name) for name in single.names()}
    place = f"{CAMPAIGN_FILE}.believed"
    return _build(BelievedDrive, BELIEVED, table, place, effects=effects, tolerances=tolerances)


def _rig(table: Fields) -> Rig:
    place = f"{CAMPAIGN_FILE}.rig"
    if not table.has("control"):
        return _build(Rig, RIG, table, place)
    sentence = table.text("control")
    match = CONTROL.search(sentence)
    try:
        proportional, integral = map(float, match.groups() if match else ())
    except ValueError:
        allowed = "'... T = P*(w_set - w) + I*integral(w_set - w) ...' with two numbers"
        raise InvalidInput(f"{place}.control", sentence, allowed) from None
    return _build(Rig, RIG, table, place, proportional=proportional, integral=integral)


def _record(entry: Fields, file: str, place: str, folder: Path) -> RunningRecord | TorsionRecord:
    named = re.fullmatch(
        rf"(\w[\w.-]*?)({re.escape(ENDING)}|{re.escape(PLAIN_ENDING)})", file, re.ASCII
    )
    if not named:
        allowed = f"letters, digits, '.', '-' and '_', ending in {ENDING} or {PLAIN_ENDING}"
        raise InvalidInput(f"{place}.file", file, allowed)
    path = folder / file
    if not path.is_file():
        raise InvalidInput(f"{place}.file", file, f"a file in {folder}")
    role = entry.choice("role", ROLES)
    running = entry.choice("test", ("running", "torsion")) == "running"
    kind: type[RunningRecord | TorsionRecord] = RunningRecord if running else TorsionRecord
    names = RUNNING if running else TORSION
    channels = [field.name for field in fields(kind) if field.name in COLUMNS]
    columns = read_text_table(path).numbers([COLUMNS[channel][0] for channel in channels])
    measured = {channel: columns[COLUMNS[channel][0]] for channel in channels}
    try:
        return _build(kind, names, entry, place, name=named[1], role=role, **measured)
    except InvalidInput as error:
        if error.field.startswith(CAMPAIGN_FILE):
            raise
        if error.field == "role":
            raise InvalidInput(f"{place}.role", error.value, error.allowed) from None
        row = re.search(r"\[(\d+)]$", error.field)
        lines = f"line {line_of_row(int(row[1]))}" if row else _lines_of(len(measured["time"]))
        field = f"{file}, {lines}: {error.field}"
        raise InvalidInput(field, error.value, error.allowed) from None


def _build(kind: type[Checked], names: Names, table: Fields, place: str, **known: Any) -> Checked:
    """Build a checked object from a table; its errors name the field as the file does."""
    optional = {field.name for field in fields(kind) if field.default is not MISSING}
    values = dict(known)
    for attribute, (key, factor) in names.items():
        if attribute in known or (attribute in optional and not table.has(key)):
            continue
        values[attribute] = _si(table.take(key, "a number"), f"{place}.{key}", factor)
    table.finish()
    try:
        return kind(**values)
    except InvalidInput as error:
        if error.field not in names:
            raise
        raise _placed_in_table(error, error.field, names, place) from None


def _si(raw: Any, field: str, factor: float) -> Any:
    """Return a number or a tuple of numbers in SI units; whole numbers without unit stay whole."""
    if isinstance(raw, list):
        return tuple(_number_in_si(item, field, factor) for item in raw)
    return _number_in_si(raw, field, factor)


def _number_in_si(raw: Any, field: str, factor: float) -> float:
    number = real_number(field, raw) * factor
    return raw if isinstance(raw, int) and factor == 1.0 else number


def _placed_in_table(error: InvalidInput, attribute: str, names: Names, place: str) -> InvalidInput:
    """Return an error about an attribute as one about its field in the file, in its unit."""
    key, factor = names[attribute]
    value = error.value
    if isinstance(value, float):
        value /= factor
    elif isinstance(value, tuple):
        value = tuple(number / factor for number in value)
    return InvalidInput(f"{place}.{key}", value, error.allowed)


def _placed_in_files(
    error: InvalidInput,
    records: Sequence[RunningRecord | TorsionRecord],
    files: Sequence[str],
) -> InvalidInput:
    """Return an error of `Campaign` as one about its files."""
    table, _, attribute = error.field.partition(".")
    names = {"believed": BELIEVED, "rig": RIG}.get(table)
    if names is not None and attribute in names:
        return _placed_in_table(error, attribute, names, f"{CAMPAIGN_FILE}.{table}")
    return InvalidInput(_place_in_files(error, records, files), error.value, error.allowed)


def _place_in_files(
    error: InvalidInput,
    records: Sequence[RunningRecord | TorsionRecord],
    files: Sequence[str],
) -> str:
    lengths = {record.name: len(record.time) for record in records}
    name, _, channel = error.field.partition(": ")
    if channel:
        (file,) = (file for file, one in zip(files, records, strict=True) if one.name == name)
        return f"{file}, {_lines_of(lengths[name])}: {channel}"
    numbers = [index for index, record in enumerate(records) if record.name == error.value]
    if numbers:
        return f"{CAMPAIGN_FILE}.record[{numbers[-1]}].file"
    return f"{CAMPAIGN_FILE}.{error.field}"


def _lines_of(n_rows: int) -> str:
    return f"lines {line_of_row(0)} to {line_of_row(n_rows - 1)}"
