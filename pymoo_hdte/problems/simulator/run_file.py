"""Finished runs of a simulator on disk, from which a killed study goes on."""

from __future__ import annotations

import json
import os
import stat
import sys
import weakref
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems.simulator.children import limit_in

if sys.platform != "win32":
    import fcntl

_SAME = 1e-6
"""Relative difference of two runs of one simulator, on two machines say; set by hand."""
_ASKED = 5
"""Runs of a file that are made again, one after the other, until one does not fail; by hand."""


class RunFile:
    """Finished runs on disk, one line each, written before the next is waited for.

    The file only grows. A line that a killed process left unfinished is dropped. Numbers are kept
    to the last bit. While it is open no other process may open it, except on Windows.

    Parameters
    ----------
    path : str or path-like
        Of the file; made if it is not there.
    names : tuple of str
        Of the simulator's inputs. A file of others is refused.
    simulator : str or None
        What tells the simulator from others (`pymoo_hdte.problems.simulator.identity`).

    Attributes
    ----------
    runs : dict
        What the simulator gave, by inputs.
    failures : dict
        Why a run gave nothing, by inputs.
    order : dict
        Which run ended when, from 0 on, by inputs.
    responses : tuple of str
        Names of what it gives; empty before the first run.
    goes_on : bool
        Whether this simulator wrote the file and was stopped before the study's end.

    Raises
    ------
    InvalidInput
        If the file holds runs of other inputs, is none of these files, or another process writes
        to it.
    OSError
        If it cannot be read or written.
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
        try:
            head, *lines = contents.decode().split("\n")[:-1]
            header = json.loads(head)
            found = header["inputs"]
        except (ValueError, KeyError, TypeError):
            raise InvalidInput("cache", str(self.path), "a file of finished runs") from None
        if found != list(self._names):
            raise InvalidInput("cache", str(self.path), f"runs of the inputs {self._names}")
        for number, line in enumerate(lines, 2):
            try:
                self._read_line(json.loads(line))
            except (ValueError, KeyError, TypeError):
                allowed = f"a file of finished runs; line {number} is damaged"
                raise InvalidInput("cache", str(self.path), allowed) from None
        known = self._simulator is not None and header.get("simulator") == self._simulator
        self.goes_on = known and not self._finished

    def _read_line(self, run: dict[str, Any]) -> None:
        self._finished = "finished" in run
        if "responses" in run:
            self.responses = tuple(run["responses"])
        elif "at" in run:
            at = tuple(map(float.fromhex, run["at"]))
            self.order.setdefault(at, len(self.order))
            if "failed" in run:
                self.failures[at] = str(run["failed"])
            else:
                self.runs[at] = run["gave"]

    def keep(self, at: tuple[float, ...], gave: Any, responses: tuple[str, ...]) -> None:
        """Write a run to the disk, before the first the names of the responses."""
        if not self.responses:
            self.responses = responses
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
        allowed = "runs of this simulator; delete the file"
        for row, kept in islice(self.runs.items(), _ASKED):
            gave = again(row)
            if gave is not None:
                same = len(gave) == len(kept) and np.allclose(gave, kept, rtol=_SAME, atol=0.0)
                if not same:
                    raise InvalidInput("cache", str(self.path), allowed)
                return
        if self.runs:
            allowed += f", if it fails now at the first {_ASKED} of them by right"
            raise InvalidInput("cache", str(self.path), allowed)

    def finish(self) -> None:
        """Note that the study came to its end."""
        if not self._finished:
            self._append({"finished": True})
            self._finished = True

    def _append(self, line: dict[str, Any]) -> None:
        left = (json.dumps(line) + "\n").encode()
        while left:
            left = left[os.write(self._descriptor, left) :]
        os.fsync(self._descriptor)
