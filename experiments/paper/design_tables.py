"""Table 9, and how far the measured prototypes are from the optimum (D_i of Section 5.3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.runs import robust_problem
from experiments.paper.choices import BAND, MODEL, TRUE_FRONT, Choice, dominating_shares
from experiments.paper.models import FITTED
from experiments.paper.shares import design_indices
from experiments.published_values import DESIGN_BOX, TABLE_6, TABLE_9
from experiments.runner.result import Cell, Column, Finding, Table, signed_percent, significant
from pymoo_hdte.decision import deviation_degree, tolerance_band
from pymoo_hdte.drive import hs_20_100

VARIABLES = (
    ("K", "1e4 N.m/rad", 1e4),
    ("J_in", "1e-4 kg.m2", 1e-4),
    ("B_in", "1e-4 N.m.s/rad", 1e-4),
    ("B_fc", "1e-4 N.m.s/rad", 1e-4),
)
"""Name, unit of the tables, and that unit in SI."""

ALIKE_PERCENT = 10.0
HARDLY_ANY = 1e-4
"""A share of designs of which a random search with the paper's 10,000 evaluations finds one."""
PRINTED_DIGIT = 0.0005
"""Half of the last digit with which the paper prints D_i."""
SWEEP = 6
"""Values of the variable of least influence, ends of its box included."""


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
    findings = (finding, box_finding(), *(_dominance_finding(model) for model in FITTED))
    return Table("optima", title, tuple(columns), tuple(rows), findings=findings)


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
    printed = np.abs(to_paper - published) <= PRINTED_DIGIT
    finding = Finding(
        bool(printed.all()),
        f"Against the paper's optimum, D_i comes out to the printed digit for {printed.sum()} "
        f"of {len(printed)} prototypes.",
        within_paper=True,
    )
    title = "Deviation degree D_i of the prototypes"
    note = _order_note(to_ours, published, optimum)
    return Table("deviation", title, columns, rows, note, (finding,))


def _order_note(
    to_ours: NDArray[np.float64], published: NDArray[np.float64], optimum: Choice
) -> str:
    """Say which prototypes are nearest and farthest, and how little that depends on the model."""
    numbers = list(TABLE_6)
    ours, theirs = ((numbers[d.argmin()], numbers[d.argmax()]) for d in (to_ours, published))
    name, share, swept = _idle_sweep(optimum)
    measured = np.array([prototype.design for prototype in TABLE_6.values()])
    degrees = np.array([deviation_degree(measured, design) for design in swept])
    nearest, farthest = (
        ", ".join(str(numbers[place]) for place in places)
        for places in (degrees.argmin(axis=1), degrees.argmax(axis=1))
    )
    return (
        f"Against our accuracy-first optimum the nearest prototype is No. {ours[0]} and the "
        f"farthest No. {ours[1]}; the paper has No. {theirs[0]}, which it measures with the lowest "
        f"DTE, and No. {theirs[1]}, with the highest. This counts for no agreement: D_i weighs "
        f"{name}, whose total share in mean and variance of the DTE is "
        f"{significant(100.0 * share, 1)} % at most, like the others. With {name} of the optimum "
        f"at {len(swept)} even steps over its box, the nearest is No. {nearest} and the farthest "
        f"No. {farthest}."
    )


def _idle_sweep(optimum: Choice) -> tuple[str, float, NDArray[np.float64]]:
    """Return the variable of least influence, its total share, and the optimum with it swept."""
    problem = robust_problem(MODEL)
    shares = np.max([indices.total for indices in design_indices(problem).values()], axis=0)
    axis = int(np.argmin(shares))
    swept = np.tile(optimum.design, (SWEEP, 1))
    swept[:, axis] = np.linspace(problem.xl[axis], problem.xu[axis], SWEEP)
    return VARIABLES[axis][0], float(shares[axis]), swept


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


def box_finding() -> Finding:
    """Whether the paper's optima lie in its own box, to the digits that it prints."""
    nominal = np.array(_nominal_design())
    printed = np.array(list(TABLE_9.values()))
    beyond = np.abs(printed / nominal - 1.0) - DESIGN_BOX
    half_digit = np.array([0.5e-3 * unit for _, _, unit in VARIABLES]) / nominal
    at_bound = [
        f"{variable} of {name.replace('_', ' ')}"
        for name, row in zip(TABLE_9, np.abs(beyond) <= half_digit, strict=True)
        for (variable, _, _), is_at in zip(VARIABLES, row, strict=True)
        if is_at
    ]
    inside = beyond <= half_digit
    return Finding(
        bool(inside.all()),
        f"{inside.sum()} of {inside.size} values of the paper's optima lie in its box of "
        f"±{100 * DESIGN_BOX:g} % to the printed digit; at a bound: "
        f"{', '.join(at_bound) or 'none'}.",
        within_paper=True,
    )


def _nominal_design() -> tuple[float, float, float, float]:
    nominal = hs_20_100().nominal
    return nominal.stiffness, nominal.input_inertia, nominal.input_damping, nominal.mesh_damping


def dominated(model: str) -> str:
    """Say which share of random designs dominates the paper's optima, for the first page."""
    shares = [significant(100.0 * share, 2) for share in sorted(dominating_shares(model).values())]
    return (
        f"{shares[0]} to {shares[-1]} % of random designs are better than each of the paper's "
        f"optima in mean and deviation at once on the model {model}: the paper optimised another "
        "model, or a surrogate of runs with errors"
    )


def _dominance_finding(model: str) -> Finding:
    """Whether the paper's optima are optimal on a model, as they are on the paper's own."""
    shares = dominating_shares(model)
    listed = ", ".join(f"{significant(100.0 * s, 2)} % ({name})" for name, s in shares.items())
    return Finding(
        max(shares.values()) <= HARDLY_ANY,
        f"On {model}, the share of random designs in the box that have both a smaller mean and a "
        f"smaller standard deviation than the paper's optimum is {listed}. The larger the share, "
        "the less can the paper's optimiser have worked on this model: a better design found here "
        "is then evidence against the model as well.",
    )
