"""Evaluations on any workers: each with a time limit, and none lost with a pool that breaks."""

from __future__ import annotations

import numbers
import os
import warnings
import weakref
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import BrokenExecutor, CancelledError, ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import Any

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.problems._simulator.children import (
    LOST,
    RAISED,
    Children,
    Failure,
    call_in_child,
    parcel,
)

_LOOK_SECONDS = 5.0
"""How often a Dask client is asked whether its scheduler is there; by hand."""


class Workers:
    """Calls made on an executor, whose results come back as they end.

    Parameters
    ----------
    executor : int, object or None
        Executor of `concurrent.futures`, client of Dask, or a number of own processes, each ended
        and replaced alone; None for this process, one call after the other.
    time_limit : float, optional
        Seconds after which a call is ended, imports not counted. Calls then run in a process beside
        the worker, together with the programs that they start, and crash alone.

    Raises
    ------
    InvalidInput
        If the executor is none of these, or the limit not above 0.

    Warns
    -----
    RuntimeWarning
        If a pool breaks, because a worker was killed, say. What it had not finished is made in as
        many processes of our own, without its initializer.
    """

    def __init__(self, executor: Any = None, time_limit: float | None = None) -> None:
        self.time_limit = time_limit
        if time_limit is not None:
            self.time_limit = real_number("time_limit", time_limit, above=0.0)
        if executor is None and time_limit is not None:
            executor = 1
        own = isinstance(executor, numbers.Integral)
        if not (own or executor is None or hasattr(executor, "submit")):
            allowed = "a number of processes, an executor of concurrent.futures or a Dask client"
            raise InvalidInput("executor", executor, allowed)
        self._children = Children()
        self._finalizer = weakref.finalize(self, self._children.end)
        self._executor: Any = None if own else executor
        self._own = False
        if own:
            self._start_own(whole_number("executor", executor, 1))
        self._here: deque[tuple[Hashable, Any]] = deque()
        self._waiting: dict[Any, tuple[Hashable, Any]] = {}
        self._done: SimpleQueue[Any] = SimpleQueue()

    def _start_own(self, number: int) -> None:
        self._executor, self._own, self._number = ThreadPoolExecutor(number), True, number

    @property
    def number(self) -> int | None:
        """How many calls run at once; None if the executor does not tell."""
        if self._executor is None:
            return 1
        if self._own:
            return self._number
        if _is_dask(self._executor):
            return sum(self._executor.nthreads().values()) or None
        return getattr(self._executor, "_max_workers", None)

    def start(self, key: Hashable, function: Callable[..., Any], *arguments: Any) -> None:
        """Have a call made, whose result will come back with its key."""
        if self._executor is None:
            self._here.append((key, (function, *arguments)))
            return
        isolated = self._own or self.time_limit is not None
        self._submit(key, parcel(function, *arguments) if isolated else (function, *arguments))

    def _submit(self, key: Hashable, call: Any) -> None:
        # Dask would return the stored result of a call that is made again.
        options = {"pure": False} if _is_dask(self._executor) else {}
        if not isinstance(call, bytes):
            task = call
        else:
            task = (call_in_child, call, self.time_limit)
            if self._own:
                task = (self._children.call, call, self.time_limit, self._children.round)
        try:
            future = self._executor.submit(*task, **options)
        except BrokenExecutor:
            self._replace()
            self._submit(key, call if isinstance(call, bytes) else parcel(*call))
            return
        self._waiting[future] = key, call
        future.add_done_callback(self._done.put)

    def next(self) -> tuple[Hashable, Any]:
        """Return key and result of the next call that ends, or its `Failure`.

        Raises
        ------
        BrokenExecutor
            If the scheduler of a Dask client is gone.
        """
        if self._here:
            key, (function, *arguments) = self._here.popleft()
            try:
                return key, function(*arguments)
            except Exception as error:  # A user's simulator may raise anything.
                return key, failure_of(error)
        while True:
            future = self._ended()
            if future not in self._waiting:
                continue
            key, call = self._waiting.pop(future)
            try:
                return key, future.result()
            except BrokenExecutor:
                self._waiting[future] = key, call
                self._replace()
            except CancelledError as error:
                raise BrokenExecutor(f"the executor gave up calls: {error}") from error
            except Exception as error:
                return key, failure_of(error)

    def _ended(self) -> Any:
        while True:
            try:
                return self._done.get(timeout=_LOOK_SECONDS)
            except Empty:
                if _is_dask(self._executor) and self._executor.status == "closed":
                    raise BrokenExecutor("the Dask scheduler is gone") from None

    def _replace(self) -> None:
        """Go on without a pool that broke."""
        number = self.number or os.cpu_count() or 1
        words = f"a pool of workers broke; its evaluations go on in {number} processes of our own"
        warnings.warn(words, RuntimeWarning, stacklevel=3)
        self._start_own(number)
        waiting, self._waiting = self._waiting, {}
        for future, (key, call) in waiting.items():
            # What came back before the pool broke is in the queue.
            if future.done() and not future.cancelled() and future.exception() is None:
                self._waiting[future] = key, call
            else:
                self._submit(key, call if isinstance(call, bytes) else parcel(*call))

    def cancel(self) -> None:
        """Forget all calls under way, and end those that run in processes of our own."""
        self._here.clear()
        waiting, self._waiting = self._waiting, {}
        for future in waiting:
            future.cancel()
        if self._own and waiting:
            self._children.end()

    def close(self) -> None:
        """End the processes that are our own; executors of the caller stay."""
        self.cancel()
        if self._own:
            self._executor.shutdown()
        self._children.end()


def failure_of(error: BaseException) -> Failure:
    """Return what an exception says of an evaluation."""
    kind = LOST if type(error).__name__ == "KilledWorker" else RAISED
    return Failure(kind, f"{type(error).__name__}: {error}", error)


def _is_dask(executor: Any) -> bool:
    return hasattr(executor, "scheduler_info")
