"""Bounded least squares of a campaign: base parameters jointly with those of effects.

Residuals are whitened by the full covariance of the features, so that their sum of squares is a
chi-square. All base parameters are perturbed in one call of the forward model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from pymoo_hdte.discrepancy.campaign import Campaign
from pymoo_hdte.discrepancy.candidate import Candidate
from pymoo_hdte.discrepancy.features import Features
from pymoo_hdte.discrepancy.forward import Prediction, coefficients_of, predict
from pymoo_hdte.discrepancy.parameters import Layout, Parameter, base_parameters
from pymoo_hdte.discrepancy.torsion_curve import TorsionPoints
from pymoo_hdte.drive import Balance, Effect, mean_torsion

_STEP = 1e-3
"""Step of difference quotients, in units of a parameter's scale."""
_EVALUATIONS = 25
_FREED = 10.0
"""Factor by which a base parameter whose tolerance is lifted may be off."""
LOST = 1e3
"""Residual of a point at which the model cannot carry the torque."""

Vector = NDArray[np.float64]


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
            for part in ("amplitude", "phase"):
                shifted = start.copy()
                amplitude = start[layout.index(f"error_amplitude_{line}")]
                unit = spread if part == "amplitude" else spread / max(amplitude, spread)
                shifted[layout.index(f"error_{part}_{line}")] += unit
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


@dataclass(frozen=True, eq=False)
class Fit:
    """A model with its fitted values.

    Attributes
    ----------
    candidates : tuple of Candidate
    parameters : tuple of Parameter
        Base first, then those of the candidates.
    values : ndarray, shape (n_parameters,)
    residuals : ndarray, shape (n_residuals,)
        Whitened: of running records, of sweeps, of priors.
    jacobian : ndarray, shape (n_residuals, n_parameters)
        Of the residuals, by parameters in units of their scale.
    slopes : ndarray, shape (n_base, r, f)
        Of the features, not whitened, by base parameters in units of their scale.
    """

    candidates: tuple[Candidate, ...]
    parameters: tuple[Parameter, ...]
    values: Vector
    residuals: Vector
    jacobian: NDArray[np.float64]
    slopes: NDArray[np.float64]

    @property
    def chi_square(self) -> float:
        """Sum of squares of all residuals."""
        return float(self.residuals @ self.residuals)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The fitted effects."""
        return tuple(effect for parts in self.effects_by_candidate for effect in parts)

    @property
    def effects_by_candidate(self) -> tuple[tuple[Effect, ...], ...]:
        """The fitted effects of each candidate."""
        return built(self.candidates, self.values[len(self.values) - count(self.candidates) :])

    @cached_property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the parameters that ended at a bound."""
        return tuple(
            parameter.name
            for parameter, side in zip(self.parameters, self.bound_sides, strict=True)
            if side != 0.0
        )

    @cached_property
    def bound_sides(self) -> Vector:
        """-1 for parameters at their lower bound, 1 at the upper one, 0 elsewhere; shape (n,)."""
        layout = Layout(self.parameters)
        near = 1e-3 * layout.array("scale")
        above = self.values >= layout.array("upper") - near
        below = self.values <= layout.array("lower") + near
        return above.astype(float) - below.astype(float)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """Of the values, from the curvature at the optimum and the bounds; shape (n, n).

        The bounds count as the variance of a uniform distribution between them: what no record
        determines is as uncertain as they are wide.
        """
        scale = Layout(self.parameters).array("scale")
        return np.linalg.inv(self.information) * np.outer(scale, scale)

    @property
    def information(self) -> NDArray[np.float64]:
        """Inverse of the covariance, by parameters in units of their scale."""
        return self.jacobian.T @ self.jacobian + np.diag(12.0 / self._widths**2)

    @property
    def evidence(self) -> float:
        """Minus twice the logarithm of the model's probability, by Laplace's approximation.

        Chi-square and, for each parameter, how much the data narrowed what its bounds allow
        (MacKay, Neural Computation 4, 1992): what no record determines costs nothing.
        """
        _, narrowed = np.linalg.slogdet(
            self.information * np.outer(self._widths, self._widths) / 12.0
        )
        return self.chi_square + float(narrowed)

    @property
    def _widths(self) -> Vector:
        layout = Layout(self.parameters)
        return np.asarray((layout.array("upper") - layout.array("lower")) / layout.array("scale"))


def count(candidates: Sequence[Candidate]) -> int:
    """Return the number of parameters of candidates."""
    return sum(len(candidate.parameters) for candidate in candidates)


def built(
    candidates: Sequence[Candidate], values: Sequence[float] | Vector
) -> tuple[tuple[Effect, ...], ...]:
    """Return the effects of each of the candidates for their values, one after the other."""
    effects, start = [], 0
    for candidate in candidates:
        end = start + len(candidate.parameters)
        effects.append(candidate.build([float(value) for value in values[start:end]]))
        start = end
    return tuple(effects)


