"""A commented ``rig.toml`` for logs that nobody has described, to be corrected by their owner."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte._io.toml import toml_text
from pymoo_hdte._io.unstated import UnstatedTable
from pymoo_hdte.checks import InvalidInput, complaints_of
from pymoo_hdte.discrepancy._records.drafts.column_roles import (
    Balance,
    ColumnGuess,
    Name,
    Roles,
    Values,
)
from pymoo_hdte.discrepancy._records.drafts.column_titles import read_title
from pymoo_hdte.discrepancy._records.drafts.log_folder import LogFolder
from pymoo_hdte.discrepancy._records.rig_files import RIG_FILE, read_rig
from pymoo_hdte.units import UNITS

EDIT = "EDIT"
"""Marks a comment on what its reader has to correct or confirm."""
_WIDE, _WIDEST = 10.0, 100.0
"""Factors within which a value is believed that the records show, and one that they do not show."""
_SHARE = 0.1
"""Of the force, that a part has which the records do not show."""
_SHOWN = 0.02
"""Least share of the force for a part that the records show."""
_HELD_OUT = 3
"""One file in so many is held out."""
_USUAL_RATE = 1000.0
"""Hz, for rows without times."""
_RESONATES = 0.5
"""Shares of the force, relative to its deviation, of a spring and a mass that oppose each other."""
_WORDS = {"train": ("train", "fit"), "held_out": ("held", "valid", "test", "check", "proof")}


def rig_text(logs: LogFolder, roles: Roles) -> str:
    """Return a ``rig.toml`` with a comment on each guess: from what it is, and how sure.

    Parameters
    ----------
    logs : LogFolder
    roles : Roles
        With a coordinate.

    Returns
    -------
    str
        TOML. Where `read_rig` refuses the records, a comment at the top says what it refused.
    """
    while True:
        text = _text(logs, roles, "")
        refusal = _refusal(logs.folder, text)
        if refusal is None:
            return text
        # One file that cannot be used must not keep the others from a verdict.
        faulty = [table for table in logs.tables if refusal.startswith(f"{table.path.name}, ")]
        if not faulty or len(logs.tables) == 1 or logs.sources:
            return _text(logs, roles, refusal)
        logs = logs.without(faulty, refusal)


def _refusal(folder: Path, text: str) -> str | None:
    """Return what `read_rig` refuses, None if it reads the rig."""
    with tempfile.TemporaryDirectory() as workshop:
        path = Path(workshop) / RIG_FILE
        path.write_text(text, encoding="utf-8")
        try:
            read_rig(path, folder)
        except InvalidInput as error:
            complaint, *further = complaints_of(error)
            return f"{complaint}" + (f" (and {len(further)} more)" if further else "")
    return None


def _text(logs: LogFolder, roles: Roles, refusal: str) -> str:
    turning = _turns(roles.coordinates[-1])
    lines = [
        *remark(
            "Drafted by pymoo-hdte init from the data files here: correct what is wrong, at least "
            f"what is marked {EDIT}. Then: pymoo-hdte discrepancy FOLDER --out FOLDER/report. "
            "After a verdict a second init proposes what to add. Values are in SI; columns have "
            "units of their own."
        ),
        *remark(f"{EDIT}: read as it stands, it is refused: {refusal}" if refusal else ""),
        f"title = {toml_value(logs.folder.resolve().name or 'A mechanism')}",
        "# cutoff = 40.0  # Hz, above which motion counts as noise; found from the records without",
        "",
    ]
    lines += _model(roles, turning)
    lines += _table(logs, roles)
    lines += _records(logs, roles)
    return "\n".join(lines) + "\n"


def _turns(coordinate: ColumnGuess) -> bool:
    """Tell whether a coordinate is an angle."""
    sliding = (*UNITS["length"], *UNITS["linear speed"])
    return coordinate.unit not in sliding


def _names(roles: Roles) -> list[str]:
    if len(roles.coordinates) == 2:
        return ["motor", "load"]
    return ["joint" if _turns(roles.coordinates[0]) else "position"]


def _model(roles: Roles, turning: bool) -> list[str]:
    names = _names(roles)
    mass, damped = ("kg.m2", "N.m.s/rad") if turning else ("kg", "N.s/m")
    force = roles.forces[0] if roles.forces else None
    scaled = force is not None and _scaled(force)
    if force is not None and not scaled:
        mass, damped = f"{mass} per {force.unit} of gain", f"{damped} per {force.unit} of gain"
    balance = _in_si(roles.balance, force)
    if balance is not None and roles.time is None and roles.sample_rate is None:
        balance = balance.at_rate(_USUAL_RATE)
    lines: list[str] = []
    inertia, inertia_said = _part(balance, "inertia", "acceleration")
    damping, damping_said = _part(balance, "damping", "speed")
    shares = f"{1.0 / len(names):g} of " if len(names) > 1 else ""
    for name in names:
        lines += [f"[coordinates.{name}]"]
        if force is None:
            lines += remark(
                f"{EDIT}: no force was recorded, so that only ratios to the inertia are known. Put "
                f"its value here, in {mass}; with 1 all forces are per unit of it."
            )
            lines += ["inertia = { value = 1.0 }"]
            continue
        lines += remark(f"{mass}: {shares}{inertia_said}. {EDIT} if you know it better.")
        lines += [f"inertia = {_believed(inertia, len(names))}"]
    lines += [""]
    if len(names) == 2:
        lines += _gear(roles, force)
    lines += [f"[ports.{'bearing' if turning else 'guide'}]", f"motion = {{ {names[-1]} = 1.0 }}"]
    if force is None:
        lines += remark(f"{damped} per unit of inertia, a wide guess.")
        lines += ["damping = { value = 0.1, factor = 1000.0 }"]
    else:
        lines += remark(f"{damped}: {damping_said}")
        lines += [f"damping = {_believed(damping)}"]
    lines += _spring(balance, turning)
    if len(names) == 1 and turning:
        lines += ['# gear = { ratio = 101, kind = "harmonic drive" }  # if the joint has one']
    lines += [""]
    if force is not None:
        lines += _input(force, names[0], turning, scaled)
    lines += [
        "# [noise]  # standard deviations in SI, where they are known; estimated without",
        *(f"# {name} = 1e-5" for name in names),
        "",
    ]
    return lines


def _part(balance: Balance | None, name: str, motion: str) -> tuple[tuple[float, float], str]:
    """Return a coefficient of the balance with its factor, and where it comes from."""
    if balance is None:
        return (1.0, _WIDEST), "a wide guess"
    value, moved = getattr(balance, name), getattr(balance, motion)
    if value > 0.0 and value * moved > _SHOWN * balance.force:
        return (value, _WIDE), (
            f"least squares of mass, friction, gravity and spring on these records, within a "
            f"factor of {_WIDE:g}"
        )
    usual = _SHARE * balance.force / moved if moved > 0.0 else 1.0
    return (usual, _WIDEST), (
        f"the records do not show it by least squares; what would take a tenth of the force, "
        f"within a factor of {_WIDEST:g}"
    )


def _believed(value: tuple[float, float], parts: int = 1) -> str:
    return f"{{ value = {value[0] / parts:.2g}, factor = {value[1]:g} }}"


def _in_si(balance: Balance | None, force: ColumnGuess | None) -> Balance | None:
    """Return a balance of a force in SI, counted as the layout counts it."""
    if balance is None or force is None or not balance.force:
        return None
    scale = force.factor
    return replace(
        balance,
        inertia=scale * balance.inertia,
        damping=scale * balance.damping,
        dry=scale * balance.dry,
        stiffness=scale * balance.stiffness,
        gravity=abs(scale) * balance.gravity,
        force=abs(scale) * balance.force,
    )


def _spring(balance: Balance | None, turning: bool) -> list[str]:
    """Return the line of a stiffness: as a comment, unless mass and spring resonate."""
    unit = "N.m/rad" if turning else "N/m"
    if balance is None or balance.stiffness <= 0.0:
        return [f"# stiffness = {{ value = 100.0, factor = 10.0 }}  # {unit}, if there is a spring"]
    line = f"stiffness = {{ value = {balance.stiffness:.2g}, factor = {_WIDE:g} }}"
    shares = (
        balance.stiffness * balance.position / abs(balance.force),
        balance.inertia * balance.acceleration / abs(balance.force),
    )
    if min(shares) < _RESONATES or turning:
        return [f"# {line}  # {unit}, if there is a spring"]
    said = f"{unit}: mass and spring oppose each other in these records, within a factor of 10"
    return [*remark(said), line]


def _gear(roles: Roles, force: ColumnGuess | None) -> list[str]:
    ratio = abs(float(roles.coordinates[0].options["divided_by"]))
    lines = [
        "[ports.gear]",
        "motion = { motor = 1.0, load = -1.0 }",
        *remark(
            f"likely: the readings show {abs(roles.ratio):.6g}, twist included. {EDIT} if the gear "
            'is of another kind: kind = "other".'
        ),
        f'gear = {{ ratio = {ratio:g}, kind = "harmonic drive" }}',
    ]
    balance = roles.balance
    twist = 1e-3
    size = abs(balance.force * force.factor) if balance is not None and force is not None else 30.0
    lines += remark(
        f"{EDIT}: N.m/rad, not known; such that the largest part of the torque twists the gear by "
        f"a milliradian, within a factor of {_WIDEST:g}"
    )
    lines += [f"stiffness = {{ value = {size / twist:.1g}, factor = {_WIDEST:g} }}", ""]
    return lines


def _scaled(force: ColumnGuess) -> bool:
    """Tell whether a column is a force by its title or unit, so that its gain is 1."""
    return force.quantity in ("torque", "force") and (force.sure != "unsure") and _told(force)


def _told(force: ColumnGuess) -> bool:
    return force.unit_sure or any("title" in reason for reason in force.why)


def _input(force: ColumnGuess, coordinate: str, turning: bool, scaled: bool) -> list[str]:
    name = force.quantity if _told(force) else "drive"
    lines = [f"[inputs.{name}]", f"acts = {{ {coordinate} = 1.0 }}"]
    unit = "N.m" if turning else "N"
    if scaled:
        return [*lines, "gain = { value = 1.0 }  # the column is a force already", ""]
    lines += remark(
        f"{EDIT}: {unit} per unit of the column, if you know it. Without it all sizes are per unit "
        "of the signal, and so are the values above."
    )
    return [*lines, "# gain = { value = 10.0 }", ""]


def _table(logs: LogFolder, roles: Roles) -> list[str]:
    table = logs.tables[0]
    lines = ["[table]", f"format = {toml_value(table.format)}"]
    for key in ("delimiter", "decimal"):
        if (stated := getattr(table, key)) is not None:
            lines += [f"{key} = {toml_value(stated)}"]
    if table.skip_rows:
        lines += [f"skip_rows = {table.skip_rows}"]
    if roles.time is not None:
        lines += remark(guess_text(roles.time, "time"))
        lines += [f"time = {channel_text(roles.time)}"]
    elif roles.sample_rate is not None:
        lines += remark(
            "likely: no column of time, but a speed beside its position, which tells the rate. "
            f"{EDIT} if you know it better."
        )
        lines += [f"sample_rate = {roles.sample_rate:.4g}"]
    else:
        lines += remark(
            f"{EDIT}: Hz, not known: there is no column of time. Speeds and inertias hang on it."
        )
        lines += [f"sample_rate = {_USUAL_RATE:g}"]
    for name, guess in _channel_columns(roles).items():
        lines += remark(guess_text(guess, name))
        if name == "drive":
            lines += ["# Its unit is not known; with 1 it is taken as it stands."]
        lines += [f"channels.{name} = {channel_text(guess, column=_column(guess, logs))}"]
    if roles.remarks:
        lines += ["# Other columns:"]
        lines += [line for said in roles.remarks for line in remark(f"- {said}")]
    return [*lines, ""]


def guess_text(guess: ColumnGuess, name: str) -> str:
    """Return how sure a column is, from what, and what is assumed of its unit."""
    text = f"{guess.sure}: {guess.column!r} is {name}: {'; '.join(guess.why)}."
    if guess.sure == "unsure":
        text = f"{EDIT}: {text}"
    if "counts_per_turn" in guess.options and not guess.unit_sure:
        text += f" {EDIT} counts_per_turn, which nothing tells."
    elif not guess.unit_sure and guess.unit == "deg":
        text += f" {EDIT} its unit if it is not deg."
    elif not guess.unit_sure and guess.quantity != "time" and _told(guess):
        text += f" That its unit is {guess.unit} is assumed."
    if (
        guess.quantity == "position"
        and read_title(guess.title).side == "input"
        and "divided_by" not in (*guess.options,)
    ):
        text += (
            f" {EDIT}: it seems to be of a motor. For values of the joint add divided_by = 101.0 "
            "and gain = { value = 101.0 }, with the ratio of its gear."
        )
    return text


def channel_text(
    guess: ColumnGuess,
    options: Mapping[str, float | bool] | None = None,
    column: Name | None = None,
) -> str:
    """Return a channel as a table of a layout.

    Parameters
    ----------
    guess : ColumnGuess
    options : mapping, optional
        Instead of those of the guess.
    column : str or int, optional
        Instead of that of the guess.
    """
    unit = guess.unit
    # The quantity of a force is then a guess as well.
    if guess.quantity in ("torque", "force") and not _told(guess):
        unit = "1"
    keys = guess.options if options is None else options
    further = "".join(f", {name} = {toml_value(value)}" for name, value in keys.items())
    name = guess.column if column is None else column
    return f"{{ column = {toml_value(name)}, unit = {toml_value(unit)}{further} }}"


def _column(guess: ColumnGuess, logs: LogFolder) -> Name:
    """Return how the file of a column calls it."""
    return logs.sources.get(guess.column, ("", guess.column))[1]


def _records(logs: LogFolder, roles: Roles) -> list[str]:
    lines: list[str] = []
    for said in logs.left_out():
        lines += remark(said)
    if logs.sources:
        files = ", ".join(
            f"{name} = {toml_value(logs.sources[guess.column][0])}"
            for name, guess in _channel_columns(roles).items()
        )
        lines += ["# One record, whose signals stand in files of their own.", "[[records]]"]
        name = logs.folder.resolve().name or "record"
        return [*lines, f"name = {toml_value(name)}", f"files = {{ {files} }}"]
    parts = roles_of(logs.tables, logs)
    if len(logs.tables) == 1:
        lines += remark(
            "One record: 60 % of it are fitted, the rest is held out to validate the result. "
            "A second test of another kind would say more."
        )
    else:
        lines += remark(
            "Fitted are records of role train; those held out only judge the result. They were "
            "chosen by their names, or else by their speeds: from between the others."
        )
    for table in logs.tables:
        lines += ["[[records]]", f"file = {toml_value(table.path.name)}"]
        lines += [f"# {_size(table, logs)}"]
        if len(logs.tables) > 1:
            lines += [f"role = {toml_value(parts[table.path.name])}"]
        lines += [""]
    return lines[:-1]


def _channel_columns(roles: Roles) -> dict[str, ColumnGuess]:
    """Return the column of each channel."""
    channels = dict(zip(_names(roles), roles.coordinates, strict=True))
    for force in roles.forces[:1]:
        channels[force.quantity if _told(force) else "drive"] = force
    return channels


def roles_of(tables: Sequence[UnstatedTable], logs: LogFolder) -> dict[str, str]:
    """Return which files are fitted and which are held out, by name.

    Parameters
    ----------
    tables : sequence of UnstatedTable
    logs : LogFolder
    """
    named: dict[str, str] = {}
    for table in tables:
        stem = table.path.name.lower()
        for role, words in _WORDS.items():
            if any(word in stem for word in words):
                named[table.path.name] = role
    held_out = [name for name, role in named.items() if role == "held_out"]
    if 0 < len(held_out) < len(tables):
        return {table.path.name: named.get(table.path.name, "train") for table in tables}
    # Held out are tests whose speeds lie between those of others, so that all are covered.
    ranked = sorted(tables, key=lambda table: (_activity(table, logs), table.path.name))
    held = {table.path.name for at, table in enumerate(ranked) if at % _HELD_OUT == 1}
    if len(tables) == 2:
        held = {ranked[0].path.name}
    return {table.path.name: "held_out" if table.path.name in held else "train" for table in tables}


def _activity(table: UnstatedTable, logs: LogFolder) -> float:
    """Return how much all columns of a file move from row to row, relative to the other files."""

    def finite(values: Values) -> Values:
        return values[np.isfinite(values)]

    total = 0.0
    for name in logs.log.signals:
        values = table.columns[name]
        usual = max(float(np.std(finite(table.columns[name]))) for table in logs.tables) or 1.0
        moved = np.diff(finite(values))
        total += float(np.std(moved)) / usual if moved.size else 0.0
    return total


def _size(table: UnstatedTable, logs: LogFolder) -> str:
    time = logs.log.time
    if time is None:
        return f"{table.rows} rows"
    stamps = table.columns[time.column] * time.factor
    steps = np.diff(stamps[np.isfinite(stamps)])
    usual = float(np.median(steps))
    length = float(stamps[np.isfinite(stamps)][-1] - stamps[np.isfinite(stamps)][0])
    text = f"{table.rows} rows in {length:.4g} s, {1.0 / usual:.4g} Hz"
    if usual > 0.0 and float(np.max(np.abs(steps / usual - 1.0))) > 0.01:
        text += f", unevenly: steps of {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms"
    return text


def toml_value(value: Any) -> str:
    """Return a value as TOML."""
    return toml_text({"a": value}).removeprefix("a = ").strip()


def remark(text: str) -> list[str]:
    """Return a comment in lines of at most a hundred characters."""
    plain = "".join(character if character.isprintable() else "?" for character in text)
    lines, line = [], ""
    for word in plain.split():
        if line and len(line) + len(word) > 96:
            lines.append(f"# {line}")
            line = word
        else:
            line = f"{line} {word}".strip()
    return [*lines, f"# {line}"] if line else lines
