"""Operating conditions: at which speeds and loads a drive runs, and for what share of its time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.csv_table import read_text_table
from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.drive import DriveModel, UnstableDrive
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

COLUMNS = ("speed_rpm", "load_Nm", "weight")
"""Columns of a file of operating conditions, in any order."""
LARGEST_WEIGHT = 1e15
"""Limit that keeps sums of weights finite."""


@dataclass(frozen=True)
class OperatingCondition:
    """One entry of a duty cycle.

    Parameters
    ----------
    input_speed : float
        rad/s, above 0.
    load_torque : float
        N.m at the output, at least 0.
    weight : float
        Above 0, at most `LARGEST_WEIGHT`; only the ratios of the weights of a duty cycle matter.

    Raises
    ------
    InvalidInput
        If a number is not finite or not in its range.

    Examples
    --------
    >>> OperatingCondition(input_speed=209.4, load_torque=20.0, weight=0.3).weight
    0.3
    """

    input_speed: float
    load_torque: float
    weight: float = 1.0

    def __post_init__(self) -> None:
        values = {
            "input_speed": real_number("input_speed", self.input_speed, above=0.0),
            "load_torque": real_number("load_torque", self.load_torque, at_least=0.0),
            "weight": real_number("weight", self.weight, above=0.0, at_most=LARGEST_WEIGHT),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __str__(self) -> str:
        speed = self.input_speed / REVOLUTION_PER_MINUTE
        return f"{speed:g} r/min and {self.load_torque:g} N.m"


def load_conditions(path: str | Path) -> tuple[OperatingCondition, ...]:
    """Read operating conditions from a CSV file.

    Parameters
    ----------
    path : str or Path
        The file, with the columns ``speed_rpm``, ``load_Nm`` and ``weight`` in any order. Speeds
        are in r/min, loads in N.m. Blank lines and lines that start with ``#`` are skipped.

    Returns
    -------
    tuple of OperatingCondition
        The conditions in the order of the file, SI.

    Raises
    ------
    InvalidInput
        If a column is missing, repeated or unknown, a row has another number of cells, a value is
        no number or not in its range, or there is no row. The error names file and line.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> conditions = load_conditions("duty_cycle.csv")  # doctest: +SKIP
    """
    table = read_text_table(Path(path), by_hand=True)
    table.require(COLUMNS, no_others=True)
    columns = table.numbers(COLUMNS)
    rows = zip(table.lines, *(columns[name].tolist() for name in COLUMNS), strict=True)
    return tuple(_condition(f"{table.file}, line {line}", *values) for line, *values in rows)


def hs_20_100_duty_cycle() -> tuple[OperatingCondition, ...]:
    """Return a duty cycle for the HS-20-100, read from ``problems/data/duty_cycle.csv``.

    Speeds and weights are our own choice, for want of a published one: the paper tests the drive
    under rated conditions only. All lie at or below the rated 2000 r/min and 40 N.m.

    Examples
    --------
    >>> print(f"{sum(one.weight for one in hs_20_100_duty_cycle()):.1f}")
    1.0
    """
    with as_file(files("pymoo_hdte.problems") / "data" / "duty_cycle.csv") as path:
        return load_conditions(path)


def duty_cycle(conditions: Sequence[OperatingCondition]) -> tuple[OperatingCondition, ...]:
    """Return the conditions as a tuple.

    Raises
    ------
    InvalidInput
        If there is none, or an entry is no `OperatingCondition`.
    """
    allowed = "one or more OperatingConditions"
    if not isinstance(conditions, Sequence) or not conditions:
        raise InvalidInput("conditions", conditions, allowed)
    for index, entry in enumerate(conditions):
        if not isinstance(entry, OperatingCondition):
            raise InvalidInput(f"conditions[{index}]", entry, "an OperatingCondition")
    return tuple(conditions)


def shares(conditions: Sequence[OperatingCondition]) -> NDArray[np.float64]:
    """Return the weights as shares of their sum, shape (n_conditions,)."""
    weights = np.array([condition.weight for condition in conditions])
    return weights / weights.sum()


def duty_cycle_dte_arcsec(
    model: DriveModel,
    conditions: Sequence[OperatingCondition],
    parameters: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the DTE of n designs, averaged over the duty cycle, shape (n,), in arcsec.

    Parameters
    ----------
    model : DriveModel
        Its own speed and load do not matter.
    conditions : sequence of OperatingCondition
        At least one.
    parameters : ndarray, shape (n, 5)
        As in `DriveModel.dte_arcsec`.

    Raises
    ------
    UnstableDrive
        If a design has no steady state under one of the conditions; names both.
    """
    average = np.zeros(len(parameters))
    for condition, share in zip(conditions, shares(conditions), strict=True):
        there = model.at(condition.input_speed, condition.load_torque)
        try:
            average += share * there.dte_arcsec(parameters)
        except UnstableDrive as error:
            raise UnstableDrive(f"at {condition}, {error}") from None
    return average


def duty_cycle_dte_where_found(
    model: DriveModel,
    conditions: Sequence[OperatingCondition],
    parameters: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return `duty_cycle_dte_arcsec`, NaN for designs without a steady state somewhere."""
    average = np.zeros(len(parameters))
    for condition, share in zip(conditions, shares(conditions), strict=True):
        there = model.at(condition.input_speed, condition.load_torque)
        average += share * there.dte_where_found(parameters)
    return average


def _condition(place: str, speed: float, load: float, weight: float) -> OperatingCondition:
    # Checked before the change of units, so that an error shows what the file says.
    speed = real_number(f"{place}: speed_rpm", speed, above=0.0)
    load = real_number(f"{place}: load_Nm", load, at_least=0.0)
    weight = real_number(f"{place}: weight", weight, above=0.0, at_most=LARGEST_WEIGHT)
    return OperatingCondition(speed * REVOLUTION_PER_MINUTE, load, weight)
