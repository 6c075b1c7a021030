"""Formats that hold columns as arrays by name: one reader for each, found by the file's ending.

MATLAB up to v7, NumPy's npz and JSON lines need nothing else; xlsx needs openpyxl, and HDF5, which
MATLAB v7.3 is, needs h5py. The extra `EXTRA` brings both, and `ROS_EXTRA` what logs of ROS need.
"""

from __future__ import annotations

import importlib
import json
import math
import tokenize
import zipfile
import zlib
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io import matlab, ros_logs
from pymoo_hdte._io.budget import Budget, regular_file
from pymoo_hdte._io.text_header import MOST_LINES_ABOVE
from pymoo_hdte._io.text_lines import line_blocks
from pymoo_hdte.checks import InvalidInput

EXTRA = "pymoo-hdte[formats]"
"""What to install for xlsx, HDF5 and MATLAB v7.3."""
ROS_EXTRA = "pymoo-hdte[ros]"
"""What to install for rosbag2 and MCAP."""

_HDF5 = b"\x89HDF\r\n\x1a\n"
_USER_BLOCK = 512
"""Bytes in which MATLAB v7.3 writes its own header, before HDF5 begins."""


@dataclass(frozen=True, eq=False)
class Arrays:
    """Vectors by name, each of shape (n,), and how many rows of the file stand above the first."""

    vectors: dict[str, NDArray[np.float64]]
    above: int = 0


def read_arrays(path: Path, form: str, names: Sequence[str]) -> Arrays:
    """Read vectors of a file.

    Parameters
    ----------
    path : Path
    form : str
        One of `READERS`.
    names : sequence of str
        Names of variables, keys, titles, or paths of data sets. A missing value becomes NaN.

    Raises
    ------
    InvalidInput
        For a file that is damaged or above its `Budget`, a name that is not that of a vector of
        real numbers, vectors of several lengths, or a library that is not installed.
    OSError
        If it cannot be read.
    """
    Budget.now().check("bytes", regular_file(path), path.name)
    return READERS[form][1](path, names)


def format_of(path: Path, form: str) -> str:
    """Return the format of a file: as stated, unless its name ends like a file of arrays."""
    if form == "csv":
        for actual_form, (endings, _) in READERS.items():
            if path.name.endswith(endings):
                return actual_form
    return form


def _library(name: str, path: Path, extra: str = EXTRA) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        allowed = f'a file that needs {name}, after: pip install "{extra}"'
        if path.suffix == ".mat":
            allowed += "; or save it as v5 or v7"
        raise InvalidInput(
            path.name, f"a file for {name}, which is not installed", allowed
        ) from None


def _checked(
    path: Path, names: Sequence[str], arrays: Mapping[str, Any], there: Sequence[str]
) -> dict[str, NDArray[np.float64]]:
    """Return arrays as vectors, all of one length.

    An array needs a ``dtype`` and a ``shape``, and is read by ``array[...]`` once these, and all
    arrays together, keep the budget.
    """
    budget, expanded = Budget.now(), 0
    right: dict[str, Any] = {}
    for name in names:
        values, shown = arrays.get(name), None
        if values is not None:
            shape = tuple(values.shape)
            shown = f"{values.dtype} of shape {list(shape)}"
            length = max(shape, default=0)
            same = all(length == max(vector.shape) for vector in right.values())
            if values.dtype.kind in "iuf" and math.prod(shape) == length > 0 and same:
                right[name] = values
                budget.check("rows", length, f"{path.name}: {name}")
                # A file may hold chunks that are larger than what is in them.
                chunk = math.prod(getattr(values, "chunks", None) or ())
                expanded += max(length, chunk) * values.dtype.itemsize
        if name not in right:
            allowed = f"a vector of real numbers, all of one length; there are {list(there)}"
            raise InvalidInput(f"{path.name}: {name}", shown, allowed[:500])
    budget.check("bytes", expanded, f"{path.name}, expanded")
    return {name: np.ravel(values[...]).astype(float) for name, values in right.items()}


