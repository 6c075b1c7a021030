"""How likely the published numbers are under a rung: nine numbers, and the front they lie on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from experiments.paper.calibrating.predictions import PUBLISHED, TABLE_8_AND_BOX, UNCERTAINTY
from experiments.paper.inference.moments import DESIGNS, TensorSurrogate, sampling_covariance
from experiments.paper.inference.node_noise import LARGEST, published_influence
from experiments.paper.inference.rungs import COLUMNS, Rung
from experiments.published_values import TABLE_8

NAMES = tuple(f"{moment}_{design}" for moment in ("mean", "std") for design in DESIGNS)
FITTED = (*NAMES, "box_std")
"""The nine numbers, in the order of their covariance."""
OBSERVED = np.array([PUBLISHED[name] for name in FITTED])
SAMPLES = 1000
"""N_mc of Section 5.1."""
DRAWS = (0, 1, 1, 1)
"""The three optima share their random numbers (Sections 5.1 and 5.3); the initial design is of the
Monte Carlo run of Section 3, before the optimisation."""
READING = 0.03
"""What the text leaves open in each of the eight moments, arcsec, beside sampling: half the root
mean square by which those of ``calibrated`` move where the surrogate's interval of theta_s, which
is not printed, is +-35 % instead of mean +- 3 std. Without it, combinations of three optima would
be known to some 0.001 arcsec, and details of the paper's integrator would decide between models."""
BAND, BOX = 0.05, 0.25
"""Tolerance of the optima, and half-width of the box that they are searched in."""
GRID = 7
"""Designs on each axis of the box, K, J_in and B_fc, that may dominate an optimum."""
FRONT_WIDTHS = (
    TABLE_8["robustness_first"].mean_arcsec - TABLE_8["accuracy_first"].mean_arcsec,
    TABLE_8["accuracy_first"].std_arcsec - TABLE_8["robustness_first"].std_arcsec,
)
"""Between the outer optima of Table 8, arcsec."""
DEPTH_TOLERANCE = 0.1
"""In front widths: how deep below the front an optimum may lie. The paper's archive ends at an IGD
of 0.018, so that this leaves five times what its search does."""
UNLIKELY = 1e3
"""Residual of every number where a model has no steady state."""
TARGETS = ("independent", "common", "front", "noise")
"""What is fitted. ``independent``: nine numbers, each with its own sampling error alone, as the
calibration takes them. ``common``: with their covariance. ``front``: besides, no design of the box
dominates one of the optima. ``noise``: as ``common``, and the surrogate's nodes carry noise, whose
size is fitted with the parameters between 0 and `node_noise.LARGEST`."""
NOISE_GRID = 25
"""Sizes of the node noise that are tried before the best is refined."""

assert set(FITTED) == set(TABLE_8_AND_BOX)

_INDEPENDENT = np.diag([UNCERTAINTY[name] ** 2 for name in FITTED])
_LOWEST = 8.0 * np.log(READING**2) + 2.0 * np.log(UNCERTAINTY["box_std"])


