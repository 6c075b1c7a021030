"""A mechanism in time, under the inputs of a record or in its closed loops.

Inputs and references are straight lines between samples: right for analogue signals; what a
controller holds acts half a sample later. Steps end at samples and are those of exprb32 (Hochbruck,
Ostermann, Schweitzer, SIAM J. Numer. Anal. 47, 2009): exact for what is linear, however stiff, and
of third order in how laws depart from their tangents. What the second order misses is their error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number
from pymoo_hdte.drive.hysteresis import MaxwellSlip
from pymoo_hdte.drive.laws import Law, PortState, periodic_phase
from pymoo_hdte.mechanism.mechanism import LawAt, Loop, Mechanism, Port
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]
Tangent = tuple[float, Values, float]
"""A force, its slopes by positions and speeds, shape (2, coordinates), and its slope by time."""

Tangents = tuple[Values, Values, Values]

_START_SAMPLES = 20
_FARTHEST = 1e6
_STEPS_PER_SAMPLE, _STEPS_ANYWAY = 50, 20_000
_SHORTEST = 1e-9
"""Share of a sample below which a step is taken whatever its error: a law jumps there."""
_ROUNDING = 1e-14
_TURN = 1e-7


@dataclass(frozen=True, eq=False)
class Simulation:
    """Course of a mechanism at the samples of a record; SI, arrays of shape (n,).

    Attributes
    ----------
    time : ndarray
    position, speed : dict of str to ndarray
        By coordinate.
    inputs : dict of str to ndarray
        As they acted: of the record, or commanded by a loop.
    forces : dict of str to ndarray
        By port that is ``read``.
    """

    time: Values
    position: dict[str, Values]
    speed: dict[str, Values]
    inputs: dict[str, Values]
    forces: dict[str, Values]


def simulate(
    mechanism: Mechanism,
    record: Record,
    effects: Sequence[LawAt] = (),
    *,
    start: Mapping[str, ArrayLike] | None = None,
    closed_loop: bool | None = None,
    rtol: float = 1e-6,
) -> Simulation:
    """Integrate a mechanism over the time of a record.

    Parameters
    ----------
    mechanism : Mechanism
        Its values are used as they are believed.
    record : Record
        Gives the inputs, or the references of loops, and measured starts.
    effects : sequence of LawAt
        Springs of hysteresis start unstretched.
    start : mapping of str to (float, float), optional
        Position and speed of coordinates. Others start at the first sample of their channel with
        the speed of a parabola through its first 20, those without a channel at rest at 0.
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
    """
    real_number("rtol", rtol, at_least=1e-12, at_most=1e-2)
    for effect in effects:
        one_of(f"port of effect {effect.name}", effect.port, mechanism.port_names)
    begin = _start(mechanism, record, start or {})
    ports = [
        _PortForce(port, [one.law for one in effects if one.port == port.name], mechanism, begin)
        for port in mechanism.ports
    ]
    loops = _closed_loops(mechanism, record, closed_loop)
    commands = {loop.input: _Command(loop, mechanism, record) for loop in loops}
    inertias = np.array([one.value for one in mechanism.inertias.values()])
    inputs, pushes = {}, np.zeros((len(record.time), len(inertias)))
    for one in mechanism.inputs:
        if one.name not in commands:
            inputs[one.name] = _channel(record, one.name)
            pushes += np.outer(inputs[one.name], one.gain.value * _row(mechanism, one.acts))
    acting = [one for one in ports if not one.port.read]
    rows = np.reshape([one.row for one in ports], (-1, len(inertias)))
    integrator = _Integrator(inertias, [*acting, *commands.values()], rows, rtol)
    known = [*mechanism.coordinates, *(loop.reference for loop in mechanism.loops)]
    scales = [np.max(np.abs(record.channels[name])) for name in known if name in record.channels]
    bound = _FARTHEST * (max([*np.abs(begin[0]), *scales]) or 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        path = integrator.follow(record.time, pushes / inertias, begin, bound)
    forces = {one.port.name: one.along(path) for one in ports if one.port.read}
    inputs |= {name: one.along(path) for name, one in commands.items()}
    position, speed = (dict(zip(mechanism.coordinates, rows, strict=True)) for rows in path)
    return Simulation(record.time, position, speed, inputs, forces)


class _PortForce:
    """What acts at a port. States are positions and speeds, shape (2, coordinates)."""

    def __init__(
        self, port: Port, laws: Sequence[Law], mechanism: Mechanism, begin: Values
    ) -> None:
        self.port = port
        self.row = _row(mechanism, port.motion)
        self.column = -self.row
        self.spring = (port.stiffness.value, port.damping.value)
        self.slopes = np.outer(self.spring, self.row)
        self.linear = not (laws or port.error)
        self.lines = [(mechanism.coordinates.index(one.coordinate), one) for one in port.error]
        self.turning = [line.order * np.eye(len(self.row))[place] for place, line in self.lines]
        self.turning += [order * self.row for law in laws for order in law.orders]
        self.laws = [law for law in laws if not isinstance(law, MaxwellSlip)]
        self.slips = [law for law in laws if isinstance(law, MaxwellSlip)]
        self.stretches = [np.zeros_like(law._slips) for law in self.slips]
        self.since = self.motion(begin)[0]

    def motion(self, state: Values) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """Return d, d', and by line its coordinate with the slopes of d and d' over it."""
        position, speed = state
        d, rate, bends = self.row @ position, self.row @ speed, []
        for place, line in self.lines:
            angle = line.order * position[place] + line.phase
            wave = line.amplitude * np.sin(angle)
            slope = line.order * line.amplitude * np.cos(angle)
            d, rate = d + wave, rate + slope * speed[place]
            bends.append((place, slope, -(line.order**2) * wave * speed[place]))
        return d, rate, bends

    def at(self, state: Values, time: float) -> Tangent:
        """Return the force and its tangent, which for slipping springs is one-sided."""
        d, rate, bends = self.motion(state)
        stiffness, damping = self.spring
        force: float = stiffness * d + damping * rate
        here: Any = PortState(d, rate, periodic_phase(d), self.port.stiffness.value)  # type: ignore[arg-type]
        for law in self.laws:
            found = law.respond(here)
            force += float(np.asarray(found.torque).item())
            stiffness += np.asarray(found.slope).item()
            damping += np.asarray(found.damping).item()
            if law.orders:
                # A law's slope holds the phase, which turns with the position here.
                turned = law.respond(replace(here, phase=periodic_phase(d + _TURN)))
                stiffness += np.asarray(turned.torque - found.torque).item() / _TURN
        for law, stretch in zip(self.slips, self.stretches, strict=True):
            moved = stretch + (d - self.since)
            force += law.torque(moved)
            stiffness += law._stiffnesses @ np.abs(law.rates(math.copysign(1.0, rate), moved))
        slopes = np.outer((stiffness, damping), self.row)
        for place, slope, bend in bends:
            slopes[:, place] += stiffness * slope + damping * bend, damping * slope
        return float(force), slopes, 0.0

    def turns(self, before: Values, after: Values, step: float, rtol: float) -> float:
        """Return the share of a step after which slipping springs turn back, 1 for none."""
        if not self.slips:
            return 1.0
        first, last = self.motion(before)[1], self.motion(after)[1]
        missed = min(abs(first), abs(last)) * step
        if first * last >= 0.0 or missed <= rtol * min(law.torsion for law in self.slips):
            return 1.0
        return float(min(max(first / (first - last), 0.01), 0.99))

    def settle(self, state: Values) -> None:
        """Keep how far springs are stretched, which between turns only the motion decides."""
        if self.slips:
            d = self.motion(state)[0]
            for law, stretch in zip(self.slips, self.stretches, strict=True):
                stretch[:] = np.clip(stretch + (d - self.since), -law._slips, law._slips)
            self.since = d

    def along(self, path: Values) -> Values:
        """Return the force on a path of shape (2, coordinates, n)."""
        d, rate, _ = self.motion(path)
        stiffness, phase = np.asarray(self.spring[0]), periodic_phase(d)
        force = stiffness * d + self.spring[1] * rate
        for law in self.laws:
            force += law.respond(PortState(d, rate, phase, stiffness)).torque
        for law in self.slips:
            force += law.respond(PortState(d - d[0], rate, phase, stiffness)).torque[0]
        return np.asarray(force)


class _Command:
    """What a loop commands."""

    linear = False
    turning: tuple[Values, ...] = ()

    def __init__(self, loop: Loop, mechanism: Mechanism, record: Record) -> None:
        self.limit, self.gain, self.time = loop.limit, loop.position_gain, record.time
        self.reference = _channel(record, loop.reference)
        self.rates = np.diff(self.reference) / np.diff(self.time)
        gains = (-loop.position_gain, -loop.speed_gain)
        self.slopes = np.outer(gains, _row(mechanism, {loop.coordinate: 1.0}))
        driven = next(one for one in mechanism.inputs if one.name == loop.input)
        self.column = driven.gain.value * _row(mechanism, driven.acts)

    def at(self, state: Values, time: float) -> Tangent:
        """Return the command and its tangent."""
        place = min(int(np.searchsorted(self.time, time, "right")), len(self.rates)) - 1
        reference = self.reference[place] + self.rates[place] * (time - self.time[place])
        wanted = float(self.gain * reference + np.sum(self.slopes * state))
        if abs(wanted) > self.limit:
            return math.copysign(self.limit, wanted), np.zeros_like(self.slopes), 0.0
        return wanted, self.slopes, float(self.gain * self.rates[place])

    def along(self, path: Values) -> Values:
        """Return the command on a path of shape (2, coordinates, n)."""
        wanted = self.gain * self.reference + np.tensordot(self.slopes, path, 2)
        return np.clip(wanted, -self.limit, self.limit)


class _Integrator:
    """Steps of a mechanism, with what those behind say about the next."""

    def __init__(
        self, inertias: Values, forces: Sequence[_PortForce | _Command], rows: Values, rtol: float
    ) -> None:
        n = len(inertias)
        self.curved = [one for one in forces if not one.linear]
        self.memories = [one for one in self.curved if isinstance(one, _PortForce) and one.slips]
        slopes = [one.slopes[:, None] * (one.column / inertias)[:, None] for one in forces]
        linear = sum(
            (one for one, force in zip(slopes, forces, strict=True) if force.linear),
            start=np.zeros((2, n, n)),
        )
        columns = np.reshape([one.column / inertias for one in self.curved], (-1, n)).T
        watched = np.vstack([np.eye(n), rows]).T
        self.plant = linear, np.ascontiguousarray(columns), np.ascontiguousarray(watched)
        whole = np.hstack([*sum(slopes, start=np.zeros((2, n, n)))])
        swings = np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), whole]))
        self.swing = float(np.max(np.abs(swings.imag), initial=1e-9))
        self.turning = [row for one in self.curved for row in one.turning]
        self.rtol, self.trial = rtol, math.inf

    def follow(self, time: Values, pushes: Values, begin: Values, bound: float) -> Values:
        """Return positions and speeds, shape (2, coordinates, n).

        ``pushes`` are the accelerations by inputs, shape (n, coordinates), and ``bound`` is how
        far positions may go.
        """
        path = np.empty((len(time), *begin.shape))
        path[0] = state = begin
        self.origin = begin * [[1.0], [0.0]]
        self.reach = np.abs((begin - self.origin) @ self.plant[2])
        swung = self.swing * (time[-1] - time[0])
        self.steps_left = int(_STEPS_ANYWAY + _STEPS_PER_SAMPLE * (len(time) + swung))
        for index, interval in enumerate(np.diff(time).tolist()):
            drift, left = (pushes[index + 1] - pushes[index]) / interval, interval
            while left > 0.0:
                passed = interval - left
                moment = float(time[index]) + passed
                state, step = self.advance(
                    state, moment, left, (pushes[index] + passed * drift, drift)
                )
                left -= step
                if not (np.abs(state[0]) < bound).all() or self.steps_left < 0:
                    raise ArithmeticError(
                        f"at t = {moment:g} s the motion is {state[0]}, beyond {bound:g}"
                        if self.steps_left >= 0
                        else f"by t = {moment:g} s there were too many steps: a law jumps"
                    )
            path[index + 1] = state
        return path.transpose(1, 2, 0)

    def advance(
        self, state: Values, time: float, left: float, push: tuple[Values, Values]
    ) -> tuple[Values, float]:
        """Return the state after one accepted step, which ends at the next sample or before."""
        found = [one.at(state, time) for one in self.curved]
        forces, rates = (np.array([one[part] for one in found]) for part in (0, 2))
        tangent = forces, np.reshape([one[1] for one in found], (-1, *state.shape)), rates
        longest, shortest = min(left, self.longest(state)), _SHORTEST * left
        while True:
            self.steps_left -= 1
            step = min(self.trial, longest)
            step = left if step > 0.999 * left else step
            middle, move, phi = _predict(step, state, push, self.plant, tangent)
            half, whole = np.zeros((2, state.shape[1]))
            if self.curved:
                half = self.departed(state, middle, time, 0.5 * step, tangent)
                later = move + _moved(phi[0] @ (step**2 * half), step)
                whole = self.departed(state, later, time, step, tangent)
            after, reach, size = _correct(
                step,
                state + move,
                half,
                whole,
                phi,
                self.plant[2],
                self.origin,
                self.reach,
                self.rtol,
            )
            change = max(0.1, 0.9 * max(size, 1e-3) ** -0.25)
            share = change
            if size <= 1.0:
                turns = [one.turns(state, after, step, self.rtol) for one in self.memories]
                share = min(turns, default=1.0)
            if share >= 1.0 or step <= shortest:
                break
            self.trial = share * step
        self.trial = max(step * change, self.trial if step < self.trial else 0.0)
        self.reach = reach
        for one in self.memories:
            one.settle(after)
        return after, step

    def departed(
        self, state: Values, move: Values, time: float, step: float, tangent: Tangents
    ) -> Values:
        """Return by how much accelerations after a move depart from the tangents, (coordinates,)."""
        forces, slopes, rates = tangent
        there = np.array([one.at(state + move, time + step)[0] for one in self.curved])
        return self.plant[1] @ (there - forces - np.tensordot(slopes, move, 2) - step * rates)

    def longest(self, state: Values) -> float:
        """Return the step in which nothing swings or turns by more than 1 rad unseen."""
        if not self.curved:
            return math.inf
        return 1.0 / max([self.swing, *(abs(float(row @ state[1])) for row in self.turning)])


@njit(cache=True)
def _predict(
    step: float,
    state: Values,
    push: tuple[Values, Values],
    plant: tuple[Values, Values, Values],
    tangent: Tangents,
) -> tuple[Values, Values, Values]:
    """Return the moves in half a step and in one by the tangents, and functions phi.

    ``push`` is the acceleration by inputs and its rate. Of phi_1 to phi_4, shape (4, 2 coordinates,
    coordinates), only what acts on accelerations is there.
    """
    (linear, columns, _), (forces, slopes, rates) = plant, tangent
    n = len(columns)
    by_position = linear[0] + columns @ np.ascontiguousarray(slopes[:, 0])
    by_speed = linear[1] + columns @ np.ascontiguousarray(slopes[:, 1])
    acceleration = push[0] + linear[0] @ state[0] + linear[1] @ state[1] + columns @ forces
    # A straight line and what departs from it, with speeds in ways per step.
    way = step * state[1]
    bend = step**2 * (by_position @ way) + step**3 * (push[1] + columns @ rates)
    block = np.eye(6 * n, k=n)
    block[n : 2 * n, :n] = step**2 * by_position
    block[n : 2 * n, n : 2 * n] = step * by_speed
    half, whole = _exponentials(block)
    phi = np.empty((4, 2 * n, n))
    for k in range(4):
        phi[k] = whole[: 2 * n, (k + 2) * n : (k + 3) * n]
    first = half[: 2 * n, 2 * n : 3 * n].copy() @ (step**2 * acceleration)
    first += half[: 2 * n, 3 * n : 4 * n].copy() @ bend
    first[:n] += 0.5 * way
    last = phi[0] @ (step**2 * acceleration) + phi[1] @ bend
    last[:n] += way
    return _moved(first, step), _moved(last, step), phi


@njit(cache=True)
def _moved(change: Values, step: float) -> Values:
    """Return a change of positions and ways per step as one of positions and speeds."""
    move = change.copy().reshape(2, len(change) // 2)
    move[1] /= step
    return move


@njit(cache=True)
def _correct(
    step: float,
    predicted: Values,
    half: Values,
    whole: Values,
    phi: Values,
    watched: Values,
    origin: Values,
    reach: Values,
    rtol: float,
) -> tuple[Values, Values, float]:
    """Return the corrected state, how far it has ever been, and the error over the allowed one."""
    error = _moved(phi[3] @ (step**2 * (12.0 * whole - 48.0 * half)), step)
    after = predicted + _moved(phi[2] @ (step**2 * (16.0 * half - 2.0 * whole)), step) + error
    farthest = np.maximum(reach, np.abs((after - origin) @ watched))
    missed = np.abs(error @ watched)
    for kind in range(2):
        rounding = _ROUNDING * (np.max(farthest[kind]) + np.max(np.abs(after[kind]))) + 1e-300
        missed[kind] /= rtol * farthest[kind] + rounding
    return after, farthest, np.max(missed)


@njit(cache=True)
def _exponentials(matrix: Values) -> tuple[Values, Values]:
    """Return the exponentials of half a matrix and of the whole one."""
    norm, halvings = np.max(np.sum(np.abs(matrix), axis=1)), 1
    while norm > 2.0**halvings and halvings < 200:
        halvings += 1
    share, identity = matrix / 2.0**halvings, np.eye(len(matrix))
    result = identity
    for order in range(18, 0, -1):
        result = identity + share @ result / order
    for _ in range(halvings - 1):
        result = result @ result
    return result, result @ result


def _row(mechanism: Mechanism, shares: Mapping[str, float]) -> Values:
    return np.array([float(shares.get(name, 0.0)) for name in mechanism.coordinates])


def _channel(record: Record, name: str) -> Values:
    if name not in record.channels:
        allowed = f"with {name!r}, which the mechanism needs"
        raise InvalidInput(f"channels of record {record.name}", sorted(record.channels), allowed)
    return record.channels[name]


def _closed_loops(mechanism: Mechanism, record: Record, closed: bool | None) -> list[Loop]:
    """Return the loops that command their inputs, each input at most one."""
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


def _start(mechanism: Mechanism, record: Record, given: Mapping[str, ArrayLike]) -> Values:
    """Return positions and speeds at the first sample, shape (2, coordinates)."""
    for name in given:
        one_of("start", name, mechanism.coordinates)
    begin = np.zeros((2, len(mechanism.coordinates)))
    for place, name in enumerate(mechanism.coordinates):
        if name in given:
            begin[:, place] = finite_array(f"start of {name}", given[name], (2,))
        elif name in record.channels:
            first = record.channels[name][:_START_SAMPLES]
            time = record.time[: len(first)] - record.time[0]
            begin[:, place] = first[0], np.polyfit(time, first, 2)[1]
    return begin
