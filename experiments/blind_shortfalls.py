"""Effects that fall short of what must be reached, by how much, and why."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.blind_data import Outcome
from experiments.blind_tables import JUDGED_COLUMNS, judged_row
from experiments.blind_targets import demands, select
from experiments.result import Cell, Column, Table
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
        judged = demands(select(outcomes, "single", name))
        short = [one for one in judged if one.verdict not in ("met", "not run")]
        rows += [(name.replace("_", " "), *judged_row(one)) for one in short]
    columns = (Column("hidden"), *JUDGED_COLUMNS)
    names = dict.fromkeys(str(row[0]) for row in rows)
    causes = [f"{name}: {REASONS.get(name, 'not known')}" for name in names]
    note = (
        "What must be reached over all effects together, held against each alone, whether or not "
        f"its twenty cases could tell. Why, as far as it is known. {'; '.join(causes)}."
    )
    return Table("shortfalls", "Where a single effect falls short", columns, tuple(rows), note=note)
