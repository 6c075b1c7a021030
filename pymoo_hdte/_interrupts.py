"""How a program ends when its user presses Ctrl-C, or reads no further than ``| head``."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

INTERRUPTED = 130
"""Exit code that a shell expects of a program ended by Ctrl-C."""
UNREAD = 141
"""Exit code that a shell expects of a program whose output nobody reads any more."""
GIVEN_BACK: list[Callable[[], None]] = []
"""What is called before Ctrl-C ends the process at once: it removes what others would find."""


def ended_quietly(name: str, main: Callable[[], int]) -> int:
    """Run a console program so that Ctrl-C and a closed pipe end it without a traceback.

    Ctrl-C ends the process at once, in the middle of imports as well, where KeyboardInterrupt may
    be lost or printed by whoever is called just then. What must be put in order first runs in
    `orderly`.

    Parameters
    ----------
    name : str
        Of the program, for its message.
    main : callable
        Returns the exit code; it should import what is slow itself.

    Returns
    -------
    int
        The exit code: `UNREAD` if standard output or error was closed.
    """
    # Started in the background by a shell, a program ignores Ctrl-C and shall go on doing so.
    minded = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if minded:
        signal.signal(signal.SIGINT, partial(_leave, name))
    try:
        try:
            return main()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
            if minded:
                # The work is done: what is left is the end of the interpreter.
                signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        # Within `orderly`, where there was nothing to put in order.
        _tell(name)
        return INTERRUPTED
    except BrokenPipeError:
        _to_nowhere()
        return UNREAD


@contextmanager
def orderly() -> Iterator[None]:
    """Have Ctrl-C raise KeyboardInterrupt within, also in a program of `ended_quietly`."""
    before = signal.getsignal(signal.SIGINT)
    ours = isinstance(before, partial) and before.func is _leave
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _leave(name: str, *signal_and_frame: Any) -> None:
    for give_back in GIVEN_BACK:
        give_back()
    _tell(name)
    os._exit(INTERRUPTED)


def _tell(name: str) -> None:
    # Not print(): its lock may be held by the code that was interrupted. A terminal may have a bar.
    line = "\n" if os.isatty(2) else ""
    with suppress(OSError):
        os.write(2, f"{line}{name}: interrupted, nothing was written\n".encode())


def _to_nowhere() -> None:
    """Let what is still to be flushed at the end of the interpreter go nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nowhere, descriptor)
