"""Fig. 17: what the pyramid and the entropy weight each contribute to AMP-MOPSO."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.named import check_setting
from pymoo_hdte._comparing.paired import Comparison, compare, too_few_seeds
from pymoo_hdte._comparing.pictures import front_pictures, run_pictures
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.setting import in_words
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
)
from pymoo_hdte._runner.result import Finding, Result, significant

__all__ = ["check_setting", "run"]

FULL = "AMP-MOPSO"
PARTS = (FULL, "A-MOPSO", "MP-MOPSO", "MOPSO")


SETTING, FLOWCHART = paragraphs("ablation")


def run(context: Context) -> Result:
    """Compare AMP-MOPSO with variants that lack strategies, or what the setting names."""
    stated = context.setting.is_stated
    setting, seeds = context.setting, context.seeds_to_run
    comparisons = compare(setting, seeds, context.campaign, PARTS, "ablation")
    findings = [list(find(comparisons)) if stated else [] for find in (_evenness, _gaps)]
    return Result(
        title=f"Fig. 17: ablation of AMP-MOPSO{'' if stated else ', open'}, {in_words(seeds)}",
        command=context.comparison_command("ablation"),
        question="" if stated else question(setting, comparisons),
        answer=_answer([*findings[0], *findings[1]])
        if any(findings)
        else answer(comparisons, seeds),
        paragraphs=(SETTING, FLOWCHART) if stated else open_paragraphs(setting, comparisons),
        models=models_compared(comparisons),
        tables=(
            quality_table(comparisons, TABLE_7 if stated else {}, findings[0]),
            coverage_table(comparisons, findings[1]),
            paired_tests_table(comparisons, subject(setting, FULL)),
            runs_table(comparisons),
        ),
        pictures=(
            *front_pictures(comparisons, "Fig. 17" if stated else ""),
            *run_pictures(comparisons, setting, subject(setting, FULL)),
        ),
        notes=too_few_seeds(comparisons) if stated else (),
    )


def _answer(findings: Sequence[Finding]) -> str:
    """Say how many parts make the difference that the paper shows, then the findings."""
    shown = sum(finding.agrees for finding in findings)
    first = (
        f"Of the {len(findings)} differences that the paper shows, {shown or 'none'} came out "
        "when the pyramid or the entropy weight was left out."
    )
    return " ".join([first, *(finding.sentence for finding in findings)])


def _gaps(comparisons: Sequence[Comparison]) -> Iterator[Finding]:
    """Whether a gap opens in the front without the pyramid, as Fig. 17b shows."""
    for comparison in comparisons:
        if len(comparison.truth.pieces) < 2:
            continue
        seeds = len(comparison.values(FULL, "lost_pieces"))
        full, without = (
            int((comparison.values(name, "lost_pieces") > 0).sum()) for name in (FULL, "A-MOPSO")
        )
        yield Finding(
            without > full,
            f"On {comparison.model}, {without} of {seeds} runs without the pyramid (A-MOPSO) lose "
            f"a piece of the front against {full} of {seeds} with it; the paper shows a gap in the "
            "middle of A-MOPSO's front.",
            answers=True,
        )


def _evenness(comparisons: Sequence[Comparison]) -> Iterator[Finding]:
    """Whether the front is less even without the entropy weight, as Fig. 17c shows."""
    for comparison in comparisons:
        if not comparison.can_be_judged:
            continue
        tests = {test.rival: test for test in comparison.paired_tests(FULL, "spacing")}
        test = tests["MP-MOPSO"]
        full = np.median(comparison.values(FULL, "spacing"))
        without = np.median(comparison.values("MP-MOPSO", "spacing"))
        word = "significant" if test.significant else "not significant"
        yield Finding(
            test.significant and test.better > 0.5,
            f"On {comparison.model}, median Spacing without the entropy weight (MP-MOPSO) is "
            f"{change(full, without)} AMP-MOPSO's, {word} (p = {significant(test.p, 2)}); the "
            "paper shows a less even front.",
            answers=True,
        )
