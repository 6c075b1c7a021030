"""A move by local quadratic models of the objectives, fitted to what was evaluated nearby."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled
from pymoo_hdte.algorithms.points import Points


class Quadratic(NamedTuple):
    """g z + z H z / 2 for each of m objectives: ``gradient`` (m, d), ``hessian`` (m, d, d)."""

    gradient: NDArray[np.float64]
    hessian: NDArray[np.float64]

    def weighted(self, weights: NDArray[np.float64]) -> Quadratic:
        """Return the sums of the objectives with ``weights`` (k, m), k models."""
        return Quadratic(
            weights @ self.gradient, np.tensordot(weights, self.hessian, axes=([1], [0]))
        )


_LINEAR_WEIGHT, _RIDGE = 100.0, 1e-6
_DEPENDENT = 1e-12
"""Share of their mean square that is added to scalar products: above rounding, far below a step."""
_DIRECTIONS = 6
"""In runs of 1,000 variables within 1e-4 of the lowest value, which halving leaves as well."""
_BLOCK = 250
"""Points whose differences from a leader still fit a processor's cache with 1,000 variables."""
_HALVINGS = 16
_LEAST_SHIFT = 1e-100
"""Keeps a model without slope and curvature at its place; its square is still a number."""


def fitted(Z: NDArray[np.float64], F: NDArray[np.float64]) -> Quadratic:
    """Return quadratics near objectives ``F`` (n, m) at places ``Z`` (n, d) of size one.

    Of all that fit alike they have the smallest second derivatives, so that fewer points than
    coefficients do: ridge regression with a polynomial kernel, in which constant and gradient are
    all but free (M. J. D. Powell, "The NEWUOA software for unconstrained optimization without
    derivatives", 2006, takes the smallest change of second derivatives).

    Raises
    ------
    numpy.linalg.LinAlgError
        If places are such that nothing can be fitted.
    """
    products = Z @ Z.T
    kernel = _LINEAR_WEIGHT * (1.0 + products) + 0.5 * products**2
    kernel.flat[:: len(Z) + 1] += _RIDGE * np.trace(kernel) / len(Z)
    parts = np.linalg.solve(kernel, F)
    return Quadratic(
        _LINEAR_WEIGHT * parts.T @ Z,
        np.array([(Z * part[:, np.newaxis]).T @ Z for part in parts.T]),
    )


