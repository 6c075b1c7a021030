"""One numeric array and a JSON header in one file, without pickle, written whole or not at all."""

from __future__ import annotations

import contextlib
import io
import json
import os
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput

FORMAT = "pymoo_hdte Chebyshev surrogate"
VERSION = 1

_UNREADABLE = (
    ValueError,
    KeyError,
    EOFError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
)


def write_archive(
    path: str | os.PathLike[str], header: dict[str, Any], array: NDArray[np.float64]
) -> None:
    """Write an npz file atomically: readers see the former file or the new one, never a part."""
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    text = json.dumps({"format": FORMAT, "version": VERSION, **header}, allow_nan=False)
    try:
        with temporary.open("wb") as file:
            np.savez(file, header=np.array(text), coefficients=array)
        os.replace(temporary, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()


def read_archive(path: str | os.PathLike[str]) -> tuple[dict[str, Any], NDArray[np.float64]]:
    """Return header and array of a file that `write_archive` made.

    Raises
    ------
    InvalidInput
        If the file is damaged, of another format, or of a later version.
    OSError
        If the file cannot be opened.
    """
    contents = io.BytesIO(Path(path).read_bytes())
    try:
        # Checksums first: numpy would trust sizes that a damaged file states.
        damaged = zipfile.ZipFile(contents).testzip()
        if damaged is not None:
            raise zipfile.BadZipFile(damaged)
        contents.seek(0)
        with np.load(contents, allow_pickle=False) as arrays:
            header = json.loads(str(arrays["header"]))
            coefficients = arrays["coefficients"]
    except _UNREADABLE as error:
        raise InvalidInput(
            "path", str(path), f"an undamaged file of format {FORMAT!r} ({error})"
        ) from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        found = header.get("format") if isinstance(header, dict) else header
        raise InvalidInput("format of the file", found, repr(FORMAT))
    if header.get("version") != VERSION:
        raise InvalidInput("version of the file", header.get("version"), f"version {VERSION}")
    return header, coefficients
