"""Numbers of the problem cards: hardness, twelve algorithms at three budgets, what separates them.

Without an option the report is made from ``experiments/data/cards.csv`` and
``cards_hardness.csv``, the committed outcome of the last full run; with ``--full`` it runs (a
quarter of an hour of one core), goes on where it was interrupted, and leaves the same files in the
results folder; with ``--quick`` a small one runs (a minute). The pages themselves are made from the
same tables when the documentation is built (``docs/_extensions/problem_cards.py``).
"""

from __future__ import annotations

from experiments.comparing.quality import GAP
from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.result import Result
from experiments.studies.cards.data import DIRECT, NAME, OF_DIRECT, numbers_for
from experiments.studies.cards.tables import hardness_table, medians_table, separation_table

SETTING = (
    "As in the comparison of peers: every algorithm with the defaults of its library and 100 "
    "solutions, what it offers thinned out evenly to 50, indicators in objectives normalised by "
    "the true front. What that comparison has stored at the largest budget is taken from it."
)
LEFT_OUT = (
    f"{DIRECT} takes 20 ms a design: it has the least budget only, and {', '.join(OF_DIRECT)}. "
    f"Its front is known to 1 % of its width, and has one step over {GAP:g}, at which pieces are "
    "told apart, so that its two pieces may be one. "
    "Those of a finer surrogate, of which the fronts are nearly the same, are spared the largest. "
    "NSPSO takes no constraints and does not run where there are some. The problems of "
    "robust_benchmarks() have fronts in closed form and no card."
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
