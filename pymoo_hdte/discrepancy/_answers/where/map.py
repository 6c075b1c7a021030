"""The map of a misfit: one cell for the mean or one order line of one channel in one record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import false_discovery_control

from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class WithinNoise:
    """Which groups of cells, taken together, the believed model meets within the noise.

    Many cells that each differ by less than their noise may still differ as a group.

    Attributes
    ----------
    channels : ndarray of bool, shape (4,)
    orders : ndarray of bool, shape (1 + m,)
    records : ndarray of bool, shape (r,)
    """

    channels: Flags
    orders: Flags
    records: Flags

    @property
    def everywhere(self) -> bool:
        """Whether that holds for all groups."""
        return bool(self.channels.all() and self.orders.all() and self.records.all())


@dataclass(frozen=True, eq=False)
class Location:
    """Location of the misfit. Cells have shape (r, 4, 1 + m): record, channel, order.

    Channels are those of `order_lines.CHANNELS`. Order 0 is the mean.

    Attributes
    ----------
    records : tuple of str, length r
    speed_rpm, load_torque : ndarray, shape (r,)
        r/min of the input, N.m.
    orders : ndarray, shape (1 + m,)
        Cycles per input turn.
    misfit : complex ndarray, shape (r, 4, 1 + m)
        Measured minus believed model, rad and N.m; nan where a mean is a condition. The believed
        model has no named effect, and every value within its tolerance.
    change : complex ndarray, shape (r, 4, 1 + m)
        What the named effects, and values out of tolerance, add to the believed model.
    noise : ndarray, shape (r, 4, 1 + m)
        Standard deviation of the real and of the imaginary part of a cell.
    chi_square : ndarray, shape (r, 4, 1 + m)
        Of the misfit: two degrees of freedom for a line, one for a mean.
    p_value : ndarray, shape (r, 4, 1 + m)
    moved : ndarray, shape (r, 4, 1 + m)
        Chi-square of ``change``; zero where nothing is named.
    flagged : ndarray of bool, shape (r, 4, 1 + m)
        Cells that the named effects, or values out of tolerance, change by more than the root
        mean square of the noise, and those with a misfit of the model with these effects that is
        significant at `Rules.false_discovery_rate`.
    within_noise : WithinNoise
        Of ``misfit``, by channel, order and record.
    sweep_p_value : float or None
        Of the torsion sweep, None without one.
    sweep_flagged : bool
    named : bool
        Whether there are named effects or values out of tolerance.
    rules : Rules
        Thresholds by which cells were flagged.
    sentence, trusted : str
        Where the misfit is, and where the model may be trusted as it is.
    """

    records: tuple[str, ...]
    speed_rpm: Values
    load_torque: Values
    orders: Values
    misfit: NDArray[np.complex128]
    change: NDArray[np.complex128]
    noise: Values
    chi_square: Values
    p_value: Values
    moved: Values
    flagged: Flags
    within_noise: WithinNoise
    sweep_p_value: float | None
    sweep_flagged: bool
    named: bool
    rules: Rules = RULES
    sentence: str = ""
    trusted: str = ""

    @property
    def cells(self) -> int:
        """Number of cells of the map."""
        return int(np.isfinite(self.chi_square).sum())

    def summary(self) -> dict[str, Any]:
        """Return its entry in ``verdict.json``, as plain types."""
        flagged = [
            {
                "record": self.records[record],
                "speed_rpm": float(self.speed_rpm[record]),
                "load_Nm": float(self.load_torque[record]),
                "channel": CHANNELS[channel],
                "order": float(self.orders[order]),
                "chi_square": float(self.chi_square[record, channel, order]),
                "p_value": float(self.p_value[record, channel, order]),
            }
            for record, channel, order in np.argwhere(self.flagged)
        ]
        return {
            "sentence": self.sentence,
            "trusted": self.trusted,
            "cells": self.cells,
            "rule": "moved by what is named, or wrong at a false discovery rate of "
            f"{100.0 * self.rules.false_discovery_rate:g} %",
            "flagged": flagged,
            "torsion_sweep": {"p_value": self.sweep_p_value, "flagged": self.sweep_flagged},
        }


def benjamini_hochberg(p_value: Values, rate: float) -> Flags:
    """Return which hypotheses are rejected at a false discovery rate; nan never is."""
    known = np.isfinite(p_value)
    rejected = np.zeros(p_value.shape, dtype=bool)
    rejected[known] = false_discovery_control(p_value[known]) <= rate
    return rejected
