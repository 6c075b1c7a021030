"""Records that a user brings as CSV files, one header line with the unit in every name.

=====================  ============================================================
file                   columns
=====================  ============================================================
torsion loops          ``prototype, repeat, torque_Nm, torsion_arcsec``; ``time_s``
no-load runs           ``prototype, repeat, speed_r_min, torque_Nm``
error measurements     ``prototype, repeat`` and one ``<symbol>_um`` for each error
=====================  ============================================================

``prototype`` and ``repeat`` count from 1. ``time_s`` may be left out; where it stands it must
rise. Columns come in any order and others are ignored. Rows of one prototype and repeat stand
together, in the order in which they were taken. Every error names the file and its line; line 1 is
the header.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.csv_table import LARGEST, read_text_table
from pymoo_hdte._io.text_columns import TextTable
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.identification.damping import NoLoadRun
from pymoo_hdte.identification.prototypes import RunKey
from pymoo_hdte.identification.torsion import TorsionLoop
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

MICROMETRES = "_um"
"""Ending of the columns of an error measurement."""

KEY = ("prototype", "repeat")

Record = TypeVar("Record")


def read_torsion_loops(path: str | Path) -> dict[RunKey, TorsionLoop]:
    """Read torque/torsion loops, by prototype and repeat.

    Parameters
    ----------
    path : str or Path
        Of a CSV file with the columns ``prototype, repeat, torque_Nm, torsion_arcsec`` and, if at
        hand, ``time_s``.

    Returns
    -------
    dict of (int, int) to TorsionLoop
        In N.m and rad.

    Raises
    ------
    InvalidInput
        For a missing column, text, a value that is not finite, time that does not rise, scattered
        rows, or a torque that does not run 0 -> +T -> 0 -> -T -> 0 once.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> loops = read_torsion_loops("bench/torsion.csv")  # doctest: +SKIP
    """

    def loop(run: _Run) -> TorsionLoop:
        if "time_s" in run.columns:
            _check_rising(run, "time_s")
        return TorsionLoop(run.columns["torque_Nm"], run.columns["torsion_arcsec"] * ARCSEC)

    return _read_runs(Path(path), ("torque_Nm", "torsion_arcsec"), ("time_s",), loop)


def read_no_load_runs(path: str | Path) -> dict[RunKey, NoLoadRun]:
    """Read no-load torques over speed, by prototype and repeat.

    Parameters
    ----------
    path : str or Path
        Of a CSV file with the columns ``prototype, repeat, speed_r_min, torque_Nm``.

    Returns
    -------
    dict of (int, int) to NoLoadRun
        In rad/s and N.m.

    Raises
    ------
    InvalidInput
        For a missing column, text, a value that is not finite, scattered rows, speeds that do not
        rise, or fewer than three of them.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> runs = read_no_load_runs("bench/no_load_bearing.csv")  # doctest: +SKIP
    """

    def no_load(run: _Run) -> NoLoadRun:
        _check_rising(run, "speed_r_min")
        speed = run.columns["speed_r_min"] * REVOLUTION_PER_MINUTE
        return NoLoadRun(speed, run.columns["torque_Nm"])

    return _read_runs(Path(path), ("speed_r_min", "torque_Nm"), (), no_load)


def read_error_measurements(path: str | Path) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Read repeated error measurements of prototypes.

    Parameters
    ----------
    path : str or Path
        Of a CSV file with the columns ``prototype, repeat`` and one ``<symbol>_um`` for each error.

    Returns
    -------
    readings : ndarray, shape (n_prototypes, n_errors, n_repeats)
        In micrometres, for `error_statistics`; prototypes and repeats in the order of the file.
    symbols : tuple of str, length n_errors
        In the order of the columns.

    Raises
    ------
    InvalidInput
        For no column of errors, text, a value that is not finite, scattered rows, or prototypes
        with different numbers of repeats.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> values, symbols = read_error_measurements("bench/errors.csv")  # doctest: +SKIP
    """
    table = read_text_table(Path(path), by_hand=True)
    errors = [name for name in table.titles if name.endswith(MICROMETRES)]
    if not errors:
        allowed = f"at least one column that ends in {MICROMETRES}"
        raise InvalidInput(f"{table.file}, line {table.title_line}: columns", table.titles, allowed)
    rows = _rows(table, errors)
    values = np.column_stack([rows.columns[name] for name in errors])
    prototypes: dict[int, dict[int, NDArray[np.float64]]] = {}
    first_lines: dict[int, int] = {}
    for (prototype, repeat), line, readings in zip(rows.keys, rows.lines, values, strict=True):
        repeats = prototypes.setdefault(prototype, {})
        if repeat in repeats:
            raise InvalidInput(f"{table.file}, line {line}: repeat", repeat, "each repeat once")
        repeats[repeat] = readings
        first_lines.setdefault(prototype, line)
    usual = max(map(len, prototypes.values()))
    for number, repeats in prototypes.items():
        if len(repeats) != usual:
            place = f"{table.file}, line {first_lines[number]}"
            field = f"{place}: repeats of prototype {number}"
            raise InvalidInput(field, len(repeats), f"{usual}, as for the others")
    readings = np.array([list(repeats.values()) for repeats in prototypes.values()])
    return readings.transpose(0, 2, 1), tuple(name.removesuffix(MICROMETRES) for name in errors)


