"""Sobol indices of a Chebyshev surrogate in closed form, without a sample.

Written in polynomials that are orthonormal under the inputs' distributions, a tensor polynomial's
variance is the sum of its squared coefficients but the first, and each of them belongs to exactly
the variables in which its polynomial is no constant (Sudret, Reliability Engineering and System
Safety 93, 2008). The change of basis is one small matrix a variable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.surrogate.box import Box
from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.inputs import UncertainInput
from pymoo_hdte.surrogate.tensor import to_orthonormal

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Values of one variable, shape (q,), and their weights, which sum to one."""


@dataclass(frozen=True)
class SobolIndices:
    """How the variance of an output divides among its independent inputs (Sobol indices).

    Attributes
    ----------
    names : tuple of str, length d
        Names of the inputs.
    mean, variance : float
        Mean and variance of the output, in its unit and the square of that.
    first : ndarray, shape (d,)
        First-order indices: the share of the variance that is due to one input alone. The
        variance would be less by it, on average, if the input were known.
    total : ndarray, shape (d,)
        Total indices: the share in which an input takes part, with interactions. It is what would
        be left of the variance, on average, if all other inputs were known.

    Notes
    -----
    First-order indices sum to at most 1, total ones to at least 1. All are 0 where the output does
    not vary and there is nothing to share. Sobol, Mathematics and Computers in Simulation 55, 2001.

    Examples
    --------
    >>> box = Box(("x", "y"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: 3 * X[:, 0] + X[:, 1], box, 1)
    >>> np.round(sobol_indices_over_box(surrogate, box).first, 3)
    array([0.9, 0.1])
    """

    names: tuple[str, ...]
    mean: float
    variance: float
    first: NDArray[np.float64]
    total: NDArray[np.float64]


def sobol_indices(
    surrogate: ChebyshevSurrogate, inputs: Sequence[UncertainInput], design: ArrayLike
) -> SobolIndices:
    """Return the indices over the scatter around one design, in closed form.

    From the coefficients in polynomials that are orthonormal under the inputs (Sudret, Reliability
    Engineering and System Safety 93, 2008).

    Parameters
    ----------
    surrogate : ChebyshevSurrogate
        Polynomial in d variables, of any orders.
    inputs : sequence of TruncatedNormal or UniformBand, length d
        The scatter of each variable of the surrogate, in its order, as `ExactMoments` takes it.
    design : array_like, shape (m,)
        Values of the m variables with a `UniformBand`, in the surrogate's order and units.

    Returns
    -------
    SobolIndices
        Exact to rounding, as are its mean and variance.

    Raises
    ------
    InvalidInput
        If the inputs or the design do not match the surrogate.
    ExtrapolationError
        If the scatter leaves the box of the surrogate.

    Examples
    --------
    >>> box = Box(("x",), np.array([0.5]), np.array([2.5]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0] ** 2, box, 2)
    >>> np.round(sobol_indices(surrogate, [UniformBand(0.1)], np.array([1.0])).first, 3)
    array([1.])
    """
    box = surrogate.box
    if len(inputs) != len(box):
        raise InvalidInput("number of inputs", len(inputs), str(len(box)))
    for name, entry in zip(box.names, inputs, strict=True):
        if not isinstance(entry, UncertainInput):
            raise InvalidInput(f"input {name!r}", entry, "a TruncatedNormal or a UniformBand")
    designed = np.array([entry.scales_design for entry in inputs])
    scale = np.ones(len(box))
    scale[designed] = finite_array("design", design, (int(designed.sum()),))
    box.check_inside(np.array([entry.support for entry in inputs]).T * scale)
    rules = []
    for entry, factor, order in zip(inputs, scale, surrogate.orders, strict=True):
        values, weights = entry.quadrature(2 * order)
        rules.append((factor * values, weights))
    return _indices(surrogate, rules)


def sobol_indices_over_box(surrogate: ChebyshevSurrogate, box: Box) -> SobolIndices:
    """Return the indices for variables that are uniform over a whole ``box``.

    Closed form as in `sobol_indices` (Sudret 2008).

    Parameters
    ----------
    surrogate : ChebyshevSurrogate
        Polynomial in d variables, of any orders.
    box : Box
        Box of the surrogate's variables, e.g. ``surrogate.box`` itself.

    Returns
    -------
    SobolIndices
        Exact to rounding, as are its mean and variance.

    Raises
    ------
    InvalidInput
        If the box has other variables than the surrogate.
    ExtrapolationError
        If it leaves the surrogate's box.

    Examples
    --------
    >>> box = Box(("x", "y"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0] * X[:, 1], box, 1)
    >>> np.round(sobol_indices_over_box(surrogate, box).total, 3)
    array([1., 1.])
    """
    if box.names != surrogate.box.names:
        raise InvalidInput("names of the box", box.names, str(surrogate.box.names))
    surrogate.box.check_inside(np.array([box.lower, box.upper]))
    rules = []
    for centre, half_width, order in zip(box.centre, box.half_width, surrogate.orders, strict=True):
        nodes, weights = leggauss(order + 1)
        rules.append((centre + half_width * nodes, weights / 2.0))
    return _indices(surrogate, rules)


def _indices(surrogate: ChebyshevSurrogate, rules: Sequence[Rule]) -> SobolIndices:
    coefficients = _orthonormal_coefficients(surrogate, rules)
    mean = float(coefficients.flat[0])
    rounding = np.finfo(float).eps * np.abs(coefficients).max()
    shares = coefficients**2
    shares.flat[0] = 0.0
    variance = float(shares.sum())
    if variance <= shares.size * rounding**2:
        variance, shares = 0.0, np.zeros_like(shares)
    else:
        shares /= variance
    first_order, total = np.empty((2, shares.ndim))
    for axis in range(shares.ndim):
        by_degree = np.moveaxis(shares, axis, 0).reshape(shares.shape[axis], -1)
        first_order[axis] = by_degree[1:, 0].sum()
        total[axis] = by_degree[1:].sum()
    return SobolIndices(surrogate.box.names, mean, variance, first_order, total)


def _orthonormal_coefficients(
    surrogate: ChebyshevSurrogate, rules: Sequence[Rule]
) -> NDArray[np.float64]:
    """Return the surrogate's coefficients in polynomials orthonormal under the rules."""
    box, coefficients = surrogate.box, surrogate.coefficients
    for axis, (values, weights) in enumerate(rules):
        cube = (values - box.centre[axis]) / box.half_width[axis]
        change = to_orthonormal(cube, weights, coefficients.shape[axis])
        coefficients = np.moveaxis(np.tensordot(change, coefficients, axes=(1, axis)), 0, axis)
    return coefficients
