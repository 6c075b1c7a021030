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
Triple = tuple[Values, Values, Values]

_START_SAMPLES = 20
_FARTHEST = 1e6
_STEPS_ANYWAY, _STEPS_PER_SAMPLE = 20_000, 50
_SHORTEST = 1e-9
"""Share of the way to the next sample below which a step is taken whatever its error."""
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
    position, speed = (
        dict(zip(mechanism.coordinates, rows, strict=True)) for rows in path.transpose(1, 2, 0)
    )
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

    def motion(self, states: Values) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """Return d, d', and by error line its coordinate and the slopes of d and d' over it.

        Of states of shape (..., 2, coordinates).
        """
        d, rate = (states @ self.row).T
        bends = []
        for place, line in self.lines:
            angle, speed = line.order * states[..., 0, place] + line.phase, states[..., 1, place]
            wave = line.amplitude * np.sin(angle)
            slope = line.order * line.amplitude * np.cos(angle)
            d, rate = d + wave, rate + slope * speed
            bends.append((place, slope, -(line.order**2) * wave * speed))
        return d, rate, bends

    def at(self, state: Values, time: float, slopes: Values) -> tuple[float, float]:
        """Return the force and its slope by time; write those by the state into ``slopes``."""
        d, rate, bends = self.motion(state)
        stiffness, damping = self.spring
        force = stiffness * d + damping * rate
        here = PortState(d, rate, periodic_phase(d), self.spring[0])  # type: ignore[arg-type]
        for law in self.laws:
            found = law.respond(here)
            force += np.asarray(found.torque).item()
            stiffness += np.asarray(found.slope).item()
            damping += np.asarray(found.damping).item()
            if law.orders:
                # A law's slope holds the phase, which turns with the position here.
                turned = law.respond(replace(here, phase=periodic_phase(d + _TURN)))
                stiffness += np.asarray(turned.torque - found.torque).item() / _TURN
        for law, stretch in zip(self.slips, self.stretches, strict=True):
            moved = stretch + (d - self.since)
            force += law.torque(moved)
            # At the slip the tangent is that of the way in which it moves.
            sticking = np.abs(law.rates(math.copysign(1.0, rate), moved))
            stiffness += float(law._stiffnesses @ sticking)
        slopes[0], slopes[1] = stiffness * self.row, damping * self.row
        for place, slope, bend in bends:
            slopes[:, place] += stiffness * slope + damping * bend, damping * slope
        return force, 0.0

    def turns(self, before: Values, after: Values, step: float, rtol: float) -> float:
        """Return the share of a step after which slipping springs turn back, 1 for none."""
        first, last = self.motion(before)[1], self.motion(after)[1]
        missed = min(abs(first), abs(last)) * step
        if first * last >= 0.0 or missed <= rtol * min(law.torsion for law in self.slips):
            return 1.0
        return float(min(max(first / (first - last), 0.01), 0.99))

    def settle(self, state: Values) -> None:
        """Keep how far springs are stretched, which up to a turn only the way decides."""
        d = self.motion(state)[0]
        for law, stretch in zip(self.slips, self.stretches, strict=True):
            stretch[:] = np.clip(stretch + (d - self.since), -law._slips, law._slips)
        self.since = d

    def along(self, path: Values) -> Values:
        """Return the force on a path of shape (n, 2, coordinates)."""
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

    def at(self, state: Values, time: float, slopes: Values) -> tuple[float, float]:
        """Return the command and its slope by time; write those by the state into ``slopes``."""
        place = min(int(np.searchsorted(self.time, time, "right")), len(self.rates)) - 1
        reference = self.reference[place] + self.rates[place] * (time - self.time[place])
        wanted = float(self.gain * reference + np.sum(self.slopes * state))
        if abs(wanted) > self.limit:
            slopes[:] = 0.0
            return math.copysign(self.limit, wanted), 0.0
        slopes[:] = self.slopes
        return wanted, float(self.gain * self.rates[place])

    def along(self, path: Values) -> Values:
        """Return the command on a path of shape (n, 2, coordinates)."""
        wanted = self.gain * self.reference + np.sum(self.slopes * path, axis=(1, 2))
        return np.clip(wanted, -self.limit, self.limit)


