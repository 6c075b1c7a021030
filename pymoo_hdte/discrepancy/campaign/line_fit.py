"""Order lines of a running record: phasors of every channel over the measured input angle.

A channel is fitted by a straight line in time and by lines at the given orders::

    value(t) = mean + slope (t - t_mid) + Re sum_j phasor_j exp(i order_j theta_in)

so that lines that do not close over the record (order 2.02) do not leak into each other. theta_in
is the measured, absolute input angle; its noise enters all channels: directly the two that contain
it, and each one through the slope of its lines, as order x |phasor| x N x angle_noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular
from scipy.special import factorial

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.discrepancy.campaign.believed import Rig
from pymoo_hdte.discrepancy.campaign.records import RunningRecord

CHANNELS = ("transmission_error", "input_torque", "output_torque", "input_angle")

# Numerical limits of a linear fit; the verdict does not depend on them.
LARGEST_CONDITION = 1e3
"""Largest condition number of the fit; beyond it the noise of the lines grows a thousandfold."""

ROWS_A_BLOCK = 1 << 15
"""Rows worked on at once, to bound the memory."""


@dataclass(frozen=True, eq=False)
class OrderLines:
    """Order lines of one record.

    The channels are transmission error (rad), input torque (N.m), output torque (N.m) and input
    angle (rad), in this order.

    Attributes
    ----------
    orders : ndarray, shape (m,)
        Cycles per input turn.
    mean : ndarray, shape (4,)
        Value of the straight line at the middle of the record, rad or N.m.
    slope : ndarray, shape (4,)
        Of the straight line, rad/s or N.m/s; that of the input angle is the mean input speed.
    phasors : ndarray of complex, shape (4, m)
        Corrected for the loss by averaging, rad or N.m.
    covariance : ndarray, shape (4, 1 + 2 m, 1 + 2 m)
        Of (mean, Re phasors, Im phasors) of each channel, from sensor noise and quantisation, in
        the square of its unit.
    row_covariance : ndarray, shape (4, 4)
        Covariance of the noise of one row between channels, in the product of their units. The
        covariance of channel a with channel b is ``covariance[a] * row_covariance[a, b] /
        row_covariance[a, a]``: the noise of the input encoder enters the transmission error, the
        input angle, and all lines by their slopes.
    bends : ndarray of complex, shape (3, 1 + m)
        Mean and phasors, in s^k, that a fit assigns to the signals (t - t_mid)^k / k!, k = 2, 3, 4:
        a drift is curved in a record of ten minutes, and an order with one cycle per record absorbs
        the curvature.
    """

    orders: NDArray[np.float64]
    mean: NDArray[np.float64]
    slope: NDArray[np.float64]
    phasors: NDArray[np.complex128]
    covariance: NDArray[np.float64]
    row_covariance: NDArray[np.float64]
    bends: NDArray[np.complex128]


def order_lines(
    record: RunningRecord, rig: Rig, ratio: float, orders: ArrayLike | Sequence[float]
) -> OrderLines:
    """Fit order lines to every channel of a record by least squares.

    The model is that of a least-squares spectrum (Lomb, Astrophysics and Space Science 39, 1976)
    with all lines at once: sinusoids at known frequencies that need not be periodic in the record,
    and a straight line.

    Parameters
    ----------
    record : RunningRecord
        Of a drive at constant speed.
    rig : Rig
        For the noise.
    ratio : float
        Transmission ratio N, dimensionless.
    orders : array_like, shape (m,)
        Cycles per input turn, above zero, below the Nyquist order of the record.

    Returns
    -------
    OrderLines

    Raises
    ------
    InvalidInput
        For orders out of range or closer together than the record can tell apart.
    """
    fit = LineFit.of(record, ratio, orders)
    gains, coefficients = averaging_gain(fit.orders, record), fit.coefficients
    m = len(gains)
    real, imaginary = coefficients[2 : 2 + m].T, coefficients[2 + m :].T
    inverse = np.linalg.inv(fit.triangle)
    kept = np.r_[0, 2 : 2 + 2 * m]
    scales = 1.0 / np.concatenate([[1.0], gains, gains])
    unit = (inverse @ inverse.T)[np.ix_(kept, kept)] * np.outer(scales, scales)
    phasors = np.asarray((real + 1j * imaginary) / gains, dtype=complex)
    noise = row_covariance(rig, ratio, record.samples_averaged)
    # The noise of the angle also enters the exponent, where a line is steep; it is nearly white.
    steepness = fit.orders * phasors
    noise = noise + 0.5 * (steepness @ steepness.conj().T).real * noise[3, 3]
    bends = inverse @ fit.projections[1]
    lines = (bends[2 : 2 + m] + 1j * bends[2 + m :]).T / gains
    return OrderLines(
        orders=fit.orders,
        mean=coefficients[0],
        slope=coefficients[1],
        phasors=phasors,
        covariance=np.diag(noise)[:, None, None] * unit,
        row_covariance=noise,
        bends=np.column_stack([bends[0], lines]),
    )


def averaging_gain(orders: ArrayLike, record: RunningRecord) -> NDArray[np.float64]:
    """Return the factor by which averaging of raw samples reduces each line, shape (m,).

    The mean of n samples, Delta apart, of exp(i w t) is exp(i w t_mid) times
    ``sin(n w Delta / 2) / (n sin(w Delta / 2))``, with w = order x mean input speed.
    """
    n = record.samples_averaged
    half = np.asarray(orders) * _speed(record) / (2.0 * n * record.sample_rate)
    return np.sin(n * half) / (n * np.sin(half))


def row_covariance(rig: Rig, ratio: float, samples_averaged: int) -> NDArray[np.float64]:
    """Return the covariance of the noise of one row between `CHANNELS`, shape (4, 4).

    An encoder has the variance ``angle_noise**2 + angle_quantisation**2 / 12``, referred to the
    output; the transmission error has the variance of both encoders.
    """
    encoder = rig.angle_noise**2 + rig.angle_quantisation**2 / 12.0
    covariance = np.diag(
        [2.0 * encoder, rig.input_torque_noise**2, rig.output_torque_noise**2, ratio**2 * encoder]
    )
    covariance[0, 3] = covariance[3, 0] = ratio * encoder
    return covariance / samples_averaged


@dataclass(frozen=True, eq=False)
class LineFit:
    """Least squares by QR: ``values = basis @ triangle @ coefficients + residual``.

    Block by block, so that a record of millions of rows takes the memory of a block: the triangle
    of all rows is that of the triangle of those before and of a block (Golub and Van Loan, Matrix
    Computations, 2013, 5.2.9), and a block of the basis follows from the triangle.

    Attributes
    ----------
    record, ratio, orders
        As in `order_lines`.
    parts : tuple of slice
        Rows of each block.
    whole : ndarray, shape (n, 2 + 2 m), or None
        The basis of a record of one block.
    triangle : ndarray, shape (2 + 2 m, 2 + 2 m)
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
        scale = np.linalg.norm(design, axis=0)
        basis, triangle = np.linalg.qr(design / scale)
        for part in parts[1:]:
            rows = np.vstack([triangle, _design(record, checked, part) / scale])
            triangle = np.asarray(np.linalg.qr(rows, mode="r"))
        unit = triangle / np.linalg.norm(triangle, axis=0)
        if len(record.time) <= len(scale) or np.linalg.cond(unit) > LARGEST_CONDITION:
            allowed = "orders that a record of this length can tell apart"
            raise InvalidInput("orders", checked.tolist(), allowed)
        whole = basis if len(parts) == 1 else None
        return cls(record, ratio, checked, parts, whole, triangle * scale)

    @cached_property
    def projections(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Parts in the basis of the channels, shape (2 + 2 m, 4), and of the bends, (2 + 2 m, 3).

        The bends are (t - t_mid)^k / k! for k = 2, 3, 4.
        """
        channels, bends = zip(*map(self._project, self.parts), strict=True)
        return np.asarray(reduce(np.add, channels)), np.asarray(reduce(np.add, bends))

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Of the straight line and of cosines and sines of each channel, shape (2 + 2 m, 4)."""
        return np.asarray(np.linalg.solve(self.triangle, self.projections[0]))

    def basis(self, part: slice) -> NDArray[np.float64]:
        """Return the orthonormal columns that the lines span, of some rows, shape (b, 2 + 2 m)."""
        if self.whole is not None:
            return self.whole
        design = _design(self.record, self.orders, part)
        return solve_triangular(self.triangle, design.T, trans="T", check_finite=False).T

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
        return self.values(part) - basis @ self.projections[0]

    def _project(self, part: slice) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what some rows add to the parts in the basis of the channels and of bends."""
        basis = self.basis(part)
        return basis.T @ self.values(part), basis.T @ _bent(self.record, part)


def _design(record: RunningRecord, orders: NDArray[np.float64], part: slice) -> NDArray[np.float64]:
    """Return the columns of the fit in some rows: a straight line, cosines and sines."""
    angle = np.outer(record.input_angle[part], orders)
    time = _centred(record, part)
    return np.column_stack([np.ones_like(time), time, np.cos(angle), -np.sin(angle)])


def _centred(record: RunningRecord, part: slice) -> NDArray[np.float64]:
    return np.asarray(record.time[part] - (record.time[0] + record.time[-1]) / 2.0)


def _bent(record: RunningRecord, part: slice) -> NDArray[np.float64]:
    """Return (t - t_mid)^k / k! for k = 2, 3, 4 in some rows, shape (b, 3)."""
    powers = np.arange(2, 5)
    return np.asarray(_centred(record, part)[:, None] ** powers / factorial(powers))


def _speed(record: RunningRecord) -> float:
    travel = record.input_angle[-1] - record.input_angle[0]
    return abs(float(travel / (record.time[-1] - record.time[0])))


def nyquist_order(record: RunningRecord) -> float:
    """Return the order at half the rate of the rows, in cycles per input turn."""
    return float(np.pi * record.sample_rate / _speed(record))
