"""The cards as pages in Markdown, from the code of the problems and the stored numbers."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from experiments.runner.texts import filled
from experiments.studies.cards.data import Numbers, committed_numbers
from experiments.studies.cards.experiment import LEFT_OUT, SETTING
from experiments.studies.cards.tables import (
    HARDNESS_NOTE,
    SEPARATION_NOTE,
    Separation,
    hardness_table,
    medians_table,
    separation_table,
    separations,
)
from experiments.studies.contest.peers_data import MEASURES
from experiments.studies.contest.problems import CARDS, problem_of
from pymoo_hdte._comparing.figures import BLUE, GREY, grid
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.result import Table, significant
from pymoo_hdte.problems import RobustDTEGrades
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

_RANDOM_DESIGNS = 2000
_FEW_DESIGNS = 200


def write_pages(folder: Path) -> None:
    """Write an index and, for each problem, a page, a picture of its front and a table of runs."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = committed_numbers()
    for name in numbers.scores.problems:
        stem = stem_of(name)
        front_picture(problem_of(name)).savefig(
            folder / f"{stem}.png", dpi=110, metadata={"Software": None}
        )
        (folder / f"{stem}.csv").write_text(runs_text(numbers, name), encoding="utf-8")
        (folder / f"{stem}.md").write_text(page(numbers, name), encoding="utf-8")
    (folder / "index.md").write_text(index_page(numbers), encoding="utf-8")


def stem_of(name: str) -> str:
    """Return the name of a problem's files."""
    return name.removeprefix("RobustDTE-")


def index_page(numbers: Numbers) -> str:
    """Return the page that leads to all cards: which problem is hard why, and what it tells."""
    return filled(
        "cards.md",
        stems=[stem_of(name) for name in numbers.scores.problems],
        reproduced=lambda name: significant(first_run(numbers, name), 3),
        separating=separation_table(numbers),
        hardness=hardness_table(numbers),
        table_text=table_text,
        separation_note=SEPARATION_NOTE,
        hardness_note=HARDNESS_NOTE,
        setting=SETTING,
        left_out=LEFT_OUT,
    )


def first_run(numbers: Numbers, algorithm: str) -> float:
    """Return the IGD that the index shows how to reproduce: least budget and first seed."""
    scores = numbers.scores
    row = scores.problems.index("RobustDTE-resonant")
    return float(scores.of("igd", scores.budgets[0])[row, scores.algorithms.index(algorithm), 0])


def page(numbers: Numbers, name: str) -> str:
    """Return the card of one problem."""
    problem = problem_of(name)
    medians = medians_table(numbers.scores, name)
    return filled(
        "card.md",
        stem=stem_of(name),
        constructor=_constructor(name),
        problem=problem,
        kind=type(problem).__name__,
        **_limits(problem),
        description=_description(problem),
        scatter=_scatter(problem),
        variables=_variables(problem),
        hardness=table_text(_of(hardness_table(numbers), name)),
        verdicts=_verdicts(numbers, name),
        measures=medians.title.partition(": ")[2].capitalize(),
        medians=table_text(medians),
    )


def runs_text(numbers: Numbers, name: str) -> str:
    """Return the CSV of all runs on a problem."""
    scores = numbers.scores
    row = scores.problems.index(name)
    lines = []
    for place in np.ndindex(*scores.spent[row].shape):
        if scores.spent[(row, *place)]:
            algorithm, budget, seed = place
            key = scores.algorithms[algorithm], scores.budgets[budget], scores.seeds[seed]
            lines.append([*key, *scores.values[: len(_SHOWN), row, *place].tolist()])
    return csv_text(["algorithm", "evaluations", "seed", *_SHOWN], lines)


_SHOWN = MEASURES[:4]
"""IGD, IGD+, hypervolume, Spacing."""


def table_text(table: Table) -> str:
    """Return a table in Markdown, with as many digits as its columns show."""
    head = [column.heading for column in table.columns]
    shown = [
        [column.show(cell) for column, cell in zip(table.columns, row, strict=True)]
        for row in table.rows
    ]
    return _markdown(head, shown)


