"""Features of a campaign's running records: numbers with a full covariance.

A record's features are the means of transmission error and input torque, then real and imaginary
parts of the order lines of every channel. Their covariance is that of the sensors (both encoders
share the input's noise) plus that of the repeatability: the static error changes a little from one
record to the next, which reaches all channels through the response of the drive. A line that lies
too near the Nyquist order of a record, or above it, is zero there in measurement and prediction.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions, Prediction
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS, OrderLines, order_lines
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._records.residual_spectrum import residual_spectrum
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules

MEANS = (0, 1)
"""Channels whose mean is a feature; the others' means are conditions."""


@dataclass(frozen=True, eq=False)
class Features:
    """Features of r records.

    Attributes
    ----------
    records : tuple of RunningRecord
    conditions : Conditions
    orders : ndarray, shape (m,)
        Cycles per input turn.
    values : ndarray, shape (r, n_features)
    covariance : ndarray, shape (r, n_features, n_features)
        Of the sensors' noise only.
    shown : ndarray of bool, shape (r, m), optional
        Which lines each record shows; by default all.
    """

    records: tuple[RunningRecord, ...]
    conditions: Conditions
    orders: NDArray[np.float64]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    shown: NDArray[np.bool_] | None = None

    def rows(self, rows: NDArray[np.int_]) -> Features:
        """Return the features of some of the records."""
        return Features(
            tuple(self.records[row] for row in rows),
            self.conditions.rows(rows),
            self.orders,
            self.values[rows],
            self.covariance[rows],
            None if self.shown is None else self.shown[rows],
        )

    def of_prediction(self, prediction: Prediction) -> NDArray[np.float64]:
        """Return predicted features, shape (v, r, n_features)."""
        phasors = prediction.phasors
        if self.shown is not None:
            phasors = np.where(self.shown[:, None], phasors, 0.0)
        return stack(prediction.mean, phasors)

    def places(self, channel: int) -> NDArray[np.int_]:
        """Return the indices (m, 2) of a channel's real and imaginary parts among the features."""
        m = len(self.orders)
        first = len(MEANS) + 2 * m * channel
        return first + np.array([np.arange(m), m + np.arange(m)]).T


