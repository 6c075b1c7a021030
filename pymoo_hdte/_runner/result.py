"""What an experiment hands back: sentences, tables and figures, immutable and storable."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.figure import Figure

NO_VALUE = "\N{EM DASH}"
MINUS = "\N{MINUS SIGN}"

LONG = 40
"""Characters from which a cell is given room."""

Cell = float | int | str | None
"""What a table holds; None where there is nothing to say."""

SHOWN, NOT_SHOWN, MISSED = "Shown", "Not shown", "Missed"
"""States of a score, which chance has a part in: its 95 % interval meets the demand, the score
itself does but its interval does not, as there are too few cases, or the score does not."""
SCORE_STATES = (SHOWN, NOT_SHOWN, MISSED)

MOODS = {
    "Contradicts": "no",
    "Consistent": "yes",
    "Differs": "no",
    "Agrees": "yes",
    "Missed by the fit": "no",
    "Fitted": "fitted",
    "Fails": "no",
    "Holds": "yes",
    MISSED: "no",
    NOT_SHOWN: "open",
    SHOWN: "yes",
}
"""The style in which a page shows a finding, by its `Finding.verdict`."""


@dataclass(frozen=True)
class Finding:
    """One sentence that sets our numbers against the paper's, and whether the two agree.

    A ``check`` sets them against a demand of our own instead, and says whether it holds. A check in
    which chance has a part is a ``score``, one of `SCORE_STATES`; see `scored`. Where the model was
    ``fitted`` to the paper's numbers, giving them back is no agreement. What stands
    ``within_paper`` sets printed numbers against each other, and needs no drive model of ours. At
    most one of the three holds. What ``answers`` the question of its experiment is repeated at the
    top of the page.
    """

    agrees: bool
    sentence: str
    check: bool = False
    fitted: bool = False
    answers: bool = False
    within_paper: bool = False
    score: str = ""

    def __post_init__(self) -> None:
        if self.check + self.fitted + self.within_paper > 1:
            raise ValueError("a finding is a check, of a fit or within the paper, not two of these")
        if self.score and not (self.check and self.score in SCORE_STATES):
            raise ValueError(f"a score is a check in one of the states {', '.join(SCORE_STATES)}")
        object.__setattr__(self, "agrees", bool(self.agrees))

    @property
    def verdict(self) -> str:
        """The outcome in a word or two."""
        if self.score:
            return self.score
        if self.check:
            return "Holds" if self.agrees else "Fails"
        if self.fitted:
            return "Fitted" if self.agrees else "Missed by the fit"
        if self.within_paper:
            return "Consistent" if self.agrees else "Contradicts"
        return "Agrees" if self.agrees else "Differs"


def scored(state: str, sentence: str, *, answers: bool = False) -> Finding:
    """Return the finding on a score in one of `SCORE_STATES`; only what is shown agrees."""
    return Finding(state == SHOWN, sentence, check=True, answers=answers, score=state)


@dataclass(frozen=True)
class Column:
    """One column of a table: what it holds, in which unit, shown with how many digits.

    Neighbouring columns of the same ``group`` stand under one heading. ``paper`` marks numbers that
    the paper printed, so that they are not taken for ours.
    """

    name: str
    unit: str = ""
    digits: int = 4
    group: str = ""
    paper: bool = False

    @property
    def heading(self) -> str:
        """Group, name and unit, as a CSV heading shows them."""
        words = f"{self.group} {self.name}".strip()
        return f"{words} [{self.unit}]" if self.unit else words

    def show(self, value: Cell) -> str:
        """Write ``value`` with the significant digits of this column; a dash for no value."""
        if value is None:
            return NO_VALUE
        if isinstance(value, str | int):
            return str(value)
        return significant(value, self.digits)


@dataclass(frozen=True)
class Table:
    """Rows of cells, the same number in each, under named columns.

    ``note`` says what a reader must know beside it; ``findings`` hold the sentences that compare it
    with the paper. ``folded`` tables open on request. ``wall_times`` marks a table that no two runs
    fill alike: it is stored apart from what must come out the same.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    findings: tuple[Finding, ...] = ()
    folded: bool = False
    wall_times: bool = False

    def __post_init__(self) -> None:
        rows = tuple(tuple(_plain(cell) for cell in row) for row in self.rows)
        for row in rows:
            if len(row) != len(self.columns):
                raise ValueError(f"{self.name}: {len(row)} cells for {len(self.columns)} columns")
        object.__setattr__(self, "rows", rows)

    @property
    def groups(self) -> list[tuple[str, int]]:
        """Headings over neighbouring columns, each with the number of columns below it."""
        runs = groupby(self.columns, key=lambda column: column.group)
        return [(group, len(list(columns))) for group, columns in runs]

    def holds_text(self, index: int) -> bool:
        """Whether the column at ``index`` holds words, which read better aligned to the left."""
        return any(isinstance(row[index], str) for row in self.rows)

    def holds_prose(self, index: int) -> bool:
        """Whether the words of the column at ``index`` need room."""
        return any(len(str(row[index])) > LONG for row in self.rows)


