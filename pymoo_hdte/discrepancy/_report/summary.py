"""The verdict in ten lines, as a terminal shows it: read from the document, nothing computed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import Any

import numpy as np

from pymoo_hdte._reports.html import digits, number
from pymoo_hdte.discrepancy._report.tables import EffectRow, effect_rows
from pymoo_hdte.discrepancy._report.words import bench_in_words, sure_in_words

MOST_LINES = 10


def summary(document: Mapping[str, Any], page: str) -> str:
    """Return at most ten lines on a verdict: what, how large, how sure, how well, what next.

    Parameters
    ----------
    document : mapping
        What ``verdict.json`` holds, of a drive, a mechanism or a machine of a user's kind.
    page : str
        Where the page of the report stands.
    """
    torsion = document.get("torsion", {})
    top = [f"Verdict: {document['status']}. {document['sentence']}"]
    if bench := bench_in_words(document.get("nuisances", ())):
        top.append(bench)
    bottom = [
        *_probability(document.get("probability")),
        *_prediction_errors(document["held_out"]),
        *_torsion_error(torsion.get("held_out", ())),
        f"Next: {document['next_experiment']['description']}",
        *([f"For the torsion: {test}"] if (test := torsion.get("next_experiment")) else []),
        f"Report: {page}",
    ]
    effects = [*document["effects"], *torsion.get("effects", ())]
    room = MOST_LINES - len(top) - len(bottom)
    lines = [*top, *_at_most(room, [*_sizes(effects), *_remarks(document, torsion)]), *bottom]
    return "\n".join(line.replace("\n", " ") for line in lines)


def _at_most(room: int, lines: list[str]) -> list[str]:
    if len(lines) <= room:
        return lines
    return [*lines[: room - 1], f"{len(lines) - room + 1} more such lines in the report."]


def _remarks(document: Mapping[str, Any], torsion: Mapping[str, Any]) -> Iterable[str]:
    """Return further sentences, the most important one before the others."""
    if relevance := document.get("relevance"):
        yield relevance["sentence"]
    yield document["location"]["sentence"]
    yield from (*document.get("limits", ()), *document.get("record_remarks", ()))
    yield from torsion.get("limits", ())


def _sizes(effects: list[dict[str, Any]]) -> Iterable[str]:
    """Return a line on each effect with its values, intervals and units."""
    shown = (row for row in effect_rows(effects) if row.is_headline)
    for effect, rows in groupby(shown, key=lambda row: row.effect):
        yield f"{effect or 'out of tolerance'}: {'; '.join(map(_size, rows))}"


def _size(row: EffectRow) -> str:
    places = digits(row.lower, row.upper)
    value, low, high = (number(size, places) for size in (row.value, row.lower, row.upper))
    bound = ", at a bound" if row.at_bound else ""
    return f"{row.parameter} {value} (95 %: {low} … {high}{bound}) {_shown(row.unit)}".rstrip()


def _probability(probability: float | None) -> Iterable[str]:
    if probability is not None:
        yield f"Probability: {sure_in_words(probability)}"


def _prediction_errors(held_out: Any) -> Iterable[str]:
    """Return the prediction errors on held-out records before and after the correction.

    Those of a mechanism by balance and by simulation; a root mean square over its records.
    """
    if isinstance(held_out, list):
        for kind in ("balance", "simulation"):
            of_kind = [error for error in held_out if error["kind"] == kind]
            if of_kind:
                quantities = dict.fromkeys(error["quantity"] for error in of_kind)
                parts = [
                    _change(name, *_over_records(e for e in of_kind if e["quantity"] == name))
                    for name in quantities
                ]
                yield f"Held-out error by {kind}: {'; '.join(parts)}"
    elif "reason" in held_out:
        yield f"Held-out error: {held_out['reason']}"
    else:
        channels = {**held_out.get("channels", {})}
        channels["all together"] = held_out.get("overall", held_out)
        parts = [
            _change(name.replace("_", " "), error["before"], error["after"], error["unit"])
            for name, error in channels.items()
        ]
        yield f"Held-out error: {'; '.join(parts)}"


def _over_records(errors: Iterable[Mapping[str, Any]]) -> tuple[float | None, float | None, str]:
    of_records = list(errors)
    before, after = (
        root_mean_square([error[side] for error in of_records]) for side in ("before", "after")
    )
    return before, after, of_records[0]["unit"]


def root_mean_square(sizes: list[float | None]) -> float | None:
    """Return the root mean square of errors, or None where one of them is not finite."""
    if not sizes or any(size is None for size in sizes):
        return None
    return float(np.sqrt(np.mean(np.square(np.array(sizes, dtype=float)))))


def _torsion_error(errors: Iterable[Mapping[str, Any]]) -> Iterable[str]:
    of_records = list(errors)
    if of_records:
        before, after = (
            root_mean_square([error[f"{side}_arcsec"] for error in of_records])
            for side in ("before", "after")
        )
        yield f"Held-out error of the torsion: {_change('', before, after, 'arcsec').lstrip()}"


def _change(name: str, before: float | None, after: float | None, unit: str) -> str:
    return f"{name} {_finite(before, unit)} before, {_finite(after, unit)} after"


def _finite(size: float | None, unit: str) -> str:
    return "diverges" if size is None else f"{number(size)} {_shown(unit)}".rstrip()


def _shown(unit: str) -> str:
    """Return a unit as it is printed: none for what has none, or is per unit of a signal."""
    return "" if unit in ("SI", "1") else unit
