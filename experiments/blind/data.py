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
from experiments.blind.scoring import NUMBERS, PARTS, RIVALS
from experiments.runner.campaign import Run
from experiments.runner.committed import read_origin, read_rows, table_with_origin
from pymoo_hdte.discrepancy.drive.proof import Gap
from pymoo_hdte.discrepancy.engine.verdict import EXPLAINED
from pymoo_hdte.io.text_table import csv_text

CONFIDENT = ("named", "parameter")
"""Statuses that give a single answer."""
OPENED = 1.5
"""Multiple of the noise floor beyond which the revision has opened a gap."""
_CASE = ("kind", "truth", "size", "number")
_WORDS = ("status", "chosen", "equivalents", "truth_in_class", *RIVALS)


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
    truth_in_class : bool
        Whether one of these sets holds all that is hidden.
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
    truth_in_class: bool = False
    answers: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    seconds: tuple[float, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accepted effects."""
        if self.status not in EXPLAINED:
            return ()
        return tuple(label.partition(":")[0] for label in self.chosen)

    @property
    def right(self) -> bool:
        """Whether the first name is a hidden effect, or the class holds all that is hidden.

        A parameter out of tolerance has to be the right one.
        """
        if self.case.kind == "parameter":
            return bool(self.names) and self.chosen[0] == f"parameter:{self.case.names[0]}"
        return bool(self._hidden & set(self.names[:1])) or self._in_class

    @property
    def right_answer(self) -> bool:
        """Whether the verdict is what it must be for what is hidden."""
        if self.case.kind == "none":
            return self.status == "adequate"
        if self.case.kind == "unlisted":
            return self.status == "unlisted"
        return self.both if self.case.kind == "pair" else self.right

    @property
    def right_word(self) -> bool:
        """Whether the preferred answer alone, without its class, is what it must be."""
        if self.case.kind in ("none", "unlisted"):
            return self.right_answer
        return bool(self._hidden & set(self.names[:1]))

    @property
    def both(self) -> bool:
        """Whether all that is hidden is named or in the class."""
        return self._hidden <= set(self.names) or self._in_class

    @property
    def wrong_confident(self) -> bool:
        """Whether any name is not hidden, and no other is offered."""
        wrong = not self.right or not set(self.names) <= self._hidden
        return self.status in CONFIDENT and wrong

    @property
    def answer(self) -> str:
        """One word for a confusion matrix: the truth where it is right, or name or status."""
        if self.status not in EXPLAINED:
            return self.status
        if self.right and len(self._hidden) == 1:
            return next(iter(self._hidden))
        return self.names[0]

    @property
    def f1(self) -> float | None:
        """Of the flagged cells against those truly moved; None where there is neither."""
        if self.status == ERROR:
            return 0.0
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

    @property
    def _hidden(self) -> set[str]:
        return {"parameter"} if self.case.kind == "parameter" else set(self.case.names)

    @property
    def _in_class(self) -> bool:
        return self.status == "class" and self.truth_in_class


def outcome(case: Case, run: Run) -> Outcome:
    """Decode the run of a `BlindJob`."""
    cells = dict(zip(run.columns, run.values[0].tolist(), strict=True))
    chosen = []
    for place in ("first", "second"):
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
        truth_in_class=cells["truth_in_class"] == 1.0,
        answers={n: word(cells[n], NAMES) for n in RIVALS if not math.isnan(cells[n])},
        numbers={name: cells[name] for name in NUMBERS if not math.isnan(cells[name])},
        seconds=run.parts,
    )


def format_outcomes(outcomes: Sequence[Outcome]) -> str:
    """Return the CSV text of outcomes, with seed, date and versions in a first comment line."""
    rows = []
    for one in outcomes:
        words = [one.status, " ".join(one.chosen), " ".join(one.equivalents)]
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
            truth_in_class=row["truth_in_class"] == "1",
            answers={name: row[name] for name in RIVALS if row[name]},
            numbers={name: float(row[name]) for name in NUMBERS if row[name]},
            seconds=tuple(float(time[part]) for part in PARTS if time[part]),
        )
        for row, time in zip(read_rows(path), read_rows(seconds_path), strict=True)
    ]


def _identity(case: Case) -> tuple[str, str, str, int]:
    return case.kind, case.truth, f"{case.size:g}", case.number


def _case(row: dict[str, str], root: int) -> Case:
    names = () if row["truth"] == "none" else tuple(row["truth"].split("+"))
    return Case(row["kind"], names, float(row["size"]), int(row["number"]), root)
