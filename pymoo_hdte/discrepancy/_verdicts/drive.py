"""From a campaign to a verdict: extract features, fit the base, find order lines, judge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from pymoo_hdte._one_thread import ONE_THREAD
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, flanks_held, training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import (
    Features,
    measure,
    shown_order,
    unexpected_lines,
    unexpected_orders,
)
from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import motor_orders
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import coefficients_of
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import (
    port_sizes,
    scales_of,
)
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import PREDICTION, Lead
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.cleaning.cleaning import cleaned_rows
from pymoo_hdte.discrepancy._records.cleaning.findings import NoiseFinding
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules
from pymoo_hdte.discrepancy._verdicts import rattling, records_judged
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive import harmonic_balance
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.ripple import orders_beside
from pymoo_hdte.effects.unknowns import HARMONIC_NAMES, is_among


def expected_orders(campaign: Campaign, rules: Rules = RULES) -> list[float]:
    """Return the orders that are always analysed: of the error, their sums, of the output turn.

    Raises
    ------
    InvalidInput
        For a line of the believed static error that some record cannot resolve.
    """
    believed = campaign.believed
    lines = believed.error_orders
    wanted = [1.0 / believed.ratio, 2.0 / believed.ratio, *lines]
    wanted += [line + addend for place, line in enumerate(lines) for addend in lines[place:]]
    wanted += [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
    return _apart(wanted, campaign, _error_lines(campaign, rules), rules)


@ONE_THREAD
def examine_drive(campaign: Campaign, rules: Rules = RULES) -> DriveFinding:
    """Return the verdict on a campaign.

    In one thread: the matrices are small, so that several threads would be much slower.

    Parameters
    ----------
    campaign : Campaign
    rules : Rules
        Thresholds of the verdict.

    Raises
    ------
    InvalidInput
        If there are fewer than `Rules.fewest_records` records to fit, a record cannot resolve the
        lines of the believed static error, or the drive has no steady motion with the believed
        effects.
    """
    if len(campaign.train) < rules.fewest_records:
        allowed = f"at least {rules.fewest_records}, or base and effects cannot be told apart"
        raise InvalidInput("number of train records", len(campaign.train), allowed)
    ratio = campaign.believed.ratio
    expected = expected_orders(campaign, rules)
    campaign, rows = cleaned_rows(campaign, expected, rules)
    features = measure(campaign, campaign.train, expected, rules)
    coarse = _scales_are_coarse(campaign.rig, rows.noise)
    lines = unexpected_lines(features, ratio, campaign.rig, rules, coarse)
    held = flanks_held(features, campaign.torque_scale, rules)
    enough = held.sum() >= rules.fewest_records
    known = campaign.believed.error_orders
    rattles = enough and rattling.is_heard(lines, held, known, ratio, rules)
    # Lines of a motion that does not repeat are no orders.
    repeating = np.flatnonzero(held) if rattles else range(len(lines))
    unexpected = unexpected_orders([lines[row] for row in repeating], ratio, rules)
    if unexpected:
        orders = _apart(unexpected, campaign, expected, rules)
        features = measure(campaign, campaign.train, orders, rules)
    data = training_data(campaign, features, rules)
    if any(effect_named(effect.name).rattles for effect in campaign.believed.effects):
        data = data.loaded
    elif rattles:
        data = rattling.with_clearance(data)
    _check_steady(data)
    base = fit(data)
    harmonics, exciting = _beyond(data, base)
    orders = sorted([*data.features.orders.tolist(), *harmonics, *exciting])

    def where_only_excite(above: list[float], of: Data) -> tuple[Data, Fit]:
        if orders == data.features.orders.tolist():
            return data, base
        features = measure(campaign, of.features.records, orders, rules, above)
        of_lines = replace(data, features=features)
        return of_lines, fit(of_lines, start=base.values)

    candidates_of = partial(_candidates, above=harmonics)
    judged = records_judged.judged(*where_only_excite([*harmonics, *exciting], data), candidates_of)
    # What lower orders leave to something outside, the harmonics do as well; and where no likely
    # set follows these, as in a record that then has no steady state, the lower ones are explained.
    if harmonics and judged.verdict.outside <= 0.5:
        everything = where_only_excite(exciting, judged.data)
        of_all = records_judged.judged_if_explained(judged, *everything, _candidates)
        if of_all is not None and of_all.verdict.outside <= 0.5:
            judged, unexpected = of_all, [*unexpected, *harmonics]
    return DriveFinding(campaign, judged.data, judged.verdict, tuple(unexpected), rows)


def _beyond(data: Data, base: Fit) -> tuple[list[float], list[float]]:
    """Return what strong lines bring above the orders looked at, and where that only excites.

    The harmonics of a strong line belong to its effect, if they are strong, too: what they leave
    out of a fit ends in other values, as in the gains of sensors; lines of poles and slots belong
    to one motor. Where the input moves at such an order, perhaps in a single record, the drive is
    excited by that. Each record is asked for what its rows show.
    """
    campaign, features, rules = data.campaign, data.features, data.rules
    orders, lowest = features.orders.tolist(), highest_order(campaign, rules)
    most = max(shown_order(record, rules) for record in features.records)
    strong = _strong_lines(features, base.residuals, rules)
    brought = {
        round(multiple * order, 9)
        for order in strong
        for multiple in range(2, len(HARMONIC_NAMES) + 1)
    }
    further = [
        order
        for order in sorted(brought | orders_beside(strong, motor_orders(campaign.rig)))
        if lowest < order <= most and not is_among(orders, order)
    ]
    if not further:
        return [], []
    everything = measure(campaign, features.records, sorted([*orders, *further]), rules)
    wider = replace(data, features=everything)
    residuals = wider.objective(()).residuals(base.values)
    strong = _strong_lines(everything, residuals, rules)
    moved = _moved_lines(everything, rules)
    harmonics = [order for order in further if is_among(strong, order)]
    exciting = [order for order in further if is_among(moved, order) and order not in harmonics]
    return harmonics, exciting


def _moved_lines(features: Features, rules: Rules) -> list[float]:
    """Return the orders at which the measured input moves in some record, whatever the cause."""
    places = features.places(CHANNELS.index("input_angle"))
    variances = np.diagonal(features.covariance, axis1=1, axis2=2)[:, places]
    power = np.sum(features.values[:, places] ** 2 / variances, axis=2)
    chance = rules.order_line_chance / power.shape[0]
    return features.orders[power.max(axis=0) > _threshold(2, chance)].tolist()


def _check_steady(data: Data) -> None:
    """Refuse believed effects with which the drive has no steady motion in some record.

    A fit would ignore the effects there, and judge a drive other than the believed one.
    """
    campaign = data.campaign
    believed = campaign.believed
    if not believed.effects:
        return
    values = {parameter.name: np.array([parameter.start]) for parameter in data.base}
    conditions = data.features.conditions
    coefficients = coefficients_of(believed, values, believed.effects, len(conditions))
    torus = torus_of(coefficients)
    # Features are of measured records, whose input moves as it did.
    moving = Lead(data.features.orders, np.asarray(conditions.lead))
    steady = harmonic_balance(
        coefficients,
        input_speed=conditions.input_speed,
        load_torque=conditions.output_torque,
        torus=torus,
        tolerance=PREDICTION.tolerance,
        lead=moving.on(torus),
    ).converged
    if not steady.all():
        lost = data.features.records[int(np.argmin(steady))].name
        names = [effect.name for effect in believed.effects]
        allowed = f"effects with which the drive has a steady motion in every record; not in {lost}"
        raise InvalidInput("believed.effects", names, allowed)


def _candidates(
    data: Data, base: Fit, further: Fit | None = None, above: Sequence[float] = ()
) -> list[Candidate]:
    """Return the effects that the lines suggest which the base, and a further fit, leave.

    Strong lines ``above`` the highest order that only excite belong to them: a motor cogs at all
    of its orders.
    """
    features, highest = data.features, highest_order(data.campaign, data.rules)
    clear, seen = list(above), list[float]()
    for fitted in (base, further) if further is not None else (base,):
        strong = _strong_lines(features, fitted.residuals, data.rules)
        clear += [order for order in strong if not is_among(clear, order)]
        # Above the highest order there are harmonics only.
        strongest = [order for order in strong if order <= highest][: data.rules.most_order_lines]
        seen += [order for order in strongest if not is_among(seen, order)]
    believed, orders = data.campaign.believed, features.orders.tolist()
    sizes = port_sizes(believed, orders, seen, scales_of(data, base), clear, highest)
    return drive_candidates(sizes, believed.effects, data.bench.nuisances)


def highest_order(campaign: Campaign, rules: Rules) -> float:
    """Return the order up to which lines of a campaign are analysed, cycles per input turn."""
    shown = [shown_order(record, rules) for record in campaign.running]
    return float(min(rules.highest_order, *shown))


def _error_lines(campaign: Campaign, rules: Rules) -> list[float]:
    """Return the orders of the believed static error that are analysed; all must be resolved.

    A line that a record aliases to another order, or mixes with its neighbour, would be measured
    but not predicted: an effect would seem to be missing from a drive without any. Lines of
    amplitude zero need not be resolved, and lines above `Rules.highest_order` are not analysed.
    """
    believed = campaign.believed
    coarsest = min(campaign.running, key=lambda record: shown_order(record, rules))
    shortest = min(campaign.running, key=_travel)
    apart = rules.line_separation
    least = 2.0 * np.pi * apart / max(_travel(shortest), 2.0 * np.pi * believed.ratio)
    resolved: list[float] = []
    for order, amplitude in zip(believed.error_orders, believed.error_amplitudes, strict=True):
        if amplitude == 0.0:
            continue
        if order > (shown := shown_order(coarsest, rules)):
            rate = coarsest.sample_rate * order / shown
            allowed = (
                f"at most {shown:.4g}, {rules.nyquist_share:g} of the Nyquist order of "
                f"{coarsest.name}: rows at {rate:.4g} Hz or more instead of "
                f"{coarsest.sample_rate:g} Hz, or a campaign without this record"
            )
            raise InvalidInput("believed.error_orders", order, allowed)
        if order > rules.highest_order:
            continue
        neighbour = min(resolved, key=lambda line: abs(line - order), default=np.inf)
        if abs(order - neighbour) < least:
            turns = apart / (believed.ratio * abs(order - neighbour))
            allowed = (
                f"{least:.4g} or more from order {neighbour:g}, or {shortest.name} cannot tell "
                f"them apart: records of at least {turns:.3g} output turns, or both as one line"
            )
            raise InvalidInput("believed.error_orders", order, allowed)
        resolved.append(order)
    return resolved


def _travel(record: RunningRecord) -> float:
    return abs(float(record.input_angle[-1] - record.input_angle[0]))


def _scales_are_coarse(rig: Rig, noise: Sequence[NoiseFinding]) -> bool:
    """Tell whether the angles show twice the power of the noise that is stated of their encoders.

    Steps of a scale do so, whether they are stated or not. Noise averages out four fifths of their
    first tone at that power, and less beyond: exp(-pi^2 / 6 / (times - 1)) of it remains, as in
    `coarse_readings`.
    """
    shown = rig.angle_noise**2 + rig.angle_quantisation**2 / 12.0
    stated = [finding.stated for finding in noise if finding.name == "angle_noise"]
    return bool(stated) and shown > 2.0 * stated[0] ** 2


def _apart(
    wanted: list[float], campaign: Campaign, orders: list[float], rules: Rules
) -> list[float]:
    """Return orders that every record can resolve: those given, then wanted ones in their order."""
    least = rules.line_separation / campaign.believed.ratio
    highest = highest_order(campaign, rules)
    orders = list(orders)
    for order in wanted:
        if order <= highest and all(abs(order - neighbour) >= least for neighbour in orders):
            orders.append(order)
    return sorted(orders)


def _strong_lines(features: Features, residuals: NDArray[np.float64], rules: Rules) -> list[float]:
    """Return the orders at which the residual of the base exceeds the noise in any channel.

    The strongest first. If there are several speeds, a line seen at one speed only is a frequency
    and no order.
    """
    misfit: NDArray[np.float64] = (residuals[: features.values.size] ** 2).reshape(
        features.values.shape
    )
    by_line = np.array([misfit[:, features.places(channel)].sum(axis=2) for channel in range(4)])
    power = by_line.sum(axis=0)
    speed = np.abs([record.input_speed for record in features.records])
    groups = [power[speed == group_speed].sum(axis=0) for group_speed in np.unique(speed)]
    total, strongest = power.sum(axis=0), np.max(groups, axis=0)
    strong = total > _threshold(8 * len(speed), rules.order_line_chance)
    if len(groups) > 1:
        fewest = min(np.sum(speed == group_speed) for group_speed in np.unique(speed))
        degrees_of_freedom = 8 * (len(speed) - fewest)
        strong &= total - strongest > _threshold(degrees_of_freedom, rules.second_speed_chance)
    ranked = [k for k in np.argsort(-total) if strong[k]]
    return [float(features.orders[k]) for k in ranked]


def _threshold(degrees_of_freedom: int, chance: float) -> float:
    return float(chi2.isf(chance, degrees_of_freedom))
