"""Tensor Chebyshev series at very many points: products of matrices that fit a processor's caches.

`TensorPolynomial` is better for few points, and keeps its last bits, on which stored runs of
algorithms depend.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate.tensor import MULTIPLICATIONS_AT_ONCE, chebyshev_basis, products
from pymoo_hdte.surrogate.threads import in_blocks

Array = NDArray[np.float64]

_BLOCK = 512
"""Points that go through all steps together: fewer cost numpy overhead, more exceed the caches."""


class ManyPoints:
    """Several tensor Chebyshev series, each of its own degrees.

    The trailing half of the variables is summed by matrix products; the leading variables then one
    after the other, point by point.

    Parameters
    ----------
    series : sequence of ndarray, each of shape (p_1, ..., p_d)
        Plain coefficients.
    """

    def __init__(self, series: Sequence[Array]) -> None:
        self._split = series[0].ndim // 2
        self._series = [np.ascontiguousarray(coefficients) for coefficients in series]
        self._longest = max(max(coefficients.shape) for coefficients in series)

    def __call__(self, x: Array) -> Array:
        """Return the values, shape (len(series), n), at points of the cube, shape (d, n)."""
        values = np.empty((len(self._series), x.shape[1]))

        def fill(block: slice) -> None:
            basis = chebyshev_basis(x[:, block], self._longest)
            for coefficients, row in zip(self._series, values, strict=True):
                row[block] = self._sum(coefficients, basis)

        in_blocks(fill, x.shape[1], _BLOCK)
        return values

    def _sum(self, coefficients: Array, basis: Array) -> Array:
        tail = coefficients.shape[self._split :]
        trailing = products(basis[:, self._split :], tail)
        matrix = coefficients.reshape(-1, prod(tail))
        part = np.empty((len(matrix), trailing.shape[1]))
        rows = max(1, MULTIPLICATIONS_AT_ONCE // trailing.size)
        for start in range(0, len(matrix), rows):
            panel = slice(start, start + rows)
            np.matmul(matrix[panel], trailing, out=part[panel])
        for variable in reversed(range(self._split)):
            size = coefficients.shape[variable]
            part = np.einsum(
                "hkn,kn->hn", part.reshape(-1, size, part.shape[1]), basis[:size, variable]
            )
        return part[0]
