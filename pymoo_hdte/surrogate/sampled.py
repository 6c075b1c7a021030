"""Sampled mean and standard deviation of a surrogate, with common random numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import whole_number
from pymoo_hdte.surrogate.box import Box
from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.inputs import UncertainInput, Uncertainty
from pymoo_hdte.surrogate.moments import divide_or_zero

# Bounds the memory, whatever the number of designs.
_POINTS_AT_ONCE = 8192


class SampledMoments:
    """Monte Carlo mean and standard deviation as in the paper (Section 5.1).

    The samples of the inputs' standard variables are drawn once, at construction, one input after
    the other in the surrogate's order: all designs and all calls share them (common random
    numbers), so differences between designs are not blurred by sampling. Every sampled point of
    every design is evaluated on the surrogate.

    Parameters
    ----------
    surrogate, inputs, design_box
        As for `ExactMoments`.
    n_samples : int
        Samples of each design, at least 2.
    seed : int
        Seed of the generator that draws them, at least 0.

    Attributes
    ----------
    uncertainty : Uncertainty
        The inputs, checked against the boxes.
    surrogate : ChebyshevSurrogate
        As given.

    Raises
    ------
    InvalidInput
        As for `ExactMoments`; also for a number of samples below 2 or a negative seed.

    Examples
    --------
    >>> box = Box(("x",), np.array([0.5]), np.array([2.5]))
    >>> surrogate = ChebyshevSurrogate.fit(lambda X: X[:, 0] ** 2, box, 2)
    >>> design_box = Box(("x",), np.array([1.0]), np.array([2.0]))
    >>> moments = SampledMoments(surrogate, [UniformBand(0.1)], design_box, 1000, seed=1)
    >>> mean, std = moments(np.array([[1.0]]))
    >>> print(f"{mean[0]:.2f}")
    1.00
    """

    def __init__(
        self,
        surrogate: ChebyshevSurrogate,
        inputs: Sequence[UncertainInput],
        design_box: Box,
        n_samples: int,
        seed: int,
    ) -> None:
        self.uncertainty = Uncertainty(surrogate.box, inputs, design_box)
        self.design_box = design_box
        self.n_samples = whole_number("n_samples", n_samples, 2)
        self.seed = whole_number("seed", seed, 0)
        random_state = np.random.default_rng(self.seed)
        self._samples = np.array(
            [entry.sample(random_state, self.n_samples) for entry in self.uncertainty.inputs]
        )
        self.surrogate = surrogate

    def __call__(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and standard deviation of the samples, shape (n,) each, in the output's unit.

        The standard deviation divides by the number of samples (population convention).

        Parameters
        ----------
        designs : array_like, shape (n, m)
            Design variables in the units of ``design_box``.

        Raises
        ------
        ExtrapolationError
            If a design lies outside ``design_box``.
        InvalidInput
            If ``designs`` is no array of numbers of shape (n, m).
        """
        checked = self._checked(designs)
        mean, std = np.empty((2, len(checked)))
        for block, points in self._blocks(checked):
            values = self.surrogate(points).reshape(-1, self.n_samples)
            mean[block] = values.mean(axis=1)
            std[block] = values.std(axis=1)
        return mean, std

    def gradient(self, designs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the exact gradients, shape (n, m) each, of what a call returns.

        In the output's unit per unit of each variable. Where the standard deviation is zero its
        gradient is given as zero. Parameters and errors as in `__call__`.
        """
        checked = self._checked(designs)
        dmean, dstd = np.empty((2, *checked.shape))
        axes = list(self.uncertainty.design_axes)
        for block, points in self._blocks(checked):
            values = self.surrogate(points).reshape(-1, self.n_samples)
            slopes = self.surrogate.gradient(points)[:, axes].T
            slopes = slopes.reshape(len(axes), -1, self.n_samples)
            slopes *= self._samples[axes, None]
            deviation = values - values.mean(axis=1, keepdims=True)
            dmean[block] = slopes.mean(axis=2).T
            covariance = np.einsum("mns,ns->nm", slopes, deviation) / self.n_samples
            dstd[block] = divide_or_zero(covariance, values.std(axis=1)[:, None])
        return dmean, dstd

    def _checked(self, designs: ArrayLike) -> NDArray[np.float64]:
        return self.design_box.from_cube(self.design_box.to_cube(designs))

    def _blocks(self, designs: NDArray[np.float64]) -> Iterator[tuple[slice, NDArray[np.float64]]]:
        """Yield a few designs at a time: their rows and their sampled points.

        The points have shape (designs * samples, d), the samples running fastest.
        """
        step = max(1, _POINTS_AT_ONCE // self.n_samples)
        for start in range(0, len(designs), step):
            block = slice(start, start + step)
            # One variable per contiguous row, as the surrogate works.
            points = np.empty((len(self._samples), len(designs[block]), self.n_samples))
            points[:] = self._samples[:, None]
            for column, axis in enumerate(self.uncertainty.design_axes):
                points[axis] *= designs[block, column, None]
            yield block, points.reshape(len(points), -1).T
