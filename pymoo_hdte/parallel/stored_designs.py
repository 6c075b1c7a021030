"""Finished evaluations of a pymoo problem on disk, as flat numbers with names."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems._simulator.children import Failure
from pymoo_hdte.problems._simulator.identity import identity
from pymoo_hdte.problems._simulator.run_file import RunFile

Output = dict[str, Any]
Row = tuple[float, ...]


class StoredDesigns:
    """Evaluated designs in a file, from which a killed run goes on.

    Parameters
    ----------
    path : str or path-like
        The file.
    problem : object
        The problem, identified by its state and source.
    n_var : int
        Number of its variables.
    again : callable
        Evaluates a design: its outputs, or a `Failure`. Called once if the problem may be another.
    time_limit : float or None
        Seconds that an evaluation has; one that was ended after fewer is lost no longer.

    Attributes
    ----------
    order : dict
        Position of each design in the order in which they were finished, from 0.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        problem: object,
        n_var: int,
        again: Callable[[Row], Output | Failure],
        time_limit: float | None,
    ) -> None:
        names = tuple(f"x{k + 1}" for k in range(n_var))
        self._file = RunFile(path, names, identity(problem))  # type: ignore[arg-type]

        def numbers(row: Row) -> list[float] | None:
            gave = again(row)
            return None if isinstance(gave, Failure) else self._flat(gave)[1]

        if not self._file.goes_on:
            self._file.check(numbers)
            # Another source may do better where the former one failed.
            self._file.failures.clear()
        self._file.retry_within(time_limit)
        done = [row for row in self._file.order if row in self._file.runs | self._file.failures]
        self.order = {row: place for place, row in enumerate(done)}
        self._early: dict[Row, Failure] = {}

    def __getitem__(self, row: Row) -> Output | Failure:
        """Return what is known of a design."""
        if row in self._file.runs:
            return self._whole(self._file.runs[row])
        if row in self._early:
            return self._early[row]
        kind, _, text = self._file.failures[row].partition(": ")
        return Failure(kind, text)

    def keep(self, row: Row, gave: Output | Failure) -> Output | Failure:
        """Write what a design gave to the disk, and return it as it will come back from there."""
        self.order.setdefault(row, len(self.order))
        if isinstance(gave, Failure):
            # Where nothing has run so far, what is amiss will be mended: nothing is given up.
            self._early[row] = gave
            self._write_failures(bool(self._file.runs))
            return gave
        names, flat = self._flat(gave)
        self._write_failures(True)
        self._file.keep(row, flat, names)
        return self._whole(flat)

    def _write_failures(self, now: bool) -> None:
        while now and self._early:
            row = next(iter(self._early))
            failure = self._early.pop(row)
            self._file.keep_failure(row, f"{failure.kind}: {failure.text}")

    def _flat(self, gave: Output) -> tuple[tuple[str, ...], list[float]]:
        names: list[str] = []
        flat: list[float] = []
        for key, value in gave.items():
            try:
                numbers = np.asarray(value, dtype=float).ravel().tolist()
            except (TypeError, ValueError):
                raise InvalidInput(f"output {key!r}", value, "numbers, to be kept") from None
            names += [f"{key}[{k}]" for k in range(len(numbers))]
            flat += numbers
        if self._file.responses not in ((), tuple(names)):
            raise InvalidInput("names of the outputs", tuple(names), str(self._file.responses))
        return tuple(names), flat

    def _whole(self, flat: list[float]) -> Output:
        output: dict[str, list[float]] = {}
        for name, number in zip(self._file.responses, flat, strict=True):
            output.setdefault(name.rpartition("[")[0], []).append(number)
        return {key: np.array(numbers) for key, numbers in output.items()}
