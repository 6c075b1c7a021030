"""Table 7 and Fig. 18: AMP-MOPSO against basic MOPSO and NSGA-II."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from experiments.comparison.figures import fronts, igd_of_runs
from experiments.comparison.paired import Comparison, compare, too_few_seeds
from experiments.paper.comparison_tables import (
    INDICATOR_NAMES,
    change,
    coverage_table,
    paired_tests_table,
    quality_table,
    runs_table,
    times_table,
)
from experiments.published_values import TABLE_7
from experiments.runner.registry import Context
from experiments.runner.result import Finding, Picture, Result, significant

OURS = "AMP-MOPSO"

CONFIRMED = 0.5
"""An advantage agrees with the paper's if it is significant and at least this share of it."""

SETTING = (
    "Every run spends 100 x 100 evaluations, the budget that the paper states; what is found holds "
    "for this budget alone. The final set holds at most 50 designs, for NSGA-II its non-dominated "
    "population thinned by the crowding truncation that the archives use. IGD and Spacing come "
    "from pymoo, with ideal and nadir point of the true front of the order-3 surrogate, which none "
    "of the compared algorithms produced. The paper names neither its reference front nor its "
    "normalisation, so ratios can be compared with it, but not the values themselves; an advantage "
    "counts as agreeing if it is significant and at least half of what the paper prints."
)
LOST = (
    "A piece of that front (parts separated by a gap above 0.02) counts as lost when no "
    "solution lies within 0.05 of it, both in normalised objectives. Spacing alone misleads: a "
    "front crowded into one corner has a good one."
)


def run(context: Context) -> Result:
    """Compare the three algorithms of Table 7 on both drive models."""
    comparisons = compare(context, tuple(TABLE_7), "table7")
    quality = quality_table(comparisons, TABLE_7, list(_advantages(comparisons)))
    return Result(
        title=f"Table 7: three algorithms, seeds 1 to {context.seeds}",
        command=f"python -m experiments table7 --seeds {context.seeds}",
        paragraphs=(SETTING,),
        tables=(
            quality,
            paired_tests_table(comparisons, OURS),
            coverage_table(comparisons),
            runs_table(comparisons),
            times_table(comparisons, TABLE_7, [_time_finding(comparisons[0])]),
        ),
        pictures=(
            Picture(
                "fronts",
                "As Fig. 18: for every algorithm the run of median IGD over the surrogate's front.",
                fronts(comparisons),
            ),
            Picture("igd", "IGD of every run; bars mark the medians.", igd_of_runs(comparisons)),
        ),
        notes=(LOST, *too_few_seeds(comparisons)),
        headline=quality.name,
    )


def _advantages(comparisons: Sequence[Comparison]) -> Iterator[Finding]:
    """Whether AMP-MOPSO is ahead of each rival as far as the paper has it."""
    for comparison in comparisons:
        if not comparison.can_be_judged:
            continue
        for indicator in ("igd", "spacing"):
            ours = comparison.values(OURS, indicator).mean()
            confirmed, clauses = True, []
            for test in comparison.paired_tests(OURS, indicator):
                theirs = comparison.values(test.rival, indicator).mean()
                paper = [getattr(TABLE_7[name], indicator) for name in (test.rival, OURS)]
                enough = 1.0 - ours / theirs >= CONFIRMED * (1.0 - paper[1] / paper[0])
                confirmed = confirmed and test.significant and enough
                clauses.append(
                    f"{change(theirs, ours)} {test.rival}'s (p = {significant(test.p, 2)}; the "
                    f"paper: {change(*paper)})"
                )
            name = INDICATOR_NAMES[indicator]
            sentence = (
                f"On {comparison.model}, after 100 x 100 evaluations, {OURS}'s mean {name} is "
                f"{' and '.join(clauses)}."
            )
            yield Finding(confirmed, sentence)


def _time_finding(comparison: Comparison) -> Finding:
    """Whether the three algorithms take about the same time, as the paper has it."""
    ours = {a: comparison.seconds(a).mean() for a in comparison.algorithms}
    spread = max(ours.values()) / min(ours.values())
    paper = [row.seconds for row in TABLE_7.values()]
    paper_spread = max(paper) / min(paper)
    return Finding(
        spread < 1.1,
        f"On {comparison.model}, {OURS} takes {significant(ours[OURS], 2)} s a run against "
        f"{TABLE_7[OURS].seconds} s in the paper, and the slowest algorithm takes "
        f"{significant(spread, 2)} times as long as the fastest (paper: "
        f"{significant(paper_spread, 3)}).",
    )
