"""The least squares behind order lines: a straight line, waves over the angle, decay and jumps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular
from scipy.special import factorial

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.discrepancy._records.records import RunningRecord

# A numerical limit of a linear fit; the verdict does not depend on it.
LARGEST_CONDITION = 1e3
"""Largest condition number of the fit; beyond it the noise of the lines grows a thousandfold."""

FADING = (0.02, 0.05, 0.1, 0.25, 0.6, 2.0)
"""Time constants of what fades in a record, as shares of its duration. Set by hand on one seen
record of an output turn: from two turns of its input, before which a loop is not yet formed, to
what hardly fades, some three times apart. A loop that forgets takes several, as it slows down."""

_FASTEST = 2.0
"""Speed up to which a row's own one counts, in mean speeds: far above a noisy one."""
_STILL = 1e-9
"""Phase between samples below which averaging changes nothing, rad."""
ROWS_A_BLOCK = 1 << 15
"""Rows worked on at once, to bound the memory."""


@dataclass(frozen=True, eq=False)
class LineFit:
    """Least squares: ``values = basis @ triangle @ coefficients + residual``.

    The triangle is the Cholesky factor of the products of the columns. This loses twice as many
    digits as a QR; a second factor, of the products of the resulting basis, restores them (Yamamoto
    et al., Electronic Transactions on Numerical Analysis 44, 2015). Products add up over blocks of
    rows, so that a record of millions of rows takes the memory of one block.

    The columns are 1, the time from the middle of the record, the cosines, and minus the sines. A
    record that begins unsettled adds its decay and the derivative of that by the time constant,
    which is uncertain; each jump adds a unit step.

    Attributes
    ----------
    record, ratio, orders
        As in `order_lines`.
    parts : tuple of slice
        Rows of each block.
    whole : ndarray, shape (n, p), or None
        The basis of a record of one block.
    triangle : ndarray, shape (p, p)
    """

    record: RunningRecord
    ratio: float
    orders: NDArray[np.float64]
    parts: tuple[slice, ...]
    whole: NDArray[np.float64] | None
    triangle: NDArray[np.float64]

    @classmethod
    def of(cls, record: RunningRecord, ratio: float, orders: ArrayLike) -> LineFit:
        """Fit lines; the arguments and errors are those of `order_lines`."""
        checked = finite_array("orders", orders, (None,))
        for order in checked:
            real_number("orders", float(order), above=0.0, below=nyquist_order(record))
        starts = range(0, len(record.time), ROWS_A_BLOCK)
        parts = tuple(slice(start, start + ROWS_A_BLOCK) for start in starts)
        design = _design(record, checked, parts[0])
        products = design.T @ design
        for part in parts[1:]:
            rows = _design(record, checked, part)
            products += rows.T @ rows
        scale = np.sqrt(np.diag(products))
        apart = len(record.time) > len(scale) and bool(np.all(scale > 0.0))
        if apart:
            unit = products / np.outer(scale, scale)
            apart = bool(np.linalg.cond(unit) <= LARGEST_CONDITION**2)
        if not apart:
            allowed = "orders that a record of this length can tell apart"
            raise InvalidInput("orders", checked.tolist(), allowed)
        triangle = np.linalg.cholesky(unit).T * scale
        whole = _orthonormal(design, triangle) if len(parts) == 1 else None
        return cls(record, ratio, checked, parts, whole, triangle)._sharpened()

    def _sharpened(self) -> LineFit:
        """Return the fit with a basis that is orthonormal to the last digits."""
        products = np.sum([basis.T @ basis for basis in map(self.basis, self.parts)], axis=0)
        triangle = np.linalg.cholesky(products).T
        whole = None if self.whole is None else _orthonormal(self.whole, triangle)
        return replace(self, whole=whole, triangle=triangle @ self.triangle)

    @cached_property
    def projections(self) -> NDArray[np.float64]:
        """Parts of the channels in the basis, shape (p, 4)."""
        return self.projected(self.values)

    @cached_property
    def courses(self) -> NDArray[np.float64]:
        """Parts in the basis of slow courses of unit size, shape (p, 9).

        These are (t - t_mid)^k / k! for k = 2, 3, 4, then decays from the first row on with the
        time constants `FADING`.
        """
        constants = np.ptp(self.record.time) * np.array(FADING)

        def signals(part: slice) -> NDArray[np.float64]:
            return np.hstack([_bent(self.record, part), decays(self.record, part, constants)])

        return self.projected(signals)

    def projected(self, signals: Callable[[slice], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the parts (p, k) in the basis of signals, which are given for rows, (b, k)."""
        return np.sum([self.basis(part).T @ signals(part) for part in self.parts], axis=0)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Coefficients of the columns for each channel, shape (p, 4); those of jumps come last."""
        return np.asarray(np.linalg.solve(self.triangle, self.projections))

    def basis(self, part: slice) -> NDArray[np.float64]:
        """Return the orthonormal columns that the lines span, of some rows, shape (b, p)."""
        if self.whole is not None:
            return self.whole
        return _orthonormal(_design(self.record, self.orders, part), self.triangle)

    def values(self, part: slice) -> NDArray[np.float64]:
        """Return the channels in some rows, shape (b, 4)."""
        record = self.record
        return np.column_stack(
            [
                record.input_angle[part] / self.ratio - record.output_angle[part],
                record.input_torque[part],
                record.output_torque[part],
                record.input_angle[part],
            ]
        )

    def residual(self, part: slice, basis: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the lines leave of the channels in some rows, shape (b, 4)."""
        return self.values(part) - basis @ self.projections

    @property
    def whole_residual(self) -> NDArray[np.float64]:
        """What the lines leave of the channels in all rows, shape (n, 4)."""
        return np.vstack([self.residual(part, self.basis(part)) for part in self.parts])


def _design(record: RunningRecord, orders: NDArray[np.float64], part: slice) -> NDArray[np.float64]:
    """Return the columns of the fit in some rows, (b, p), as `LineFit` has them."""
    waves = _waves(record.input_angle[part], orders)
    if record.samples_averaged > 1:
        waves *= _averaging_at_rows(record, orders, part)
    time = centred(record, part)
    settling = []
    if record.settling is not None:
        (ending,) = decays(record, part, np.array([record.settling])).T
        settling = [ending, ending * (record.time[part] - record.time[0]) / record.settling]
    steps = [record.time[part] >= jump.time for jump in record.jumps]
    lines = waves.real, -waves.imag
    return np.vstack([np.ones_like(time), time, *lines, *settling, *steps]).T


def _averaging_at_rows(
    record: RunningRecord, orders: NDArray[np.float64], part: slice
) -> NDArray[np.float64]:
    """Return the gain of averaging in some rows beside that at the mean speed, shape (m, b).

    A row is a mean over a time, in which an order passes faster where the input does. To the second
    order in that time, the mean of exp(i order angle) is this gain times exp(i order angle) at the
    mean of the angle, which is measured: what the speed's change does to the two of them cancels.
    """
    mean = mean_speed(record)
    first, last, _ = part.indices(len(record.time))
    around = slice(max(first - 1, 0), min(last + 1, len(record.time)))
    speed = np.abs(np.gradient(record.input_angle[around], record.time[around]))
    speed = np.clip(speed[first - around.start :][: last - first], 0.0, _FASTEST * mean)
    at_mean = averaging_gain(orders, record, mean)[:, None]
    return averaging_gain(orders[:, None], record, speed) / at_mean


def averaging_gain(
    orders: ArrayLike, record: RunningRecord, speed: ArrayLike
) -> NDArray[np.float64]:
    """Return the factor by which averaging of raw samples reduces a line; as both broadcast.

    The mean of n samples, Delta apart, of exp(i w t) is exp(i w t_mid) times
    ``sin(n w Delta / 2) / (n sin(w Delta / 2))``, with w = order x speed of the input, rad/s.
    """
    n = record.samples_averaged
    half = np.asarray(orders) * speed / (2.0 * n * record.sample_rate)
    half = np.maximum(half, _STILL)
    return np.asarray(np.sin(n * half) / (n * np.sin(half)))


def _waves(angle: NDArray[np.float64], orders: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return exp(i order angle) at angles (b,) for orders (m,), shape (m, b).

    The wave of an order that is the sum of two others is their product, which saves most cosines.
    """
    waves = np.empty((len(orders), len(angle)), dtype=complex)
    places = dict[float, int]()
    for place in np.argsort(orders).tolist():
        order = float(orders[place])
        parts = next(((part, order - part) for part in places if order - part in places), None)
        if parts is None:
            waves[place].real, waves[place].imag = np.cos(order * angle), np.sin(order * angle)
        else:
            factor, cofactor = (waves[places[part]] for part in parts)
            np.multiply(factor, cofactor, out=waves[place])
        places[order] = place
    return waves


def _orthonormal(design: NDArray[np.float64], triangle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the columns of a design made orthonormal by its triangle."""
    return solve_triangular(triangle, design.T, trans="T", check_finite=False).T


def decays(
    record: RunningRecord, part: slice, constants: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return decays from 1 at the first row, for time constants (k,), s, in some rows; (b, k)."""
    return np.exp(-np.divide.outer(record.time[part] - record.time[0], constants))


def centred(record: RunningRecord, part: slice) -> NDArray[np.float64]:
    """Return the time of some rows from the middle of a record, s, shape (b,)."""
    return np.asarray(record.time[part] - (record.time[0] + record.time[-1]) / 2.0)


def _bent(record: RunningRecord, part: slice) -> NDArray[np.float64]:
    """Return (t - t_mid)^k / k! for k = 2, 3, 4 in some rows, shape (b, 3)."""
    powers = np.arange(2, 5)
    return np.asarray(centred(record, part)[:, None] ** powers / factorial(powers))


def mean_speed(record: RunningRecord) -> float:
    """Return the mean speed of the input, without its sign, rad/s."""
    travel = record.input_angle[-1] - record.input_angle[0]
    return abs(float(travel / (record.time[-1] - record.time[0])))


def nyquist_order(record: RunningRecord) -> float:
    """Return the order at half the rate of the rows, in cycles per input turn."""
    return float(np.pi * record.sample_rate / mean_speed(record))


def spans_a_turn(record: RunningRecord, ratio: float) -> bool:
    """Tell whether a record spans an output turn, without which its lines cannot be told apart.

    Its last row lies one step before the end of the turn, and the speed is not exact.
    """
    travel = float(record.input_angle[-1] - record.input_angle[0])
    return abs(travel) >= 0.99 * 2.0 * np.pi * ratio
