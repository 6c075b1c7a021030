"""Files for long-term storage: npz with a JSON header, versioned, no pickle.

``docs/file_format.md`` describes the files. Files are treated as untrusted: stated sizes are
compared with actual ones, nothing is decompressed, and nothing is ever executed.
"""

from __future__ import annotations

import io
import json
import math
import numbers
import os
import stat
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.whole_file import write_whole
from pymoo_hdte.checks import InvalidInput

LARGEST_FILE = 2**22
"""Bytes: enough for half a million coefficients, as of order 12 in five variables."""

LARGEST_HEADER = 2**18
"""Largest number of characters in a header."""

DEEPEST_HEADER = 50
"""Largest depth of nested lists and tables."""

MOST_AXES = 32
"""Largest number of dimensions of an array; the limit of numpy 1."""

_END_OF_DIRECTORY = struct.Struct("<4s4H2LH")
_MARK_OF_ZIP64 = slice(-_END_OF_DIRECTORY.size - 20, -_END_OF_DIRECTORY.size - 16)
_LARGEST_DIRECTORY = 2**12


@dataclass(frozen=True)
class FileFormat:
    """A kind of file: the names of its header fields and arrays.

    Attributes
    ----------
    name : str
        Written into the file, to distinguish it from other kinds.
    version : int
        Written into files. Those of a later version are refused.
    fields, arrays : tuple of str
        Names in the header, beside ``format`` and ``version``, and of the float64 arrays. A file
        has all of them and no others.
    """

    name: str
    version: int
    fields: tuple[str, ...]
    arrays: tuple[str, ...] = ()

    def write(
        self,
        path: str | os.PathLike[str],
        header: Mapping[str, Any],
        **arrays: NDArray[np.float64],
    ) -> None:
        """Write a file atomically: readers see the former file or the new one, never a part.

        Raises
        ------
        InvalidInput
            If `read` would refuse the file; nothing is written then.
        OSError
            If the file cannot be written.
        """
        contents = io.BytesIO()
        text = _as_json({"format": self.name, "version": self.version, **header})
        np.savez(contents, header=np.array(text), **arrays)  # type: ignore[arg-type]
        self._parsed(contents.getvalue(), str(path))
        write_whole(Path(path), contents.getvalue())

    def read(
        self, path: str | os.PathLike[str]
    ) -> tuple[dict[str, Any], dict[str, NDArray[np.float64]]]:
        """Return the fields of the header, and the arrays, of a file that `write` made.

        Types and values of the fields are the caller's to check; the numbers among them are finite.

        Raises
        ------
        InvalidInput
            If it is no regular file, too large, damaged, of another format or of a later version,
            or has other contents than this format.
        OSError
            If the file cannot be read.
        """
        return self._parsed(_contents_of(Path(path)), str(path))

    def _parsed(
        self, contents: bytes, path: str
    ) -> tuple[dict[str, Any], dict[str, NDArray[np.float64]]]:
        try:
            members = _members(contents)
            header = _header(members.pop("header"))
            self._check(header)
            if set(members) != set(self.arrays):
                raise ValueError(f"its arrays are {sorted(members)}")
            arrays = {name: _array(member) for name, member in members.items()}
        except InvalidInput:
            raise
        # All is in memory here, so that any error of the libraries is caused by the file.
        except Exception as error:
            reason = str(error) or type(error).__name__
            allowed = f"an undamaged file of format {self.name!r} ({reason})"
            raise InvalidInput("path", path, allowed) from error
        return {name: header[name] for name in self.fields}, arrays

    def _check(self, header: Any) -> None:
        stated_format = header.get("format") if isinstance(header, dict) else header
        if not isinstance(header, dict) or stated_format != self.name:
            raise InvalidInput("format of the file", stated_format, repr(self.name))
        version = header.get("version")
        allowed = "version 1" if self.version == 1 else f"versions 1 to {self.version}"
        if type(version) is not int or not 1 <= version <= self.version:
            raise InvalidInput("version of the file", version, allowed)
        wanted = {"format", "version", *self.fields}
        if set(header) != wanted:
            raise InvalidInput("header of the file", sorted(header), f"just {sorted(wanted)}")


