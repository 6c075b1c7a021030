"""Held-out records, simulated in windows by the model before and after a verdict, as a test of it.

With the measured inputs, or with the references where a loop is closed. Each window starts from the
measured positions and the speeds of their smoothed course.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData, measured_data
from pymoo_hdte.discrepancy._evidence.force_balances.unexplained import (
    fitted_values,
    root_mean_square,
)
from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.windows import Reach, Windows, reach_of, windows_of
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import quantity_names
from pymoo_hdte.mechanism.motion import SmoothedMotion, motion_of, smooth
from pymoo_hdte.mechanism.simulation import simulate_mechanism

Values = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Extent:
    """How much of a record was simulated.

    Attributes
    ----------
    length : float
        Of a window, s.
    windows : int
        How many were simulated,
    room : int
        of how many that the record has room for.
    """

    length: float
    windows: int
    room: int


@dataclass(frozen=True, eq=False)
class SimulatedRecord:
    """A held-out record, simulated by the model before and after a verdict.

    Attributes
    ----------
    record : str
    time : ndarray, shape (n,)
        Of all samples that were simulated but those at which a window starts, s.
    measured, before, after : dict of str to ndarray, shape (n,)
        Positions by coordinate, SI; nan where a model diverges.
    noise : dict of str to float
        Of the sensors.
    extent : Extent
    rows : tuple of slice
        Of each window among those of the record, its start included.
    independent : float
        Independent values that a window gives.
    expected : dict of str to float
        Mean square of the error by coordinate to be expected of the model after the verdict, from
        what it leaves of the training records.
    """

    record: str
    time: Values
    measured: dict[str, Values]
    before: dict[str, Values]
    after: dict[str, Values]
    noise: dict[str, float]
    extent: Extent
    rows: tuple[slice, ...]
    independent: float
    expected: dict[str, float]

    def powers(self, name: str) -> tuple[float, float, float]:
        """Return mean squares of a coordinate's errors before and after, and of the change."""
        before, after = (
            float(np.mean((predicted[name] - self.measured[name]) ** 2))
            for predicted in (self.before, self.after)
        )
        return before, after, float(np.mean((self.after[name] - self.before[name]) ** 2))


@dataclass(frozen=True)
class _Model:
    mechanism: Mechanism
    effects: tuple[LawAt, ...]


