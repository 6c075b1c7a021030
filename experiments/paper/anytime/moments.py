"""The three ways to get mean and standard deviation: exact, common samples, fresh samples."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte.problems import RobustProblem
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, SampledMoments
from pymoo_hdte.surrogate.inputs import UncertainInput
from pymoo_hdte.surrogate.tensor import (
    TensorPolynomial,
    chebyshev_nodes,
    coefficients_from_nodes,
)

EXACT, COMMON, FRESH = "exact", "common", "fresh"
N_SAMPLES = 1000
"""Of every design, as the paper draws them."""
COMMON_SEED = 1
"""Seed of the samples that all designs of all runs share."""


class CommonMoments(SampledMoments):
    """`SampledMoments` of the same samples at a thousandth of the cost.

    On a tensor polynomial of degree k, mean and variance over fixed samples are tensor polynomials
    of the design as well, of degree k and 2 k. They are found once, from their values on a
    Chebyshev grid of designs. Parameters and errors as for `SampledMoments`.
    """

    def __init__(
        self,
        surrogate: ChebyshevSurrogate,
        inputs: Sequence[UncertainInput],
        design_box: Box,
        n_samples: int,
        seed: int,
    ) -> None:
        super().__init__(surrogate, inputs, design_box, n_samples, seed)
        sizes = [2 * surrogate.coefficients.shape[a] - 1 for a in self.uncertainty.design_axes]
        axes = np.meshgrid(*map(chebyshev_nodes, sizes), indexing="ij")
        cube = np.column_stack([axis.ravel() for axis in axes])
        mean, std = super().__call__(design_box.from_cube(cube))
        on_grid = [moment.reshape(sizes) for moment in (mean, std**2)]
        self._polynomial = TensorPolynomial(np.array([*map(coefficients_from_nodes, on_grid)]))

    def __call__(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As `SampledMoments`, to rounding."""
        mean, variance = self._polynomial(self.design_box.to_cube(designs).T)
        return mean, np.sqrt(np.maximum(variance, 0.0))


class FreshMoments(SampledMoments):
    """`SampledMoments` whose samples are drawn anew for every evaluation of every design.

    Parameters
    ----------
    surrogate, inputs, design_box, n_samples
        As for `SampledMoments`.
    random_state : numpy.random.Generator
        What draws them.
    """

    def __init__(
        self,
        surrogate: ChebyshevSurrogate,
        inputs: Sequence[UncertainInput],
        design_box: Box,
        n_samples: int,
        random_state: np.random.Generator,
    ) -> None:
        super().__init__(surrogate, inputs, design_box, n_samples, seed=0)
        self._random_state = random_state

    def __call__(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As `SampledMoments`; the same design gives other numbers the next time."""
        checked = self._checked(designs)
        moments = np.empty((2, len(checked)))
        for row in range(len(checked)):
            self._samples = np.array(
                [e.sample(self._random_state, self.n_samples) for e in self.uncertainty.inputs]
            )
            moments[:, row] = np.ravel(super().__call__(checked[row : row + 1]))
        return moments[0], moments[1]


def problem_with(model: str, moments: str, seed: int) -> RobustProblem:
    """Return the robust problem on a drive model with one of the three kinds of moments.

    ``seed`` is for fresh samples alone; common ones are the same in all runs, and built once.
    """
    if moments == EXACT:
        return robust_problem(model)
    if moments == COMMON:
        return _common(model)
    # Not the seed alone: the algorithm draws its first designs with a generator of that.
    return _sampled(model, np.random.default_rng([seed, N_SAMPLES]))


@cache
def _common(model: str) -> RobustProblem:
    return _sampled(model, COMMON_SEED)


def _sampled(model: str, source: int | np.random.Generator) -> RobustProblem:
    problem = robust_problem(model)
    scatter = problem.surrogate, problem.inputs, problem.moments.design_box, N_SAMPLES
    moments: SampledMoments
    if isinstance(source, int):
        moments = CommonMoments(*scatter, source)
    else:
        moments = FreshMoments(*scatter, source)
    return RobustProblem(moments, problem.obj_names, problem.units)