def _contents_of(path: Path) -> bytes:
    # Reading a pipe or a device may never end.
    if not stat.S_ISREG(path.stat().st_mode):
        raise InvalidInput("path", str(path), "a regular file")
    with path.open("rb") as file:
        contents = file.read(LARGEST_FILE + 1)
    if len(contents) > LARGEST_FILE:
        size = path.stat().st_size
        raise InvalidInput("size of the file", size, f"at most {LARGEST_FILE} bytes")
    return contents


def _members(contents: bytes) -> dict[str, bytes]:
    """Return the members of a zip file by their names without ``.npy``."""
    if len(contents) > LARGEST_FILE:
        raise ValueError(f"its size is {len(contents)}, allowed: at most {LARGEST_FILE} bytes")
    end = contents[-_END_OF_DIRECTORY.size :]
    mark, *_, directory_size, _, _ = _END_OF_DIRECTORY.unpack(end)
    # zipfile trusts this size, and builds an object for every entry it finds.
    if mark != b"PK\5\6" or contents[_MARK_OF_ZIP64] == b"PK\6\7":
        raise ValueError("it does not end as a plain zip file")
    if directory_size > _LARGEST_DIRECTORY:
        raise ValueError("it has too many members")
    members = {}
    with zipfile.ZipFile(io.BytesIO(contents)) as archive:
        for entry in archive.infolist():
            # Without compression no member is larger than the file, whatever size it states.
            if entry.compress_type != zipfile.ZIP_STORED:
                raise ValueError(f"{entry.filename!r} is compressed")
            name = entry.filename.removesuffix(".npy")
            if name in members or name == entry.filename:
                raise ValueError(f"{entry.filename!r} is there twice, or no array")
            members[name] = archive.read(entry)
    return members


def _array_header(member: bytes) -> tuple[tuple[int, ...], bool, str, bytes]:
    """Return shape, whether the order is Fortran's, type and bytes of an array."""
    stream = io.BytesIO(member)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an array is of another version than 1.0")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    data = member[stream.tell() :]
    if len(shape) > MOST_AXES or dtype.itemsize * math.prod(shape) != len(data):
        raise ValueError(f"an array of {dtype.str} and shape {shape} has {len(data)} bytes")
    return shape, fortran, dtype.str, data


def _array(member: bytes) -> NDArray[np.float64]:
    shape, fortran, kind, data = _array_header(member)
    if kind != "<f8":
        raise ValueError(f"an array is of {kind}, allowed: <f8")
    return np.frombuffer(data, kind).reshape(shape, order="F" if fortran else "C")


def _header(member: bytes) -> Any:
    shape, _, kind, data = _array_header(member)
    if shape != () or not kind.startswith("<U") or len(data) > 4 * LARGEST_HEADER:
        raise ValueError(f"the header is no text of at most {LARGEST_HEADER} characters")
    header = json.loads(
        data.decode("utf-32-le"),
        object_pairs_hook=_table,
        parse_float=_finite,
        parse_int=_whole,
        parse_constant=_finite,
    )
    level, depth = [header], 0
    while level := [part for part in level if isinstance(part, dict | list)]:
        depth += 1
        if depth > DEEPEST_HEADER:
            raise ValueError(f"the header is nested deeper than {DEEPEST_HEADER}")
        parts = [part.values() if isinstance(part, dict) else part for part in level]
        level = [member for some in parts for member in some]
    return header


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        raise ValueError("a field is there twice")
    return table


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:20]} is not finite")
    return number


def _whole(text: str) -> int:
    _finite(text)
    return int(text)


def _as_json(header: Mapping[str, Any]) -> str:
    try:
        return json.dumps(header, allow_nan=False, default=_plain_number)
    except (TypeError, ValueError, RecursionError) as error:
        allowed = f"words, finite numbers, lists and tables ({error})"
        raise InvalidInput("header", dict(header), allowed) from None


def _plain_number(value: Any) -> int | float:
    """Return a NumPy number, which JSON does not know, as a Python number."""
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value)
    raise TypeError(f"{value!r} is no number")
