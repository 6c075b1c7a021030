"""Files that are either complete or not there, whenever the program is interrupted."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_NEW_FILE = os.O_WRONLY | os.O_CREAT | os.O_EXCL
_FLAGS = _NEW_FILE | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
"""Flags for a new file: a link that somebody has put in its place is not followed."""


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in a folder that is there; a file of that name is replaced in one step.

    Raises
    ------
    OSError
        If it cannot be written; what was there before is then still there.
    """
    with _complete(path, content) as temporary:
        os.replace(temporary, path)


def write_new(path: Path, content: bytes) -> None:
    """Write a file in one step where none is, in a folder that is there.

    Raises
    ------
    FileExistsError
        If there is a file or a link of that name, also one that has appeared meanwhile.
    OSError
        If it cannot be written.
    """
    with _complete(path, content) as temporary:
        try:
            os.link(temporary, path)
        except FileExistsError:
            raise
        except OSError:
            # Some file systems have no links.
            if path.exists() or path.is_symlink():
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path)) from None
            os.replace(temporary, path)


@contextmanager
def _complete(path: Path, content: bytes) -> Iterator[Path]:
    """Write a file beside a path, and take it away in the end if it is still there."""
    # A name that nobody can foresee; tempfile would make a file that others must not read.
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(8)}.tmp")
    descriptor = os.open(temporary, _FLAGS, 0o666)
    try:
        write_all(descriptor, content)
        yield temporary
    finally:
        # On a full disk a partial file remains, which would keep the disk full.
        temporary.unlink(missing_ok=True)


def write_all(descriptor: int, content: bytes) -> None:
    """Write to an open file and close it.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
