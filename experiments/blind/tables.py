"""Tables of the blind campaigns."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.blind.codes import STATUSES
from experiments.blind.data import Outcome
from experiments.blind.limits import LIMITS, curve, size_at
from experiments.blind.scoring import COMPARED, DETERMINED, PARTS, RIVALS
from experiments.blind.targets import Estimate, Judged, demands, median, rate, select, time_demand
from experiments.runner.result import Cell, Column, Finding, Table, significant
from pymoo_hdte.virtual.hidden_forms import LISTED_FORMS

KINDS = {
    "none": "nothing",
    "single": "one listed effect",
    "unlisted": "one unlisted effect",
    "pair": "two listed effects",
    "parameter": "a parameter out of tolerance",
}
JUDGED_COLUMNS = (
    Column("demand"),
    Column("cases that hide"),
    Column("n"),
    Column("required"),
    Column("value", "", 3, "measured"),
    Column("low", "", 3, "measured"),
    Column("high", "", 3, "measured"),
    Column("verdict"),
)
_ANSWERS = len(LISTED_FORMS) + 2
"""All names, "adequate" and "unlisted": what chance chooses from."""


def must_reach_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what must be reached beside what was measured."""
    note = (
        "Intervals are exact: Clopper and Pearson's for rates, order statistics' for medians. A "
        "demand is missed where an exact one-sided test at 1 % rejects it. A gap that exceeds the "
        "noise floor by less than a tenth cannot shrink and counts for no median."
    )
    return _judged_table("must_reach", "Must reach", list(demands(outcomes)), note)


