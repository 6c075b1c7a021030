"""Which effects the printed equations lack: a ladder of models fitted to published numbers.

Without ``--full`` the report is made from ``experiments/data/calibration.csv``, the committed
outcome of the last full campaign; with it the campaign runs, goes on where it was interrupted, and
leaves the same file in the results folder.
"""

from __future__ import annotations

from experiments.paper.calibrating.data import Outcome, collect, format_outcomes, read_outcomes
from experiments.paper.calibrating.fitting import BUDGETS, Bootstrap, Fit
from experiments.paper.calibrating.ladder import ladder_rungs
from experiments.paper.calibrating.tables import (
    best_rungs,
    gaps,
    ladder_table,
    numbers_table,
    of_the_first_page,
    parameter_table,
    simplest_table,
    unexplained,
)
from experiments.runner.committed import committed_file, stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._runner.result import OF_MODELS, Picture, Result
from pymoo_hdte._runner.store import write_atomically

OUTCOMES = "calibration.csv"
SEEDS = {"table8": (1, 2), "table5": (1,)}
"""Seeds of the fits, by direction; four numbers need no second seed."""
REPLICATES = 20

(SETTING,) = paragraphs("calibration")


def run(context: Context) -> Result:
    """Fit or read the ladder, and hold every rung against what it was not fitted to."""
    outcomes = (
        _campaign(context)
        if context.full
        else read_outcomes(committed_file(OUTCOMES, "calibration"))
    )
    best = best_rungs(outcomes, "table8")[0]
    first, numbers = of_the_first_page(best), numbers_table(best)
    plain = simplest_table(outcomes)
    answers = [
        finding for table in (numbers, plain) for finding in table.findings if finding.answers
    ]
    sentences = " ".join(finding.sentence for finding in answers)
    return Result(
        title="Calibration: what the printed equations lack",
        command=context.command("calibration"),
        answer=f"{first[0].upper()}{first[1:]}. {sentences}",
        paragraphs=(*stored_outcome(context, "calibration"), SETTING),
        tables=(
            numbers,
            plain,
            ladder_table(outcomes, "table8", "fitted to Table 8 and the box scatter"),
            ladder_table(outcomes, "table5", "fitted to Table 5 and the prototypes"),
            parameter_table(best, outcomes),
        ),
        pictures=(
            Picture(
                "gaps",
                "Gap to the published numbers of every rung fitted to Table 8 and the box scatter: "
                "fitted numbers (circles) and numbers held out (squares).",
                gaps(best_rungs(outcomes, "table8")),
            ),
        ),
        notes=tuple(unexplained(best)),
        first_page={OF_MODELS: first},
    )


def _campaign(context: Context) -> list[Outcome]:
    rungs = sorted(ladder_rungs(), key=lambda rung: -len(rung.effects))
    fits = [
        Fit(rung, direction, seed, budget)
        for direction, budget in BUDGETS.items()
        for seed in SEEDS[direction]
        for rung in rungs
    ]
    outcomes = collect(fits, context.campaign.run(fits, "calibration"))
    best = best_rungs(outcomes, "table8")[0]
    start = tuple(best.parameters.items())
    replicates = [
        Bootstrap(best.candidate, start, best.direction, number, BUDGETS[best.direction])
        for number in range(REPLICATES)
    ]
    outcomes += collect(replicates, context.campaign.run(replicates, "bootstrap"))
    target = context.out / "calibration" / OUTCOMES
    write_atomically(target, format_outcomes(outcomes).encode())
    return outcomes