@dataclass(frozen=True)
class Picture:
    """A figure with the caption that says what to see on it; a leading one precedes the tables."""

    name: str
    caption: str
    figure: Figure
    leading: bool = False


WITHIN_PAPER = "The paper against itself"
AT_EVERY_BUDGET = "Table 7 at every budget"
OF_MODELS = "What models of the drive say"
NEW = "What is new"
FIRST_PAGE = (WITHIN_PAPER, AT_EVERY_BUDGET, OF_MODELS, NEW)
"""Sections of the report's first page, in its order: what needs no model of ours comes first."""


@dataclass(frozen=True)
class Result:
    """Everything that one experiment found, ready for the report.

    Attributes
    ----------
    title
        Heading of its page.
    command
        What makes it anew.
    answer
        What came out, with which its page begins; the first sentence stands on its card. Without
        one, the findings that answer are joined.
    paragraphs
        What was done.
    models
        What is said of the drive models behind the numbers, by their names; once for all pages.
    tables, pictures, notes
        What was found.
    first_page
        Parts of the sections of `FIRST_PAGE`, each beginning in lower case.
    shown_first
        Name of the picture that the first page shows, if any.
    question
        What it answers, where that is not the question of the experiment.
    """

    title: str
    command: str
    answer: str = ""
    paragraphs: tuple[str, ...] = ()
    models: Mapping[str, str] = field(default_factory=dict)
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()
    first_page: Mapping[str, str] = field(default_factory=dict)
    shown_first: str = ""
    question: str = ""

    def __post_init__(self) -> None:
        unknown = set(self.first_page) - set(FIRST_PAGE)
        if unknown:
            raise ValueError(f"no section of the first page: {', '.join(sorted(unknown))}")
        if not self.answer:
            answering = (
                finding for table in self.tables for finding in table.findings if finding.answers
            )
            object.__setattr__(self, "answer", " ".join(finding.sentence for finding in answering))


def significant(value: float, digits: int) -> str:
    """Write ``value`` with that many significant digits, without exponent where it reads well."""
    if not math.isfinite(value):
        return NO_VALUE if math.isnan(value) else ("∞" if value > 0 else f"{MINUS}∞")
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if not -5 <= exponent <= 6:
        return f"{value:.{digits - 1}e}".replace("-", MINUS)
    return f"{value:.{max(0, digits - 1 - exponent)}f}".replace("-", MINUS)


def signed_percent(values: Iterable[float]) -> str:
    """List percentages with their signs."""
    shown = [f"{'+' if value > 0 else ''}{significant(float(value), 2)}" for value in values]
    return f"{', '.join(shown)} %"


def _plain(cell: Any) -> Cell:
    return cell.item() if isinstance(cell, np.generic) else cell
