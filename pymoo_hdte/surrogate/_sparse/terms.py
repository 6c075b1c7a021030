"""Which terms of a most probable polynomial are kept: a downward-closed set that loses little."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate._sparse.index_set import parents

Array = NDArray[np.float64]
Indices = NDArray[np.int_]

MOST_TERMS = 6000
"""Terms that are looked at, those of the largest prior variance."""
LEAST_VARIANCE = 1e-14
"""Prior variance below which a term is not looked at, as a share of the largest."""
_BESIDE = 1.5
"""Factor between one trial of the threshold and the next."""


def likely_terms(variance: Array, most: int = MOST_TERMS) -> Indices:
    """Return a downward-closed set of the terms with the largest prior variance, shape (p, d).

    Parameters
    ----------
    variance : ndarray, shape (d, k)
        By axis, of degrees 1 .. k.
    most : int
        Number of terms not to exceed.
    """
    whole = np.column_stack([np.ones(len(variance)), variance])
    # No degree counts for less than a higher one, so that the set is downward-closed.
    envelope = np.maximum.accumulate(whole[:, ::-1], axis=1)[:, ::-1]
    threshold, step = float(np.prod(envelope[:, 0])), 1e-2
    least = LEAST_VARIANCE * threshold
    indices = np.zeros((1, len(variance)), dtype=int)
    while threshold > least:
        enlarged = _above(envelope, threshold * step, most)
        if enlarged is not None:
            indices, threshold = enlarged, threshold * step
        elif step >= 1.0 / _BESIDE:
            break
        else:
            step = min(np.sqrt(step), 1.0 / _BESIDE)
    return indices


def _above(envelope: Array, threshold: float, most: int) -> Indices | None:
    """Return all indices of products above a threshold, or None if they are too many."""
    largest_after = np.append(np.cumprod(envelope[::-1, 0])[::-1][1:], 1.0)
    indices, weights = np.zeros((1, 0), dtype=int), np.ones(1)
    for of_axis, after in zip(envelope, largest_after, strict=True):
        products = weights[:, None] * of_axis
        row, degree = np.nonzero(products * after >= threshold)
        if len(row) > most:
            return None
        indices, weights = np.column_stack([indices[row], degree]), products[row, degree]
    return indices


def prior_of_terms(variance: Array, indices: Indices) -> Array:
    """Return the prior variance of terms, shape (p,), as shares of the constant's."""
    prior = np.ones(len(indices))
    for of_axis, degrees in zip(variance, indices.T, strict=True):
        prior *= np.append(1.0, of_axis)[degrees]
    return prior


def products(features: list[Array], indices: Indices) -> Array:
    """Return the terms at points, shape (n, p), from the polynomials of every axis there."""
    values = np.ones((len(indices), features[0].shape[1]))
    for feature, degrees in zip(features, indices.T, strict=True):
        raised = np.flatnonzero(degrees)
        values[raised] *= feature[degrees[raised] - 1]
    return values.T


def largest(coefficients: Array, lost: float) -> NDArray[np.bool_]:
    """Return which coefficients to keep, shape (p,): the others have at most this norm."""
    order = np.argsort(np.abs(coefficients))
    dropped = np.sqrt(np.cumsum(coefficients[order] ** 2)) <= lost
    stays = np.ones(len(coefficients), dtype=bool)
    stays[order[dropped]] = False
    stays[0] = True
    return stays


def closed(indices: Indices) -> Indices:
    """Return the smallest downward-closed set that holds these indices, sorted, shape (q, d)."""
    waiting = [tuple(row) for row in indices.tolist()]
    closure = set(waiting)
    while waiting:
        for _, below in parents(waiting.pop()):
            if below not in closure:
                closure.add(below)
                waiting.append(below)
    return np.array(sorted(closure), dtype=int)
