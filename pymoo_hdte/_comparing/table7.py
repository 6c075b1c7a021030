"""Table 7 and Fig. 18: AMP-MOPSO against basic MOPSO and NSGA-II, or others on other problems."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pymoo_hdte._comparing.indicators import NAMES
from pymoo_hdte._comparing.paired import Comparison, compare, too_few_seeds
from pymoo_hdte._comparing.pictures import front_pictures, run_pictures
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.setting import Setting, in_words
from pymoo_hdte._comparing.tables import (
    answer,
    change,
    coverage_table,
    models_compared,
    open_paragraphs,
    paired_tests_table,
    quality_table,
    question,
    runs_table,
    subject,
    times_table,
)
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import Finding, Result, significant

OURS = "AMP-MOPSO"

CONFIRMED = 0.5
"""An advantage agrees with the paper's if it is significant and at least this share of it: it is
nearer to the paper's than to none."""
SAME_TIME = 1.1
"""Slowest over fastest mean time that counts as the same, set by hand: three times the 3.3 % by
which the paper's times differ."""

SETTING = """\
Every run spends 100 x 100 evaluations, the budget that the paper states; what is found holds for \
this budget alone. Means and standard deviations are exact here; the paper takes them from 1,000 \
samples. The final set holds at most 50 designs, for NSGA-II its non-dominated population thinned \
by the crowding truncation that the archives use. IGD and Spacing come from pymoo, with ideal and \
nadir point of the true front of the order-3 surrogate, which none of the compared algorithms \
produced. The paper names neither its reference front nor its normalisation, so ratios can be \
compared with it, but not the values themselves; an advantage counts as agreeing if it is \
significant and at least half of what the paper prints."""
LOST = """\
A piece of the front (parts separated by a gap above 0.02) counts as lost when no solution lies \
within 0.05 of it, both in normalised objectives. Spacing alone misleads: a front crowded into one \
corner has a good one."""


def run(setting: Setting, seeds: range, campaign: Campaign) -> list[Comparison]:
    """Run the algorithms of Table 7 on both drive models, or what the setting names."""
    return compare(setting, seeds, campaign, tuple(TABLE_7), "table7")


def result(setting: Setting, comparisons: Sequence[Comparison], program: str) -> Result:
    """Return tables and pictures of the comparisons, with the paper's numbers at its setting.

    Parameters
    ----------
    setting : Setting
        As the comparisons were made.
    comparisons : sequence of Comparison
        From `run`.
    program : str
        Which the command line of the same comparison begins with.
    """
    stated, seeds = setting.is_stated, comparisons[0].seeds
    paper = TABLE_7 if stated else {}
    quality = quality_table(comparisons, paper, list(_advantages(comparisons)) if stated else [])
    times = [_time_finding(comparisons[0])] if stated else []
    tested = subject(setting, OURS)
    fronts = front_pictures(comparisons, "Fig. 18" if stated else "")
    what = "Table 7: three algorithms" if stated else _title(setting, comparisons)
    return Result(
        title=f"{what}, {in_words(seeds)}",
        command=setting.command(program, seeds),
        question="" if stated else question(setting, comparisons),
        answer="" if quality.findings else answer(comparisons, seeds),
        paragraphs=(SETTING,) if stated else open_paragraphs(setting, comparisons),
        models=models_compared(comparisons),
        tables=(
            quality,
            paired_tests_table(comparisons, tested),
            coverage_table(comparisons),
            runs_table(comparisons),
            times_table(comparisons, paper, times, setting.evaluations),
        ),
        pictures=(*fronts, *run_pictures(comparisons, setting, tested)),
        notes=(LOST, *(too_few_seeds(comparisons) if stated else ())),
        shown_first=fronts[0].name,
    )


def _title(setting: Setting, comparisons: Sequence[Comparison]) -> str:
    names = ", ".join(comparisons[0].algorithms)
    return f"{names} on {', '.join(setting.problems)}"


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
        spread < SAME_TIME,
        f"On {comparison.model}, {OURS} takes {significant(ours[OURS], 2)} s a run against "
        f"{TABLE_7[OURS].seconds} s in the paper, and the slowest algorithm takes "
        f"{significant(spread, 2)} times as long as the fastest (paper: "
        f"{significant(paper_spread, 3)}).",
    )
