"""Features of a campaign with their full covariance, and their prediction by a model.

Residuals are whitened by that covariance, so that their sum of squares is a chi-square. The small
changes of the static error from record to record count as noise, which reaches all channels through
the response of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtrtrs

from pymoo_hdte.discrepancy._evidence.order_lines.bench import IDEAL, Bench
from pymoo_hdte.discrepancy._evidence.order_lines.features import (
    MEANS,
    Features,
)
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import (
    Prediction,
    coefficients_of,
    predict,
)
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import PREDICTION, Effort
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import TorsionPoints
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.known_values import of_equal_numbers
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.linearised import LEAST_ERROR
from pymoo_hdte.drive import DriveEffect, LawAtPort, SteadyMotion, mean_torsion
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]
Values = NDArray[np.float64]

_COURSE = 0.1
"""Share by which creep may differ from a sum of decays, line by line: it slows down as it fades,
and comes in fits and starts where lines of the error beat."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Features to fit, whitened, for a campaign.

    Attributes
    ----------
    campaign : Campaign
    features : Features
    base : tuple of Parameter
    torsion : tuple of TorsionPoints
        Sweeps with the input locked.
    reference : ndarray, shape (n_base,), optional
        Base values for the response to the repeatability; by default the starts.
    reference_effects : tuple of DriveEffect
        Effects included in this response: they may move a resonance, which amplifies the
        repeatability.
    bench : Bench
        Nuisances that are fitted with the base, whose unknowns are the last of ``base``.
    """

    campaign: Campaign
    features: Features
    base: tuple[Parameter, ...]
    torsion: tuple[TorsionPoints, ...] = ()
    reference: Vector | None = None
    reference_effects: tuple[DriveEffect, ...] = ()
    bench: Bench = IDEAL

    def on_bench(self, nuisance: Candidate, begin: Sequence[float]) -> Self:
        """Return the observations on a bench with one more nuisance, whose fits begin at values."""
        bench = self.bench.with_nuisance(nuisance, begin)
        own = len(self.base) - len(self.bench.parameters)
        reference = None if self.reference is None else np.append(self.reference, begin)
        return replace(
            self, bench=bench, base=(*self.base[:own], *bench.parameters), reference=reference
        )

    @cached_property
    def whiteners(self) -> NDArray[np.float64]:
        """Lower triangles L, shape (r, f, f), of the `covariance` L L^T of each record."""
        return np.asarray(np.linalg.cholesky(self.covariance), dtype=np.float64)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of the features of each record, shape (r, f, f).

        It is the sum of those of sensors, of the repeatability, of creep in laws that forget
        gradually, and of the model's own error where an effect dominates.
        """
        start, changes = self._start, self.repeatability
        known = self._of_sensors(start) + self._of_model(start)
        known = known + np.einsum("vri,vrj->rij", changes, changes)
        return known + self._creep(float(start[Layout(self.base).index("stiffness")]))

    @property
    def _start(self) -> Vector:
        """Base values for responses, shape (n_base,)."""
        return Layout(self.base).array("start") if self.reference is None else self.reference

    def _of_model(self, start: Vector) -> NDArray[np.float64] | float:
        """Return the covariance by what the model does not hold of what the effects change.

        Of a line as a whole, as that may be in its phase as well.
        """
        if not self.reference_effects:
            return 0.0
        change = self.predict(start[None], self.reference_effects)[0]
        change = change - self.predict(start[None], ())[0]
        for channel in range(len(CHANNELS)):
            places = self.features.places(channel)
            change[:, places] = np.linalg.norm(change[:, places], axis=2, keepdims=True)
        return np.asarray((LEAST_ERROR * change[:, :, None]) ** 2 * np.eye(change.shape[1]))

    def _of_sensors(self, start: Vector) -> NDArray[np.float64]:
        """Return the covariance by the noise of the sensors, (r, f, f).

        Where the measured lead excites the drive, its noise also moves what is predicted of the
        other channels; where the loop's does, what the motor does beside its loop. This may be as
        fast as a line, or slow; the drive answers to either differently.
        """
        features = self.features
        response = self.prediction(start[None], self.reference_effects).response
        if response is None:
            return features.covariance
        share = features.conditions.lead_share
        share = np.ones(response.rate.shape) if share is None else share
        count, size = features.values.shape
        by_noise, of_lead = np.tile(np.eye(size), (count, 1, 1)), features.places(3)
        fast, slow = np.zeros((2, count, size, size))
        _set_blocks(fast, of_lead, of_lead, np.ones_like(share))
        by_ends = np.zeros((count, 2, size))
        for channel, by_lead in enumerate(np.moveaxis(response.channels, 1, 0)):
            places, by_rates = features.places(channel), response.slow[:, channel, :, None]
            as_slow = by_rates[:, 0] * response.rate + by_rates[:, 1] * response.rate**2
            _set_blocks(by_noise, places, of_lead, -share * by_lead)
            _set_blocks(fast, places, of_lead, (1.0 - share) * by_lead)
            _set_blocks(slow, places, of_lead, by_lead - as_slow)
            if features.ends is not None:
                lines = by_rates[:, 1:] * features.ends
                by_ends[..., places] = np.stack([lines.real, lines.imag], axis=-1)
        covariance = by_noise @ features.covariance @ by_noise.swapaxes(1, 2)
        if features.wander is not None:
            deviations = np.zeros((count, 1, size))
            deviations[:, 0, of_lead] = np.sqrt(features.wander)[..., None]
            for moved in (fast * deviations, slow * deviations):
                covariance += moved @ moved.swapaxes(1, 2)
        return np.asarray(covariance + by_ends.swapaxes(1, 2) @ by_ends)

    @property
    def creep(self) -> float:
        """Mesh torque that fades in believed and included effects, N.m: see `Behaviour.creep`."""
        effects = (*self.campaign.believed.effects, *self.reference_effects)
        at_mesh = (
            effect for effect in effects if isinstance(effect, LawAtPort) and effect.port == "mesh"
        )
        return sum(effect.law.creep for effect in at_mesh)

    def _creep(self, stiffness: float) -> NDArray[np.float64] | float:
        """Return the covariance by torsion that earlier loads have left and that fades in a record.

        Nobody knows how long the drive had turned when a record began, so any share of it may
        remain and fade at any rate. Each decay has the size of the whole force as its deviation, so
        far above the noise that a smaller one would make no difference.
        """
        size, features = self.creep / stiffness, self.features
        fading = features.conditions.fading
        if fading is None or not size:
            return 0.0
        real, imaginary = features.places(0).T
        decays = np.zeros((*fading.shape[:2], features.values.shape[1]))
        decays[..., 0] = fading[..., 0].real
        decays[..., real], decays[..., imaginary] = fading[..., 1:].real, fading[..., 1:].imag
        covariance = np.einsum("rki,rkj->rij", decays, decays)
        # A torsion that hardly fades moves the mean.
        covariance[:, 0, 0] += 1.0
        diagonal = np.arange(decays.shape[2])
        covariance[:, diagonal, diagonal] *= 1.0 + _COURSE**2
        return np.asarray(size**2 * covariance)

    @cached_property
    def repeatability(self) -> NDArray[np.float64]:
        """Changes by the deviation of each part of the static error, shape (2 m + 1, r, f).

        Those of the lines, which reach all channels, and of the mean: the error of each record
        differs by independent multiples of them.
        """
        layout, start = Layout(self.base), self._start
        lines = range(len(self.campaign.believed.error_orders))
        spread = self.campaign.rig.repeatability / max(len(lines), 1) ** 0.5
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
        of_mean = np.zeros_like(predicted[:1])
        of_mean[..., 0] = spread
        return np.concatenate([predicted[1:] - predicted[0], of_mean])

    def predict(self, vectors: Vector, effects: Sequence[DriveEffect]) -> NDArray[np.float64]:
        """Return features, shape (v, r, f), of vectors (v, n_base) of base parameters."""
        return self.features.of_prediction(self.prediction(vectors, effects))

    def prediction(
        self,
        vectors: Vector,
        effects: Sequence[DriveEffect],
        start: SteadyMotion | None = None,
        effort: Effort = PREDICTION,
    ) -> Prediction:
        """Return the prediction behind `predict`, steady states included."""
        values = self._values_by_name(vectors)
        believed, rig = self.campaign.believed, self.campaign.rig
        features = self.features
        orders = features.orders.tolist()
        conditions = features.conditions
        return predict(
            believed, rig, conditions, orders, values, effects, start, effort, self.bench
        )

    def _values_by_name(self, vectors: Vector) -> dict[str, Vector]:
        return {p.name: column for p, column in zip(self.base, vectors.T, strict=True)}

    def torsion_residuals(
        self, vectors: Vector, effects: Sequence[DriveEffect]
    ) -> NDArray[np.float64]:
        """Return whitened residuals (v, n_points) of the sweeps; none where there is no sweep."""
        groups = of_equal_numbers(self.campaign.believed.effects, self._values_by_name(vectors))
        residuals = np.empty((len(vectors), self.n_sweep_residuals))
        for rows, known in groups if self.torsion else ():
            residuals[rows] = self._sweep_residuals(vectors[rows], known, effects)
        return residuals

    def _sweep_residuals(
        self, vectors: Vector, known: Sequence[DriveEffect], effects: Sequence[DriveEffect]
    ) -> NDArray[np.float64]:
        """Return whitened residuals of the sweeps where the believed effects are ``known``."""
        swept = self._swept(vectors, known, effects)
        residuals = [
            (torsion - points.angle) @ points.whitening.T
            for torsion, points in zip(swept, self.torsion, strict=True)
        ]
        return np.hstack(residuals)

    def swept_torsion(
        self, vector: Vector, effects: Sequence[DriveEffect]
    ) -> list[NDArray[np.float64]]:
        """Return the torsion at the points of each sweep, rad, shapes (n_points,).

        ``vector`` are the base parameters, shape (n_base,).
        """
        ((_, known),) = of_equal_numbers(
            self.campaign.believed.effects, self._values_by_name(vector[None])
        )
        return [torsion[0] for torsion in self._swept(vector[None], known, effects)]

    def _swept(
        self, vectors: Vector, known: Sequence[DriveEffect], effects: Sequence[DriveEffect]
    ) -> list[NDArray[np.float64]]:
        """Return the torsion (v, n_points) of each sweep where the believed effects are known."""
        values = self._values_by_name(vectors)
        coefficients = coefficients_of(self.campaign.believed, values, (*known, *effects), 1)
        stiffness = coefficients.stiffness * values["locked_stiffness"]
        coefficients = replace(coefficients, stiffness=stiffness)
        # Vectors with equal sensor errors have the same path of the torque.
        of_sensors: dict[tuple[float, float], list[int]] = {}
        sensors = (values[f"output_torque_{part}"].tolist() for part in ("gain", "zero"))
        for row, sensor in enumerate(zip(*sensors, strict=True)):
            of_sensors.setdefault(sensor, []).append(row)
        swept = []
        for points in self.torsion:
            torsion = np.empty((len(vectors), len(points.angle)))
            for (gain, zero), rows in of_sensors.items():
                group = coefficients if len(of_sensors) == 1 else coefficients.rows(np.array(rows))
                path = (points.path - zero) / (1.0 + gain)
                torsion[rows] = mean_torsion(group, path)[:, points.intervals]
            swept.append(torsion)
        return swept

    @property
    def n_sweep_residuals(self) -> int:
        """Number of residuals of the sweeps: one a point, less the constant of each sweep."""
        return sum(len(points.angle) - 1 for points in self.torsion)

    def whiten(self, differences: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return whitened differences of features (..., r, f), flat: shape (..., r f)."""
        white = np.empty_like(differences)
        for record, triangle in enumerate(self.whiteners):
            part = differences[..., record, :].reshape(-1, len(triangle)).T
            # Unknown values are NaN here and count as lost afterwards. LAPACK is called directly,
            # with columns first, because SciPy's checks would take several times as long.
            solved, _ = dtrtrs(triangle.T, part, trans=True)
            white[..., record, :] = solved.T.reshape(differences[..., record, :].shape)
        return white.reshape(*differences.shape[:-2], -1)


def _set_blocks(
    matrices: NDArray[np.float64],
    rows: NDArray[np.int_],
    columns: NDArray[np.int_],
    factors: NDArray[np.complex128] | NDArray[np.float64],
) -> None:
    """Let matrices (r, f, f) multiply lines by ``factors`` (r, m), from places (m, 2) to others."""
    (real, imaginary), (of_real, of_imaginary) = rows.T, columns.T
    matrices[:, real, of_real] = matrices[:, imaginary, of_imaginary] = factors.real
    matrices[:, real, of_imaginary] = -factors.imag
    matrices[:, imaginary, of_real] = factors.imag


def cell_degrees_of_freedom(data: Observations) -> Values:
    """Return the degrees of freedom of each cell, shape (4, 1 + m)."""
    degrees_of_freedom = np.full((len(CHANNELS), 1 + len(data.features.orders)), 2.0)
    degrees_of_freedom[:, 0] = 1.0
    return degrees_of_freedom


def cell_chi_square(data: Observations, difference: Values) -> Values:
    """Return the chi-square of each cell for differences of features (r, f); (r, 4, 1 + m).

    Nan where a channel has no mean among the features, or a record does not show a line.
    """
    covariance = data.covariance
    chi_square = np.full((len(difference), *cell_degrees_of_freedom(data).shape), np.nan)
    for channel in range(len(CHANNELS)):
        if channel in MEANS:
            chi_square[:, channel, 0] = (
                difference[:, channel] ** 2 / covariance[:, channel, channel]
            )
        for line, pair in enumerate(data.features.places(channel)):
            block = covariance[:, pair[:, None], pair]
            part = difference[:, pair, None]
            solved = np.linalg.solve(block, part)
            chi_square[:, channel, 1 + line] = np.sum(part * solved, axis=(1, 2))
    if (shown := data.features.shown) is not None:
        chi_square[:, :, 1:] = np.where(shown[:, None], chi_square[:, :, 1:], np.nan)
    return chi_square


def cell_noise(data: Observations) -> Values:
    """Return the standard deviation of each cell, shape (r, 4, 1 + m).

    That of a line is the root mean square of those of its real and imaginary part.
    """
    variance = np.diagonal(data.covariance, axis1=1, axis2=2)
    variances = np.full((len(variance), *cell_degrees_of_freedom(data).shape), np.nan)
    for channel in range(len(CHANNELS)):
        if channel in MEANS:
            variances[:, channel, 0] = variance[:, MEANS.index(channel)]
        variances[:, channel, 1:] = variance[:, data.features.places(channel)].mean(axis=2)
    return np.sqrt(variances)


def as_lines(data: Observations, difference: Values) -> NDArray[np.complex128]:
    """Return differences of features (r, f) as phasors of cells (r, 4, 1 + m)."""
    cells = np.full((len(difference), *cell_degrees_of_freedom(data).shape), np.nan, dtype=complex)
    for channel in range(len(CHANNELS)):
        if channel in MEANS:
            cells[:, channel, 0] = difference[:, channel]
        real, imaginary = data.features.places(channel).T
        cells[:, channel, 1:] = difference[:, real] + 1j * difference[:, imaginary]
    return cells
