"""Windows of held-out records: each is simulated from the measured state (multiple shooting).

In an open loop an error of the force moves a free coordinate further and further away, so that a
long simulation shows chance and not the model. Its windows end where the forces that the model does
not explain would have moved it by a stated share of its travel, and there are enough of them for a
mean. Where springs or loops let the start be forgotten, a window has a stated number of decay
times: a longer one would show no more. Bock's multiple shooting (Ebert, Deuflhard, Jaeger, eds.,
Modelling of Chemical Reaction Systems, Springer 1981).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.acting_forces import coordinate_row
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.motion import margin_of
from pymoo_hdte.mechanism.port_motion import law_force
from pymoo_hdte.mechanism.records import FEWEST_SAMPLES

Values = NDArray[np.float64]

_SAMPLES = 20
"""Samples of a simulation in a period of the cutoff: straight lines between them are off by 1 %."""
_STARTS = 64
"""Moments from which errors are followed,"""
_FEWEST_STARTS = 16
"""as long as so many have not reached the end of the record."""


@dataclass(frozen=True, eq=False)
class Reach:
    """How far a simulation carries.

    Attributes
    ----------
    drift : float
        Time after which unexplained forces have moved a coordinate, s; infinite if they never do.
    memory : float
        Decay time of the slowest mode, s; infinite for a free coordinate.
    step : float
        Of the following, s.
    errors : ndarray, shape (n, coordinates)
        Mean squares of what unexplained forces add to positions in that time from the start.
    """

    drift: float
    memory: float
    step: float
    errors: Values

    def remembers_start(self, duration: float, rules: Rules) -> bool:
        """Tell whether the start is remembered for most of a record of a duration in s."""
        return self.memory > duration / rules.fewest_windows

    def length(self, duration: float, rules: Rules) -> float:
        """Return the length in s of the windows of a record of a duration in s."""
        if self.remembers_start(duration, rules):
            return min(self.drift, duration / rules.fewest_windows)
        return min(rules.window_decays * self.memory, duration)

    def expected(self, window: float) -> Values:
        """Return the mean squares that a window of that length in s should have, (coordinates,)."""
        samples = max(1, round(window / self.step))
        return np.asarray(self.errors[:samples].mean(axis=0))

    def independent(self, window: float) -> float:
        """Return how many independent values a window of that length in s gives, at least 1."""
        return max(1.0, window / self.memory)


@dataclass(frozen=True)
class Windows:
    """Windows of a record.

    Attributes
    ----------
    rows : tuple of slice
        Of each window, its start and its end among them.
    count : int
        Of windows that the record has room for, of which ``rows`` are evenly spread ones.
    finer : int
        Samples of the simulation for one of ``rows``.
    """

    rows: tuple[slice, ...]
    count: int
    finer: int


def reach_of(
    mechanism: Mechanism,
    data: MeasuredData,
    residuals: Values,
    effects: Sequence[LawAt],
    duration: float,
) -> Reach:
    """Return how far a fitted mechanism can be simulated: the least of the training records.

    Parameters
    ----------
    mechanism : Mechanism
        With the fitted values.
    data : MeasuredData
        Of the training records.
    residuals : ndarray, shape (n,)
        Whitened, what the model leaves of them.
    effects : sequence of LawAt
        Of the model: their forces count by the straight lines that fit them best.
    duration : float
        Of the longest record that is to be simulated, s.
    """
    reaches = []
    for balance, unexplained in zip(data.spectra, data.coefficients(residuals), strict=True):
        forces = np.array(
            [
                balance.in_time(coefficients)
                for coefficients in unexplained[: len(mechanism.coordinates)]
            ]
        )
        memory = _memory(_linearised(mechanism, balance, ()))
        matrix = _linearised(mechanism, balance, effects)
        step = float(balance.time[1] - balance.time[0])
        longest = Reach(np.inf, memory, step, np.ones((1, 1))).length(duration, data.rules)
        errors = _errors(_inertias(mechanism), matrix, forces, step, int(longest / step))
        allowed = [balance.motions[name].position.std() for name in mechanism.coordinates]
        beyond = np.any(errors > (data.rules.window_drift * np.array(allowed)) ** 2, axis=1)
        drift = step * float(np.argmax(beyond)) if beyond.any() else np.inf
        reaches.append(Reach(drift, memory, step, errors))
    return min(reaches, key=lambda reach: reach.drift)


def windows_of(record: Record, cutoff: float, reach: Reach | None, rules: Rules) -> Windows:
    """Return the windows of a record, or all of it as one without a ``reach``.

    Parameters
    ----------
    record : Record
    cutoff : float
        Hz, up to which the motion is known.
    reach : Reach or None
    rules : Rules
        How many windows at least, and how many samples at most.
    """
    share = _SAMPLES * cutoff * record.step
    finer, stride = (int(np.ceil(share - 1e-9)), 1) if share > 1.0 else (1, int(1.0 / share))
    # Where smoothing has one side only, the state at the start of a window is not known.
    before, after = record.context
    begin = max(min(margin_of(cutoff, record.step), len(record.time) // 4), before)
    room = (len(record.time) - 1 - after - begin) // stride
    if reach is None:
        return Windows((slice(begin, begin + room * stride + 1, stride),), 1, finer)
    step = stride * record.step
    # Of at least a period of the cutoff, in which the samples of the simulation are as many.
    fewest = max(_SAMPLES // finer, FEWEST_SAMPLES)
    most = max(rules.proof_samples // finer, fewest)
    steps, longest = int(reach.length(room * step, rules) / step), most
    if reach.remembers_start(room * step, rules):
        longest = most // rules.fewest_windows
    steps = min(max(min(steps, longest), fewest), room)
    count = room // steps
    chosen = np.linspace(0, count - 1, min(count, max(1, most // steps)))
    starts = begin + np.unique(np.round(chosen).astype(int)) * steps * stride
    rows = tuple(slice(start, start + steps * stride + 1, stride) for start in starts.tolist())
    return Windows(rows, count, finer)


def _linearised(mechanism: Mechanism, balance: ForceBalance, effects: Sequence[LawAt]) -> Values:
    """Return the rates of positions and speeds by themselves, shape (2 n, 2 n).

    Loops act where the record has their references.
    """
    n = len(mechanism.coordinates)
    by_position, by_speed = np.zeros((2, n, n))
    for port in mechanism.ports:
        if port.read:
            continue
        row, motion = coordinate_row(mechanism, port.motion), balance.ports[port.name]
        stiffness, damping = port.stiffness.value, port.damping.value
        laws = [effect.law for effect in effects if effect.port == port.name]
        if laws:
            force = np.sum([law_force(law, motion, stiffness) for law in laws], axis=0)
            columns = np.column_stack(
                [motion.position - motion.position.mean(), motion.speed, np.ones(len(force))]
            )
            spring, damper, _ = np.linalg.lstsq(columns, force, rcond=None)[0]
            stiffness, damping = stiffness + spring, damping + damper
        by_position -= stiffness * np.outer(row, row)
        by_speed -= damping * np.outer(row, row)
    for loop in mechanism.loops:
        if loop.reference in balance.record.channels:
            driven = next(driver for driver in mechanism.inputs if driver.name == loop.input)
            acts = driven.gain.value * coordinate_row(mechanism, driven.acts)
            seen = coordinate_row(mechanism, {loop.coordinate: 1.0})
            by_position -= loop.position_gain * np.outer(acts, seen)
            by_speed -= loop.speed_gain * np.outer(acts, seen)
    inertias = _inertias(mechanism)[:, None]
    lower = np.hstack([by_position / inertias, by_speed / inertias])
    return np.vstack([np.eye(n, 2 * n, n), lower])


def _inertias(mechanism: Mechanism) -> Values:
    return np.array([inertia.value for inertia in mechanism.inertias.values()])


def _memory(matrix: Values) -> float:
    """Return the decay time of the slowest mode, infinite if one does not decay."""
    slowest, fastest = np.sort(np.linalg.eigvals(matrix).real)[[-1, 0]]
    # A free coordinate has a rate of zero, but for rounding.
    return float(-1.0 / slowest) if slowest < -1e-9 * abs(fastest) else np.inf


def _errors(inertias: Values, matrix: Values, forces: Values, step: float, longest: int) -> Values:
    """Return mean squares of the positions to which forces (n, samples) move a mechanism at rest.

    Shape (k, n), after one, two ... ``longest`` steps from moments all over the record.
    """
    n, samples = forces.shape
    block = np.zeros((3 * n, 3 * n))
    block[: 2 * n, : 2 * n] = matrix
    block[n : 2 * n, 2 * n :] = np.diag(1.0 / inertias)
    transition = expm(step * block)[: 2 * n]
    by_state, by_force = transition[:, : 2 * n], transition[:, 2 * n :]
    starts = np.unique(np.linspace(0, max(samples - 2, 0), _STARTS).astype(int))
    state, errors = np.zeros((2 * n, len(starts))), list[Values]()
    for passed in range(min(max(longest, 1), samples - 1)):
        inside = starts + passed < samples
        if errors and np.count_nonzero(inside) < _FEWEST_STARTS:
            break
        starts, state = starts[inside], state[:, inside]
        state = by_state @ state + by_force @ forces[:, starts + passed]
        errors.append(np.mean(state[:n] ** 2, axis=1))
    return np.array(errors)
