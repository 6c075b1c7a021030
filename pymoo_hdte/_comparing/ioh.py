"""Runs as files of IOHprofiler, which its analysers read: every improvement of every run.

The form is that of IOHexperimenter 0.3 as IOHinspector takes it for several objectives: a folder an
algorithm, in it a JSON file a problem and a table of ``evaluations raw_y F2 ...``, in which
``raw_y`` is the first objective and every run begins with evaluation 1. See
https://iohprofiler.github.io/IOHanalyzer/data.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte import __version__
from pymoo_hdte._comparing.named import problem_named
from pymoo_hdte._comparing.paired import Comparison
from pymoo_hdte._comparing.pictures import file_name
from pymoo_hdte._comparing.setting import Setting, in_words

FORM = "0.3.17"
"""Version of IOHexperimenter whose form this is."""
NEVER_FEASIBLE = 1e300
"""Objectives of a first evaluation that gave nothing feasible: worse than any, and a number."""


def ioh_files(comparisons: Sequence[Comparison], setting: Setting) -> Iterator[tuple[str, str]]:
    """Yield paths and texts of the files of all runs.

    The trace of a run holds each feasible point that no earlier one of it weakly dominates, so that
    every indicator of what was found so far follows from it at every evaluation.
    """
    for number, comparison in enumerate(comparisons, start=1):
        function = f"f{number}_{file_name(comparison.model)}"
        n_var = problem_named(comparison.model).n_var
        for algorithm in comparison.algorithms:
            folder = file_name(algorithm)
            data = f"data_{function}/IOHprofiler_f{number}_DIM{n_var}.dat"
            n_obj = len(comparison.objectives)
            runs = [_from_the_first(trace, n_obj) for trace in comparison.traces(algorithm)]
            yield f"{folder}/{data}", "".join(map(_table, runs))
            described = {
                "version": FORM,
                "suite": "pymoo_hdte",
                "function_id": number,
                "function_name": comparison.model,
                "maximization": False,
                "algorithm": {"name": algorithm, "info": f"pymoo_hdte {__version__}"},
                "experiment_attributes": _attributes(comparison, setting),
                "attributes": _columns(n_obj),
                "scenarios": [
                    {
                        "dimension": n_var,
                        "path": data,
                        "runs": [
                            {"instance": 1, "evals": spent, "best": _best(rows)}
                            for rows, spent in zip(runs, comparison.spent[algorithm], strict=True)
                        ],
                    }
                ],
            }
            text = json.dumps(described, indent=1, ensure_ascii=False, allow_nan=False)
            yield f"{folder}/IOHprofiler_{function}.json", f"{text}\n"


def _from_the_first(trace: NDArray[np.float64], n_obj: int) -> NDArray[np.float64]:
    """Return a trace that begins with evaluation 1, by which readers tell runs apart."""
    if len(trace) and trace[0, 0] == 1.0:
        return trace
    first = np.concatenate([[1.0], np.full(n_obj, NEVER_FEASIBLE)])
    return np.vstack([first, *trace])


def _columns(n_obj: int) -> list[str]:
    return ["evaluations", "raw_y", *(f"F{number}" for number in range(2, n_obj + 1))]


def _table(rows: NDArray[np.float64]) -> str:
    lines = [" ".join(_columns(rows.shape[1] - 1))]
    lines += [" ".join([str(int(row[0])), *map(repr, row[1:].tolist())]) for row in rows]
    return "\n".join(lines) + "\n"


def _best(rows: NDArray[np.float64]) -> dict[str, Any]:
    """Return the smallest first objective, which is all that this field has room for."""
    evaluations, value = rows[np.argmin(rows[:, 1]), :2].tolist()
    return {"evals": int(evaluations), "y": value, "x": []}


def _attributes(comparison: Comparison, setting: Setting) -> list[dict[str, str]]:
    """Return what else the runs have in common; objectives are normalised from ideal to nadir."""
    said: dict[str, object] = {
        "seeds": in_words(comparison.seeds),
        "population": setting.population,
        "reference": "true front" if comparison.is_true else "union of the final sets",
    }
    front = comparison.truth.F
    for name, values in (("ideal", front.min(axis=0)), ("nadir", front.max(axis=0))):
        said |= {f"{name}_{place}": repr(value) for place, value in enumerate(values.tolist(), 1)}
    return [{name: str(value)} for name, value in said.items()]
