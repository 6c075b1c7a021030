"""Steps of an exponential integrator for mechanisms: exact for linear parts, however stiff.

Steps are those of exprb32 (Hochbruck, Ostermann, Schweitzer, SIAM J. Numer. Anal. 47, 2009): of
third order in the deviation of laws from their tangents. The difference to the second order is the
estimate of their error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled
from pymoo_hdte.mechanism.acting_forces import Command, PortForce

Values = NDArray[np.float64]
Triple = tuple[Values, Values, Values]

_STEPS_ANYWAY, _STEPS_PER_SAMPLE = 20_000, 50
_SHORTEST = 1e-9
"""Share of the time to the next sample below which a step is accepted whatever its error."""
_ROUNDING = 1e-14


class ExponentialIntegrator:
    """Steps of a mechanism, with the size of the next predicted from previous ones."""

    def __init__(
        self, inertias: Values, forces: Sequence[PortForce | Command], rows: Values, rtol: float
    ) -> None:
        n = len(inertias)
        self.curved = [force for force in forces if not force.linear]
        self.memories = [cast(PortForce, force) for force in self.curved if force.memories]
        linear, whole = np.zeros((2, n, n)), np.zeros((2, n, n))
        for force in forces:
            slopes = force.slopes[:, None] * (force.column / inertias)[:, None]
            whole += slopes
            linear += force.linear * slopes
        columns = np.reshape([force.column / inertias for force in self.curved], (-1, n)).T
        self.plant = linear, np.ascontiguousarray(columns), np.vstack([np.eye(n), rows])
        companion = np.vstack([np.eye(n, 2 * n, n), np.hstack([whole[0], whole[1]])])
        self.swing = float(np.max(np.abs(np.linalg.eigvals(companion).imag), initial=1e-9))
        self.turning = [row for force in self.curved for row in force.turning]
        self.rtol, self.trial = rtol, math.inf

    def follow(self, time: Values, pushes: Values, begin: Values, bound: float) -> Values:
        """Return the states at times (n,), shape (n, 2, coordinates).

        ``pushes`` are the accelerations by inputs, shape (n, coordinates), and ``bound`` limits the
        positions.
        """
        path = np.empty((len(time), *begin.shape))
        path[0] = state = begin
        self.origin = begin * [[1.0], [0.0]]
        self.reach = np.abs((begin - self.origin) @ self.plant[2].T)
        # Number of steps of a scheme whose error is proportional to the third power of the step.
        finer = max(1.0, 1e-6 / self.rtol) ** (1.0 / 3.0)
        samples = len(time) + self.swing * (time[-1] - time[0])
        self.steps_left = int(finer * (_STEPS_ANYWAY + _STEPS_PER_SAMPLE * samples))
        for index, interval in enumerate(np.diff(time).tolist()):
            drift, remaining = (pushes[index + 1] - pushes[index]) / interval, interval
            while remaining > 0.0:
                passed = interval - remaining
                moment, push = float(time[index]) + passed, pushes[index] + passed * drift
                state, step = self.advance(state, moment, remaining, push, drift)
                remaining -= step
                if not (np.abs(state[0]) < bound).all():
                    raise ArithmeticError(
                        f"at t = {moment:g} s the positions {state[0]} have left +-{bound:g}"
                    )
            path[index + 1] = state
        return path

    def advance(
        self, state: Values, time: float, remaining: float, push: Values, drift: Values
    ) -> tuple[Values, float]:
        """Return the state after one accepted step, which ends at the next sample or before."""
        tangent = self.tangent(state, time)
        longest, shortest = min(remaining, self.longest(state)), _SHORTEST * remaining
        while True:
            self.steps_left -= 1
            if self.steps_left < 0:
                raise ArithmeticError(f"too many steps by t = {time:g} s: a law jumps or is stiff")
            step = min(self.trial, longest)
            step = remaining if step > 0.999 * remaining else step
            moves, exponential = _predict(step, state, push, drift, self.plant, tangent)
            missed = []
            # Checked at the end alone, a motion that reverses within the step would look like rest.
            for share, move in zip((0.5, 1.0), moves, strict=True):
                there = self.tangent(state + move, time + share * step)[0]
                missed.append(_correct(step, share, move, exponential, there, self.plant, tangent))
            after = state + moves[1] + missed[1]
            judgements = [
                _judge(after, error, self.origin, self.plant[2], self.reach, self.rtol)
                for error in missed
            ]
            reach, size = judgements[1][0], max(judgements[0][1], judgements[1][1])
            change = max(0.1, 0.9 * max(size, 6e-3) ** (-1.0 / 3.0))
            share = self.turn(state, after, step) if size <= 1.0 else change
            if share >= 1.0 or step <= shortest:
                break
            self.trial = share * step
        self.trial = max(step * change, self.trial if step < self.trial else 0.0)
        self.reach = reach
        for force in self.memories:
            force.settle(after)
        return after, step

    def tangent(self, state: Values, time: float) -> Triple:
        """Return the nonlinear parts: forces (r,), slopes by state (r, 2, coordinates), by time."""
        count = len(self.curved)
        forces, slopes, rates = np.empty(count), np.empty((count, *state.shape)), np.empty(count)
        for place, force in enumerate(self.curved):
            forces[place], rates[place] = force.at(state, time, slopes[place])
        return forces, slopes, rates

    def longest(self, state: Values) -> float:
        """Return the step in which no vibration or periodic law advances by more than 1 rad."""
        if not self.curved:
            return math.inf
        return 1.0 / max([self.swing, *(abs(float(row @ state[1])) for row in self.turning)])

    def turn(self, before: Values, after: Values, step: float) -> float:
        """Return the share of a step after which the first slipping springs reverse."""
        shares = (force.turns(before, after, step, self.rtol) for force in self.memories)
        return min(shares, default=1.0)


@compiled
def _predict(
    step: float, state: Values, push: Values, drift: Values, plant: Triple, tangent: Triple
) -> tuple[tuple[Values, Values], Values]:
    """Return the moves by the tangents to the middle and the end, and the exponential of phi_3.

    In plain loops, which compile in a tenth of the time of array expressions.
    """
    (linear, columns, _), (forces, slopes, rates) = plant, tangent
    n, r = columns.shape
    # The exponential of this block matrix contains phi_1, phi_2 and phi_3 beside that of the first;
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


@compiled
def _moved(exponential: Values, sources: Values, step: float) -> Values:
    """Return the change of positions and speeds, (2, coordinates), by sources in ways per step."""
    n = len(sources) // 5
    change, move = _product(exponential, sources), np.empty((2, n))
    for i in range(n):
        move[0, i], move[1, i] = change[i, 0], change[n + i, 0] / step
    return move


@compiled
def _correct(
    step: float,
    share: float,
    move: Values,
    exponential: Values,
    there: Values,
    plant: Triple,
    tangent: Triple,
) -> Values:
    """Return the error of the tangents in a step, from the forces after a share of the step.

    The deviation of forces is assumed to grow with the square of time, as it does initially.
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


