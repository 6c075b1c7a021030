"""The files of a robust study: its page, its document, the front and all runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte.cli.command import heading
from pymoo_hdte.problems import SimulatorProblem
from pymoo_hdte.problems._simulator import plots

FRONT_FILE, RUNS_FILE = "front.csv", "runs.csv"
FOLDER = ReportFolder("robust.json", (FRONT_FILE, RUNS_FILE))


def write_robust_report(
    title: str, problem: SimulatorProblem, result: Any, noted: Sequence[str], out: Path
) -> dict[str, Any]:
    """Write the report of a study and return its document; errors as `ReportFolder.write`.

    Parameters
    ----------
    title : str
    problem : SimulatorProblem
    result : pymoo.core.result.Result
        Of the search; without a design that meets all constraints, the nearest one is shown.
    noted : sequence of str
        Warnings of the surrogate's building.
    out : Path
    """
    feasible = result.X is not None
    designs = np.atleast_2d(result.X if feasible else _least_violating(result))
    F, band = problem.evaluate(designs, return_values_of=["F", "F_band"])
    place = plots.middle(F)
    chosen = designs[place]
    page = plots.page(problem, result if feasible else None, chosen, title)
    document = heading("robust", _sentences(problem, designs, feasible, chosen), noted) | {
        "title": title,
        "n_runs": problem.n_runs,
        "failed_runs": len(problem.failed),
        "trusted": problem.trusted,
        "response_errors": problem.response_errors,
        "feasible": feasible,
        "front": len(designs) if feasible else 0,
        "design": dict(zip(problem.var_names, chosen.tolist(), strict=True)),
        "objectives": [
            {"name": name, "value": value, "error": half if np.isfinite(half) else None}
            for name, value, half in zip(
                problem.obj_names, F[place].tolist(), band[place].tolist(), strict=True
            )
        ],
        "constraints": [
            {"name": name, "value": value, side: bound}
            for name, value, side, bound in plots.limits_at(problem, chosen)
        ],
    }
    texts = {FRONT_FILE: _front(problem, designs, F, band), RUNS_FILE: _runs(problem)}
    FOLDER.write(out, page, document, texts)
    return document


def _least_violating(result: Any) -> NDArray[np.float64]:
    violation = result.pop.get("CV").ravel()
    return np.asarray(result.pop.get("X")[np.argmin(violation)], dtype=float)


def _sentences(
    problem: SimulatorProblem,
    designs: NDArray[np.float64],
    feasible: bool,
    chosen: NDArray[np.float64],
) -> list[str]:
    values = ", ".join(
        f"{name} = {value:.4g}" for name, value in zip(problem.var_names, chosen, strict=True)
    )
    if not feasible:
        first = f"No design meets all constraints. The nearest one: {values}."
    elif problem.n_obj == 1:
        first = f"The best design: {values}."
    else:
        count = "1 design" if len(designs) == 1 else f"{len(designs)} designs"
        first = f"The front has {count}. The one nearest to the best of all objectives: {values}."
    worst = 100.0 * max(problem.response_errors.values())
    second = (
        f"{problem.n_runs} runs of the simulator; the estimated error of mean and standard"
        f" deviation is at most {worst:.2g} % of the scatter."
    )
    return [first, second]


def _front(
    problem: SimulatorProblem,
    designs: NDArray[np.float64],
    F: NDArray[np.float64],
    band: NDArray[np.float64],
) -> str:
    columns = [*problem.var_names, *problem.obj_names, *(f"{n}_error" for n in problem.obj_names)]
    table = np.column_stack([designs, F, band])
    order = np.argsort(F[:, 0], kind="stable")
    return csv_text(columns, table[order].tolist())


def _runs(problem: SimulatorProblem) -> str:
    runs = problem.runs
    assert runs is not None  # None only of a loaded problem.
    table = np.column_stack([runs.X, runs.Y])
    return csv_text([*problem.input_names, *problem.responses], table.tolist())