def _read_matlab(path: Path, names: Sequence[str]) -> Arrays:
    with path.open("rb") as file:
        start = file.read(_USER_BLOCK + len(_HDF5))
    if start.startswith(_HDF5) or start[_USER_BLOCK:] == _HDF5:
        return _read_hdf5(path, names)
    return Arrays(matlab.read_vectors(path, names))


def _read_hdf5(path: Path, names: Sequence[str]) -> Arrays:
    h5py = _library("h5py", path)
    try:
        with h5py.File(path, "r") as file:
            arrays = {}
            for name in names:
                data = file.get(name)
                # Links lead to other files, which nobody named.
                own = isinstance(data, h5py.Dataset) and data.file.filename == file.filename
                if own and not data.is_virtual and data.external is None:
                    arrays[name] = data
            return Arrays(_checked(path, names, arrays, list(file)))
    except InvalidInput:
        raise
    except (OSError, ValueError, KeyError, RuntimeError, TypeError) as error:
        allowed = "an intact HDF5 file, or a MATLAB file saved as v5 or v7"
        raise InvalidInput(path.name, str(error)[:200], allowed) from None


_DAMAGED = (
    *(OSError, ValueError, LookupError, TypeError, EOFError, RuntimeError, SyntaxError),
    *(zlib.error, zipfile.BadZipFile, tokenize.TokenError),
)
"""Errors that libraries raise for damaged packed files."""


@dataclass(frozen=True)
class _Member:
    """An array of an npz file, read when its values are taken; type and shape are in its head."""

    archive: Any
    name: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def __getitem__(self, _: Any) -> NDArray[Any]:
        return np.asarray(self.archive[self.name])


def _member(archive: Any, name: str) -> _Member:
    """Return an array of an open npz file; `ValueError` if it does not hold numbers."""
    with archive.zip.open(f"{name}.npy") as file:
        version = np.lib.format.read_magic(file)
        heads = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }
        shape, _, dtype = heads[version](file)
    return _Member(archive, name, dtype, shape)


def _check_zip(path: Path, wanted: Callable[[str], bool]) -> list[str]:
    """Return the names in a zip file, whose wanted members together fit into the budget."""
    with zipfile.ZipFile(path) as packed:
        members = packed.infolist()
    size = sum(member.file_size for member in members if wanted(member.filename))
    Budget.now().check("bytes", size, f"{path.name}, expanded")
    return [member.filename for member in members]


def _read_npz(path: Path, names: Sequence[str]) -> Arrays:
    try:
        members = _check_zip(path, lambda member: member.removesuffix(".npy") in names)
        there = [member.removesuffix(".npy") for member in members]
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: _member(file, name) for name in names if name in there}
            return Arrays(_checked(path, names, arrays, there))
    except InvalidInput:
        raise
    except _DAMAGED as error:
        if isinstance(error, OSError) and not path.is_file():
            raise
        raise InvalidInput(path.name, str(error)[:200], "an intact npz file of numbers") from None


def _read_json_lines(path: Path, names: Sequence[str]) -> Arrays:
    columns = {name: array("d") for name in names}
    there: list[str] = []
    for numbers, lines in line_blocks(path, "JSON lines"):
        for number, line in zip(numbers, lines, strict=True):
            place = f"{path.name}, line {number}"
            try:
                row = json.loads(line)
            except (ValueError, RecursionError) as error:
                raise InvalidInput(place, str(error), "one JSON object in each line") from None
            if not isinstance(row, dict):
                raise InvalidInput(place, row, "one JSON object in each line")
            there = there or list(row)
            for name, column in columns.items():
                value = row.get(name)
                if isinstance(value, bool) or not isinstance(value, int | float | None):
                    raise InvalidInput(f"{place}: {name}", value, "a number")
                try:
                    column.append(np.nan if value is None else value)
                except OverflowError:
                    raise InvalidInput(f"{place}: {name}", value, "a finite number") from None
    arrays = {name: np.array(column) for name, column in columns.items()}
    known = {name: column for name, column in arrays.items() if not np.all(np.isnan(column))}
    return Arrays(_checked(path, names, known, there))


