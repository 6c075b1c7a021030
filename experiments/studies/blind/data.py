"""Outcomes of blind cases as the small CSV that the repository keeps.

Seconds are in a separate file, because they differ from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from experiments.runner.committed import read_origin, read_rows, table_with_origin
from experiments.studies.blind.cases import Case
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.scoring import NUMBERS, PARTS, PLACES, RIVALS
from experiments.studies.blind.truth import ERROR, NAMES, PORTS, STATUSES, word, words_of_set
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.campaign import Run

_CASE = ("kind", "number", "truth", "forms", "stress")
_WORDS = ("status", "probability", "chosen", "equivalents", "members", "truth_in_class", *RIVALS)


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
    for case_outcome in outcomes:
        said = "" if case_outcome.probability is None else f"{case_outcome.probability:.6g}"
        words = [
            case_outcome.status,
            said,
            " ".join(case_outcome.chosen),
            " ".join(case_outcome.equivalents),
            case_outcome.members,
        ]
        answers = [case_outcome.answers.get(name, "") for name in RIVALS]
        numbers = [
            f"{case_outcome.numbers[n]:.6g}" if n in case_outcome.numbers else "" for n in NUMBERS
        ]
        rows.append(
            [
                *_identity(case_outcome.case),
                *words,
                int(case_outcome.truth_in_class),
                *answers,
                *numbers,
            ]
        )
    seeds = sorted({case_outcome.case.root for case_outcome in outcomes})
    return table_with_origin([*_CASE, *_WORDS, *NUMBERS], rows, seed=seeds)


def format_seconds(outcomes: Sequence[Outcome]) -> str:
    """Return the CSV text of the seconds of outcomes."""
    rows = []
    for case_outcome in outcomes:
        seconds = [f"{second:.3g}" for second in case_outcome.seconds]
        rows.append([*_identity(case_outcome.case), *seconds, *[""] * (len(PARTS) - len(seconds))])
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
