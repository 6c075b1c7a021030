"""Parts of a file: so that one log gives a record to be fitted and one to judge the result."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput

WORDS = ("share", "rows", "seconds")
"""Units in which a part may be stated."""


@dataclass(frozen=True)
class Part:
    """A part of a file, from its start (inside) to its stop (outside).

    Attributes
    ----------
    by : {"share", "rows", "seconds"}
        Whether the limits are shares of the rows, row numbers from 0 or times as in the column of
        time, s. Skipped rows do not count.
    start, stop : float

    Raises
    ------
    InvalidInput
        For limits that do not rise, are negative, or shares above 1.
    """

    by: str
    start: float
    stop: float

    def __post_init__(self) -> None:
        least, most = {"share": (0.0, 1.0), "rows": (0.0, math.inf)}.get(
            self.by, (-math.inf, math.inf)
        )
        whole = self.by != "rows" or (self.start % 1.0 == 0.0 == self.stop % 1.0)
        if not (least <= self.start < self.stop <= most and whole):
            allowed = {
                "share": "[from, to] between 0 and 1, rising",
                "rows": "[first, end] as whole numbers from 0, rising",
            }.get(self.by, "[from, to] in s, rising")
            raise InvalidInput(self.by, [self.start, self.stop], allowed)

    def rows_of(self, time: NDArray[np.float64]) -> slice:
        """Return which of the rows, taken at times of shape (n,), s, belong to the part."""
        if self.by == "seconds":
            inside = np.flatnonzero((time >= self.start) & (time < self.stop))
            return slice(int(inside[0]), int(inside[-1]) + 1) if inside.size else slice(0, 0)
        size = len(time) if self.by == "share" else 1
        return slice(round(self.start * size), min(round(self.stop * size), len(time)))


def part_from_fields(entry: Fields) -> Part | None:
    """Take the part of a file out of a record's table; None for all of it.

    Raises
    ------
    InvalidInput
        With the name of the faulty field: as `Part`, or if the part is stated twice.
    """
    stated = [word for word in WORDS if entry.has(word)]
    if not stated:
        return None
    by, *others = stated
    for word in others:
        raise InvalidInput(entry.name_of(word), entry.numbers(word), f"absent beside {by}")
    limits = entry.numbers(by)
    if len(limits) != 2:
        raise InvalidInput(entry.name_of(by), limits, "two numbers, [from, to]")
    try:
        return Part(by, *limits)
    except InvalidInput as error:
        raise InvalidInput(entry.name_of(by), error.value, error.allowed) from None
