"""One record without its faulty rows, and a list of what was wrong with it.

Spikes and repeated rows are left out: the order lines are fitted over the measured angle and do not
need evenly spaced rows. A jump of a sensor is taken out of the rows after it and fitted again with
the lines (`records.Jump`). Where both encoders jump alike, the drive has moved on while the time
has not: rows are missing, and the time is set right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.campaign.line_basis import LineFit, spans_a_turn
from pymoo_hdte.discrepancy.campaign.records import Jump, RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy.campaign.rows.drift import torque_drifts
from pymoo_hdte.discrepancy.campaign.rows.faults import (
    WINDOWS,
    Lines,
    Step,
    spikes,
    spikes_on_course,
    step,
)
from pymoo_hdte.discrepancy.campaign.rows.findings import FAILED, RowFault
from pymoo_hdte.discrepancy.campaign.rows.search import Rows, RowSearch, Spikes
from pymoo_hdte.discrepancy.campaign.rows.settling import settling, unsettled_rows
from pymoo_hdte.discrepancy.engine.rules import Rules

RUNNING = ("input_angle", "output_angle", "input_torque", "output_torque")
SWEPT = ("output_angle", "output_torque")

FoundStep = tuple[Step, str, float]
"""A jump in what the lines leave, the channel of the record that jumps, and by how much."""

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
        Of the order lines, by channel as in `LineFit`; None where they cannot be fitted.
    usable : bool
        False if several channels jump at once: not a sensor has changed then, but the test. And if
        too few rows are left in which no channel has failed.
    drifts : ndarray, shape (2,), or None
        See `torque_drifts`; None where the lines cannot be fitted.
    """

    record: RunningRecord
    faults: tuple[RowFault, ...]
    residual: Rows | None
    usable: bool
    drifts: Rows | None = None


