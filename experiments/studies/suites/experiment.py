"""The swarms on suites of others, held-out ones first; see `protocol` for what is run.

Without an option the report is made from the stored outcome, and a few of its runs are made anew;
``--full`` runs what the stored outcome took, some hours of one core. It needs the extra ``suites``,
and goes on where it was interrupted.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.suites import protocol
from experiments.studies.suites.bbob_tables import BEST, CITED, duels_table, reached, shares_table
from experiments.studies.suites.data import NAME, Outcome, outcome_for
from experiments.studies.suites.demands import counted, demands_table, in_one_sentence
from experiments.studies.suites.figures import how_to_choose, runtime_profiles
from experiments.studies.suites.formulas import df, engineering, imop, lz09, zcat
from experiments.studies.suites.jobs import MEASURES, BbobRun, SuiteRun
from experiments.studies.suites.limits import limits_tables
from experiments.studies.suites.own_time import own_time_table
from experiments.studies.suites.parts import parts_table
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.problems import DIFFICULTY, SUITES
from experiments.studies.suites.protocol import BOTH_SIZES, DIMENSIONS, HELD_OUT
from experiments.studies.suites.reduced import WHOLE
from experiments.studies.suites.renew import kept_table
from experiments.studies.suites.suite_tables import (
    NAMES,
    in_short,
    medians_tables,
    ranks_tables,
    rivals_tables,
    together_table,
)
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import NEW, Cell, Column, Finding, Picture, Result, Table

SETTING, SETS, PEERS_NOTE = paragraphs("suites", ours=OURS, difficulty=DIFFICULTY)


def run(context: Context) -> Result:
    """Show what came out on the suites."""
    outcome = outcome_for(context)
    sources = [_source(module.__doc__) for module in (zcat, df, imop, engineering, lz09)]
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
            *(table for table in (duels_table(outcome),) if table.rows),
            parts_table(outcome),
            own_time_table(),
            *limits_tables(),
            *ranks_tables(outcome),
            *rivals_tables(outcome),
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
    (paragraph,) = (
        paragraph for paragraph in (text or "").split("\n\n") if paragraph.startswith("Source:")
    )
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
    missing = [
        suite
        for suite in (*HELD_OUT, BOTH_SIZES, *protocol.VALIDATION)
        if not outcome.budgets(suite)
    ]
    return (
        f"Of 15 seeds and four budgets asked for, this holds: {runs}; bbob-biobj one run an "
        "instance. The table of the parts says what is there and what was not run.",
        *((f"Not run: {', '.join(missing)}.",) if missing else ()),
    )


SUITE_RUNS = (
    SuiteRun("IMOP1", OURS, 1, (500,)),
    SuiteRun("ZCAT1_3", OURS, 1, (500,)),
    SuiteRun("IMOP4", OURS, 1, (500,)),
    SuiteRun("IMOP3", "ElitistSwarm", 1, (500,)),
    SuiteRun("IMOP2", "NSGA-II", 1, (500,)),
)
BBOB_RUNS = (BbobRun(1, 10, 10, WHOLE, 10_000), BbobRun(28, 10, 9, OURS, 25_000))
_PLACES = {words: 1 + MEASURES.index(name) for name, words in NAMES.items()}
"""Where the measures of a run stand in the outcome."""
SAME = 2e-5
"""Relative difference that digits of the table leave open."""


def anew_table(campaign: Campaign, outcome: Outcome) -> Table:
    """Run them, and set their measures beside the stored ones."""
    jobs: list[SuiteRun | BbobRun] = [*SUITE_RUNS]
    if find_spec("cocoex") is not None:
        jobs += BBOB_RUNS
    made = Outcome()
    made.add(jobs, campaign.run(jobs, "anew"))
    rows: list[tuple[Cell, ...]] = []
    for key, numbers in made.suites.items():
        for measure, place in _PLACES.items() if key in outcome.suites else ():
            rows.append((key[0], *key[1:], measure, outcome.suites[key][place], numbers[place]))
    for run, shares in made.bbob.items():
        if run in outcome.bbob:
            name = f"bbob-biobj f{run.function}, instance {run.instance}, {run.dimension}-D"
            pair = outcome.bbob[run][run.told], shares[run.told]
            rows.append((name, run.algorithm, run.told, run.seed, "share of targets", *pair))
    # Two zeros, as of runs that reach no hypervolume, could not differ.
    rows = [row for row in rows if row[-2] or row[-1]]
    stored, now = np.array([row[-2:] for row in rows], dtype=float).reshape(-1, 2).T
    same = int(np.sum(np.isclose(stored, now, rtol=SAME, atol=1e-12)))
    sentence = (
        f"{same} of {len(rows)} numbers of runs made anew here are the stored ones; a relative "
        f"difference of {SAME:g} is allowed."
    )
    if same < len(rows):
        sentence += " Another processor or version may round otherwise, which a search amplifies."
    return Table(
        "anew",
        "Runs of the stored outcome made anew",
        (
            *(Column("problem"), Column("algorithm"), Column("evaluations"), Column("seed")),
            *(Column("measure"), Column("stored", digits=6), Column("now", digits=6)),
        ),
        tuple(rows),
        note="What is 0 in both is left out: it could not differ.",
        findings=(Finding(same == len(rows), sentence, check=True),) if rows else (),
        folded=True,
    )
