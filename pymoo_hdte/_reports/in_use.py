"""One command at a time writes to a folder; errors of others name the process that does."""

from __future__ import annotations

import errno
import json
import os
import platform
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from pymoo_hdte._interrupts import GIVEN_BACK
from pymoo_hdte.checks import InvalidInput

if sys.platform != "win32":
    import fcntl

_TRIES = 100
"""How often a folder that vanishes while a file is opened in it is made again; set by hand."""
_LINK = (errno.ELOOP, errno.EMLINK)
"""Error codes for a link that is not followed: of Linux and macOS, and of FreeBSD."""


@contextmanager
def in_use(file: Path, field: str, folder: Path) -> Iterator[None]:
    """Hold a folder for this process by a lock on a file, which ends with the process.

    A process that is killed leaves the file, but no lock: the next one takes it over. Where the
    system has no such locks (Windows), nothing is held.

    Parameters
    ----------
    file : Path
        File to be locked. It and its missing folders are made, and removed afterwards.
    field : str
        The user's name for the folder, for the message.
    folder : Path
        The folder that is to be used by one process.

    Raises
    ------
    InvalidInput
        If another process holds it; the message names that process. If the file is there as a link
        or anything but a regular file.
    OSError
        If the file cannot be made.
    """
    if sys.platform == "win32":
        yield
        return
    made = [parent for parent in file.parents if not parent.exists()]
    lock = _locked(file, field, folder)

    def release() -> None:
        # Removed before it is unlocked: who opened it meanwhile sees that it is no longer there.
        file.unlink(missing_ok=True)
        lock.close()
        for parent in made:
            with suppress(OSError):
                parent.rmdir()

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
        lock = _opened(file, field, folder)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with suppress(FileNotFoundError):
                if os.path.samestat(file.lstat(), os.fstat(lock.fileno())):
                    return lock
        except BlockingIOError:
            allowed = f"a folder that no other command writes to; {_holder(lock)}"
            lock.close()
            raise InvalidInput(field, str(folder), allowed) from None
        lock.close()


def _opened(file: Path, field: str, folder: Path) -> IO[str]:
    # It will be overwritten, and with it whatever a link leads to or shares its content.
    allowed = f"a folder where {file.name} is no link, pipe or device, since it is overwritten"
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_NONBLOCK
    for remaining_tries in reversed(range(_TRIES)):
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(file, flags, 0o666)
            break
        except (FileNotFoundError, FileExistsError):
            # Whoever held it may just be removing the folders that it made.
            if not remaining_tries:
                raise
        except OSError as error:
            if error.errno not in _LINK:
                raise
            raise InvalidInput(field, str(folder), allowed) from None
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode) or status.st_nlink > 1:
        os.close(descriptor)
        raise InvalidInput(field, str(folder), allowed)
    return os.fdopen(descriptor, "a+", encoding="utf-8")


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
