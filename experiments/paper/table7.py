"""Table 7 and Fig. 18: AMP-MOPSO against basic MOPSO and NSGA-II, beside other budgets."""

from __future__ import annotations

from dataclasses import replace

from experiments.paper.anytime.experiment import at_the_stated_setting, table_7_picture
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing import table7
from pymoo_hdte._comparing.named import check_setting
from pymoo_hdte._runner.result import Result

__all__ = ["check_setting", "run"]

(OTHERS,) = paragraphs("table7")


def run(context: Context) -> Result:
    """Compare the three algorithms of Table 7 on both drive models, or what the setting names."""
    comparisons = table7.run(context.setting, context.seeds_to_run, context.campaign)
    result = table7.result(context.setting, comparisons, "python -m experiments table7")
    if not context.setting.is_stated:
        return result
    quality, *others = result.tables
    return replace(
        result,
        paragraphs=(*result.paragraphs, OTHERS),
        tables=(quality, at_the_stated_setting(), *others),
        pictures=(table_7_picture(), *result.pictures),
        shown_first="",
    )
