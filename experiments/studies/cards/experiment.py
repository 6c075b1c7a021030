"""Numbers of the problem cards: hardness, twelve algorithms at three budgets, what separates them.

Without an option the report is made from ``experiments/data/cards.csv`` and
``cards_hardness.csv``, the committed outcome of the last full run; with ``--full`` it runs (a
quarter of an hour of one core), goes on where it was interrupted, and leaves the same files in the
results folder; with ``--quick`` a small one runs (a minute). The pages themselves are made from the
same tables when the documentation is built (``docs/_extensions/problem_cards.py``).
"""

from __future__ import annotations

from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.cards.data import DIRECT, NAME, OF_DIRECT, numbers_for
from experiments.studies.cards.tables import hardness_table, medians_table, separation_table
from pymoo_hdte._comparing.quality import GAP
from pymoo_hdte._runner.result import Result

SETTING, LEFT_OUT = paragraphs(
    "cards", direct=DIRECT, of_direct=", ".join(OF_DIRECT), gap=f"{GAP:g}"
)


def run(context: Context) -> Result:
    """Compute the numbers of the cards, or read them."""
    numbers = numbers_for(context)
    scores = numbers.scores
    return Result(
        title="Cards of the robust problems",
        command=context.command(NAME),
        paragraphs=(*stored_outcome(context, NAME), SETTING, LEFT_OUT),
        tables=(
            separation_table(numbers),
            hardness_table(numbers),
            *(medians_table(scores, problem) for problem in scores.problems),
        ),
        notes=(f"{len(scores.seeds)} seeds.",),
    )
