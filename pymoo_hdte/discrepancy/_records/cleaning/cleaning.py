"""A campaign without faulty rows and with the noise that its records show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import norm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.cleaning.drift import without_drift
from pymoo_hdte.discrepancy._records.cleaning.faults import WINDOWS
from pymoo_hdte.discrepancy._records.cleaning.findings import (
    FAILED,
    NoiseFinding,
    RowFault,
    RowFindings,
)
from pymoo_hdte.discrepancy._records.cleaning.noise_estimate import (
    coarse_readings,
    repeatability,
    running_noise,
    sweep_noise,
    with_noise,
)
from pymoo_hdte.discrepancy._records.cleaning.repair import (
    RUNNING,
    RepairedRun,
    repaired_run,
    repaired_sweep,
)
from pymoo_hdte.discrepancy._records.cleaning.session_zero import with_one_zero
from pymoo_hdte.discrepancy._records.cleaning.settling import SETTLED, unsettled_rows
from pymoo_hdte.discrepancy._records.line_basis import mean_speed
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules


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

    Raises
    ------
    InvalidInput
        For a record in which a channel fails, if too few were left without it.
    """
    n_rows = sum(len(one.time) for one in campaign.running)
    n_rows += sum(len(one.time) for one in campaign.torsion)
    # Every row is compared as a spike, and as a jump in each window and in the whole record.
    tests = n_rows * len(RUNNING) * (2 + len(WINDOWS))
    deviations = float(norm.isf(rules.row_fault_chance / tests / 2.0))
    ratio = campaign.believed.ratio
    runs = [repaired_run(one, ratio, orders, deviations, rules) for one in campaign.running]
    sweeps = [repaired_sweep(one, deviations, rules) for one in campaign.torsion]
    left_out = _left_out(runs, rules)
    kept = [one for one in runs if one.record.name not in left_out]
    _check_failed(kept)
    records = _unsettled([one.record for one in kept], rules)
    shown = _noise(campaign, kept, [record for record, _ in sweeps], rules)
    read, of_readings = coarse_readings(records, shown, campaign.rig, ratio, rules)
    drifts = [one.drifts for one in kept]
    steady, drifting, zeros = without_drift(read, drifts, campaign.rig, ratio, rules)
    noise = (*of_readings, *zeros)
    rig = with_noise(campaign.rig, noise)
    running, new_zero = with_one_zero(steady, campaign.believed, rig, rules)
    changed: dict[str, Any] = {
        "running": running,
        "torsion": tuple(record for record, _ in sweeps),
        "rig": rig,
    }
    if any(not _same(getattr(campaign, name), value) for name, value in changed.items()):
        campaign = replace(campaign, **changed, rules=rules)
    faults = [fault for one in runs for fault in one.faults]
    pairs = zip(records, kept, strict=True)
    faults += [_hidden_decay(one) for one, own in pairs if one is not own.record]
    faults += [fault for _, found in sweeps for fault in found]
    final = [_final(fault, left_out) for fault in (*faults, *drifting)]
    return campaign, RowFindings(n_rows, (*final, *new_zero), left_out, noise)


def _unsettled(records: Sequence[RunningRecord], rules: Rules) -> list[RunningRecord]:
    """Return records that all begin with a decay if several plainly do.

    Where it is not clear of the noise, the slow lines take the most of it: in a short record. It
    lasts for a time, or for a way of the input, as a hysteresis does: what differs less.
    """
    known = [one for one in records if one.settling is not None]
    if len(known) < rules.fewest_unsettled:
        return list(records)
    times = np.array([one.settling for one in known], dtype=float)
    ways = times * [mean_speed(one) for one in known]
    of_time = np.std(np.log(times)) <= np.std(np.log(ways))
    usual = float(np.median(times if of_time else ways))
    found = []
    for one in records:
        lasting = usual if of_time else usual / mean_speed(one)
        short = lasting <= rules.longest_settling * float(np.ptp(one.time))
        found.append(replace(one, settling=lasting) if one.settling is None and short else one)
    return found


def _hidden_decay(record: RunningRecord) -> RowFault:
    """Return what is said of a record that is taken to begin with a decay, as others do."""
    length = SETTLED * (record.settling or 0.0)
    rows = unsettled_rows(record)
    return RowFault(record.name, "settling", "rows", 0, rows, length, "modelled")


def _same(old: object, new: object) -> bool:
    """Return whether nothing was replaced in a tuple of records, or in a rig."""
    if isinstance(old, tuple) and isinstance(new, tuple):
        return len(old) == len(new) and all(a is b for a, b in zip(old, new, strict=True))
    return old is new


def _noise(
    campaign: Campaign,
    runs: Sequence[RepairedRun],
    sweeps: Sequence[TorsionRecord],
    rules: Rules,
) -> tuple[NoiseFinding, ...]:
    rig, believed = campaign.rig, campaign.believed
    records = [one.record for one in runs]
    residuals = [one.residual for one in runs]
    return (
        *running_noise(records, residuals, rig, believed.ratio, rules),
        *sweep_noise(sweeps, rig, rules),
        repeatability(records, believed, rig, rules),
    )


def _left_out(runs: Sequence[RepairedRun], rules: Rules) -> tuple[str, ...]:
    """Return the records that cannot be repaired, unless too few would be left to fit."""
    lost = [one.record for one in runs if not one.usable]
    train = [one.record for one in runs if one.record.role == "train"]
    if len(train) - sum(one.role == "train" for one in lost) < rules.fewest_records:
        lost = [one for one in lost if one.role != "train"]
    return tuple(one.name for one in lost)


def _check_failed(kept: Sequence[RepairedRun]) -> None:
    """Refuse a record that cannot be left out and in which a channel has failed for too long."""
    for one in kept:
        failed = [fault for fault in one.faults if fault.kind in FAILED]
        if failed and not one.usable:
            rows = f"{failed[0].rows} rows from row {failed[0].row + 1} on"
            field = f"{one.record.name}: {failed[0].channel} in {rows}"
            allowed = "a reading that changes; without this record too few are left"
            word = "always" if failed[0].kind == "stuck" else "saturated at"
            raise InvalidInput(field, f"{word} {failed[0].size:g}", allowed)


def _final(fault: RowFault, left_out: Sequence[str]) -> RowFault:
    return replace(fault, treatment="left out") if fault.record in left_out else fault