def times_tables(outcomes: Sequence[Outcome]) -> tuple[Table, Table]:
    """Return the demand on time, and the seconds of the parts, by what is hidden."""
    judged = _judged_table(
        "time", "Must reach: time", [time_demand(outcomes)],
        "Processor time of analyse, locate, prove and next experiment.", wall_times=True,
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    for kind, words in KINDS.items():
        groups: tuple[str | None, ...] = (*LISTED_FORMS,) if kind == "single" else (None,)
        for name in groups:
            chosen = [one.seconds for one in select(outcomes, kind, name) if one.seconds]
            parts = [median([one[k] for one in chosen]).value for k in range(len(PARTS))]
            whole = median([sum(one) for one in chosen])
            what = _plain(name) if name else words
            rows.append((what, whole.n, *parts, whole.value, whole.high))
    columns = (
        Column("hidden"),
        Column("cases"),
        *(Column(part.replace("_", " "), "s", 3, "median") for part in PARTS),
        Column("all", "s", 3, "median"),
        Column("upper end", "s", 3, "median"),
    )
    parts_table = Table("time_parts", "Processor time by what is hidden", columns, tuple(rows),
                        folded=True, wall_times=True)  # fmt: skip
    return judged, parts_table


def status_table(outcomes: Sequence[Outcome]) -> Table:
    """Return how often each status is the answer, by kind."""
    rows: list[tuple[Cell, ...]] = []
    for kind, words in KINDS.items():
        chosen = select(outcomes, kind)
        counts = [sum(one.status == status for one in chosen) for status in STATUSES]
        wrong = sum(one.wrong_confident for one in chosen)
        f1 = median([one.f1 for one in chosen if one.case.names and "cells_moved" in one.numbers])
        rows.append((words, len(chosen), *counts, sum(one.right for one in chosen), wrong,
                     f1.value))  # fmt: skip
    columns = (
        Column("hidden"),
        Column("cases"),
        *(Column(status, group="status") for status in STATUSES),
        Column("right", group="first name"),
        Column("wrong, confident", group="first name"),
        Column("F1 of cells", "", 3, "median"),
    )
    note = (
        "Confident are the statuses named and parameter. Error: the workflow raised an exception, "
        "which counts as wrong everywhere."
    )
    return Table("statuses", "Verdicts by what is hidden", columns, tuple(rows), note=note)


def effects_table(outcomes: Sequence[Outcome]) -> Table:
    """Return the scores of each listed effect."""
    rows: list[tuple[Cell, ...]] = []
    for name in LISTED_FORMS:
        chosen = select(outcomes, "single", name)
        right = rate([one.right for one in chosen])
        counts = [sum(one.status == status for one in chosen)
                  for status in ("class", "unlisted", "adequate", "error")]  # fmt: skip
        biases = [median([one.numbers.get(f"bias_{state}") for one in chosen]).value
                  for state in ("before", "after", "error")]  # fmt: skip
        gaps = [one.gap("leading") for one in chosen]
        rows.append((
            _plain(name), len(chosen), right.value, right.low, right.high,
            sum(one.wrong_confident for one in chosen), *counts,
            median([one.f1 for one in chosen]).value, *biases,
            median([one.bias_ratio for one in chosen]).value,
            median([one.shrinkage("transmission_error") for one in chosen]).value,
            median([one.shrinkage("leading") for one in chosen]).value,
            median([g.after / g.noise_floor for g in gaps if g is not None]).value,
        ))  # fmt: skip
    columns = (
        Column("hidden"),
        Column("cases"),
        Column("rate", "", 3, "right"),
        Column("low", "", 3, "right"),
        Column("high", "", 3, "right"),
        Column("wrong, confident"),
        *(Column(status, group="status") for status in ("class", "unlisted", "adequate", "error")),
        Column("F1 of cells", "", 3, "median"),
        Column("before", "", 2, "bias of the base, in tolerances"),
        Column("after", "", 2, "bias of the base, in tolerances"),
        Column("standard error", "", 2, "bias of the base, in tolerances"),
        Column("ratio", "", 2, "bias of the base, in tolerances"),
        Column("transmission error", "", 3, "held-out shrinkage"),
        Column("leading channel", "", 3, "held-out shrinkage"),
        Column("end over noise floor", "", 3),
    )
    note = (
        "Medians. The bias is the root mean square distance of mechanical parameters and error "
        "amplitudes from a fit to the same rig and noise without the effect, of those that this "
        f"fit knows to better than {DETERMINED:g} tolerances; beside it the standard error of the "
        "same fit. A ratio counts where the bias exceeds that error. Root mean square over all "
        f"cases: {_pooled(outcomes, 'bias')} of the bias is left, with the parameters that no "
        f"record determines {_pooled(outcomes, 'bias_of_all')}. The leading channel is that in "
        "which the base stands out of the noise most; the end is its."
    )
    return Table("effects", "Each listed effect at its typical size", columns, tuple(rows),
                 note=note)  # fmt: skip


def _pooled(outcomes: Sequence[Outcome], name: str) -> str:
    """Return the ratio of root mean squares over all cases, after the revision to before it."""
    numbers = [one.numbers for one in select(outcomes, "single") if f"{name}_before" in one.numbers]
    squares = [sum(one[f"{name}_{state}"] ** 2 for one in numbers) for state in ("after", "before")]
    return significant((squares[0] / squares[1]) ** 0.5, 2) if numbers else "none"


def limits_table(outcomes: Sequence[Outcome]) -> Table:
    """Return the rate of right verdicts by size, and the sizes found in half and in 95 %."""
    sizes = sorted({one.case.size for one in outcomes if one.case.kind == "detection"} | {1.0})
    rows: list[tuple[Cell, ...]] = []
    for name in LISTED_FORMS:
        points = dict(curve(outcomes, name))
        at = [points[size].value if size in points else None for size in sizes]
        rows.append((_plain(name), *at, *(size_at(outcomes, name, limit) for limit in LIMITS)))
    columns = (
        Column("hidden"),
        *(Column(f"{size:g}", "", 3, "rate of right verdicts at size") for size in sizes),
        *(Column(f"{limit:.0%}".replace("%", " %"), "", 2, "size found in") for limit in LIMITS),
    )
    note = (
        "Size 1 is a typical effect. Sizes found in half and in 95 % lie between two sizes tried, "
        "on the rates made monotone; none where that rate is not reached, or is already at the "
        "smallest size."
    )
    return Table("limits", "Detection limits", columns, tuple(rows), note=note)


def tools_table(outcomes: Sequence[Outcome]) -> Table:
    """Return how often simpler tools and chance are right on the same cases."""
    rows: list[tuple[Cell, ...]] = []
    for kind in COMPARED:
        chosen = select(outcomes, kind)
        expected = {"none": "adequate", "unlisted": "unlisted"}.get(kind)
        rates: dict[str, Estimate] = {
            "this workflow, name or class": rate([one.right_answer for one in chosen]),
            "this workflow, first name alone": rate([one.right_word for one in chosen]),
        }
        for tool in RIVALS:
            answers = [one.answers.get(tool, "error") == (expected or one.case.truth)
                       for one in chosen]  # fmt: skip
            rates[_plain(tool)] = rate(answers)
        for tool, found in rates.items():
            rows.append((KINDS[kind], tool, found.n, found.value, found.low, found.high))
        rows.append((KINDS[kind], "chance", None, 1.0 / _ANSWERS, None, None))
    columns = (
        Column("hidden"),
        Column("tool"),
        Column("cases"),
        Column("rate", "", 3, "right"),
        Column("low", "", 3, "right"),
        Column("high", "", 3, "right"),
    )
    note = (
        f"Chance picks one of {_ANSWERS} answers: {len(LISTED_FORMS)} names, adequate, unlisted. "
        "Right are adequate where nothing is hidden, unlisted, and the effect's name."
    )
    return Table("tools", "What simpler tools say of the same cases", columns, tuple(rows),
                 note=note)  # fmt: skip


def misses_table(outcomes: Sequence[Outcome]) -> Table:
    """Return every case at typical size whose verdict is not right."""
    rows = tuple(
        (one.case.truth.replace("+", " + "), one.case.number, one.status, ", ".join(one.chosen),
         ", ".join(map(_plain, one.equivalents)))
        for one in outcomes
        if one.case.kind != "detection" and not one.right_answer
    )  # fmt: skip
    columns = (
        Column("hidden"),
        Column("case"),
        Column("status"),
        Column("preferred"),
        Column("not told from it"),
    )
    return Table("misses", f"All {len(rows)} cases that went wrong", columns, rows, folded=True)


def _judged_table(
    name: str, title: str, judged: Sequence[Judged], note: str, wall_times: bool = False
) -> Table:
    rows = tuple(judged_row(one) for one in judged)
    findings = tuple(
        Finding(one.met, _sentence(one), check=True)
        for one in judged
        if one.verdict in ("met", "missed")
    )
    return Table(name, title, JUDGED_COLUMNS, rows, note=note, findings=findings,
                 wall_times=wall_times)  # fmt: skip


def judged_row(one: Judged) -> tuple[Cell, ...]:
    """Return a demand and what was measured as cells of `JUDGED_COLUMNS`."""
    asked = ("at least " if one.at_least else "at most ") + significant(one.required, 3)
    measured = one.measured
    return (one.what, one.cases, measured.n, asked, measured.value, measured.low, measured.high,
            one.verdict)  # fmt: skip


def _sentence(one: Judged) -> str:
    value, low, high = (significant(x, 3) for x in
                        (one.measured.value, one.measured.low, one.measured.high))  # fmt: skip
    bound = "at least" if one.at_least else "at most"
    return (
        f"Blind campaigns with {one.cases}, {one.what}: {value} ({low} to {high}, "
        f"{one.measured.n} cases), required {bound} {significant(one.required, 3)}."
    )


def _plain(name: str) -> str:
    return name.replace("_", " ")
