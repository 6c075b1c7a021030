"""The workflow from a campaign to a verdict: measure, fit the base, locate lines, judge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.campaign.order_lines import HIGHEST_ORDER
from pymoo_hdte.discrepancy.campaign.records import RunningRecord
from pymoo_hdte.discrepancy.drive.candidates import candidates
from pymoo_hdte.discrepancy.drive.evidence import Data, training_data
from pymoo_hdte.discrepancy.drive.features import Features, measure
from pymoo_hdte.discrepancy.drive.sizes import port_sizes, scales_of
from pymoo_hdte.discrepancy.drive.sweep_effects import leading_sweep_effect, unexpected_orders
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.fitting import Fit, fit
from pymoo_hdte.discrepancy.engine.hypothesis import SHARE
from pymoo_hdte.discrepancy.engine.verdict import Verdict, judge
from pymoo_hdte.laws.effect import effect_named

FEWEST_RECORDS = 3
"""Below this no effect could be told from the base parameters."""
_SEPARATION = 0.9
"""Least distance of two order lines, in cycles per output turn."""
_BELOW_NYQUIST = 0.9
"""Share of the lowest Nyquist order: closer to it, rows hardly tell sine from cosine."""
_MOST_LINES = 4
_LINE_CHANCE = 1e-6
_SECOND_CHANCE = 0.01
"""That noise alone makes a line of one speed seem to be one of two."""
_SAME_NOISE = 1.5
"""Largest ratio of variances up to which the noise is that of the believed drive."""
LEAST_LOAD = 0.5
"""N.m at a `torque_scale` of 1, a few times what a torque sensor's zero is known to."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """A campaign and what the workflow finds in it.

    Attributes
    ----------
    campaign : Campaign
    data : Data
        Features of the training records.
    verdict : Verdict
    unexpected : tuple of float
        Orders beyond the expected ones at which records show more than noise.
    """

    campaign: Campaign
    data: Data
    verdict: Verdict
    unexpected: tuple[float, ...]

    @cached_property
    def held_out(self) -> Data | None:
        """Features of the held-out records, or None where there are none.

        Where records that rattle were left out of the fit, they are here too.
        """
        records = self.campaign.held_out
        if not records:
            return None
        features = measure(self.campaign, records, self.data.features.orders.tolist())
        if len(self.data.features.records) < len(self.campaign.train):
            held = _flanks_held(features, self.campaign.torque_scale)
            features = features.rows(np.flatnonzero(held))
        if not features.records:
            return None
        return replace(self.data, features=features, torsion=())


def expected_orders(campaign: Campaign) -> list[float]:
    """Return the orders that are always looked at: of the error, their sums, of the output turn.

    Raises
    ------
    InvalidInput
        For a line of the believed static error that some record does not show or tell apart.
    """
    believed = campaign.believed
    lines = believed.error_orders
    wanted = [1.0 / believed.ratio, 2.0 / believed.ratio, *lines]
    wanted += [one + other for place, one in enumerate(lines) for other in lines[place:]]
    wanted += [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]
    return _apart(wanted, campaign, _error_lines(campaign))


@threadpool_limits.wrap(limits=1)
def analyse(campaign: Campaign) -> Analysis:
    """Return the verdict on a campaign.

    In one thread: the matrices are small, and threads that wait for each other cost a multiple.

    Raises
    ------
    InvalidInput
        If fewer than `FEWEST_RECORDS` records are there to be fitted, or a record cannot show or
        tell apart the lines of the believed static error.
    """
    if len(campaign.train) < FEWEST_RECORDS:
        allowed = f"at least {FEWEST_RECORDS}, or base and effects cannot be told apart"
        raise InvalidInput("number of train records", len(campaign.train), allowed)
    ratio = campaign.believed.ratio
    expected = expected_orders(campaign)
    features = measure(campaign, campaign.train, expected)
    unexpected = unexpected_orders(features, ratio, campaign.rig)
    if unexpected:
        orders = _apart(unexpected, campaign, expected)
        features = measure(campaign, campaign.train, orders)
    data = training_data(campaign, features)
    base = fit(data)
    listed = _candidates(data, base)
    leading = leading_sweep_effect(data, base, listed)
    if leading is not None and effect_named(leading).rattles:
        data = _loaded(data)
        base = fit(data)
        listed = _candidates(data, base)
    verdict = judge(data, base, listed)
    data, verdict = _with_noise_of(verdict, data, listed)
    return Analysis(campaign, data, verdict, tuple(unexpected))


def _with_noise_of(verdict: Verdict, data: Data, listed: list[Candidate]) -> tuple[Data, Verdict]:
    """Judge again where the named effect changes how the drive answers to what does not repeat.

    The repeatability is a motion, which all channels show by way of the model's own response.
    """
    if verdict.chosen is None or verdict.chosen.share < SHARE:
        return data, verdict
    fitted = verdict.chosen.fit
    values = fitted.values[: len(data.base)]
    renewed = replace(data, reference=values, reference_effects=fitted.effects)
    ratio = np.diagonal(renewed.covariance, axis1=1, axis2=2) / np.diagonal(
        data.covariance, axis1=1, axis2=2
    )
    if ratio.max() <= _SAME_NOISE:
        return data, verdict
    again = judge(renewed, fit(renewed), listed)
    return (data, verdict) if again.chosen is None else (renewed, again)


def _candidates(data: Data, base: Fit) -> list[Candidate]:
    features = data.features
    seen = _strong_lines(features, base)
    orders = features.orders.tolist()
    return candidates(port_sizes(data.campaign.believed, orders, seen, scales_of(data, base)))


def _loaded(data: Data) -> Data:
    """Return the data without records whose load does not hold the tooth flanks together.

    With a clearance such a drive rattles and has no steady state to be fitted.
    """
    held = _flanks_held(data.features, data.campaign.torque_scale)
    if np.all(held) or held.sum() < FEWEST_RECORDS:
        return data
    return replace(data, features=data.features.rows(np.flatnonzero(held)))


def _flanks_held(features: Features, torque_scale: float) -> NDArray[np.bool_]:
    """Return which records carry a load beyond the swing of their torque, shape (r,)."""
    m = len(features.orders)
    lines = features.values[:, features.places(2)].reshape(len(features.records), m, 2)
    swing = np.hypot(lines[..., 0], lines[..., 1]).sum(axis=1)
    load = np.abs(features.conditions.output_torque)
    return np.asarray(load > np.maximum(swing, torque_scale * LEAST_LOAD))


def highest_order(campaign: Campaign) -> float:
    """Return the order up to which lines of a campaign are looked at, cycles per input turn."""
    return float(min(HIGHEST_ORDER, *(_shown_order(record) for record in campaign.running)))


def _shown_order(record: RunningRecord) -> float:
    """Return the order up to which the rows of a record show lines."""
    return _BELOW_NYQUIST * (np.pi * record.sample_rate / abs(record.input_speed))


def _error_lines(campaign: Campaign) -> list[float]:
    """Return the orders of the believed static error that the records show, if they can.

    A line that a record folds to another order, or mixes with its neighbour, would be there and
    not predicted: a drive that hides nothing would miss something. What is believed to be nothing
    need not be seen, and what lies above `HIGHEST_ORDER` is looked at nowhere.
    """
    believed = campaign.believed
    coarsest = min(campaign.running, key=_shown_order)
    shortest = min(campaign.running, key=_travel)
    least = 2.0 * np.pi * _SEPARATION / max(_travel(shortest), 2.0 * np.pi * believed.ratio)
    kept: list[float] = []
    for order, amplitude in zip(believed.error_orders, believed.error_amplitudes, strict=True):
        if amplitude == 0.0:
            continue
        if order > (shown := _shown_order(coarsest)):
            rate = coarsest.sample_rate * order / shown
            allowed = (
                f"at most {shown:.4g}, {_BELOW_NYQUIST:g} of the Nyquist order of "
                f"{coarsest.name}: rows at {rate:.4g} Hz or more instead of "
                f"{coarsest.sample_rate:g} Hz, or a campaign without this record"
            )
            raise InvalidInput("believed.error_orders", order, allowed)
        if order > HIGHEST_ORDER:
            continue
        near = min(kept, key=lambda one: abs(one - order), default=np.inf)
        if abs(order - near) < least:
            turns = _SEPARATION / (believed.ratio * abs(order - near))
            allowed = (
                f"{least:.4g} or more from order {near:g}, or {shortest.name} cannot tell them "
                f"apart: records of at least {turns:.3g} output turns, or both as one line"
            )
            raise InvalidInput("believed.error_orders", order, allowed)
        kept.append(order)
    return kept


def _travel(record: RunningRecord) -> float:
    return abs(float(record.input_angle[-1] - record.input_angle[0]))


def _apart(wanted: list[float], campaign: Campaign, kept: list[float]) -> list[float]:
    """Return orders that every record can tell apart: those kept, then the first ones first."""
    least = _SEPARATION / campaign.believed.ratio
    highest = highest_order(campaign)
    kept = list(kept)
    for order in wanted:
        if order <= highest and all(abs(order - other) >= least for other in kept):
            kept.append(order)
    return sorted(kept)


def _strong_lines(features: Features, base: Fit) -> list[float]:
    """Return the orders at which the base leaves more than noise in any channel.

    What is seen at one speed only is no order but a frequency, if there are several speeds.
    """
    misfit: NDArray[np.float64] = (base.residuals[: features.values.size] ** 2).reshape(
        features.values.shape
    )
    by_line = np.array([misfit[:, features.places(channel)].sum(axis=2) for channel in range(4)])
    power = by_line.sum(axis=0)
    speed = np.abs([record.input_speed for record in features.records])
    groups = [power[speed == one].sum(axis=0) for one in np.unique(speed)]
    total, strongest = power.sum(axis=0), np.max(groups, axis=0)
    strong = total > _threshold(8 * len(speed), _LINE_CHANCE)
    if len(groups) > 1:
        fewest = min(np.sum(speed == one) for one in np.unique(speed))
        strong &= total - strongest > _threshold(8 * (len(speed) - fewest), _SECOND_CHANCE)
    ranked = [k for k in np.argsort(-total) if strong[k]]
    return [float(features.orders[k]) for k in ranked[:_MOST_LINES]]


def _threshold(freedom: int, chance: float) -> float:
    return float(chi2.isf(chance, freedom))
