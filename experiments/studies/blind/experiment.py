"""Blind campaigns: how often the discrepancy workflow finds what a bench hides.

Without ``--full`` the report is made from ``experiments/data/blind.csv``, the committed outcome of
the cases that have been run, which stand together in the list; with it the list is run (of it
``--cases 97-192``), goes on where it was interrupted, and leaves the same file, that of the
seconds and the row of the run in the results folder.
"""

from __future__ import annotations

from experiments.runner.campaign import Campaign
from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context, require
from experiments.runner.result import NEW, Picture, Result, Table
from experiments.runner.store import TIMES, write_atomically
from experiments.runner.texts import paragraphs
from experiments.studies.blind.cases import SCORING_SEED, Case, all_cases
from experiments.studies.blind.data import format_outcomes, format_seconds, outcome, read_outcomes
from experiments.studies.blind.figures import confusion_matrix, reliability_diagram
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.reliability import reliability_table
from experiments.studies.blind.rig.visible import LEAST
from experiments.studies.blind.runs import (
    RUNS,
    BlindRun,
    format_runs,
    read_runs,
    recent,
    run_of,
    runs_table,
    total,
)
from experiments.studies.blind.scoring import BlindJob
from experiments.studies.blind.sentences import in_one_sentence, of_the_first_page
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
            f"about the code of now. {_extent(outcomes)}",
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
    return [*(one for one in stored if one.last < now.first), now]


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
