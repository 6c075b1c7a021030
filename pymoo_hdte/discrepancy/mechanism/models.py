"""The model part of a rig's file, read and written: mechanism and effects, `rig_files` has it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.drive.toml_text import toml_string
from pymoo_hdte.io.fields import Fields, toml_with_lines
from pymoo_hdte.laws.effect import effect_named
from pymoo_hdte.mechanism import Believed, ErrorLine, Input, LawAt, Loop, Mechanism, Port
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.mechanism import NOTHING

Model = tuple[str, Mechanism, tuple[LawAt, ...]]
"""Title, mechanism and effects."""


def read_model(path: str | Path) -> Model:
    """Return title, mechanism and effects of a file without records; errors as of `read_rig`."""
    path = Path(path)
    with toml_with_lines(path) as top:
        model, _ = model_from_fields(top, path.name)
        top.finish()
    return model


def rig_toml(
    title: str, mechanism: Mechanism, effects: Sequence[LawAt], cutoff: float | None = None
) -> str:
    """Return the text that `read_model` reads back exactly, without tables and records.

    Raises
    ------
    InvalidInput
        For what `read_model` would refuse: an effect that is not registered or whose port is
        not there, an empty title, a limit or cutoff that is not positive.
    """
    tables: list[tuple[str, Mapping[str, Any]]] = []
    for name, inertia in mechanism.inertias.items():
        tables.append((_heading("coordinates", name), {"inertia": _believed_table(inertia)}))
    for port in mechanism.ports:
        tables.append((_heading("ports", port.name), _port_table(port)))
        lines = f"[{_heading('ports', port.name, 'error')}]"
        tables += [(lines, vars(line)) for line in port.error]
    for one in mechanism.inputs:
        acting = {"acts": one.acts, "gain": _believed_table(one.gain)}
        tables.append((_heading("inputs", one.name), acting))
    for loop in mechanism.loops:
        # The reader takes finite numbers only: a loop without saturation has no limit there.
        kept = {name: one for name, one in vars(loop).items() if one != float("inf")}
        tables.append(("[[loops]]", kept))
    for effect in effects:
        where = {"name": effect.name, "port": effect.port}
        tables.append(
            ("[[effects]]", {**where, **effect_named(effect.name).numbers_of(effect.law)})
        )
    top = {"title": title} if cutoff is None else {"title": title, "cutoff": cutoff}
    text = _lines(top) + "".join(f"\n{heading}\n{_lines(table)}" for heading, table in tables)
    # What cannot be read back is better refused now than when the text is needed.
    model_from_fields(Fields(tomllib.loads(text), "model"), "model")
    return text


def _believed_table(one: Believed) -> dict[str, float]:
    return {"value": one.value} | ({"tolerance": one.tolerance} if one.tolerance else {})


def _port_table(port: Port) -> dict[str, Any]:
    elements = {"stiffness": port.stiffness, "damping": port.damping}
    there = {name: _believed_table(one) for name, one in elements.items() if one != NOTHING}
    return {"motion": port.motion, **there} | ({"read": True} if port.read else {})


def _heading(*names: str) -> str:
    return f"[{'.'.join(_key(name) for name in names)}]"


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(name)} = {_value(value)}\n" for name, value in table.items())


def _key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:
    """Return a text, number, truth value or table of these in TOML."""
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(name)} = {_value(one)}" for name, one in value.items())
        return f"{{ {inside} }}"
    if isinstance(value, str):
        return toml_string(value)
    return "true" if value is True else repr(float(value))


def model_from_fields(top: Fields, file: str) -> tuple[Model, float | None]:
    """Take the model out of a file's top table, and the cutoff (Hz) if it has one.

    Raises `InvalidInput` with the name of the ``file`` and the field.
    """
    title = top.text("title")
    cutoff = top.number("cutoff", above=0.0) if top.has("cutoff") else None
    mechanism = _mechanism(top, file)
    rows = top.tables("effects") if top.has("effects") else []
    effects = [_effect(row, f"{file}.effects[{i}]", mechanism) for i, row in enumerate(rows)]
    return (title, mechanism, tuple(effects)), cutoff


def _mechanism(top: Fields, file: str) -> Mechanism:
    inertias: dict[str, Believed] = {}
    for name, table in _named(top, "coordinates", file).items():
        inertias[name] = _believed(table, "inertia", above=0.0)
        table.finish()
    ports = [
        _port(name, table, f"{file}.ports.{name}", inertias)
        for name, table in _named(top, "ports", file).items()
    ]
    inputs = []
    for name, table in _named(top, "inputs", file).items():
        acts = _shares(table, "acts", f"{file}.inputs.{name}", inertias)
        inputs.append(Input(name, acts, _believed(table, "gain", at_least=0.0)))
        table.finish()
    rows = top.tables("loops") if top.has("loops") else []
    loops = [_loop(row, [one.name for one in inputs], inertias) for row in rows]
    try:
        return Mechanism(inertias, ports, inputs, loops)
    except InvalidInput as error:
        raise InvalidInput(f"{file}: {error.field}", error.value, error.allowed) from None


def _named(top: Fields, field: str, file: str) -> dict[str, Fields]:
    """Return tables by the names that users gave them; only coordinates have to be there."""
    if field != "coordinates" and not top.has(field):
        return {}
    raw = top.take(field, "a table for each name")
    if not isinstance(raw, Mapping):
        raise InvalidInput(f"{file}.{field}", raw, "a table for each name")
    return {name: Fields(table, f"{file}.{field}.{name}") for name, table in raw.items()}


def _believed(table: Fields, field: str, **limits: float) -> Believed:
    inside = table.table(field)
    value = inside.number("value", **limits)
    given = inside.has("tolerance")
    tolerance = inside.number("tolerance", at_least=0.0, at_most=1.0) if given else 0.0
    inside.finish()
    return Believed(value, tolerance)


def _shares(
    table: Fields, field: str, place: str, coordinates: Collection[str]
) -> dict[str, float]:
    raw = table.take(field, "{ coordinate = share, ... }")
    if not isinstance(raw, Mapping):
        raise InvalidInput(f"{place}.{field}", raw, "{ coordinate = share, ... }")
    return {
        one_of(f"{place}.{field}", name, coordinates): real_number(f"{place}.{field}.{name}", share)
        for name, share in raw.items()
    }


def _port(name: str, table: Fields, place: str, coordinates: Collection[str]) -> Port:
    motion = _shares(table, "motion", place, coordinates)
    stiffness, damping = (
        _believed(table, field, at_least=0.0) if table.has(field) else NOTHING
        for field in ("stiffness", "damping")
    )
    read = table.take("read", "true or false") if table.has("read") else False
    if not isinstance(read, bool):
        raise InvalidInput(f"{place}.read", read, "true or false")
    lines = []
    for row in table.tables("error") if table.has("error") else []:
        coordinate = row.choice("coordinate", coordinates)
        numbers = {one: row.number(one) for one in ("order", "amplitude", "phase")}
        lines.append(ErrorLine(coordinate, **numbers))
        row.finish()
    table.finish()
    return Port(name, motion, stiffness, damping, read, tuple(lines))


def _loop(row: Fields, inputs: Collection[str], coordinates: Collection[str]) -> Loop:
    loop = Loop(
        row.choice("input", inputs),
        row.text("reference"),
        row.choice("coordinate", coordinates),
        row.number("position_gain"),
        row.number("speed_gain"),
        row.number("limit", above=0.0) if row.has("limit") else float("inf"),
    )
    row.finish()
    return loop


def _effect(row: Fields, place: str, mechanism: Mechanism) -> LawAt:
    name = row.choice("name", [one.name for one in law_effects()])
    effect, port = effect_named(name), row.choice("port", mechanism.port_names)
    if effect.of_reading and not mechanism.port(port).read:
        allowed = f"a port with read = true: {name} is what its force sensor shows"
        raise InvalidInput(f"{place}.port", port, allowed)
    numbers = {one: row.number(one) for one in effect.quantities if row.has(one)}
    row.finish()
    try:
        return LawAt(name, port, effect.law_of(numbers))
    except InvalidInput as error:
        field = error.field.removeprefix(f"{name}.")
        raise InvalidInput(f"{place}.{field}", error.value, error.allowed) from None
