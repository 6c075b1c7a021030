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
from pymoo_hdte.discrepancy._records.cleaning.spikes_and_jumps import WINDOWS
from pymoo_hdte.discrepancy._records.line_basis import mean_speed
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules


def cleaned_rows(
    campaign: Campaign, orders: Sequence[float], rules: Rules = RULES
) -> tuple[Campaign, RowFindings]:
    """Return a campaign without faulty rows and with its real noise, and what was wrong with it.

    Parameters
    ----------
    campaign : Campaign
    orders : sequence of float
        Lines that are fitted to the running records first, cycles per input turn.
    rules : Rules

    Returns
    -------
    campaign : Campaign
        The same object if nothing was found.
    findings : RowFindings

    Raises
    ------
    InvalidInput
        If a channel fails in a record without which too few are left.
    """
    n_rows = sum(len(record.time) for record in campaign.running)
    n_rows += sum(len(record.time) for record in campaign.torsion)
    # Every row is compared as a spike, and as a jump in each window and in the whole record.
    tests = n_rows * len(RUNNING) * (2 + len(WINDOWS))
    deviations = float(norm.isf(rules.row_fault_chance / tests / 2.0))
    ratio = campaign.believed.ratio
    runs = [repaired_run(record, ratio, orders, deviations, rules) for record in campaign.running]
    faults = [fault for run in runs for fault in run.faults]
    if ends := {(fault.channel, fault.size) for fault in faults if fault.kind == "saturated"}:
        runs = [
            repaired_run(record, ratio, orders, deviations, rules, ends)
            if record.samples_averaged > 1
            else run
            for record, run in zip(campaign.running, runs, strict=True)
        ]
    sweeps = [repaired_sweep(sweep, deviations, rules) for sweep in campaign.torsion]
    left_out = _left_out(runs, rules)
    runs_used = [run for run in runs if run.record.name not in left_out]
    _check_failed(runs_used)
    records = _unsettled([run.record for run in runs_used], rules)
    shown = _noise(campaign, runs_used, [record for record, _ in sweeps], rules)
    read, of_readings = coarse_readings(records, shown, campaign.rig, ratio, rules)
    drifts = [run.drifts for run in runs_used]
    steady, drifting, zeros = without_drift(read, drifts, campaign.rig, ratio, rules)
    noise = (*of_readings, *zeros)
    rig = with_noise(campaign.rig, noise)
    running, new_zero = with_one_zero(steady, campaign.believed, rig, rules)
    changed: dict[str, Any] = {
        "running": running,
        "torsion": tuple(record for record, _ in sweeps),
        "rig": rig,
    }
    if any(not _unchanged(getattr(campaign, name), value) for name, value in changed.items()):
        campaign = replace(campaign, **changed, rules=rules)
    faults = [fault for run in runs for fault in run.faults]
    pairs = zip(records, runs_used, strict=True)
    faults += [_hidden_decay(record) for record, run in pairs if record is not run.record]
    faults += [fault for _, sweep_faults in sweeps for fault in sweep_faults]
    final = [_with_treatment(fault, left_out) for fault in (*faults, *drifting)]
    return campaign, RowFindings(n_rows, (*final, *new_zero), left_out, noise)


def _unsettled(records: Sequence[RunningRecord], rules: Rules) -> list[RunningRecord]:
    """Return records that all begin with a decay, if several of them clearly do.

    A short record hides it, because its slow lines absorb most of the decay. Its constant is a
    time, or a travel of the input as for a hysteresis, whichever varies less between the records.
    """
    unsettled = [record for record in records if record.settling is not None]
    if len(unsettled) < rules.fewest_unsettled:
        return list(records)
    times = np.array([record.settling for record in unsettled], dtype=float)
    ways = times * [mean_speed(record) for record in unsettled]
    of_time = np.std(np.log(times)) <= np.std(np.log(ways))
    usual = float(np.median(times if of_time else ways))
    with_decay = []
    for record in records:
        constant = usual if of_time else usual / mean_speed(record)
        short = constant <= rules.longest_settling * float(np.ptp(record.time))
        with_decay.append(
            replace(record, settling=constant) if record.settling is None and short else record
        )
    return with_decay


def _hidden_decay(record: RunningRecord) -> RowFault:
    """Return the entry of a record that is taken to begin with a decay because others do."""
    length = SETTLED * (record.settling or 0.0)
    rows = unsettled_rows(record)
    return RowFault(record.name, "settling", "rows", 0, rows, length, "modelled")


def _unchanged(old: object, new: object) -> bool:
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
    records = [run.record for run in runs]
    residuals = [run.residual for run in runs]
    return (
        *running_noise(records, residuals, rig, believed.ratio, rules),
        *sweep_noise(sweeps, rig, rules),
        repeatability(records, believed, rig, rules),
    )


def _left_out(runs: Sequence[RepairedRun], rules: Rules) -> tuple[str, ...]:
    """Return the records that cannot be repaired, unless too few would be left to fit."""
    lost = [run.record for run in runs if not run.usable]
    train = [run.record for run in runs if run.record.role == "train"]
    if len(train) - sum(record.role == "train" for record in lost) < rules.fewest_records:
        lost = [record for record in lost if record.role != "train"]
    return tuple(record.name for record in lost)


def _check_failed(runs: Sequence[RepairedRun]) -> None:
    """Refuse a record that cannot be left out and in which a channel has failed for too long."""
    for run in runs:
        failed = [fault for fault in run.faults if fault.kind in FAILED]
        if failed and not run.usable:
            rows = f"{failed[0].rows} rows from row {failed[0].row + 1} on"
            field = f"{run.record.name}: {failed[0].channel} in {rows}"
            allowed = "a reading that changes; without this record too few are left"
            word = "always" if failed[0].kind == "stuck" else "saturated at"
            raise InvalidInput(field, f"{word} {failed[0].size:g}", allowed)


def _with_treatment(fault: RowFault, left_out: Sequence[str]) -> RowFault:
    return replace(fault, treatment="left out") if fault.record in left_out else fault