@dataclass(frozen=True)
class _Run:
    """Rows by column, with the lines they stand on and the prototype and repeat of each."""

    file: str
    keys: list[RunKey]
    lines: Sequence[int]
    columns: dict[str, NDArray[np.float64]]

    def part(self, start: int, stop: int) -> _Run:
        """Return some of the rows, which follow each other."""
        rows = slice(start, stop)
        columns = {name: column[rows].copy() for name, column in self.columns.items()}
        return _Run(self.file, self.keys[rows], self.lines[rows], columns)


def _read_runs(
    path: Path,
    required: tuple[str, ...],
    optional: tuple[str, ...],
    build: Callable[[_Run], Record],
) -> dict[RunKey, Record]:
    table = read_text_table(path, by_hand=True)
    rows = _rows(table, [*required, *(name for name in optional if name in table.titles)])
    records: dict[RunKey, Record] = {}
    start = 0
    for key, group in groupby(rows.keys):
        run = rows.part(start, start := start + len(list(group)))
        if key in records:
            allowed = "rows of one prototype and repeat next to each other"
            place = f"{run.file}, line {run.lines[0]}"
            raise InvalidInput(f"{place}: (prototype, repeat)", key, allowed)
        records[key] = _located(run, build)
    return records


def _rows(table: TextTable, names: Sequence[str]) -> _Run:
    """Return all rows of a table with these columns, which may hold any finite values."""
    columns = table.numbers([*KEY, *names])
    for name, values in columns.items():
        allowed, good = _allowed(name, values)
        for row in np.flatnonzero(~good)[:1]:
            place = f"{table.file}, line {table.lines[row]}: {name}"
            raise InvalidInput(place, float(values[row]), allowed)
    prototypes, repeats = (columns.pop(name).astype(int).tolist() for name in KEY)
    keys = list(zip(prototypes, repeats, strict=True))
    return _Run(table.file, keys, table.lines, columns)


def _allowed(name: str, values: NDArray[np.float64]) -> tuple[str, NDArray[np.bool_]]:
    """Return which values a column may have, in words, and which of these values are allowed."""
    if name in KEY:
        return "a whole number of at least 1", (values >= 1.0) & (values == np.floor(values))
    return f"at most {LARGEST:g} in size", np.abs(values) <= LARGEST


def _located(run: _Run, build: Callable[[_Run], Record]) -> Record:
    """Build a record; add the lines it stands on to the error of one that is bad as a whole."""
    try:
        return build(run)
    except InvalidInput as error:
        if error.field.startswith(run.file):
            raise
        place = f"{run.file}, lines {run.lines[0]} to {run.lines[-1]}"
        raise InvalidInput(f"{place}: {error.field}", error.value, error.allowed) from None


def _check_rising(run: _Run, name: str) -> None:
    values = run.columns[name]
    for row in 1 + np.flatnonzero(np.diff(values) <= 0.0)[:1]:
        place = f"{run.file}, line {run.lines[row]}: {name}"
        raise InvalidInput(place, float(values[row]), f"above {values[row - 1]:g}, rising")
