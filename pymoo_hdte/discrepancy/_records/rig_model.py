"""A model of a mechanism as a file: its values with tolerances, and its effects."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import toml_text, toml_with_lines
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.mechanism import BelievedValue, ErrorLine, Input, LawAt, Loop, Mechanism, Port
from pymoo_hdte.mechanism.believed import LARGEST_FACTOR, NOTHING
from pymoo_hdte.mechanism.effects import read_law, table_of
from pymoo_hdte.mechanism.gear import KINDS, Gear


@dataclass(frozen=True)
class MechanismModel:
    """The believed model of a mechanism: the model part of a rig's file.

    Attributes
    ----------
    title : str
    mechanism : Mechanism
        Its values with their tolerances.
    effects : tuple of LawAt
        Known laws at its ports.
    cutoff : float or None
        Frequency up to which the motion is known, Hz; None to determine it from the records.

    Examples
    --------
    >>> model = read_mechanism_model("report/revised_model.toml")  # doctest: +SKIP
    >>> model.mechanism.coordinates, model.effects  # doctest: +SKIP
    """

    title: str
    mechanism: Mechanism
    effects: tuple[LawAt, ...] = ()
    cutoff: float | None = None


def read_mechanism_model(path: str | Path) -> MechanismModel:
    """Read a model of a mechanism, such as ``revised_model.toml`` of a report.

    Parameters
    ----------
    path : str or Path
        File like ``rig.toml``, without records.

    Raises
    ------
    InvalidInput
        With file and line, as `read_rig`.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> model = read_mechanism_model("report/revised_model.toml")  # doctest: +SKIP
    """
    path = Path(path)
    with toml_with_lines(path) as top:
        model = model_from_fields(top, path.name)
        top.finish()
    return model


def model_text(model: MechanismModel) -> str:
    """Return the text that `read_mechanism_model` reads back exactly, without tables and records.

    Raises
    ------
    InvalidInput
        For what `read_mechanism_model` would refuse: an effect that is not registered or whose port
        does not exist, an empty title, a limit or cutoff that is not positive.
    """
    mechanism = model.mechanism
    top: dict[str, Any] = {"title": model.title}
    if model.cutoff is not None:
        top["cutoff"] = model.cutoff
    top["coordinates"] = {
        name: {"inertia": _believed_table(inertia)}
        | ({"angle": True} if name in (mechanism.angles or ()) else {})
        | ({"angle": False} if name in (mechanism.lengths or ()) else {})
        for name, inertia in mechanism.inertias.items()
    }
    top["ports"] = {port.name: _port_table(port) for port in mechanism.ports}
    top["inputs"] = {
        signal.name: {"acts": signal.acts}
        | ({"gain": _believed_table(signal.gain)} if signal.scaled else {})
        | ({} if signal.delay == 0.0 else {"delay": _stated_delay(signal)})
        for signal in mechanism.inputs
    }
    # The reader takes finite numbers only: a loop without saturation has no limit there.
    loops = [
        {name: value for name, value in vars(loop).items() if value != float("inf")}
        for loop in mechanism.loops
    ]
    rows = [table_of(effect) for effect in model.effects]
    # The reader takes no empty array of tables.
    top |= {name: array for name, array in (("loops", loops), ("effects", rows)) if array}
    # Refuse now a text that could not be read back later.
    model_from_fields(Fields(top, "model"), "model")
    return toml_text(top)


def _stated_delay(signal: Input) -> float | str:
    return "estimated" if signal.delay is None else signal.delay


def _believed_table(believed: BelievedValue) -> dict[str, float]:
    limits = {"tolerance": believed.tolerance, "factor": believed.factor}
    return {"value": believed.value} | {
        name: limit for name, limit in limits.items() if limit != getattr(NOTHING, name)
    }


def _port_table(port: Port) -> dict[str, Any]:
    elements = {"stiffness": port.stiffness, "damping": port.damping}
    stated = {name: _believed_table(value) for name, value in elements.items() if value != NOTHING}
    error = {"error": [vars(line) for line in port.error]} if port.error else {}
    optional: dict[str, Any] = {"load": dict(port.load)} if port.load else {}
    if port.gear:
        optional["gear"] = vars(port.gear)
    return (
        {"motion": port.motion, **stated} | ({"read": True} if port.read else {}) | error | optional
    )


def model_from_fields(top: Fields, file: str) -> MechanismModel:
    """Take the model out of a file's top table.

    Raises `InvalidInput` with the name of the ``file`` and the field.
    """
    title = top.text("title")
    cutoff = top.number("cutoff", above=0.0) if top.has("cutoff") else None
    mechanism = _mechanism(top, file)
    rows = top.tables("effects") if top.has("effects") else []
    effects = [_effect(row, f"{file}.effects[{i}]", mechanism) for i, row in enumerate(rows)]
    return MechanismModel(title, mechanism, tuple(effects), cutoff)


def _mechanism(top: Fields, file: str) -> Mechanism:
    inertias: dict[str, BelievedValue] = {}
    angles: dict[str, bool] = {}
    for name, table in _tables_by_name(top, "coordinates", file).items():
        inertias[name] = _believed(table, "inertia", above=0.0)
        if table.has("angle"):
            angles[name] = _flag(table, "angle", f"{file}.coordinates.{name}")
        table.finish()
    inputs = []
    for name, table in _tables_by_name(top, "inputs", file).items():
        acts = _shares(table, "acts", f"{file}.inputs.{name}", inertias)
        scaled = table.has("gain")
        gain = _believed(table, "gain") if scaled else BelievedValue(1.0)
        inputs.append(Input(name, acts, gain, scaled, _delay(table)))
        table.finish()
    input_names = [signal.name for signal in inputs]
    ports = [
        _port(name, table, f"{file}.ports.{name}", inertias, input_names)
        for name, table in _tables_by_name(top, "ports", file).items()
    ]
    rows = top.tables("loops") if top.has("loops") else []
    loops = [_loop(row, input_names, inertias) for row in rows]
    turning = [name for name, turns in angles.items() if turns] if angles else None
    sliding = [name for name, turns in angles.items() if not turns] if angles else None
    try:
        return Mechanism(inertias, ports, inputs, loops, turning, sliding)
    except InvalidInput as error:
        gains = {f"gain of {signal.name}": f"{file}.inputs.{signal.name}.gain" for signal in inputs}
        place = gains.get(error.field, f"{file}: {error.field}")
        raise InvalidInput(place, error.value, error.allowed) from None


def _delay(table: Fields) -> float | None:
    """Take the delay of an input, s; None where it is to be estimated."""
    if not table.has("delay"):
        return 0.0
    stated = table.take("delay", "a number of seconds, or 'estimated'")
    return None if stated == "estimated" else real_number(table.name_of("delay"), stated)


def _tables_by_name(top: Fields, field: str, file: str) -> dict[str, Fields]:
    """Return tables by the names that users gave them; only coordinates are required."""
    if field != "coordinates" and not top.has(field):
        return {}
    raw = top.take(field, "a table for each name")
    if not isinstance(raw, Mapping):
        raise InvalidInput(f"{file}.{field}", raw, "a table for each name")
    return {name: Fields(table, f"{file}.{field}.{name}") for name, table in raw.items()}


def _believed(table: Fields, field: str, **limits: float) -> BelievedValue:
    inside = table.table(field)
    value = inside.number("value", **limits)
    ranges = {"tolerance": (0.0, 1.0), "factor": (1.0, LARGEST_FACTOR)}
    stated = {
        name: inside.number(name, at_least=least, at_most=most)
        for name, (least, most) in ranges.items()
        if inside.has(name)
    }
    inside.finish()
    try:
        return BelievedValue(value, **stated)
    except InvalidInput as error:
        place = inside.name_of(error.field.removeprefix("believed."))
        raise InvalidInput(place, error.value, error.allowed) from None


def _flag(table: Fields, field: str, place: str) -> bool:
    raw = table.take(field, "true or false") if table.has(field) else False
    if not isinstance(raw, bool):
        raise InvalidInput(f"{place}.{field}", raw, "true or false")
    return raw


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


def _port(
    name: str, table: Fields, place: str, coordinates: Collection[str], inputs: Collection[str]
) -> Port:
    load = _shares(table, "load", place, inputs) if table.has("load") else {}
    motion = _shares(table, "motion", place, coordinates)
    stiffness, damping = (
        _believed(table, field, at_least=0.0) if table.has(field) else NOTHING
        for field in ("stiffness", "damping")
    )
    read = _flag(table, "read", place)
    lines = []
    for row in table.tables("error") if table.has("error") else []:
        coordinate = row.choice("coordinate", coordinates)
        numbers = {field: row.number(field) for field in ("order", "amplitude", "phase")}
        lines.append(ErrorLine(coordinate, **numbers))
        row.finish()
    gear = _gear(table.table("gear"), place) if table.has("gear") else None
    table.finish()
    return Port(name, motion, stiffness, damping, read, tuple(lines), load, gear)


def _gear(table: Fields, place: str) -> Gear:
    kind = table.choice("kind", KINDS) if table.has("kind") else "other"
    pairs = table.take("pole_pairs", "a whole number") if table.has("pole_pairs") else 0
    ratio = table.number("ratio", at_least=1.0)
    table.finish()
    try:
        return Gear(ratio, kind, pairs)
    except InvalidInput as error:
        raise InvalidInput(f"{place}.{error.field}", error.value, error.allowed) from None


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
    law = read_law(row, place, mechanism.port_names)
    name, port, effect = law.name, law.port, effect_named(law.name)
    if effect.of_reading and not mechanism.port(port).read:
        allowed = f"a port with read = true: {name} is what its force sensor shows"
        raise InvalidInput(f"{place}.port", port, allowed)
    if effect.loaded and not mechanism.port(port).load:
        allowed = f"a port with load = {{ input = share }}, on which {name} depends"
        raise InvalidInput(f"{place}.port", port, allowed)
    return law
