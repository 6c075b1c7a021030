"""How much a file may take: the one place that bounds what is read from a disk.

A file is a stranger's: a few megabytes may expand to gigabytes, a line may never end, and a path
may lead to a device. What is larger than the budget is refused by name, before it fills the memory.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path

from pymoo_hdte.checks import InvalidInput

LARGEST_TOML = 2**20
"""Bytes of a TOML file, which people write: the largest of the project has some ten thousand."""


@dataclass(frozen=True)
class Budget:
    """The most that one file of measured data may take.

    An environment variable sets each of them, so that it also holds in worker processes:
    ``PYMOO_HDTE_MOST_BYTES``, ``PYMOO_HDTE_MOST_ROWS`` and ``PYMOO_HDTE_MOST_CHARACTERS``.

    Attributes
    ----------
    bytes : int
        After decompression, of a text or of all arrays of a MATLAB file that are read.
    rows : int
        Lines of a text, or length of an array; each number that is read takes 8 bytes of memory,
        and as much again while it is read.
    characters : int
        Of a line with its end, all lines of a quoted cell, or consecutive blank lines.

    Examples
    --------
    >>> Budget().rows
    10000000
    """

    bytes: int = 2**30
    rows: int = 10_000_000
    characters: int = 2**20

    @classmethod
    def now(cls) -> Budget:
        """Return the budget with what the environment sets.

        Raises
        ------
        InvalidInput
            If a variable is no whole number above 0.
        """
        values = {}
        for limit in fields(cls):
            variable = _variable(limit.name)
            if (text := os.environ.get(variable)) is not None:
                digits = text.strip().replace("_", "")
                if not (digits.isascii() and digits.isdigit() and int(digits[:20])):
                    raise InvalidInput(variable, text, "a whole number above 0")
                values[limit.name] = int(digits[:20])
        return cls(**values)

    def check(self, unit: str, amount: int, where: str) -> None:
        """Refuse an amount above the budget.

        Parameters
        ----------
        unit : {"bytes", "rows", "characters"}
        amount : int
        where : str
            The file, and the part of it that is too large, for the error.

        Raises
        ------
        InvalidInput
            Names the variable of the environment that allows more.
        """
        most = getattr(self, unit)
        if amount > most:
            allowed = f"at most {most} {unit} (the environment variable {_variable(unit)} sets it)"
            raise InvalidInput(where, f"{amount} {unit} or more", allowed)


def _variable(unit: str) -> str:
    return f"PYMOO_HDTE_MOST_{unit.upper()}"


def regular_file(path: Path) -> int:
    """Return the size in bytes of a file that can be read to its end, or of a folder.

    Raises
    ------
    InvalidInput
        For a pipe or a device, whose reading may never end.
    OSError
        If there is none.
    """
    status = path.stat()
    # What is wrong with a folder the system says itself.
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise InvalidInput(path.name, str(path), "a regular file, no pipe or device")
    return status.st_size


@contextmanager
def refused_if_too_large(path: Path) -> Iterator[None]:
    """Refuse, by its name, a file that does not fit into memory.

    Raises
    ------
    InvalidInput
        Instead of a MemoryError inside the block.
    """
    try:
        yield
    except MemoryError:
        allowed = "a file that fits into the memory: take fewer rows or columns, or a part of it"
        raise InvalidInput(path.name, "too large for the memory of this machine", allowed) from None
