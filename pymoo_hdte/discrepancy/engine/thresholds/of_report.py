"""Rules for what a report flags, how it describes a misfit, and what it shows as certain."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.thresholds.fields import BY_HAND, RuleSet, rule


def _counted(right: int, of: int, verdict: str, truth: str) -> float:
    """Return a rule for the share of verdicts that turned out right."""
    return rule(
        (right + 1) / (of + 2),
        "probability",
        f"Of verdicts that are {verdict}, the share of which {truth}, where the evidence leaves no "
        "doubt.",
        f"Simulation: {right} of {of} on the first cases of seed 777 of the blind campaign, on the "
        "shared cases and on the blind cases 889 to 1056, which were run once; one more of either "
        "kind is assumed (Laplace's rule of succession).",
        at_most=1.0,
    )


@dataclass(frozen=True, kw_only=True)
class ReportRules(RuleSet):
    """Thresholds of the map of the misfit, of the proof and of the next test.

    See `rules.Rules`, which has them all.
    """

    # Where is the model wrong?
    false_discovery_rate: float = rule(
        0.01,
        "share of the flagged cells",
        "Share of the flagged cells of the map that may be clean, and the chance with which a "
        "clean torsion sweep is flagged.",
        "Test level of Benjamini and Hochberg (J. R. Stat. Soc. B 57, 1995); it holds for the "
        "positive dependence that shared parameters give cells (Benjamini and Yekutieli, Annals "
        "of Statistics 29, 2001).",
        at_most=1.0,
    )

    # Of what kind is the misfit?
    slow_share: float = rule(
        0.1,
        "share of the misfit",
        "A misfit shows at speed only if the slower half of the records has no more of it.",
        f"{BY_HAND}.",
        at_least=0.0,
        at_most=1.0,
    )
    caused_share: float = rule(
        0.25,
        "share of the power",
        "A misfit is caused by another one if no more of it remains when that one is taken out.",
        f"{BY_HAND}: half of the amplitude.",
        at_least=0.0,
        at_most=1.0,
    )
    growth_ratio: float = rule(
        1.25,
        "ratio of amplitudes",
        "A misfit grows or falls with speed or load if a regression over all records gives it, at "
        "one end of the condition, this multiple of its amplitude at the other; below, it hardly "
        "changes.",
        f"{BY_HAND}: a change of a fifth is what a reader would not call the same.",
        at_least=1.0,
    )
    growth_chance: float = rule(
        0.01,
        "probability",
        "Chance that a misfit that does not change with speed or load is said to do so.",
        "Test level of Student's distribution, two-sided, for the slope of the regression; the "
        "interval with which a change that matters is excluded has the same level.",
        at_most=1.0,
    )
    fixed_frequency_width: float = rule(
        0.02,
        "relative",
        "Frequencies of different records are one if they differ by less.",
        f"{BY_HAND}: the resolution of a record of fifty periods.",
        at_most=1.0,
    )
    fixed_frequency_range: float = rule(
        0.1,
        "share of the largest speed",
        "Least range of the speeds at which a line of one frequency is told from one of an order.",
        f"{BY_HAND}: five times `fixed_frequency_width`, within which both look alike.",
        at_least=0.0,
        at_most=1.0,
    )
    fixed_frequency_records: int = rule(
        3,
        "1",
        "Least number of records of different speeds that make a frequency a fixed one.",
        f"{BY_HAND}: two may share a frequency by chance.",
    )
    broad_band_lines: float = rule(
        8.0,
        "lines",
        "A band is broad if more lines share its power.",
        f"{BY_HAND}: one line that leaks fills two.",
    )

    # Which questions can these records not answer?
    one_speed_ratio: float = rule(
        1.1,
        "ratio",
        "Records run at one speed if the largest exceeds the smallest by no more.",
        f"{BY_HAND}.",
        at_least=1.0,
    )
    one_load_range: float = rule(
        0.1,
        "share of the largest load",
        "Records carry one load if their range is no larger.",
        f"{BY_HAND}.",
        at_least=0.0,
        at_most=1.0,
    )
    undetermined_share: float = rule(
        0.8,
        "share of the width between the bounds",
        "An interval that is wider is shown as all between the bounds: they gave it, and not the "
        "records. Intervals of effects lie around what is to be expected in the middle of it.",
        "A uniform distribution between the bounds has a standard deviation of 0.289 times their "
        "width, and so a normal interval of 1.13 times it. Records that leave more than 0.8 have "
        "not halved its variance.",
        at_most=1.0,
    )

    # What does the proof say, and what is to be measured next?
    least_gap_share: float = rule(
        0.1,
        "share of the noise floor",
        "A gap that exceeds the noise floor by no more cannot be said to shrink.",
        f"{BY_HAND}: the floor is no better known, and the quotient would be of two small numbers.",
        at_least=0.0,
    )
    worse_share: float = rule(
        0.05,
        "share of the noise floor",
        "A gap that the correction makes larger by more is said to have become worse.",
        f"{BY_HAND}: below, both gaps print as the same number.",
        at_least=0.0,
    )
    separated_chi_square: float = rule(
        9.0,
        "chi-square",
        "Least expected chi-square at which a test tells two models apart.",
        "Test level: three standard deviations of one degree of freedom, a chance of 0.3 %.",
    )
    nearest_rival_ratio: float = rule(
        4.0,
        "ratio of chi-squares",
        "Of a mechanism, other explanations that leave up to this multiple of what the chosen one "
        "leaves are to be told from it by the next test.",
        f"{BY_HAND}: twice the amplitude.",
        at_least=1.0,
    )
    offered_share: float = rule(
        0.05,
        "share of what the named effect leaves",
        "Least share that a second effect removes to be mentioned though it is not named.",
        f"{BY_HAND}, equal to `second_form_share`.",
        at_least=0.0,
        at_most=1.0,
    )

    # How probable is what is said?
    named_right: float = _counted(110, 112, "named (or of a parameter)", "all its names are true")
    class_right: float = _counted(31, 33, "of a class", "the truth is in the class")
    partial_right: float = _counted(20, 24, "partial", "all its names are true")
    adequate_right: float = _counted(38, 38, "that nothing is missing", "nothing is")
