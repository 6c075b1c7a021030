"""The swarms on suites of others, held-out ones first; see `protocol` for what is run.

Without an option the report is made from the stored outcome, and a few of its runs are made anew;
``--quick`` runs what the stored outcome took (some hours of one core), ``--full`` the whole of what
was asked for (days). Both need the extra ``suites``, and go on where they were interrupted.
"""

from __future__ import annotations

from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.result import NEW, Picture, Result
from experiments.runner.texts import paragraphs
from experiments.studies.suites import protocol
from experiments.studies.suites.anew import anew_table
from experiments.studies.suites.bbob.published import BEST, CITED
from experiments.studies.suites.bbob_tables import duels_table, reached, shares_table
from experiments.studies.suites.data import NAME, Outcome, outcome_for
from experiments.studies.suites.demands import counted, demands_table, in_one_sentence
from experiments.studies.suites.figures import how_to_choose, runtime_profiles
from experiments.studies.suites.formulas import engineering, imop, lz09, zcat
from experiments.studies.suites.own_time import own_time_table
from experiments.studies.suites.parts import parts_table
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.problems import DIFFICULTY, SUITES
from experiments.studies.suites.protocol import DIMENSIONS, HELD_OUT
from experiments.studies.suites.renew import kept_table
from experiments.studies.suites.suite_tables import (
    in_short,
    medians_tables,
    ranks_tables,
    rivals_table,
)
from experiments.studies.suites.together import together_table

SETTING, SETS, PEERS_NOTE = paragraphs("suites", ours=OURS, difficulty=DIFFICULTY)


def run(context: Context) -> Result:
    """Show what came out on the suites."""
    outcome = outcome_for(context)
    sources = [_source(module.__doc__) for module in (zcat, imop, engineering, lz09)]
    return Result(
        title="The swarms on suites of others",
        command=context.command(NAME),
        answer=f"{in_one_sentence(outcome)} {counted(outcome)}",
        paragraphs=(*stored_outcome(context, NAME), SETS, SETTING, PEERS_NOTE, *sources),
        tables=(
            in_short(outcome),
            demands_table(outcome),
            together_table(outcome),
            shares_table(outcome),
            *(one for one in (duels_table(outcome),) if one.rows),
            parts_table(outcome),
            own_time_table(),
            *ranks_tables(outcome),
            rivals_table(outcome),
            *medians_tables(outcome),
            kept_table(outcome),
            anew_table(context.campaign, outcome),
        ),
        pictures=(
            Picture(
                "profiles",
                "Runtime profiles: share of COCO's targets over evaluations. Bold: ours; broken "
                "lines: published.",
                runtime_profiles(outcome),
                leading=True,
            ),
            Picture(
                "choice",
                f"How to choose: average ranks on {HELD_OUT[0]}, and shares of targets.",
                how_to_choose(outcome),
            ),
        ),
        notes=_extent(outcome),
        first_page={NEW: _new(outcome)},
    )


def _source(text: str | None) -> str:
    """Return the paragraph of a module that names its source."""
    (paragraph,) = (one for one in (text or "").split("\n\n") if one.startswith("Source:"))
    return " ".join(paragraph.split())


def _new(outcome: Outcome) -> str:
    """Say for the first page what share of targets our swarm reaches, beside the best published."""
    parts = []
    for dimension in DIMENSIONS:
        share = reached(outcome, dimension, 10_000)
        if share is not None:
            cited = CITED[dimension, 10_000]
            parts.append(f"{share:.3f} in {dimension} dimensions ({BEST} {cited:.3f})")
    return (
        "a swarm for few evaluations beside published results on COCO's bbob-biobj, held out: "
        f"after 10,000 evaluations it reaches a share of the targets of {' and '.join(parts)}"
    )


def _extent(outcome: Outcome) -> tuple[str, ...]:
    runs = ", ".join(
        f"{suite} {outcome.seeds(suite)} seeds or more at "
        + ", ".join(f"{budget:,}" for budget in outcome.budgets(suite))
        for suite in SUITES
        if outcome.budgets(suite)
    )
    missing = [suite for suite in (*HELD_OUT, *protocol.VALIDATION) if not outcome.budgets(suite)]
    return (
        f"Of 15 seeds and four budgets asked for, this holds: {runs}; bbob-biobj one run an "
        "instance. The table of the parts says what is there and what was not run.",
        *((f"Not run: {', '.join(missing)}.",) if missing else ()),
    )
