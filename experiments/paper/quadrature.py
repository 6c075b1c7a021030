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


def weighted_moments(
    values: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[float, float]:
    """Return mean and standard deviation of values (n,) under weights (n,) that sum to 1."""
    mean = float(weights @ values)
    return mean, float(np.sqrt(weights @ (values - mean) ** 2))
