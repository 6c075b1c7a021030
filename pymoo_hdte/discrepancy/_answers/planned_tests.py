"""Possible tests, and the predictions of fitted models for them, with their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.separation import unimitated
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, flanks_held
from pymoo_hdte.discrepancy._evidence.order_lines.features import Features
from pymoo_hdte.discrepancy._evidence.order_lines.objective import Objective
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import TorsionPoints
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.rattling import clearances
from pymoo_hdte.drive import DriveEffect
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

_SPEEDS = 4
_LOADS = (0.0, 0.5, 1.0)
"""Loads of the grid, as shares of the largest measured."""
_SWEEP_SHARE = 0.25
"""Range of the sweep through zero, as a share of the largest load."""
_LEG_POINTS = 16
_ROWS = 30
"""Rows of a torsion record averaged into one point of the sweep."""

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted model and its predictions for every test, in units of the noise.

    ``predicted`` has shape (n_tests, f); ``influence``, shape (n_tests, f, p), is that of the
    parameters in units of their own uncertainty. Where a test has no ``steady`` state (n_tests,) by
    the model, it predicts nothing there.
    """

    label: str
    predicted: Values
    influence: Values
    steady: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Grid:
    """Possible tests: running records, then a sweep through zero torque.

    ``repeats`` tells which of the running records the campaign has already, shape (n_running,).
    """

    data: Data
    speed_rpm: Values
    load_torque: Values
    slopes: Values
    repeats: NDArray[np.bool_]

    @classmethod
    def of(cls, finding: DriveFinding) -> Grid:
        """Return tests within the speeds and loads of the training records."""
        features = finding.data.features
        conditions = features.conditions
        measured = np.unique([abs(record.input_speed) for record in features.records])
        places = np.linspace(0, len(measured) - 1, min(_SPEEDS, len(measured))).round().astype(int)
        largest = max(abs(record.load_torque) for record in features.records)
        grid = np.array(
            [(speed, share * largest) for speed in measured[places] for share in _LOADS]
        )
        speed, load = grid.T
        distance = np.abs(speed[:, None] - np.abs(conditions.input_speed))
        nearest = np.argmin(distance, axis=1)
        planned = Features(
            records=tuple(features.records[k] for k in nearest),
            conditions=Conditions(
                speed,
                load,
                np.full(len(grid), conditions.elapsed.max()),
                conditions.bends[nearest],
                fading=None if conditions.fading is None else conditions.fading[nearest],
            ),
            orders=features.orders,
            values=np.zeros((len(grid), features.values.shape[1])),
            covariance=features.covariance[nearest],
            shown=None if features.shown is None else features.shown[nearest],
        )
        sweep = _sweep(_SWEEP_SHARE * largest, finding.campaign.rig.torsion_angle_noise)
        data = replace(finding.data, features=planned, torsion=(sweep,) if largest else ())
        data = _moving_as_predicted(data, finding.verdict.accepted)
        # Slopes without effects serve for all models: they suffice for the uncertainty of a test.
        slopes = Objective(data, ()).slopes_at(finding.verdict.base.values)
        made = [(record.input_speed, record.load_torque) for record in finding.campaign.running]
        repeats = np.isclose(grid[:, None], made).all(axis=2).any(axis=1)
        return cls(data, speed / REVOLUTION_PER_MINUTE, load, slopes, repeats)

    def model(self, fitted: Fit) -> Model:
        """Return the predictions of a fit with their uncertainty."""
        objective = Objective(self.data, fitted.candidates, self.slopes)
        scale = Layout(fitted.parameters).array("scale")
        covariance = fitted.covariance / np.outer(scale, scale)
        size, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.clip(size, 0.0, None))
        label = "+".join(candidate.label for candidate in fitted.candidates) or "base"
        influence = objective.jacobian(fitted.values) @ root
        predicted, steady = self._predicted(fitted.values[: len(self.data.base)], fitted.effects)
        names = {candidate.name for candidate in fitted.candidates}
        names |= {effect.name for effect in self.data.campaign.believed.effects}
        if names & clearances():
            # Such records would not be fitted, whatever holds the flanks in the model: without
            # lines of their own, by their load alone.
            data, running = self.data, slice(len(self.speed_rpm))
            steady[running] &= flanks_held(data.features, data.campaign.torque_scale, data.rules)
        return Model(label, predicted, self._by_test(influence), steady)

    def predict(self, base: Values, effects: Sequence[DriveEffect]) -> Values:
        """Return predictions in units of the noise, (n_tests, f)."""
        return self._predicted(base, effects)[0]

    def _predicted(
        self, base: Values, effects: Sequence[DriveEffect]
    ) -> tuple[Values, NDArray[np.bool_]]:
        """Return the same, and which tests have a steady state."""
        prediction = self.data.prediction(base[None], effects)
        running = self.data.whiten(self.data.features.of_prediction(prediction))[0]
        torsion = np.nan_to_num(self.data.torsion_residuals(base[None], effects)[0])
        predicted = self._by_test(np.concatenate([running, torsion])[:, None])[..., 0]
        sweeps = np.ones(len(self.data.torsion), dtype=bool)
        return predicted, np.append(prediction.balance.converged, sweeps)

    def _by_test(self, rows: Values) -> Values:
        """Return rows (n, p) of running records, sweep and priors as (n_tests, f, p)."""
        records, size = self.data.features.values.shape
        by_test = np.zeros((records + len(self.data.torsion), size, rows.shape[1]))
        by_test[:records] = rows[: records * size].reshape(records, size, -1)
        for points in self.data.torsion:
            length = min(len(points.angle) - 1, size)
            by_test[records, :length] = rows[records * size : records * size + length]
        return by_test

    def condition(self, test: int) -> tuple[str, float | None, float | None, str]:
        """Return a test in words, its speed (r/min), its load (N.m) and its kind."""
        if test >= len(self.speed_rpm):
            reach = float(self.data.torsion[0].path.max())
            what = f"a torsion sweep through zero between -{reach:.3g} and {reach:.3g} N.m"
            return what, None, None, "torsion_sweep"
        speed, load = float(self.speed_rpm[test]), float(self.load_torque[test])
        record = "a repeat of the record" if self.repeats[test] else "a record"
        what = f"{record} at {speed:.4g} r/min with {load:.3g} N.m"
        return what, speed, load, "running"


