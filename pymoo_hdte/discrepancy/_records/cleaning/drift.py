"""A torque sensor whose zero drifts within the records, as the straight line of each one shows.

A steady motion has no straight line in its torques. A load that rises or falls moves both torques
and is a motion; a torque that moves alone, by more than its stated zero, is a sensor that drifts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.cleaning.findings import NoiseFinding, RowFault
from pymoo_hdte.discrepancy._records.cleaning.spikes_and_jumps import scatter
from pymoo_hdte.discrepancy._records.line_basis import LineFit, centred
from pymoo_hdte.discrepancy._records.records import ReadingError, RunningRecord
from pymoo_hdte.discrepancy._selection.rules import Rules

Values = NDArray[np.float64]

TORQUES = ("input_torque", "output_torque")

_PARTS = 16
"""Parts of a record whose means show other slow changes, such as waves of a few cycles a turn."""


def torque_drifts(fit: LineFit, residual: Values, deviations: float, rules: Rules) -> Values:
    """Return the rise of each torque on a straight line over a record, N.m, shape (2,).

    It is zero where it does not exceed the noise and other slow changes, such as waves of the
    output turn.

    Parameters
    ----------
    fit : LineFit
        Fit of the order lines.
    residual : ndarray, shape (n, 4)
        Residual of the fit.
    deviations : float
        Least size of a drift in its standard deviations.
    rules : Rules
    """
    length = float(np.ptp(fit.record.time))
    rises = fit.coefficients[1, 1:3] * length
    spread = length * float(np.linalg.norm(np.linalg.inv(fit.triangle)[1]))
    torques = residual[:, 1:3]
    noise = spread * np.array([scatter(rows) for rows in torques.T])
    means = np.array([part.mean(axis=0) for part in np.array_split(torques, _PARTS)])
    least = np.maximum(deviations * noise, rules.fault_prominence * np.ptp(means, axis=0))
    return np.where(np.abs(rises) > least, rises, 0.0)


def without_drift(
    records: Sequence[RunningRecord],
    drifts: Sequence[Values | None],
    rig: Rig,
    ratio: float,
    rules: Rules,
) -> tuple[list[RunningRecord], list[RowFault], list[NoiseFinding]]:
    """Return records without the drift of a torque sensor, the drifts, and the zeros beside them.

    Nobody knows when in a record the zero was right: in its middle it may be off by half the drift.
    What most records share of that makes the stated zero more uncertain. Nor need the drift be as
    straight as the line that is taken out (`ReadingError.bent`).

    Parameters
    ----------
    records : sequence of RunningRecord
    drifts : sequence of ndarray, shape (2,), or None
        Results of `torque_drifts`; None where they are unknown.
    rig : Rig
        What is stated.
    ratio : float
        Transmission ratio N, dimensionless.
    rules : Rules

    Returns
    -------
    records : list of RunningRecord
        The same objects if nothing drifts.
    faults : list of RowFault
    zeros : list of NoiseFinding
        Stated zeros that are replaced.
    """
    known = [np.zeros(2) if rises is None else rises for rises in drifts]
    sizes = np.array([_sensor_drifts(rises, rig, ratio, rules) for rises in known]).reshape(-1, 2)
    steady, faults, zeros = list(records), list[RowFault](), list[NoiseFinding]()
    for channel, rises in zip(TORQUES, sizes.T, strict=True):
        if not rises.any():
            continue
        shared = float(np.median(rises))
        steady = [
            _without_rise(record, channel, rise, shared)
            for record, rise in zip(steady, rises.tolist(), strict=True)
        ]
        faults += [
            RowFault(record.name, "drift", channel, 0, len(record.time), rise, "modelled")
            for record, rise in zip(records, rises.tolist(), strict=True)
            if rise
        ]
        name = f"{channel}_zero"
        stated = float(getattr(rig, name))
        used = float(np.hypot(stated, shared / 2.0))
        if used > rules.noise_mismatch * stated:
            reason = f"half of its drift in {np.count_nonzero(rises)} records"
            zeros.append(NoiseFinding(name, stated, abs(shared) / 2.0, used, reason))
    return steady, faults, zeros


def _sensor_drifts(rises: Values, rig: Rig, ratio: float, rules: Rules) -> tuple[float, float]:
    """Return how much of the rise of each torque is a drift of its sensor, N.m."""
    of_input, of_output = float(rises[0]) * ratio, float(rises[1])
    apart = of_input - of_output
    larger = max(abs(of_input), abs(of_output))
    # With friction that grows with the load the input follows it by more than 1 / N.
    if not rules.fault_prominence * abs(apart) > larger:
        return 0.0, 0.0
    if abs(of_input) > abs(of_output):
        size = apart / ratio
        return (size if abs(size) > rig.input_torque_zero else 0.0), 0.0
    return 0.0, (-apart if abs(apart) > rig.output_torque_zero else 0.0)


def _without_rise(record: RunningRecord, channel: str, rise: float, shared: float) -> RunningRecord:
    """Return a record without its drift, whose zero may differ from that of other records."""
    if rise:
        share = centred(record, slice(None)) / float(np.ptp(record.time))
        record = replace(record, **{channel: getattr(record, channel) - rise * share})
    error = ReadingError(channel, abs(rise - shared) / 2.0, bent=abs(rise))
    return replace(record, reading_errors=(*record.reading_errors, error))