@contextmanager
def _rows_of_sheet(path: Path, most: int | None = None) -> Iterator[Iterator[tuple[Any, ...]]]:
    """Give the rows of the first sheet; file and sheet are closed wherever reading ends."""
    openpyxl = _library("openpyxl", path)
    try:
        _check_zip(path, lambda _: True)
        with closing(openpyxl.load_workbook(path, read_only=True, data_only=True)) as book:
            sheet = book.worksheets[0]
            # What a sheet says of its size may be too small, and rows beyond it would be left out.
            sheet.reset_dimensions()
            # Rows keep the file open until they end or are closed, whatever becomes of the book.
            with closing(sheet.iter_rows(values_only=True, max_row=most)) as rows:
                yield rows
    except InvalidInput:
        raise
    except _DAMAGED as error:
        if isinstance(error, OSError) and not path.is_file():
            raise
        raise InvalidInput(path.name, str(error)[:200], "an intact xlsx file") from None


def _read_xlsx(path: Path, names: Sequence[str]) -> Arrays:
    budget = Budget.now()
    with _rows_of_sheet(path) as rows:
        titles: list[str] = []
        above = 0
        for row in rows:
            above += 1
            cells = ["" if cell is None else str(cell).strip() for cell in row]
            titles = max(
                titles, cells, key=lambda candidate: sum(candidate.count(n) == 1 for n in names)
            )
            if all(cells.count(name) == 1 for name in names):
                break
            if above >= MOST_LINES_ABOVE:
                break
        if not all(titles.count(name) == 1 for name in names):
            allowed = f"{', '.join(names)}, each once, in the first sheet"
            raise InvalidInput(f"{path.name}: columns", titles, allowed)
        places = [titles.index(name) for name in names]
        columns = [array("d") for _ in names]
        row_of_file, first_row = above, True
        for row in rows:
            row_of_file += 1
            budget.check("rows", row_of_file, f"{path.name}: rows")
            values = [row[at] if at < len(row) else None for at in places]
            # Units may stand below the titles.
            if first_row and any(isinstance(cell, str) for cell in values):
                first_row, above = False, above + 1
                if not any(isinstance(cell, int | float) for cell in values):
                    continue
            first_row = False
            for name, column, value in zip(names, columns, values, strict=True):
                if isinstance(value, bool) or not isinstance(value, int | float | None):
                    place = f"{path.name}, row {row_of_file}: {name}"
                    raise InvalidInput(place, value, "a number")
                column.append(np.nan if value is None else value)
    arrays = {name: np.array(column) for name, column in zip(names, columns, strict=True)}
    # Sheets have rows that were formatted and never filled.
    filled = np.flatnonzero(np.any([~np.isnan(column) for column in arrays.values()], axis=0))
    n_rows = int(filled[-1]) + 1 if filled.size else 0
    arrays = {name: column[:n_rows] for name, column in arrays.items()}
    return Arrays(_checked(path, names, arrays, titles), above)


def _read_ros(path: Path, names: Sequence[str]) -> Arrays:
    library = partial(_library, path=path, extra=ROS_EXTRA)
    columns, there = ros_logs.joint_columns(path, names, library)
    return Arrays(_checked(path, names, columns, there))


READERS: dict[str, tuple[tuple[str, ...], Callable[[Path, Sequence[str]], Arrays]]] = {
    "matlab": ((".mat",), _read_matlab),
    "json_lines": ((".jsonl", ".ndjson", ".jsonl.gz", ".ndjson.gz"), _read_json_lines),
    "npz": ((".npz",), _read_npz),
    "xlsx": ((".xlsx",), _read_xlsx),
    "hdf5": ((".h5", ".hdf5"), _read_hdf5),
    **{form: (endings, _read_ros) for form, endings in ros_logs.ENDINGS.items()},
}
"""The endings of file names and the reader of each format."""


