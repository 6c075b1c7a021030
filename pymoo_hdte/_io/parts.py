"""Parts of a file: so that one log gives a record to be fitted and one to judge the result."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput

WORDS = ("share", "rows", "seconds")
"""How a part may be stated."""


@dataclass(frozen=True)
class Part:
    """A part of a file, the first of its limits inside, the last outside.

    Attributes
    ----------
    by : {"share", "rows", "seconds"}
        Shares of the rows, numbers of rows from 0, each below those that are skipped, or times as
        in the column of time, s.
    first, last : float

    Raises
    ------
    InvalidInput
        For limits that do not rise, are negative, or shares above 1.
    """

    by: str
    first: float
    last: float

    def __post_init__(self) -> None:
        least, most = {"share": (0.0, 1.0), "rows": (0.0, math.inf)}.get(
            self.by, (-math.inf, math.inf)
        )
        whole = self.by != "rows" or (self.first % 1.0 == 0.0 == self.last % 1.0)
        if not (least <= self.first < self.last <= most and whole):
            allowed = {
                "share": "[from, to] between 0 and 1, rising",
                "rows": "[first, end] as whole numbers from 0, rising",
            }.get(self.by, "[from, to] in s, rising")
            raise InvalidInput(self.by, [self.first, self.last], allowed)

    def rows_of(self, time: NDArray[np.float64]) -> slice:
        """Return the rows of the part among all, which were taken at times of shape (n,), s."""
        if self.by == "seconds":
            inside = np.flatnonzero((time >= self.first) & (time < self.last))
            return slice(int(inside[0]), int(inside[-1]) + 1) if inside.size else slice(0, 0)
        size = len(time) if self.by == "share" else 1
        return slice(round(self.first * size), min(round(self.last * size), len(time)))


def part_from_fields(entry: Fields) -> Part | None:
    """Take the part of a file out of a record's table; None for all of it.

    Raises
    ------
    InvalidInput
        With the field, as `Part`, or for a second of `WORDS`.
    """
    stated = [word for word in WORDS if entry.has(word)]
    if not stated:
        return None
    by, *others = stated
    for other in others:
        raise InvalidInput(entry._name(other), entry.numbers(other), f"absent beside {by}")
    limits = entry.numbers(by)
    if len(limits) != 2:
        raise InvalidInput(entry._name(by), limits, "two numbers, [from, to]")
    try:
        return Part(by, *limits)
    except InvalidInput as error:
        raise InvalidInput(entry._name(by), error.value, error.allowed) from None
