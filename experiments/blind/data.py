"""Outcomes of blind cases: as objects, and as the small CSV that the repository keeps.

Seconds are in a separate file, because they differ from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from experiments.blind.cases import Case
from experiments.blind.codes import ERROR, NAMES, PORTS, STATUSES, word, words_of_set
from experiments.blind.scoring import MOST_IN_CLASS, NUMBERS, PARTS, PLACES, RIVALS
from experiments.blind.truth import may_be_named, one_name, to_be_named
from experiments.runner.campaign import Run
from experiments.runner.committed import read_origin, read_rows, table_with_origin
from pymoo_hdte.discrepancy.drive.proof import Gap
from pymoo_hdte.discrepancy.engine.verdict import EXPLAINED
from pymoo_hdte.io.text_table import csv_text

CONFIDENT = ("named", "parameter")
"""Statuses that give a single answer."""
OPENED = 1.5
"""Multiple of the noise floor beyond which the revision has opened a gap."""
_CASE = ("kind", "number", "truth", "forms", "stress")
_WORDS = ("status", "probability", "chosen", "equivalents", "members", "truth_in_class", *RIVALS)


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
        before, error = (self.numbers.get(f"bias_{one}", 0.0) for one in ("before", "error"))
        after = self.numbers.get("bias_after", 0.0)
        if max(before, after) <= error:
            return None
        return after / max(before, error)

    def gap(self, name: str) -> Gap | None:
        """Return one of `experiments.blind.scoring.GAPS`; None where nothing was proved."""
        if f"{name}_before" not in self.numbers:
            return None
        before, after, floor = (self.numbers[f"{name}_{s}"] for s in ("before", "after", "floor"))
        return Gap(before, after, floor, "")

    def shrinkage(self, name: str) -> float | None:
        """Return how far one of the gaps shrinks; None where there is none, 0 after a failure.

        A gap that the revision opened shrank by -1.
        """
        if self.status == ERROR:
            return 0.0
        gap = self.gap(name)
        if gap is None or gap.shrinkage is not None:
            return None if gap is None else gap.shrinkage
        return None if self.closed(name, OPENED) else -1.0

    def open_before(self, name: str, multiple: float) -> bool:
        """Return whether one of the gaps was beyond a multiple of the noise floor, or unknown."""
        gap = self.gap(name)
        return self.status == ERROR or (gap is not None and gap.before > multiple * gap.noise_floor)

    def closed(self, name: str, multiple: float) -> bool:
        """Return whether one of the gaps ends within a multiple of the noise floor."""
        gap = self.gap(name)
        return gap is not None and gap.after <= multiple * gap.noise_floor


def outcome(case: Case, run: Run) -> Outcome:
    """Decode the run of a `BlindJob`."""
    cells = dict(zip(run.columns, run.values[0].tolist(), strict=True))
    chosen = []
    for place in PLACES:
        if not math.isnan(cells[place]):
            order = cells[f"{place}_order"]
            at = "" if math.isnan(order) else f"@{order:.4g}"
            port = word(cells[f"{place}_port"], PORTS)
            chosen.append(f"{word(cells[place], NAMES)}:{port}{at}")
    failed = word(cells["status"], STATUSES) == ERROR
    return Outcome(
        case=case,
        status=word(cells["status"], STATUSES),
        chosen=tuple(chosen),
        equivalents=() if failed else words_of_set(cells["equivalents"]),
        members=0 if failed else int(cells["members"]),
        truth_in_class=cells["truth_in_class"] == 1.0,
        probability=None if math.isnan(cells["probability"]) else cells["probability"],
        answers={n: word(cells[n], NAMES) for n in RIVALS if not math.isnan(cells[n])},
        numbers={name: cells[name] for name in NUMBERS if not math.isnan(cells[name])},
        seconds=run.parts,
    )


def format_outcomes(outcomes: Sequence[Outcome]) -> str:
    """Return the CSV text of outcomes, with seed, date and versions in a first comment line."""
    rows = []
    for one in outcomes:
        said = "" if one.probability is None else f"{one.probability:.6g}"
        words = [one.status, said, " ".join(one.chosen), " ".join(one.equivalents), one.members]
        answers = [one.answers.get(name, "") for name in RIVALS]
        numbers = [f"{one.numbers[n]:.6g}" if n in one.numbers else "" for n in NUMBERS]
        rows.append([*_identity(one.case), *words, int(one.truth_in_class), *answers, *numbers])
    seeds = sorted({one.case.root for one in outcomes})
    return table_with_origin([*_CASE, *_WORDS, *NUMBERS], rows, seed=seeds)


def format_seconds(outcomes: Sequence[Outcome]) -> str:
    """Return the CSV text of the seconds of outcomes."""
    rows = []
    for one in outcomes:
        seconds = [f"{second:.3g}" for second in one.seconds]
        rows.append([*_identity(one.case), *seconds, *[""] * (len(PARTS) - len(seconds))])
    return csv_text([*_CASE, *PARTS], rows)


def read_outcomes(path: Path, seconds_path: Path) -> list[Outcome]:
    """Read what `format_outcomes` and `format_seconds` wrote."""
    (root,) = read_origin(path)["seed"]
    return [
        Outcome(
            case=_case(row, root),
            status=row["status"],
            chosen=tuple(row["chosen"].split()),
            equivalents=tuple(row["equivalents"].split()),
            members=int(row["members"]),
            truth_in_class=row["truth_in_class"] == "1",
            probability=float(row["probability"]) if row["probability"] else None,
            answers={name: row[name] for name in RIVALS if row[name]},
            numbers={name: float(row[name]) for name in NUMBERS if row[name]},
            seconds=tuple(float(time[part]) for part in PARTS if time[part]),
        )
        for row, time in zip(read_rows(path), read_rows(seconds_path), strict=True)
    ]


def _identity(case: Case) -> tuple[str, int, str, str, str]:
    return case.kind, case.number, case.truth, case.forms, case.stress


def _case(row: dict[str, str], root: int) -> Case:
    return Case(row["kind"], int(row["number"]), root)
