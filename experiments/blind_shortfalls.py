"""Effects that fall short of what must be reached, by how much, and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from experiments import blind_cases as required
from experiments.blind_data import Outcome
from experiments.blind_targets import Estimate, median, rate, select
from experiments.result import Cell, Column, Table, significant
from pymoo_hdte.discrepancy.hidden_forms import LISTED_FORMS

REASONS = {
    "soft windup": "three straight pieces are hidden, the law is one curve, and K takes the rest",
    "hysteresis": "the hidden elements yield each at its torsion, the law's at a smooth spread of "
    "torsions",
    "backlash": "under load it is a constant of the transmission error, so that no running record "
    "shows a gap that could shrink; the sweep shows it",
    "clearance variation": "no load turns its sign, so that what varies is a line of the static "
    "error as well: within that line's tolerance the base takes it, and no record can tell",
    "coulomb friction": "the least drawn at the input, below 10 mN.m, are within three times what "
    "the zero of the torque sensor is known to",
    "stribeck friction": "the hidden friction falls exponentially, the law's as a Gaussian, and "
    "the input damping takes up the rest",
    "nonlinear drag": "the hidden powers of the speed are 1.7 and 3, the law's is 2, and the input "
    "damping takes up the rest",
    "mesh stiffness variation": "where the hidden cosine is clipped it has harmonics beyond the "
    "law's",
}
"""What is known of the cause, for effects that fall short anywhere."""


def shortfalls_table(outcomes: Sequence[Outcome]) -> Table:
    """Return every demand that the cases of one effect alone do not meet."""
    rows: list[tuple[Cell, ...]] = []
    for name in LISTED_FORMS:
        chosen = select(outcomes, "single", name)
        for what, found, limit, at_least in _figures(chosen):
            if found.n and found.value != limit and (found.value < limit) == at_least:
                asked = ("at least " if at_least else "at most ") + significant(limit, 3)
                rows.append((name.replace("_", " "), what, asked, found.n, found.value, found.low,
                             found.high))  # fmt: skip
    columns = (
        Column("hidden"),
        Column("demand"),
        Column("required"),
        Column("n"),
        Column("value", "", 3, "measured"),
        Column("low", "", 3, "measured"),
        Column("high", "", 3, "measured"),
    )
    short = dict.fromkeys(str(row[0]) for row in rows)
    causes = [f"{name}: {REASONS.get(name, 'not known')}" for name in short]
    note = (
        "What must be reached over all effects together, held against each alone, whether or not "
        f"its twenty cases could tell. Why, as far as it is known. {'; '.join(causes)}."
    )
    return Table("shortfalls", "Where a single effect falls short", columns, tuple(rows), note=note)


def _figures(chosen: Sequence[Outcome]) -> Iterator[tuple[str, Estimate, float, bool]]:
    """Yield what is demanded, what was measured, the limit, and whether more is better."""
    multiple = required.FLOOR_MULTIPLE
    yield "right", rate([one.right for one in chosen]), required.LEAST_RIGHT, True
    wrong = rate([one.wrong_confident for one in chosen])
    yield "wrong with confidence", wrong, required.MOST_WRONG_CONFIDENT, False
    yield "F1 of the cells", median([one.f1 for one in chosen]), required.LEAST_F1, True
    yield "bias left", median([one.bias_ratio for one in chosen]), required.MOST_BIAS_LEFT, False
    for gap, words in (
        ("transmission_error", "transmission error"),
        ("leading", "leading channel"),
    ):
        shrunk = median([one.shrinkage(gap) for one in chosen])
        yield f"gap shrunk, {words}", shrunk, required.LEAST_SHRINKAGE, True
        open_gaps = [one for one in chosen if one.open_before(gap, multiple)]
        closed = rate([one.closed(gap, multiple) for one in open_gaps])
        yield f"gap closed, {words}", closed, required.LEAST_CLOSED, True
