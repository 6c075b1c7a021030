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

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.identification.damping import NoLoadRun
from pymoo_hdte.identification.prototypes import RunKey
from pymoo_hdte.identification.torsion import TorsionLoop
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

MICROMETRES = "_um"
"""Ending of the columns of an error measurement."""

KEY = ("prototype", "repeat")

LARGEST = 1e15
"""In any unit of the columns; beyond it nobody measures, and the squares of a fit overflow."""

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
    """
    path = Path(path)
    lines = _lines(path)
    header = lines[0][1]
    errors = [name for name in header if name.endswith(MICROMETRES)]
    if not errors:
        allowed = f"at least one column that ends in {MICROMETRES}"
        raise InvalidInput(f"{path.name}, line 1: columns", header, allowed)
    prototypes: dict[int, list[list[float]]] = {}
    first_lines: dict[int, int] = {}
    seen: set[RunKey] = set()
    for row in _rows(path, lines, tuple(errors), ()):
        if row.key in seen:
            raise InvalidInput(f"{row.place}: repeat", row.key[1], "each repeat once")
        seen.add(row.key)
        first_lines.setdefault(row.key[0], row.line)
        prototypes.setdefault(row.key[0], []).append([row.values[name] for name in errors])
    counts = {number: len(repeats) for number, repeats in prototypes.items()}
    usual = max(counts.values())
    for number, count in counts.items():
        if count != usual:
            place = f"{path.name}, line {first_lines[number]}"
            field = f"{place}: repeats of prototype {number}"
            raise InvalidInput(field, count, f"{usual}, as for the others")
    readings = np.array(list(prototypes.values())).transpose(0, 2, 1)
    return readings, tuple(name.removesuffix(MICROMETRES) for name in errors)


@dataclass(frozen=True)
class _Row:
    path: Path
    line: int
    key: RunKey
    values: dict[str, float]

    @property
    def place(self) -> str:
        return f"{self.path.name}, line {self.line}"


@dataclass(frozen=True)
class _Run:
    """All rows of one prototype and repeat, by column, with the lines they stand on."""

    path: Path
    lines: list[int]
    columns: dict[str, NDArray[np.float64]]


def _read_runs(
    path: Path,
    required: tuple[str, ...],
    optional: tuple[str, ...],
    build: Callable[[_Run], Record],
) -> dict[RunKey, Record]:
    records: dict[RunKey, Record] = {}
    rows = _rows(path, _lines(path), required, optional)
    for key, group in groupby(rows, key=lambda row: row.key):
        members = list(group)
        if key in records:
            allowed = "rows of one prototype and repeat next to each other"
            raise InvalidInput(f"{members[0].place}: (prototype, repeat)", key, allowed)
        names = members[0].values
        columns = {name: np.array([row.values[name] for row in members]) for name in names}
        run = _Run(path, [row.line for row in members], columns)
        records[key] = _located(run, build)
    return records


def _located(run: _Run, build: Callable[[_Run], Record]) -> Record:
    """Build a record; add the lines it stands on to the error of one that is bad as a whole."""
    try:
        return build(run)
    except InvalidInput as error:
        if error.field.startswith(run.path.name):
            raise
        place = f"{run.path.name}, lines {run.lines[0]} to {run.lines[-1]}"
        raise InvalidInput(f"{place}: {error.field}", error.value, error.allowed) from None


def _check_rising(run: _Run, name: str) -> None:
    values = run.columns[name]
    falls = np.flatnonzero(np.diff(values) <= 0.0)
    if falls.size:
        where = int(falls[0]) + 1
        place = f"{run.path.name}, line {run.lines[where]}: {name}"
        raise InvalidInput(place, float(values[where]), f"above {values[where - 1]:g}, rising")


def _lines(path: Path) -> list[tuple[int, list[str]]]:
    """Return line number and cells of the header and of every line that is not blank."""
    lines = []
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        try:
            for cells in reader:
                if any(cell.strip() for cell in cells):
                    lines.append((reader.line_num, [cell.strip() for cell in cells]))
        except (UnicodeDecodeError, csv.Error) as error:
            place = f"{path.name}, line {reader.line_num + 1}"
            raise InvalidInput(place, str(error), "CSV text in UTF-8") from None
    if len(lines) < 2:
        field = f"{path.name}, line 1: number of lines"
        raise InvalidInput(field, len(lines), "a header line and at least one row of numbers")
    return lines


def _rows(
    path: Path,
    lines: Sequence[tuple[int, list[str]]],
    required: tuple[str, ...],
    optional: tuple[str, ...],
) -> Iterator[_Row]:
    (header_line, header), *body = lines
    required = (*KEY, *required)
    if any(header.count(name) != 1 for name in required):
        allowed = f"the columns {', '.join(required)}, each once"
        raise InvalidInput(f"{path.name}, line {header_line}: columns", header, allowed)
    wanted = {name: header.index(name) for name in (*required, *optional) if name in header}
    for line, cells in body:
        place = f"{path.name}, line {line}"
        if len(cells) != len(header):
            allowed = f"{len(header)}, as in the header"
            raise InvalidInput(f"{place}: number of cells", len(cells), allowed)
        values = {name: _number(f"{place}: {name}", cells[at]) for name, at in wanted.items()}
        prototype, repeat = (_counted(f"{place}: {name}", values.pop(name)) for name in KEY)
        yield _Row(path, line, (prototype, repeat), values)


def _number(field: str, cell: str) -> float:
    try:
        number = real_number(field, float(cell))
    except ValueError:
        raise InvalidInput(field, cell, "a finite number") from None
    return real_number(field, number, at_least=-LARGEST, at_most=LARGEST)


def _counted(field: str, value: float) -> int:
    if value < 1.0 or value != int(value):
        raise InvalidInput(field, value, "a whole number of at least 1")
    return int(value)
