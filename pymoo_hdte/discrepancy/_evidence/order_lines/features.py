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
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ncx2

from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import orders_that_fold
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions, Prediction
from pymoo_hdte.discrepancy._evidence.order_lines.wander import (
    NEIGHBOURS,
    WHOLE,
    line_variances,
    wander_of_lines,
)
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.line_fit import (
    CHANNELS,
    OrderLines,
    order_lines,
    unsteady_lines,
)
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._records.residual_spectrum import residual_phasors
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules

_SPREAD = 0.1
"""Most power of a line that differs between records, as a share of what they have in common. Below
six tenths of the resonance of the load, a static error moves the output by 1 to 1.6 times itself,
which is .05; where an error changes with the load, as much again. Random phases give .5 and more.
"""
_TAKEN_FOR_TONE = 0.01
"""Chance that a line of that spread is taken for a tone of a scale."""
_GUARD = 2
"""Neighbours on either side that a line may leak into."""
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
        Covariance of the sensors' noise only.
    shown : ndarray of bool, shape (r, m), optional
        Which lines each record shows, and is judged by; by default all.
    wander : ndarray, shape (r, m), optional
        Variance of the lines of the input angle by what the motor does beside its loop, rad2: see
        `wander_of_lines`; by default none.
    ends : complex ndarray, shape (r, 2, m), optional
        Lines of the input's acceleration by what is not known of its speed at either end of a
        record, rad/s2: see `unsteady_lines`; by default none.
    """

    records: tuple[RunningRecord, ...]
    conditions: Conditions
    orders: NDArray[np.float64]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    shown: NDArray[np.bool_] | None = None
    wander: NDArray[np.float64] | None = None
    ends: NDArray[np.complex128] | None = None

    def rows(self, rows: NDArray[np.int_]) -> Features:
        """Return the features of some of the records."""
        return Features(
            tuple(self.records[row] for row in rows),
            self.conditions.rows(rows),
            self.orders,
            self.values[rows],
            self.covariance[rows],
            None if self.shown is None else self.shown[rows],
            None if self.wander is None else self.wander[rows],
            None if self.ends is None else self.ends[rows],
        )

    @property
    def only_exciting(self) -> list[float]:
        """Orders of lines of the input that no record is judged by."""
        return [] if self.shown is None else self.orders[~self.shown.any(axis=0)].tolist()

    @cached_property
    def judged(self) -> NDArray[np.bool_]:
        """Which features are measured, and not those of lines that are not shown: (r, n)."""
        if self.shown is None:
            return np.ones(self.values.shape, dtype=bool)
        means = np.ones((len(self.shown), len(MEANS)), dtype=bool)
        return np.hstack([means, *[self.shown] * (2 * len(CHANNELS))])

    def of_prediction(self, prediction: Prediction) -> NDArray[np.float64]:
        """Return predicted features, shape (v, r, n_features)."""
        phasors = prediction.phasors
        if self.shown is not None:
            phasors = np.where(self.shown[:, None], phasors, 0.0)
        return stack(prediction.mean, phasors)

    def places(self, channel: int) -> NDArray[np.int_]:
        """Return the indices (m, 2) of a channel's real and imaginary parts among the features."""
        m = len(self.orders)
        start = len(MEANS) + 2 * m * channel
        return start + np.array([np.arange(m), m + np.arange(m)]).T


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
    only_exciting: Sequence[float] = (),
) -> Features:
    """Return the features of records, each at those of the orders that it shows.

    By lines at some of them, which are ``only_exciting``, no record is judged.

    Raises
    ------
    InvalidInput
        For orders that a record cannot tell apart.
    """
    ratio, rig = campaign.believed.ratio, campaign.rig
    all_orders = np.array(orders)
    shown = np.array([all_orders <= shown_order(record, rules) for record in records])
    measured = [
        order_lines(record, rig, ratio, all_orders[of_record], orders_that_fold(rig))
        for record, of_record in zip(records, shown, strict=True)
    ]
    lines = [
        _at_all_orders(line, all_orders, of_record)
        for line, of_record in zip(measured, shown, strict=True)
    ]
    conditions = Conditions(
        input_speed=np.array([line.slope[3] for line in lines]),
        output_torque=np.array([line.mean[2] for line in lines]),
        elapsed=np.array([_middle_time(record) for record in records]),
        bends=np.array([line.bends for line in lines]),
        temperature=np.array([record.temperature for record in records], dtype=float),
        input_angle=np.array([line.mean[3] for line in lines]),
        fading=np.array([line.fading for line in lines]),
        folded=np.array([line.folded for line in lines]),
        travel=np.array(
            [abs(record.input_angle[-1] - record.input_angle[0]) for record in records]
        ),
    )
    wander = np.zeros(shown.shape)
    for row, of_lines in enumerate(wander_of_lines(records, campaign, measured, rules)):
        wander[row, shown[row]] = of_lines
    lead_share = wander / (wander + np.array([line_variances(line) for line in lines]))
    unsteady, ends = np.zeros((2, len(records), 2, len(all_orders)), dtype=complex)
    for row in np.flatnonzero(wander.any(axis=1)).tolist():
        of_record = shown[row]
        rates = unsteady_lines(records[row], ratio, measured[row], lead_share[row, of_record])
        unsteady[row][:, of_record], ends[row][:, of_record] = rates
    conditions = replace(
        conditions,
        lead=np.array([line.phasors[3] for line in lines]),
        lead_share=lead_share,
        unsteady=unsteady,
    )
    shown &= ~np.isin(all_orders, only_exciting)
    values = np.array(
        [
            stack(line.mean, np.where(of_record, line.phasors, 0.0))
            for line, of_record in zip(lines, shown, strict=True)
        ]
    )
    stiffness = campaign.believed.stiffness
    covariance = np.array([_sensor_covariance(line, rig, stiffness) for line in lines])
    # The load is the measured output torque, whose error also shifts the predicted input torque.
    covariance[:, 1, 1] += [_load_variance(record) / ratio**2 for record in records]
    return Features(
        tuple(records),
        conditions,
        all_orders,
        values,
        covariance,
        None if shown.all() else shown,
        wander,
        ends,
    )


