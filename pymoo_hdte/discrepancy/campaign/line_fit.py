"""Order lines of a running record: phasors of every channel over the measured input angle.

A channel is fitted by a straight line in time and by lines at the given orders::

    value(t) = mean + slope (t - t_mid) + Re sum_j phasor_j exp(i order_j theta_in)

so that lines that do not close over the record (order 2.02) do not leak into each other. theta_in
is the measured, absolute input angle; its noise enters all channels: directly the two that contain
it, and each one through the slope of its lines, as order x |phasor| x N x angle_noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import factorial

from pymoo_hdte.discrepancy.campaign.believed import Rig
from pymoo_hdte.discrepancy.campaign.line_basis import LineFit, centred, mean_speed, nyquist_order
from pymoo_hdte.discrepancy.campaign.records import RunningRecord
from pymoo_hdte.discrepancy.engine.rules import RULES

CHANNELS = ("transmission_error", "input_torque", "output_torque", "input_angle")

_READ = {"output_angle": (0, False), "input_angle": (0, True), "input_torque": (1, False),
         "output_torque": (2, False)}  # fmt: skip
"""Place in `CHANNELS` of the mean that a jump makes uncertain; whether divided by the ratio."""

LEAST_SEPARATION = 0.1
"""Least share of a line's power that is independent of the fitted lines."""

BLOCK = 64
"""Lines of the residual spectrum worked on at once, to bound the memory."""


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
    gains = averaging_gain(fit.orders, record)
    m = len(gains)
    real, imaginary = fit.coefficients[2 : 2 + m].T, fit.coefficients[2 + m : 2 + 2 * m].T
    inverse = np.linalg.inv(fit.triangle)
    kept = np.r_[0, 2 : 2 + 2 * m]
    scales = 1.0 / np.concatenate([[1.0], gains, gains])
    unit = (inverse @ inverse.T)[np.ix_(kept, kept)] * np.outer(scales, scales)
    phasors = np.asarray((real + 1j * imaginary) / gains, dtype=complex)
    noise = row_covariance(rig, ratio, record.samples_averaged)
    # The noise of the angle also enters the exponent, where a line is steep; it is nearly white.
    steepness = fit.orders * phasors
    noise = noise + 0.5 * (steepness @ steepness.conj().T).real * noise[3, 3]
    bends = inverse @ (fit.basis.T @ _bent(record))
    lines = (bends[2 : 2 + m] + 1j * bends[2 + m : 2 + 2 * m]).T / gains
    covariance = np.diag(noise)[:, None, None] * unit
    for jump in record.jumps:
        channel, share = _READ[jump.channel]
        covariance[channel, 0, 0] += (jump.size / (ratio if share else 1.0)) ** 2
    return OrderLines(
        orders=fit.orders,
        mean=fit.coefficients[0],
        slope=fit.coefficients[1],
        phasors=phasors,
        covariance=covariance,
        row_covariance=noise,
        bends=np.column_stack([bends[0], lines]),
    )


def averaging_gain(orders: ArrayLike, record: RunningRecord) -> NDArray[np.float64]:
    """Return the factor by which averaging of raw samples reduces each line, shape (m,).

    The mean of n samples, Delta apart, of exp(i w t) is exp(i w t_mid) times
    ``sin(n w Delta / 2) / (n sin(w Delta / 2))``, with w = order x mean input speed.
    """
    n = record.samples_averaged
    half = np.asarray(orders) * mean_speed(record) / (2.0 * n * record.sample_rate)
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


