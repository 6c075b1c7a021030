"""Runs of a user's simulator: by name, one by one or all at once, tried again, kept on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems.simulator.run_file import RunFile

Array = NDArray[np.float64]


_SAME = 1e-6
"""Relative difference of two runs of one simulator, on two machines say; set by hand."""
_ASKED = 5
"""Runs of a file that are made again, one after the other, until one does not fail; by hand."""
SMALLEST, LARGEST = 1e-100, 1e100
"""Sizes of responses, in any unit, the squares of which keep their digits."""


class SimulatorFailed(RuntimeError):
    """The simulator fails where no surrogate can do without it; the message names the place.

    Examples
    --------
    >>> def broken(x):
    ...     raise RuntimeError("no licence")
    ...
    >>> try:
    ...     _ = robust_problem(broken, {"x": Design(0.0, 1.0, deviation=0.1)}, progress=False)
    ... except SimulatorFailed as error:
    ...     print("failed")
    ...
    failed
    """


class Simulator:
    """A user's function as one of arrays, shape (n, d) to (n, r), NaN where it failed.

    Parameters
    ----------
    function : callable
        Takes the inputs by name. Returns a number, a mapping of names to numbers, or a sequence of
        numbers; with ``vectorised`` arrays of shape (n,) in their place.
    names : tuple of str
        Of the inputs.
    vectorised : bool
        Whether it takes and returns arrays of shape (n,).
    executor : object or None
        With ``submit``: of `concurrent.futures`, or a client of Dask.
    tries : int
        How often a run is made before it counts as failed.
    file : RunFile or None
        Of finished runs.
    progress : tqdm
        A bar to move.

    Raises
    ------
    InvalidInput
        If a run of the file, made again, gives something else, or all that are made again fail.

    Attributes
    ----------
    responses : tuple of str
        Names of what it returns; empty before the first run.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        names: tuple[str, ...],
        vectorised: bool,
        executor: Any,
        tries: int,
        file: RunFile | None,
        progress: tqdm,
    ) -> None:
        self.function, self.names, self.vectorised = function, names, vectorised
        self.executor, self.tries = executor, tries
        self.file, self.progress = file, progress
        self.responses = file.responses if file else ()
        self._ran = self._sized = False
        self._last_error: BaseException | None = None
        if file and file.runs and not file.goes_on:
            self._check_kept(file)

    def _check_kept(self, file: RunFile) -> None:
        """Make a run of the file again: names and inputs of simulators may be the same."""
        allowed = "runs of this simulator; delete the file"
        for row, kept in islice(file.runs.items(), _ASKED):
            for _ in range(self.tries):
                ((_, gave),) = self._run([row])
                if self._good(gave):
                    if not np.allclose(gave, kept, rtol=_SAME, atol=0.0):
                        raise InvalidInput("cache", str(file.path), allowed)
                    return
        allowed += f", if it fails now at the first {_ASKED} of them by right"
        raise InvalidInput("cache", str(file.path), allowed) from self._last_error

    def __call__(self, values: Array) -> Array:
        """Return the responses at inputs in their units, shape (n, r), NaN where a run failed.

        Raises
        ------
        SimulatorFailed
            If all of these runs fail, and no run before did not.
        InvalidInput
            If what it returns is no set of numbers, or another one than before.
        """
        rows = [tuple(row) for row in values.tolist()]
        kept = self.file.runs if self.file else {}
        found: dict[tuple[float, ...], Any] = {row: kept[row] for row in rows if row in kept}
        for _ in range(self.tries):
            missing = [row for row in dict.fromkeys(rows) if not self._good(found.get(row))]
            if not missing:
                break
            for row, gave in self._run(missing):
                found[row] = gave
                if self.file and self._good(gave):
                    self.file.keep(row, gave, self.responses)
        self.progress.update(len(rows))
        self._ran = self._ran or any(self._good(found[row]) for row in rows)
        if not self._ran:
            where = ", ".join(f"{n} = {v:g}" for n, v in zip(self.names, rows[0], strict=True))
            message = f"the simulator failed in all of {len(rows)} runs, the first at {where}"
            message += f": {self._last_error!r}" if self._last_error else ""
            raise SimulatorFailed(message) from self._last_error
        bad = [np.nan] * len(self.responses)
        table = np.array([found[row] if self._good(found[row]) else bad for row in rows])
        if not self._sized:
            self._check_sizes(table)
        return table

    def _check_sizes(self, table: Array) -> None:
        """Refuse the first runs if squares of their responses would lose digits."""
        self._sized = True
        for name, size in zip(self.responses, np.nanmax(np.abs(table), axis=0), strict=True):
            if size and not (size > SMALLEST and size < LARGEST):
                allowed = f"0 or {SMALLEST:g} to {LARGEST:g}: choose another unit"
                raise InvalidInput(f"size of {name!r}", float(size), allowed)

    def _good(self, gave: Any) -> bool:
        if gave is None:
            return False
        return bool(np.all(np.isfinite(gave)))

    def _run(self, rows: Sequence[tuple[float, ...]]) -> Iterable[tuple[tuple[float, ...], Any]]:
        if self.vectorised:
            columns = dict(zip(self.names, np.array(rows).T, strict=True))
            table = self._table(self.function(**columns), len(rows))
            yield from zip(rows, table.tolist(), strict=True)
        elif self.executor is None:
            for row in rows:
                yield row, self._one(lambda row=row: self._call(row))  # type: ignore[misc]
        else:
            yield from self._on_workers(rows)

    def _on_workers(
        self, rows: Sequence[tuple[float, ...]]
    ) -> Iterable[tuple[tuple[float, ...], Any]]:
        """Yield runs as they end, so that a finished one is kept whatever happens to the others."""
        # Dask would return the stored failure of a run that is made again.
        options = {"pure": False} if hasattr(self.executor, "scheduler_info") else {}
        done: SimpleQueue[Any] = SimpleQueue()
        waiting = {}
        for row in rows:
            inputs = dict(zip(self.names, row, strict=True))
            future = self.executor.submit(call_by_name, self.function, inputs, **options)
            waiting[future] = row
            future.add_done_callback(done.put)
        for _ in rows:
            future = done.get()
            yield waiting.pop(future), self._one(future.result)

    def _call(self, row: tuple[float, ...]) -> Any:
        return call_by_name(self.function, dict(zip(self.names, row, strict=True)))

    def _one(self, result: Callable[[], Any]) -> list[float] | None:
        try:
            gave = result()
        except Exception as error:  # A user's simulator may raise anything.
            self._last_error = error
            return None
        return self._table(gave, None)[0].tolist()

    def _table(self, gave: Any, count: int | None) -> Array:
        """Return what the simulator gave as (n, r), and learn the names of its responses."""
        if isinstance(gave, Mapping):
            names, parts = tuple(gave), list(gave.values())
        elif isinstance(gave, tuple | list) or (count is None and np.ndim(gave) == 1):
            names, parts = tuple(f"response_{k + 1}" for k in range(len(gave))), list(gave)
        else:
            names, parts = ("response",), [gave]
        shape = (1,) if count is None else (count,)
        try:
            arrays = [np.asarray(part, dtype=float).reshape(shape) for part in parts]
        except (TypeError, ValueError):
            wanted = "numbers" if count is None else f"arrays of shape ({count},)"
            raise InvalidInput("what the simulator returns", gave, wanted) from None
        if self.responses and names != self.responses:
            raise InvalidInput("names of the responses", names, str(self.responses))
        self.responses = names
        return np.column_stack(arrays)


def call_by_name(function: Callable[..., Any], inputs: dict[str, float]) -> Any:
    """Return what the function gives for inputs by name; workers call it."""
    return function(**inputs)
