"""Outcomes of the long campaigns: CSV files in ``experiments/data``, how they are written and read.

A first comment line holds, as JSON, the date and the versions that made the table.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from experiments.runner.registry import Context
from pymoo_hdte._io.csv_table import csv_text, read_text_table
from pymoo_hdte._runner.provenance import environment, source_fingerprint

DATA = Path(__file__).parents[1] / "data"
_ORIGIN = "# {"


def committed_file(name: str, experiment: str) -> Path:
    """Return the path of a committed table.

    Raises
    ------
    FileNotFoundError
        If ``experiment`` has not left it there yet.
    """
    path = DATA / name
    if not path.is_file():
        raise FileNotFoundError(f"no {name} yet: run python -m experiments {experiment} --full")
    return path


def table_with_origin(columns: Sequence[str], rows: Iterable[Iterable[Any]], **further: Any) -> str:
    """Return the text of a table that says when and by what it was made, and ``further`` facts."""
    made = {"date": datetime.date.today().isoformat(), "source": source_fingerprint()}
    origin = {**further, **made, **environment()}
    return f"# {json.dumps(origin)}\n" + csv_text(columns, rows)


def rounded(value: float, digits: int) -> float:
    """Return the number that a CSV keeps, so that both ways to a report give the same."""
    return float(f"{value:.{digits}g}")


def read_origin(path: Path) -> dict[str, Any]:
    """Return what the first line of a table with an origin says.

    Raises
    ------
    OSError
        If there is no such line.
    """
    with path.open(encoding="utf-8") as file:
        line = file.readline()
    if not line.startswith(_ORIGIN):
        raise OSError(f"{path} does not say in its first line when and by what it was made")
    return dict(json.loads(line.removeprefix("#")))


def stored_outcome(context: Context, experiment: str) -> tuple[str, ...]:
    """Return a paragraph that says so if the report is made from the experiment's own table."""
    if context.full or context.quick:
        return ()
    made = read_origin(committed_file(f"{experiment}.csv", experiment))["date"]
    return (
        f"Not computed in this run: made from the stored outcome of {made}, which "
        f"python -m experiments {experiment} --full computes anew.",
    )


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table, with an origin or without, by column."""
    return read_text_table(path, origin=_ORIGIN).texts()