class Span(NamedTuple):
    """Places (n, d) in n coordinates of their span, or as they stand without ``originals``.

    Gradient and second derivatives of `fitted` are combinations of the places, so that a model is
    flat at right angles to their span, and its lowest place lies within. The rows of the Cholesky
    factor of the scalar products are coordinates of the places in a basis of the span.
    """

    places: NDArray[np.float64]
    originals: NDArray[np.float64] | None

    @classmethod
    def of(cls, Z: NDArray[np.float64]) -> Span:
        """Return the span of places ``Z`` (n, d).

        Raises
        ------
        numpy.linalg.LinAlgError
            If they are not finite.
        """
        n = len(Z)
        products = Z @ Z.T
        # Places that depend on each other, the leader itself among them, have no factor without.
        products[np.diag_indices(n)] += _DEPENDENT * np.trace(products) / n
        return cls(np.asarray(np.linalg.cholesky(products), dtype=np.float64), Z)

    def lowest(
        self, model: Quadratic, which: NDArray[np.int_], radii: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the lowest places (k, d), as `lowest_within`, of models in these coordinates."""
        if self.originals is None:
            return lowest_within(model, which, radii)
        downhill, directions = along_gradients(model, _DIRECTIONS)
        steps = lowest_within(downhill, which, radii)[:, :, np.newaxis]
        coordinates = (directions[which] @ steps)[:, :, 0]
        return np.linalg.solve(self.places.T, coordinates.T).T @ self.originals


def along_gradients(model: Quadratic, size: int) -> tuple[Quadratic, NDArray[np.float64]]:
    """Return models in the first directions that their gradients lead to, and these directions.

    Gradient g, H g, H H g and so on, each at right angles to those before: the lowest place within
    a radius is a combination of few of them to many digits (N. I. M. Gould, S. Lucidi, M. Roma, Ph.
    L. Toint, "Solving the trust-region subproblem using the Lanczos method", SIAM Journal on
    Optimization 9 (1999) 504-525). Directions have shape (k, d, size), zero where there are fewer.
    """
    gradient, hessian = model
    directions = np.zeros((*gradient.shape, size))
    new = gradient[:, :, np.newaxis]
    least = 1e-10 * np.linalg.norm(gradient, axis=1)[:, np.newaxis, np.newaxis]
    for column in range(size):
        length = np.linalg.norm(new, axis=1, keepdims=True)
        new = np.divide(new, length, out=np.zeros_like(new), where=length > least)
        directions[:, :, column] = new[:, :, 0]
        new = hessian @ new
        for _ in range(2):  # once is not enough against rounding
            new = new - directions @ (directions.transpose(0, 2, 1) @ new)
    across = directions.transpose(0, 2, 1)
    slopes = (across @ gradient[:, :, np.newaxis])[:, :, 0]
    return Quadratic(slopes, across @ hessian @ directions), directions


def lowest_within(
    model: Quadratic, which: NDArray[np.int_], radii: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the lowest places (k, d) of the models ``which`` (k,) within ``radii`` (k,) of zero.

    They solve (H + l I) z = -g with the smallest l that makes the matrix positive and z short
    enough, found by halving in the eigenvectors of H.
    """
    values, vectors = np.linalg.eigh(model.hessian)
    slopes = np.einsum("kij,ki->kj", vectors, model.gradient)[which]
    values, radii = values[which], radii[:, np.newaxis]
    least = np.maximum(-values[:, :1], 0.0) + 1e-14 * np.abs(values).max(axis=1, keepdims=True)
    least = np.maximum(least * (1.0 + 1e-9), _LEAST_SHIFT)
    most = least + np.linalg.norm(slopes, axis=1, keepdims=True) / radii
    shift = _halved(slopes**2, values, radii**2, least, most)
    return np.einsum("kij,kj->ki", vectors[which], -slopes / (values + shift))


@compiled
def _halved(
    squares: NDArray[np.float64],
    values: NDArray[np.float64],
    largest: NDArray[np.float64],
    least: NDArray[np.float64],
    most: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the shifts (k, 1), between two bounds, that leave a step no longer than its radius.

    In plain loops, which compile in a tenth of the time of array expressions.
    """
    shifts = np.empty(most.shape)
    for row in range(len(squares)):
        low, high = least[row, 0], most[row, 0]
        for _ in range(_HALVINGS):
            middle, length = math.sqrt(low * high), 0.0
            for column in range(squares.shape[1]):
                length += squares[row, column] / (values[row, column] + middle) ** 2
            if length > largest[row, 0]:
                low = middle
            else:
                high = middle
        shifts[row, 0] = high
    return shifts


class ModelStep:
    """To where quadratic models of the objectives are lowest, near one leader of a generation.

    Fitted to the 3 d + 20 evaluated points nearest to the leader, at most 200; their median
    distance is the unit of length. A particle goes to the lowest place of a weighted sum of the
    models within a radius of 0.1 to 1 units, log-uniform; weights are uniform on the simplex, one
    in five an objective alone. Sums in which a quadratic model is right have their lowest places on
    the front, whatever the scales and directions of the variables are; the swarm does the rest.

    It remembers the latest 1,000 points that it is told.
    """

    EXACT = True
    """A mutation would spoil what is computed."""
    MEMORY = 1000
    LARGEST_FIT = 200
    WEIGHTS = 3
    """Different sums in a generation: each costs eigenvectors."""
    ALONE = 0.2
    SMALLEST_EXPONENT, LARGEST_EXPONENT = -1.0, 0.0

    def __init__(self) -> None:
        self.forget()

    def forget(self, widths: NDArray[np.float64] | None = None) -> None:
        """Forget all points: a run begins.

        Parameters
        ----------
        widths : ndarray, shape (d,), optional
            Ranges of the variables, in which distances are measured; by default they are equal.
        """
        self._told: list[Points] = []
        self._reach = np.ones(1)
        if widths is not None and np.any(widths > 0.0):
            self._reach = widths / widths.max()

    def learn(self, points: Points) -> None:
        """Remember evaluated points."""
        finite = np.isfinite(points.F).all(axis=1)
        new = points if finite.all() else points[np.flatnonzero(finite)]
        # Copies of a swarm share full blocks: a history would hold all points many times.
        if self._told and len(self._told[-1]) < _BLOCK:
            new = self._told.pop().followed_by(new)
        self._told.append(new)
        while sum(map(len, self._told[1:])) >= self.MEMORY:
            del self._told[0]

    def _known(self) -> list[Points]:
        """Return blocks of the latest points, at most as many as it remembers."""
        first, *others = self._told or [Points.none(0, 0)]
        room = self.MEMORY - sum(map(len, others))
        return [first[-room:], *others]

    def _away(self, X: NDArray[np.float64], centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the differences of positions (n, d) from a centre, in ranges of the variables."""
        away = X - centre
        away /= np.where(self._reach > 0.0, self._reach, 1.0)
        return away

    def __call__(
        self,
        X: NDArray[np.float64],
        leaders: NDArray[np.float64],
        swarm: NDArray[np.float64],
        random_state: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return the steps (n, d); none while there is nothing to fit."""
        n, d = X.shape
        known = self._known()
        F = np.concatenate([block.F for block in known])
        if not n or len(F) < 3:
            return np.zeros((n, d))
        centre = leaders[0]
        distances = np.concatenate(
            [np.sqrt((self._away(block.X, centre) ** 2).sum(axis=1)) for block in known]
        )
        nearest = min(len(distances), 3 * d + 20, self.LARGEST_FIT)
        neighbours = np.argpartition(distances, nearest - 1)[:nearest]
        in_order = np.sort(distances[neighbours])
        unit = 0.5 * float(in_order[(nearest - 1) // 2] + in_order[nearest // 2])  # their median
        F = F[neighbours] - F[distances.argmin()]
        width = np.ptp(F, axis=0)
        if not unit > 0.0 or not np.isfinite(width).all():
            return np.zeros((n, d))
        F = F / np.where(width > 0.0, width, 1.0)
        weights = self._weights(F.shape[1], random_state)
        radii = 10.0 ** random_state.uniform(self.SMALLEST_EXPONENT, self.LARGEST_EXPONENT, n)
        try:
            Z = self._away(_rows(known, neighbours), centre) / unit
            # Few variables cost less as they stand.
            span = Span.of(Z) if d > self.LARGEST_FIT else Span(Z, None)
            model = fitted(span.places, F).weighted(weights)
            places = span.lowest(model, np.arange(n) % len(weights), radii)
        except np.linalg.LinAlgError:
            return np.zeros((n, d))
        # A variable without a range does not move.
        return centre + unit * places * self._reach - X

    def _weights(self, n_obj: int, random_state: np.random.Generator) -> NDArray[np.float64]:
        weights = random_state.dirichlet(np.ones(n_obj), self.WEIGHTS)
        alone = random_state.random(self.WEIGHTS) < self.ALONE
        weights[alone] = np.eye(n_obj)[random_state.integers(n_obj, size=int(alone.sum()))]
        return weights


def _rows(blocks: Sequence[Points], rows: NDArray[np.int_]) -> NDArray[np.float64]:
    """Return positions (n, d) by their ``rows`` in all blocks together."""
    X = np.empty((len(rows), blocks[0].X.shape[1]))
    before = 0
    for block in blocks:
        within = (before <= rows) & (rows < before + len(block))
        X[within] = block.X[rows[within] - before]
        before += len(block)
    return X
