"""Tensor quadrature: nodes and weights of several variables, and moments of values on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

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
