"""Outcomes of many runs as the two files that the repository keeps of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from experiments.runner.committed import committed_file
from experiments.runner.registry import Context
from pymoo_hdte._runner.store import TIMES, write_atomically

Scores = TypeVar("Scores")


@dataclass(frozen=True)
class Stored(Generic[Scores]):
    """How the scores of an experiment are written and read.

    Seconds are in a separate file, because they differ from run to run.

    Attributes
    ----------
    read
        Takes both files.
    values_text, seconds_text
        Return the text of either.
    """

    read: Callable[[Path, Path], Scores]
    values_text: Callable[[Scores], str]
    seconds_text: Callable[[Scores], str]

    def committed(self, experiment: str) -> Scores:
        """Return the scores of the last full run; errors as `committed_file`."""
        return self.read(*(committed_file(file, experiment) for file in _files(experiment)))

    def leave(self, scores: Scores, experiment: str, context: Context) -> None:
        """Write both files to where the committed ones can be replaced by them."""
        values, seconds = _files(experiment)
        folders = context.out / experiment, context.out / TIMES / experiment
        write_atomically(folders[0] / values, self.values_text(scores).encode())
        write_atomically(folders[1] / seconds, self.seconds_text(scores).encode())

    def of(self, context: Context, experiment: str, run: Callable[[], Scores]) -> Scores:
        """Return the committed scores, or those of a full or quick run, which are left."""
        if not (context.full or context.quick):
            return self.committed(experiment)
        scores = run()
        self.leave(scores, experiment, context)
        return scores


def _files(experiment: str) -> tuple[str, str]:
    return f"{experiment}.csv", f"{experiment}_seconds.csv"
