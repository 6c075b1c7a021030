"""Runs of a user's simulator: by name, one by one or all at once, tried again, kept on disk."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput, whole_number
from pymoo_hdte.problems._simulator.children import TOO_LONG, Failure
from pymoo_hdte.problems._simulator.identity import identity
from pymoo_hdte.problems._simulator.run_file import RunFile, check_again
from pymoo_hdte.problems._simulator.workers import Workers, failure_of

Array = NDArray[np.float64]


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


@contextmanager
def opened(
    function: Callable[..., Any] | None,
    names: tuple[str, ...],
    vectorised: bool,
    executor: Any,
    tries: int,
    time_limit: float | None,
    cache: str | os.PathLike[str] | None,
    progress: Callable[[], tqdm],
    takes_seed: bool | None = None,
) -> Iterator[Simulator]:
    """Yield a user's function with its workers and the file of its runs, which ends as this does.

    Parameters
    ----------
    function, names, vectorised, takes_seed
        As in `Simulator`.
    executor, tries, time_limit, cache
        As in `robust_problem`.
    progress : callable
        Makes the bar.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, or a function that does not take the inputs.
    """
    function = _checked_signature(function, names[:-1] if takes_seed is False else names)
    count = whole_number("tries", tries, 1)
    if vectorised and time_limit is not None:
        raise InvalidInput("time_limit", time_limit, "None for a vectorised simulator")
    file = None if cache is None else RunFile(cache, names, identity(function))
    with progress() as bar, closing(Workers(executor, time_limit)) as workers:
        yield Simulator(function, names, vectorised, workers, count, file, bar, takes_seed)
        # Fewer runs than the budget are the good end.
        bar.total = bar.n
        bar.refresh()
    if file:
        file.finish()


def no_simulator(**inputs: Any) -> Any:
    """Stand for the simulator where runs in hand are all there is.

    Raises
    ------
    RuntimeError
        Always.
    """
    raise RuntimeError("there is no simulator")


class Simulator:
    """A user's function as one of arrays, shape (n, d) to (n, r), NaN where it failed.

    Parameters
    ----------
    function : callable
        Takes the inputs by name. Returns a number, a mapping of names to numbers, or a sequence of
        numbers; with ``vectorised`` arrays of shape (n,) in their place.
    names : tuple of str
        Names of the inputs.
    vectorised : bool
        Whether it takes and returns arrays of shape (n,).
    workers : Workers
        Workers that make the runs, unless the function is vectorised.
    tries : int
        How often a run is made before it counts as failed.
    file : RunFile or None
        File of finished runs.
    progress : tqdm
        A bar to move.
    takes_seed : bool, optional
        Where the last input is the seed of a random function, whether that takes it.

    Raises
    ------
    InvalidInput
        If a run of the file, made again, gives something else, or all that are made again fail.

    Attributes
    ----------
    responses : tuple of str
        Names of the results; empty before the first run.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        names: tuple[str, ...],
        vectorised: bool,
        workers: Workers,
        tries: int,
        file: RunFile | None,
        progress: tqdm,
        takes_seed: bool | None = None,
    ) -> None:
        self.function, self.names, self.vectorised = function, names, vectorised
        self.workers, self.tries, self.takes_seed = workers, tries, takes_seed
        self.file, self.progress = file, progress
        self.responses = file.responses if file else ()
        self._ran = self._sized = False
        self._last_failure: Failure | None = None
        self._given_up: set[tuple[float, ...]] = set()
        if file and file.goes_on:
            file.retry_within(workers.time_limit)
            self._given_up |= set(file.failures)
        elif file and takes_seed is not False:
            file.check(self.again)

    def check_data(self, X: Array, Y: Array, responses: tuple[str, ...]) -> None:
        """Take the names of the responses from runs in hand, and make one of them again.

        Parameters
        ----------
        X : ndarray, shape (n, d)
            Inputs in their units.
        Y : ndarray, shape (n, r)
            Responses, NaN where a run failed.
        responses : tuple of str
            Their names; empty if they are not known.

        Raises
        ------
        InvalidInput
            If the simulator gives something else, or the squares of responses would lose digits.
        """
        if self.responses and responses not in ((), self.responses):
            raise InvalidInput("responses in data", responses, str(self.responses))
        self.responses = self.responses or responses
        whole = np.isfinite(Y).all(axis=1)
        if self.takes_seed is not None and self.function is not no_simulator:
            # Another run of a random function gives something else; only its names are of use.
            self.again((*X[0].tolist(), 0.0))
        elif self.function is not no_simulator:
            rows = zip(map(tuple, X[whole].tolist()), Y[whole], strict=True)
            check_again("data", rows, self.again, f"an array of shape {Y.shape}")
        if not self.responses:
            count = Y.shape[1]
            one = ("response",)
            self.responses = one if count == 1 else tuple(f"response_{k + 1}" for k in range(count))
        if whole.any():
            self._ran = True
            self._check_sizes(Y)
        elif self.function is no_simulator:
            raise InvalidInput("runs of data that did not fail", 0, "one or more")

    def again(self, row: tuple[float, ...]) -> Any:
        """Return the result of a new run, whatever the file has; None if it fails."""
        for _ in range(self.tries):
            ((_, gave),) = self._run([row])
            if self._good(gave):
                return gave
        return None

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
        stored = self.file.runs if self.file else {}
        results: dict[tuple[float, ...], Any] = {row: stored.get(row) for row in rows}
        for _ in range(self.tries):
            missing = [
                row for row in results if row not in self._given_up and not self._good(results[row])
            ]
            for row, gave in self._run(missing) if missing else ():
                results[row] = gave
                if self.file and self._good(gave):
                    self.file.keep(row, gave, self.responses)
        self.progress.update(len(rows))
        self._ran = self._ran or any(self._good(results[row]) for row in rows)
        self._give_up([row for row in results if not self._good(results[row])])
        if not self._ran:
            where = ", ".join(f"{n} = {v:g}" for n, v in zip(self.names, rows[0], strict=True))
            message = f"the simulator failed in all of {len(rows)} runs, the first at {where}"
            message += f": {self._last_failure.text}" if self._last_failure else ""
            raise SimulatorFailed(message) from (
                self._last_failure.error if self._last_failure else None
            )
        bad = [np.nan] * len(self.responses)
        table = np.array([results[row] if self._good(results[row]) else bad for row in rows])
        if not self._sized:
            self._check_sizes(table)
        return table

    def _give_up(self, rows: Sequence[tuple[float, ...]]) -> None:
        """Note runs that have failed as often as they are tried: a killed study goes on without.

        Not where nothing has run so far: what is amiss there will be mended.
        """
        for row in rows:
            if self.file and self._ran and row not in self.file.failures:
                why = self._last_failure.text if self._last_failure else "not a number"
                self.file.keep_failure(row, why)
            self._given_up.add(row)

    def _check_sizes(self, table: Array) -> None:
        """Refuse the first runs if squares of their responses would lose digits."""
        self._sized = True
        whole = table[np.isfinite(table).all(axis=1)]
        for name, size in zip(self.responses, np.max(np.abs(whole), axis=0), strict=True):
            if size and not (size > SMALLEST and size < LARGEST):
                allowed = f"0 or {SMALLEST:g} to {LARGEST:g}: choose another unit"
                raise InvalidInput(f"size of {name!r}", float(size), allowed)

    def _good(self, gave: Any) -> bool:
        if gave is None:
            return False
        return bool(np.all(np.isfinite(gave)))

    def _run(self, rows: Sequence[tuple[float, ...]]) -> Iterable[tuple[tuple[float, ...], Any]]:
        if self.vectorised:
            yield from self._together(rows)
        else:
            yield from self._on_workers(rows)

    def _together(
        self, rows: Sequence[tuple[float, ...]]
    ) -> list[tuple[tuple[float, ...], list[float] | None]]:
        """Make runs of a vectorised simulator; one by one where it raises."""
        try:
            gave = self.function(**self._inputs(np.array(rows).T))
        except Exception as error:  # A user's simulator may raise anything.
            self._last_failure = failure_of(error)
            if len(rows) == 1:
                return [(rows[0], None)]
            return [run for row in rows for run in self._together([row])]
        return list(zip(rows, self._table(gave, len(rows)).tolist(), strict=True))

    def _inputs(self, values: Any) -> dict[str, Any]:
        """Return numbers or columns by the names of the inputs, as the function takes them."""
        inputs: dict[str, Any] = dict(zip(self.names, values, strict=True))
        if self.takes_seed is not None:
            seed = inputs.pop(self.names[-1])
            if self.takes_seed:
                single = np.ndim(seed) == 0
                inputs[self.names[-1]] = int(seed) if single else np.asarray(seed, dtype=int)
        return inputs

    def _on_workers(
        self, rows: Sequence[tuple[float, ...]]
    ) -> Iterable[tuple[tuple[float, ...], Any]]:
        """Yield runs as they end, so that a finished one is kept whatever happens to the others."""
        try:
            for row in rows:
                inputs = self._inputs(row)
                # Not by a function of ours: processes beside workers would import our package.
                self.workers.start(row, partial(self.function, **inputs))
            for _ in rows:
                row, gave = self.workers.next()  # type: ignore[assignment]
                if isinstance(gave, Failure):
                    self._last_failure = gave
                    # Another try would last as long again.
                    if gave.kind == TOO_LONG:
                        self._give_up([row])
                    yield row, None
                else:
                    yield row, self._table(gave, None)[0].tolist()
        finally:
            self.workers.cancel()

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


