"""One command at a time writes to a folder; the others are told which one does."""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.interrupts import GIVEN_BACK

if sys.platform != "win32":
    import fcntl

_TRIES = 100
"""How often a folder that vanishes while a file is opened in it is made again; by hand."""


@contextmanager
def in_use(file: Path, field: str, folder: Path) -> Iterator[None]:
    """Hold a folder for this process by a lock on a file, which ends with the process.

    A process that is killed leaves the file, but no lock: the next one takes it over. Where the
    system has no such locks (Windows), nothing is held.

    Parameters
    ----------
    file : Path
        To be locked; it, and folders that are missing for it, are made and removed again.
    field : str
        What the folder is to the user, for the message.
    folder : Path
        The folder that is to be used by one process.

    Raises
    ------
    InvalidInput
        If another process holds it; the message names that process.
    OSError
        If the file cannot be made.
    """
    if sys.platform == "win32":
        yield
        return
    made = [one for one in file.parents if not one.exists()]
    lock = _locked(file, field, folder)

    def release() -> None:
        # Removed before it is unlocked: who opened it meanwhile sees that it is no longer there.
        file.unlink(missing_ok=True)
        lock.close()
        for one in made:
            with suppress(OSError):
                one.rmdir()

    GIVEN_BACK.append(release)
    try:
        _describe(lock)
        yield
    finally:
        GIVEN_BACK.remove(release)
        release()


def _locked(file: Path, field: str, folder: Path) -> IO[str]:
    """Return the open file with its lock, as soon as it is the file of that name."""
    while True:
        lock = _opened(file)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(file.stat(), os.fstat(lock.fileno())):
                    return lock
        except BlockingIOError:
            allowed = f"a folder that no other command writes to; {_holder(lock)}"
            lock.close()
            raise InvalidInput(field, str(folder), allowed) from None
        lock.close()


def _opened(file: Path) -> IO[str]:
    for left in reversed(range(_TRIES)):
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            return open(file, "a+", encoding="utf-8")
        except (FileNotFoundError, FileExistsError):
            # Whoever held it may just be removing the folders that it made.
            if not left:
                raise
    raise AssertionError


def _describe(lock: IO[str]) -> None:
    lock.truncate(0)
    command = " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])
    about = {"process": os.getpid(), "machine": platform.node(), "command": command}
    lock.write(json.dumps(about | {"since": time.strftime("%Y-%m-%d %H:%M:%S")}))
    lock.flush()


def _holder(lock: IO[str]) -> str:
    lock.seek(0)
    try:
        about = json.loads(lock.read())
        return (
            f"process {about['process']} on {about['machine']} does since {about['since']} "
            f"({about['command']})"
        )
    except (ValueError, LookupError, TypeError):
        # It has only just taken the lock.
        return "another process does"