def _at_all_orders(
    lines: OrderLines, orders: NDArray[np.float64], shown: NDArray[np.bool_]
) -> OrderLines:
    """Return lines of a record at all orders; those that it does not show are zero.

    These get the mean variance of the others, because a covariance cannot be zero.
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
    courses = {}
    for name in ("bends", "fading", "folded"):
        of_known = getattr(lines, name)
        courses[name] = np.zeros((*of_known.shape[:-1], 1 + m), dtype=complex)
        courses[name][..., known] = of_known
    return replace(lines, orders=orders, phasors=phasors, covariance=covariance, **courses)


def shown_order(record: RunningRecord, rules: Rules) -> float:
    """Return the order up to which the rows of a record show lines, cycles per input turn."""
    return rules.nyquist_share * (np.pi * record.sample_rate / abs(record.input_speed))


def _middle_time(record: RunningRecord) -> float:
    """Return the time from the start of the session to the middle of a record, s."""
    # A first time further than one row from zero shows that the clock does not start at the record.
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
    for a, places_a in enumerate(places):
        for b, places_b in enumerate(places):
            share = line.row_covariance[a, b] / line.row_covariance[a, a]
            block = share * line.covariance[a]
            rows, columns = places_a >= 0, places_b >= 0
            covariance[np.ix_(places_a[rows], places_b[columns])] += block[np.ix_(rows, columns)]
    # The load is the measured output torque, whose error changes the predicted torsion.
    covariance[0, 0] += line.covariance[2, 0, 0] / stiffness**2
    return covariance


def _load_variance(record: RunningRecord) -> float:
    """Return the variance of the mean output torque by errors of its sensor, (N.m)^2."""
    errors = record.reading_errors
    return sum(error.size**2 for error in errors if error.channel == "output_torque")


class _Spectrum(NamedTuple):
    """Orders and phasors (5, k) of what lines leave of a record, and its raw samples."""

    orders: NDArray[np.float64]
    phasors: NDArray[np.complex128]
    samples: int


def unexpected_lines(
    features: Features, ratio: float, rig: Rig, rules: Rules = RULES, coarse: bool = False
) -> list[dict[float, float]]:
    """Return the lines outside the features' orders at which each record exceeds the noise.

    Each record has a mapping of orders, in cycles per input turn, to powers summed over channels.
    The input moves as it likes, so that what it alone does counts only as what a motor may do: in
    whole cycles of its turn, and beyond what it does beside them. A ``coarse`` scale shows tones of
    its own, which start anywhere in each record: elsewhere, what no torque shows is then a line
    only where the output has it at the same angle in all records.
    """
    spectra = []
    for record in features.records:
        orders, phasors = residual_phasors(record, rig, ratio, features.orders, rules.highest_order)
        samples = len(record.time) * record.samples_averaged
        spectra.append(_Spectrum(orders.round(9), phasors, samples))
    lines = []
    for spectrum in spectra:
        orders, powers = spectrum.orders, np.abs(spectrum.phasors) ** 2
        power, of_output = powers[: len(CHANNELS)], powers[-1]
        threshold = np.log(power.size * len(spectra) / rules.unexpected_line_chance)
        seen = (power[:3] > threshold).any(axis=0)
        whole = np.abs(orders - orders.round()) < WHOLE
        if coarse:
            by_angles = seen & ~whole & ~(power[1:3] > threshold).any(axis=0)
            for place in np.flatnonzero(by_angles).tolist():
                shown = of_output[place] > threshold
                seen[place] = shown and _is_common(spectra, orders[place])
        for place in np.flatnonzero(whole).tolist():
            seen[place] |= power[3, place] > _threshold_at(place, power[3], threshold)
        beyond = np.flatnonzero(seen)
        sizes = power[:, beyond].sum(axis=0)
        lines.append(dict(zip(orders[beyond].tolist(), sizes.tolist(), strict=True)))
    return lines


def _is_common(spectra: Sequence[_Spectrum], order: float) -> bool:
    """Tell whether a line of the transmission error may be the same in all records.

    The phasors of n records, whose noise is of one size, have a part in common, and n - 1 in which
    they differ; what these have is noncentral chi-square where the amplitudes spread.
    """
    reaching = [
        (spectrum.phasors[0, places[0]], spectrum.samples)
        for spectrum in spectra
        if (places := np.flatnonzero(spectrum.orders == order)).size
    ]
    if len(reaching) < 2:
        return True
    phasors, samples = map(np.array, zip(*reaching, strict=True))
    common = np.abs(np.sqrt(samples) @ phasors) ** 2 / samples.sum()
    differing = np.sum(np.abs(phasors) ** 2) - common
    chance = ncx2.sf(2.0 * differing, 2 * (len(reaching) - 1), 2.0 * _SPREAD * common)
    return bool(chance > _TAKEN_FOR_TONE)


def _threshold_at(place: int, power: NDArray[np.float64], threshold: float) -> float:
    """Return the power that a line exceeds no more often by chance than noise the ``threshold``.

    Where its neighbours show more than noise, their mean is the measure. Of n of them it is not
    exact: a line exceeds c times it by chance in (1 + c / n)^-n of all cases, not in exp(-c).
    """
    below = power[max(place - _GUARD - NEIGHBOURS, 0) : max(place - _GUARD, 0)]
    near = np.concatenate([below, power[place + _GUARD + 1 :][:NEIGHBOURS]])
    n = near.size
    if not n or near.sum() <= chi2.isf(np.exp(-threshold), 2 * n) / 2.0:
        return threshold
    return float(near.mean() * n * np.expm1(threshold / n))


def unexpected_orders(
    lines: Sequence[dict[float, float]], ratio: float, rules: Rules = RULES
) -> list[float]:
    """Return the orders of unexpected lines of several records, the strongest first.

    The total power counts. Fixed frequencies, whose order differs between records, do not add up
    and come last.
    """
    total: Counter[float] = Counter()
    for powers in lines:
        total.update(powers)
    strongest: list[float] = []
    for order in sorted(total, key=lambda order: -total[order]):
        if all(abs(order - stronger) > 2.5 / ratio for stronger in strongest):
            strongest.append(order)
    return strongest[: rules.most_unexpected_lines]
