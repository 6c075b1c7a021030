"""What a campaign offers a fit: its features with their whole covariance, and its torsion sweeps.

Residuals are whitened by that covariance, so that their sum of squares is a chi-square. The small
changes of the static error from record to record count as noise that the drive's own response
carries to all channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from pymoo_hdte.discrepancy.campaign.campaign import Campaign
from pymoo_hdte.discrepancy.campaign.order_lines import CHANNELS
from pymoo_hdte.discrepancy.drive.candidates import out_of_tolerance
from pymoo_hdte.discrepancy.drive.features import (
    MEANS,
    Features,
    cell_chi_square,
    degrees_of_freedom,
)
from pymoo_hdte.discrepancy.drive.objective import Objective
from pymoo_hdte.discrepancy.drive.parameters import base_parameters
from pymoo_hdte.discrepancy.drive.prediction import Prediction, coefficients_of, predict
from pymoo_hdte.discrepancy.drive.torsion_curve import TorsionPoints, torsion_points
from pymoo_hdte.discrepancy.engine.candidate import Candidate, Layout, Parameter
from pymoo_hdte.discrepancy.engine.excess import Excess
from pymoo_hdte.discrepancy.engine.fitting import Response
from pymoo_hdte.drive import Balance, Effect, mean_torsion

if TYPE_CHECKING:
    from pymoo_hdte.discrepancy.engine.fitting import Fit

Vector = NDArray[np.float64]

PARTS = (*CHANNELS, "torsion_sweep")
"""Of the data, as an `Excess` has them: channels of the running records, and the sweeps."""
NUMERICAL = 1e-4
"""Share of an excess that may be of the integrator's steps: see `rival.EXACT_SHARE`."""


