"""Order lines of a running record: phasors of every channel over the measured input angle.

A channel is fitted by a straight line in time and by lines at the given orders::

    value(t) = mean + slope (t - t_mid) + Re sum_j phasor_j exp(i order_j theta_in)

so that lines that do not close over the record (order 2.02) do not leak into each other. theta_in
is the measured, absolute input angle; its noise enters all channels: directly the two that contain
it, and each one through the slope of its lines, as order x |phasor| x N x angle_noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import finite_array
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.line_basis import (
    LineFit,
    averaging_gain,
    mean_speed,
    nyquist_order,
)
from pymoo_hdte.discrepancy._records.records import Jump, ReadingError, RunningRecord

CHANNELS = ("transmission_error", "input_torque", "output_torque", "input_angle")

_READ = {"output_angle": (0, False), "input_angle": (0, True), "input_torque": (1, False),
         "output_torque": (2, False)}  # fmt: skip
"""For each sensor, the place in `CHANNELS` of its mean, and whether the ratio divides it."""
# Which doubles of orders are fitted beside them decides no verdict.
_RESOLVED = 0.9
"""Largest double, as a share of the Nyquist order."""
_KNOTS = 500
"""Means of rows from which a wandering motion is smoothed: a spline through more takes longer than
a fit, and what wanders is slow."""
_HALVINGS = 16
"""Of the logarithm of a density within some fifteen decades: it is then known to a per mille."""
_APART = 1.5
"""Least distance of a double from another order, in cycles per output turn."""


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
        Slope of the straight line, rad/s or N.m/s; that of the input angle is the mean input speed.
    phasors : ndarray of complex, shape (4, m)
        Corrected for the loss by averaging, rad or N.m.
    covariance : ndarray, shape (4, 1 + 2 m, 1 + 2 m)
        Covariance of (mean, Re phasors, Im phasors) of each channel, from sensor noise and
        quantisation, in the square of its unit.
    row_covariance : ndarray, shape (4, 4)
        Covariance of the noise of one row between channels, in the product of their units. The
        covariance of channel a with channel b is ``covariance[a] * row_covariance[a, b] /
        row_covariance[a, a]``: the noise of the input encoder enters the transmission error, the
        input angle, and all lines by their slopes.
    bends : ndarray of complex, shape (3, 1 + m)
        Mean and phasors, in s^k, that a fit assigns to the signals (t - t_mid)^k / k!, k = 2, 3, 4:
        a drift is curved in a record of ten minutes, and an order with one cycle per record absorbs
        the curvature.
    fading : ndarray of complex, shape (6, 1 + m)
        Mean and phasors, dimensionless, that a fit assigns to signals that fade from one at the
        first row, with the time constants `line_basis.FADING`.
    folded : ndarray of complex, shape (k, 2, 1 + m)
        Mean and phasors, dimensionless, that a fit assigns to the cosine and to minus the sine of
        orders that averaging folds down: see `order_lines`.

    Examples
    --------
    >>> campaign = read_campaign("campaign")
    >>> lines = order_lines(campaign.running[0], campaign.rig, campaign.believed.ratio, [1.0, 2.0])
    >>> lines.orders, lines.phasors.shape
    (array([1., 2.]), (4, 2))
    """

    orders: NDArray[np.float64]
    mean: NDArray[np.float64]
    slope: NDArray[np.float64]
    phasors: NDArray[np.complex128]
    covariance: NDArray[np.float64]
    row_covariance: NDArray[np.float64]
    bends: NDArray[np.complex128]
    fading: NDArray[np.complex128]
    folded: NDArray[np.complex128]


