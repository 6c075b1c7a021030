"""One record without its faulty rows, and a list of what was wrong with it.

Spikes and repeated rows are left out: the order lines are fitted over the measured angle and do not
need evenly spaced rows. A jump of a sensor is taken out of the rows after it and fitted again with
the lines (`records.Jump`). Where both encoders jump alike, rows are missing: the drive has moved
on, and the time is corrected.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, median_filter

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.cleaning.drift import torque_drifts
from pymoo_hdte.discrepancy._records.cleaning.findings import FAILED, RowFault
from pymoo_hdte.discrepancy._records.cleaning.settling import settling, unsettled_rows
from pymoo_hdte.discrepancy._records.cleaning.spikes_and_jumps import (
    WINDOWS,
    Step,
    UnitSteps,
    spikes,
    spikes_on_course,
    step,
)
from pymoo_hdte.discrepancy._records.line_basis import LineFit, spans_a_turn
from pymoo_hdte.discrepancy._records.records import (
    FEWEST_SAMPLES,
    Jump,
    RunningRecord,
    TorsionRecord,
)
from pymoo_hdte.discrepancy._selection.rules import Rules

Rows = NDArray[np.float64]
Record = TypeVar("Record", RunningRecord, TorsionRecord)

Spikes = tuple[str, NDArray[np.bool_], Rows]
"""Name of a channel, which rows are spikes in it, and how far every row departs."""


class RowSearch(Generic[Record]):
    """A record whose faulty rows are taken out one after the other.

    Attributes
    ----------
    record : RunningRecord or TorsionRecord
        Without the faults removed so far.
    channels : tuple of str
        Its columns beside the time.
    deviations : float
        Least size of a fault, in standard deviations.
    rules : Rules
    rows : ndarray of int, shape (n,)
        Number of each row in the file.
    faults : list of RowFault
    """

    def __init__(
        self, record: Record, channels: tuple[str, ...], deviations: float, rules: Rules
    ) -> None:
        self.record: Record = record
        self.channels, self.deviations, self.rules = channels, deviations, rules
        self.rows = np.arange(len(record.time))
        self.faults: list[RowFault] = []

    def take_repeated(self) -> None:
        """Leave out rows that are equal in all channels to the one before."""
        table = np.column_stack([getattr(self.record, channel) for channel in self.channels])
        again = np.r_[False, np.all(table[1:] == table[:-1], axis=1)]
        if again.any() and np.count_nonzero(~again) >= FEWEST_SAMPLES:
            for start, end in _runs(again):
                length = float(self.record.time[end] - self.record.time[start - 1])
                self.note("repeated", "rows", start, end - start + 1, length, "left out")
            self._keep_rows(~again)

    def take_stuck(self) -> bool:
        """Leave out rows in which a channel is saturated, or stays the same for far too long.

        None is left out if too few would remain. Returns whether enough remain.
        """
        every, saturated = np.zeros(len(self.rows), dtype=bool), 0
        for channel in self.channels:
            values = getattr(self.record, channel)
            for reading in (float(values.max()), float(values.min())):
                flags = self._saturated(values, reading)
                if flags.any():
                    start, rows = int(np.argmax(flags)), int(np.count_nonzero(flags))
                    self.note("saturated", channel, start, rows, reading, "left out")
                    saturated += rows
                every |= flags
            stuck = self._stuck(values) & ~every
            for start, end in _runs(stuck):
                value = float(values[start])
                self.note("stuck", channel, start, end - start + 1, value, "left out")
            every |= stuck
        enough = bool(np.count_nonzero(~every) >= FEWEST_SAMPLES)
        enough &= saturated <= self.rules.saturated_share * len(every)
        if every.any() and enough:
            self._keep_rows(~every)
        return enough

    def _saturated(self, values: Rows, reading: float) -> NDArray[np.bool_]:
        """Return which rows are at the end of a channel's range, if far more are than next to it.

        The rows beside them are included, because the noise decides which of those reach the end. A
        single run is no saturation but a channel that is stuck.
        """
        rules, at_end = self.rules, values == reading
        inside = values[~at_end]
        next_to_it = inside[np.argmin(np.abs(inside - reading))]
        number, others = np.count_nonzero(at_end), np.count_nonzero(inside == next_to_it)
        lively = len(np.unique(inside)) >= rules.stuck_rows
        frequent = number >= rules.stuck_rows and number >= rules.stuck_ratio * others
        if not (lively and frequent and len(_runs(at_end)) > 1):
            return np.zeros_like(at_end)
        return np.asarray(binary_dilation(at_end, iterations=rules.longest_spike))

    def _stuck(self, values: Rows) -> NDArray[np.bool_]:
        """Return the rows in which a channel keeps one reading for too long."""
        rules, changes = self.rules, np.r_[True, values[1:] != values[:-1]]
        lengths = np.diff(np.r_[np.flatnonzero(changes), len(values)])
        # A rest that the record cuts off counts as a whole one only if it is long.
        whole = np.ones(len(lengths), dtype=bool)
        whole[[0, -1]] = lengths[[0, -1]] >= rules.stuck_rows
        ranked = np.sort(lengths[whole])[::-1][: rules.most_jumps + 1]
        longest, others = ranked[:-1], ranked[1:]
        outstanding = longest[
            (longest >= rules.stuck_ratio * others) & (longest >= rules.stuck_rows)
        ]
        stuck = np.repeat(lengths >= min(outstanding, default=np.inf), lengths)
        remaining = changes[~stuck]
        fine = len(remaining) >= rules.stuck_rows and remaining.mean() >= rules.changing_share
        return stuck if fine else np.zeros_like(stuck)

    def note_gaps(self) -> None:
        """Note where the time runs on without rows."""
        steps = np.diff(self.record.time) * self.record.sample_rate
        for place in np.flatnonzero(steps > self.rules.gap_of_rows):
            lost = round(float(steps[place])) - 1 - int(np.diff(self.rows)[place] - 1)
            if lost > 0:
                length = lost / self.record.sample_rate
                self.note("gap", "rows", int(place) + 1, lost, length, "none needed")

    def take_spikes(self, channels: Sequence[Spikes]) -> None:
        """Leave out the rows of spikes: name of the channel, rows, and how far they depart."""
        for channel, flags, departures in channels:
            for start, end in _runs(flags):
                run = departures[start : end + 1]
                size = float(run[np.argmax(np.abs(run))])
                self.note("spike", channel, start, end - start + 1, size, "left out")
        self._keep_rows(~np.any([flags for _, flags, _ in channels], axis=0))

    def note(
        self, kind: str, channel: str, place: int, rows: int, size: float, treatment: str
    ) -> None:
        """Note a fault from a place in the remaining rows on."""
        row = int(self.rows[place])
        self.faults.append(RowFault(self.record.name, kind, channel, row, rows, size, treatment))

    def _keep_rows(self, flags: NDArray[np.bool_]) -> None:
        columns = {name: getattr(self.record, name)[flags] for name in ("time", *self.channels)}
        self.record = replace(self.record, **columns)
        self.rows = self.rows[flags]


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and the last place of every run of flags."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False]))
    return list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))


RUNNING = ("input_angle", "output_angle", "input_torque", "output_torque")
SWEPT = ("output_angle", "output_torque")

ChannelStep = tuple[Step, str, float]
"""A jump in the residual of the lines, the channel of the record that jumps, and by how much."""

_ROUNDS = 20
"""Most rounds of a search, each of which removes what hides smaller faults."""

_SMOOTHED = 11
"""Rows of the running median from which the size of a spike is measured."""


@dataclass(frozen=True, eq=False)
class RepairedRun:
    """A running record without its faults.

    Attributes
    ----------
    record : RunningRecord
    faults : tuple of RowFault
    residual : ndarray, shape (n, 4), or None
        Residual of the order lines, by channel as in `LineFit`; None where they cannot be fitted.
    usable : bool
        False if several channels jump at once, since then the test has changed and not a sensor;
        also if too few rows remain in which no channel has failed.
    drifts : ndarray, shape (2,), or None
        Result of `torque_drifts`; None where the lines cannot be fitted.
    """

    record: RunningRecord
    faults: tuple[RowFault, ...]
    residual: Rows | None
    usable: bool
    drifts: Rows | None = None


def repaired_run(
    record: RunningRecord,
    ratio: float,
    orders: Sequence[float],
    deviations: float,
    rules: Rules,
    ends: Collection[tuple[str, float]] = (),
) -> RepairedRun:
    """Return a running record without spikes, jumps, failed or repeated rows, and settling.

    Parameters
    ----------
    record : RunningRecord
    ratio : float
        Transmission ratio N, dimensionless.
    orders : sequence of float
        Lines that are fitted first, cycles per input turn.
    deviations : float
        Least size of a fault, in standard deviations.
    rules : Rules
    ends : collection of (str, float), optional
        Channels and readings at which their sensors saturate in other records.
    """
    search = _RunSearch(record, ratio, deviations, rules)
    search.take_repeated()
    enough = search.take_stuck()
    failed = tuple(fault for fault in search.faults if fault.kind in FAILED)
    if failed and not (enough and spans_a_turn(search.record, ratio)):
        return RepairedRun(record, tuple(search.faults), None, False)
    search.note_gaps()
    try:
        if not search.take_near_ends(orders, ends):
            return RepairedRun(record, tuple(search.faults), None, False)
        residual = search.run(orders)
    except InvalidInput:
        # A record that cannot tell these lines apart is refused where its lines are measured,
        # unless only the rows lost to a failed channel keep it from that.
        return RepairedRun(record, failed, None, not failed)
    drifts = torque_drifts(search.fitted(orders), residual, deviations, rules)
    return RepairedRun(search.record, tuple(search.faults), residual, search.usable, drifts)


def repaired_sweep(
    record: TorsionRecord, deviations: float, rules: Rules
) -> tuple[TorsionRecord, tuple[RowFault, ...]]:
    """Return a torsion sweep without spikes and repeated rows, and what was wrong with it.

    Its jumps stay: a drive with a clearance jumps where the torque changes sign.
    """
    search = RowSearch[TorsionRecord](record, SWEPT, deviations, rules)
    search.take_repeated()
    search.note_gaps()
    for channel in SWEPT:
        values = getattr(search.record, channel)
        flags = spikes_on_course(values, deviations, rules)
        if flags.any():
            departures = values - median_filter(values, _SMOOTHED, mode="mirror")
            search.take_spikes([(channel, flags, departures)])
    return search.record, tuple(search.faults)


class _RunSearch(RowSearch[RunningRecord]):
    """A `RowSearch` of a running record, in the residual of its order lines."""

    def __init__(
        self, record: RunningRecord, ratio: float, deviations: float, rules: Rules
    ) -> None:
        super().__init__(record, RUNNING, deviations, rules)
        self.ratio = ratio
        self.usable = True
        self._searched: RunningRecord | None = None
        self._fit: LineFit | None = None

    def run(self, orders: Sequence[float]) -> Rows:
        """Take out spikes, jumps and a decay until there are none; return the lines' residual.

        If there are too many jumps, they are a motion, and none is taken out.
        """
        # A decay comes first, because its rows depart from each other as spikes do.
        self._take_settling(self.fitted(orders), ())
        rough: tuple[RunningRecord, NDArray[np.int_], list[RowFault]] | None = None
        for taken in range(self.rules.most_jumps + 1):
            fit = self._without_spikes(orders)
            steps = self._steps(fit)
            if self._take_settling(fit, steps):
                fit = self._without_spikes(orders)
                steps = self._steps(fit)
            if not steps:
                return fit.whole_residual
            self._note_simultaneous_jumps(steps)
            rough = rough or (self.record, self.rows, list(self.faults))
            if taken == self.rules.most_jumps or not self._take_step(*steps[0], orders):
                break
        if rough is not None:
            self.record, self.rows, self.faults = rough
        self._take_settling(self.fitted(orders), ())
        return self.fitted(orders).whole_residual

    def take_near_ends(
        self, orders: Sequence[float], known: Collection[tuple[str, float]] = ()
    ) -> bool:
        """Leave out rows whose lines come near the end of a saturated range; return if enough stay.

        Rows at the end are left out already, but of those that come near it only rows stay whose
        noise took them away from it, and where samples are averaged none stands at the end. Their
        mean is off by noise times the density of a normal distribution at the distance: less than
        that of all samples is known to beyond where the density is one over the root of their
        number.
        """
        saturated = [fault for fault in self.faults if fault.kind == "saturated"]
        faults = {(fault.channel, fault.size): fault for fault in saturated}
        averaged, own = self.record.samples_averaged, {fault.channel for fault in saturated}
        beside = [end for end in sorted(known) if averaged > 1 and end[0] not in own]
        torques = [end for end in (*faults, *beside) if end[0] in RUNNING[2:]]
        if not torques:
            return True
        fit, near = self.fitted(orders), np.zeros(len(self.rows), dtype=bool)
        residual = fit.whole_residual
        lines = np.vstack([fit.values(part) for part in fit.parts]) - residual
        count = len(self.rows) + sum(fault.rows for fault in saturated)
        distance = float(np.sqrt(max(np.log(count * averaged / (2.0 * np.pi)), 0.0)))
        for channel, reading in torques:
            place = RUNNING.index(channel) - 1
            side = np.sign(reading - np.median(lines[:, place]))
            noise = np.std(residual[:, place]) * np.sqrt(averaged)
            further = ~(side * (reading - lines[:, place]) > distance * noise) & ~near
            rows = int(np.count_nonzero(further))
            if (fault := faults.get((channel, reading))) is not None:
                self.faults[self.faults.index(fault)] = replace(fault, rows=fault.rows + rows)
            elif rows:
                self.note("saturated", channel, int(np.argmax(further)), rows, reading, "left out")
            near |= further
        kept = int(np.count_nonzero(~near))
        if kept < max(FEWEST_SAMPLES, (1.0 - self.rules.saturated_share) * count):
            return False
        if not near.any():
            return True
        self._keep_rows(~near)
        return spans_a_turn(self.record, self.ratio)

    def fitted(self, orders: Sequence[float]) -> LineFit:
        """Return the lines of the remaining rows, fitted once for the same rows."""
        if self._fit is None or self._fit.record is not self.record:
            self._fit = LineFit.of(self.record, self.ratio, orders)
        return self._fit

    def _take_settling(self, fit: LineFit, steps: Sequence[ChannelStep]) -> bool:
        """Fit a decay of the first rows with the lines, if it is clearer than all steps."""
        if self.record.settling is not None or self.record is self._searched:
            return False
        self._searched = self.record
        decay = settling(fit, self.deviations, self.rules)
        if decay is None or any(decay.deviations < jump.deviations for jump, _, _ in steps):
            return False
        channel = ("output_angle", "input_torque", "output_torque", "input_angle")[decay.place]
        size = -decay.size if channel == "output_angle" else decay.size
        self.record = replace(self.record, settling=decay.constant)
        self.note("settling", channel, 0, unsettled_rows(self.record), size, "modelled")
        return True

    def _without_spikes(self, orders: Sequence[float]) -> LineFit:
        """Leave out spikes, the small ones once the large ones are gone, and return the fit."""
        for _ in range(_ROUNDS):
            fit = self.fitted(orders)
            channels = self._spikes(fit.whole_residual)
            if not channels:
                break
            self.take_spikes(channels)
        return fit

    def _spikes(self, residual: Rows) -> list[Spikes]:
        """Return channels with spikes, which rows they are, and the departures there."""
        flags = [spikes(channel, self.deviations, self.rules) for channel in residual.T]
        if not np.any(flags):
            return []
        departures = residual - median_filter(residual, (_SMOOTHED, 1), mode="mirror")
        read_in = departures[:, 3] / self.ratio
        read_out = read_in - departures[:, 0]
        angle = flags[0] | flags[3]
        together = angle & (np.abs(departures[:, 0]) < 0.5 * np.abs(read_in))
        lost = departures[:, 3] / self.record.input_speed
        # Where both angles depart by less than the way of a row, the drive has moved.
        angle &= ~together | self._is_of_rows(lost)
        together &= angle
        of_input = angle & ~together & (np.abs(read_in) > np.abs(read_out))
        candidates = [
            ("time", together, lost),
            ("input_angle", of_input, departures[:, 3]),
            ("output_angle", angle & ~together & ~of_input, read_out),
            # A wrong input angle also shifts the lines of the torques.
            ("input_torque", flags[1] & ~of_input, departures[:, 1]),
            ("output_torque", flags[2] & ~of_input, departures[:, 2]),
        ]
        return [candidate for candidate in candidates if candidate[1].any()]

    def _is_of_rows(self, time: Any) -> Any:
        """Return whether a time is that of lost or repeated rows, not of a motion."""
        return np.abs(time) * self.record.sample_rate > self.rules.gap_of_rows - 1.0

    def _steps(self, fit: LineFit) -> list[ChannelStep]:
        """Return the jump of each channel that stands out most, the clearest first."""
        residual, jumps = fit.whole_residual, list[ChannelStep]()
        unit_steps = UnitSteps(fit)
        for place in range(residual.shape[1]):
            jump = step(residual[:, place], unit_steps, self.deviations, self.rules)
            if jump is None:
                continue
            channel, size = self._jumping_channel(place, jump, residual)
            if channel != "time" or self._is_of_rows(size):
                jumps.append((jump, channel, size))
        return sorted(jumps, key=lambda jump: -jump[0].deviations)

    def _note_simultaneous_jumps(self, steps: Sequence[ChannelStep]) -> None:
        """Note jumps of other channels at the row of the clearest: a record of two tests."""
        angles = ("time", "input_angle", "output_angle")
        best, *further = steps
        for jump, channel, size in further:
            both_angles = channel in angles and best[1] in angles
            if channel != best[1] and not both_angles and abs(jump.row - best[0].row) <= WINDOWS[1]:
                self.note("jump", channel, jump.row, len(self.rows) - jump.row, size, "modelled")
                self.usable = False

    def _take_step(
        self, detected: Step, channel: str, size: float, orders: Sequence[float]
    ) -> bool:
        """Take a jump out of the rows; return whether that was possible."""
        rows = len(self.rows) - detected.row
        if channel == "time":
            time = self.record.time.copy()
            time[detected.row :] += size
            if not time[detected.row] > time[detected.row - 1]:
                return False
            self.record = replace(self.record, time=time)
        else:
            jump = Jump(float(self.record.time[detected.row]), channel, 0.0)
            self.record = replace(self.record, jumps=(*self.record.jumps, jump))
            self._shift(len(self.record.jumps) - 1, size)
            size = self._refined(orders)
        self.note("jump", channel, detected.row, rows, size, "modelled")
        return True

    def _jumping_channel(self, place: int, detected: Step, residual: Rows) -> tuple[str, float]:
        """Return which channel of the record jumps at a step, and by how much."""
        if place in (1, 2):
            return RUNNING[place + 1], detected.size
        half = min(WINDOWS[1], detected.row, len(residual) - detected.row)
        before, after = (
            residual[detected.row - half : detected.row],
            residual[detected.row :][:half],
        )
        error, read_in = (np.median(after, axis=0) - np.median(before, axis=0))[[0, 3]]
        if place == 3:
            read_in = detected.size
        else:
            error = detected.size
        if abs(error) < 0.5 * abs(read_in) / self.ratio:
            return "time", read_in / self.record.input_speed
        if abs(read_in) > 0.5 * abs(error) * self.ratio:
            return "input_angle", error * self.ratio
        return "output_angle", -error

    def _refined(self, orders: Sequence[float]) -> float:
        """Return the size of the last jump, fitted with the lines of the shifted rows."""
        place = len(self.record.jumps) - 1
        for _ in range(2):
            jump = self.record.jumps[place]
            corrections = LineFit.of(self.record, self.ratio, orders).coefficients[-1]
            sizes = {"input_angle": self.ratio * corrections[0], "output_angle": -corrections[0],
                     "input_torque": corrections[1], "output_torque": corrections[2]}  # fmt: skip
            self._shift(place, float(sizes[jump.channel]))
        return self.record.jumps[place].size

    def _shift(self, place: int, size: float) -> None:
        """Take a further ``size`` of a jump out of the rows."""
        jumps = list(self.record.jumps)
        jump = jumps[place]
        jumps[place] = replace(jump, size=jump.size + size)
        values = getattr(self.record, jump.channel).copy()
        values[self.record.time >= jump.time] -= size
        self.record = replace(self.record, jumps=tuple(jumps), **{jump.channel: values})
