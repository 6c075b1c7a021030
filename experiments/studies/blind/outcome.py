"""What the workflow says of a blind case, and in which senses that is right."""

from __future__ import annotations

from dataclasses import dataclass, field

from experiments.studies.blind.cases import Case
from experiments.studies.blind.scoring import MOST_IN_CLASS
from experiments.studies.blind.truth import ERROR, may_be_named, one_name, to_be_named
from pymoo_hdte.discrepancy._selection.verdict import EXPLAINED
from pymoo_hdte.discrepancy._verdicts.validation_drive import PredictionError

CONFIDENT = ("named", "parameter")
"""Statuses that give a single answer."""
OPENED = 1.5
"""Multiple of the noise floor beyond which the revision has raised an error."""


@dataclass(frozen=True)
class Outcome:
    """What the workflow says of a case.

    Attributes
    ----------
    case : Case
    status : str
        Of the verdict, or `ERROR`.
    chosen : tuple of str
        Labels (name:port@order) of the effects that it prefers, accepted or not.
    equivalents : tuple of str
        Names in the sets that it cannot tell from those.
    members : int
        Number of sets that it cannot tell apart, that of the preferred effects among them.
    truth_in_class : bool
        Whether one of these sets is what is hidden.
    probability : float or None
        That the verdict gives itself.
    answers : dict
        What the simpler tools say, by their name.
    numbers : dict
        `NUMBERS` that are scored for this kind.
    seconds : tuple of float
        Of the `PARTS`, as far as they were run.
    """

    case: Case
    status: str
    chosen: tuple[str, ...]
    equivalents: tuple[str, ...] = ()
    members: int = 0
    truth_in_class: bool = False
    probability: float | None = None
    answers: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    seconds: tuple[float, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accepted effects."""
        if self.status not in EXPLAINED:
            return ()
        parts = (label.partition("@")[0].partition(":") for label in self.chosen)
        return tuple(one_name(name, port) for name, _, port in parts)

    @property
    def hidden(self) -> frozenset[str]:
        """Names of what is hidden and could be named."""
        return to_be_named(self.case)

    @property
    def true_names(self) -> bool:
        """Whether something is named and all of it is there."""
        return bool(self.names) and set(self.names) <= may_be_named(self.case)

    @property
    def confident(self) -> bool:
        """Whether the verdict gives a single answer."""
        return self.status in CONFIDENT

    @property
    def wrong_confident(self) -> bool:
        """Whether a single answer has a name that is not hidden, or only what the hidden holds."""
        missed = bool(self.hidden) and not self.hidden & set(self.names)
        return self.confident and (missed or not self.true_names)

    @property
    def wrong_partial(self) -> bool:
        """Whether what is called certain, but not all, holds a name that is not hidden."""
        return self.status == "partial" and not self.true_names

    @property
    def right(self) -> bool:
        """Whether the first name is hidden, or a small class holds what is hidden.

        Of what is called certain but not all, every name has to be hidden.
        """
        if self.status == "class":
            return self.truth_in_class and self.members <= MOST_IN_CLASS
        if self.status == "partial":
            return self.true_names and bool(self.hidden & set(self.names))
        return bool(self.hidden & set(self.names[:1]))

    @property
    def right_first(self) -> bool:
        """Whether the preferred answer alone, without its class, is what it must be."""
        if not self.hidden:
            return self.right_answer
        return bool(self.hidden & set(self.names[:1]))

    @property
    def all_named(self) -> bool:
        """Whether all that is hidden is named with confidence, or is a member of a small class."""
        if self.status == "class":
            return self.right
        return self.confident and bool(self.hidden) and self.hidden <= set(self.names)

    @property
    def two_named(self) -> bool:
        """Whether two hidden effects are named, and nothing that is not hidden."""
        return self.true_names and len(self.hidden & set(self.names)) >= 2

    @property
    def nothing_hidden(self) -> bool:
        """Whether the believed model is right as it is."""
        return self.case.kind != "unlisted" and not self.hidden

    @property
    def right_answer(self) -> bool:
        """Whether the verdict is what it must be for what is hidden."""
        if self.nothing_hidden:
            return self.status == "adequate"
        if self.case.kind == "unlisted":
            return self.status == "unlisted" or (self.status == "partial" and self.true_names)
        if self.case.kind == "pair":
            return self.all_named
        return self.two_named if self.case.kind == "triple" else self.right

    @property
    def true_statement(self) -> bool:
        """Whether what the verdict says is true: what its probability is of."""
        if self.status == "class":
            return self.right
        if self.status in EXPLAINED:
            return self.true_names and not self.wrong_confident
        return self.right_answer

    @property
    def answer(self) -> str:
        """One word for a confusion matrix: the truth where it is right, or name or status."""
        if self.status not in EXPLAINED or not self.names:
            return self.status
        if self.right and len(self.case.names) == 1:
            return self.case.names[0]
        return self.names[0]

    @property
    def covered(self) -> list[bool]:
        """Whether each interval of a named effect's quantity holds its true value."""
        total, held = (int(self.numbers.get(n, 0.0)) for n in ("quantities", "quantities_covered"))
        return [True] * held + [False] * (total - held)

    @property
    def f1(self) -> float | None:
        """Of the flagged cells against those truly moved; None where there is neither."""
        if self.status == ERROR:
            return 0.0
        if "cells_both" not in self.numbers:
            return None
        cells = self.numbers.get("cells_moved", 0.0) + self.numbers.get("cells_flagged", 0.0)
        return 2.0 * self.numbers["cells_both"] / cells if cells else None

    @property
    def bias_ratio(self) -> float | None:
        """Bias of the base after the revision over that before it; 1 where the workflow failed.

        None where neither moves the base by more than its standard error.
        """
        if self.status == ERROR:
            return 1.0
        before, error = (self.numbers.get(f"bias_{state}", 0.0) for state in ("before", "error"))
        after = self.numbers.get("bias_after", 0.0)
        if max(before, after) <= error:
            return None
        return after / max(before, error)

    def error(self, name: str) -> PredictionError | None:
        """Return one of `experiments.studies.blind.scoring.GAPS`; None without held-out records."""
        if f"{name}_before" not in self.numbers:
            return None
        before, after, floor = (self.numbers[f"{name}_{s}"] for s in ("before", "after", "floor"))
        return PredictionError(before, after, floor, "")

    def shrinkage(self, name: str) -> float | None:
        """Return how far one of the errors shrinks; None where there is none, 0 after a failure.

        An error that the revision raised shrank by -1.
        """
        if self.status == ERROR:
            return 0.0
        error = self.error(name)
        if error is None or error.shrinkage is not None:
            return None if error is None else error.shrinkage
        return None if self.closed(name, OPENED) else -1.0

    def open_before(self, name: str, multiple: float) -> bool:
        """Return whether one of the errors was beyond a multiple of the noise floor, or unknown."""
        error = self.error(name)
        return self.status == ERROR or (
            error is not None and error.before > multiple * error.noise_floor
        )

    def closed(self, name: str, multiple: float) -> bool:
        """Return whether one of the errors ends within a multiple of the noise floor."""
        error = self.error(name)
        return error is not None and error.after <= multiple * error.noise_floor