def vector_names(path: Path, form: str) -> list[str]:
    """Return names of vectors of numbers of one length, of those of which a file has most numbers.

    Parameters
    ----------
    path : Path
    form : str
        One of `READERS`.

    Raises
    ------
    InvalidInput
        As `read_arrays`.
    OSError
        If it cannot be read.
    """
    Budget.now().check("bytes", regular_file(path), path.name)
    if form in ("json_lines", "xlsx"):
        return _names_of_json_lines(path) if form == "json_lines" else _names_of_xlsx(path)
    lengths = {"matlab": _lengths_of_matlab, "npz": _lengths_of_npz, "hdf5": _lengths_of_hdf5}
    by_length: dict[int, list[str]] = {}
    for name, length in lengths[form](path).items():
        by_length.setdefault(length, []).append(name)
    most = max(by_length, key=lambda length: length * len(by_length[length]), default=0)
    return by_length[most] if most > 1 else []


def _length(shape: Sequence[int], kind: str) -> int:
    """Return the length of an array if it is a vector of numbers, else 0."""
    length = max(shape, default=0)
    return length if kind in "iuf" and math.prod(shape) == length else 0


def _lengths_of_matlab(path: Path) -> dict[str, int]:
    with path.open("rb") as file:
        start = file.read(_USER_BLOCK + len(_HDF5))
    if start.startswith(_HDF5) or start[_USER_BLOCK:] == _HDF5:
        return _lengths_of_hdf5(path)
    return matlab.vector_lengths(path)


def _lengths_of_npz(path: Path) -> dict[str, int]:
    try:
        names = [name for name in _check_zip(path, lambda _: False) if name.endswith(".npy")]
        with np.load(path, allow_pickle=False) as file:
            members = [_member(file, name.removesuffix(".npy")) for name in names]
            return {member.name: _length(member.shape, member.dtype.kind) for member in members}
    except _DAMAGED as error:
        if isinstance(error, OSError) and not path.is_file():
            raise
        raise InvalidInput(path.name, str(error)[:200], "an intact npz file of numbers") from None


def _lengths_of_hdf5(path: Path) -> dict[str, int]:
    h5py = _library("h5py", path)
    lengths: dict[str, int] = {}

    def note(name: str, data: Any) -> None:
        if isinstance(data, h5py.Dataset):
            lengths[name] = _length(data.shape or (), data.dtype.kind)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(note)
    except (OSError, ValueError, KeyError, RuntimeError, TypeError) as error:
        allowed = "an intact HDF5 file, or a MATLAB file saved as v5 or v7"
        raise InvalidInput(path.name, str(error)[:200], allowed) from None
    return lengths


def _names_of_json_lines(path: Path) -> list[str]:
    _, lines = next(line_blocks(path, "JSON lines"), (range(0), []))
    try:
        row = json.loads(lines[0]) if lines else {}
    except (ValueError, RecursionError) as error:
        allowed = "one JSON object in each line"
        raise InvalidInput(f"{path.name}, line 1", str(error), allowed) from None
    pairs = row.items() if isinstance(row, dict) else ()
    return [
        name
        for name, value in pairs
        if isinstance(value, int | float) and not isinstance(value, bool)
    ]


def _names_of_xlsx(path: Path) -> list[str]:
    with _rows_of_sheet(path, MOST_LINES_ABOVE) as rows:
        titles: list[str] = []
        for row in rows:
            numbers = [isinstance(cell, int | float) and cell is not True for cell in row]
            if titles and any(numbers):
                return [
                    title
                    for title, number in zip(titles, numbers, strict=False)
                    if title and number and titles.count(title) == 1
                ]
            words = ["" if cell is None else str(cell).strip() for cell in row]
            # Units below the titles have no more cells than these.
            if sum(map(bool, words)) > sum(map(bool, titles)):
                titles = words
    return []
