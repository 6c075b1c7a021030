"""Limits of a campaign: conditions that no record varies, lines that are not analysed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection import reason as codes
from pymoo_hdte.discrepancy._selection.reason import Reason
from pymoo_hdte.discrepancy._selection.verdict import EXPLAINED
from pymoo_hdte.discrepancy._verdicts.drive import highest_order
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.stated_sensors import beyond_limits
from pymoo_hdte.effects.unknowns import harmonics_among

_SAME_ORDER = 1e-6
"""Largest difference of order at which two lines count as the same."""
_FEWEST_TO_COMPARE = 4
"""Records of which one can stand out; of four that are alike each has a quarter."""


def campaign_limits(finding: DriveFinding) -> list[Reason]:
    """Return a reason for each question that the records of a campaign cannot answer.

    Parameters
    ----------
    finding : DriveFinding
        Of `analysis.examine_drive`.
    """
    of_records = _zeroed(finding) + _standing_out(finding) + _not_validated(finding)
    of_conditions = _unvaried(finding) + _unseen(finding)
    of_values = _far_sensors(finding) + _too_high(finding)
    return of_records + of_conditions + _like_a_gain(finding) + of_values


def _zeroed(finding: DriveFinding) -> list[Reason]:
    """Return what records say that all begin at one reading of both angles, noise included."""
    running = finding.campaign.running
    begins = {(float(record.input_angle[0]), float(record.output_angle[0])) for record in running}
    if len(begins) > 1 or len(running) < 2:
        return []
    return [Reason(codes.SAME_READING)]


def _standing_out(finding: DriveFinding) -> list[Reason]:
    """Return which record has most of what the believed drive leaves, if nothing explains it."""
    records, verdict = finding.data.features.records, finding.verdict
    if verdict.status != "unlisted" or len(records) < _FEWEST_TO_COMPARE:
        return []
    # The sweeps have a row of their own, the last; chance may leave a record less than noise.
    excess = np.maximum(finding.data.excess(verdict.base).chi_square.sum(axis=1), 0.0)
    worst = int(np.argmax(excess[: len(records)]))
    if 2.0 * excess[worst] <= excess.sum():
        return []
    share = excess[worst] / excess.sum()
    return [Reason.of(codes.STANDS_OUT, numbers={records[worst].name: share})]


def _not_validated(finding: DriveFinding) -> list[Reason]:
    limits = []
    if not finding.campaign.held_out:
        limits.append(Reason(codes.NO_HELD_OUT))
    if finding.verdict.status in EXPLAINED and not finding.verdict.shown_in_held_out:
        limits.append(Reason(codes.NOT_SHOWN))
    fitted = {record.name for record in finding.data.features.records}
    if finding.campaign.held_out and (held_out := finding.held_out) is None:
        limits.append(Reason(codes.HELD_OUT_RATTLES))
    elif finding.campaign.held_out and held_out is not None:
        fitted |= {record.name for record in held_out.features.records}
    left_out = {
        record.name: record.load_torque
        for record in finding.campaign.running
        if record.name not in fitted
    }
    if left_out:
        limits.append(Reason.of(codes.FLANKS_PART, numbers=left_out))
    if finding.data.evident:
        limits.append(Reason(codes.CLEARANCE_EVIDENT))
    return limits


def _unvaried(finding: DriveFinding) -> list[Reason]:
    records, rules = finding.data.features.records, finding.data.rules
    speeds = np.array([record.input_speed for record in records])
    loads = np.array([record.load_torque for record in records])
    zero = {"input_torque_zero": finding.campaign.rig.input_torque_zero}
    limits = (
        (
            np.abs(speeds).max() <= rules.one_speed_ratio * np.abs(speeds).min(),
            Reason(codes.ONE_SPEED),
        ),
        (np.ptp(loads) <= rules.one_load_range * np.abs(loads).max(), Reason(codes.ONE_LOAD)),
        (
            np.all(speeds > 0.0) or np.all(speeds < 0.0),
            Reason.of(codes.ONE_WAY, numbers=zero),
        ),
        (np.ptp([record.elapsed for record in records]) == 0.0, Reason(codes.ONE_TIME)),
        (not finding.data.torsion, Reason(codes.NO_SWEEP)),
    )
    return [reason for holds, reason in limits if holds]


def _like_a_gain(finding: DriveFinding) -> list[Reason]:
    """Return what tells a friction in proportion to the load from a gain of the torque sensor."""
    verdict = finding.verdict
    chosen = verdict.chosen if verdict.status in EXPLAINED else None
    if chosen is None or not any(
        candidate.effect and candidate.effect.loaded for candidate in chosen.candidates
    ):
        return []
    power = [record.input_speed * record.load_torque for record in finding.data.features.records]
    if min(power) < 0.0 < max(power):
        return []
    gain = {"input_torque_gain": finding.campaign.rig.input_torque_gain}
    return [Reason.of(codes.LIKE_A_GAIN, numbers=gain)]


def _far_sensors(finding: DriveFinding) -> list[Reason]:
    """Return which sensors are far from what is stated of them, if the verdict explains records."""
    verdict = finding.verdict
    # Gains of a base that explains nothing say nothing of the sensors.
    explains = verdict.status in (*EXPLAINED, "adequate")
    if not explains:
        return []
    return [
        Reason.of(codes.SENSOR_OFF, sensor.name, {"fitted": value, "stated": sensor.prior})
        for sensor, value in beyond_limits(verdict.accepted, verdict.rules)
    ]


def _unseen(finding: DriveFinding) -> list[Reason]:
    orders = finding.data.features.orders
    highest = highest_order(finding.campaign, finding.data.rules)
    believed = finding.campaign.believed
    unseen = [
        order
        for order, amplitude in zip(believed.error_orders, believed.error_amplitudes, strict=True)
        if amplitude != 0.0 and np.abs(orders - order).min() > _SAME_ORDER
    ]
    groups = (
        (codes.UNRESOLVED_LINES, [order for order in unseen if order <= highest]),
        (codes.LINES_ABOVE, [order for order in unseen if order > highest]),
    )
    return [
        Reason.of(code, numbers={**_named(orders), "highest": highest})
        for code, orders in groups
        if orders
    ]


def _too_high(finding: DriveFinding) -> list[Reason]:
    verdict, rules = finding.verdict, finding.data.rules
    highest = highest_order(finding.campaign, rules)
    if verdict.chosen is None or not verdict.leaves_more_than_noise:
        return []
    seen = finding.data.features.orders.tolist()
    orders = {
        candidate.order for candidate in verdict.chosen.candidates if candidate.order is not None
    }
    named = verdict.chosen.label if verdict.status in EXPLAINED else ""
    # Unexpected lines are searched strictly below the highest order.
    return [
        Reason.of(codes.HARMONIC_ABOVE, named, {"order": order, "highest": highest})
        for order in sorted(orders)
        if 2.0 * order >= highest and harmonics_among(seen, order, 2) == 1
    ]


def _named(orders: Sequence[float]) -> dict[str, float]:
    return {f"{order:.4g}": order for order in orders}