def order_lines(
    record: RunningRecord,
    rig: Rig,
    ratio: float,
    orders: ArrayLike | Sequence[float],
    folded: Sequence[float] = (),
) -> OrderLines:
    """Fit order lines to every channel of a record by least squares.

    The model is that of a least-squares spectrum (Lomb, Astrophysics and Space Science 39, 1976)
    with all lines at once: sinusoids at known frequencies that need not be periodic in the record,
    and a straight line. Twice the orders are fitted beside them: see `_doubles`.

    Parameters
    ----------
    record : RunningRecord
        Record of a drive at constant speed.
    rig : Rig
        Gives the noise.
    ratio : float
        Transmission ratio N, dimensionless.
    orders : array_like, shape (m,)
        Cycles per input turn, above zero, below the Nyquist order of the record.
    folded : sequence of float, length k
        Orders that may lie beyond it, cycles per input turn: a mean of several samples lets through
        a part of them, which shows at lower orders. What lies beyond the Nyquist order of the
        samples is taken to have been filtered away before.

    Returns
    -------
    OrderLines

    Raises
    ------
    InvalidInput
        For orders out of range or closer together than the record can tell apart.

    Examples
    --------
    >>> campaign = read_campaign("campaign")
    >>> lines = order_lines(campaign.running[0], campaign.rig, campaign.believed.ratio, [1.0, 2.0])
    >>> lines.mean.shape
    (4,)
    """
    checked = finite_array("orders", orders, (None,))
    fit = LineFit.of(record, ratio, [*checked, *_doubles(checked, record, ratio)])
    m, n_fitted = len(checked), len(fit.orders)
    of_lines = np.r_[2 : 2 + m], np.r_[2 + n_fitted : 2 + n_fitted + m]
    gains, coefficients = averaging_gain(checked, record, mean_speed(record)), fit.coefficients
    real, imaginary = (coefficients[rows].T for rows in of_lines)
    inverse = np.linalg.inv(fit.triangle)
    columns = np.r_[0, of_lines[0], of_lines[1]]
    scales = 1.0 / np.concatenate([[1.0], gains, gains])
    unit = (inverse @ inverse.T)[np.ix_(columns, columns)] * np.outer(scales, scales)
    phasors = np.asarray((real + 1j * imaginary) / gains, dtype=complex)
    noise = row_covariance(rig, ratio, record.samples_averaged)
    # The noise of the angle also enters the exponent, where a line is steep; it is nearly white.
    steepness = checked * phasors
    noise = noise + 0.5 * (steepness @ steepness.conj().T).real * noise[3, 3]
    real_parts, imaginary_parts = of_lines

    def line_parts(projected: NDArray[np.float64]) -> NDArray[np.complex128]:
        parts = inverse @ projected
        lines = (parts[real_parts] + 1j * parts[imaginary_parts]).T / gains
        return np.column_stack([parts[0], lines])

    courses = line_parts(fit.courses)
    beyond = np.array(folded, dtype=float)
    between = beyond / nyquist_order(record)
    beyond = beyond[(between > 1.0) & (between < record.samples_averaged)]
    parts_of_folded = np.zeros((len(folded), 2, 1 + m), dtype=complex)
    if beyond.size:
        shares = averaging_gain(beyond, record, mean_speed(record))

        def waves(part: slice) -> NDArray[np.float64]:
            turned = np.outer(record.input_angle[part], beyond)
            return np.hstack([shares * np.cos(turned), -shares * np.sin(turned)])

        of_waves = line_parts(fit.projected(waves)).reshape(2, len(beyond), 1 + m)
        parts_of_folded[np.isin(folded, beyond)] = of_waves.swapaxes(0, 1)
    covariance = np.diag(noise)[:, None, None] * unit
    for jump in record.jumps:
        channel, variance = _variance_in_channel(jump, ratio)
        covariance[channel, 0, 0] += variance
    for error in record.reading_errors:
        channel, variance = _variance_in_channel(error, ratio)
        covariance[channel, 0, 0] += variance
        for power, bend in enumerate(courses[:3], 2):
            shape = math.factorial(power) * bend / float(np.ptp(record.time)) ** power
            part = error.bent * np.r_[shape.real, shape.imag[1:]]
            covariance[channel] += np.outer(part, part)
    lines = np.arange(1, covariance.shape[1])
    covariance[:, lines, lines] += step_variances(record, ratio)[:, None]
    return OrderLines(
        orders=checked,
        mean=coefficients[0],
        slope=coefficients[1],
        phasors=phasors,
        covariance=covariance,
        row_covariance=noise,
        bends=courses[:3],
        fading=courses[3:],
        folded=parts_of_folded,
    )


