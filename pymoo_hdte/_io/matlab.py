"""Vectors of real numbers in MATLAB files, v5 to v7; any bytes give numbers or a clear refusal.

`scipy.io.loadmat` looks an unknown type of numbers up without a check, so that one damaged byte
ends the Python process by a segmentation fault, which nothing can catch (seen in SciPy 1.17.1).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.budget import Budget, regular_file
from pymoo_hdte.checks import InvalidInput

_COMPRESSED, _COMPLEX, _NUMERIC = 15, 0x800, range(6, 16)  # Codes of MATLAB v5, as are these:
_NUMBERS = dict(zip((1, 2, 3, 4, 5, 6, 7, 9, 12, 13), "bBhHiIfdqQ", strict=True))

_HEAD = 2**12
"""Bytes in which flags, shape and name of an array stand: names have 63 characters at most."""


@np.errstate(invalid="ignore")  # Damaged bytes may be signalling NaNs of single precision.
def read_vectors(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Return rows or columns of real numbers by name, each of shape (n,), all of one length.

    Raises
    ------
    InvalidInput
        If the file is damaged or of another version, above its `Budget`, or a name is not that of
        such a vector. Of other arrays nothing but the head is expanded.
    OSError
        If it cannot be read.
    """
    budget = Budget.now()
    descriptions, columns = dict[str, str](), dict[str, NDArray[np.float64]]()
    expanded = 0
    with _refusals(path):
        order, data = _contents(path)
        for name, flags, lengths, start, matrix, packed in _arrays(data, order):
            descriptions[name] = f"MATLAB class {flags & 0xFFF:#x} of shape {lengths}"
            if name in names and _is_vector(flags, lengths):
                budget.check("rows", max(lengths), f"{path.name}: {name}")
                if packed is not None:
                    # Eight bytes at most for a number, and the tag in front of them.
                    matrix = _expanded(packed, start + 16 + 8 * max(lengths))
                    expanded += len(matrix)
                    budget.check("bytes", expanded, f"{path.name}, expanded")
                kind, numbers, _ = _element(matrix, start, order)
                values = np.frombuffer(numbers, order + _NUMBERS[kind]).reshape(lengths)
                columns[name] = values.ravel().astype(float)
    for name in names:
        if name not in columns or columns[name].size != columns[names[0]].size:
            allowed = f"a vector of real numbers, all of one length; there are {descriptions}"
            raise InvalidInput(f"{path.name}: {name}", descriptions.get(name), allowed[:500])
    return columns


def vector_lengths(path: Path) -> dict[str, int]:
    """Return how many numbers each row or column of real numbers has, by name.

    Raises
    ------
    InvalidInput, OSError
        As `read_vectors`.
    """
    with _refusals(path):
        order, data = _contents(path)
        return {
            name: max(lengths)
            for name, flags, lengths, *_ in _arrays(data, order)
            if _is_vector(flags, lengths)
        }


@contextmanager
def _refusals(path: Path) -> Iterator[None]:
    """Refuse the file by name where its bytes are not those of MATLAB."""
    try:
        yield
    except (KeyError, ValueError, struct.error, zlib.error) as error:
        if isinstance(error, InvalidInput):
            raise
        allowed = "an intact MATLAB file (save v4 or v7.3, HDF5, as v5 or v7)"
        raise InvalidInput(path.name, repr(error)[:200], allowed) from None


def _contents(path: Path) -> tuple[str, bytes]:
    """Return the order of bytes and all bytes of a file."""
    Budget.now().check("bytes", regular_file(path), path.name)
    data = path.read_bytes()
    return {b"\0\1IM": "<", b"\1\0MI": ">"}[data[124:128]], data


_Array = tuple[str, int, list[int], int, bytes, bytes | None]


def _arrays(data: bytes, order: str) -> Iterator[_Array]:
    """Yield name, flags, lengths and start of the numbers of each array, and its bytes.

    The last are the array as it stands, and the same if it is compressed.
    """
    at = 128
    while at < len(data):
        kind, matrix, at = _element(data, at, order)
        packed = matrix if kind == _COMPRESSED else None
        head = matrix[:_HEAD]
        if packed is not None:
            head = zlib.decompressobj().decompress(packed, _HEAD)[8:]
        flags = struct.unpack_from(f"{order}8xI", head)[0]
        _, shape, start = _element(head, 16, order)
        _, title, start = _element(head, start, order)
        lengths = np.frombuffer(shape, f"{order}i4").tolist()
        yield title.decode("latin-1"), flags, lengths, start, matrix, packed


def _is_vector(flags: int, lengths: list[int]) -> bool:
    """Tell whether an array is a row or a column of real numbers."""
    numeric = flags & 0xFF in _NUMERIC and not flags & _COMPLEX
    return numeric and math.prod(lengths) == max(lengths)


def _expanded(packed: bytes, most: int) -> bytes:
    """Return an array that was compressed, without its tag; `ValueError` if it is longer."""
    unpacking = zlib.decompressobj()
    matrix = unpacking.decompress(packed, 8 + most)
    # To the end of the stream, where its checksum is compared.
    if unpacking.decompress(unpacking.unconsumed_tail, 1) or not unpacking.eof:
        raise ValueError("an array has other bytes than its shape says")
    return matrix[8:]


def _element(data: bytes, at: int, order: str) -> tuple[int, bytes, int]:
    kind, size = struct.unpack_from(f"{order}II", data, at)
    # Up to four bytes are in the tag itself, their number in its upper half.
    if kind >> 16:
        return kind & 0xFFFF, data[at + 4 : at + 4 + (kind >> 16)], at + 8
    after = at + 8 + size
    return kind, data[at + 8 : after], after if kind == _COMPRESSED else after + -size % 8
