"""A mechanism in time, under the inputs of a record or in its closed loops.

Inputs and references are straight lines between samples: right for analogue signals; signals held
by a controller act half a sample later. The steps, which end at samples, are in
`exponential_steps`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number
from pymoo_hdte.mechanism.acting_forces import Command, PortForce, coordinate_row
from pymoo_hdte.mechanism.exponential_steps import ExponentialIntegrator
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.parts import LawAt, Loop
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]

_START_SAMPLES = 20
_FARTHEST = 1e6


@dataclass(frozen=True, eq=False)
class SimulatedCourse:
    """Course of a mechanism at the samples of a record, in SI.

    Attributes
    ----------
    time : ndarray, shape (n,)
        s.
    position, speed : dict of str to ndarray, shape (n,)
        By coordinate, m and m/s or rad and rad/s.
    inputs : dict of str to ndarray, shape (n,)
        As applied: of the record, or commanded by a loop; in its unit.
    forces : dict of str to ndarray, shape (n,)
        By port that is ``read``, N or N.m.

    Examples
    --------
    >>> arm = Mechanism({"q": BelievedValue(0.06)}, [], [Input("torque", {"q": 1.0})])
    >>> time = np.arange(0.0, 1.0, 0.01)
    >>> record = Record("one", "train", time, {"q": np.zeros(100), "torque": np.full(100, 0.06)})
    >>> course = simulate_mechanism(arm, record)
    >>> print(f"{course.speed['q'][-1]:.2f} rad/s")
    0.99 rad/s
    """

    time: Values
    position: dict[str, Values]
    speed: dict[str, Values]
    inputs: dict[str, Values]
    forces: dict[str, Values]


def simulate_mechanism(
    mechanism: Mechanism,
    record: Record,
    effects: Sequence[LawAt] = (),
    *,
    start: Mapping[str, ArrayLike] | None = None,
    history: Mapping[str, ArrayLike] | None = None,
    closed_loop: bool | None = None,
    rtol: float = 1e-6,
) -> SimulatedCourse:
    """Integrate a mechanism over the time of a record.

    Parameters
    ----------
    mechanism : Mechanism
        Its values are used as they are believed.
    record : Record
        Gives the inputs, or the references of loops, and measured starts.
    effects : sequence of LawAt
        Springs of hysteresis start as the ``history`` leaves them.
    start : mapping of str to (float, float), optional
        Position and speed of coordinates, shape (2,), SI. Others start at the first sample of their
        channel with the speed of a parabola through its first 20, those without a channel at rest
        at 0.
    history : mapping of str to ndarray, shape (k,), optional
        Positions of every coordinate before the start, from rest, SI; k of at least 1. Without it
        laws with memory start from rest.
    closed_loop : bool, optional
        Whether loops command their inputs; by default those do whose reference the record has.
    rtol : float
        Error of a step, relative to the farthest and fastest motion so far of every coordinate and
        port.

    Raises
    ------
    InvalidInput
        For a missing channel, an effect at no port, or a wrong argument.
    ArithmeticError
        If the motion grows beyond all bounds, or a law jumps so that no step is short enough.

    Examples
    --------
    >>> arm = Mechanism({"q": BelievedValue(0.06)}, [], [Input("torque", {"q": 1.0})])
    >>> time = np.arange(0.0, 1.0, 0.01)
    >>> record = Record("one", "train", time, {"q": np.zeros(100), "torque": np.full(100, 0.06)})
    >>> print(f"{simulate_mechanism(arm, record).position['q'][-1]:.2f} rad")
    0.49 rad
    """
    real_number("rtol", rtol, at_least=1e-12, at_most=1e-2)
    for effect in effects:
        one_of(f"port of effect {effect.name}", effect.port, mechanism.port_names)
    for port in mechanism.ports:
        if port.followed:
            allowed = "empty: a simulation moves coordinates only"
            raise InvalidInput(f"{port.name}.followed", dict(port.followed), allowed)
    begin = _start(mechanism, record, start or {})
    passed = _history(mechanism, begin, history)
    state = mechanism, passed, record
    ports = [
        PortForce(port, [effect.law for effect in effects if effect.port == port.name], *state)
        for port in mechanism.ports
    ]
    loops = _closed_loops(mechanism, record, closed_loop)
    commands = {loop.input: Command(loop, mechanism, record) for loop in loops}
    inertias = np.array([inertia.value for inertia in mechanism.inertias.values()])
    inputs, pushes = {}, np.zeros((len(record.time), len(inertias)))
    for actuation in mechanism.inputs:
        if actuation.name not in commands:
            inputs[actuation.name] = record.channel(actuation.name)
            pushes += np.outer(
                inputs[actuation.name],
                actuation.gain.value * coordinate_row(mechanism, actuation.acts),
            )
    acting = [force for force in ports if not force.port.read]
    rows = np.reshape([force.row for force in ports], (-1, len(inertias)))
    integrator = ExponentialIntegrator(inertias, [*acting, *commands.values()], rows, rtol)
    known = [*mechanism.coordinates, *(loop.reference for loop in mechanism.loops)]
    scales = [np.max(np.abs(record.channels[name])) for name in known if name in record.channels]
    bound = _FARTHEST * (max([*np.abs(begin[0]), *scales]) or 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        path = integrator.follow(record.time, pushes / inertias, begin, bound)
    forces = {force.port.name: force.along(path) for force in ports if force.port.read}
    inputs |= {name: command.along(path) for name, command in commands.items()}
    position, speed = (
        dict(zip(mechanism.coordinates, rows, strict=True)) for rows in path.transpose(1, 2, 0)
    )
    return SimulatedCourse(record.time, position, speed, inputs, forces)


def _closed_loops(mechanism: Mechanism, record: Record, closed: bool | None) -> list[Loop]:
    """Return the loops that command their inputs, each input at most one."""
    if not (closed is None or isinstance(closed, bool)):
        raise InvalidInput("closed_loop", closed, "None, True or False")
    if closed is None:
        loops = [loop for loop in mechanism.loops if loop.reference in record.channels]
    else:
        loops = list(mechanism.loops) if closed else []
    if closed and not loops:
        raise InvalidInput("closed_loop", closed, "None or False for a mechanism without loops")
    driven = [loop.input for loop in loops]
    if len(set(driven)) < len(driven):
        raise InvalidInput("inputs of closed loops", driven, "each input once")
    return loops


def _history(mechanism: Mechanism, begin: Values, given: Mapping[str, ArrayLike] | None) -> Values:
    """Return the states up to the start, shape (k, 2, coordinates), without speeds before it."""
    if given is None:
        return begin[None]
    for name in given:
        one_of("history", name, mechanism.coordinates)
    for name in mechanism.coordinates:
        one_of("coordinate of history", name, tuple(given))
    coordinate = next(iter(given))
    shape = (len(finite_array(f"history of {coordinate}", given[coordinate], (None,))),)
    passed = np.zeros((*shape, 2, len(mechanism.coordinates)))
    for place, name in enumerate(mechanism.coordinates):
        passed[:, 0, place] = finite_array(f"history of {name}", given[name], shape)
    return np.concatenate([passed, begin[None]])


def _start(mechanism: Mechanism, record: Record, given: Mapping[str, ArrayLike]) -> Values:
    """Return positions and speeds at the first sample, shape (2, coordinates)."""
    for name in given:
        one_of("start", name, mechanism.coordinates)
    begin = np.zeros((2, len(mechanism.coordinates)))
    for place, name in enumerate(mechanism.coordinates):
        if name in given:
            begin[:, place] = finite_array(f"start of {name}", given[name], (2,))
        elif name in record.channels:
            samples = record.channels[name][:_START_SAMPLES]
            time = record.time[: len(samples)] - record.time[0]
            begin[:, place] = samples[0], np.polyfit(time, samples, 2)[1]
    return begin
