"""A campaign without faulty rows and with the noise that its records show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scipy.stats import norm

from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.campaign.noise_estimate import (
    repeatability,
    running_noise,
    sweep_noise,
    with_noise,
)
from pymoo_hdte.discrepancy.campaign.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy.campaign.row_faults import WINDOWS
from pymoo_hdte.discrepancy.campaign.row_findings import RowFault, RowFindings
from pymoo_hdte.discrepancy.campaign.row_repair import (
    RUNNING,
    Repaired,
    repaired_run,
    repaired_sweep,
)
from pymoo_hdte.discrepancy.engine.rules import RULES, Rules


def examined_rows(
    campaign: Campaign, orders: Sequence[float], rules: Rules = RULES
) -> tuple[Campaign, RowFindings]:
    """Return a campaign that can be believed row by row, and what was wrong with it.

    Parameters
    ----------
    campaign : Campaign
    orders : sequence of float
        Lines that are taken out of the running records first, cycles per input turn.
    rules : Rules

    Returns
    -------
    campaign : Campaign
        The same object if nothing was found.
    findings : RowFindings
    """
    n_rows = sum(len(record.time) for record in (*campaign.running, *campaign.torsion))
    # Every row is compared as a spike, and as a jump in each window and in the whole record.
    tests = n_rows * len(RUNNING) * (2 + len(WINDOWS))
    deviations = float(norm.isf(rules.row_fault_chance / tests / 2.0))
    ratio = campaign.believed.ratio
    runs = [repaired_run(one, ratio, orders, deviations, rules) for one in campaign.running]
    sweeps = [repaired_sweep(one, deviations, rules) for one in campaign.torsion]
    left_out = _left_out(runs, rules)
    kept = [one for one in runs if one.record.name not in left_out]
    repaired = _with_records(campaign, kept, sweeps, rules)
    fitted = [one for one in kept if one.residual is not None]
    noise = (
        *running_noise(
            [one.record for one in fitted],
            [one.residual for one in fitted],
            campaign.rig,
            ratio,
            rules,
        ),
        *sweep_noise(repaired.torsion, campaign.rig, rules),
        repeatability(repaired.running, campaign.believed, campaign.rig, rules),
    )
    rig = with_noise(campaign.rig, noise)
    if rig is not campaign.rig:
        repaired = replace(repaired, rig=rig, rules=rules)
    faults = [_final(fault, left_out) for one in (*runs, *sweeps) for fault in one.faults]
    return repaired, RowFindings(n_rows, tuple(faults), left_out, noise)


def _left_out(runs: Sequence[Repaired], rules: Rules) -> tuple[str, ...]:
    """Return the records that cannot be repaired, unless too few would be left to fit."""
    lost = [one.record for one in runs if not one.usable]
    train = [one.record for one in runs if one.record.role == "train"]
    if len(train) - sum(one.role == "train" for one in lost) < rules.fewest_records:
        lost = [one for one in lost if one.role != "train"]
    return tuple(one.name for one in lost)


def _with_records(
    campaign: Campaign, runs: Sequence[Repaired], sweeps: Sequence[Repaired], rules: Rules
) -> Campaign:
    running: tuple[RunningRecord, ...] = tuple(one.record for one in runs)
    torsion: tuple[TorsionRecord, ...] = tuple(one.record for one in sweeps)
    before, after = (*campaign.running, *campaign.torsion), (*running, *torsion)
    if len(before) == len(after) and all(a is b for a, b in zip(before, after, strict=True)):
        return campaign
    return replace(campaign, running=running, torsion=torsion, rules=rules)


def _final(fault: RowFault, left_out: Sequence[str]) -> RowFault:
    return replace(fault, treatment="left out") if fault.record in left_out else fault