def stack(mean: NDArray[np.float64], phasors: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return means (..., 4) and phasors (..., 4, m) as features (..., n_features)."""
    lines = np.concatenate([phasors.real, phasors.imag], axis=-1)
    flat = lines.reshape(*lines.shape[:-2], -1)
    return np.concatenate([mean[..., list(MEANS)], flat], axis=-1)


def measure(
    campaign: Campaign,
    records: Sequence[RunningRecord],
    orders: Sequence[float],
    rules: Rules = RULES,
) -> Features:
    """Return the features of records at these orders, of each record at those that it shows.

    Raises
    ------
    InvalidInput
        For orders that a record cannot tell apart.
    """
    ratio, rig = campaign.believed.ratio, campaign.rig
    asked = np.array(orders)
    shown = np.array([asked <= shown_order(record, rules) for record in records])
    lines = [
        _at_all_orders(order_lines(record, rig, ratio, asked[of_record]), asked, of_record)
        for record, of_record in zip(records, shown, strict=True)
    ]
    conditions = Conditions(
        input_speed=np.array([line.slope[3] for line in lines]),
        output_torque=np.array([line.mean[2] for line in lines]),
        elapsed=np.array([_middle(record) for record in records]),
        bends=np.array([line.bends for line in lines]),
        temperature=np.array([record.temperature for record in records], dtype=float),
        input_angle=np.array([line.mean[3] for line in lines]),
        fading=np.array([line.fading for line in lines]),
        travel=np.array([abs(one.input_angle[-1] - one.input_angle[0]) for one in records]),
    )
    values = np.array([stack(line.mean, line.phasors) for line in lines])
    stiffness = campaign.believed.stiffness
    covariance = np.array([_sensor_covariance(line, rig, stiffness) for line in lines])
    # The load is taken from the measured output torque: its error is one of the input torque, too.
    covariance[:, 1, 1] += [_load_variance(record) / ratio**2 for record in records]
    return Features(
        tuple(records), conditions, asked, values, covariance, None if shown.all() else shown
    )


def _at_all_orders(
    lines: OrderLines, orders: NDArray[np.float64], shown: NDArray[np.bool_]
) -> OrderLines:
    """Return lines of a record with those that it does not show, which are zero.

    These have the mean variance of the others, as a covariance has to have one.
    """
    if shown.all():
        return lines
    m = len(orders)
    known = np.concatenate([[True], shown])
    places = np.flatnonzero(np.concatenate([known, shown]))
    variances = np.diagonal(lines.covariance, axis1=1, axis2=2)[:, 1:].mean(axis=1)
    covariance = variances[:, None, None] * np.eye(1 + 2 * m)
    covariance[:, places[:, None], places] = lines.covariance
    phasors = np.zeros((len(CHANNELS), m), dtype=complex)
    phasors[:, shown] = lines.phasors
    bends, fading = (
        np.zeros((len(courses), 1 + m), dtype=complex) for courses in (lines.bends, lines.fading)
    )
    bends[:, known], fading[:, known] = lines.bends, lines.fading
    return replace(
        lines, orders=orders, phasors=phasors, covariance=covariance, bends=bends, fading=fading
    )


def shown_order(record: RunningRecord, rules: Rules) -> float:
    """Return the order up to which the rows of a record show lines, cycles per input turn."""
    return rules.nyquist_share * (np.pi * record.sample_rate / abs(record.input_speed))


def _middle(record: RunningRecord) -> float:
    """Return the time from the start of the session to the middle of a record, s."""
    # If the first time is not within one row of zero, the clock has another origin than the record.
    own_clock = abs(record.time[0]) * record.sample_rate <= 1.0
    start = 0.0 if own_clock else record.time[0]
    return float(record.elapsed + (record.time[0] + record.time[-1]) / 2.0 - start)


def _sensor_covariance(line: OrderLines, rig: Rig, stiffness: float) -> NDArray[np.float64]:
    """Return the covariance of one record's features, shape (n_features, n_features)."""
    m = len(line.orders)
    size = len(MEANS) + 2 * m * len(CHANNELS)
    covariance = np.zeros((size, size))
    # Indices of the mean (0) and the lines (1 .. 2 m) of each channel among the features.
    places = [
        np.concatenate([[channel] if channel in MEANS else [-1], len(MEANS) + 2 * m * channel
                        + np.arange(2 * m)])
        for channel in range(len(CHANNELS))
    ]  # fmt: skip
    for one, first in enumerate(places):
        for other, second in enumerate(places):
            share = line.row_covariance[one, other] / line.row_covariance[one, one]
            block = share * line.covariance[one]
            rows, columns = first >= 0, second >= 0
            covariance[np.ix_(first[rows], second[columns])] += block[np.ix_(rows, columns)]
    # The load is taken from the measured output torque, whose error changes the predicted torsion.
    covariance[0, 0] += line.covariance[2, 0, 0] / stiffness**2
    return covariance


def _load_variance(record: RunningRecord) -> float:
    """Return the variance of the mean output torque by errors of its sensor, (N.m)^2."""
    errors = record.reading_errors
    return sum(error.size**2 for error in errors if error.channel == "output_torque")


def unexpected_lines(
    features: Features, ratio: float, rig: Rig, rules: Rules = RULES
) -> list[dict[float, float]]:
    """Return where the residual of each record exceeds the noise, beyond the features' orders.

    For each record the power, summed over channels, by order in cycles per input turn.
    """
    found = []
    for record in features.records:
        orders, amplitudes = residual_spectrum(
            record, rig, ratio, features.orders, rules.highest_order
        )
        power = amplitudes**2
        threshold = np.log(power.size * len(features.records) / rules.unexpected_line_chance)
        beyond = np.flatnonzero(power.max(axis=0) > threshold)
        sizes = power[:, beyond].sum(axis=0)
        found.append(dict(zip(orders[beyond].round(9).tolist(), sizes.tolist(), strict=True)))
    return found


def unexpected_orders(
    lines: Sequence[dict[float, float]], ratio: float, rules: Rules = RULES
) -> list[float]:
    """Return the orders of unexpected lines of several records, the strongest first.

    In total; fixed frequencies, whose order differs from record to record, do not add up and come
    last.
    """
    total: Counter[float] = Counter()
    for one in lines:
        total.update(one)
    strongest: list[float] = []
    for order in sorted(total, key=lambda one: -total[one]):
        if all(abs(order - other) > 2.5 / ratio for other in strongest):
            strongest.append(order)
    return strongest[: rules.most_unexpected_lines]
