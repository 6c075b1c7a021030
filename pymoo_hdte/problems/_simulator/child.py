"""A process that makes the calls that come through its standard input, one after the other.

It is run as a file, so that nothing of this package is imported before the first call.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread
from typing import IO


def send(stream: IO[bytes], message: bytes) -> None:
    """Write a message behind its length."""
    stream.write(len(message).to_bytes(8, "little") + message)
    stream.flush()


def receive(stream: IO[bytes]) -> bytes:
    """Read a message; EOFError if the other side is gone."""
    length = stream.read(8)
    message = stream.read(int.from_bytes(length, "little")) if len(length) == 8 else b""
    if len(length) < 8 or len(message) < int.from_bytes(length, "little"):
        raise EOFError
    return message


def serve() -> None:
    """Make calls until the requests end."""
    # What a simulator prints or reads must not mix with the messages.
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    calls: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_read, args=(requests, calls), daemon=True).start()
    sys.path[:] = pickle.loads(calls.get())
    # Whoever requested it may be gone before the answer.
    with suppress(BrokenPipeError):
        while True:
            _answer(calls.get(), answers)


def _read(requests: IO[bytes], calls: SimpleQueue[bytes]) -> None:
    try:
        while True:
            calls.put(receive(requests))
    except (EOFError, OSError):
        # Whoever requested it is gone: programs that the simulator started end too, if possible.
        if hasattr(os, "killpg"):
            os.killpg(0, signal.SIGKILL)
        os._exit(1)


def _answer(call: bytes, answers: IO[bytes]) -> None:
    try:
        function, arguments = pickle.loads(call)
        # Imports are done: the clock of the time limit starts here.
        send(answers, b"")
    except Exception as error:
        send(answers, b"")
        send(answers, pickle.dumps((False, _text_of(error))))
        return
    try:
        answer = pickle.dumps((True, function(*arguments)))
    except BaseException as error:  # A simulator may also end Python.
        answer = pickle.dumps((False, _text_of(error)))
    send(answers, answer)


def _text_of(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    serve()
