"""What became of the evaluations of a run."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field


@dataclass
class Counts:
    """How many designs were evaluated, taken from the file, or lost, and why.

    Attributes
    ----------
    made : int
        Designs evaluated in this process's run, with a result.
    from_file : int
        Designs whose result was in the file, from an earlier run or from the same design earlier in
        this one; lost ones count as lost.
    lost : Counter
        Designs without a result, which are NaN, by kind: "raised", "not a number", "over the time
        limit", "worker lost".
    repeated : int
        Evaluations made again because the first one failed.
    first_loss : str
        Text of the first loss; empty without one.

    Examples
    --------
    >>> counts = Counts(made=9)
    >>> counts.lose("raised", "no convergence")
    >>> print(counts)
    9 designs evaluated, 1 designs lost (1 raised); the first: no convergence
    """

    made: int = 0
    from_file: int = 0
    lost: Counter[str] = field(default_factory=Counter)
    repeated: int = 0
    first_loss: str = ""

    def lose(self, kind: str, text: str) -> None:
        """Count a design without a result.

        Parameters
        ----------
        kind : str
            One of the four kinds.
        text : str
            Text of the loss.
        """
        self.first_loss = self.first_loss or text
        self.lost[kind] += 1

    @property
    def n_lost(self) -> int:
        """Number of designs without a result."""
        return self.lost.total()

    def __str__(self) -> str:
        words = f"{self.made} designs evaluated"
        if self.from_file:
            words += f", {self.from_file} taken from the file"
        if self.repeated:
            words += f", {self.repeated} evaluations made again"
        if self.n_lost:
            kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(self.lost.items()))
            words += f", {self.n_lost} designs lost ({kinds}); the first: {self.first_loss}"
        return words
