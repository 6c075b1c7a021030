"""Table 7 and Fig. 18: AMP-MOPSO against basic MOPSO and NSGA-II."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from experiments.comparing.figures import fronts, igd_of_runs
from experiments.comparing.indicators import NAMES
from experiments.comparing.named import check_setting
from experiments.comparing.paired import Comparison, compare, too_few_seeds
from experiments.paper.anytime.experiment import at_the_stated_setting, table_7_picture
from experiments.paper.comparison_tables import (
    change,
    coverage_table,
    least_igd,
    models_compared,
    open_paragraphs,
    paired_tests_table,
    quality_table,
    runs_table,
    subject,
    times_table,
)
from experiments.published_values import TABLE_7
from experiments.runner.registry import Context
from experiments.runner.result import Finding, Picture, Result, significant
from experiments.runner.texts import paragraphs

__all__ = ["check_setting", "run"]

OURS = "AMP-MOPSO"

CONFIRMED = 0.5
"""An advantage agrees with the paper's if it is significant and at least this share of it."""

SETTING, LOST = paragraphs("table7")


def run(context: Context) -> Result:
    """Compare the three algorithms of Table 7 on both drive models, or what the setting names."""
    stated = context.setting.is_stated
    comparisons = compare(context, tuple(TABLE_7), "table7")
    paper = TABLE_7 if stated else {}
    quality = quality_table(comparisons, paper, list(_advantages(comparisons)) if stated else [])
    times = [_time_finding(comparisons[0])] if stated else []
    return Result(
        title=f"Table 7: {'three algorithms' if stated else 'open'}, {context.seeds_in_words}",
        command=context.comparison_command("table7"),
        answer="" if quality.findings else least_igd(comparisons),
        paragraphs=(SETTING,) if stated else open_paragraphs(context, comparisons),
        models=models_compared(comparisons),
        tables=(
            quality,
            *([at_the_stated_setting()] if stated else []),
            paired_tests_table(comparisons, subject(context, OURS)),
            coverage_table(comparisons),
            runs_table(comparisons),
            times_table(comparisons, paper, times, context.setting.evaluations),
        ),
        pictures=(
            *([table_7_picture()] if stated else []),
            Picture(
                "fronts",
                "As Fig. 18: for every algorithm the run of median IGD over the reference front.",
                fronts(comparisons),
            ),
            Picture("igd", "IGD of every run; bars mark the medians.", igd_of_runs(comparisons)),
        ),
        notes=(LOST, *(too_few_seeds(comparisons) if stated else ())),
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
            name = NAMES[indicator]
            sentence = (
                f"On {comparison.model}, after 100 x 100 evaluations, {OURS}'s mean {name} is "
                f"{' and '.join(clauses)}."
            )
            answers = comparison is comparisons[0] and indicator == "igd"
            yield Finding(confirmed, sentence, answers=answers)


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
