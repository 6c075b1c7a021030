"""A record on the way to its repair: rows that are left out, and what is noted about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from pymoo_hdte.discrepancy.campaign.records import FEWEST_SAMPLES, RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy.campaign.rows.findings import RowFault
from pymoo_hdte.discrepancy.engine.rules import Rules

Rows = NDArray[np.float64]
Record = TypeVar("Record", RunningRecord, TorsionRecord)

Spikes = tuple[str, NDArray[np.bool_], Rows]
"""Name of a channel, which rows are spikes in it, and how far every row departs."""


class RowSearch(Generic[Record]):
    """A record whose faulty rows are taken out one after the other.

    Attributes
    ----------
    record : RunningRecord or TorsionRecord
        As it is by now.
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
            for first, last in _runs(again):
                length = float(self.record.time[last] - self.record.time[first - 1])
                self.note("repeated", "rows", first, last - first + 1, length, "left out")
            self._keep(~again)

    def take_stuck(self) -> bool:
        """Leave out rows in which a channel is saturated, or stays the same for far too long.

        Not if too few rows would be left, of which it tells.
        """
        every, saturated = np.zeros(len(self.rows), dtype=bool), 0
        for channel in self.channels:
            values = getattr(self.record, channel)
            for reading in (float(values.max()), float(values.min())):
                flags = self._saturated(values, reading)
                if flags.any():
                    first, rows = int(np.argmax(flags)), int(np.count_nonzero(flags))
                    self.note("saturated", channel, first, rows, reading, "left out")
                    saturated += rows
                every |= flags
            stuck = self._stuck(values) & ~every
            for first, last in _runs(stuck):
                value = float(values[first])
                self.note("stuck", channel, first, last - first + 1, value, "left out")
            every |= stuck
        enough = bool(np.count_nonzero(~every) >= FEWEST_SAMPLES)
        enough &= saturated <= self.rules.saturated_share * len(every)
        if every.any() and enough:
            self._keep(~every)
        return enough

    def _saturated(self, values: Rows, reading: float) -> NDArray[np.bool_]:
        """Return in which rows a channel is at the end of its range, as at no other reading.

        With the rows beside them, of which noise has taken others to that end. One run alone is a
        channel that is stuck.
        """
        rules, at_end = self.rules, values == reading
        inside = values[~at_end]
        next_to_it = inside[np.argmin(np.abs(inside - reading))]
        number, others = np.count_nonzero(at_end), np.count_nonzero(inside == next_to_it)
        lively = len(np.unique(inside)) >= rules.stuck_rows
        many = number >= rules.stuck_rows and number >= rules.stuck_ratio * others
        if not (lively and many and len(_runs(at_end)) > 1):
            return np.zeros_like(at_end)
        return np.asarray(binary_dilation(at_end, iterations=rules.longest_spike))

    def _stuck(self, values: Rows) -> NDArray[np.bool_]:
        """Return in which rows a channel has one reading for too long."""
        rules, changes = self.rules, np.r_[True, values[1:] != values[:-1]]
        lengths = np.diff(np.r_[np.flatnonzero(changes), len(values)])
        # A rest that the record cuts off tells how long rests are only where it is long.
        whole = np.ones(len(lengths), dtype=bool)
        whole[[0, -1]] = lengths[[0, -1]] >= rules.stuck_rows
        ranked = np.sort(lengths[whole])[::-1][: rules.most_jumps + 1]
        longest, others = ranked[:-1], ranked[1:]
        far = longest[(longest >= rules.stuck_ratio * others) & (longest >= rules.stuck_rows)]
        stuck = np.repeat(lengths >= min(far, default=np.inf), lengths)
        left = changes[~stuck]
        fine = len(left) >= rules.stuck_rows and left.mean() >= rules.changing_share
        return stuck if fine else np.zeros_like(stuck)

    def note_gaps(self) -> None:
        """Note where the time runs on without rows."""
        steps = np.diff(self.record.time) * self.record.sample_rate
        for place in np.flatnonzero(steps > self.rules.gap_of_rows):
            lost = round(float(steps[place])) - 1 - int(np.diff(self.rows)[place] - 1)
            if lost > 0:
                length = lost / self.record.sample_rate
                self.note("gap", "rows", int(place) + 1, lost, length, "none needed")

    def take_spikes(self, found: Sequence[Spikes]) -> None:
        """Leave out the rows of spikes: name of the channel, rows, and how far they depart."""
        for channel, flags, departures in found:
            for first, last in _runs(flags):
                run = departures[first : last + 1]
                size = float(run[np.argmax(np.abs(run))])
                self.note("spike", channel, first, last - first + 1, size, "left out")
        self._keep(~np.any([flags for _, flags, _ in found], axis=0))

    def note(
        self, kind: str, channel: str, first: int, rows: int, size: float, treatment: str
    ) -> None:
        """Note a fault at rows as they are by now."""
        row = int(self.rows[first])
        self.faults.append(RowFault(self.record.name, kind, channel, row, rows, size, treatment))

    def _keep(self, kept: NDArray[np.bool_]) -> None:
        columns = {name: getattr(self.record, name)[kept] for name in ("time", *self.channels)}
        self.record = replace(self.record, **columns)
        self.rows = self.rows[kept]


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and the last place of every run of flags."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False]))
    return list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))
