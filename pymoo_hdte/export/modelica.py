"""A model as a Modelica model with its laws as equations."""

from __future__ import annotations

import re

from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.export.equations import Symbol, equations
from pymoo_hdte.export.exported import Exported, head_lines
from pymoo_hdte.export.expressions import FUNCTIONS, MODELICA

_RESERVED = (
    *("algorithm", "and", "annotation", "assert", "block", "break", "class", "connect"),
    *("connector", "constant", "constrainedby", "der", "discrete", "each", "else"),
    *("elseif", "elsewhen", "encapsulated", "end", "enumeration", "equation", "expandable"),
    *("extends", "external", "false", "final", "flow", "for", "function", "if", "import"),
    *("impure", "in", "initial", "inner", "input", "loop", "model", "not", "operator"),
    *("or", "outer", "output", "package", "parameter", "partial", "protected", "public"),
    *("pure", "record", "redeclare", "replaceable", "return", "stream", "then", "true"),
    *("type", "when", "while", "within", "time", "Real", "Integer", "Boolean", "String"),
    *("Modelica"),
)


def to_modelica(model: MechanismModel) -> Exported:
    """Return a mechanism as a Modelica model: its inputs, and its laws as equations.

    Parameters
    ----------
    model : MechanismModel
        For instance ``analysis.revised_model()``.

    Raises
    ------
    InvalidInput
        For a port that follows a measured angle, or a law whose formula cannot be written.

    Examples
    --------
    >>> from pymoo_hdte.discrepancy import MechanismModel
    >>> from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism
    >>> arm = Mechanism({"q": BelievedValue(0.5)}, [], [Input("torque", {"q": 1.0})])
    >>> print(to_modelica(MechanismModel("An arm", arm)).text.splitlines()[0])
    model An_arm "An arm"
    """
    title = " ".join(model.title.split())
    named = re.sub(r"\W+", "_", title, flags=re.ASCII).strip("_")
    named = named if named[:1].isalpha() else f"Model_{named}"
    found = equations(model, MODELICA, {*_RESERVED, *FUNCTIONS, named})
    lines = [f"model {named} {_string(title)}"]
    lines += [f"  // {line}" for line in head_lines(model, found.notes)[1:]]
    lines += [
        f"  parameter Real {one.name}{_unit(one)} = {float(value)!r}{_words(one)};"
        for one, value in found.parameters
    ]
    lines += [f"  input Real {one.name}{_words(one)};" for one in found.inputs]
    begin = "start = 0, fixed = true"
    lines += [
        f"  Real {one.name}{_unit(one, begin)}{_words(one)};"
        for one in (*found.coordinates, *found.speeds, *(state for state, _ in found.rates))
    ]
    lines += [f"  Real {one.name}{_unit(one)};" for one, _ in found.lines]
    lines.append("equation")
    lines += [f"  {one.name} = {text};" for one, text in found.lines]
    for coordinate, speed, inertia, force in zip(
        found.coordinates, found.speeds, found.inertias, found.forces, strict=True
    ):
        lines.append(f"  der({coordinate.name}) = {speed.name};")
        lines.append(f"  {inertia} * der({speed.name}) = {force};")
    lines += [f"  der({one.name}) = {text};" for one, text in found.rates]
    lines.append(f"end {named};")
    return Exported("\n".join(lines) + "\n", found.notes)


def _unit(symbol: Symbol, more: str = "") -> str:
    unit = "" if symbol.unit == "SI" else f'unit = "{symbol.unit}"'
    inside = ", ".join(filter(None, (more, unit)))
    return f"({inside})" if inside else ""


def _words(symbol: Symbol) -> str:
    return f" {_string(symbol.words)}" if symbol.words else ""


def _string(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
