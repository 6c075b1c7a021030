"""DTE of one design under its scatter, for any tolerance band: samples and exact moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.paper.quadrature import tensor_rule, weighted_moments
from experiments.published_values import Moments
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand

Inputs = Sequence[TruncatedNormal | UniformBand]


def dte_samples(
    problem: RobustDTE, design: ArrayLike, tolerance: float, n_samples: int, seed: int
) -> NDArray[np.float64]:
    """Draw DTE values of a design (4,) whose variables scatter by +-``tolerance``.

    Returns arcsec, shape (n_samples,), from the problem's surrogate.
    """
    random_state = np.random.default_rng(seed)
    inputs = scatter_of(problem, tolerance)
    columns = [entry.sample(random_state, n_samples) for entry in inputs]
    return problem.surrogate(np.column_stack(columns) * _scale(design))


def exact_moments(problem: RobustDTE, design: ArrayLike, tolerance: float) -> Moments:
    """Return mean and standard deviation of the DTE of a design (4,), exact for the surrogate.

    `ExactMoments` answers for a whole box of designs, whose bands must all lie in the surrogate's
    box; here only this design's must, so that the wide band of the initial design can be asked for.
    """
    degree = 2 * max(problem.surrogate.orders)
    rules = [entry.quadrature(degree) for entry in scatter_of(problem, tolerance)]
    points, weights = tensor_rule(rules)
    return Moments(*weighted_moments(problem.surrogate(points * _scale(design)), weights))


def theta_s_of(problem: RobustDTE) -> TruncatedNormal:
    """Return the distribution of theta_s, in rad."""
    return cast(TruncatedNormal, problem.inputs[0])


def scatter_of(problem: RobustDTE, tolerance: float) -> Inputs:
    """Return the scatter of `PARAMETERS` with bands of +-``tolerance`` around any design."""
    return [theta_s_of(problem), *[UniformBand(tolerance) for _ in problem.nominal]]


def _scale(design: ArrayLike) -> NDArray[np.float64]:
    # Bands are relative to the design; theta_s stands for itself.
    return np.concatenate([[1.0], np.asarray(design, dtype=float)])