def repaired_run(
    record: RunningRecord, ratio: float, orders: Sequence[float], deviations: float, rules: Rules
) -> RepairedRun:
    """Return a running record without spikes, jumps, failed or repeated rows, and settling.

    Parameters
    ----------
    record : RunningRecord
    ratio : float
        Transmission ratio N, dimensionless.
    orders : sequence of float
        Lines that are taken out first, cycles per input turn.
    deviations : float
        Least size of a fault, in standard deviations.
    rules : Rules
    """
    search = _RunSearch(record, ratio, deviations, rules)
    search.take_repeated()
    enough = search.take_stuck()
    failed = tuple(fault for fault in search.faults if fault.kind in FAILED)
    if failed and not (enough and spans_a_turn(search.record, ratio)):
        return RepairedRun(record, tuple(search.faults), None, False)
    search.note_gaps()
    try:
        residual = search.run(orders)
    except InvalidInput:
        # A record that cannot tell these lines apart is judged, and refused, where it is measured,
        # unless that is so only without the rows in which a channel has failed.
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
    """The same for a running record, by what its order lines leave."""

    def __init__(
        self, record: RunningRecord, ratio: float, deviations: float, rules: Rules
    ) -> None:
        super().__init__(record, RUNNING, deviations, rules)
        self.ratio = ratio
        self.usable = True
        self._asked: RunningRecord | None = None
        self._fit: LineFit | None = None

    def run(self, orders: Sequence[float]) -> Rows:
        """Take out spikes, jumps and a decay until there are none; return the lines' residual.

        Where jumps do not end, they are a motion, and none is taken out.
        """
        # Its first rows depart from each other as spikes do.
        self._take_settling(self.fitted(orders), ())
        rough: tuple[RunningRecord, NDArray[np.int_], list[RowFault]] | None = None
        for taken in range(self.rules.most_jumps + 1):
            fit = self._without_spikes(orders)
            found = self._steps(fit)
            if self._take_settling(fit, found):
                fit = self._without_spikes(orders)
                found = self._steps(fit)
            if not found:
                return fit.whole_residual
            self._compare(found)
            rough = rough or (self.record, self.rows, list(self.faults))
            if taken == self.rules.most_jumps or not self._take_step(*found[0], orders):
                break
        if rough is not None:
            self.record, self.rows, self.faults = rough
        self._take_settling(self.fitted(orders), ())
        return self.fitted(orders).whole_residual

    def fitted(self, orders: Sequence[float]) -> LineFit:
        """Return the lines of the rows as they are by now, fitted once for the same rows."""
        if self._fit is None or self._fit.record is not self.record:
            self._fit = LineFit.of(self.record, self.ratio, orders)
        return self._fit

    def _take_settling(self, fit: LineFit, steps: Sequence[FoundStep]) -> bool:
        """Have a decay at the first rows fitted with the lines, if it is clearer than all steps."""
        if self.record.settling is not None or self.record is self._asked:
            return False
        self._asked = self.record
        found = settling(fit, self.deviations, self.rules)
        if found is None or any(found.deviations < one.deviations for one, _, _ in steps):
            return False
        channel = ("output_angle", "input_torque", "output_torque", "input_angle")[found.place]
        size = -found.size if channel == "output_angle" else found.size
        self.record = replace(self.record, settling=found.constant)
        self.note("settling", channel, 0, unsettled_rows(self.record), size, "modelled")
        return True

    def _without_spikes(self, orders: Sequence[float]) -> LineFit:
        """Leave out spikes, the small ones once the large ones are gone, and return the fit."""
        for _ in range(_ROUNDS):
            fit = self.fitted(orders)
            found = self._spikes(fit.whole_residual)
            if not found:
                break
            self.take_spikes(found)
        return fit

    def _spikes(self, residual: Rows) -> list[Spikes]:
        """Return channels with spikes, which rows they are, and the departures there."""
        flags = [spikes(one, self.deviations, self.rules) for one in residual.T]
        if not np.any(flags):
            return []
        departures = residual - median_filter(residual, (_SMOOTHED, 1), mode="mirror")
        read_in = departures[:, 3] / self.ratio
        read_out = read_in - departures[:, 0]
        angle = flags[0] | flags[3]
        together = angle & (np.abs(departures[:, 0]) < 0.5 * np.abs(read_in))
        lost = departures[:, 3] / self.record.input_speed
        # A drive whose angles depart by less than a row's way has moved so.
        angle &= ~together | self._is_of_rows(lost)
        together &= angle
        of_input = angle & ~together & (np.abs(read_in) > np.abs(read_out))
        found = [
            ("time", together, lost),
            ("input_angle", of_input, departures[:, 3]),
            ("output_angle", angle & ~together & ~of_input, read_out),
            # Where the input angle is wrong, so is what the lines say about the torques.
            ("input_torque", flags[1] & ~of_input, departures[:, 1]),
            ("output_torque", flags[2] & ~of_input, departures[:, 2]),
        ]
        return [one for one in found if one[1].any()]

    def _is_of_rows(self, time: Any) -> Any:
        """Return whether a time is that of lost or repeated rows, not of a motion."""
        return np.abs(time) * self.record.sample_rate > self.rules.gap_of_rows - 1.0

    def _steps(self, fit: LineFit) -> list[FoundStep]:
        """Return the jump of each channel that stands out most, the clearest first."""
        residual, found = fit.whole_residual, list[FoundStep]()
        lines = Lines(fit)
        for place in range(residual.shape[1]):
            one = step(residual[:, place], lines, self.deviations, self.rules)
            if one is None:
                continue
            channel, size = self._jumped(place, one, residual)
            if channel != "time" or self._is_of_rows(size):
                found.append((one, channel, size))
        return sorted(found, key=lambda one: -one[0].deviations)

    def _compare(self, found: Sequence[FoundStep]) -> None:
        """Note jumps of further channels at the row of the first: the record is of two tests."""
        angles = ("time", "input_angle", "output_angle")
        best, *further = found
        for one, channel, size in further:
            both_angles = channel in angles and best[1] in angles
            if channel != best[1] and not both_angles and abs(one.row - best[0].row) <= WINDOWS[1]:
                self.note("jump", channel, one.row, len(self.rows) - one.row, size, "modelled")
                self.usable = False

    def _take_step(self, found: Step, channel: str, size: float, orders: Sequence[float]) -> bool:
        """Take a jump out of the rows; return whether that was possible."""
        rows = len(self.rows) - found.row
        if channel == "time":
            time = self.record.time.copy()
            time[found.row :] += size
            if not time[found.row] > time[found.row - 1]:
                return False
            self.record = replace(self.record, time=time)
        else:
            jump = Jump(float(self.record.time[found.row]), channel, 0.0)
            self.record = replace(self.record, jumps=(*self.record.jumps, jump))
            self._shift(len(self.record.jumps) - 1, size)
            size = self._refined(orders)
        self.note("jump", channel, found.row, rows, size, "modelled")
        return True

    def _jumped(self, place: int, found: Step, residual: Rows) -> tuple[str, float]:
        """Return which channel of the record jumps at a step, and by how much."""
        if place in (1, 2):
            return RUNNING[place + 1], found.size
        near = min(WINDOWS[1], found.row, len(residual) - found.row)
        before, after = residual[found.row - near : found.row], residual[found.row :][:near]
        error, read_in = (np.median(after, axis=0) - np.median(before, axis=0))[[0, 3]]
        if place == 3:
            read_in = found.size
        else:
            error = found.size
        if abs(error) < 0.5 * abs(read_in) / self.ratio:
            return "time", read_in / self.record.input_speed
        if abs(read_in) > 0.5 * abs(error) * self.ratio:
            return "input_angle", error * self.ratio
        return "output_angle", -error

    def _refined(self, orders: Sequence[float]) -> float:
        """Return the size of the last jump, fitted with the lines of the shifted rows."""
        last = len(self.record.jumps) - 1
        for _ in range(2):
            jump = self.record.jumps[last]
            left = LineFit.of(self.record, self.ratio, orders).coefficients[-1]
            sizes = {"input_angle": self.ratio * left[0], "output_angle": -left[0],
                     "input_torque": left[1], "output_torque": left[2]}  # fmt: skip
            self._shift(last, float(sizes[jump.channel]))
        return self.record.jumps[last].size

    def _shift(self, place: int, size: float) -> None:
        """Take so much more of a jump out of the rows."""
        jumps = list(self.record.jumps)
        jump = jumps[place]
        jumps[place] = replace(jump, size=jump.size + size)
        values = getattr(self.record, jump.channel).copy()
        values[self.record.time >= jump.time] -= size
        self.record = replace(self.record, jumps=tuple(jumps), **{jump.channel: values})
