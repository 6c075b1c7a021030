"""Rows of stored tables as texts, and as what a page shows."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.runner.committed import committed_file, read_rows
from pymoo_hdte._runner.result import Cell, Column

Rows = list[list[str]]


def headings(columns: Sequence[Column]) -> list[str]:
    """Return the headings of a CSV."""
    return [column.heading for column in columns]


def stored(name: str, experiment: str) -> Rows:
    """Return the rows of a committed table; errors as `committed_file`."""
    return [list(row.values()) for row in read_rows(committed_file(name, experiment))]


def cells(rows: Sequence[Sequence[str]]) -> tuple[tuple[Cell, ...], ...]:
    """Return texts as numbers where they are some, and as None where they are empty."""
    return tuple(tuple(_cell(text) for text in row) for row in rows)


def _cell(text: str) -> Cell:
    try:
        return float(text) if text else None
    except ValueError:
        return text
