"""Mutations of folders: typing errors, other programs' changes, disk faults and pranks.

A mutated folder is a pure function of the folder and the generator.
"""

from __future__ import annotations

import gzip
import io
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.studies.reliability.text import BYTES, TEXTS, encoded, pick


@dataclass(frozen=True)
class Link:
    """A symbolic link to ``target``."""

    target: str


@dataclass(frozen=True)
class Folder:
    """A folder in the place of a file."""


Files = dict[str, bytes | Link | Folder]
"""Contents of a folder, by name."""

MOST_MUTATIONS = 3
"""In one input."""
SHARES = {"folder": 0.08, "bytes": 0.12, "array": 0.06, "encoding": 0.06}
"""Of the mutations; the others change the text inside a file, if there is one."""


def mutated(files: Files, rng: np.random.Generator) -> tuple[Files, list[str]]:
    """Return the files after one to three mutations, and the names of these."""
    files, names = dict(files), []
    for _ in range(rng.integers(1, MOST_MUTATIONS + 1)):
        if files:
            # With equal chances the table that names all other files would hardly ever change.
            tables = [name for name in files if name.endswith(".toml")]
            name = pick(tables if tables and rng.random() < 0.5 else list(files), rng)
            names.append(f"{_mutate(files, name, rng)} of {name}")
    return files, names


def put(files: Files, folder: Path) -> None:
    """Write files into a new folder."""
    folder.mkdir()
    for name, content in files.items():
        path = folder / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        elif isinstance(content, Link):
            path.symlink_to(content.target)
        else:
            path.mkdir()


def _mutate(files: Files, name: str, rng: np.random.Generator) -> str:
    """Change one file in its folder, and say how."""
    content = files[name]
    where = rng.choice([*SHARES, "text"], p=[*SHARES.values(), 1.0 - sum(SHARES.values())])
    if where == "folder" or not isinstance(content, bytes):
        choices = (None, Folder(), Link(name), Link("nowhere"), Link("."), *files)
        replacement: Folder | Link | str | None = pick(choices, rng)
        if replacement is None:
            del files[name]
        elif isinstance(replacement, str):
            files[name] = files[replacement]
        else:
            files[name] = replacement
        return f"replacement by {replacement}"
    text = _text_of(name, content)
    if where == "array" and name.endswith(".npz") and text is not None:
        files[name] = _archive(text, _strange_array(rng))
        return "strange array"
    if where == "encoding" and text is not None and not name.endswith(".npz"):
        files[name] = _packed(name, encoded(text, rng))
        return "encoding"
    if where == "bytes" or text is None:
        of_bytes = pick(BYTES, rng)
        files[name] = of_bytes(content, rng)
        return of_bytes.__name__
    of_text = pick(TEXTS, rng)
    changed = of_text(text, rng)
    if name.endswith(".npz"):
        with np.load(io.BytesIO(content)) as arrays:
            files[name] = _archive(changed, arrays["coefficients"])
    else:
        files[name] = _packed(name, changed.encode())
    return of_text.__name__


def _text_of(name: str, content: bytes) -> str | None:
    """Return the text inside a file, the header of an npz file; None where there is none."""
    # Whatever an earlier mutation left of the file.
    with suppress(Exception):
        if name.endswith(".gz"):
            return gzip.decompress(content).decode()
        if name.endswith(".npz"):
            with np.load(io.BytesIO(content)) as arrays:
                return str(arrays["header"]) if arrays["coefficients"].ndim else None
        if not name.endswith(".mat"):
            return content.decode()
    return None


def _packed(name: str, raw: bytes) -> bytes:
    return gzip.compress(raw, compresslevel=1, mtime=0) if name.endswith(".gz") else raw


def _archive(header: str, array: NDArray[Any]) -> bytes:
    packed = io.BytesIO()
    np.savez(packed, header=np.array(header), coefficients=array)
    return packed.getvalue()


def _strange_array(rng: np.random.Generator) -> NDArray[Any]:
    strange = (
        *(np.full((2, 2), np.nan), np.ones((3, 3), complex), np.array([["a", "b"], ["c", "d"]])),
        *(np.empty((0, 2)), np.array(1.0), np.array([[None]], dtype=object), np.ones((2, 2), bool)),
        *(np.ones((2, 2, 2)), np.full((2, 2), 1e308), np.ones((2, 2), int), np.ones(10**6)),
        np.array([["2020-01-01"] * 2] * 2, dtype="M8[D]"),
    )
    return pick(strange, rng)