@dataclass(frozen=True, eq=False)
class Data:
    """Features to fit, whitened, for a campaign.

    Attributes
    ----------
    campaign : Campaign
    features : Features
    base : tuple of Parameter
    torsion : tuple of TorsionPoints
        Sweeps with the input locked.
    reference : ndarray, shape (n_base,), optional
        Base values at which the repeatability is carried to all channels; by default the starts.
    reference_effects : tuple of Effect
        Effects that are there then: a resonance that they move magnifies what does not repeat.
    """

    campaign: Campaign
    features: Features
    base: tuple[Parameter, ...]
    torsion: tuple[TorsionPoints, ...] = ()
    reference: Vector | None = None
    reference_effects: tuple[Effect, ...] = ()

    @cached_property
    def whiteners(self) -> NDArray[np.float64]:
        """Lower triangles L, shape (r, f, f), of the `covariance` L L^T of each record."""
        return np.asarray(np.linalg.cholesky(self.covariance), dtype=np.float64)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """Of the features of each record, sensors and repeatability, shape (r, f, f)."""
        layout = Layout(self.base)
        start = layout.array("start") if self.reference is None else self.reference
        return self.features.covariance + self._repeatability(layout, start)

    def _repeatability(self, layout: Layout, start: Vector) -> NDArray[np.float64]:
        """Return the covariance that small changes of the static error give each record."""
        rig, believed = self.campaign.rig, self.campaign.believed
        lines = range(len(believed.error_orders))
        spread = rig.repeatability / max(len(lines), 1) ** 0.5
        moved = [start]
        for line in lines:
            places = [layout.index(f"error_{part}_{line}") for part in ("amplitude", "phase")]
            amplitude, phase = start[places]
            for step in (spread, 1j * spread):
                shifted = start.copy()
                phasor = amplitude * np.exp(1j * phase) + step
                shifted[places] = np.abs(phasor), np.angle(phasor)
                moved.append(shifted)
        predicted = self.predict(np.array(moved), self.reference_effects)
        change = predicted[1:] - predicted[0]
        covariance = np.einsum("vri,vrj->rij", change, change)
        covariance[:, 0, 0] += spread**2
        return covariance

    def predict(
        self, vectors: Vector, effects: Sequence[Effect], start: Balance | None = None
    ) -> NDArray[np.float64]:
        """Return features, shape (v, r, f), of vectors (v, n_base) of base parameters."""
        return self.features.of_prediction(self.prediction(vectors, effects, start))

    def prediction(
        self, vectors: Vector, effects: Sequence[Effect], start: Balance | None = None
    ) -> Prediction:
        """Return what `predict` is made of, steady states included."""
        values = self._named(vectors)
        believed, rig = self.campaign.believed, self.campaign.rig
        features = self.features
        orders = features.orders.tolist()
        return predict(believed, rig, features.conditions, orders, values, effects, start)

    def _named(self, vectors: Vector) -> dict[str, Vector]:
        return {p.name: column for p, column in zip(self.base, vectors.T, strict=True)}

    def torsion_residuals(self, vectors: Vector, effects: Sequence[Effect]) -> NDArray[np.float64]:
        """Return whitened residuals (v, n_points) of the sweeps; none where there is no sweep."""
        values = self._named(vectors)
        coefficients = coefficients_of(self.campaign.believed, values, effects, 1)
        stiffness = coefficients.stiffness * values["locked_stiffness"]
        coefficients = replace(coefficients, stiffness=stiffness)
        sensor = np.column_stack([values["output_torque_gain"], values["output_torque_zero"]])
        found = [np.empty((len(vectors), 0))]
        for points in self.torsion:
            torsion = np.empty((len(vectors), len(points.angle)))
            # Vectors that share the sensor's errors share the path of the torque.
            for gain, zero in np.unique(sensor, axis=0):
                rows = np.flatnonzero(np.all(sensor == (gain, zero), axis=1))
                path = (points.path - zero) / (1.0 + gain)
                torsion[rows] = mean_torsion(coefficients.rows(rows), path)[:, points.intervals]
            found.append((torsion - points.angle) @ points.whitening.T)
        return np.hstack(found)

    def whiten(self, differences: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return whitened differences of features (..., r, f), flat: shape (..., r f)."""
        white = np.empty_like(differences)
        for record, triangle in enumerate(self.whiteners):
            part = differences[..., record, :].reshape(-1, len(triangle)).T
            # What is not known is not a number; it is counted as lost afterwards.
            solved = solve_triangular(triangle, part, lower=True, check_finite=False)
            white[..., record, :] = solved.T.reshape(differences[..., record, :].shape)
        return white.reshape(*differences.shape[:-2], -1)

    @property
    def remainder(self) -> float:
        """Share of the base's excess up to which what is left is numerical."""
        return NUMERICAL

    def objective(
        self, candidates: Sequence[Candidate], slopes: NDArray[np.float64] | None = None
    ) -> Objective:
        """Return whitened residuals of the drive with candidates."""
        return Objective(self, candidates, slopes)

    def response(self, fitted: Fit) -> Response:
        """Return how the whitened residuals of a fit respond to further effects."""
        base = fitted.values[None, : len(self.base)]
        stands = self.prediction(base, fitted.effects)
        before = self.features.of_prediction(stands)
        before_torsion = self.torsion_residuals(base, fitted.effects)
        priors = np.zeros(len(fitted.residuals) - before.size - before_torsion.size)

        def change(added: Sequence[Effect]) -> Vector:
            effects = (*fitted.effects, *added)
            running = self.whiten(self.predict(base, effects, stands.balance) - before)[0]
            torsion = self.torsion_residuals(base, effects) - before_torsion
            return np.concatenate([running, np.nan_to_num(torsion[0]), priors])

        return change

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return where the residuals of each channel stand, and those of the sweeps."""
        n_records, n_features = self.features.values.shape
        first = n_features * np.arange(n_records)[:, None]
        found = []
        for channel in range(len(CHANNELS)):
            mean = [MEANS.index(channel)] if channel in MEANS else []
            places = np.append(mean, self.features.places(channel)).astype(int)
            found.append((first + places).ravel())
        return [*found, n_records * n_features + np.arange(self._sweep_residuals)]

    @property
    def _sweep_residuals(self) -> int:
        return sum(len(points.angle) - 1 for points in self.torsion)

    def excess(self, fitted: Fit) -> Excess:
        """Return the excess chi-square of a fit by record and part of the data.

        Parts are the four channels of the running records, cell by cell as on the map of the
        misfit, and the torsion sweeps, which count as one more record: shape (r + 1, 5).
        """
        n_records, n_features = self.features.values.shape
        n_running = n_records * n_features
        n_sweeps = self._sweep_residuals
        whitened = fitted.residuals[:n_running].reshape(n_records, n_features)
        cells = cell_chi_square(self, np.einsum("rij,rj->ri", self.whiteners, whitened))
        known = np.isfinite(cells)
        chi_square, freedom = np.zeros((2, n_records + 1, cells.shape[1] + 1))
        freedom[:-1, :-1] = np.where(known, degrees_of_freedom(self), 0.0).sum(axis=2)
        chi_square[:-1, :-1] = np.where(known, cells, 0.0).sum(axis=2)
        sweeps = fitted.residuals[n_running : n_running + n_sweeps]
        chi_square[-1, -1], freedom[-1, -1] = sweeps @ sweeps, n_sweeps
        return Excess(chi_square - freedom, freedom)

    def out_of_tolerance(self, at_bounds: Sequence[str]) -> list[Candidate]:
        """Return a candidate for each base parameter that a fit left at a bound."""
        return out_of_tolerance(self.base, at_bounds)


def training_data(campaign: Campaign, features: Features) -> Data:
    """Return features of training records with first guesses, and the sweeps."""
    points = tuple(torsion_points(record, campaign.rig) for record in campaign.torsion)
    return Data(campaign, features, start_parameters(campaign, features), points)


def start_parameters(campaign: Campaign, features: Features) -> tuple[Parameter, ...]:
    """Return the base parameters, with first guesses from the slowest record."""
    believed = campaign.believed
    slowest = int(np.argmin(np.abs(features.conditions.input_speed)))
    values, places = features.values[slowest], features.places(0)
    phases = []
    for order in believed.error_orders:
        line = int(np.argmin(np.abs(features.orders - order)))
        real, imaginary = values[places[line]]
        # amplitude sin(x + phase) has the phasor -i amplitude exp(i phase).
        phases.append(float(np.angle(1j * (real + 1j * imaginary))))
    load = features.conditions.output_torque
    offset = float(np.median(features.values[:, 0] - load / believed.stiffness))
    return base_parameters(believed, campaign.rig, phases, offset)