def _markdown(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(head)]
    lines += [["---"] * len(lines[0]), *map(list, rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _of(table: Table, name: str) -> Table:
    rows = [row for row in table.rows if row[0] == name]
    return Table(table.name, table.title, table.columns, tuple(rows))


def _verdicts(numbers: Numbers, name: str) -> str:
    separated = [
        separation
        for separation in separations(numbers.scores, numbers.hardness)
        if separation.problem == name
    ]
    return " ".join(map(_verdict, separated))


def _verdict(separation: Separation) -> str:
    at = f"At {separation.evaluations:,} evaluations"
    reach = f"{separation.reached} of {separation.algorithms} reach the front."
    if separation.separates is None:
        return f"{at} too few algorithms ran to say whether it separates them; {reach}"
    return (
        f"{at} it {'separates' if separation.separates else 'does not separate'} algorithms: "
        f"quartiles of their median IGD differ {significant(separation.spread, 2)} times, one "
        f"algorithm's seeds {significant(separation.scatter, 2)} times; {reach}"
    )


def _constructor(name: str) -> str:
    if name not in CARDS or not name.startswith("RobustDTE-"):
        return f"{name}()"
    return f"robust_dte_family()[{stem_of(name)!r}]()"


def _description(problem: Problem) -> str:
    """Return what the class and its module say about the problem, and about its drive model."""
    words = inspect.getdoc(type(problem)) or ""
    parts = [words.partition("\nParameters\n")[0].strip()]
    module = inspect.getmodule(type(problem))
    further = (module.__doc__ or "").partition("\n\n")[2] if module else ""
    parts.append(textwrap.dedent(further).strip())
    model = getattr(problem, "model", None)
    if model is not None:
        parts.append(f"The drive model is `{model.name}`: {model.description}")
    # Docstrings are reStructuredText, of which the footnotes stay behind.
    return re.sub(r" \[\d+\]_", "", "\n\n".join(part for part in parts if part))


def _limits(problem: Problem) -> dict[str, str]:
    if not isinstance(problem, RobustDTEGrades):
        return {}
    return {
        "speed": f"{problem.process_speed / REVOLUTION_PER_MINUTE:.0f}",
        "shares": ", ".join(f"{share:.3f}" for share in problem.cost_shares),
    }


def _scatter(problem: Problem) -> str:
    uncertainty = getattr(problem.moments, "uncertainty", None)
    inputs = getattr(problem, "inputs", getattr(uncertainty, "inputs", ()))
    if not inputs:
        return "As in `RobustDTE`, with the tolerance of the design in place of 5 %."
    names = _input_names(problem, len(inputs))
    rows = []
    for name, entry in zip(names, inputs, strict=True):
        if isinstance(entry, TruncatedNormal):
            law = f"normal, mean {entry.mean:.4g}, std {entry.std:.4g}, cut at {entry.cut:g} std"
        else:
            law = f"uniform within ±{100 * entry.tolerance:g} % of the design"
        rows.append([name, law])
    return _markdown(["input", "law (SI)"], rows)


def _input_names(problem: Problem, n: int) -> list[str]:
    surrogate = getattr(problem, "surrogate", None)
    if surrogate is not None:
        return list(surrogate.box.names)
    return ["theta_s", *problem.var_names][:n]


def _variables(problem: Problem) -> str:
    rows = [
        [name, f"{low:.4g}", f"{high:.4g}", problem.units[name]]
        for name, low, high in zip(problem.var_names, problem.xl, problem.xu, strict=True)
    ]
    return _markdown(["variable", "lower", "upper", "unit"], rows)


def front_picture(problem: Problem) -> Figure:
    """Draw the front over random designs; a third objective as colour."""
    figure, axes = grid(1, 1, width=6.0, height=3.8)
    axis = axes.flat[0]
    front = problem.pareto_front()
    n = _RANDOM_DESIGNS if hasattr(problem, "surrogate") else _FEW_DESIGNS
    designs = np.random.default_rng(1).uniform(problem.xl, problem.xu, (n, problem.n_var))
    F, G = problem.evaluate(designs, return_values_of=["F", "G"])
    F = F[np.all(G <= 0.0, axis=1)]
    axis.plot(*F[:, :2].T, ".", color=GREY, markersize=2, label="random designs")
    if problem.n_obj == 2:
        axis.plot(*front.T, ".", color=BLUE, markersize=3, label="true front")
    else:
        points = axis.scatter(*front[:, :2].T, c=front[:, 2], s=3, cmap="viridis")
        figure.colorbar(points, ax=axis, label=_label(problem, 2))
    _around(axis, front[:, :2])
    axis.set_xlabel(_label(problem, 0))
    axis.set_ylabel(_label(problem, 1))
    return figure


def _around(axis: Axes, front: NDArray[np.float64]) -> None:
    """Show the front with as much again on either side: the whole box would leave it a dot."""
    low, high = front.min(axis=0), front.max(axis=0)
    margin = 1.5 * (high - low)
    axis.set_xlim(low[0] - 0.2 * margin[0], high[0] + margin[0])
    axis.set_ylim(low[1] - 0.2 * margin[1], high[1] + margin[1])


def _label(problem: Problem, place: int) -> str:
    name = problem.obj_names[place]
    unit = problem.units[name]
    words = name.removesuffix(f"_{unit}").replace("_", " ").replace("dte", "DTE")
    return words if unit == "1" else f"{words} [{unit}]"
