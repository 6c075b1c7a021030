"""Relative errors of laws in records of any machine, and what no law of the library holds.

The arguments of a law are not known here. Its relative error is another one in each record; what is
outside of the library changes smoothly along the rows of each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.own_records import PredictedRecords
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.linearised import linearise, modulated
from pymoo_hdte.discrepancy._selection.process import TERMS, sines_of
from pymoo_hdte.discrepancy._selection.score import Linearised, Sized, groups_of

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RecordErrors:
    """Hypotheses of a machine as the score takes them.

    Attributes
    ----------
    data : PredictedRecords
    base : Fit
        Without effects.
    """

    data: PredictedRecords
    base: Fit

    @property
    def groups(self) -> list[NDArray[np.int_]]:
        """Rows of each record and of each channel."""
        return groups_of(*self.data.layout)

    def linearised(self, fitted: Fit) -> Linearised:
        """Return a fit as a hypothesis."""
        record, channel = self.data.layout
        in_record = (record[:, None] == np.unique(record)).astype(float)

        def errors(candidate: Candidate, place: slice) -> list[Matrix]:
            columns = fitted.jacobian[: len(channel), place]
            return modulated(candidate, fitted.values[place], columns, in_record)

        return linearise(fitted, channel, errors)

    @cached_property
    def _along_rows(self) -> Matrix:
        """A process of deviation 1 along the rows of each record, shape (n, records x TERMS)."""
        record, channel = self.data.layout
        waves = np.zeros((len(record), record.max() + 1, TERMS))
        for number in range(record.max() + 1):
            for part in np.unique(channel):
                rows = np.flatnonzero((record == number) & (channel == part))
                waves[rows, number] = sines_of(np.linspace(-1.0, 1.0, len(rows)))
        return waves.reshape(len(record), -1)

    @cached_property
    def outside(self) -> tuple[Sized, ...]:
        """What no law holds, in each channel: as large as its noise, up to the misfit."""
        return tuple(self._outside())

    def _outside(self) -> Iterator[Sized]:
        for part, name in enumerate(self.data.parts):
            inside = self.data.layout[1] == part
            columns = self._along_rows * inside[:, None]
            columns = columns[:, np.any(columns != 0.0, axis=0)]
            n, none = int(inside.sum()), np.zeros(columns.shape[1])
            size = float(np.sum(columns**2))
            least, most = np.sqrt(n / size), np.sqrt(max(self.base.chi_square, 4.0 * n) / size)
            yield Sized(f"outside: {name}", columns, float(least), float(most), none, none > 0.0)
