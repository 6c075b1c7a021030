"""Rules for rows of a record that are faulty, and for a stated noise that the rows contradict."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.thresholds.fields import BY_HAND, RuleSet, rule


@dataclass(frozen=True, kw_only=True)
class RowRules(RuleSet):
    """Thresholds for spikes, jumps, lost rows and the noise of the sensors.

    See `rules.Rules`, which has them all.
    """

    row_fault_chance: float = rule(
        1e-3,
        "probability",
        "Chance that noise alone shows any spike, jump or decay in a whole campaign, or a wrong "
        "noise.",
        "Test level by the normal distribution: all rows of all channels share the chance "
        "(Bonferroni), which takes 6.4 standard deviations at 100,000 rows.",
        at_most=1.0,
    )
    fault_prominence: float = rule(
        2.0,
        "ratio",
        "A spike, a jump or a decay stands out of the largest similar changes of its record, those "
        "that are too many to be faults, by this factor.",
        f"{BY_HAND}: a motion that is rough in some rows, as rattling is, is rough in many. The "
        "hundredth row of normal noise lies at 2.6 standard deviations, so that pure noise never "
        "comes into question.",
        at_least=1.0,
    )
    spike_share: float = rule(
        0.01,
        "share of the rows",
        "Most rows of a record that may be spikes; more are a motion.",
        f"{BY_HAND}: a drive that hits a stop once an input turn does so in one of 30 to 200 rows.",
        at_most=0.5,
    )
    longest_spike: int = rule(
        3,
        "rows",
        "A spike has no more rows than this.",
        f"{BY_HAND}: a false reading lasts one sample, which a filter spreads a little; a motion "
        "lasts longer.",
    )
    most_jumps: int = rule(
        3,
        "1",
        "Most jumps of a sensor in one record; more are a motion.",
        f"{BY_HAND}: a sensor that jumps more often has to be repaired first.",
    )
    stuck_rows: int = rule(
        30,
        "rows",
        "A channel of a running record may have failed where it stays the same for at least so "
        "many rows.",
        "Test level: a reading that changes in every other row by chance stays the same that long "
        "with a chance of 2^-30, which is 1e-3 in a million rows.",
    )
    stuck_ratio: float = rule(
        10.0,
        "ratio",
        "It has, if that is this multiple of the longest that it stays the same elsewhere, and "
        "that at most `most_jumps` times.",
        "Simulation: of 12,600 sound readings in counts (sines, ramps and walks, with noise of up "
        "to a count) two came into question by both ratios; with this one alone flickers beside a "
        "long rest did.",
        at_least=1.0,
    )
    changing_share: float = rule(
        0.5,
        "share of the rows",
        "And if at least this share of the other rows, `stuck_rows` or more, differ from the row "
        "before. Readings of coarser steps are not examined.",
        "Simulation: in the same readings. Of 400 channels that stood still for 300 of 3000 rows, "
        "with noise of a count or more, all were found.",
        at_most=1.0,
    )
    saturated_share: float = rule(
        0.5,
        "share of the rows",
        "Most rows of a record in which a channel may be at the end of its range, or nearly; "
        "they are left out, and with more of them the record is.",
        f"{BY_HAND}: where noise alone takes a tenth of the rows to the end of the range, "
        "half of all are there or beside; the mean of the others is then too low by a fifth of a "
        "deviation of the noise.",
        at_most=1.0,
    )
    longest_settling: float = rule(
        0.1,
        "share of the record",
        "A decay at the first rows of a record counts as settling up to this time constant.",
        f"{BY_HAND}: three time constants leave two thirds of the record to the steady motion; "
        "what takes longer is a drift, which a straight line and the slow lines follow.",
        at_most=0.3,
    )
    fewest_unsettled: int = rule(
        2,
        "records",
        "From so many records on that plainly begin unsettled all are taken to do so.",
        f"{BY_HAND}: one record may be started in haste; two show how a session was run. A record "
        "that had settled loses next to nothing by one more unknown.",
    )
    gap_of_rows: float = rule(
        1.5,
        "time steps",
        "A longer step of time from one row to the next is a gap.",
        "Resolution: halfway between no row lost and one.",
        at_least=1.0,
    )
    noise_mismatch: float = rule(
        1.05,
        "ratio of standard deviations",
        "The noise that the rows show replaces the stated one if their ratio is larger, or smaller "
        "than the inverse, and differs from 1 significantly.",
        f"{BY_HAND}: up to here chi-square is off by at most 10 %, which takes an adequate model "
        "of 1400 degrees of freedom no further than two thirds of the way to a false alarm.",
        at_least=1.0,
    )
