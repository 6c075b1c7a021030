"""Evaluations under way: tried again, kept in a file, counted."""

from __future__ import annotations

import copy
import heapq
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.parallel.counts import Counts
from pymoo_hdte.parallel.stored_designs import Output, Row, StoredDesigns
from pymoo_hdte.problems._simulator.children import NOT_A_NUMBER, TOO_LONG, Failure
from pymoo_hdte.problems._simulator.runs import SimulatorFailed


@dataclass
class _Task:
    """An evaluation under way: f(x), tried so often."""

    f: Callable[[Any], Output]
    x: Any
    row: Row | None
    tries: int = 1


class Evaluations:
    """Designs that are evaluated on workers, and come back as they are finished.

    Parameters
    ----------
    workers : Workers or VirtualWorkers
        Workers that make the evaluations.
    tries : int
        How often a failing evaluation is made.
    cache : path or None
        File of finished evaluations.
    counts : Counts
        Counts of their outcomes.
    """

    def __init__(
        self, workers: Any, tries: int, cache: str | os.PathLike[str] | None, counts: Counts
    ) -> None:
        self._workers, self._tries, self._cache, self._counts = workers, tries, cache, counts
        self._stored: StoredDesigns | None = None
        self._known: list[tuple[int, int, Row]] = []
        self._same: dict[Row, list[int]] = {}
        self._tasks: dict[int, _Task] = {}
        self._shapes: dict[str, tuple[int, ...]] = {}

    def start(self, number: int, f: Callable[[Any], Output], x: Any) -> None:
        """Have f(x) evaluated, which `next` returns with the number.

        Parameters
        ----------
        number : int
            Tells the design from others under way.
        f : callable
            Function of pymoo that maps a design to its outputs by name.
        x : object
            The design; with a file n_var real numbers.

        Raises
        ------
        InvalidInput
            If the design cannot be kept in the file, or the file is another problem's.
        """
        row = None if self._cache is None else _row(x)
        if row is not None:
            self._stored = self._stored or self._opened(f, len(row))
            if row in self._stored.order:
                heapq.heappush(self._known, (self._stored.order[row], number, row))
                return
            if row in self._same:
                self._same[row].append(number)
                return
            self._same[row] = []
        self._tasks[number] = task = _Task(_without_runner(f), x, row)
        self._workers.start(number, task.f, x)

    def _opened(self, f: Callable[[Any], Output], n_var: int) -> StoredDesigns:
        bare = _without_runner(f)

        def again(row: Row) -> Output | Failure:
            for _ in range(self._tries):
                self._workers.start(None, bare, np.array(row))
                gave: Output | Failure = _judged(self._workers.next()[1])
                if not isinstance(gave, Failure):
                    break
            return gave

        assert self._cache is not None
        problem, limit = getattr(bare, "problem", f), self._workers.time_limit
        return StoredDesigns(self._cache, problem, n_var, again, limit)

    def next(self) -> tuple[int, Output | None]:
        """Return number and outputs of the next design that is finished, None if it is lost.

        What is in the file comes first, in the order in which it once ended.
        """
        if self._known:
            return self._from_file()
        while True:
            number, answer = self._workers.next()
            task, gave = self._tasks[number], _judged(answer)
            # Another try of what lasts too long would last as long again.
            final = gave.kind == TOO_LONG if isinstance(gave, Failure) else True
            if final or task.tries == self._tries:
                break
            task.tries += 1
            self._counts.repeated += 1
            self._workers.start(number, task.f, task.x)
        del self._tasks[number]
        if task.row is not None and self._stored is not None:
            gave = self._stored.keep(task.row, gave)
            for duplicate in self._same.pop(task.row):
                heapq.heappush(self._known, (self._stored.order[task.row], duplicate, task.row))
        self._counts.made += not isinstance(gave, Failure)
        return number, self._counted(gave)

    def _from_file(self) -> tuple[int, Output | None]:
        _, number, row = heapq.heappop(self._known)
        assert self._stored is not None
        gave = self._stored[row]
        self._counts.from_file += not isinstance(gave, Failure)
        return number, self._counted(gave)

    def _counted(self, gave: Output | Failure) -> Output | None:
        if isinstance(gave, Failure):
            self._counts.lose(gave.kind, gave.text)
            return None
        self._shapes = {key: np.shape(value) for key, value in gave.items()}
        return gave

    def filled(self, f: Any, output: Output | None) -> Output:
        """Return the outputs of a design, NaN for one that is lost."""
        if output is not None:
            return output
        shapes = dict(self._shapes)
        if (problem := getattr(f, "problem", None)) is not None:
            sizes = {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}
            shapes = {key: (size,) for key, size in sizes.items() if size} | shapes
        return {key: np.full(shape, np.nan) for key, shape in shapes.items()}

    def refuse_failures(self) -> None:
        """Refuse to go on where nothing but failures came so far.

        Raises
        ------
        SimulatorFailed
            In that case, with the text of the first failure.
        """
        if self._counts.n_lost and not self._counts.made + self._counts.from_file:
            raise SimulatorFailed(f"no evaluation gave a result: {self._counts}")

    def cancel(self) -> None:
        """Forget what is under way, and end it where the processes are our own."""
        self._workers.cancel()
        self._known, self._same, self._tasks = [], {}, {}


def _without_runner(f: Any) -> Any:
    """Return f for a worker, which would import this package for the runner of its problem."""
    if getattr(f, "problem", None) is None:
        return f
    f = copy.copy(f)
    f.problem = copy.copy(f.problem)
    f.problem.elementwise_runner = None
    return f


def _row(x: Any) -> Row:
    try:
        return tuple(np.asarray(x, dtype=float).tolist())
    except (TypeError, ValueError):
        raise InvalidInput("design", x, "real numbers, to be kept in a file") from None


def _judged(gave: Any) -> Output | Failure:
    """Return the outputs of a design, or why they are none."""
    if isinstance(gave, Failure):
        return gave
    for key in ("F", "G", "H"):
        value = gave.get(key)
        if value is not None and np.isnan(np.asarray(value, dtype=float)).any():
            return Failure(NOT_A_NUMBER, f"{key} is {np.asarray(value)}")
    return gave
