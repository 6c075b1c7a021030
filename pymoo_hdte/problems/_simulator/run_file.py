"""Finished runs of a simulator on disk, from which a killed study goes on."""

from __future__ import annotations

import json
import math
import os
import stat
import sys
import warnings
import weakref
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.children import limit_in

if sys.platform != "win32":
    import fcntl

_SAME = 1e-6
"""Relative difference of two runs of one simulator, on two machines say; set by hand."""
_RERUNS = 5
"""Runs of a file that are made again, one after the other, until one does not fail; by hand. Also
the largest number of damaged lines that are listed."""
_SHOWN = 80
"""Characters that are shown of the reason why a line is damaged; set by hand."""
_DAMAGED = (ValueError, TypeError, OverflowError, RecursionError)
"""What is raised by a line that is no JSON, or other JSON than a run file has: no text in UTF-8,
too many digits, nested too deeply, a number beyond those of floats, another type."""


class RunFile:
    """Finished runs on disk, one line each, written before the next is waited for.

    The file only grows. A line that a killed process left unfinished is dropped, and a damaged one
    is left out: their runs are made again. Numbers are kept to the last bit. While it is open no
    other process may open it, except on Windows.

    Parameters
    ----------
    path : str or path-like
        The file; it is made if it is not there.
    names : tuple of str
        Names of the simulator's inputs. A file with other names is refused.
    simulator : str or None
        What tells the simulator from others (`pymoo_hdte.problems._simulator.identity`).

    Attributes
    ----------
    runs : dict
        Results of the simulator, by inputs.
    failures : dict
        Reasons why runs gave no result, by inputs.
    order : dict
        Position of each run in the order in which they ended, from 0, by inputs.
    responses : tuple of str
        Names of the results; empty before the first run.
    goes_on : bool
        Whether this simulator wrote the file and was stopped before the study's end.

    Raises
    ------
    InvalidInput
        If the file holds runs of other inputs, is none of these files, or another process writes
        to it.
    OSError
        If it cannot be read or written.

    Warns
    -----
    RuntimeWarning
        If lines are damaged; tells their numbers, from 1.
    """

    def __init__(
        self, path: str | os.PathLike[str], names: tuple[str, ...], simulator: str | None
    ) -> None:
        self.path = Path(path)
        self._names, self._simulator = names, simulator
        self.runs: dict[tuple[float, ...], Any] = {}
        self.failures: dict[tuple[float, ...], str] = {}
        self.order: dict[tuple[float, ...], int] = {}
        self.responses: tuple[str, ...] = ()
        self.goes_on = self._finished = False
        self._width = 0  # How many responses a run gave; 0 before the first.
        self._open_alone()
        contents = self._contents()
        whole = contents[: contents.rfind(b"\n") + 1]
        # A file without a line is what a kill left of the first one.
        beginning = json.dumps({"inputs": list(names), "simulator": ""})[:-2].encode()
        if not whole and not beginning.startswith(contents[: len(beginning)]):
            raise InvalidInput("cache", str(self.path), "a file of finished runs")
        if whole:
            self._read(whole)
        if len(whole) < len(contents):
            # Not written anew: a kill would then leave less than there was.
            os.ftruncate(self._descriptor, len(whole))
        if not whole:
            self._append({"inputs": list(names), "simulator": simulator})

    def _open_alone(self) -> None:
        """Open the file and lock it for this process, until this object or the process ends.

        The lock is of the kind that processes started from this one do not inherit: a worker that
        outlives a killed study does not hold it. It would end with the first descriptor of the
        file that is closed, hence there is only one.
        """
        binary = getattr(os, "O_BINARY", 0)
        self._descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | binary, 0o666)
        weakref.finalize(self, os.close, self._descriptor)
        if not stat.S_ISREG(os.fstat(self._descriptor).st_mode):
            raise InvalidInput("cache", str(self.path), "a regular file, no pipe or device")
        if sys.platform == "win32":
            return
        try:
            fcntl.lockf(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            allowed = "a file that no other process writes to"
            raise InvalidInput("cache", str(self.path), allowed) from None
        except OSError:
            # Some network folders have no locks.
            return

    def _contents(self) -> bytes:
        parts = []
        while part := os.read(self._descriptor, 1 << 20):
            parts.append(part)
        return b"".join(parts)

    def _read(self, contents: bytes) -> None:
        head, *lines = contents.split(b"\n")[:-1]
        try:
            header = json.loads(head.decode())
            names = header["inputs"]
        except (*_DAMAGED, KeyError):
            raise InvalidInput("cache", str(self.path), "a file of finished runs") from None
        if names != list(self._names):
            raise InvalidInput("cache", str(self.path), f"runs of the inputs {self._names}")
        damaged = []
        for number, line in enumerate(lines, 2):
            try:
                self._read_line(json.loads(line.decode()))
            except _DAMAGED as error:
                damaged.append((number, str(error) or type(error).__name__))
        if damaged:
            self._warn_of_damaged(damaged)
        known = self._simulator is not None and header.get("simulator") == self._simulator
        # Without the names of the responses a run has to be made again, which tells them.
        named = bool(self.responses) or not self.runs
        self.goes_on = known and named and not self._finished

    def _read_line(self, line: Any) -> None:
        """Take over the contents of a line, or raise one of `_DAMAGED` and change nothing."""
        if not isinstance(line, dict):
            raise ValueError("it is no table")
        if "responses" in line:
            responses = tuple(_texts(line["responses"]))
            if self.responses not in ((), responses) or self._width not in (0, len(responses)):
                raise ValueError("it names other responses than the lines above")
            self.responses, self._width = responses, len(responses)
        elif "at" in line:
            at = tuple(map(float.fromhex, _texts(line["at"])))
            if len(at) != len(self._names) or not all(map(math.isfinite, at)):
                raise ValueError(f"it has no {len(self._names)} finite inputs")
            if "failed" in line:
                (self.failures[at],) = _texts([line["failed"]])
            else:
                gave = _numbers(line.get("gave"))
                if self._width not in (0, len(gave)):
                    raise ValueError(f"it has {len(gave)} responses in place of {self._width}")
                self.runs[at], self._width = gave, len(gave)
            self.order.setdefault(at, len(self.order))
        elif "finished" not in line:
            raise ValueError("it is neither a run nor a remark on one")
        self._finished = "finished" in line

    def _warn_of_damaged(self, damaged: Sequence[tuple[int, str]]) -> None:
        listing = "; ".join(f"line {number} ({why[:_SHOWN]})" for number, why in damaged[:_RERUNS])
        ending = f" and {len(damaged) - _RERUNS} more" if len(damaged) > _RERUNS else ""
        message = (
            f"{self.path}: damaged lines are left out, and their runs are made again: "
            f"{listing}{ending}"
        )
        warnings.warn(message, RuntimeWarning, stacklevel=5)

    def keep(self, at: tuple[float, ...], gave: Any, responses: tuple[str, ...]) -> None:
        """Write a run to the disk, before the first the names of the responses."""
        if not self.responses:
            self.responses, self._width = responses, len(responses)
            self._append({"responses": list(responses)})
        self.runs[at] = gave
        self.order.setdefault(at, len(self.order))
        self._append({"at": [value.hex() for value in at], "gave": gave})
        self._finished = False

    def keep_failure(self, at: tuple[float, ...], why: str) -> None:
        """Write to the disk that a run gave nothing, so that it is not tried again."""
        self.failures[at] = why
        self.order.setdefault(at, len(self.order))
        self._append({"at": [value.hex() for value in at], "failed": why})
        self._finished = False

    def retry_within(self, time_limit: float | None) -> None:
        """Forget failures of runs that were ended after a shorter time than they have now.

        Parameters
        ----------
        time_limit : float or None
            Seconds that a run has now; None if it has any time.
        """
        now = float("inf") if time_limit is None else time_limit
        limits = {row: limit_in(why) for row, why in self.failures.items()}
        for row, limit in limits.items():
            if limit is not None and limit < now:
                del self.failures[row]

    def check(self, again: Callable[[tuple[float, ...]], Any]) -> None:
        """Make a run of the file again: names and inputs of simulators may be the same.

        Parameters
        ----------
        again : callable
            Returns what the simulator gives for inputs, or None where it fails.

        Raises
        ------
        InvalidInput
            If it gives something else, or the first five of the file fail.
        """
        check_again("cache", self.runs.items(), again, f"{self.path}", "; delete the file")

    def finish(self) -> None:
        """Note in the file that the study has ended."""
        if not self._finished:
            self._append({"finished": True})
            self._finished = True

    def _append(self, line: dict[str, Any]) -> None:
        remaining = (json.dumps(line) + "\n").encode()
        while remaining:
            remaining = remaining[os.write(self._descriptor, remaining) :]
        os.fsync(self._descriptor)


def check_again(
    field: str,
    runs: Iterable[tuple[tuple[float, ...], Any]],
    again: Callable[[tuple[float, ...]], Any],
    shown: str,
    ending: str = "",
) -> None:
    """Make one of some runs again: they may be those of another simulator.

    Raises
    ------
    InvalidInput
        If it gives something else, or the first five fail.
    """
    allowed, row = f"runs of this simulator{ending}", None
    for row, stored in islice(runs, _RERUNS):
        gave = again(row)
        if gave is not None:
            same = len(gave) == len(stored) and np.allclose(gave, stored, rtol=_SAME, atol=0.0)
            if not same:
                raise InvalidInput(field, shown, allowed)
            return
    if row is not None:
        allowed += f", if it fails now at the first {_RERUNS} of them by right"
        raise InvalidInput(field, shown, allowed)


def _texts(given: Any) -> list[str]:
    """Return a list of texts, or raise `TypeError`."""
    if not isinstance(given, list) or not all(isinstance(entry, str) for entry in given):
        raise TypeError("it has no list of texts where there should be one")
    return given


def _numbers(given: Any) -> list[float]:
    """Return a list of finite numbers as floats, or raise one of `_DAMAGED`."""
    if not isinstance(given, list) or not all(type(entry) in (int, float) for entry in given):
        raise TypeError("it has no list of numbers where there should be one")
    values = [float(entry) for entry in given]
    if not values or not all(map(math.isfinite, values)):
        raise ValueError("it has no response, or one that is not finite")
    return values
