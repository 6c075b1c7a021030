"""Table 7 and the ablation at every budget and population, and in every reading.

Without an option the report is made from ``experiments/data/anytime.csv``, the committed outcome of
the last full run; with ``--full`` it runs (some forty minutes on two cores) and leaves the same
files in the results folder; with ``--quick`` a small one runs (a minute).
"""

from __future__ import annotations

from collections.abc import Sequence

from experiments.paper.anytime.data import NAME, OF_TABLE_7, Scores, committed_scores, scores_for
from experiments.paper.anytime.figures import closeness, over_budget
from experiments.paper.anytime.leads import leads_table
from experiments.paper.anytime.readings import Reading, readings
from experiments.paper.anytime.sentences import (
    SPOKEN_OF,
    advantage_findings,
    first_page,
    number_of_designs,
    opening,
    readings_findings,
)
from experiments.paper.anytime.strategies import gains_table, strategies_table
from experiments.paper.anytime.tables import (
    CONTESTED,
    contests,
    drawn,
    duels_table,
    means_table,
    readings_table,
    standings_table,
    stated_table,
)
from experiments.runner.committed import committed_file, read_origin, stored_outcome
from experiments.runner.registry import Context
from experiments.runner.result import Column, Picture, Result, Table
from experiments.runner.texts import paragraphs

VARIANTS = ("AMP-MOPSO", "A-MOPSO", "MP-MOPSO", "MOPSO")

SETTING, READINGS = paragraphs("anytime")


def run(context: Context) -> Result:
    """Run the comparison at every budget or read its outcome, and rank the readings."""
    scores = scores_for(context)
    found, ranked = contests(scores), readings(scores)
    return Result(
        title="Table 7 and Fig. 17 at every budget, and what the printed numbers may mean",
        command=context.command(NAME),
        paragraphs=(*stored_outcome(context, NAME), SETTING, READINGS),
        tables=(
            standings_table(found, list(advantage_findings(found))),
            readings_table(
                ranked, list(readings_findings(ranked)), number_of_designs(scores, ranked)
            ),
            leads_table(scores),
            gains_table(scores),
            duels_table(found),
            strategies_table(scores),
            means_table(scores),
            _seconds_table(scores),
        ),
        pictures=tuple(_pictures(scores, ranked)),
        notes=tuple(_extent(scores)),
        answer=opening(scores, found, ranked),
        first_page=first_page(scores, found),
        shown_first="anytime",
    )


def table_7_picture() -> Picture:
    """Return the picture that the section on Table 7 begins with, from the committed outcome."""
    picture = _table_7(committed_scores())
    made = read_origin(committed_file(f"{NAME}.csv", NAME))["date"]
    caption = f"{picture.caption} Made from the stored outcome of {made} of the experiment {NAME}."
    return Picture(picture.name, caption, picture.figure, leading=True)


def at_the_stated_setting() -> Table:
    """Return the table that the section on Table 7 shows beside its own, from the same outcome."""
    return stated_table(committed_scores())


def _table_7(scores: Scores) -> Picture:
    return Picture(
        "anytime",
        f"Table 7 at every budget: means over the seeds on {SPOKEN_OF.model}, exact moments, first "
        "velocities as printed, arcsec to the "
        "true front (hypervolume: normalised by it, up to 1.1); bands are 95 % intervals, dashed "
        "lines the printed numbers. The paper states a population of 100 and 10,000 evaluations: "
        "the right end of the last column.",
        over_budget(scores, SPOKEN_OF, OF_TABLE_7, printed=True),
    )


def _pictures(scores: Scores, ranked: Sequence[Reading]) -> list[Picture]:
    lead = _table_7(scores)
    return [
        Picture(lead.name, lead.caption, lead.figure, leading=True),
        Picture(
            "closeness",
            "By what factor the closest reading of each population and budget is off the six "
            "printed numbers.",
            closeness(ranked),
        ),
        Picture(
            "ablation",
            f"The ablation at every budget, measured as above on {SPOKEN_OF.model}. A wide band "
            "stems from a few runs that stay away from the front.",
            over_budget(scores, SPOKEN_OF, VARIANTS, printed=False),
        ),
    ]


def _extent(scores: Scores) -> list[str]:
    return [
        f"{contested.model} with {contested.moments} moments and velocities drawn "
        f"{drawn(contested)}: {', '.join(scores.algorithms(contested))}; {seeds} seeds."
        for contested in scores.contested()
        for seeds in {
            len(runs) for case, runs in scores.values.items() if case.contested == contested
        }
    ]


def _seconds_table(scores: Scores) -> Table:
    columns = [*CONTESTED, Column("population"), Column("algorithm")]
    return Table(
        "seconds",
        "Seconds of one seed over all budgets, median",
        (*columns, Column("time", "s", 3)),
        tuple((*key, value) for key, value in scores.seconds.items()),
        folded=True,
        wall_times=True,
    )
