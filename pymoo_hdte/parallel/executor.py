"""Evaluations of a pymoo problem on any workers, in the place of pymoo's own runners."""

from __future__ import annotations

import copy
import heapq
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput, whole_number
from pymoo_hdte.parallel.counts import Counts
from pymoo_hdte.parallel.kept_designs import KeptDesigns, Output, Row
from pymoo_hdte.parallel.virtual import VirtualWorkers
from pymoo_hdte.problems.simulator.children import NOT_A_NUMBER, TOO_LONG, Failure
from pymoo_hdte.problems.simulator.runs import SimulatorFailed
from pymoo_hdte.problems.simulator.workers import Workers


@dataclass
class _Task:
    """An evaluation under way: f(x), tried so often."""

    f: Callable[[Any], Output]
    x: Any
    row: Row | None
    tries: int = 1


class ExecutorParallelization:
    """The ``elementwise_runner`` of a problem whose evaluations are costly, and may fail.

    All of pymoo's algorithms can use it. Results are put in the order of the designs, so that a run
    gives the same bytes on any number of workers, in any order of arrival, and after a kill.

    A design is lost, with NaN for its objectives and constraints, if its evaluation raises, gives
    NaN or loses its worker as often as it is tried, or lasts too long. The swarms of this package
    rank it last; for other algorithms set ``replace_nan_values_by`` of the problem to something
    large, since NaN would pass for non-dominated there.

    Parameters
    ----------
    executor : int or object, optional
        Of `concurrent.futures`, or a client of Dask; or a number of processes of our own, each of
        which is ended and replaced alone; or `VirtualWorkers`. Without one, evaluations run here,
        one after the other.
    time_limit : float, optional
        Seconds after which an evaluation is ended, imports not counted. It then runs in a process
        beside its worker, together with the programs that it calls: hanging ones free the worker,
        crashing ones leave it whole, on every kind of executor.
    tries : int
        How often an evaluation is made that raises, gives NaN or loses its worker.
    cache : path, optional
        File of finished evaluations, lost ones included, for a simulator that gives the same at the
        same design. With it nothing that had ended is evaluated again, though the process be
        killed; the first one is, if the source of the problem has changed, to see whether the file
        is its own. Outputs have to be numbers. To have lost designs tried again, take their lines
        (``"failed"``) out of the file.

    Attributes
    ----------
    counts : Counts
        What became of the evaluations. Our swarms hand it on as ``result.evaluations``, and warn
        at the end of a run that lost designs.

    Raises
    ------
    InvalidInput
        If an argument is not allowed, the file belongs to another problem, or a problem that was
        stored comes back without workers.
    SimulatorFailed
        If nothing but failures came so far, at the end of the first generation.
    """

    def __init__(
        self,
        executor: Any = None,
        *,
        time_limit: float | None = None,
        tries: int = 2,
        cache: str | os.PathLike[str] | None = None,
    ) -> None:
        virtual = isinstance(executor, VirtualWorkers)
        if virtual and time_limit is not None:
            raise InvalidInput("time_limit", time_limit, "that of the VirtualWorkers")
        self._workers: Any = executor if virtual else Workers(executor, time_limit)
        self._tries = whole_number("tries", tries, 1)
        self._cache = cache
        self.counts = Counts()
        self._forget()

    def _forget(self) -> None:
        self._kept: KeptDesigns | None = None
        self._known: list[tuple[int, int, Row]] = []
        self._same: dict[Row, list[int]] = {}
        self._tasks: dict[int, _Task] = {}
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._delivered: Output | None = None

    def __getstate__(self) -> dict[str, Any]:
        # Workers cannot be stored, and what a problem is does not depend on them.
        return {"_tries": self._tries, "_cache": self._cache}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state | {"_workers": None, "counts": Counts()}
        self._forget()

    @property
    def number(self) -> int | None:
        """How many evaluations run at once; None if the executor does not tell."""
        return None if self._workers is None else self._workers.number

    def __call__(self, f: Callable[[Any], Output], X: Sequence[Any]) -> list[Output]:
        """Return f(x) of every x, in their order; NaN where it failed."""
        if self._delivered is not None:
            delivered, self._delivered = self._delivered, None
            return [delivered]
        outputs: dict[int, Output | None] = {}
        try:
            for number, x in enumerate(X):
                self.start(number, f, x)
            while len(outputs) < len(X):
                number, output = self.next()
                outputs[number] = output
        except BaseException:
            self.cancel()
            raise
        self.refuse_failures()
        return [self._filled(f, outputs[number]) for number in range(len(X))]

    def start(self, number: int, f: Callable[[Any], Output], x: Any) -> None:
        """Have f(x) evaluated, which `next` returns with the number.

        Parameters
        ----------
        number : int
            Tells the design from others under way.
        f : callable
            Of pymoo: from a design to its outputs by name.
        x : object
            The design; with a file n_var real numbers.
        """
        if self._workers is None:
            allowed = "a new one: workers are not stored with a problem"
            raise InvalidInput("elementwise_runner of the problem", self, allowed)
        row = None if self._cache is None else _row(x)
        if row is not None:
            self._kept = self._kept or self._opened(f, len(row))
            if row in self._kept.order:
                heapq.heappush(self._known, (self._kept.order[row], number, row))
                return
            if row in self._same:
                self._same[row].append(number)
                return
            self._same[row] = []
        self._tasks[number] = task = _Task(_without_runner(f), x, row)
        self._workers.start(number, task.f, x)

    def _opened(self, f: Callable[[Any], Output], n_var: int) -> KeptDesigns:
        bare = _without_runner(f)

        def again(row: Row) -> Output | Failure:
            for _ in range(self._tries):
                self._workers.start(None, bare, np.array(row))
                gave: Output | Failure = _judged(self._workers.next()[1])
                if not isinstance(gave, Failure):
                    break
            return gave

        assert self._cache is not None
        return KeptDesigns(self._cache, getattr(bare, "problem", f), n_var, again)

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
            self.counts.repeated += 1
            self._workers.start(number, task.f, task.x)
        del self._tasks[number]
        if task.row is not None and self._kept is not None:
            gave = self._kept.keep(task.row, gave)
            for other in self._same.pop(task.row):
                heapq.heappush(self._known, (self._kept.order[task.row], other, task.row))
        self.counts.made += not isinstance(gave, Failure)
        return number, self._counted(gave)

    def _from_file(self) -> tuple[int, Output | None]:
        _, number, row = heapq.heappop(self._known)
        assert self._kept is not None
        gave = self._kept[row]
        self.counts.from_file += not isinstance(gave, Failure)
        return number, self._counted(gave)

    def _counted(self, gave: Output | Failure) -> Output | None:
        if isinstance(gave, Failure):
            self.counts.lose(gave.kind, gave.text)
            return None
        self._shapes = {key: np.shape(value) for key, value in gave.items()}
        return gave

    def _filled(self, f: Any, output: Output | None) -> Output:
        """Return the outputs of a design, NaN for one that is lost."""
        if output is not None:
            return output
        shapes = dict(self._shapes)
        if (problem := getattr(f, "problem", None)) is not None:
            sizes = {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}
            shapes = {key: (size,) for key, size in sizes.items() if size} | shapes
        return {key: np.full(shape, np.nan) for key, shape in shapes.items()}

    def deliver(self, f: Any, output: Output | None) -> None:
        """Hand out the outputs of a design, NaN for a lost one, in the next call by pymoo."""
        self._delivered = self._filled(f, output)

    def refuse_failures(self) -> None:
        """Raise `SimulatorFailed` if nothing but failures came so far."""
        if self.counts.n_lost and not self.counts.made + self.counts.from_file:
            raise SimulatorFailed(f"no evaluation gave a result: {self.counts}")

    def cancel(self) -> None:
        """Forget what is under way, and end it where the processes are our own."""
        if self._workers is not None:
            self._workers.cancel()
        self._known, self._same, self._tasks = [], {}, {}

    def close(self) -> None:
        """End the processes that are our own; executors of the caller stay."""
        if self._workers is not None:
            self._workers.close()

    def __enter__(self) -> ExecutorParallelization:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


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
