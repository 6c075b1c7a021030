"""Where jobs run: in this process, on its own cores, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager

from pymoo_hdte.checks import InvalidInput

CONNECT_SECONDS = 10


def make_executor(workers: int, dask: str | None = None) -> Executor | None:
    """Return an executor of ``workers`` processes, or of the scheduler at the address ``dask``.

    One worker needs no executor: None stands for this process.

    Raises
    ------
    InvalidInput
        ``dask`` is given, but the extra is not installed or no scheduler answers.
    """
    if dask is not None:
        return _dask_executor(dask)
    if workers == 1:
        return None
    # Forked children would inherit the threads of numerical libraries in an undefined state.
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, spawn)


def _dask_executor(address: str) -> Executor:
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput(
            "--dask", address, "only with the extra: pip install '.[dask]'"
        ) from None
    try:
        return Client(address, timeout=CONNECT_SECONDS).get_executor()
    except (OSError, ValueError):
        raise InvalidInput("--dask", address, "the address of a running Dask scheduler") from None


@contextmanager
def interrupts_held_off() -> Iterator[None]:
    """Ignore Ctrl-C while processes are started, so that these ignore it for good.

    Ctrl-C reaches the whole process group, and processes inherit what they ignore from the one that
    starts them: only the parent is to decide what becomes of the jobs.
    """
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
