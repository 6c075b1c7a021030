"""What the workflow says of fourteen rigs whose truth it has never been told.

Without ``--full`` the table is the committed one, ``experiments/data/sealed_rigs.csv``; with it the
campaigns in ``../shared/rig`` are analysed and both files left in the results folder.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

from tqdm import tqdm

from experiments.runner.committed import (
    stored_outcome,
    table_with_origin,
)
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.measured.rigs import MEASURED
from experiments.studies.measured.stored_rows import Rows, cells, headings, stored
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.result import Column, Result, Table
from pymoo_hdte._runner.store import TIMES, write_atomically
from pymoo_hdte.discrepancy import DriveAnalysis, analyse, read_campaign
from pymoo_hdte.discrepancy._report.words import in_a_sentence
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.effects.sentence_blanks import in_words

NAME = "sealed_rigs"
RIGS = MEASURED.parent / "rig"
"""Folder of the campaigns, which are not part of the project."""
COLUMNS = (
    Column("rig"),
    Column("status"),
    Column("effects"),
    Column("or"),
    Column("doubts"),
    Column("before", digits=4, group="chi-square per degree of freedom"),
    Column("after", digits=4, group="chi-square per degree of freedom"),
    Column("before", "noise", 4, "held-out gap"),
    Column("after", "noise", 4, "held-out gap"),
    Column("before", '"', 3, "transmission error held out"),
    Column("after", '"', 3, "transmission error held out"),
    Column("noise", '"', 3, "transmission error held out"),
)
SECONDS = (
    Column("rig"),
    *(Column(part, "s", 3, "CPU time") for part in ("verdict", "proof")),
)
SETTING, NOTE = paragraphs("sealed_rigs")

_WORDS = 5
"""Columns of a verdict before its numbers."""


def run(context: Context) -> Result:
    """Analyse the rigs, or read what was found, and show it."""
    if context.full and not RIGS.is_dir():
        sentence = f"Skipped: there are no campaigns in {RIGS}."
        return Result("Verdicts on sealed rigs", context.command(NAME), sentence)
    if context.full:
        rows, seconds = _analysed(context)
    else:
        rows, seconds = (stored(name, NAME) for name in (f"{NAME}.csv", f"{NAME}_seconds.csv"))
    return Result(
        title="Verdicts on sealed rigs",
        command=context.command(NAME),
        answer=_counted([row[1] for row in rows]),
        paragraphs=(*stored_outcome(context, NAME), SETTING),
        tables=(
            Table("verdicts", "What is said to be missing", COLUMNS, cells(_told(rows)), note=NOTE),
            Table("seconds", "CPU time", SECONDS, cells(seconds), wall_times=True),
        ),
    )


def _counted(statuses: Sequence[str]) -> str:
    """Say how many rigs end with each status."""
    counts = Counter(statuses).most_common()
    counted = ", ".join(f"{status} in {n}" for status, n in counts)
    return f"Verdicts on {len(statuses)} rigs: {counted}."


def verdict_row(name: str, analysis: DriveAnalysis) -> list[str]:
    """Return what is said of a rig, in the order of `COLUMNS`."""
    verdict, validation = analysis.verdict, analysis.validate()
    accepted = verdict.accepted
    effects = "" if accepted is verdict.base else _labels(accepted.candidates)
    rivals = " or ".join(_labels(hypothesis.candidates) for hypothesis in verdict.equivalent)
    fits = [
        hypothesis.chi_square / verdict.degrees_of_freedom
        for hypothesis in (verdict.base, accepted)
    ]
    words = [name, verdict.status, effects, rivals, "; ".join(map(in_a_sentence, verdict.reasons))]
    errors = [float("nan")] * 5
    if validation is not None:
        error = validation.channels["transmission_error"]
        errors = [validation.overall.before, validation.overall.after]
        errors += [error.before, error.after, error.noise_floor]
    return [*words, *(f"{number:.5g}" for number in (*fits, *errors))]


def _labels(candidates: Sequence[Candidate]) -> str:
    return " + ".join(candidate.label for candidate in candidates)


def _analysed(context: Context) -> tuple[Rows, Rows]:
    rows, seconds = [], []
    for folder in tqdm(sorted(RIGS.glob("rig-*")), desc="sealed rigs", leave=False):
        started = time.process_time()
        analysis = analyse(read_campaign(folder))
        judged = time.process_time()
        rows.append(verdict_row(folder.name, analysis))
        ended = time.process_time()
        seconds.append([folder.name, f"{judged - started:.3g}", f"{ended - judged:.3g}"])
    texts = table_with_origin(headings(COLUMNS), rows), csv_text(headings(SECONDS), seconds)
    write_atomically(context.out / NAME / f"{NAME}.csv", texts[0].encode())
    write_atomically(context.out / TIMES / NAME / f"{NAME}_seconds.csv", texts[1].encode())
    return rows, seconds


def _told(rows: Rows) -> Rows:
    """Return the rows of verdicts with statuses and labels in words."""
    return [
        [
            row[0],
            row[1],
            *(in_words(text).replace("_", " ") for text in row[2:_WORDS]),
            *row[_WORDS:],
        ]
        for row in rows
    ]
