"""A few cheap runs of the stored outcome made anew, so that code and outcome cannot part."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from experiments.runner.campaign import Campaign
from experiments.runner.result import Cell, Column, Finding, Table
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.jobs import MEASURES, BbobRun, SuiteRun
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.reduced import WHOLE
from experiments.studies.suites.suite_tables import NAMES

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