@dataclass(frozen=True)
class Evaluation:
    """Predictions (9,) and their covariance (9, 9), arcsec; depths (3,) in front widths.

    A depth says how far both objectives of an optimum can be bettered at once, see `depths`.
    ``influence`` (9, 1024) holds the derivatives by the runs that the surrogate is fitted to.
    """

    predicted: NDArray[np.float64]
    covariance: NDArray[np.float64]
    depths: NDArray[np.float64]
    influence: NDArray[np.float64]

    @cached_property
    def of_unit_noise(self) -> NDArray[np.float64]:
        """Covariance of the predictions for node noise of 1 arcsec, shape (9, 9)."""
        return np.asarray(self.influence @ self.influence.T)

    @cached_property
    def node_noise(self) -> float:
        """Likeliest standard deviation of the node noise, arcsec, at most `LARGEST`."""
        factor = np.linalg.cholesky(self.covariance)
        half = np.linalg.solve(factor, self.influence)
        sizes, directions = np.linalg.eigh(half @ half.T)
        squares = (directions.T @ np.linalg.solve(factor, self.predicted - OBSERVED)) ** 2

        def deviance(noise: NDArray[np.float64]) -> NDArray[np.float64]:
            growth = 1.0 + np.multiply.outer(noise**2, np.maximum(sizes, 0.0))
            return np.asarray(np.sum(squares / growth + np.log(growth), axis=-1))

        grid = np.linspace(0.0, LARGEST, NOISE_GRID)
        best = int(np.argmin(deviance(grid)))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, NOISE_GRID - 1)]
        # The solver stops short of the ends of its interval.
        refined = minimize_scalar(
            lambda size: float(deviance(np.array(size))),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-9},
        )
        tried = np.array([float(refined.x), grid[best]])
        return float(tried[np.argmin(deviance(tried))])

    def covariance_with(self, node_noise: float) -> NDArray[np.float64]:
        """Return the covariance for node noise of this size in arcsec, shape (9, 9)."""
        return self.covariance + node_noise**2 * self.of_unit_noise

    def chi_square(self, target: str) -> float:
        """Return the sum of squares of what is fitted, without the size of the covariance."""
        return float(np.sum(self._whitened(target) ** 2))

    def deviance(self, target: str) -> float:
        """Return -2 log likelihood."""
        _, size = np.linalg.slogdet(2.0 * np.pi * self._covariance(target))
        return self.chi_square(target) + float(size)

    def residuals(self, target: str) -> NDArray[np.float64]:
        """Return what has the sum of squares `deviance`, less the least that it could be.

        The last residual holds the determinant of the covariance, which depends on the model.
        """
        _, size = np.linalg.slogdet(self._covariance(target))
        return np.append(self._whitened(target), np.sqrt(size - _LOWEST))

    def _covariance(self, target: str) -> NDArray[np.float64]:
        if target == "independent":
            return _INDEPENDENT
        return self.covariance_with(self.node_noise if target == "noise" else 0.0)

    def _whitened(self, target: str) -> NDArray[np.float64]:
        factor = np.linalg.cholesky(self._covariance(target))
        residuals = np.linalg.solve(factor, self.predicted - OBSERVED)
        if target != "front":
            return residuals
        return np.append(residuals, self.depths / DEPTH_TOLERANCE)


def evaluate(rung: Rung, parameters: dict[str, float], front: bool = True) -> Evaluation:
    """Predict what is published; without ``front`` depths are 0, which saves time.

    Raises
    ------
    ArithmeticError
        If the model has no steady state.
    """
    surrogate = TensorSurrogate.fit(rung, parameters)
    bands = rung.candidate.bands
    joint = surrogate.joint(bands)
    predicted = np.array([*joint.means, *joint.stds, surrogate.box_std(bands)])
    if not np.all(np.isfinite(predicted)) or joint.stds.min() <= 0.0:
        raise ArithmeticError(f"{rung.name} has no finite moments at {parameters}")
    covariance = np.diag([*[READING**2] * 8, UNCERTAINTY["box_std"] ** 2])
    covariance[:8, :8] += sampling_covariance(joint, SAMPLES, DRAWS)
    optima = np.column_stack([joint.means, joint.stds])[1:]
    values = depths(surrogate, optima) if front else np.zeros(3)
    return Evaluation(predicted, covariance, values, published_influence(surrogate, bands))


def box_axes(surrogate: TensorSurrogate, n: int) -> list[NDArray[np.float64]]:
    """Return n values of K, J_in and B_fc each, over the box that the optima are searched in."""
    nominal = surrogate.model.nominal[COLUMNS[1:]]
    return [value * np.linspace(1.0 - BOX, 1.0 + BOX, n) for value in nominal]


def depths(
    surrogate: TensorSurrogate, optima: NDArray[np.float64], n: int = GRID
) -> NDArray[np.float64]:
    """Return how far each of m optima (mean, std), shape (m, 2), lies below a front; (m,).

    In front widths: the largest t such that a design on a grid of n^3 has a mean lower by t widths
    of the published front in the mean, and a std lower by t widths in the std; 0 if none has.
    """
    mean, std = surrogate.on_designs(box_axes(surrogate, n), BAND)
    objectives = np.stack([mean, std], axis=-1).reshape(-1, 1, 2)
    gain = (optima - objectives) / np.array(FRONT_WIDTHS)
    return np.asarray(np.maximum(gain.min(axis=2).max(axis=0), 0.0))


def residuals_of(rung: Rung, target: str, searched: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `Evaluation.residuals` at a point of the search space; large ones where it fails."""
    try:
        evaluation = evaluate(rung, rung.physical(searched), target == "front")
        values = evaluation.residuals(target)
    except (ArithmeticError, np.linalg.LinAlgError):
        values = np.full(13 if target == "front" else 10, UNLIKELY)
    return values


def least_deviance(residuals: NDArray[np.float64]) -> float:
    """Return the deviance that residuals stand for."""
    return float(np.sum(residuals**2)) + _LOWEST + len(OBSERVED) * float(np.log(2.0 * np.pi))
