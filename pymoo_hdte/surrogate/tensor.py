"""Chebyshev series in several variables on the cube [-1, 1]^d: nodes, coefficients, values."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import numpy as np
from numpy.polynomial.chebyshev import chebder
from numpy.typing import NDArray

# OpenBLAS keeps a matrix product of up to a million multiplications on one thread. A larger one
# starts threads that gain nothing here, and stall when several processes share the cores.
MULTIPLICATIONS_AT_ONCE = 1_000_000


def chebyshev_nodes(size: int) -> NDArray[np.float64]:
    """Return the roots of the Chebyshev polynomial of degree ``size``, shape (size,) (Eq. 20)."""
    return np.cos(_node_angles(size))


def _node_angles(size: int) -> NDArray[np.float64]:
    return (2 * np.arange(size) + 1) * np.pi / (2 * size)


def chebyshev_basis(x: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Return T_0 .. T_(size-1) at ``x``, shape (size, *x.shape), by the three-term recurrence."""
    basis = np.empty((size, *x.shape))
    basis[0] = 1.0
    basis[1:2] = x
    twice = 2.0 * x
    rows = list(basis)
    for before, current, new in zip(rows, rows[1:], rows[2:], strict=False):
        np.multiply(twice, current, out=new)
        np.subtract(new, before, out=new)
    return basis


def to_orthonormal(
    x: NDArray[np.float64], weights: NDArray[np.float64], size: int
) -> NDArray[np.float64]:
    """Return R, shape (size, size), of T_a = sum_b R_ba phi_b, the phi orthonormal under a rule.

    The triangular factor of the weighted basis at the values ``x``, shape (q,). Unlike a Cholesky
    factor of its moments, it keeps all digits of a narrow distribution, and is there for one of no
    width. phi_0 is the constant 1.
    """
    change = np.array(np.linalg.qr((chebyshev_basis(x, size) * np.sqrt(weights)).T, mode="r"))
    return change * np.sign(change[0, 0])


def coefficients_from_nodes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn values on a tensor grid of Chebyshev nodes into the coefficients of the interpolant.

    This is the product Gauss-Chebyshev rule of Eq. (24). The factor (1/2)^h that Eq. (23) puts
    before a term with h zero indices is folded into the coefficients here, so the expansion is
    the plain sum of ``coefficients[i] * T_i1(x_1) * ... * T_id(x_d)``.

    Parameters
    ----------
    values : ndarray, shape (p_1, ..., p_d)
        Entry ``q`` is the function's value at ``chebyshev_nodes(p_j)[q_j]`` in each variable j.

    Returns
    -------
    ndarray, same shape
    """
    coefficients = values
    for axis, size in enumerate(values.shape):
        rule = (2.0 / size) * np.cos(np.outer(np.arange(size), _node_angles(size)))
        rule[0] *= 0.5
        coefficients = np.moveaxis(np.tensordot(rule, coefficients, axes=(1, axis)), 0, axis)
    return coefficients


class TensorPolynomial:
    """Several tensor Chebyshev series of one shape, evaluated together.

    The variables are split into a leading and a trailing half. As a matrix over the products of
    polynomials of either half, the coefficients of a smooth function often have a low rank r; then
    one small product for each half, and a sum of r terms, give the values. Otherwise the trailing
    half is summed by one product and the leading half point by point.

    Parameters
    ----------
    coefficients : ndarray, shape (outputs, p_1, ..., p_d)
        Plain coefficients: no factor 1/2 is left to apply.
    """

    def __init__(self, coefficients: NDArray[np.float64]) -> None:
        self.coefficients = np.array(coefficients)
        self.coefficients.flags.writeable = False
        shape = self.coefficients.shape[1:]
        self._head, self._tail = shape[: len(shape) // 2], shape[len(shape) // 2 :]
        self._longest = max(shape)
        matrices = self.coefficients.reshape(-1, prod(self._head), prod(self._tail))
        self._leading: NDArray[np.float64] | None
        self._leading, self._trailing = _factors(matrices)
        if self._leading.size + self._trailing.size >= matrices.size:
            self._leading, self._trailing = None, matrices.reshape(-1, matrices.shape[2])

    def __call__(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values, shape (outputs, n), at points ``x`` of the cube, shape (d, n)."""
        largest = max(self._trailing.size, 0 if self._leading is None else self._leading.size)
        step = max(1, MULTIPLICATIONS_AT_ONCE // largest)
        if x.shape[1] <= step:
            return self._block(x)
        values = np.empty((len(self.coefficients), x.shape[1]))
        for start in range(0, x.shape[1], step):
            block = slice(start, start + step)
            values[:, block] = self._block(x[:, block])
        return values

    def _block(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        basis = chebyshev_basis(x, self._longest)
        split = len(self._head)
        leading = products(basis[:, :split], self._head)
        trailing = self._trailing @ products(basis[:, split:], self._tail)
        if self._leading is None:
            parts = trailing.reshape(len(self.coefficients), *leading.shape)
            return np.einsum("ohn,hn->on", parts, leading)
        parts = (self._leading @ leading).reshape(len(self.coefficients), *trailing.shape)
        return np.einsum("orn,rn->on", parts, trailing)

    def derivatives(self, axes: Sequence[int]) -> TensorPolynomial:
        """Return the partial derivatives in the variables ``axes``.

        Output ``a * outputs + o`` of the result is the derivative of output o in ``axes[a]``.
        """
        parts = []
        for axis in axes:
            part = np.zeros_like(self.coefficients)
            derivative = chebder(self.coefficients, axis=axis + 1)
            # chebder shortens the axis by one, but leaves an axis of length one (a constant).
            part[tuple(slice(size) for size in derivative.shape)] = derivative
            parts.append(part)
        return TensorPolynomial(np.concatenate(parts))


def _factors(
    matrices: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Factor the matrices (outputs, h, t) into (outputs * r, h) and a common (r, t).

    Singular values below the rounding of the largest are dropped. Outputs are brought to one scale
    first, so that each keeps all its digits.
    """
    outputs, rows, columns = matrices.shape
    scale = np.abs(matrices).max(axis=(1, 2), keepdims=True)
    scaled = matrices / np.where(scale > 0.0, scale, 1.0)
    left_vectors, values, right = np.linalg.svd(scaled.reshape(-1, columns), full_matrices=False)
    rank = max(1, int(np.sum(values > np.finfo(float).eps * values[0])))
    weighted = (left_vectors[:, :rank] * values[:rank]).reshape(outputs, rows, rank) * scale
    return weighted.transpose(0, 2, 1).reshape(-1, rows), right[:rank]


def products(basis: NDArray[np.float64], sizes: tuple[int, ...]) -> NDArray[np.float64]:
    """Return all products of one polynomial per variable (Khatri-Rao), shape (prod(sizes), n)."""
    points = basis.shape[-1]
    if not sizes:
        return np.ones((1, points))
    product = basis[: sizes[0], 0]
    for variable, size in enumerate(sizes[1:], start=1):
        product = product[:, None] * basis[:size, variable]
        product = product.reshape(product.shape[0] * size, points)
    return product