class Objective:
    """Whitened residuals and their Jacobian for a set of candidates.

    Parameters
    ----------
    data : Data
    candidates : sequence of Candidate
    slopes : ndarray, shape (n_base, r, f), optional
        Derivatives of the features by base parameters, kept where they are given. Those of a model
        without an effect serve with it: an effect changes features far more than their slopes, and
        what slopes are wrong by slows a search down but moves its end little.
    """

    def __init__(
        self,
        data: Data,
        candidates: Sequence[Candidate],
        slopes: NDArray[np.float64] | None = None,
    ) -> None:
        self.data = data
        self.candidates = tuple(candidates)
        self.slopes = slopes
        added = [parameter for candidate in candidates for parameter in candidate.parameters]
        freed = {candidate.frees for candidate in candidates}
        base = [_without_tolerance(one) if one.name in freed else one for one in data.base]
        self.parameters = (*base, *added)
        layout = Layout(self.parameters)
        self.scale, self.start = layout.array("scale"), layout.array("start")
        self.lower, self.upper = layout.array("lower"), layout.array("upper")
        self.prior = layout.array("prior")
        self.bounded = np.isfinite(self.prior)
        self.nearby: Balance | None = None

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n,), those of sweeps and priors last."""
        difference, others = self.differences(values)
        return np.nan_to_num(np.concatenate([self.data.whiten(difference), others]), nan=LOST)

    def differences(self, values: Vector) -> tuple[NDArray[np.float64], Vector]:
        """Return predicted minus measured features (r, f), and residuals of sweeps and priors."""
        base, effects = self._parts(values)
        difference = self._features(base, effects)[0] - self.data.features.values
        priors = ((values - self.start) / self.prior)[self.bounded]
        return difference, np.concatenate([self._torsion(base, effects)[0], priors])

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return the derivatives of the residuals by parameters in units of their scale."""
        features, others = self.derivatives(values)
        return np.concatenate([self.data.whiten(features), others], axis=1).T

    def derivatives(self, values: Vector) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return derivatives by parameters in units of their scale.

        Of the features, not whitened, (n, r, f); of sweeps and priors, whitened, (n, n_others).
        """
        n_base, steps = len(self.data.base), self._steps(values)
        slopes = self.slopes_at(values) if self.slopes is None else self.slopes
        moved = values + np.diag(steps * self.scale)
        base, effects = self._parts(values)
        torsion = self._torsion(np.vstack([base, moved[:n_base, :n_base]]), effects)
        features, sweeps = list(slopes), list((torsion[1:] - torsion[0]) / steps[:n_base, None])
        here = self._features(base, effects)[0]
        for place in range(n_base, len(values)):
            base, effects = self._parts(moved[place])
            features.append((self._features(base, effects)[0] - here) / steps[place])
            sweeps.append((self._torsion(base, effects)[0] - torsion[0]) / steps[place])
        priors = np.diag(self.scale / self.prior)[:, self.bounded]
        return np.array(features), np.concatenate([np.array(sweeps), priors], axis=1)

    def _steps(self, values: Vector) -> Vector:
        """Return steps of quotients; an effect's strength cannot fall below zero."""
        return np.where(values + _STEP * self.scale > self.upper, -_STEP, _STEP)

    def _torsion(
        self, vectors: NDArray[np.float64], effects: tuple[Effect, ...]
    ) -> NDArray[np.float64]:
        return np.nan_to_num(self.data.torsion_residuals(vectors, effects), nan=LOST)

    def slopes_at(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives of the features by base parameters in units of their scale."""
        base, effects = self._parts(values)
        n_base = base.shape[1]
        steps = self._steps(values)[:n_base]
        features = self._features(
            np.vstack([base, base + np.diag(steps * self.scale[:n_base])]), effects
        )
        return (features[1:] - features[0]) / steps[:, None, None]

    def _parts(self, values: Vector) -> tuple[NDArray[np.float64], tuple[Effect, ...]]:
        """Return the base parameters as one row, and the effects."""
        n_base = len(self.data.base)
        parts = built(self.candidates, values[n_base:])
        return values[None, :n_base], tuple(effect for part in parts for effect in part)

    def _features(
        self, vectors: NDArray[np.float64], effects: tuple[Effect, ...]
    ) -> NDArray[np.float64]:
        """Return predicted features, the first vector's steady states being kept to begin from."""
        prediction = self.data.prediction(vectors, effects, self.nearby)
        self.nearby = prediction.balance.rows(slice(len(self.data.features.records)))
        return self.data.features.of_prediction(prediction)


def _without_tolerance(parameter: Parameter) -> Parameter:
    return replace(parameter, lower=parameter.start / _FREED, upper=parameter.start * _FREED)


def fit(
    data: Data,
    candidates: Sequence[Candidate] = (),
    start: Vector | None = None,
    evaluations: int = _EVALUATIONS,
    slopes: NDArray[np.float64] | None = None,
) -> Fit:
    """Fit base parameters and those of candidates from ``start`` (by default their own starts).

    With ``slopes`` (see `Objective`) a fit takes a fifth of the time; without, they are renewed in
    every step.
    """
    objective = Objective(data, candidates, slopes)
    scale = objective.scale
    inner = 1e-6 * (objective.upper - objective.lower)
    begin = objective.start if start is None else start
    begin = np.clip(begin, objective.lower + inner, objective.upper - inner)
    found = least_squares(
        lambda scaled: objective.residuals(scaled * scale),
        begin / scale,
        jac=lambda scaled: objective.jacobian(scaled * scale),
        bounds=(objective.lower / scale, objective.upper / scale),
        max_nfev=evaluations,
        xtol=1e-5,
        ftol=1e-6,
        gtol=1e-9,
    )
    values = found.x * scale
    kept = objective.slopes_at(values) if slopes is None else slopes
    return Fit(objective.candidates, objective.parameters, values, found.fun, found.jac, kept)


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