def unsteady_lines(
    record: RunningRecord, ratio: float, lines: OrderLines, share: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return what the rates of a wandering input have in lines beyond those of a steady one.

    Beside its lines the input does something that does not repeat. A fit assigns a share of that to
    the lines, and other shares of its rates: a line of i w phasor, and of (i w)^2 phasor, is then
    not that of speed and acceleration, as the motion does not end as it began. What is beside the
    lines is smoothed by a cubic spline and differentiated: as the motion under a white noise of
    acceleration (Wahba, J. Royal Statistical Society B 40, 1978) of which the known noise is left.

    Parameters
    ----------
    record, ratio
        As in `order_lines`.
    lines : OrderLines
        Lines of the record.
    share : ndarray, shape (m,)
        How much of each line of the input angle is taken for its motion, and not for noise.

    Returns
    -------
    rates : ndarray of complex, shape (2, m)
        Lines of speed (rad/s) and acceleration (rad/s2) of the input.
    ends : ndarray of complex, shape (2, m)
        Lines of the acceleration (rad/s2) by the standard deviation of the speed at either end.
    """
    orders = lines.orders
    fit = LineFit.of(record, ratio, [*orders, *_doubles(orders, record, ratio)])
    time, beside = record.time, fit.whole_residual[:, 3]
    rows, count = max(len(time) // _KNOTS, 1), len(time)
    middles, means = (
        values[: count - count % rows].reshape(-1, rows).mean(axis=1) for values in (time, beside)
    )
    noise, step = lines.row_covariance[3, 3], 1.0 / record.sample_rate
    course, intensity = _smoothed(middles, means, noise / rows)
    rates = [course, course.derivative(1), course.derivative(2)]

    def signals(part: slice) -> NDArray[np.float64]:
        place = np.arange(count)[part]
        ends = (place == 0), (place == count - 1)
        return np.column_stack([*(rate(time[part]) for rate in rates), *ends])

    parts = np.linalg.solve(fit.triangle, fit.projected(signals))
    m, n_fitted = len(orders), len(fit.orders)
    shown = parts[2 : 2 + m] + 1j * parts[2 + n_fitted : 2 + n_fitted + m]
    shown = shown.T / averaging_gain(orders, record, mean_speed(record))
    rate = 1j * orders * lines.slope[3]
    of_lines = share * shown[0]
    beyond = np.stack([shown[1] - rate * of_lines, shown[2] - rate**2 * of_lines])
    # Of a motion under white noise of acceleration whose position is seen in white noise: the
    # steady variance of a Kalman filter's speed.
    variance = math.sqrt(2.0) * (noise * step) ** 0.25 * intensity**0.75
    ends = np.asarray(shown[3:] * math.sqrt(variance) / step, dtype=complex)
    return np.asarray(beyond, dtype=complex), ends


def _smoothed(
    time: NDArray[np.float64], values: NDArray[np.float64], variance: float
) -> tuple[scipy.interpolate.BSpline, float]:
    """Return the spline that leaves the variance of the noise (Reinsch, Numer. Math. 10, 1967).

    The second value is the power density of its second derivative, which goes with it. The density
    is searched between one that moves less than the noise in a record, and one that moves more in a
    row.
    """
    step = float(np.diff(time).mean())
    low, high = (3.0 * variance / span**3 for span in (float(np.ptp(time)), step))

    def spline(intensity: float) -> scipy.interpolate.BSpline:
        return scipy.interpolate.make_smoothing_spline(time, values, lam=variance / intensity)

    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        if np.mean((values - spline(middle)(time)) ** 2) > variance:
            low = middle
        else:
            high = middle
    return spline(high), high


def _doubles(orders: NDArray[np.float64], record: RunningRecord, ratio: float) -> list[float]:
    """Return twice the orders, where a record tells them from the others.

    Rows are equidistant in time. Where the speed varies with an order, its double is part of the
    other channels and is not orthogonal to it: left out, a ripple of order 8 that made the input
    wobble by 0.02 rad was off by 4e-3 of itself, forty times its interval.
    """
    doubles: list[float] = []
    highest = _RESOLVED * nyquist_order(record)
    for order in (2.0 * orders[orders >= 1.0]).tolist():
        distances = np.abs(np.concatenate([orders, doubles]) - order)
        if order < highest and distances.min() > _APART / ratio:
            doubles.append(order)
    return doubles


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


def step_variances(record: RunningRecord, ratio: float) -> NDArray[np.float64]:
    """Return the variance of each part of a line by coarse steps, by channel, shape (4,)."""
    variances = np.zeros(len(CHANNELS))
    for error in record.reading_errors:
        if error.of_lines:
            channel, variance = _variance_in_channel(error, ratio)
            variances[channel] += variance
    return variances


def _variance_in_channel(error: Jump | ReadingError, ratio: float) -> tuple[int, float]:
    """Return the place in `CHANNELS` of what a sensor shows, and the square of its error there."""
    channel, share = _READ[error.channel]
    return channel, (error.size / (ratio if share else 1.0)) ** 2