def _checked_signature(
    simulator: Callable[..., Any] | None, names: Sequence[str]
) -> Callable[..., Any]:
    """Return a simulator that can be called with these inputs, as far as it tells."""
    if not callable(simulator):
        allowed = "a function of the designs and the noise, or None where data have runs enough"
        raise InvalidInput("simulator", simulator, allowed)
    try:
        # What a decorator wraps is not what is called.
        signature = inspect.signature(simulator, follow_wrapped=False)
    except (TypeError, ValueError):
        return simulator
    parameters = signature.parameters.values()
    named = [
        parameter
        for parameter in parameters
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    ]
    optional = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    takes = {parameter.name for parameter in named}
    anything = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters)
    surplus = [] if anything else [name for name in names if name not in takes]
    missing = [
        parameter.name
        for parameter in parameters
        if parameter.default is parameter.empty
        and parameter.kind not in optional
        and parameter.name not in names
    ]
    if surplus or missing:
        reasons = [f"it takes no {', '.join(surplus)}"] if surplus else []
        reasons += [f"it needs {', '.join(missing)}"] if missing else []
        allowed = f"those of designs and noise ({', '.join(names)}); {' and '.join(reasons)}"
        raise InvalidInput("arguments of the simulator", str(signature), allowed)
    return simulator