@compiled
def _exponentials(matrix: Values) -> tuple[Values, Values]:
    """Return the exponentials of half a matrix and the whole one, by a series and squaring."""
    norm, halvings, n = 0.0, 1, len(matrix)
    result = np.zeros((n, n))
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(matrix[i, j])
        norm = max(norm, row)
        result[i, i] = 1.0
    while norm > 2.0**halvings and halvings < 200:
        halvings += 1
    for order in range(18, 0, -1):
        result = _product(matrix, result)
        for i in range(n):
            for j in range(n):
                result[i, j] *= 0.5**halvings / order
            result[i, i] += 1.0
    for _ in range(halvings - 1):
        result = _product(result, result)
    return result, _product(result, result)


@compiled
def _product(first: Values, second: Values) -> Values:
    """Return the product of small matrices with many zeros."""
    result = np.zeros((len(first), second.shape[1]))
    for i in range(len(first)):
        for k in range(len(second)):
            if first[i, k] != 0.0:
                for j in range(second.shape[1]):
                    result[i, j] += first[i, k] * second[k, j]
    return result


@compiled
def _judge(
    after: Values, error: Values, origin: Values, watched: Values, reach: Values, rtol: float
) -> tuple[Values, float]:
    """Return the largest positions and speeds so far, (2, rows), and the relative error."""
    farthest, missed, size, finite = np.empty(reach.shape), np.zeros(reach.shape), 0.0, True
    for kind in range(2):
        largest = 0.0
        for place in range(watched.shape[1]):
            largest = max(largest, abs(after[kind, place]))
            finite = finite and math.isfinite(error[kind, place])
        for row in range(len(watched)):
            moved = 0.0
            for place in range(watched.shape[1]):
                moved += watched[row, place] * (after[kind, place] - origin[kind, place])
                missed[kind, row] += watched[row, place] * error[kind, place]
            farthest[kind, row] = max(reach[kind, row], abs(moved))
            largest = max(largest, farthest[kind, row])
        for row in range(len(watched)):
            allowed = rtol * farthest[kind, row] + _ROUNDING * largest + 1e-300
            size = max(size, abs(missed[kind, row]) / allowed)
    return farthest, size if finite else math.inf
