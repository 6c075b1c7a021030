"""Signals that repeat with several angles at once: grids, harmonics and the way between them.

Orders 1, 2 and 2.02 share no short period, but as a = 1, b = 0.02 they are (1, 0), (2, 0), (2, 1):
a function on a torus of two angles. On a grid of that torus products and laws are evaluated point
by point, and the discrete Fourier transform leads to the orders and back without leakage.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive._solve.fundamentals import TOLERANCE, multiples_of
from pymoo_hdte.drive._solve.recursion import Recollection

Matrices = NDArray[np.float64]


@lru_cache(maxsize=8)
def shared_torus(fundamentals: tuple[float, ...], highest: tuple[int, ...]) -> Torus:
    """Return a torus that all callers share: its tables take longer than a solution."""
    return Torus(fundamentals, highest)


class Torus:
    """A grid over the phases of ``fundamentals`` and the harmonics up to ``highest`` of each.

    Parameters
    ----------
    fundamentals : sequence of float
        Orders of the angles, in cycles per input turn; the first is 1.
    highest : sequence of int
        Largest multiple of each that is kept.
    at_once : int, optional
        Most angles beside the first of which a kept harmonic has a multiple; by default all.

    Attributes
    ----------
    orders : ndarray, shape (n_harmonics,)
        Orders of the kept harmonics; the first is 0. Others may be negative: a real signal's line
        at -o is the conjugate of that at o, so only one of the two is kept.
    size : int
        Number G of grid points.
    """

    def __init__(
        self, fundamentals: Sequence[float], highest: Sequence[int], at_once: int | None = None
    ) -> None:
        self.fundamentals = tuple(fundamentals)
        self.highest = tuple(highest)
        if len(self.fundamentals) != len(self.highest) or self.fundamentals[0] != 1.0:
            raise InvalidInput("fundamentals", fundamentals, "1 first, and one highest for each")
        every = product(*(range(-most, most + 1) for most in self.highest))
        most = len(self.highest) if at_once is None else at_once
        half = [k for k in every if k > (0,) * len(k) and np.count_nonzero(k[1:]) <= most]
        self._multiples = np.array([(0,) * len(self.highest), *half])
        self.orders = self._multiples @ np.array(self.fundamentals)
        # Four points a cycle of the highest harmonic: squares are free of aliasing, and cubes of
        # all but the highest harmonic.
        grids = [2.0 * np.pi * np.arange(4 * most) / (4 * most) for most in self.highest]
        mesh = np.meshgrid(*grids, indexing="ij")
        self._shape = mesh[0].shape
        self._phases = np.array([axis.ravel() for axis in mesh])
        self.size = self._phases.shape[1]
        # A product of the first angle and all others: a signal is summed over the others first.
        # Of a line and its conjugate one is kept, so that the first multiple is never negative
        # and half of those with multiple 0 are missing.
        self._turns = self.highest[0] + 1
        self._missing = sum(k[0] == 0 for k in half)
        self._beats = 2 * self._missing + 1
        # Points of the other angles at each of the first.
        self._points = self.size // self._shape[0]
        self._axes = tuple(range(1, 1 + len(self._shape)))
        self._places: dict[float, tuple[int, bool] | None] = {}
        self._rate = 1j * self.orders
        self._moving = self.orders != 0.0
        self._divisor = np.where(self._moving, self._rate, 1.0)

    @cached_property
    def core(self) -> Torus:
        """The same grid with the harmonics of one angle beside the first at a time."""
        return Torus(self.fundamentals, self.highest, 1)

    @cached_property
    def of_core(self) -> NDArray[np.int_]:
        """Indices of the harmonics of the `core`."""
        return np.flatnonzero(np.count_nonzero(self._multiples[:, 1:], axis=1) <= 1)

    @cached_property
    def _pairs(self) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Places of differences and of sums of two harmonics in a transform, each (H, H)."""
        lines = self._multiples
        return self._flat(lines[:, None] - lines), self._flat(lines[:, None] + lines)

    @cached_property
    def _of_beats(self) -> Matrices:
        """Harmonics of all angles but the first on their grid, (2 beats, 2 points).

        Real and imaginary part of a harmonic are side by side, as complex numbers lie in memory;
        all real values on the grid come before the imaginary ones.
        """
        multiples = self._multiples[self._missing + 1 :][: self._beats, 1:]
        argument = multiples @ self._phases[1:, : self._points]
        cosine, sine = np.cos(argument), np.sin(argument)
        rows = [np.hstack([cosine, sine]), np.hstack([-sine, cosine])]
        return np.stack(rows, axis=1).reshape(2 * self._beats, -1)

    @cached_property
    def _of_turns(self) -> Matrices:
        """Harmonics of the first angle, real before imaginary part of each, on its grid.

        Shape (points, 2 turns).
        """
        angle = self._phases[0, :: self._points]
        argument = np.outer(angle, np.arange(self._turns))
        parts = np.stack([np.cos(argument), -np.sin(argument)], axis=2)
        return parts.reshape(len(angle), -1)

    @cached_property
    def _to_turns(self) -> Matrices:
        """Values on the grid to harmonics of the first angle: (2 turns, points)."""
        return np.ascontiguousarray(self._of_turns.T)

    @cached_property
    def _to_beats(self) -> Matrices:
        """Values on the grid of the other angles to their harmonics: (2 points, 2 beats)."""
        return np.ascontiguousarray((2.0 / self.size) * self._of_beats.T)

    @cached_property
    def _synthesis(self) -> Matrices:
        """Values on the grid, (G, 2 H), by all real parts of harmonics, then all imaginary."""
        argument = self._phases.T @ self._multiples.T
        return np.hstack([np.cos(argument), -np.sin(argument)])

    def _flat(self, multiples: NDArray[np.int_]) -> NDArray[np.int_]:
        """Return the indices of multiples (..., n_angles) in a flattened transform of the grid."""
        wrapped = np.moveaxis(multiples % np.array(self._shape), -1, 0)
        return np.asarray(np.ravel_multi_index(tuple(wrapped), self._shape))

    def phase(self, order: float) -> NDArray[np.float64]:
        """Return ``order`` times the input angle on the grid, shape (G,), up to whole turns."""
        return np.asarray(multiples_of(self.fundamentals, order) @ self._phases)

    def place(self, order: float) -> tuple[int, bool]:
        """Return the index of an order among the harmonics, and whether it is there as -o."""
        place = self.find(order)
        if place is None:
            raise InvalidInput("order", order, f"within {self.highest} times {self.fundamentals}")
        return place

    def find(self, order: float) -> tuple[int, bool] | None:
        """Return the same as `place`, or None for an order that is not kept."""
        if order not in self._places:
            self._places[order] = self._searched(order)
        return self._places[order]

    def _searched(self, order: float) -> tuple[int, bool] | None:
        for sign in (1.0, -1.0):
            places = np.flatnonzero(np.abs(self.orders - sign * order) < TOLERANCE)
            if places.size:
                return int(places[0]), sign < 0.0
        return None

    def harmonics(
        self, orders: NDArray[np.float64], phasors: NDArray[np.complex128]
    ) -> NDArray[np.complex128]:
        """Return lines (n, m) at orders (m,) as harmonics; those that are not kept are left out."""
        harmonics = np.zeros((len(phasors), len(self.orders)), dtype=complex)
        for order, column in zip(orders.tolist(), phasors.T, strict=True):
            if (place := self.find(order)) is not None:
                index, conjugate = place
                harmonics[:, index] = column.conj() if conjugate else column
        return harmonics

    def path(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return grid values (n, G) in the order in which a slow beat passes them, twice over.

        One input turn after the other, each at the next point of the other angles. Laws that depend
        on the sequence of extremes but not on time respond as in the real, slower beat; the second
        passage is independent of the start from rest.
        """
        points = self._shape[0]
        turns = values.reshape(len(values), points, self.size // points).swapaxes(1, 2)
        return np.tile(turns.reshape(len(values), self.size), 2)

    def back(self, along: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the second passage of values along `path` on the grid, shape (n, G)."""
        points = self._shape[0]
        second = along[:, self.size :].reshape(len(along), self.size // points, points)
        return second.swapaxes(1, 2).reshape(len(along), self.size)

    def signal(self, phasors: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return values on the grid, shape (n, G), of Re sum phasor exp(i order alpha)."""
        n = len(phasors)
        whole = np.zeros((n, self._turns * self._beats), dtype=complex)
        whole[:, self._missing :] = phasors
        parts = whole.view(float).reshape(n * self._turns, 2 * self._beats)
        over_beats = (parts @ self._of_beats).reshape(n, 2 * self._turns, self._points)
        return (self._of_turns @ over_beats).reshape(n, self.size)

    def phasors(self, values: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return the kept harmonics, shape (n, n_harmonics), of values on the grid."""
        n = len(values)
        of_turns = self._to_turns @ values.reshape(n, self._shape[0], self._points)
        whole = of_turns.reshape(n * self._turns, 2 * self._points) @ self._to_beats
        harmonics = whole.view(complex).reshape(n, self._turns * self._beats)[:, self._missing :]
        harmonics[:, 0] *= 0.5
        return harmonics

    def derivative(self, phasors: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the harmonics of the derivative by the input angle."""
        return self._rate * phasors

    def integral(self, phasors: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the harmonics of the zero-mean integral over the input angle."""
        return np.where(self._moving, phasors / self._divisor, 0.0)

    def product_matrix(self, factor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the real matrices that multiply a signal by ``factor``, given on the grid (n, G).

        They act on stacked real and imaginary parts of harmonics, shape (n, 2 H, 2 H). With the
        Fourier coefficients F of the factor, line j of the product is the sum over lines k of
        F(j - k) x_k + F(j + k) conj(x_k).
        """
        spectrum = fft.fftn(factor.reshape(-1, *self._shape), axes=self._axes, norm="forward")
        flat = spectrum.reshape(len(factor), self.size)
        below, above = (flat[:, places] for places in self._pairs)
        size = len(self.orders)
        matrix = np.empty((len(factor), 2 * size, 2 * size))
        matrix[:, :size, :size] = below.real + above.real
        matrix[:, :size, size:] = above.imag - below.imag
        matrix[:, size:, :size] = below.imag + above.imag
        matrix[:, size:, size:] = below.real - above.real
        # The mean counts once, a line with its conjugate twice.
        matrix[:, 0] *= 0.5
        return matrix

    def recall_matrix(self, recollection: Recollection) -> NDArray[np.float64]:
        """Return the real matrices by which forces depend on the signal elsewhere.

        There is one for each of n rows, along a `path`; it acts as those of `product_matrix`.
        """
        n, size = len(recollection.places), 2 * len(self.orders)
        matrices = np.empty((n, size, size))
        for row in range(n):
            elsewhere = recollection.of_signals(self._synthesis, row)
            matrices[row] = self._stacked_harmonics(elsewhere)
        return matrices

    def _stacked_harmonics(self, columns: Matrices) -> Matrices:
        """Return the harmonics (2 H, m), real parts first, of m signals on the grid, (G, m)."""
        m = columns.shape[1]
        of_turns = self._to_turns @ columns.reshape(self._shape[0], -1)
        whole = self._to_beats.T @ of_turns.reshape(self._turns, -1, m)
        parts = whole.reshape(self._turns * self._beats, 2, m)[self._missing :]
        parts[0] *= 0.5
        return parts.swapaxes(0, 1).reshape(-1, m)
