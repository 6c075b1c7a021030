"""Validation on records that were not fitted: the error of the model before and after.

Differences are taken between means and order lines, measured and predicted at the loads measured;
their squares add up to a `PredictionError`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._records.cleaning.settling import unsettled_rows
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.prediction_error import DEVIATIONS, PredictionError
from pymoo_hdte.drive import OrderSpectrum
from pymoo_hdte.units import ARCSEC, UNITS
from pymoo_hdte.validation import ValidationMetrics, validation_metrics

_OVERLAY_TURNS = 2.0
_OVERLAY_POINTS = 400

__all__ = ["Overlay", "PredictionError", "Validation", "validate_drive"]

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Overlay:
    """One channel of one held-out record over the input angle, its measured mean taken out.

    Attributes
    ----------
    channel : str
    turns : ndarray, shape (p,)
        Input turns.
    measured, before, after : ndarray, shape (p,)
        From order lines, in ``unit``.
    sample_turns, samples : ndarray, shape (n,)
        The raw samples within these turns.
    unit : str
    """

    channel: str
    turns: Values
    measured: Values
    before: Values
    after: Values
    sample_turns: Values
    samples: Values
    unit: str


@dataclass(frozen=True, eq=False)
class Validation:
    """Prediction errors on the held-out records.

    Attributes
    ----------
    records : tuple of str, length r
    channels : dict of PredictionError
        By name of the channel, over all records.
    overall : PredictionError
        Over all features, whitened by their full covariance: 1 for a perfect model.
    by_record : tuple of PredictionError, length r
        Of the transmission error.
    orders : ndarray, shape (1 + m,)
        0 for the mean, then the order lines.
    by_order : tuple of PredictionError, length 1 + m
        Of the transmission error.
    dte : ndarray, shape (3, r)
        Peak-to-peak over one output turn, arcsec, of the sum of the order lines of the transmission
        error: measured, before, after.
    metrics : tuple of ValidationMetrics, or None
        Of ``dte`` before and after; None for fewer than two records.
    leading : str
        Channel in which the error of the base is largest in units of the noise.
    worst : str
        Record with the largest error of the base in that channel, in multiples of the noise floor.
    overlays : tuple of Overlay
        Transmission error and one torque of that record.
    """

    records: tuple[str, ...]
    channels: dict[str, PredictionError]
    overall: PredictionError
    by_record: tuple[PredictionError, ...]
    orders: Values
    by_order: tuple[PredictionError, ...]
    dte: Values
    metrics: tuple[ValidationMetrics, ValidationMetrics] | None
    leading: str
    worst: str
    overlays: tuple[Overlay, ...]

    @property
    def worse(self) -> tuple[str, ...]:
        """What the correction made worse: channels, ``overall``, and records by their name.

        Of a record, its transmission error.
        """
        errors = {**self.channels, "overall": self.overall}
        records = zip(self.records, self.by_record, strict=True)
        return tuple(name for name, error in (*errors.items(), *records) if error.worse)

    def as_dict(self) -> dict[str, Any]:
        """Return the entry in the verdict as plain values, the transmission error first."""
        metrics = None
        if self.metrics is not None:
            metrics = {
                name: asdict(metric)
                for name, metric in zip(("before", "after"), self.metrics, strict=True)
            }
        return self.channels["transmission_error"].as_dict() | {
            "overall": self.overall.as_dict(),
            "channels": {name: error.as_dict() for name, error in self.channels.items()},
            "leading_channel": self.leading,
            "worse": list(self.worse),
            "records": {
                name: error.as_dict()
                for name, error in zip(self.records, self.by_record, strict=True)
            },
            "orders": {
                f"{order:.6g}": error.as_dict()
                for order, error in zip(self.orders, self.by_order, strict=True)
            },
            "dte_arcsec": dict(
                zip(("measured", "before", "after"), self.dte.tolist(), strict=True)
            ),
            "dte_metrics": metrics,
        }


def validate_drive(finding: DriveFinding) -> Validation | None:
    """Return the errors on the held-out records, or None where there are none.

    The loads are those measured. Where the verdict names nothing, nothing was added, so that
    before and after are the same.
    """
    data = finding.held_out
    if data is None:
        return None
    fits = (finding.verdict.base, finding.verdict.accepted)
    predicted = np.array([_predict(data, fitted) for fitted in fits])
    difference = predicted - data.features.values
    white = data.whiten(difference).reshape(len(fits), len(data.features.records), -1)
    overall = np.sqrt(np.mean(white**2, axis=(1, 2)))
    change = difference[1] - difference[0]
    misfit = finding.verdict.accepted.misfit
    # Contributions of each mean and line to the squares (2, r, channel, 1 + m), and of the noise.
    squares = np.stack([_squares(data, difference**2, channel) for channel in range(3)], axis=2)
    noise = np.diagonal(data.covariance, axis1=1, axis2=2)
    floor = np.stack([_squares(data, noise, channel) for channel in range(3)], axis=1)
    chance = np.stack([_chance(data, change, misfit, channel) for channel in range(3)], axis=1)
    errors = {
        name: _gap(
            data,
            squares[:, :, place].sum(axis=2),
            floor[:, place].sum(axis=1),
            chance[:, place],
            name,
        )
        for place, name in enumerate(SHOWN_IN)
    }
    moved = (white[1] - white[0]).ravel()
    overall_chance = 2.0 * float(np.linalg.norm(moved)) * misfit**0.5 / moved.size
    error, error_floor = squares[:, :, 0], floor[:, 0]
    leading = max(errors, key=lambda name: _height(errors[name]))
    # What decides is asked first; one of the others grows by chance the more easily.
    others = len(errors) - 1 + len(data.features.records)
    errors = {
        name: replace(error, among=2 if name == leading else others)
        for name, error in errors.items()
    }
    beside = "input_torque" if leading == "transmission_error" else leading
    place = CHANNELS.index(leading)
    worst = int(np.argmax(squares[0, :, place].sum(axis=1) / floor[:, place].sum(axis=1)))
    dte = np.array([_dte(data, features) for features in (data.features.values, *predicted)])
    return Validation(
        records=tuple(record.name for record in data.features.records),
        channels=errors,
        overall=PredictionError(
            float(overall[0]), float(overall[1]), 1.0, DEVIATIONS, data.rules, overall_chance, 2
        ),
        by_record=tuple(
            _gap(
                data,
                error[:, [k]].sum(axis=2),
                error_floor[[k]].sum(axis=1),
                chance[[k], 0],
                CHANNELS[0],
                others,
            )
            for k in range(error.shape[1])
        ),
        orders=np.array([0.0, *data.features.orders]),
        by_order=tuple(
            _gap(data, error[:, :, k], error_floor[:, k], np.zeros(1), CHANNELS[0])
            for k in range(error.shape[2])
        ),
        dte=dte,
        metrics=_metrics(dte),
        leading=leading,
        worst=data.features.records[worst].name,
        overlays=tuple(
            _overlay(data, predicted, worst, name) for name in ("transmission_error", beside)
        ),
    )


def _predict(data: Data, fitted: Fit) -> Values:
    """Return predicted features, shape (r, f)."""
    return data.predict(fitted.values[None, : len(data.base)], fitted.effects)[0]


def _squares(data: Data, squares: Values, channel: int) -> Values:
    """Return mean squares (..., 1 + m) over a period, from squares of features (..., f)."""
    lines = squares[..., data.features.places(channel)].sum(axis=-1) / 2.0
    if channel in MEANS:
        mean = squares[..., [MEANS.index(channel)]]
    else:
        mean = np.zeros_like(lines[..., :1])
    return np.concatenate([mean, lines], axis=-1)


def _chance(data: Data, change: Values, misfit: float, channel: int) -> Values:
    """Return the standard deviation of the growth of mean squares (r,) by the noise, SI.

    Of a prediction that changes by features (r, f), where noise has a variance of ``misfit`` times
    the stated one: noise alone makes the error of one prediction larger than that of the other.
    """
    weighted = np.zeros_like(change)
    lines = data.features.places(channel).ravel()
    weighted[:, lines] = change[:, lines] / 2.0
    if channel in MEANS:
        mean = MEANS.index(channel)
        weighted[:, mean] = change[:, mean]
    variance = np.einsum("rf,rfg,rg->r", weighted, data.covariance, weighted)
    return np.asarray(2.0 * np.sqrt(misfit * variance))


def _gap(
    data: Data, squares: Values, noise: Values, chance: Values, channel: str, among: int = 1
) -> PredictionError:
    """Return the error from mean squares (2, r), those of the noise (r,), and `_chance` (r,)."""
    unit, size = SHOWN_IN[channel]
    before, after = np.sqrt(squares.mean(axis=1)) / size
    floor = float(np.sqrt(noise.mean()) / size)
    by_chance = float(np.linalg.norm(chance)) / squares.shape[1] / size**2
    return PredictionError(float(before), float(after), floor, unit, data.rules, by_chance, among)


def _height(error: PredictionError) -> float:
    return error.before / error.noise_floor


def _phasors(data: Data, features: Values, channel: int) -> NDArray[np.complex128]:
    """Return the order lines (..., m) of a channel from features (..., f)."""
    places = data.features.places(channel)
    return features[..., places[:, 0]] + 1j * features[..., places[:, 1]]


def _dte(data: Data, features: Values) -> Values:
    """Return the peak-to-peak over one output turn of the sum of the lines of features (r, f)."""
    spectrum = OrderSpectrum(data.features.orders, _phasors(data, features, 0))
    return spectrum.peak_to_peak(data.campaign.believed.ratio) / ARCSEC


def _metrics(dte: Values) -> tuple[ValidationMetrics, ValidationMetrics] | None:
    if dte.shape[1] < 2:
        return None
    return validation_metrics(dte[1], dte[0]), validation_metrics(dte[2], dte[0])


def _overlay(data: Data, predicted: Values, record: int, name: str) -> Overlay:
    """Return measured, before and after of a record, from the start of its first settled turn."""
    unit, size = SHOWN_IN[name]
    channel = CHANNELS.index(name)
    raw = data.features.records[record]
    settled = raw.input_angle[unsettled_rows(raw) :]
    start_turn = np.ceil(settled.min() / (2.0 * np.pi))
    turns = np.linspace(0.0, _OVERLAY_TURNS, _OVERLAY_POINTS)
    waves = np.exp(2j * np.pi * np.outer(data.features.orders, start_turn + turns))
    measured = data.features.values[record]
    samples = _samples(data, raw, channel)
    # The mean of the output torque is a condition, the same in all three.
    own_mean = measured[MEANS.index(channel)] if channel in MEANS else samples.mean()

    def curve(features: Values) -> Values:
        mean = features[MEANS.index(channel)] if channel in MEANS else own_mean
        moving = (_phasors(data, features, channel) @ waves).real
        return np.asarray((mean - own_mean + moving) / size)

    sample_turns = raw.input_angle / (2.0 * np.pi) - start_turn
    shown = (sample_turns >= 0.0) & (sample_turns <= _OVERLAY_TURNS)
    return Overlay(
        name,
        turns,
        curve(measured),
        curve(predicted[0, record]),
        curve(predicted[1, record]),
        sample_turns[shown],
        (samples[shown] - own_mean) / size,
        unit,
    )


def _samples(data: Data, record: RunningRecord, channel: int) -> Values:
    """Return the rows of a channel of `SHOWN_IN`, SI."""
    error = record.transmission_error(data.campaign.believed.ratio)
    return (error, record.input_torque, record.output_torque)[channel]


SHOWN_IN = {
    "transmission_error": ("arcsec", UNITS["angle"]["arcsec"]),
    "input_torque": ("mN.m", UNITS["torque"]["mN.m"]),
    "output_torque": ("mN.m", UNITS["torque"]["mN.m"]),
}
"""Channels whose error is shown, with their unit and its size in SI."""