def _moving_as_predicted(data: Data, fitted: Fit) -> Data:
    """Return data in whose records the input moves as the loop of a fitted drive lets it.

    All models will be asked what follows from the same motion, as it will be measured.
    """
    prediction = data.prediction(fitted.values[None, : len(data.base)], fitted.effects)
    lead = np.nan_to_num(prediction.phasors[0, :, 3])
    share = np.zeros(lead.shape)
    conditions = replace(data.features.conditions, lead=lead, lead_share=share)
    return replace(data, features=replace(data.features, conditions=conditions))


def separation(model: Model, rival: Model) -> Values:
    """Return the chi-square of the difference in every test, shape (n_tests,).

    Zero where the drive would rattle by one of them: such a record is not fitted.
    """
    difference = (rival.predicted - model.predicted)[..., None]
    columns = np.concatenate([difference, model.influence, rival.influence], axis=2)
    # The unknowns of both models are known to their own uncertainty, the unit of the influence.
    known = np.diag(np.r_[0.0, np.ones(columns.shape[2] - 1)])
    separations = unimitated(np.swapaxes(columns, 1, 2) @ columns + known, 1)[:, 0, 0]
    return np.where(model.steady & rival.steady, separations, 0.0)


def _sweep(reach: float, noise: float) -> TorsionPoints:
    """Return a planned sweep 0, reach, -reach, reach N.m whose rows have this noise, rad."""
    legs = [
        np.linspace(start, end, points + 1)
        for start, end, points in (
            (0.0, reach, _LEG_POINTS // 2),
            (reach, -reach, _LEG_POINTS),
            (-reach, reach, _LEG_POINTS),
        )
    ]
    path = np.concatenate(legs)
    # Turning points are listed twice; nothing is measured between the two.
    intervals = np.flatnonzero(np.diff(path))
    return TorsionPoints(
        torque=(path[intervals] + path[intervals + 1]) / 2.0,
        angle=np.zeros(len(intervals)),
        covariance=np.eye(len(intervals)) * noise**2 / _ROWS,
        path=path,
        intervals=intervals,
    )
