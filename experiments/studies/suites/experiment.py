"""The swarms on suites of others, held-out ones first; see `protocol` for what is run.

Without an option the report is made from the stored outcome, and a few of its runs are made anew;
``--quick`` runs what the stored outcome took (some hours of one core), ``--full`` the whole of what
was asked for (days). Both need the extra ``suites``, and go on where they were interrupted.
"""

from __future__ import annotations

from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.result import NEW, Picture, Result
from experiments.studies.suites import protocol
from experiments.studies.suites.anew import anew_table
from experiments.studies.suites.bbob.published import BEST, CITED
from experiments.studies.suites.bbob_tables import duels_table, reached, shares_table
from experiments.studies.suites.data import NAME, Outcome, outcome_for
from experiments.studies.suites.demands import counted, demands_table, in_one_sentence
from experiments.studies.suites.figures import how_to_choose, runtime_profiles
from experiments.studies.suites.formulas import engineering, imop, lz09, zcat
from experiments.studies.suites.gather import kept_table
from experiments.studies.suites.own_time import own_time_table
from experiments.studies.suites.parts import parts_table
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.problems import DIFFICULTY, SUITES
from experiments.studies.suites.protocol import DIMENSIONS, HELD_OUT
from experiments.studies.suites.rule import steps_table
from experiments.studies.suites.suite_tables import (
    in_short,
    medians_tables,
    ranks_tables,
    rivals_table,
)
from experiments.studies.suites.together import together_table

SETTING = (
    f"{OURS} runs as it is, all others as their users run them, with a population of 100; those "
    "that move alike whatever their budget are read on the way to the largest, on bbob-biobj "
    f"{OURS} among them. There COCO's logger counts every evaluated point; first positions are "
    "drawn from -5 to 5. Elsewhere at most 100 solutions are judged, more are thinned out by what "
    "they add to the hypervolume, which counts up to 1.1 in objectives normalised by the true "
    "front, or, where that has no closed form (RE, MW, DAS-CMOP), by the ends of the best found in "
    "long runs. Ranks are those of medians over the seeds."
)
SETS = (
    "Held out: nothing was chosen on them. ZCAT was run once; instance 9 with an earlier swarm "
    "too. These are all 55 functions of bbob-biobj in 10 and 20 dimensions, instance 9, and "
    "ZCAT's twenty problems with two and with three objectives, thirty variables, at levels of "
    "difficulty 1 to 4 in turn. The protocol was committed first. Validation: RE, MW, DAS-CMOP, "
    "LZ09, whose outcomes led to the demands, IMOP, which showed what truncation by hypervolume "
    "lacked, and instance 10 of bbob-biobj, on which it was decided which parts stay."
)
PEERS_NOTE = (
    "GDE3 and MOEA/D-DE are jMetalPy's (pymoode's GDE3 wants an older pymoo); MOEA/D-DE, "
    "COMO-CMA-ES and NSPSO take no constraints, COMO-CMA-ES two objectives only, and it alone is "
    "told the corner up to which hypervolume counts. Peers of jMetalPy and pygmo, which cannot be "
    "told where to start, are not run on bbob-biobj. DAS-CMOP is taken at the "
    f"{DIFFICULTY}th of pymoo's triplets of difficulty."
)


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
            steps_table(outcome),
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