class _Integrator:
    """Steps of a mechanism, with what those behind say about the next."""

    def __init__(
        self, inertias: Values, forces: Sequence[_PortForce | _Command], rows: Values, rtol: float
    ) -> None:
        n = len(inertias)
        self.curved = [one for one in forces if not one.linear]
        self.memories = [one for one in self.curved if isinstance(one, _PortForce) and one.slips]
        linear, whole = np.zeros((2, n, n)), np.zeros((2, n, n))
        for one in forces:
            slopes = one.slopes[:, None] * (one.column / inertias)[:, None]
            whole += slopes
            linear += one.linear * slopes
        columns = np.reshape([one.column / inertias for one in self.curved], (-1, n)).T
        self.plant = linear, np.ascontiguousarray(columns), np.vstack([np.eye(n), rows])
        companion = np.vstack([np.eye(n, 2 * n, n), np.hstack([whole[0], whole[1]])])
        self.swing = float(np.max(np.abs(np.linalg.eigvals(companion).imag), initial=1e-9))
        self.turning = [row for one in self.curved for row in one.turning]
        self.rtol, self.trial = rtol, math.inf

    def follow(self, time: Values, pushes: Values, begin: Values, bound: float) -> Values:
        """Return the states at times (n,), shape (n, 2, coordinates).

        ``pushes`` are the accelerations by inputs, shape (n, coordinates), and ``bound`` is how
        far positions may go.
        """
        path = np.empty((len(time), *begin.shape))
        path[0] = state = begin
        self.origin = begin * [[1.0], [0.0]]
        self.reach = np.abs((begin - self.origin) @ self.plant[2].T)
        # A scheme whose error goes with the third power of the step takes so many more.
        finer = max(1.0, 1e-6 / self.rtol) ** (1.0 / 3.0)
        samples = len(time) + self.swing * (time[-1] - time[0])
        self.steps_left = int(finer * (_STEPS_ANYWAY + _STEPS_PER_SAMPLE * samples))
        for index, interval in enumerate(np.diff(time).tolist()):
            drift, left = (pushes[index + 1] - pushes[index]) / interval, interval
            while left > 0.0:
                passed = interval - left
                moment, push = float(time[index]) + passed, pushes[index] + passed * drift
                state, step = self.advance(state, moment, left, push, drift)
                left -= step
                if not (np.abs(state[0]) < bound).all():
                    raise ArithmeticError(
                        f"at t = {moment:g} s the positions {state[0]} have left +-{bound:g}"
                    )
            path[index + 1] = state
        return path

    def advance(
        self, state: Values, time: float, left: float, push: Values, drift: Values
    ) -> tuple[Values, float]:
        """Return the state after one accepted step, which ends at the next sample or before."""
        tangent = self.tangent(state, time)
        longest, shortest = min(left, self.longest(state)), _SHORTEST * left
        while True:
            self.steps_left -= 1
            if self.steps_left < 0:
                raise ArithmeticError(f"too many steps by t = {time:g} s: a law jumps or is stiff")
            step = min(self.trial, longest)
            step = left if step > 0.999 * left else step
            moves, exponential = _predict(step, state, push, drift, self.plant, tangent)
            missed = []
            # At the end alone, a motion that turns back within the step would look like none.
            for share, move in zip((0.5, 1.0), moves, strict=True):
                there = self.tangent(state + move, time + share * step)[0]
                missed.append(_correct(step, share, move, exponential, there, self.plant, tangent))
            after = state + moves[1] + missed[1]
            found = [
                _judge(after, one, self.origin, self.plant[2], self.reach, self.rtol)
                for one in missed
            ]
            reach, size = found[1][0], max(found[0][1], found[1][1])
            change = max(0.1, 0.9 * max(size, 6e-3) ** (-1.0 / 3.0))
            share = self.turn(state, after, step) if size <= 1.0 else change
            if share >= 1.0 or step <= shortest:
                break
            self.trial = share * step
        self.trial = max(step * change, self.trial if step < self.trial else 0.0)
        self.reach = reach
        for one in self.memories:
            one.settle(after)
        return after, step

    def tangent(self, state: Values, time: float) -> Triple:
        """Return what is not linear: forces (r,), slopes by state (r, 2, coordinates), by time."""
        slopes = np.empty((len(self.curved), *state.shape))
        found = [one.at(state, time, slopes[place]) for place, one in enumerate(self.curved)]
        forces, rates = np.reshape(found, (-1, 2)).T.copy()
        return forces, slopes, rates

    def longest(self, state: Values) -> float:
        """Return the step in which nothing swings or turns by more than 1 rad unseen."""
        if not self.curved:
            return math.inf
        return 1.0 / max([self.swing, *(abs(float(row @ state[1])) for row in self.turning)])

    def turn(self, before: Values, after: Values, step: float) -> float:
        """Return the share of a step after which the first slipping springs turn back."""
        shares = (one.turns(before, after, step, self.rtol) for one in self.memories)
        return min(shares, default=1.0)