def residual_spectrum(
    record: RunningRecord,
    rig: Rig,
    ratio: float,
    orders: ArrayLike | Sequence[float],
    highest_order: float = RULES.highest_order,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the residual of the order lines, at multiples of 1/N and of 1, in units of the noise.

    Errors of the output repeat every output turn and errors of the input every input turn; unless
    the ratio is a whole number, their orders differ.

    Each line is made orthogonal to the fitted lines before it is fitted to the residual, so that
    these do not leak into it. Orders too close to a fitted line are left out. Under noise alone the
    power is exponential (Scargle, Astrophysical Journal 263, 1982).

    Parameters
    ----------
    record, rig, ratio, orders
        As in `order_lines`.
    highest_order : float
        Cycles per input turn.

    Returns
    -------
    orders : ndarray, shape (k,)
        Cycles per input turn, up to ``highest_order`` or the Nyquist order.
    amplitudes : ndarray, shape (4, k)
        Dimensionless, by channel as in `OrderLines`: divided by their root mean square under noise
        alone. The square is then exponential with mean 1: a line exceeds x by chance with
        probability exp(-x**2).

    Raises
    ------
    InvalidInput
        As `order_lines`.
    """
    fit = LineFit.of(record, ratio, orders)
    highest = min(highest_order, nyquist_order(record))
    multiples = np.arange(1, int(np.ceil(highest * ratio - 1e-9)))
    whole = ratio * np.arange(1, int(np.ceil(highest - 1e-9)))
    whole = whole[np.abs(whole - whole.round()) > 1e-9]
    sigma = np.sqrt(np.diag(row_covariance(rig, ratio, record.samples_averaged)))
    residual = (fit.values - fit.basis @ (fit.basis.T @ fit.values)) / sigma
    rows = np.hstack([fit.basis, residual]).T
    angle = record.input_angle[:, None] / ratio
    found, amplitudes = [], []
    for block, waves in _waves(angle, multiples, whole):
        # As real numbers: a product of real and complex matrices would copy the real one.
        products = (rows @ waves.view(float)).view(complex)
        separate, amplitude = _amplitudes(waves, *np.split(products, [fit.basis.shape[1]]))
        found.append(block[separate] / ratio)
        amplitudes.append(amplitude)
    searched = np.concatenate(found)
    rising = np.argsort(searched)
    return searched[rising], np.concatenate(amplitudes, axis=1)[:, rising]


def _waves(
    angle: NDArray[np.float64], multiples: NDArray[np.int_], others: NDArray[np.floating[Any]]
) -> Iterator[tuple[NDArray[Any], NDArray[np.complex128]]]:
    """Yield consecutive multiples in blocks, then others, with their waves over angles (n, 1)."""
    powers = np.exp(1j * angle * np.arange(BLOCK))
    for block in np.split(multiples, range(BLOCK, len(multiples), BLOCK)):
        yield block, powers[:, : len(block)] * np.exp(1j * angle * block[0])
    yield others, np.exp(1j * angle * others)


def _amplitudes(
    waves: NDArray[np.complex128],
    shared: NDArray[np.complex128],
    products: NDArray[np.complex128],
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Fit cosine and sine of each wave, orthogonal to the basis, to residuals of unit variance.

    ``waves`` has shape (n, k), ``shared``, their part in the basis, (p, k), and ``products`` with
    the residuals (4, k).
    """
    power = len(waves) - np.sum(np.abs(shared) ** 2, axis=0)
    square = np.einsum("nk,nk->k", waves, waves) - np.sum(shared**2, axis=0)
    separate = power - np.abs(square) > LEAST_SEPARATION * len(waves)
    power, square, products = power[separate], square[separate], products[:, separate]
    # Normal equations of the two columns: c'c = (power + Re square)/2, s's = (power - Re square)/2,
    # c's = Im square / 2; their chi-square of two degrees of freedom has mean 2.
    chi_square = 2.0 * (np.abs(products) ** 2 * power - np.real(products**2 * np.conj(square)))
    chi_square /= power**2 - np.abs(square) ** 2
    return separate, np.sqrt(chi_square / 2.0)


def _bent(record: RunningRecord) -> NDArray[np.float64]:
    """Return (t - t_mid)^k / k! for k = 2, 3, 4, shape (n, 3)."""
    powers = np.arange(2, 5)
    return np.asarray(centred(record)[:, None] ** powers / factorial(powers))
