"""DTE of one design under its scatter, for any tolerance band: samples and exact moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.published_values import Moments
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Nodes and weights: of one variable (n,) and (n,), or of d variables (n, d) and (n,)."""


def tensor_rule(rules: Sequence[Rule]) -> Rule:
    """Return all combinations of the nodes of d variables, shape (n, d), and their weights (n,)."""
    points = np.meshgrid(*[values for values, _ in rules], indexing="ij")
    weights = np.ones(1)
    for _, factor in rules:
        weights = np.outer(weights, factor).ravel()
    return np.column_stack([axis.ravel() for axis in points]), weights


def gauss_rule(rule: Rule, n: int) -> Rule:
    """Return the n nodes and weights that are exact for the same measure up to degree 2 n - 1.

    By Lanczos' recurrence on the nodes of a finer rule, (m,) and (m,), and the eigenvalues of its
    tridiagonal matrix (Golub and Welsch, Mathematics of Computation 23, 1969).
    """
    nodes, weights = rule
    scale = np.abs(nodes).max()
    before, now = np.zeros_like(nodes), np.sqrt(weights / weights.sum())
    diagonal, beside = np.empty(n), np.zeros(n)
    for step in range(n):
        after = nodes / scale * now - beside[step - 1] * before
        diagonal[step] = now @ after
        after -= diagonal[step] * now
        beside[step] = np.linalg.norm(after)
        before, now = now, after / beside[step]
    values, vectors = np.linalg.eigh(
        np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    )
    return scale * values, vectors[0] ** 2 * weights.sum()


def weighted_moments(
    values: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[float, float]:
    """Return mean and standard deviation of values (n,) under weights (n,) that sum to 1."""
    mean = float(weights @ values)
    return mean, float(np.sqrt(weights @ (values - mean) ** 2))


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