@njit(cache=True)
def _predict(
    step: float, state: Values, push: Values, drift: Values, plant: Triple, tangent: Triple
) -> tuple[tuple[Values, Values], Values]:
    """Return the moves by the tangents to the middle and the end, and the exponential of phi_3.

    In plain loops, which compile in a tenth of the time of array expressions.
    """
    (linear, columns, _), (forces, slopes, rates) = plant, tangent
    n, r = columns.shape
    # The exponential of this block matrix holds phi_1, phi_2 and phi_3 beside that of the first;
    # speeds are in ways per step.
    block, sources = np.zeros((5 * n, 5 * n)), np.zeros((5 * n, 1))
    for i in range(4 * n):
        block[i, i + n] = 1.0
    for i in range(n):
        acceleration, jerk = push[i], drift[i]
        for k in range(r):
            acceleration += columns[i, k] * forces[k]
            jerk += columns[i, k] * rates[k]
        for j in range(n):
            by_position, by_speed = linear[0, i, j], linear[1, i, j]
            acceleration += by_position * state[0, j] + by_speed * state[1, j]
            for k in range(r):
                by_position += columns[i, k] * slopes[k, 0, j]
                by_speed += columns[i, k] * slopes[k, 1, j]
            jerk += by_position * state[1, j]
            block[n + i, j], block[n + i, n + j] = step**2 * by_position, step * by_speed
        sources[2 * n + i, 0], sources[3 * n + i, 0] = step**2 * acceleration, step**3 * jerk
    half, whole = _exponentials(block)
    middle, end = _moved(half, sources, step), _moved(whole, sources, step)
    for j in range(n):
        middle[0, j] += 0.5 * step * state[1, j]
        end[0, j] += step * state[1, j]
    return (middle, end), whole


@njit(cache=True)
def _moved(exponential: Values, sources: Values, step: float) -> Values:
    """Return the change of positions and speeds, (2, coordinates), by sources in ways per step."""
    n = len(sources) // 5
    change, move = _product(exponential, sources), np.empty((2, n))
    for i in range(n):
        move[0, i], move[1, i] = change[i, 0], change[n + i, 0] / step
    return move


@njit(cache=True)
def _correct(
    step: float,
    share: float,
    move: Values,
    exponential: Values,
    there: Values,
    plant: Triple,
    tangent: Triple,
) -> Values:
    """Return what the tangents miss in a step, by the forces after a move of a share of it.

    Forces are taken to depart with the square of time, as they do at first.
    """
    (_, columns, _), (forces, slopes, rates) = plant, tangent
    n, r = columns.shape
    sources = np.zeros((5 * n, 1))
    for k in range(r):
        departed = there[k] - forces[k] - share * step * rates[k]
        for j in range(n):
            departed -= slopes[k, 0, j] * move[0, j] + slopes[k, 1, j] * move[1, j]
        for i in range(n):
            sources[4 * n + i, 0] += 2.0 * (step / share) ** 2 * columns[i, k] * departed
    return _moved(exponential, sources, step)


@njit(cache=True)
def _exponentials(matrix: Values) -> tuple[Values, Values]:
    """Return the exponentials of half a matrix and the whole one, by a series and squaring."""
    norm, halvings, n = 0.0, 1, len(matrix)
    for i in range(n):
        norm = max(norm, np.sum(np.abs(matrix[i])))
    while norm > 2.0**halvings and halvings < 200:
        halvings += 1
    result = np.eye(n)
    for order in range(18, 0, -1):
        result = _product(matrix, result)
        for i in range(n):
            for j in range(n):
                result[i, j] *= 0.5**halvings / order
            result[i, i] += 1.0
    for _ in range(halvings - 1):
        result = _product(result, result)
    return result, _product(result, result)


@njit(cache=True)
def _product(first: Values, second: Values) -> Values:
    """Return the product of matrices that are small, with many zeros."""
    result = np.zeros((len(first), second.shape[1]))
    for i in range(len(first)):
        for k in range(len(second)):
            if first[i, k] != 0.0:
                for j in range(second.shape[1]):
                    result[i, j] += first[i, k] * second[k, j]
    return result


@njit(cache=True)
def _judge(
    after: Values, error: Values, origin: Values, watched: Values, reach: Values, rtol: float
) -> tuple[Values, float]:
    """Return how far and fast all has ever been, (2, rows), and the error over the allowed one."""
    farthest, missed, size = reach.copy(), np.zeros(reach.shape), 0.0
    for kind in range(2):
        largest = np.max(np.abs(after[kind]))
        for row in range(len(watched)):
            moved = 0.0
            for place in range(watched.shape[1]):
                moved += watched[row, place] * (after[kind, place] - origin[kind, place])
                missed[kind, row] += watched[row, place] * error[kind, place]
            farthest[kind, row] = max(farthest[kind, row], abs(moved))
            largest = max(largest, farthest[kind, row])
        for row in range(len(watched)):
            allowed = rtol * farthest[kind, row] + _ROUNDING * largest + 1e-300
            size = max(size, abs(missed[kind, row]) / allowed)
    return farthest, size if np.isfinite(error).all() else np.inf


def _row(mechanism: Mechanism, shares: Mapping[str, float]) -> Values:
    return np.array([float(shares.get(name, 0.0)) for name in mechanism.coordinates])


def _channel(record: Record, name: str) -> Values:
    if name not in record.channels:
        allowed = f"with {name!r}, which the mechanism needs"
        raise InvalidInput(f"channels of record {record.name}", sorted(record.channels), allowed)
    return record.channels[name]


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
