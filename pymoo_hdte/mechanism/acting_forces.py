"""Forces in a simulated mechanism: those at ports, and the commands of loops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.effects.law import Law, Memory, PortState, periodic_phase
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.parts import Loop, Port
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force, load_at_port
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]

_TURN = 1e-7
_SOON = 1e-6
"""Step of a difference quotient by time, s."""


class PortForce:
    """The force at a port. States are positions and speeds, shape (2, coordinates).

    ``passed`` are those from rest up to the start, shape (k, 2, coordinates).
    """

    def __init__(
        self,
        port: Port,
        laws: Sequence[Law],
        mechanism: Mechanism,
        passed: Values,
        record: Record,
    ) -> None:
        self.port, self.time = port, record.time
        channels = {name: record.channel(name) for name in port.load}
        loaded = any(law.loaded for law in laws)
        self.load = load_at_port(port, mechanism.inputs, channels) if loaded else None
        self.row = coordinate_row(mechanism, port.motion)
        self.column = -self.row
        self.spring = (port.stiffness.value, port.damping.value)
        self.slopes = np.outer(self.spring, self.row)
        self.linear = not (laws or port.error)
        self.lines = [
            (mechanism.coordinates.index(error_line.coordinate), error_line)
            for error_line in port.error
        ]
        self.turning = [line.order * np.eye(len(self.row))[place] for place, line in self.lines]
        self.turning += [order * self.row for law in laws for order in law.orders]
        self.laws = [law for law in laws if not law.states]
        self.memories = [cast(Memory, law) for law in laws if law.states]
        self.memory_states = [np.zeros(law.states) for law in self.memories]
        # Inner states depend on the way between reversals only.
        way = self.motion(passed)[0]
        turns = np.flatnonzero(np.diff(np.sign(np.diff(way)))) + 1
        self.since = way[0]
        for d in (*way[turns], way[-1]):
            self._pass(d)

    def motion(self, states: Values) -> tuple[Any, Any, list[tuple[int, Any, Any]]]:
        """Return d, d' and, for each error line, its coordinate and the slopes of d and d' over it.

        States have shape (..., 2, coordinates).
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
        grows = 0.0
        if self.load is not None:
            load, growth = self._load_at(time)
            here = replace(here, load=load)
        for law in self.laws:
            response = law.respond(here)
            if law.loaded and self.load is not None:
                later = law.respond(replace(here, load=load + _SOON * growth)).torque
                grows += np.asarray(later - response.torque).item() / _SOON
            force += np.asarray(response.torque).item()
            stiffness += np.asarray(response.slope).item()
            damping += np.asarray(response.damping).item()
            if law.orders:
                # A law's slope is at constant phase, which varies with the position here.
                turned = law.respond(replace(here, phase=periodic_phase(d + _TURN)))
                stiffness += np.asarray(turned.torque - response.torque).item() / _TURN
        for law, states in zip(self.memories, self.memory_states, strict=True):
            moved = states + (d - self.since)
            force += law.torque(moved)
            stiffness += law.tangent(moved, math.copysign(1.0, rate))
        slopes[0], slopes[1] = stiffness * self.row, damping * self.row
        for place, slope, bend in bends:
            slopes[:, place] += stiffness * slope + damping * bend, damping * slope
        return force, grows

    def _load_at(self, time: float) -> tuple[Values, Values]:
        """Return the load that the port passes on, a straight line between samples, and its slope.

        Each has shape (1,).
        """
        assert self.load is not None
        place = min(max(int(np.searchsorted(self.time, time, "right")), 1), len(self.time) - 1)
        before, after = self.time[place - 1 : place + 1]
        low, high = self.load[place - 1 : place + 1]
        slope = (high - low) / (after - before)
        return np.array([low + slope * (time - before)]), np.array([slope])

    def turns(self, before: Values, after: Values, step: float, rtol: float) -> float:
        """Return the share of a step after which laws with memory reverse, 1 for none."""
        rate_before, rate_after = self.motion(before)[1], self.motion(after)[1]
        missed = min(abs(rate_before), abs(rate_after)) * step
        if rate_before * rate_after >= 0.0 or missed <= rtol * min(
            law.shortest for law in self.memories
        ):
            return 1.0
        return float(min(max(rate_before / (rate_before - rate_after), 0.01), 0.99))

    def settle(self, state: Values) -> None:
        """Store the inner states of laws; up to a reversal they depend on the way only."""
        self._pass(self.motion(state)[0])

    def _pass(self, d: Values) -> None:
        for law, states in zip(self.memories, self.memory_states, strict=True):
            states[:] = law.moved(states, d - self.since)
        self.since = d

    def along(self, path: Values) -> Values:
        """Return the force on a path of shape (n, 2, coordinates)."""
        d, rate, _ = self.motion(path)
        stiffness, damping = self.spring
        laws = [
            law_force(law, PortMotion(d, rate, self.load), stiffness)
            for law in (*self.laws, *self.memories)
        ]
        return np.asarray(stiffness * d + damping * rate + sum(laws))


class Command:
    """The command of a loop."""

    linear = False
    memories: tuple[Memory, ...] = ()
    turning: tuple[Values, ...] = ()

    def __init__(self, loop: Loop, mechanism: Mechanism, record: Record) -> None:
        self.limit, self.gain, self.time = loop.limit, loop.position_gain, record.time
        self.reference = record.channel(loop.reference)
        self.rates = np.diff(self.reference) / np.diff(self.time)
        gains = (-loop.position_gain, -loop.speed_gain)
        self.slopes = np.outer(gains, coordinate_row(mechanism, {loop.coordinate: 1.0}))
        driven = next(driver for driver in mechanism.inputs if driver.name == loop.input)
        self.column = driven.gain.value * coordinate_row(mechanism, driven.acts)

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


def coordinate_row(mechanism: Mechanism, shares: Mapping[str, float]) -> Values:
    """Return shares of coordinates as a row over all coordinates, shape (coordinates,)."""
    return np.array([float(shares.get(name, 0.0)) for name in mechanism.coordinates])
