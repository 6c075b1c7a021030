"""Ways to spend model runs on a surrogate: tensor grids, sparse grids, scattered points.

All are polynomials on the same box. chaospy's are polynomial chaos expansions for variables that
are uniform over the box; those of a total degree are fitted by least squares to twice as many
points as they have terms (point collocation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import chaospy
import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, latin_hypercube, sobol_indices_over_box
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes

Points = NDArray[np.float64]
Function = Callable[[Points], NDArray[np.float64]]

TENSOR = "Chebyshev tensor grid"
SCREENED = "Chebyshev grid, idle parameters held"
TENSOR_CHAOS = "chaospy, tensor Gauss quadrature"
SPARSE_CHAOS = "chaospy, sparse (Smolyak) quadrature"
SOBOL_CHAOS = "chaospy, total degree, Sobol points"
LATIN_CHAOS = "chaospy, total degree, Latin hypercube"

FAMILIES = (TENSOR, SCREENED, TENSOR_CHAOS, SPARSE_CHAOS, SOBOL_CHAOS, LATIN_CHAOS)

IDLE = 1e-4
"""A parameter whose total Sobol index is below this on the coarsest grid is held at its centre."""

_TENSOR_ORDERS = (1, 2, 3, 4, 5)
_QUADRATURE_ORDERS = (1, 2, 3)
_SPARSE_ORDERS = (1, 2, 3, 4)
_DEGREES = (1, 2, 3, 4, 5, 6)
_POINTS_PER_TERM = 2
_SEED = 4


@dataclass(frozen=True)
class Rival:
    """A surrogate, how it was made, and the model runs it took."""

    family: str
    order: int
    runs: int
    predict: Function


def rivals(function: Function, box: Box) -> Iterator[Rival]:
    """Yield surrogates of ``function`` on the box, of every family and order.

    Parameters
    ----------
    function : callable
        Maps points (n, d) in the box to values (n,).
    box : Box
    """
    for order in _TENSOR_ORDERS:
        surrogate = ChebyshevSurrogate.fit(function, box, order)
        yield Rival(TENSOR, order, (order + 1) ** len(box), surrogate)
    yield from _screened(function, box)
    joint = chaospy.J(*[chaospy.Uniform(-1, 1) for _ in box.names])

    def on_cube(cube: Points) -> NDArray[np.float64]:
        return function(box.from_cube(cube.T))

    for order in _QUADRATURE_ORDERS:
        yield _by_quadrature(TENSOR_CHAOS, on_cube, box, joint, order)
    for order in _SPARSE_ORDERS:
        yield _by_quadrature(SPARSE_CHAOS, on_cube, box, joint, order)
    for degree in _DEGREES:
        expansion = chaospy.generate_expansion(degree, joint, normed=True)
        count = _POINTS_PER_TERM * len(expansion)
        scattered = {
            SOBOL_CHAOS: joint.sample(count, rule="sobol"),
            LATIN_CHAOS: box.to_cube(latin_hypercube(box, count, _SEED)).T,
        }
        for family, nodes in scattered.items():
            fitted = chaospy.fit_regression(expansion, nodes, on_cube(nodes))
            yield Rival(family, degree, count, _predictor(fitted, box))


def _screened(function: Function, box: Box) -> Iterator[Rival]:
    """Yield tensor grids in the parameters that matter on the coarsest grid, whose runs count."""
    coarse = ChebyshevSurrogate.fit(function, box, 1)
    active = sobol_indices_over_box(coarse, box).total >= IDLE
    for order in _TENSOR_ORDERS:
        sizes = np.where(active, order + 1, 1)
        surrogate = fit_grid(function, box, sizes.tolist())
        yield Rival(SCREENED, order, 2 ** len(box) + int(np.prod(sizes)), surrogate)


def fit_grid(function: Function, box: Box, sizes: Sequence[int]) -> ChebyshevSurrogate:
    """Interpolate at a tensor grid with its own number of Chebyshev nodes in every variable."""
    grid = np.meshgrid(*[chebyshev_nodes(size) for size in sizes], indexing="ij")
    nodes = box.from_cube(np.stack(grid, axis=-1).reshape(-1, len(box)))
    return ChebyshevSurrogate(box, coefficients_from_nodes(function(nodes).reshape(sizes)))


def _by_quadrature(
    family: str, on_cube: Function, box: Box, joint: chaospy.Distribution, order: int
) -> Rival:
    sparse = family == SPARSE_CHAOS
    truncation = {} if sparse else {"cross_truncation": np.inf}
    expansion = chaospy.generate_expansion(order, joint, normed=True, **truncation)
    nodes, weights = chaospy.generate_quadrature(order, joint, rule="gaussian", sparse=sparse)
    fitted = chaospy.fit_quadrature(expansion, nodes, weights, on_cube(nodes))
    return Rival(family, order, nodes.shape[1], _predictor(fitted, box))


def _predictor(polynomial: chaospy.ndpoly, box: Box) -> Function:
    def predict(points: Points) -> NDArray[np.float64]:
        return np.asarray(polynomial(*box.to_cube(points).T))

    return predict
