"""Downward-closed sets of multi-indices, and how a small matrix acts along one of their axes.

With an index such a set holds all indices below it. A triangular matrix along one axis, such as a
change of basis that keeps degrees, therefore maps coefficients on a set to coefficients on it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int_]


class AxisMap:
    """Apply a triangular matrix along one axis to coefficients on a downward-closed set.

    Parameters
    ----------
    indices : ndarray of int, shape (p, d)
        The set.
    axis : int
        Along which to act.
    rows : int
        Number of rows of the matrix; fewer than it has columns cut the set.

    Attributes
    ----------
    result : ndarray of int, shape (q, d)
        The set on which the result lives: indices below ``rows`` in the axis.
    """

    def __init__(self, indices: Indices, axis: int, rows: int) -> None:
        count, columns = len(indices), int(indices[:, axis].max()) + 1
        self._count = count
        others = np.delete(indices, axis, axis=1)
        _, fibre = np.unique(others, axis=0, return_inverse=True)
        fibre = fibre.reshape(-1)
        self._source = np.full((fibre.max() + 1, columns), count)
        self._source[fibre, indices[:, axis]] = np.arange(count)
        inside = np.flatnonzero(indices[:, axis] < rows)
        self.result = indices[inside]
        self._target = np.full((fibre.max() + 1, min(rows, columns)), len(inside))
        self._target[fibre[inside], indices[inside, axis]] = np.arange(len(inside))

    @property
    def columns(self) -> int:
        """Number of columns of the matrix."""
        return self._source.shape[1]

    @property
    def size(self) -> int:
        """Numbers in the largest array for one matrix and one set of coefficients."""
        return self._source.size

    def forward(self, coefficients: Array, matrix: Array) -> Array:
        """Return the new coefficients, shape (n, r, q).

        Parameters
        ----------
        coefficients : ndarray, shape (n or 1, r, p)
        matrix : ndarray, shape (n or 1, rows, columns)
            Triangular: no row takes from lower columns.
        """
        blocks = _gather(coefficients, self._source) @ np.swapaxes(matrix, 1, 2)[:, None]
        return _scatter(blocks, self._target, len(self.result))

    def pairs(self) -> Indices:
        """Return what a triangular matrix takes where, shape (k, 4), by rising target.

        Target and source among the coefficients, row and column in the matrix.
        """
        blocks = []
        for source, target in zip(self._source, self._target, strict=True):
            inside = np.flatnonzero(source < self._count)
            for row in np.flatnonzero(target < len(self.result)).tolist():
                above = inside[inside >= row]
                rows = np.full(len(above), row)
                blocks.append(
                    np.column_stack([np.full(len(above), target[row]), source[above], rows, above])
                )
        together = np.concatenate(blocks)
        return together[np.argsort(together[:, 0], kind="stable")]

    def backward(self, weights: Array, matrix: Array, count: int) -> Array:
        """Return the gradient before the map of what has the gradient ``weights`` after it.

        Parameters
        ----------
        weights : ndarray, shape (n, r, q)
        matrix : ndarray, shape (n or 1, rows, columns)
        count : int
            The number p of coefficients before.
        """
        return _scatter(_gather(weights, self._target) @ matrix[:, None], self._source, count)

    def of_matrix(self, weights: Array, coefficients: Array) -> Array:
        """Return the gradient in the matrix, shape (n, r, rows, columns)."""
        after = _gather(weights, self._target)
        return np.swapaxes(after, 2, 3) @ _gather(coefficients, self._source)


def _gather(values: Array, places: Indices) -> Array:
    """Return (n, r, fibres, length), zero where a fibre has ended."""
    padded = np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)
    return padded[..., places]


def _scatter(blocks: Array, places: Indices, count: int) -> Array:
    result = np.zeros((*blocks.shape[:-2], count + 1))
    result[..., places] = blocks
    return result[..., :count]


def neighbours(index: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Return the indices that are one step above."""
    return [(*index[:j], index[j] + 1, *index[j + 1 :]) for j in range(len(index))]


def parents(index: tuple[int, ...]) -> list[tuple[int, tuple[int, ...]]]:
    """Return axis and index of all that are one step below."""
    return [(j, (*index[:j], index[j] - 1, *index[j + 1 :])) for j in range(len(index)) if index[j]]
