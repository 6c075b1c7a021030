"""Where jobs run: in this process, on its own cores, or on a Dask cluster."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_info

from pymoo_hdte.checks import InvalidInput

if TYPE_CHECKING:
    from distributed import Client
    from distributed import Future as Task

CONNECT_SECONDS = 10


class WorkerLost(RuntimeError):
    """Several workers in turn ended while they held a job; this job or another is the cause."""


class WrongWorker(RuntimeError):
    """A worker cannot give the bytes of this process: its source, versions or processor differ."""


def arithmetic() -> str:
    """Name what BLAS and numpy choose for this processor: it decides the last bits."""
    blas = {
        f"{library['internal_api']} {library.get('architecture')}"
        for library in threadpool_info()
        if library["user_api"] == "blas"
    }
    functions = np.lib.introspect.opt_func_info().values()
    loops = {loop["current"] for types in functions for loop in types.values()}
    return " ".join(sorted(blas) + sorted(loops))


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
    return ProcessPoolExecutor(workers, spawn, initializer=_end_with_the_parent)


def _end_with_the_parent() -> None:
    # A parent that is killed cannot end its workers, and these would wait for work for ever.
    def wait() -> None:
        if parent := multiprocessing.parent_process():
            parent.join()
            os._exit(1)

    Thread(target=wait, daemon=True).start()


def _dask_executor(address: str) -> Executor:
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput(
            "--dask", address, "only with the extra: pip install 'pymoo-hdte[dask]'"
        ) from None
    try:
        asyncio.run(_greet(address))
        client = Client(address, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, MemoryError):
        # MemoryError: another service answers, and its greeting is read as an enormous length.
        raise InvalidInput("--dask", address, "the address of a running Dask scheduler") from None
    return DaskExecutor(client)


async def _greet(address: str) -> None:
    # A client waits without end for a service that takes a greeting and is silent, such as the
    # dashboard of the scheduler.
    from distributed import Security
    from distributed.comm import connect

    greeting = connect(address, **Security().get_connection_args("client"))
    await (await asyncio.wait_for(greeting, CONNECT_SECONDS)).close()


class DaskExecutor(Executor):
    """The workers of a Dask scheduler.

    The client's own executor leaves a future undecided for ever when the scheduler ends while a
    result is on its way; this one decides each.

    Parameters
    ----------
    client
        A connection to the scheduler; it is closed with the executor.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._loop: Any = client.loop
        self._address = client.scheduler.address

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a call on some worker.

        Beside what the call raises, the future can end with `WorkerLost`; with `WrongWorker` if
        the worker lacks a module; with `BrokenExecutor` if the scheduler is gone.
        """
        parcel = pickle.dumps(_Call(partial(function, *args, **kwargs)))
        # Calls are kept apart: an equal call of another client may have another source.
        task = self._client.submit(pickle.loads, parcel, pure=False)
        future: Future[Any] = Future()
        future.add_done_callback(partial(self._drop, task))
        self._loop.add_callback(self._deliver, task, future)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the connection; the scheduler drops what is still under way."""
        self._client.close()

    def _drop(self, task: Task, future: Future[Any]) -> None:
        if future.cancelled():
            # In the client's own thread, so that the caller does not wait for the scheduler.
            self._loop.add_callback(task.cancel)

    async def _deliver(self, task: Task, future: Future[Any]) -> None:
        try:
            result, error = await task, None
        except Exception as failure:
            result, error = None, failure
        if not future.set_running_or_notify_cancel():
            return
        if error is None:
            future.set_result(result)
        elif task.status == "error":
            future.set_exception(self._explained(error))
        else:
            gone = f"The Dask scheduler at {self._address} is gone."
            future.set_exception(BrokenExecutor(gone))

    def _explained(self, error: Exception) -> Exception:
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            return WorkerLost(str(error))
        if isinstance(error, ImportError):
            wrong = WrongWorker(
                f"A worker of {self._address} does not find what a job needs: {error}. Start "
                "workers in the folder of this repository with the same environment."
            )
            wrong.__cause__ = error
            return wrong
        return error


class _Call:
    """A call that stays pickled until a worker makes it.

    Dask also unpickles arguments outside of jobs. That would end a worker without our modules, then
    the next one, and the run would wait for ever. Unpickled within a job, it is the job's error.
    """

    def __init__(self, call: Callable[[], Any]) -> None:
        self.call = call

    def __reduce__(self) -> tuple[Callable[[], Any], tuple[()]]:
        return self.call, ()


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
