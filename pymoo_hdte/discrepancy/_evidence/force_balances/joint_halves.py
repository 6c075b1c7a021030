"""A joint with encoders on both sides of its gear, taken apart into two mechanisms.

The first is the joint as a rigid body, whose balance of torques does not contain the gear's torque.
The second is the input alone, driven by the motor and held by the gear's spring, whose far end
follows the measured angle of the output. All angles and torques are those of the output side.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.mechanism import BelievedValue, Gear, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.believed import NOTHING
from pymoo_hdte.mechanism.gear import torsion_of

_SIDES = "input", "output"
"""Names of the ports of the motor and of the load where a mechanism has none there."""


@dataclass(frozen=True)
class Joint:
    """A mechanism that is a joint with two encoders.

    Attributes
    ----------
    mechanism : Mechanism
        A mechanism of two coordinates.
    gear : Port
        Port whose motion is the torsion.
    kind : Gear
    motor, load : str
        Coordinates of the gear's input and output.
    """

    mechanism: Mechanism
    gear: Port
    kind: Gear
    motor: str
    load: str

    def side(self, coordinate: str) -> Port:
        """Return the port of the motor or of the load, against the housing."""
        for port in self.mechanism.ports:
            if port is not self.gear and port.motion.get(coordinate):
                return port
        return Port(_SIDES[coordinate == self.load], {coordinate: 1.0})


def joint_of(mechanism: Mechanism) -> Joint | None:
    """Return a mechanism as a joint with two encoders, or None if it is not one.

    Raises
    ------
    InvalidInput
        If the gear has no stiffness, or there are other coordinates, a loop, a force sensor, or two
        ports on one side.
    """
    for port in mechanism.ports:
        between = torsion_of(port.motion)
        if port.gear and between and not port.read:
            joint = Joint(mechanism, port, port.gear, *between)
            _check(joint)
            return joint
    return None


def _check(joint: Joint) -> None:
    mechanism, name = joint.mechanism, joint.gear.name
    if joint.gear.stiffness.value == 0.0:
        allowed = "above 0; if it is known roughly only, with factor = 10"
        raise InvalidInput(f"stiffness of {name}", 0.0, allowed)
    sides = [port for port in mechanism.ports if port is not joint.gear]
    moved = [coordinate for port in sides for coordinate, share in port.motion.items() if share]
    plain = all([*port.motion.values()] == [1.0] and not port.read for port in sides)
    if mechanism.loops or len(mechanism.coordinates) != 2 or len(set(moved)) < len(moved):
        plain = False
    if not plain:
        allowed = (
            "beside the gear between two encoders no third coordinate, no loop, no force sensor, "
            "and one port on each side, its motion 1 of the angle there"
        )
        raise InvalidInput(f"ports beside {name}", [port.name for port in sides], allowed)


@dataclass(frozen=True)
class Half:
    """One of the two mechanisms, with its records and known effects.

    Attributes
    ----------
    mechanism : Mechanism
    records : tuple of Record
    known : tuple of LawAt
    """

    mechanism: Mechanism
    records: tuple[Record, ...]
    known: tuple[LawAt, ...]


def rigid_half(joint: Joint, records: Sequence[Record], known: Sequence[LawAt]) -> Half:
    """Return the joint as a rigid body with the coordinate of the load.

    The ports of both sides become one, because torques do not tell the sides of a friction apart.

    Parameters
    ----------
    joint : Joint
    records : sequence of Record
    known : sequence of LawAt
        Effects of the joint.
    """
    name, mechanism = joint.load, joint.mechanism
    load, motor = joint.side(name), joint.side(joint.motor)
    port = replace(
        load,
        motion={name: 1.0},
        stiffness=_sum_of_values(load.stiffness, motor.stiffness),
        damping=_sum_of_values(load.damping, motor.damping),
        load={**motor.load, **load.load},
        gear=joint.kind,
    )
    inputs = [
        replace(signal, acts={name: sum(signal.acts.values())}) for signal in mechanism.inputs
    ]
    rigid = Mechanism(
        {name: _sum_of_values(*mechanism.inertias.values())}, [port], inputs, (), [name]
    )
    laws = [replace(effect, port=port.name) for effect in known if effect.port != joint.gear.name]
    channels = {name, *(signal.name for signal in inputs)}
    return Half(rigid, tuple(_with_channels(record, channels) for record in records), tuple(laws))


def torsion_half(joint: Joint, records: Sequence[Record], known: Sequence[LawAt]) -> Half:
    """Return the input of the gear, which its spring holds to the measured angle of the load.

    The mean torsion of the first record is subtracted from all records, because they share the
    zeros of the encoders.

    Parameters
    ----------
    joint : Joint
    records : sequence of Record
    known : sequence of LawAt
        Effects of the joint.

    Raises
    ------
    InvalidInput
        If no input acts on the motor.
    """
    motor, load = joint.motor, joint.load
    reference = records[0]
    middle = float(np.mean(reference.channel(motor) - reference.channel(load)))
    error = tuple(
        # The load's angle moves by the middle, but its believed errors stay where they were.
        replace(line, phase=line.phase - line.order * middle) if line.coordinate == load else line
        for line in joint.gear.error
    )
    gear = replace(joint.gear, motion={motor: 1.0}, followed={load: -1.0}, error=error, gear=None)
    inputs = [
        Input(signal.name, {motor: signal.acts[motor]}, signal.gain, signal.scaled, signal.delay)
        for signal in joint.mechanism.inputs
        if signal.acts.get(motor)
    ]
    if not inputs:
        raise InvalidInput("inputs", (), f"one that acts on {motor}: the torque of the motor")
    inertia = {motor: joint.mechanism.inertias[motor]}
    # The motor's torque passes the shaft and loads it, because friction may be tenths of it.
    shaft = joint.side(motor)
    shaft = replace(
        shaft, load=shaft.load or {signal.name: signal.acts[motor] for signal in inputs}
    )
    half = Mechanism(inertia, [shaft, gear], inputs, (), [motor])
    channels = {motor, load, *(signal.name for signal in inputs)}
    moved = [
        _with_channels(
            record, channels, {load: record.channel(load) + middle, motor: record.channel(motor)}
        )
        for record in records
    ]
    laws = tuple(effect for effect in known if effect.port in half.port_names)
    return Half(half, tuple(moved), laws)


def _with_channels(
    record: Record, names: Collection[str], instead: dict[str, NDArray[np.float64]] | None = None
) -> Record:
    """Return a record with the named channels only, some of them replaced."""
    channels = {name: record.channel(name) for name in sorted(names)} | (instead or {})
    noise = {name: level for name, level in record.noise.items() if name in channels}
    treatment = record.dropped, record.remarks, record.interpolated, record.context
    return Record(record.name, record.role, record.time, channels, noise, *treatment)


def _sum_of_values(a: BelievedValue, b: BelievedValue) -> BelievedValue:
    """Return a sum, which is right where both parts are within their limits."""
    if NOTHING.value in (a.value, b.value):
        return b if a.value == NOTHING.value else a
    value = a.value + b.value
    lower, upper = (a.limits[end] + b.limits[end] for end in (0, 1))
    share = max(1.0 - lower / value, upper / value - 1.0)
    factor = max(value / lower, upper / value) if lower > 0.0 else math.inf
    # The narrower of both limits.
    if 2.0 * share <= factor - 1.0 / factor:
        return BelievedValue(value, tolerance=min(share, 1.0))
    return BelievedValue(value, factor=factor)
