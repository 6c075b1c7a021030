"""Tables of the runs needed, and of where ours stops and what its band covers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from experiments.robust.data import FURTHER, SEEDS, Outcome, ahead
from experiments.robust.functions import BY_NAME, FUNCTIONS
from experiments.robust.job import BUDGET, METHODS, OURS
from experiments.runner.result import Cell, Column, Finding, Table

WANTED_AHEAD = 8
WANTED_COVERED = 0.95


def needed_table(outcome: Outcome) -> Table:
    """Say how many runs every method needs on every function."""
    columns = [Column("function"), Column("inputs"), Column("chosen on")]
    columns += [Column(name, group="error at designs") for name in METHODS]
    columns += [Column(name, group="error overall") for name in METHODS]
    rows: list[tuple[Cell, ...]] = []
    for name in outcome.functions():
        function = BY_NAME[name]
        counts = [_count(outcome, name, method, column) for column in (1, 2) for method in METHODS]
        rows.append((name, len(function.laws), "yes" if function.tuned else "no", *counts))
    return Table(
        "needed",
        "Least model runs for a deviation within 1 %",
        tuple(columns),
        tuple(rows),
        note=f"Others are tried up to {FURTHER} times the runs that ours needs, at most {BUDGET}, "
        "or as far as stands behind 'above'; "
        "of their ways, the best counts. Curves end where the error at designs stays, also those "
        "for the error overall. One seed of every method. A dash: not run.",
        findings=tuple(_needed_findings(outcome)),
    )


def _count(outcome: Outcome, function: str, method: str, column: int) -> Cell:
    tried = outcome.tried(function, method)
    return outcome.needed(function, method, column) or (f"above {tried}" if tried else None)


def of_the_first_page(outcome: Outcome) -> str:
    """Say what a robust problem is and how few runs it takes, as part of a longer sentence."""
    names, won = _tried_and_won(outcome)
    return (
        "a robust problem made of a deterministic simulator in a dozen lines, with exact moments "
        "of a surrogate that takes fewer runs than chaospy and OpenTURNS on "
        f"{len(won)} of {len(names)} functions"
    )


def _tried_and_won(outcome: Outcome) -> tuple[list[str], list[str]]:
    """Return the functions on which all methods were run, and those on which ours needs least."""
    names = [
        name
        for name in outcome.functions()
        if all(outcome.tried(name, method) for method in METHODS)
    ]
    return names, [name for name in names if ahead(outcome, name)]


def _needed_findings(outcome: Outcome) -> Iterator[Finding]:
    names, won = _tried_and_won(outcome)
    kept_out = [name for name in names if not BY_NAME[name].tuned]
    lost = ", ".join(name for name in names if name not in won)
    others = ", ".join(name for name in outcome.functions() if name not in names)
    yield Finding(
        len(won) >= WANTED_AHEAD,
        f"Our surrogate takes fewer runs than chaospy's and OpenTURNS's on {len(won)} of "
        f"{len(names)} functions ({WANTED_AHEAD} wanted), {len(set(won) & set(kept_out))} of the "
        f"{len(kept_out)} kept out of the choice of constants among them."
        + (f" It does not on {lost}." if lost else "")
        + (f" Not run with all three: {others}." if others else ""),
        check=True,
        answers=True,
    )


def stops_table(outcome: Outcome) -> Table:
    """Say where ours stops by itself, with the worst of the seeds."""
    rows: list[tuple[Cell, ...]] = []
    for name in outcome.functions():
        found = [outcome.stops[name, seed] for seed in SEEDS if (name, seed) in outcome.stops]
        if not found:
            continue
        stopped = [one["runs"] for one in found if np.isfinite(one["runs"])]
        rows.append(
            (
                name,
                len(found),
                int(np.median(stopped)) if stopped else None,
                len(found) - len(stopped),
                *(100.0 * max(one[key] for one in found) for key in _ERRORS),
                *(100.0 * min(one[key] for one in found) for key in _COVERED),
            )
        )
    columns = (
        Column("function"),
        Column("seeds"),
        Column("runs where it stops, median"),
        Column("refused"),
        *(Column(one, "%", 2, group) for group in ("true error", "stated") for one in _MOMENTS),
        *(Column(one, "%", 3, "designs that the band covers") for one in _MOMENTS),
    )
    return Table(
        "stops",
        "Where ours stops when asked for 1 %, and its band at 200 designs",
        columns,
        tuple(rows),
        note="Errors as shares of the scatter: true ones of 95 % of the designs, stated ones the "
        "median band; the worst seed. Refused: not within 1000 runs.",
        findings=tuple(_cover_findings(outcome)),
    )


_MOMENTS = ("mean", "deviation")
_COVERED = ("covered_mean", "covered_std")
_ERRORS = ("true_mean_error", "true_std_error", "stated_mean_error", "stated_std_error")


def _cover_findings(outcome: Outcome) -> Iterator[Finding]:
    worst = {key: min(numbers[one] for one in _COVERED) for key, numbers in outcome.stops.items()}
    if not worst:
        return
    (name, seed), least = min(worst.items(), key=lambda item: item[1])
    met = {function for function, _ in worst}
    others = ", ".join(one.name for one in FUNCTIONS if one.name not in met)
    refused = sorted({key[0] for key, one in outcome.stops.items() if not np.isfinite(one["runs"])})
    yield Finding(
        least >= WANTED_COVERED and not others,
        f"The stated band of {OURS} covers mean and deviation at {100.0 * least:.3g} % of 200 "
        f"designs or more (least: {name}, seed {seed}; {100.0 * WANTED_COVERED:g} % wanted), in "
        f"{len(worst)} of the {len(FUNCTIONS) * len(SEEDS)} growths planned, on {len(met)} of "
        f"{len(FUNCTIONS)} functions; not run: {others or 'none'}; refused, so that the band is "
        f"of no use: {', '.join(refused) or 'none'}.",
        check=True,
    )


def curves_table(outcome: Outcome) -> Table:
    """Give the points of all curves."""
    rows = tuple((*key, *step) for key, steps in outcome.curves.items() for step in steps)
    columns = (
        Column("function"),
        Column("method"),
        Column("way"),
        Column("runs"),
        Column("at designs", "", 3, "error of the deviation"),
        Column("overall", "", 3, "error of the deviation"),
    )
    return Table("curves", "Errors over runs", columns, rows, folded=True)
