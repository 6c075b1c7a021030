"""The noise of the sensors as the records show it, beside the one that the campaign states.

The residual of the order lines is noise, and perhaps motion that they do not describe. Noise is
alike at all frequencies, so it is the median of the residual's spectrum up to the highest order
analysed. The median over the records follows, because their speeds move any further line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pymoo_hdte.discrepancy._records.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.cleaning.findings import NoiseFinding
from pymoo_hdte.discrepancy._records.line_fit import order_lines, row_covariance
from pymoo_hdte.discrepancy._records.records import ReadingError, RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.units import ARCSEC

Rows = NDArray[np.float64]

_FEWEST_FREQUENCIES = 30
"""Frequencies of a record that are enough for the median of its spectrum."""

_BROADENING = 1.5
"""Frequencies over which the taper of a spectrum spreads one line; its values are correlated."""

_MEDIAN_SPREAD = 1.0 / np.log(2.0)
"""Relative standard deviation of the median of n exponential values, times sqrt(n)."""

_MEDIAN_OF_NORMAL = 0.6745

_ROUNDING = 1e-6
"""Differences between changes that are rounding, as a share of their range."""

_THIRD_DIFFERENCES = np.sqrt(20.0)
"""Third differences of white noise have 1 + 9 + 9 + 1 times its variance."""


def running_noise(
    records: Sequence[RunningRecord],
    residuals: Sequence[Rows | None],
    rig: Rig,
    ratio: float,
    rules: Rules,
) -> list[NoiseFinding]:
    """Return what running records show of the noise of encoders and torque sensors.

    Both encoders share one noise, that of the worse of the two.

    Parameters
    ----------
    records : sequence of RunningRecord
    residuals : sequence of ndarray, shape (n, 4), or None
        Residuals of their order lines, by channel as in `LineFit`; None where they are unknown.
    rig : Rig
        What is stated.
    ratio : float
        Transmission ratio N, dimensionless.
    rules : Rules
    """
    shown = [
        _powers(record, residual, rig, ratio, rules)
        for record, residual in zip(records, residuals, strict=True)
        if residual is not None
    ]
    known = [estimate for estimate in shown if estimate is not None]
    if not known:
        reason = "the records are too short to show it"
        names = ("angle_noise", "input_torque_noise", "output_torque_noise")
        return [_unknown(rig, name, reason) for name in names]
    powers = np.array([estimate[0] for estimate in known])
    deviations = np.array([estimate[1] for estimate in known])
    power = np.median(powers, axis=0)
    # The median of r values scatters by sqrt(pi / 2) more than their mean.
    deviation = float(np.sqrt(np.pi / 2.0 * np.mean(deviations**2) / len(known)))
    reason = f"median over {len(known)} records of what their order lines leave"
    encoders = float(max(power[0], power[3]))
    quantised = rig.angle_quantisation**2 / 12.0
    angle = encoders * (rig.angle_noise**2 + quantised) - quantised
    estimates = [
        ("angle_noise", encoders, np.sqrt(angle) if angle > 0.0 else 0.0),
        ("input_torque_noise", power[1], rig.input_torque_noise * np.sqrt(power[1])),
        ("output_torque_noise", power[2], rig.output_torque_noise * np.sqrt(power[2])),
    ]
    return [
        _finding(rig, name, float(size), abs(np.log(times)) / deviation, reason, rules)
        for name, times, size in estimates
    ]


def coarse_readings(
    records: Sequence[RunningRecord],
    findings: Sequence[NoiseFinding],
    rig: Rig,
    ratio: float,
    rules: Rules,
) -> tuple[list[RunningRecord], list[NoiseFinding]]:
    """Return records and noise where channels are read in steps that hide the stated noise.

    The noise is at least that of the steps, step / sqrt(12). Angles pass through many steps. Steps
    of a torque also hide what is small beside them, which makes its mean and lines uncertain.

    Parameters
    ----------
    records : sequence of RunningRecord
    findings : sequence of NoiseFinding
        Results of `running_noise`.
    rig : Rig
        What is stated.
    ratio : float
        Transmission ratio N, dimensionless.
    rules : Rules
    """
    encoder = float(np.hypot(rig.angle_noise, rig.angle_quantisation / np.sqrt(12.0)))
    channels = (
        ("input_angle", "angle_noise", encoder * ratio, ratio),
        ("output_angle", "angle_noise", encoder, 1.0),
        ("input_torque", "input_torque_noise", rig.input_torque_noise, 1.0),
        ("output_torque", "output_torque_noise", rig.output_torque_noise, 1.0),
    )
    read, noise = list(records), {finding.name: finding for finding in findings}
    for channel, name, stated, scale in channels:
        steps = np.array([_step(getattr(record, channel), rules) for record in read])
        # Of one raw sample, as the stated noise.
        coarse = steps * np.sqrt([record.samples_averaged for record in read])
        hides = coarse > rules.noise_mismatch * stated * np.sqrt(12.0)
        if name != "angle_noise":
            read = [
                _with_hidden(record, channel, step, stated * step / of_sample) if hidden else record
                for record, step, of_sample, hidden in zip(read, steps, coarse, hides, strict=True)
            ]
        if np.mean(hides) > 0.5:
            used = np.median(coarse) / np.sqrt(12.0) / scale
            size = f"{np.median(steps):.3g} N.m"
            if name == "angle_noise":
                used = np.sqrt(used**2 - rig.angle_quantisation**2 / 12.0)
                size = f"{np.median(steps) / ARCSEC:.3g} arcsec"
            used = float(max(used, noise[name].used))
            reason = f"{channel.replace('_', ' ')} is read in steps of {size}"
            step = float(np.median(steps))
            noise[name] = replace(noise[name], found=used, used=used, reason=reason, step=step)
    return read, list(noise.values())


def _step(values: Rows, rules: Rules) -> float:
    """Return the step in which a channel is read, or zero if its changes are not in steps."""
    changes = np.diff(values)
    # Whole turns that were added, or digits of a file, leave equal changes apart by rounding.
    rounding = float(np.ptp(changes)) * _ROUNDING
    distinct = np.unique(np.round((changes - changes.min()) / rounding)) if rounding else changes
    if len(distinct) > rules.changing_share * len(changes):
        return 0.0
    return float(np.median(np.diff(distinct))) * rounding


def _with_hidden(record: RunningRecord, channel: str, step: float, noise: float) -> RunningRecord:
    """Return a record whose mean and lines are as uncertain as the steps of a channel make them.

    Rounding adds waves of the reading over a step, the first one of step / pi, which noise beside
    it averages out by exp(-2 (pi noise / step)^2) (Carbone and Petri, IEEE Transactions on
    Instrumentation and Measurement 43, 1994). Real and imaginary part of a line have its root mean
    square.
    """
    wave = step / np.pi * np.exp(-2.0 * (np.pi * noise / step) ** 2)
    error = ReadingError(channel, float(wave / np.sqrt(2.0)), of_lines=True)
    return replace(record, reading_errors=(*record.reading_errors, error))


def _powers(
    record: RunningRecord, residual: Rows, rig: Rig, ratio: float, rules: Rules
) -> tuple[Rows, float] | None:
    """Return the power of the noise in units of the stated one (4,), and its relative deviation."""
    n = len(residual)
    taper = np.hanning(n)
    spectrum = np.abs(np.fft.rfft(residual * taper[:, None], axis=0)) ** 2 / (taper @ taper)
    highest = rules.highest_order * abs(record.input_speed) / (2.0 * np.pi)
    # The lowest frequencies lost a straight line.
    used = spectrum[2 : int(min(highest / record.sample_rate, 0.5) * n)]
    if len(used) < _FEWEST_FREQUENCIES:
        return None
    stated = np.diag(row_covariance(rig, ratio, record.samples_averaged))
    power = np.median(used, axis=0) / np.log(2.0) / stated
    return power, _MEDIAN_SPREAD * float(np.sqrt(_BROADENING / len(used)))


def sweep_noise(sweeps: Sequence[TorsionRecord], rig: Rig, rules: Rules) -> list[NoiseFinding]:
    """Return what torsion sweeps show of the noise of their angle, from row to row.

    Third differences take out the slow motion of a sweep; their median does not see a clearance.
    """
    name = "torsion_angle_noise"
    if not sweeps:
        return []
    thirds = np.concatenate([np.diff(sweep.output_angle, 3) for sweep in sweeps])
    noise = float(np.median(np.abs(thirds)) / _MEDIAN_OF_NORMAL / _THIRD_DIFFERENCES)
    if noise == 0.0 or len(thirds) < _FEWEST_FREQUENCIES:
        return [_unknown(rig, name, "the steps of the sensor hide it")]
    # Relative deviation of the median of n magnitudes, 1.17 / sqrt(n), correlated over three rows.
    deviation = 1.17 * np.sqrt(3.0 / len(thirds))
    significance = abs(np.log(noise / rig.torsion_angle_noise)) / deviation
    return [_finding(rig, name, noise, significance, "differences of the sweep's rows", rules)]


def repeatability(
    records: Sequence[RunningRecord], believed: BelievedDrive, rig: Rig, rules: Rules
) -> NoiseFinding:
    """Return what repeated conditions show of the changes of the static error between records.

    Records of equal speed and load differ by these changes and by the noise of the sensors only.
    The response of the drive counts as 1, as it is far below the resonance.
    """
    name, n_lines = "repeatability", len(believed.error_orders)
    groups = [list(group) for _, group in groupby(sorted(records, key=_condition), key=_condition)]
    groups = [group for group in groups if len(group) > 1]
    if not groups or rig.repeatability == 0.0:
        return _unknown(rig, name, "no condition was recorded twice")
    power, sensors, number = 0.0, 0.0, 0
    for group in groups:
        lines = [
            order_lines(record, rig, believed.ratio, believed.error_orders) for record in group
        ]
        phasors = np.array([fit.phasors[0] for fit in lines])
        power += float(np.sum(np.abs(phasors - phasors.mean(axis=0)) ** 2))
        variances = [np.diag(fit.covariance[0])[1:].sum() for fit in lines]
        sensors += float(np.mean(variances)) * (len(group) - 1)
        number += 2 * n_lines * (len(group) - 1)
    # Each part of each line has this variance; see `Observations.repeatability`.
    stated = rig.repeatability**2 / n_lines + sensors / number
    estimate = float(np.sqrt(max(power / number - sensors / number, 0.0) * n_lines))
    chance = 2.0 * min(chi2.sf(power / stated, number), chi2.cdf(power / stated, number))
    significance = float(norm.isf(max(chance, 1e-300) / 2.0))
    reason = f"{sum(map(len, groups))} records of conditions that were recorded more than once"
    return _finding(rig, name, estimate, significance, reason, rules)


def _condition(record: RunningRecord) -> tuple[float, float]:
    return record.input_speed, record.load_torque


def with_noise(rig: Rig, findings: Sequence[NoiseFinding]) -> Rig:
    """Return a rig with the noise that is used; the same object if all is as stated."""
    changed: dict[str, Any] = {
        finding.name: finding.used for finding in findings if finding.replaced
    }
    return replace(rig, **changed) if changed else rig


def _unknown(rig: Rig, name: str, reason: str) -> NoiseFinding:
    stated = float(getattr(rig, name))
    return NoiseFinding(name, stated, None, stated, reason)


def _finding(
    rig: Rig, name: str, estimate: float, significance: float, reason: str, rules: Rules
) -> NoiseFinding:
    """Return a finding that uses an estimate if it differs from the stated value significantly."""
    stated = float(getattr(rig, name))
    least = float(norm.isf(rules.row_fault_chance / 2.0))
    differs = estimate > rules.noise_mismatch * stated or estimate * rules.noise_mismatch < stated
    replaced = differs and estimate > 0.0 and significance > least
    return NoiseFinding(name, stated, estimate, estimate if replaced else stated, reason)
