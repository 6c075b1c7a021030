"""Limits of a campaign: conditions that no record varies, lines that are not analysed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pymoo_hdte.discrepancy._selection.verdict import EXPLAINED
from pymoo_hdte.discrepancy._verdicts.drive import highest_order
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.stated_sensors import sensor_caveats
from pymoo_hdte.effects.unknowns import harmonics_among

_SAME_ORDER = 1e-6
"""Largest difference of order at which two lines count as the same."""
_FEWEST_TO_COMPARE = 4
"""Records of which one can stand out; of four that are alike each has a quarter."""


def campaign_limits(finding: DriveFinding) -> list[str]:
    """Return a sentence for each question that the records of a campaign cannot answer.

    Parameters
    ----------
    finding : DriveFinding
        Of `analysis.examine_drive`.
    """
    of_records = _zeroed(finding) + _standing_out(finding) + _unproven(finding)
    of_conditions = _unvaried(finding) + _unseen(finding)
    of_values = _far_sensors(finding) + _too_high(finding)
    return of_records + of_conditions + _like_a_gain(finding) + of_values


def _zeroed(finding: DriveFinding) -> list[str]:
    """Return what records say that all begin at one reading of both angles, noise included."""
    running = finding.campaign.running
    begins = {(float(one.input_angle[0]), float(one.output_angle[0])) for one in running}
    if len(begins) > 1 or len(running) < 2:
        return []
    return [
        "Both angles begin at the same reading in every record. If their counters were zeroed "
        "there, zeros differ from record to record, and with them the phases of all lines: state "
        "the zero of each record."
    ]


def _standing_out(finding: DriveFinding) -> list[str]:
    """Return which record has most of what the believed drive leaves, if nothing explains it."""
    records, verdict = finding.data.features.records, finding.verdict
    if verdict.status != "unlisted" or len(records) < _FEWEST_TO_COMPARE:
        return []
    # The sweeps have a row of their own, the last; chance may leave a record less than noise.
    excess = np.maximum(finding.data.excess(verdict.base).chi_square.sum(axis=1), 0.0)
    worst = int(np.argmax(excess[: len(records)]))
    if 2.0 * excess[worst] <= excess.sum():
        return []
    share = 100.0 * excess[worst] / excess.sum()
    return [
        f"Record {records[worst].name} alone has {share:.0f} % of the misfit: either the missing "
        "effect shows only there, or its sensors or drive differed from the others. In that case "
        "leave it out."
    ]


def _unproven(finding: DriveFinding) -> list[str]:
    found = []
    if not finding.campaign.held_out:
        found.append("No record was held out: the correction is not validated.")
    if finding.verdict.status in EXPLAINED and not finding.verdict.shown_in_held_out:
        found.append("The held-out records do not show what is named.")
    fitted = {record.name for record in finding.data.features.records}
    if finding.campaign.held_out and (held_out := finding.held_out) is None:
        found.append("All held-out records rattle: the correction is not validated.")
    elif finding.campaign.held_out and held_out is not None:
        fitted |= {record.name for record in held_out.features.records}
    left_out = [record.name for record in finding.campaign.running if record.name not in fitted]
    if left_out:
        found.append(
            "Neither fitted nor predicted, because the load does not hold the tooth flanks "
            f"together: {', '.join(left_out)}."
        )
    if finding.data.evident:
        found.append(
            "Without load the motion does not repeat with the input, as when tooth flanks part and "
            "meet again: no hypothesis without a clearance is reported."
        )
    return found


def _unvaried(finding: DriveFinding) -> list[str]:
    records, found = finding.data.features.records, []
    rules = finding.data.rules
    speeds = np.array([record.input_speed for record in records])
    loads = np.array([record.load_torque for record in records])
    if np.abs(speeds).max() <= rules.one_speed_ratio * np.abs(speeds).min():
        found.append(
            "All fitted records run at one speed: dry friction, friction that changes with speed "
            "and damping are indistinguishable."
        )
    if np.ptp(loads) <= rules.one_load_range * np.abs(loads).max():
        found.append(
            "All fitted records carry one load: it remains open whether an error grows with the "
            "load."
        )
    if np.all(speeds > 0.0) or np.all(speeds < 0.0):
        found.append(
            "All fitted records turn one way. Dry friction at the input and a zero error of the "
            "input torque sensor are separated only by the stated limit of that error, "
            f"{finding.campaign.rig.input_torque_zero:g} N.m."
        )
    if np.ptp([record.elapsed for record in records]) == 0.0:
        found.append("All fitted records have the same time in the session: no drift can be seen.")
    if not finding.data.torsion:
        found.append(
            "No torsion sweep was fitted. Unless the running records pass through zero torque, a "
            "clearance looks like a soft wind-up, and hysteresis like damping."
        )
    return found


def _like_a_gain(finding: DriveFinding) -> list[str]:
    """Return what tells a friction in proportion to the load from a gain of the torque sensor."""
    verdict = finding.verdict
    chosen = verdict.chosen if verdict.status in EXPLAINED else None
    if chosen is None or not any(one.effect and one.effect.loaded for one in chosen.candidates):
        return []
    power = [one.input_speed * one.load_torque for one in finding.data.features.records]
    if min(power) < 0.0 < max(power):
        return []
    gain = 100.0 * finding.campaign.rig.input_torque_gain
    return [
        "Power flows one way through the drive in all fitted records, so friction that grows "
        "with the load looks like a wrong gain of the input torque sensor: only its stated gain "
        f"error, {gain:g} %, separates them."
    ]


def _far_sensors(finding: DriveFinding) -> list[str]:
    """Return which sensors are far from what is stated of them, if the verdict explains records."""
    verdict = finding.verdict
    # Gains of a base that explains nothing say nothing of the sensors.
    explains = verdict.status in (*EXPLAINED, "adequate")
    return sensor_caveats(verdict.accepted, verdict.rules) if explains else []


def _unseen(finding: DriveFinding) -> list[str]:
    orders = finding.data.features.orders
    highest = highest_order(finding.campaign, finding.data.rules)
    believed = finding.campaign.believed
    unseen = [
        order
        for order, amplitude in zip(believed.error_orders, believed.error_amplitudes, strict=True)
        if amplitude != 0.0 and np.abs(orders - order).min() > _SAME_ORDER
    ]
    found = []
    if mixed := _named([order for order in unseen if order <= highest]):
        found.append(f"The records do not resolve the nominal static error of order {mixed}.")
    if high := _named([order for order in unseen if order > highest]):
        found.append(
            f"The nominal static error of order {high} is not compared: lines are compared up to "
            f"order {highest:.3g}."
        )
    return found


def _too_high(finding: DriveFinding) -> list[str]:
    verdict, rules = finding.verdict, finding.data.rules
    highest = highest_order(finding.campaign, rules)
    if verdict.chosen is None or not verdict.leaves_more_than_noise:
        return []
    seen = finding.data.features.orders.tolist()
    orders = {one.order for one in verdict.chosen.candidates if one.order is not None}
    values = ", which may shift the values of the effect" if verdict.status in EXPLAINED else ""
    # Unexpected lines are searched strictly below the highest order.
    return [
        f"Order {2.0 * order:.4g}, the second harmonic of order {order:.4g}, is not fitted: it "
        f"lies above order {highest:.3g}. The residual may be that harmonic{values}."
        for order in sorted(orders)
        if 2.0 * order >= highest and harmonics_among(seen, order, 2) == 1
    ]


def _named(orders: Sequence[float]) -> str:
    return ", ".join(f"{order:.4g}" for order in orders)
