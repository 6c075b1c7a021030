"""Table 9, and how far the measured prototypes are from the optimum (D_i of Section 5.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.choices import BAND, MODEL, TRUE_FRONT, Choice
from experiments.published_values import TABLE_6, TABLE_9
from experiments.result import Cell, Column, Finding, Table, signed_percent, significant
from experiments.runs import robust_problem
from pymoo_hdte.decision import deviation_degree, tolerance_band

VARIABLES = (
    ("K", "1e4 N.m/rad", 1e4),
    ("J_in", "1e-4 kg.m2", 1e-4),
    ("B_in", "1e-4 N.m.s/rad", 1e-4),
    ("B_fc", "1e-4 N.m.s/rad", 1e-4),
)
"""Name, unit of the tables, and that unit in SI."""

ALIKE_PERCENT = 10.0
PRINTED_DIGIT = 0.0005
"""Half of the last digit with which the paper prints D_i."""


def optima_table(preferred: Sequence[Choice]) -> Table:
    """Table 9: optimal designs with their bands, ours and the paper's."""
    rows = [(choice.name, choice.source, *_with_bands(choice.design)) for choice in preferred]
    rows += [
        (name.replace("_", " "), "paper", *_with_bands(design)) for name, design in TABLE_9.items()
    ]
    columns = [Column("design"), Column("chosen from")]
    for name, unit, _ in VARIABLES:
        group = f"{name} [{unit}]"
        columns += [Column(part, "", 4, group) for part in ("optimum", "lower", "upper")]
    title = f"Table 9: optimal designs with their ±{100 * BAND:g} % bands"
    finding = _optima_finding([c for c in preferred if c.source != TRUE_FRONT])
    return Table("optima", title, tuple(columns), tuple(rows), findings=(finding,))


def deviation_table(optimum: Choice) -> Table:
    """D_i of the five prototypes against the paper's accuracy-first optimum and against ours."""
    measured = np.array([prototype.design for prototype in TABLE_6.values()])
    published = np.array([prototype.deviation_degree for prototype in TABLE_6.values()])
    to_paper = deviation_degree(measured, TABLE_9["accuracy_first"])
    to_ours = deviation_degree(measured, optimum.design)
    rows = tuple(zip(TABLE_6, to_paper, published, to_ours, strict=True))
    columns = (
        Column("prototype"),
        Column("to the paper's optimum", digits=3),
        Column("as printed", digits=3, paper=True),
        Column("to our optimum", digits=3),
    )
    numbers = list(TABLE_6)
    ours, theirs = ((numbers[d.argmin()], numbers[d.argmax()]) for d in (to_ours, published))
    printed = np.abs(to_paper - published) <= PRINTED_DIGIT
    findings = (
        Finding(
            bool(printed.all()),
            f"Against the paper's optimum, D_i comes out to the printed digit for {printed.sum()} "
            f"of {len(printed)} prototypes.",
        ),
        Finding(
            ours == theirs,
            f"Against our accuracy-first optimum the nearest prototype is No. {ours[0]} and the "
            f"farthest No. {ours[1]}; the paper has No. {theirs[0]}, which it measures with the "
            f"lowest DTE, and No. {theirs[1]}, with the highest.",
        ),
    )
    title = "Deviation degree D_i of the prototypes"
    return Table("deviation", title, columns, rows, findings=findings)


def influence_note(centre: Choice) -> str:
    """Say how much each variable alone moves the mean over its box, from the design ``centre``."""
    problem = robust_problem(MODEL)
    parts = []
    for axis, (name, _, _) in enumerate(VARIABLES):
        swept = np.tile(centre.design, (101, 1))
        swept[:, axis] = np.linspace(problem.xl[axis], problem.xu[axis], 101)
        mean, std = np.ptp(problem.evaluate(swept), axis=0)
        parts.append(f"{name} {significant(mean, 2)} and {significant(std, 2)}")
    return (
        f"Range of mean and standard deviation in arcsec when one variable of the design '"
        f"{centre.label}' runs over its whole box: {', '.join(parts)}. The optimal value of a "
        "variable that moves next to nothing carries no information."
    )


def _with_bands(design: Sequence[float]) -> Iterator[Cell]:
    lower, upper = tolerance_band(np.array(design), BAND)
    for (_, _, unit), value, low, high in zip(VARIABLES, design, lower, upper, strict=True):
        yield from (value / unit, low / unit, high / unit)


def _optima_finding(choices: Sequence[Choice]) -> Finding:
    """Whether the optimal designs are those of the paper."""
    ours = np.array([choice.design for choice in choices])
    paper = np.array([TABLE_9[choice.preference] for choice in choices])
    percent = 100.0 * (ours - paper) / paper
    shifts = [
        f"{name} by {signed_percent(column)}"
        for (name, _, _), column in zip(VARIABLES, percent.T, strict=True)
    ]
    names = ", ".join(choice.name for choice in choices)
    return Finding(
        bool(np.abs(percent).max() <= ALIKE_PERCENT),
        f"The optima differ from the paper's in {', '.join(shifts)} ({names}).",
    )
