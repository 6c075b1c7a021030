"""Relative errors of laws in the lines of a drive, and what no law of the library holds.

The relative error of a law is a Gaussian process over its arguments. Speed and load change from
record to record, so that it multiplies what the law does in each. A law of the torsion also errs
within a turn: there it is the law itself times smooth functions of the torsion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.corrections import Correction, LoadRate
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS, step_variances
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, Response
from pymoo_hdte.discrepancy._selection.linearised import linearise, modulated
from pymoo_hdte.discrepancy._selection.process import TERMS, sine_of, sines_of
from pymoo_hdte.discrepancy._selection.score import Linearised, Sized, groups_of
from pymoo_hdte.drive import DriveEffect, LawAtPort
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import Behaviour, Law, PortState
from pymoo_hdte.effects.law import Response as Torque
from pymoo_hdte.effects.ripple import PeriodicTorque

Matrix = NDArray[np.float64]

LENGTH = 1.0
"""Length over which a relative error changes, where the argument runs from -1 to 1: half of it.

Its process has one derivative (Matern, 3/2): one with all of them, known at some records, would be
known at the others to a ten-thousandth, which no error of a law is.
"""
_NOTHING = 1e-12
"""Values for which a residual counts that is zero by definition."""
_SMALLEST = 1e-9
"""Least share of the variance of a process for which a direction counts."""
REPEATABLE = (0.03, 30.0)
"""Range of what the mean of a record is off by, in standard deviations of its noise."""
STATED = (0.03, 2.0)
"""Range of what the static error of a record is off by beyond what is stated, as a multiple of
that: who states it may be wrong by a factor of two, as of the noise."""
_FREQUENCY_LENGTH = 0.3
"""Length over which a response errs, where the logarithm of the frequency runs from -1 to 1."""
_STEP = 0.01
"""Relative step by which a law is changed to see what follows."""
_RATES = (1, 2, 3, 4)
"""Derivatives of the load's acceleration: a line that a coupling delays by a third of a radian
needs no more for a hundredth of its torque."""


@dataclass(frozen=True, eq=False)
class ScaledLaw(Behaviour):
    """A law times a small smooth function of the torsion."""

    law: Law
    travel: float
    number: int
    size: float

    @property
    def orders(self) -> tuple[float, ...]:
        """Those of the law."""
        return self.law.orders

    @property
    def loaded(self) -> bool:  # type: ignore[override]
        """As the law."""
        return self.law.loaded

    @property
    def warmed(self) -> bool:  # type: ignore[override]
        """As the law."""
        return self.law.warmed

    def respond(self, state: PortState) -> Torque:
        """Return torque and tangents."""
        response = self.law.respond(state)
        factor, slope = sine_of(self.number, state.position / self.travel)
        factor, slope = self.size * factor, self.size * slope / self.travel
        return Torque(
            response.torque * factor,
            response.slope * factor + response.torque * slope,
            response.damping * factor,
        )

    def with_input_locked(self) -> Law | None:
        """Return the law with the input locked, times the same function."""
        locked = self.law.with_input_locked()
        return None if locked is None else ScaledLaw(locked, self.travel, self.number, self.size)


@dataclass(frozen=True, eq=False)
class LawErrors:
    """Hypotheses of a campaign as the score takes them.

    Attributes
    ----------
    data : Data
    base : Fit
        Without effects.
    """

    data: Data
    base: Fit

    @property
    def n_rows(self) -> int:
        """Number of residuals of the data."""
        return self.data.features.values.size + self.data.n_sweep_residuals

    @cached_property
    def channels(self) -> NDArray[np.int_]:
        """Channel of each residual, that of sweeps last."""
        channels = np.zeros(self.n_rows, dtype=int)
        for channel, rows in enumerate(self.data.rows_of_parts()):
            channels[rows] = channel
        return channels

    @cached_property
    def records(self) -> NDArray[np.int_]:
        """Record of each residual; sweeps count as one more."""
        n_records, n_features = self.data.features.values.shape
        running = np.repeat(np.arange(n_records), n_features)
        return np.append(running, np.full(self.data.n_sweep_residuals, n_records))

    @property
    def groups(self) -> list[NDArray[np.int_]]:
        """Rows of each record and of each channel."""
        return groups_of(self.records, self.channels)

    @cached_property
    def conditions(self) -> Matrix:
        """A process over speed and load, of deviation 1: its value in each record, shape (r, k)."""
        when = self.data.features.conditions
        speed = np.log(np.abs(when.input_speed))
        half = max(float(np.ptp(speed)) / 2.0, 0.5)
        load = when.output_torque / max(float(np.abs(when.output_torque).max()), 1e-12)
        places = np.column_stack([(speed - speed.mean()) / half, load, np.sign(when.input_speed)])
        apart = np.sqrt(3.0 * np.sum((places[:, None] - places[None]) ** 2, axis=2)) / LENGTH
        values, vectors = np.linalg.eigh((1.0 + apart) * np.exp(-apart))
        kept = values > _SMALLEST * values.max()
        return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))

    @cached_property
    def _by_row(self) -> Matrix:
        """`conditions` for each residual; of sweeps one value of their own, shape (n, k + 1)."""
        n_records, k = self.conditions.shape
        whole = np.zeros((n_records + 1, k + 1))
        whole[:-1, :-1], whole[-1, -1] = self.conditions, 1.0
        return np.asarray(whole[self.records][:, : k + bool(self.data.n_sweep_residuals)])

    def linearised(self, fitted: Fit) -> Linearised:
        """Return a fit as a hypothesis."""

        @cache
        def response() -> Response:
            # A prediction, which only laws of the torsion need.
            return self.data.response(fitted)

        def errors(candidate: Candidate, place: slice) -> list[Matrix]:
            if candidate.releases is not None or not candidate.parameters:
                return []
            values, columns = fitted.values[place], fitted.jacobian[: self.n_rows, place]
            parts = modulated(candidate, values, columns, self._by_row)
            return [*parts, *self._within(candidate, values, response)]

        hypothesis = linearise(fitted, self.channels, errors, shares=self._shares)
        return hypothesis.beside(*self.of_records)

    @cached_property
    def _shares(self) -> Matrix:
        """Values that each residual counts for: nearly none of a line that is not shown.

        Nor of one of the input where the motor does most of it beside its loop: how much that is in
        a record, is estimated from a few lines beside it, and says nothing about the drive. Nor of
        one that is lost in the steps of a torque: rounding makes a few lines large and most small.
        """
        features = self.data.features
        shares = np.where(features.judged, 1.0, _NOTHING)
        if (by_motor := features.conditions.lead_share) is not None:
            of_lead = features.places(CHANNELS.index("input_angle"))
            shares[:, of_lead] *= np.maximum(1.0 - by_motor, _NOTHING)[..., None]
        ratio = self.data.campaign.believed.ratio
        variances = np.diagonal(features.covariance, axis1=1, axis2=2)
        for row, record in enumerate(features.records):
            by_steps = step_variances(record, ratio)
            for channel in np.flatnonzero(by_steps).tolist():
                places = features.places(channel)
                of_rows = 1.0 - by_steps[channel] / variances[row, places]
                shares[row, places] *= np.maximum(of_rows, _NOTHING)
        return np.append(shares.ravel(), np.ones(self.data.n_sweep_residuals))

    @cached_property
    def of_records(self) -> tuple[Sized, ...]:
        """What the mean of a channel is off by in one record, and by something else in the next."""
        shape = self.data.features.values.shape
        sized = []
        for row, channel in enumerate(MEANS):
            values = np.zeros((shape[0], *shape))
            records = np.arange(shape[0])
            values[records, records, row] = self._noise[row]
            columns = self._whole(self.data.whiten(values).T)
            sized.append(
                _error_of_records(f"repeatability of {CHANNELS[channel]}", columns, REPEATABLE)
            )
        return (*sized, self._of_error)

    @property
    def _of_error(self) -> Sized:
        """By how much the static error of each record differs beyond what is stated."""
        changes = self.data.repeatability.swapaxes(0, 1)
        records, shape = np.arange(len(changes)), self.data.features.values.shape
        of_one = np.zeros((*changes.shape[:2], *shape))
        of_one[records, :, records] = changes
        whole = self._whole(self.data.whiten(of_one.reshape(-1, *shape)).T)
        return _error_of_records("repeatability of the static error", whole, STATED)

    @cached_property
    def _noise(self) -> Matrix:
        """Standard deviation of each feature in the middle one of the records, shape (f,)."""
        variances = np.diagonal(self.data.covariance, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.median(variances, axis=0)))

    def _whole(self, columns: Matrix) -> Matrix:
        """Return changes of the running records (n_running, m) as those of all residuals."""
        whole = np.zeros((self.n_rows, columns.shape[1]))
        whole[: len(columns)] = columns
        return whole

    def _within(
        self, candidate: Candidate, values: Matrix, response: Callable[[], Response]
    ) -> Iterator[Matrix]:
        """Yield what a law of the torsion does if it errs within a turn, (n, m)."""
        laws = [
            effect
            for effect in candidate.build([float(value) for value in values])
            if isinstance(effect, LawAtPort) and effect.port == "mesh"
        ]
        travel = self._torque / self.data.campaign.believed.stiffness
        for effect in laws:
            if effect.law.states:
                yield self._springs(travel, response(), float(np.abs(values[0])))
                continue
            changes = [
                response()((Correction("mesh", ScaledLaw(effect.law, travel, k, _STEP)),))
                for k in range(1, TERMS + 1)
            ]
            yield np.column_stack(changes)[: self.n_rows] / _STEP

    def _springs(self, travel: float, response: Response, force: float) -> Matrix:
        """Return what springs do that slip elsewhere, each of a share of the force, (n, m)."""
        shares = np.geomspace(0.01, 1.0, TERMS)
        size = max(_STEP * force, 1e-12)
        changes = [
            response((Correction("mesh", MaxwellSlip(size, share * travel, 1e-3)),))
            for share in shares
        ]
        return np.column_stack(changes)[: self.n_rows] / (_STEP * np.sqrt(TERMS))

    @cached_property
    def outside(self) -> tuple[Sized, ...]:
        """What no law holds: a process over speed and load at each line and mean of a channel.

        And a torque at each port and order, as it shows in all channels. Each has a scale from
        what is visible up to all that is measured.
        """
        return tuple(self._outside())

    def _outside(self) -> Iterator[Sized]:
        features = self.data.features
        n_records, n_features = features.values.shape
        exciting = features.only_exciting
        judged = [order for order in features.orders.tolist() if order not in exciting]
        places = [(f"mean of {CHANNELS[channel]}", [row]) for row, channel in enumerate(MEANS)]
        for channel, name in enumerate(CHANNELS):
            pairs = zip(features.orders.tolist(), features.places(channel).tolist(), strict=True)
            places += [
                (f"order {order:.4g} of {name}", pair) for order, pair in pairs if order in judged
            ]
        k = self.conditions.shape[1]
        for name, rows in places:
            values = np.zeros((len(rows) * k, n_records, n_features))
            for number, row in enumerate(rows):
                block = slice(number * k, (number + 1) * k)
                values[block, :, row] = self._noise[row] * self.conditions.T
            yield self._place(name, self.data.whiten(values).T, len(rows) * n_records)
        yield from self._responses()
        ratio = self.data.campaign.believed.ratio
        for port, slower in (("input", 1.0), ("output", ratio)):
            size = self._torque * slower / ratio
            for order in judged:
                at_port = order * slower
                parts = [
                    self._running(Correction(port, PeriodicTorque(at_port, phase, _STEP * size)))
                    for phase in (0.0, np.pi / 2.0)
                ]
                columns = [self._by_row[: part.size, :k] * part[:, None] for part in parts]
                yield self._place(
                    f"torque of order {order:.4g} at {port}", np.hstack(columns), 2 * n_records
                )
        response = self.data.response(self.base)
        hanging = np.column_stack([response((effect,)) for effect in self._load_series])
        running = features.values.size
        yield self._place("what hangs at the output", hanging[:running], running)
        start = features.values.size
        for points in self.data.torsion:
            torque = points.torque
            place = torque / max(float(np.abs(torque).max()), 1e-12)
            sines = sines_of(place)
            stop = start + len(points.angle) - 1
            swept = np.zeros((self.n_rows, TERMS))
            swept[start:stop] = points.whitening @ sines * np.median(points.deviation)
            start = stop
            yield self._place("torsion sweep", swept, len(points.angle))

    @property
    def _torque(self) -> float:
        """Largest torque at the output, N.m."""
        paths = [np.abs(points.path).max() for points in self.data.torsion]
        return float(max(np.abs(self.data.features.conditions.output_torque).max(), *paths, 0.0))

    @property
    def _load_series(self) -> list[LoadRate]:
        """Torques of a load that hangs on a spring, a damper or both: a series in the rate."""
        believed = self.data.campaign.believed
        inertia = max(believed.load_inertia, believed.output_inertia)
        fastest = np.abs(self.data.features.conditions.input_speed).max()
        return [LoadRate(k, 1e-3 * inertia / fastest**k) for k in _RATES]

    def _running(self, effect: DriveEffect) -> Matrix:
        """Return how a further effect changes the running records of the base, (n_running,).

        To all digits of a prediction, as it may be far larger than the noise.
        """
        base = self.base.values[None, : len(self.data.base)]
        change = self.data.predict(base, (effect,)) - self._unchanged
        return np.nan_to_num(self.data.whiten(change)[0])

    @cached_property
    def _unchanged(self) -> Matrix:
        return self.data.predict(self.base.values[None, : len(self.data.base)], ())

    def _responses(self) -> Iterator[Sized]:
        """Yield relative errors of the response of each channel, smooth over the frequency."""
        features = self.data.features
        predicted = np.nan_to_num(self._unchanged[0])
        speed = np.abs(features.conditions.input_speed)
        frequency = np.log(np.outer(speed, features.orders))
        place = 2.0 * (frequency - frequency.min()) / np.ptp(frequency) - 1.0
        apart = (place.ravel()[:, None] - place.ravel()) ** 2 / _FREQUENCY_LENGTH**2
        values, vectors = np.linalg.eigh(np.exp(-0.5 * apart))
        kept = values > 1e-3 * values.max()
        smooth = (vectors[:, kept] * np.sqrt(values[kept])).T.reshape(-1, *place.shape)
        for channel, name in enumerate(CHANNELS):
            real, imaginary = features.places(channel).T
            change = np.zeros((2, len(smooth), *features.values.shape))
            change[0][..., real] = smooth * predicted[:, real]
            change[0][..., imaginary] = smooth * predicted[:, imaginary]
            change[1][..., real] = -smooth * predicted[:, imaginary]
            change[1][..., imaginary] = smooth * predicted[:, real]
            columns = self.data.whiten(change.reshape(-1, *features.values.shape)).T
            yield self._place(f"response of {name}", columns, 2 * place.size)

    @cached_property
    def _measured(self) -> float:
        """Square of all that is measured, or of the misfit if that is larger, in its noise."""
        measured = float(np.sum(self.data.whiten(self.data.features.values) ** 2))
        return max(measured, self.base.chi_square)

    def _place(self, name: str, columns: Matrix, n_rows: int) -> Sized:
        """Return what may be at a place: from as large as the noise of its rows to all there is.

        Up to the misfit only, it would lose nothing where that is small, and come for nothing
        beside every effect.
        """
        whole, m = self._whole(columns), columns.shape[1]
        size = max(float(np.sum(whole**2)), 1e-24)
        least, most = np.sqrt(n_rows / size), np.sqrt(self._measured / size)
        none = np.zeros(m)
        return Sized(f"outside: {name}", whole, float(least), float(most), none, none > 0.0)


def _error_of_records(name: str, columns: Matrix, scales: tuple[float, float]) -> Sized:
    """Return an error of the records whose scale lies in a range."""
    none = np.zeros(columns.shape[1])
    return Sized(name, columns, *scales, none, none > 0.0, of_records=True)
