"""DTE of one design under its scatter, for any tolerance band: samples and exact moments."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.published_values import Moments
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand


def dte_samples(
    problem: RobustDTE, design: ArrayLike, tolerance: float, n_samples: int, seed: int
) -> NDArray[np.float64]:
    """Draw DTE values of a design (4,) whose variables scatter by +-``tolerance``.

    Returns arcsec, shape (n_samples,), from the problem's surrogate.
    """
    random_state = np.random.default_rng(seed)
    inputs = _inputs(problem, tolerance)
    columns = [entry.sample(random_state, n_samples) for entry in inputs]
    return problem.surrogate(np.column_stack(columns) * _scale(design))


def exact_moments(problem: RobustDTE, design: ArrayLike, tolerance: float) -> Moments:
    """Return mean and standard deviation of the DTE of a design (4,), exact for the surrogate.

    `ExactMoments` answers for a whole box of designs, whose bands must all lie in the surrogate's
    box; here only this design's must, so that the wide band of the initial design can be asked for.
    """
    degree = 2 * max(problem.surrogate.orders)
    rules = [entry.quadrature(degree) for entry in _inputs(problem, tolerance)]
    points = np.meshgrid(*[values for values, _ in rules], indexing="ij")
    weights = np.ones(1)
    for _, weight in rules:
        weights = np.outer(weights, weight).ravel()
    values = problem.surrogate(np.column_stack([p.ravel() for p in points]) * _scale(design))
    mean = weights @ values
    return Moments(float(mean), float(np.sqrt(weights @ (values - mean) ** 2)))


def _inputs(problem: RobustDTE, tolerance: float) -> list[TruncatedNormal | UniformBand]:
    theta_s = problem.moments.uncertainty.inputs[0]
    return [theta_s, *[UniformBand(tolerance) for _ in problem.nominal]]


def _scale(design: ArrayLike) -> NDArray[np.float64]:
    # Bands are relative to the design; theta_s stands for itself.
    return np.concatenate([[1.0], np.asarray(design, dtype=float)])
