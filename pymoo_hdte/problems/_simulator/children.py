"""Calls in processes that can be ended: at a time limit, or when the simulator crashes."""

from __future__ import annotations

import atexit
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, RLock, Timer
from typing import Any

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.child import receive, send

RAISED, NOT_A_NUMBER = "raised", "not a number"
TOO_LONG, LOST = "over the time limit", "worker lost"
"""Kinds of failures of evaluations that give no result."""
SCRATCH = "PYMOO_HDTE_SCRATCH"
"""Variable of a process that names a folder, which is removed when the process has ended."""


@dataclass(frozen=True)
class Failure:
    """A failed evaluation in place of a result: its kind, one of four, its text and its error."""

    kind: str
    text: str
    error: BaseException | None = None


def over_the_limit(seconds: float) -> Failure:
    """Return the failure of an evaluation that exceeded a time limit."""
    return Failure(TOO_LONG, f"no result within {seconds!r} s")


def limit_in(text: str) -> float | None:
    """Return the time limit in seconds that a failure's text names; None for other failures."""
    match = re.fullmatch(
        rf"(?:{TOO_LONG}: )?no result within (\d+(?:\.\d*)?(?:e[-+]?\d+)?) s", text
    )
    return float(match[1]) if match else None


def parcel(function: Callable[..., Any], *arguments: Any) -> bytes:
    """Return a call as bytes for `Children.call`.

    Raises
    ------
    InvalidInput
        If it cannot be pickled, or belongs to the main script while cloudpickle is missing.
    """
    try:
        from cloudpickle import dumps
    except ImportError:
        dumps = pickle.dumps
    try:
        written: bytes = dumps((function, arguments))
    except Exception as error:  # A user's object may raise anything when it is pickled.
        raise InvalidInput("simulator", function, f"what can be pickled ({error})") from error
    if dumps is pickle.dumps and b"__main__" in written:
        allowed = "of a module that can be imported; or install cloudpickle (the extra dask has it)"
        raise InvalidInput("simulator", function, allowed)
    return written


class Children:
    """Processes that make one call at a time each; one is started when all are busy."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._idle: list[subprocess.Popen[bytes]] = []
        # With the folder of each, since one that is killed removes nothing.
        self._subprocesses: dict[subprocess.Popen[bytes], str] = {}
        self._process = os.getpid()
        self.round = 0

    def call(self, written: bytes, time_limit: float | None, round_: int | None = None) -> Any:
        """Return what a `parcel` gives, or a `Failure`; seconds count once it is unpacked.

        A call of a ``round`` that was ended before it began is lost.
        """
        child, over = self._take(round_), Event()
        if child is None:
            return Failure(LOST, "ended before it began")

        def stop() -> None:
            over.set()
            _kill(child)

        timer = Timer(0.0 if time_limit is None else time_limit, stop)
        timer.daemon = True
        try:
            answer = self._ask(child, written, None if time_limit is None else timer)
        except (EOFError, OSError):
            self._drop(child)
            if over.is_set():
                return over_the_limit(time_limit or 0.0)
            return Failure(LOST, f"the process ended with code {child.returncode}")
        # A limit that falls together with the result: the process is gone, the result counts.
        if over.is_set():
            self._drop(child)
        else:
            with self._lock:
                self._idle.append(child)
        good, gave = pickle.loads(answer)
        return gave if good else Failure(RAISED, gave)

    def _ask(self, child: subprocess.Popen[bytes], written: bytes, timer: Timer | None) -> bytes:
        assert child.stdin
        assert child.stdout
        send(child.stdin, written)
        receive(child.stdout)
        if timer is None:
            return receive(child.stdout)
        timer.start()
        try:
            return receive(child.stdout)
        finally:
            timer.cancel()
            timer.join()

    def _take(self, round_: int | None) -> subprocess.Popen[bytes] | None:
        if self._process != os.getpid():
            # A fork of ours: pipes to the processes belong to the one that started them.
            self.__init__()  # type: ignore[misc]
        with self._lock:
            if round_ is not None and round_ != self.round:
                return None
            while self._idle:
                child = self._idle.pop()
                if child.poll() is None:
                    return child
                # It was ended from outside while it waited, for memory, say.
                self._drop(child)
            # Of a group of its own: programs that the simulator starts end with it, and Ctrl-C in
            # the terminal does not reach it.
            scratch = tempfile.mkdtemp(prefix="pymoo-hdte-")
            child = subprocess.Popen(
                [sys.executable, "-P", str(Path(__file__).with_name("child.py"))],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,
                env=os.environ | {SCRATCH: scratch},
            )
            self._subprocesses[child] = scratch
        assert child.stdin is not None
        # If it was ended meanwhile, the call will notice.
        with suppress(OSError):
            send(child.stdin, pickle.dumps(sys.path))
        return child

    def _drop(self, child: subprocess.Popen[bytes]) -> None:
        with self._lock:
            scratch = self._subprocesses.pop(child, None)
        _kill(child)
        for stream in (child.stdin, child.stdout):
            # What could not be sent to a process that is gone.
            with suppress(OSError):
                stream.close()  # type: ignore[union-attr]
        child.wait()
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)

    def end(self) -> None:
        """End all processes; calls under way or still to begin in this round count as lost."""
        if self._process != os.getpid():
            return
        with self._lock:
            self.round += 1
            idle, self._idle = self._idle, []
            busy = set(self._subprocesses) - set(idle)
        for child in busy:
            _kill(child)
        for child in idle:
            self._drop(child)


def _kill(child: subprocess.Popen[bytes]) -> None:
    if hasattr(os, "killpg"):
        # It may have ended by itself.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)
    else:
        child.kill()


_OF_THIS_WORKER = Children()
atexit.register(_OF_THIS_WORKER.end)


def call_in_child(written: bytes, time_limit: float | None) -> Any:
    """Make a call in a process beside that of the worker, whatever kind of worker it is."""
    return _OF_THIS_WORKER.call(written, time_limit)
