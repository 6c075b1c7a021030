"""A queue of workers in virtual time: what a run would take on many of them, without them."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Hashable
from typing import Any

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.problems._simulator.children import over_the_limit
from pymoo_hdte.problems._simulator.workers import failure_of


class VirtualWorkers:
    """Workers whose evaluations take stated times on a clock that only they move.

    Evaluations are made here and at once, but come back in the order in which workers would end
    them: the earliest free worker takes the next in the queue. The time of the algorithm itself is
    none. The same times and seed give the same run.

    Parameters
    ----------
    number : int
        Number of workers.
    seconds : callable
        Called for each evaluation in the order of the queue, returns its virtual seconds, 0 or
        more; infinite for one that hangs.
    time_limit : float, optional
        Seconds at which an evaluation is ended and lost.

    Attributes
    ----------
    now : float
        Virtual seconds since the beginning.
    busy : float
        Worker seconds of what came back.

    Raises
    ------
    InvalidInput
        If a number is not allowed, or an evaluation would never end.

    Examples
    --------
    >>> seconds = iter([3.0, 1.0, 1.0])
    >>> queue = VirtualWorkers(2, lambda: next(seconds))
    >>> for name in "abc":
    ...     queue.start(name, str.upper, name)
    >>> [(queue.next(), queue.now) for _ in range(3)]
    [(('b', 'B'), 1.0), (('c', 'C'), 2.0), (('a', 'A'), 3.0)]
    """

    def __init__(
        self, number: int, seconds: Callable[[], float], time_limit: float | None = None
    ) -> None:
        self.number = whole_number("number", number, 1)
        self._seconds = seconds
        self.time_limit = float("inf")
        if time_limit is not None:
            self.time_limit = real_number("time_limit", time_limit, above=0.0)
        self.now = self.busy = 0.0
        self._free_at = [0.0] * self.number
        self._running: list[tuple[float, int, float, Hashable, Any]] = []
        self._count = 0

    @property
    def efficiency(self) -> float:
        """Share of the workers' time so far in which they worked on what came back."""
        return self.busy / (self.number * self.now) if self.now else 1.0

    def start(self, key: Hashable, function: Callable[..., Any], *arguments: Any) -> None:
        """Put a call in the queue, whose result `next` returns with its key.

        Parameters
        ----------
        key : hashable
            Tells the call from others.
        function : callable
            What is called, at the virtual end of the call.
        *arguments
            Its arguments.

        Raises
        ------
        InvalidInput
            If the call would never end.
        """
        wanted = float(self._seconds())
        lasts = min(wanted, self.time_limit)
        if not 0.0 <= lasts < float("inf"):
            raise InvalidInput("seconds of an evaluation", wanted, "finite, or with a time_limit")
        begins = max(self.now, heapq.heappop(self._free_at))
        heapq.heappush(self._free_at, begins + lasts)
        call = None if wanted > self.time_limit else (function, *arguments)
        # The count keeps the order of the queue where two end at once.
        self._count += 1
        heapq.heappush(self._running, (begins + lasts, self._count, lasts, key, call))

    def next(self) -> tuple[Hashable, Any]:
        """Move the clock to the next end of a call, and return its key and result or `Failure`."""
        self.now, _, lasts, key, call = heapq.heappop(self._running)
        self.busy += lasts
        if call is None:
            return key, over_the_limit(self.time_limit)
        try:
            return key, call[0](*call[1:])
        except Exception as error:  # A user's simulator may raise anything.
            return key, failure_of(error)

    def cancel(self) -> None:
        """Forget all calls under way, whose workers are free at once."""
        self._running.clear()
        self._free_at = [min(time, self.now) for time in self._free_at]

    def close(self) -> None:
        """Do as `cancel`; nothing else is held."""
        self.cancel()
