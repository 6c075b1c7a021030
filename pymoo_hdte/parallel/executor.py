"""Evaluations of a pymoo problem on any workers, in the place of pymoo's own runners."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from pymoo_hdte.checks import InvalidInput, whole_number
from pymoo_hdte.parallel.counts import Counts
from pymoo_hdte.parallel.evaluations import Evaluations
from pymoo_hdte.parallel.stored_designs import Output
from pymoo_hdte.parallel.virtual import VirtualWorkers
from pymoo_hdte.problems._simulator.workers import Workers


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
        Executor of `concurrent.futures`, client of Dask, or a number of own processes, each of
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
        is its own. Outputs have to be numbers. Designs that were over the time limit are tried
        again under a longer one; to have others tried again, take their lines (``"failed"``) out of
        the file. One process at a time may use it.

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

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems.functional import FunctionalProblem
    >>> parabolas = [lambda x: x @ x, lambda x: (x - 1) @ (x - 1)]
    >>> with ExecutorParallelization() as runner:  # here; 4 would be four processes
    ...     problem = FunctionalProblem(2, parabolas, xl=-1, xu=2, elementwise_runner=runner)
    ...     print(minimize(problem, CompactSwarm(), ("n_eval", 200), seed=1).evaluations)
    200 designs evaluated
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
        tries = whole_number("tries", tries, 1)
        self._workers: Any = executor if virtual else Workers(executor, time_limit)
        self.counts = Counts()
        self._under_way: Evaluations | None = Evaluations(self._workers, tries, cache, self.counts)
        self._delivered: Output | None = None

    def __getstate__(self) -> dict[str, Any]:
        # Workers cannot be stored.
        return self.__dict__ | {"_workers": None, "_under_way": None, "_delivered": None}

    @property
    def number(self) -> int | None:
        """How many evaluations run at once; None if the executor does not tell."""
        return None if self._workers is None else self._workers.number

    @property
    def evaluations(self) -> Evaluations:
        """The evaluations under way.

        Raises
        ------
        InvalidInput
            If the runner comes back from a file, without workers.
        """
        if self._under_way is None:
            allowed = "a new one: workers are not stored with a problem"
            raise InvalidInput("elementwise_runner of the problem", self, allowed)
        return self._under_way

    def __call__(self, f: Callable[[Any], Output], X: Sequence[Any]) -> list[Output]:
        """Return f(x) of every x, in their order; NaN where it failed.

        Parameters
        ----------
        f : callable
            Function of pymoo that maps a design to its outputs by name.
        X : sequence
            Designs.

        Returns
        -------
        list of dict
            Outputs by name.

        Raises
        ------
        InvalidInput, SimulatorFailed
            As the class says.
        """
        if self._delivered is not None:
            delivered, self._delivered = self._delivered, None
            return [delivered]
        under_way = self.evaluations
        outputs: dict[int, Output | None] = {}
        try:
            for number, x in enumerate(X):
                under_way.start(number, f, x)
            while len(outputs) < len(X):
                number, output = under_way.next()
                outputs[number] = output
        except BaseException:
            under_way.cancel()
            raise
        under_way.refuse_failures()
        return [under_way.filled(f, outputs[number]) for number in range(len(X))]

    def deliver(self, output: Output) -> None:
        """Hand out the outputs of one design in the next call by pymoo.

        Parameters
        ----------
        output : dict
            Outputs by name, from `evaluations`.
        """
        self._delivered = output

    def close(self) -> None:
        """End the processes that are our own; executors of the caller stay."""
        if self._workers is not None:
            self._workers.close()

    def __enter__(self) -> ExecutorParallelization:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
