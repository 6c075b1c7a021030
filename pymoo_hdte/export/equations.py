"""The equations of a mechanism in order, as every language that has formulas writes them."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.portable import Formula
from pymoo_hdte.export.exported import acting, common_notes, left_out, stated
from pymoo_hdte.export.expressions import Dialect, written
from pymoo_hdte.mechanism import LawAt, Port
from pymoo_hdte.mechanism.quantity_units import base_unit, unit_of, unit_of_number


@dataclass(frozen=True)
class Symbol:
    """A name of the file with its unit, ``"SI"`` where that is not known, and what it is."""

    name: str
    unit: str
    words: str = ""


@dataclass
class Equations:
    """Everything that an export by equations writes; text is in its language already.

    Attributes
    ----------
    coordinates, speeds, inputs : list of Symbol
        In the order of the mechanism.
    parameters : list of (Symbol, float)
    lines : list of (Symbol, str)
        Each is computed from those before it.
    forces : list of str
        On each coordinate, by the lines.
    inertias : list of str
        Name of the parameter of each coordinate.
    rates : list of (Symbol, str)
        Inner states of laws with their derivatives.
    notes : tuple of str
    """

    coordinates: list[Symbol] = field(default_factory=list)
    speeds: list[Symbol] = field(default_factory=list)
    inputs: list[Symbol] = field(default_factory=list)
    parameters: list[tuple[Symbol, float]] = field(default_factory=list)
    lines: list[tuple[Symbol, str]] = field(default_factory=list)
    forces: list[str] = field(default_factory=list)
    inertias: list[str] = field(default_factory=list)
    rates: list[tuple[Symbol, str]] = field(default_factory=list)
    notes: tuple[str, ...] = ()


class _Names:
    """Identifiers, each of them once."""

    def __init__(self, reserved: Collection[str]) -> None:
        # Expressions are in the grammar of Python, whatever they are written in afterwards.
        self.taken = {*keyword.kwlist, *reserved}

    def of(self, *words: str) -> str:
        name = "_".join(re.sub(r"[^A-Za-z0-9_]", "_", word) for word in words).strip("_")
        name = name if name[:1].isalpha() else f"x_{name}"
        found, count = name, 1
        while found in self.taken:
            count += 1
            found = f"{name}_{count}"
        self.taken.add(found)
        return found


def equations(model: MechanismModel, dialect: Dialect, reserved: Collection[str]) -> Equations:
    """Return the equations of a model.

    Parameters
    ----------
    model : MechanismModel
    dialect : Dialect
    reserved : collection of str
        Words of the language, and names of the file's own.

    Raises
    ------
    InvalidInput
        For a formula outside the grammar, or a port that follows a measured angle.
    """
    return _Builder(model, dialect, reserved).built


class _Builder:
    def __init__(self, model: MechanismModel, dialect: Dialect, reserved: Collection[str]) -> None:
        self.model, self.mechanism, self.dialect = model, model.mechanism, dialect
        self.names, self.built = _Names(reserved), Equations()
        notes = list(common_notes(model))
        for name in self.mechanism.coordinates:
            unit = unit_of(self.mechanism, name, "position")
            self.built.coordinates.append(Symbol(self.names.of(name), unit, name))
        self.of = dict(
            zip(
                self.mechanism.coordinates,
                [one.name for one in self.built.coordinates],
                strict=True,
            )
        )
        self.speed_of = {}
        for name in self.mechanism.coordinates:
            unit = unit_of(self.mechanism, name, "speed")
            symbol = Symbol(self.names.of(name, "speed"), unit)
            self.built.speeds.append(symbol)
            self.speed_of[name] = symbol.name
        signals = {one.name: self.names.of(one.name) for one in self.mechanism.inputs}
        self.built.inputs = [Symbol(name, "SI", one) for one, name in signals.items()]
        gains = {
            one.name: self._parameter(f"gain of {one.name}", one.gain.value)
            for one in self.mechanism.inputs
        }
        self.driving = {name: f"{gains[name]} * {signal}" for name, signal in signals.items()}
        forces = {
            name: [
                (one.acts[name], self.driving[one.name])
                for one in self.mechanism.inputs
                if one.acts.get(name)
            ]
            for name in self.mechanism.coordinates
        }
        for port in self.mechanism.ports:
            if port.followed:
                raise InvalidInput(f"{port.name}.followed", dict(port.followed), "empty")
            if port.read:
                continue
            found, missing = self._port(port)
            notes += missing
            for name, share in port.motion.items():
                if share:
                    forces[name].append((-share, found))
        for name, inertia in self.mechanism.inertias.items():
            self.built.inertias.append(self._parameter(f"inertia of {name}", inertia.value))
            self.built.forces.append(self._text(_sum(forces[name])))
        self.built.notes = tuple(notes)

    def _text(self, expression: str, names: Mapping[str, str] | None = None) -> str:
        known = {one: one for one in self.names.taken}
        return written(expression, self.dialect, names or known)

    def _parameter(self, quantity: str, value: float) -> str:
        name = self.names.of(*quantity.split(" of "))
        unit = base_unit(self.mechanism, quantity)
        self.built.parameters.append((Symbol(name, unit, quantity), value))
        return name

    def _line(self, name: str, unit: str, text: str) -> str:
        self.built.lines.append((Symbol(name, unit), text))
        return name

    def _port(self, port: Port) -> tuple[str, list[str]]:
        """Write the lines of a port; return the name of its force, and what is missing."""
        at, rate = (
            _sum([(share, names[name]) for name, share in port.motion.items() if share])
            for names in (self.of, self.speed_of)
        )
        for line in port.error:
            # Numbers of NumPy are written with their type.
            order, amplitude, phase = map(float, (line.order, line.amplitude, line.phase))
            angle = f"{order!r} * {self.of[line.coordinate]} + {phase!r}"
            at += f" + {amplitude!r} * sin({angle})"
            moved = self.speed_of[line.coordinate]
            rate += f" + {amplitude * order!r} * cos({angle}) * {moved}"
        position, speed = (
            self._line(
                self.names.of(port.name, word),
                unit_of(self.mechanism, port.name, word),
                self._text(text),
            )
            for word, text in (("position", at), ("speed", rate))
        )
        here = {"position": position, "angle": position, "speed": speed}
        here["stiffness"] = "0.0"
        parts = []
        if port.stiffness.value:
            here["stiffness"] = self._parameter(f"stiffness of {port.name}", port.stiffness.value)
            parts.append(f"{here['stiffness']} * {position}")
        if port.damping.value:
            damping = self._parameter(f"damping of {port.name}", port.damping.value)
            parts.append(f"{damping} * {speed}")
        unit = unit_of(self.mechanism, port.name)
        if port.load:
            shares = [(share, self.driving[name]) for name, share in port.load.items() if share]
            load = self._text(_sum(shares)) if shares else "0.0"
            here["load"] = self._line(self.names.of(port.name, "load"), unit, load)
        missing = []
        for effect in acting(self.model):
            if effect.port == port.name:
                formula = stated(effect.law, "formula")
                if formula is None:
                    missing.append(left_out(effect))
                else:
                    parts.append(self._law(effect, formula, here))
        force = self.names.of(port.name, "force")
        return self._line(force, unit, self._text(" + ".join(parts) or "0.0")), missing

    def _law(self, effect: LawAt, formula: Formula, here: Mapping[str, str]) -> str:
        """Write the lines of a law; return the name of its force."""
        known, registered = dict(here), effect_named(effect.name)
        force = self.names.of(effect.name, effect.port)
        for number in (one.name for one in fields(effect.law)):  # type: ignore[arg-type]
            if number not in registered.quantities:
                continue
            unit = unit_of_number(self.mechanism, effect.port, number, registered.unit(number))
            symbol = Symbol(self.names.of(force, number), unit)
            self.built.parameters.append((symbol, getattr(effect.law, number)))
            known[number] = symbol.name
        for state in formula.rates:
            known[state] = self.names.of(force, state)
        unit = unit_of(self.mechanism, effect.port, "position")
        for state, rate in formula.rates.items():
            self.built.rates.append((Symbol(known[state], unit), self._text(rate, known)))
        unit = unit_of(self.mechanism, effect.port)
        return self._line(force, unit, self._text(formula.force, known))


def _sum(shares: list[tuple[float, str]]) -> str:
    """Return a sum of names or products, each times a number."""
    parts = [
        text if share == 1.0 else f"-({text})" if share == -1.0 else f"{float(share)!r} * ({text})"
        for share, text in shares
    ]
    return " + ".join(parts) or "0.0"