def simulate_held_out(
    mechanism: Mechanism,
    records: Sequence[Record],
    data: MeasuredData,
    fits: tuple[Fit, Fit],
    known: Sequence[LawAt] = (),
    progress: Progress | None = None,
    whole: bool = False,
) -> tuple[SimulatedRecord, ...]:
    """Simulate the held-out records by two models.

    Parameters
    ----------
    mechanism : Mechanism
    records : sequence of Record
        Of which those of the role ``held_out`` are simulated.
    data : MeasuredData
        Of the training records.
    fits : (Fit, Fit)
        Before and after.
    known : sequence of LawAt
        Effects of both.
    progress : callable, optional
        Is told how many windows have been simulated, and how many there are.
    whole : bool
        Simulate whole records without a break, however long that takes.
    """
    records = [record for record in records if record.role == "held_out"]
    if not records:
        return ()
    models = [
        _Model(fitted_mechanism(mechanism, fitted), (*known, *laws_of(fitted.effects)))
        for fitted in fits
    ]
    corrected, cutoff = models[1], data.spectra[0].cutoff
    duration = max(float(record.time[-1] - record.time[0]) for record in records)
    reach = reach_of(corrected.mechanism, data, fits[1].residuals, corrected.effects, duration)
    rules = replace(data.rules, proof_samples=max(1, data.rules.proof_samples // len(records)))
    windows = [windows_of(record, cutoff, None if whole else reach, rules) for record in records]
    total, done = sum(len(record_windows.rows) for record_windows in windows), 0
    simulated = []
    for record, these in zip(records, windows, strict=True):
        courses = _Courses(record, cutoff, these, models[: 1 if fits[0] is fits[1] else 2])
        for rows in these.rows:
            courses.follow(rows)
            done += 1
            if progress is not None:
                progress(done, total)
        simulated.append(courses.simulated(reach))
    return tuple(simulated)


class _Courses:
    """Simulations of the windows of a record by the models before and after."""

    def __init__(
        self, record: Record, cutoff: float, windows: Windows, models: Sequence[_Model]
    ) -> None:
        self.record, self.windows, self.models = record, windows, models
        self.names = models[0].mechanism.coordinates
        self.motions = {
            name: motion_of(record.channels[name], record.step, cutoff) for name in self.names
        }
        self.begin = windows.rows[0].start
        # Fewer samples than those of the record would take its noise for slow motion.
        smoothed = windows.rows[0].step > 1
        self.signals = {
            name: smooth(channel, record.step, cutoff) if smoothed else channel
            for name, channel in record.channels.items()
        }
        self.parts: list[list[dict[str, Values]]] = [[] for _ in models]

    def follow(self, rows: slice) -> None:
        """Simulate a window by all models."""
        signals = {name: channel[rows] for name, channel in self.signals.items()}
        part = Record(self.record.name, self.record.role, self.record.time[rows], signals)
        fine = part if self.windows.finer == 1 else part.finer(self.windows.finer)
        start = {name: _state(motion, rows.start) for name, motion in self.motions.items()}
        past = slice(self.begin, rows.start + 1)
        history = {name: motion.position[past] for name, motion in self.motions.items()}
        for model, parts in zip(self.models, self.parts, strict=True):
            try:
                course = simulate_mechanism(
                    model.mechanism, fine, model.effects, start=start, history=history
                ).position
                parts.append(
                    {n: positions[:: self.windows.finer][1:] for n, positions in course.items()}
                )
            except ArithmeticError:
                lost = np.full(len(part.time) - 1, np.nan)
                parts.append({name: lost for name in self.names})

    def simulated(self, reach: Reach) -> SimulatedRecord:
        """Return what was simulated."""
        rows = [np.arange(len(self.record.time))[window][1:] for window in self.windows.rows]
        every = np.concatenate(rows)
        before, after = (
            {name: np.concatenate([part[name] for part in parts]) for name in self.names}
            for parts in (self.parts[0], self.parts[-1])
        )
        length = len(rows[0]) * self.windows.rows[0].step * self.record.step
        return SimulatedRecord(
            self.record.name,
            self.record.time[every],
            {name: self.record.channels[name][every] for name in self.names},
            before,
            after,
            {name: self.record.noise_of(name) for name in self.names},
            Extent(length, len(rows), self.windows.count),
            self.windows.rows,
            reach.independent(length),
            dict(zip(self.names, reach.expected(length).tolist(), strict=True)),
        )


def _state(motion: SmoothedMotion, row: int) -> tuple[float, float]:
    return float(motion.position[row]), float(motion.speed[row])


def without_mass(mechanism: Mechanism, data: MeasuredData, fitted: Fit) -> frozenset[str]:
    """Return the coordinates whose motion a simulation cannot judge.

    Their inertial force is smaller than what the model leaves of their balance, so that a simulated
    motion is more of the residual, integrated twice, than of the model.
    """
    values = fitted_mechanism(mechanism, fitted).inertias
    left, names = root_mean_square(data, fitted.residuals), quantity_names(mechanism)
    samples = sum(balance.moving.count for balance in data.spectra)
    found = []
    for place, name in enumerate(mechanism.coordinates):
        row = names.index(f"inertia of {name}")
        power = sum(
            float(np.sum((balance.terms[place, row] * balance.kept[place]) ** 2))
            for balance in data.spectra
        )
        if values[name].value * (power / samples) ** 0.5 < left[place]:
            found.append(name)
    return frozenset(found)


def mechanism_after_held_out_test(
    verdict: Verdict,
    simulated: Sequence[SimulatedRecord],
    balances: Mapping[str, Values] | None = None,
) -> Verdict:
    """Return the verdict, ``unlisted`` where held-out records contradict what it names.

    Simulated, their positions do not come nearer to the measured ones as they should, though the
    change is large enough to be seen in them. Of coordinates that have ``balances``, see
    `held_out_balances`, these are judged instead.
    """
    if verdict.accepted is verdict.base or not simulated:
        return verdict
    return verdict.after_held_out_test(_held_out_test(simulated, balances or {}))


def held_out_balances(
    mechanism: Mechanism,
    records: Sequence[Record],
    data: MeasuredData,
    fits: tuple[Fit, Fit],
    names: Collection[str],
) -> dict[str, Values]:
    """Return the sums of squares of held-out force balances by coordinate, shape (3,).

    Before and after, and of the change, in units of what the model after leaves of the training
    records.

    Parameters
    ----------
    mechanism, records, data, fits
        As of `simulate_held_out`.
    names : collection of str
        Coordinates that are judged.
    """
    found = {name: np.zeros(3) for name in names}
    left = root_mean_square(data, fits[1].residuals)
    for record in (record for record in records if record.role == "held_out" and names):
        held_out = measured_data(mechanism, [record], data.spectra[0].cutoff, data.known)
        if held_out.says_nothing_of(laws_of(fits[1].effects)):
            continue
        floor = root_mean_square(held_out, np.ones(len(held_out.frequency)))
        before, after = (
            held_out.residuals(one.values[: len(held_out.base)], laws_of(one.effects))
            for one in fits
        )
        powers = [root_mean_square(held_out, one) ** 2 for one in (before, after, after - before)]
        counts = [len(rows) for rows in held_out.rows_of_parts()]
        for name in names:
            place = held_out.names.index(name)
            expected = max(left[place], floor[place]) ** 2
            found[name] += counts[place] * np.array([one[place] for one in powers]) / expected
    return found


def _held_out_test(
    simulated: Sequence[SimulatedRecord], balances: Mapping[str, Values] = MappingProxyType({})
) -> HeldOutTest:
    """Return the held-out test of simulated positions, and of balances in their place.

    In units of what was to be expected.
    A window of a free coordinate gives one independent value, since its error builds up.
    """
    sums = np.sum([np.zeros(3), *balances.values()], axis=0)
    for record in simulated:
        for name, expected in record.expected.items():
            if name in balances:
                continue
            powers = np.array(record.powers(name))
            diverges = ~np.isfinite(powers[:2])
            if diverges.any():
                # Where both diverge, nothing is said.
                after, change = np.inf if diverges[1] else 0.0, 0.0 if diverges.all() else np.inf
                return HeldOutTest(1.0, after, change)
            values = record.extent.windows * record.independent
            sums += values * powers / (expected + record.noise[name] ** 2)
    return HeldOutTest(*sums.tolist())


def fitted_mechanism(mechanism: Mechanism, fitted: Fit) -> Mechanism:
    """Return a mechanism with the values of a fit."""
    return mechanism.with_values(fitted_values(mechanism, fitted), exactly=False)


def laws_of(effects: Sequence[Any]) -> tuple[LawAt, ...]:
    """Return the effects of a fit, which are laws at ports in a mechanism."""
    return tuple(effects)
