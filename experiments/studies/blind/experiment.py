"""Blind campaigns: how often the discrepancy workflow finds what a bench hides.

Without ``--full`` the report is made from ``experiments/data/blind.csv``, the committed outcome of
the cases that have been run, which stand together in the list; with it the list is run (of it
``--cases 97-192``), goes on where it was interrupted, and leaves the same file, that of the
seconds and the row of the run in the results folder.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context, require
from experiments.runner.texts import paragraphs
from experiments.studies.blind.cases import SCORING_SEED, Case, all_cases
from experiments.studies.blind.data import format_outcomes, format_seconds, outcome, read_outcomes
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.rig.forms import LISTED, UNLISTED
from experiments.studies.blind.rig.visible import LEAST
from experiments.studies.blind.runs import (
    RUNS,
    BlindRun,
    Counts,
    format_runs,
    read_runs,
    recent,
    run_of,
    runs_table,
    total,
)
from experiments.studies.blind.scoring import BlindJob
from experiments.studies.blind.tables import (
    effects_table,
    misses_table,
    must_reach_table,
    pooled_table,
    status_table,
    times_tables,
    tools_table,
    wrong_table,
)
from experiments.studies.blind.targets import reliability, reliability_table
from experiments.studies.blind.truth import ERROR, PARAMETER
from pymoo_hdte._comparing.figures import BLUE, GREY, grid
from pymoo_hdte._comparing.statistics import Estimate, rate
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import NEW, Picture, Result, Table, significant
from pymoo_hdte._runner.store import TIMES, write_atomically
from pymoo_hdte.drive._effects import ENCODER_LINE

OUTCOMES = "blind.csv"
SECONDS = "blind_seconds.csv"

(SETTING,) = paragraphs("blind", least=f"{LEAST:g}", scoring_seed=SCORING_SEED)


def run(context: Context) -> Result:
    """Run the cases or read their outcomes, and hold the scores against what must be reached."""
    outcomes = _campaign(context) if context.full else _committed()
    runs = _runs(outcomes, context.full)
    pooled = total(recent(runs))
    return Result(
        title="Blind campaigns: what the discrepancy workflow finds",
        command=context.command("blind"),
        answer=in_one_sentence(pooled),
        paragraphs=(
            *stored_outcome(context, "blind"),
            f"These figures are pooled over the runs since case {recent(runs)[0].first}, which met "
            f"the score of drives; earlier ones met rules. {_extent(outcomes)}",
            SETTING,
        ),
        tables=(
            pooled_table(recent(runs)),
            must_reach_table(outcomes),
            runs_table(runs),
            *_tables(outcomes),
        ),
        pictures=_pictures(outcomes),
        first_page={NEW: of_the_first_page(pooled)},
    )


def _tables(outcomes: list[Outcome]) -> tuple[Table, ...]:
    return (
        wrong_table(outcomes),
        *times_tables(outcomes),
        reliability_table(outcomes),
        status_table(outcomes),
        effects_table(outcomes),
        tools_table(outcomes),
        misses_table(outcomes),
    )


def _pictures(outcomes: list[Outcome]) -> tuple[Picture, ...]:
    return (
        Picture(
            "confusion",
            "What is hidden against what is answered, where at most one effect is hidden: a name, "
            "or a status where none is given. A class that holds the truth counts as the truth. "
            "Shades are shares of a row, numbers are cases.",
            confusion_matrix(outcomes),
        ),
        Picture(
            "reliability",
            "Share of what is true over the probability with which it was said, with exact 95 % "
            "intervals and the number of answers.",
            reliability_diagram(outcomes),
        ),
    )


def _runs(outcomes: list[Outcome], full: bool) -> list[BlindRun]:
    """Return all runs that are stored, the one just made in place of those that it repeats."""
    stored = read_runs(committed_file(RUNS, "blind"))
    if not full:
        return stored
    now = run_of(outcomes, _first(outcomes))
    return [*(blind_run for blind_run in stored if blind_run.last < now.first), now]


def _first(outcomes: list[Outcome]) -> int:
    """Return where the first of the outcomes stands in the list, counted from 1."""
    return all_cases().index(outcomes[0].case) + 1


def _extent(outcomes: list[Outcome]) -> str:
    """Return in words how many cases of the list have been run."""
    count = len(all_cases())
    if len(outcomes) == count:
        return f"All {count} cases of the list have been run."
    first = _first(outcomes)
    what = (
        f"Cases {first} to {first + len(outcomes) - 1} of the {count} of the list are shown one by "
        "one, in which kinds, effects, forms and stresses are mixed evenly."
    )
    if first == 1:
        return what
    return f"{what} Each run before led to changes of the rules, and the next met unseen cases."


def score_cases(chosen: list[Case], campaign: Campaign, title: str) -> list[Outcome]:
    """Run cases, or read those that have run."""
    runs = campaign.run([BlindJob(case) for case in chosen], title)
    return [outcome(case, run) for case, run in zip(chosen, runs, strict=True)]


def _campaign(context: Context) -> list[Outcome]:
    # Only the jobs import it, and the error of a job ends the command with a traceback.
    require("pysindy", "blind")
    cases = all_cases()
    chosen = [cases[number - 1] for number in context.cases or range(1, len(cases) + 1)]
    outcomes = score_cases(chosen, context.campaign, "blind campaigns")
    target, seconds = context.out / "blind", context.out / TIMES / "blind"
    write_atomically(target / OUTCOMES, format_outcomes(outcomes).encode())
    write_atomically(seconds / SECONDS, format_seconds(outcomes).encode())
    write_atomically(target / RUNS, format_runs([run_of(outcomes, _first(outcomes))]).encode())
    return outcomes


def _committed() -> list[Outcome]:
    return read_outcomes(*(committed_file(name, "blind") for name in (OUTCOMES, SECONDS)))


def in_one_sentence(counts: Counts) -> str:
    """Say how many unqualified answers were wrong, and how much was found."""
    words = found(counts)
    return f"{words[0].upper()}{words[1:]}."


def of_the_first_page(counts: Counts) -> str:
    """Say the same as part of a longer sentence."""
    return f"a workflow that says what a drive model lacks beside measurements: {found(counts)}"


def found(counts: Counts, *, intervals: bool = True) -> str:
    """Say it beginning in lower case, with exact 95 % intervals on request."""
    wrong, single, pair = (
        rate(counts.plain_wrong, counts.plain),
        rate(counts.single_right, counts.single),
        rate(counts.pair_both, counts.pair),
    )
    ends = [f" ({in_percent(rate_of)})" if intervals else "" for rate_of in (wrong, single, pair)]
    return (
        f"in blind tests against an independent simulator, {counts.plain_wrong} of {counts.plain} "
        f"unqualified answers were wrong{ends[0]}; {counts.single_right} of {counts.single} single "
        f"effects{ends[1]} and {100.0 * pair.value:.0f} % of pairs{ends[2]} were identified"
    )


def in_percent(estimate: Estimate) -> str:
    """Write an interval in per cent, with three digits."""
    low, high = (significant(100.0 * end, 3) for end in (estimate.low, estimate.high))
    return f"{low} to {high} %"


_TRUTHS = (*LISTED, "none", *UNLISTED)
_OF_NO_EFFECT = ("adequate", "unlisted", ERROR)
_APART = 0.06
"""Probabilities between which there is room for a number."""
_OF_ONE = ("none", "single", "unlisted")
"""Kinds that hide at most one effect, and no stress."""


def confusion_matrix(outcomes: Sequence[Outcome]) -> Figure:
    """Draw what is hidden against what is answered, for all cases that hide at most one effect."""
    drawn = [case_outcome for case_outcome in outcomes if case_outcome.case.kind in _OF_ONE]
    known = (*LISTED, PARAMETER, ENCODER_LINE)
    # The library holds effects that the bench never hides, as the new zero of a sensor.
    others = sorted({case_outcome.answer for case_outcome in drawn} - {*known, *_OF_NO_EFFECT})
    answers = (*known, *others, *_OF_NO_EFFECT)
    counts = np.zeros((len(_TRUTHS), len(answers)), dtype=int)
    for answer in drawn:
        counts[_TRUTHS.index(answer.case.truth), answers.index(answer.answer)] += 1
    figure, axes = grid(1, 1, width=9.5, height=9.0)
    axis = axes.flat[0]
    axis.grid(False)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    axis.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for row, column in np.argwhere(counts):
        colour = "white" if shares[row, column] > 0.5 else "black"
        axis.text(column, row, str(counts[row, column]), color=colour,
                  ha="center", va="center", fontsize=8)  # fmt: skip
    words = [[name.replace("_", " ") for name in names] for names in (answers, _TRUTHS)]
    axis.set_xticks(range(len(answers)), words[0], rotation=60, ha="right", fontsize=8)
    axis.set_yticks(range(len(_TRUTHS)), words[1], fontsize=8)
    axis.set_xlabel("answer")
    axis.set_ylabel("hidden")
    for place in (len(LISTED), len(LISTED) + 1):
        axis.axhline(place - 0.5, color=GREY, linewidth=1)
    axis.axvline(len(LISTED) - 0.5, color=GREY, linewidth=1)
    return figure


def reliability_diagram(outcomes: Sequence[Outcome]) -> Figure:
    """Draw the share of true statements over the probability that they were given."""
    points = reliability(outcomes)
    figure, axes = grid(1, 1, width=5.0, height=4.5)
    axis = axes.flat[0]
    axis.plot([0.0, 1.0], [0.0, 1.0], color=GREY, linewidth=0.8, linestyle="--")
    said = [point for point, _ in points]
    values = [point.value for _, point in points]
    ends = [
        [point.value - point.low for _, point in points],
        [point.high - point.value for _, point in points],
    ]
    if points:
        axis.errorbar(said, values, np.abs(ends), fmt="o", color=BLUE, markersize=4, linewidth=1)
    level, last = 0, -1.0
    for point, one in sorted(points, key=lambda each: each[0]):
        # A number that would meet the last one stands a line lower.
        level = level + 1 if point - last < _APART else 0
        last = point
        axis.annotate(str(one.n), (point, one.value), xytext=(4, -9 - 9 * level),
                      textcoords="offset points", fontsize=7)  # fmt: skip
    axis.set_xlabel("mean probability said")
    axis.set_ylabel("share true")
    return figure
