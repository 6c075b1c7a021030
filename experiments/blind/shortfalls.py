"""Effects, and pairs of them, that fall short of what must be reached, by how much, and why."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.blind.data import Outcome
from experiments.blind.tables import JUDGED_COLUMNS, KINDS, judged_row
from experiments.blind.targets import demands, median, select
from experiments.runner.result import Cell, Column, Table, significant
from pymoo_hdte.virtual.hidden_forms import LISTED_FORMS

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
    "torque ripple": "in the median of the cases that count it moves the base by {errors} standard "
    "errors, so that a tenth of that is less than the records can tell",
    "mesh stiffness variation": "where the hidden cosine is clipped it has harmonics beyond the "
    "law's",
}
"""What is known of the cause, for effects that fall short anywhere; ``errors`` is measured."""
PAIRS = "two effects"
REASON_OF_PAIRS = (
    "beside a second effect one of near forms (stiffening with a corner and soft wind-up, backlash "
    "and clearance, an error of the drive and of the encoder) fits well enough to be taken for the "
    "other, and only the first name of a pair is tried against its rivals; a small friction or "
    "drift beside a large effect is adequate, and not missed by name"
)


def shortfalls_table(outcomes: Sequence[Outcome]) -> Table:
    """Return every demand that the cases of one effect alone do not meet."""
    rows: list[tuple[Cell, ...]] = []
    for name in LISTED_FORMS:
        judged = demands(select(outcomes, "single", name))
        short = [one for one in judged if one.verdict not in ("met", "not run")]
        rows += [(name.replace("_", " "), *judged_row(one)) for one in short]
    of_pairs = [one for one in demands(outcomes) if one.cases == KINDS["pair"]]
    short = [one for one in of_pairs if one.verdict not in ("met", "not run")]
    rows += [(PAIRS, *judged_row(one)) for one in short]
    columns = (Column("hidden"), *JUDGED_COLUMNS)
    names = dict.fromkeys(str(row[0]) for row in rows)
    reasons = REASONS | {PAIRS: REASON_OF_PAIRS}
    causes = [
        f"{name}: {reasons.get(name, 'not known').format(errors=_errors(outcomes, name))}"
        for name in names
    ]
    note = (
        "What must be reached over all effects together, held against each alone, whether or not "
        f"its twenty cases could tell. Why, as far as it is known. {'; '.join(causes)}."
    )
    return Table("shortfalls", "Where a single effect falls short", columns, tuple(rows), note=note)


def _errors(outcomes: Sequence[Outcome], name: str) -> str:
    """Return the median bias that an effect gives the base, in standard errors of the base."""
    biases = [
        one.numbers["bias_before"] / one.numbers["bias_error"]
        for one in select(outcomes, "single", name.replace(" ", "_"))
        if "bias_error" in one.numbers and one.bias_ratio is not None
    ]
    return significant(median(biases).value, 2)
