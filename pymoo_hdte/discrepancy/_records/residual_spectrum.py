"""What order lines leave of a record: the spectrum of the residual, in units of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.line_basis import LineFit, nyquist_order
from pymoo_hdte.discrepancy._records.line_fit import row_covariance, step_variances
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.discrepancy._records.uneven_sums import sums_at_lines, sums_at_whole_lines
from pymoo_hdte.discrepancy._selection.rules import RULES

_N_CHANNELS = 5
"""Those of the order lines, and the output angle."""
# Numerical limits of a linear fit; the verdict does not depend on them.
LEAST_SEPARATION = 0.1
"""Least share of a line's power that is independent of the fitted lines."""


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
    amplitudes : ndarray, shape (5, k)
        Dimensionless, by channel as in `OrderLines`, and of the output angle: divided by their root
        mean square under noise alone. The square is then exponential with mean 1: a line exceeds x
        by chance with probability exp(-x**2).

    Raises
    ------
    InvalidInput
        As `order_lines`.

    Examples
    --------
    >>> campaign = read_campaign("campaign")
    >>> record, ratio = campaign.running[0], campaign.believed.ratio
    >>> orders, sizes = residual_spectrum(record, campaign.rig, ratio, [1.0, 2.0])
    >>> orders.shape[0] == sizes.shape[-1]
    True
    """
    searched, phasors = residual_phasors(record, rig, ratio, orders, highest_order)
    return searched, np.abs(phasors)


def residual_phasors(
    record: RunningRecord, rig: Rig, ratio: float, orders: ArrayLike, highest_order: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Return the lines of `residual_spectrum` with their phases at the zero of the input angle."""
    fit = LineFit.of(record, ratio, orders)
    highest = min(highest_order, nyquist_order(record))
    multiples = max(int(np.ceil(highest * ratio - 1e-9)) - 1, 0)
    whole = ratio * np.arange(1.0, np.ceil(highest - 1e-9))
    whole = whole[np.abs(whole - whole.round()) > 1e-9]
    # The output angle is that of the input, divided by the ratio, less the transmission error.
    channels = np.vstack([np.eye(_N_CHANNELS - 1), [-1.0, 0.0, 0.0, 1.0 / ratio]])
    covariance = row_covariance(rig, ratio, record.samples_averaged)
    variances = np.diag(channels @ covariance @ channels.T)
    sigma = np.sqrt(variances)
    sums = []
    for part in fit.parts:
        basis = fit.basis(part)
        rows = np.hstack([basis, fit.residual(part, basis) @ channels.T / sigma]).T
        sums.append(_Sums.of(rows, record.input_angle[part] / ratio, multiples, whole))
    n = len(record.time)
    separate, phasors = reduce(_Sums.plus, sums).phasors(n)
    of_steps = np.append(step_variances(record, ratio), 0.0)
    # A part of a line has the variance 2 sigma^2 / n by the noise of n rows.
    phasors /= np.sqrt(1.0 + of_steps * n / (2.0 * variances))[:, None]
    searched = np.concatenate([np.arange(1, multiples + 1), whole])[separate] / ratio
    rising = np.argsort(searched)
    return searched[rising], phasors[:, rising]


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over rows for k waves: of waves times each row of products, and of waves squared.

    ``products`` has shape (p + 5, k): with the basis, then with the residuals.
    """

    products: NDArray[np.complex128]
    squares: NDArray[np.complex128]

    @classmethod
    def of(
        cls,
        rows: NDArray[np.float64],
        angle: NDArray[np.float64],
        multiples: int,
        extra_lines: NDArray[np.float64],
    ) -> _Sums:
        """Sum over rows at angles (n,) with waves exp(i line angle).

        Lines are 1, 2, .. up to ``multiples``, and then the others.
        """
        ones = np.ones((1, len(angle)))
        products = _whole_sums(rows, angle, multiples)
        squares = _whole_sums(ones, 2.0 * angle, multiples)
        if extra_lines.size:
            extra_sums = sums_at_lines(angle, rows.astype(complex, order="C"), extra_lines)
            products = np.hstack([products, extra_sums])
            extra_sums = sums_at_lines(angle, ones.astype(complex), 2.0 * extra_lines)
            squares = np.hstack([squares, extra_sums])
        return cls(products, squares[0])

    def plus(self, addend: _Sums) -> _Sums:
        """Return the sums over the rows of both."""
        return _Sums(self.products + addend.products, self.squares + addend.squares)

    def phasors(self, n: int) -> tuple[NDArray[np.bool_], NDArray[np.complex128]]:
        """Fit cosine and sine of each wave, orthogonal to the basis, to residuals of variance 1.

        Returns which lines are separate enough, and their phasors (5, k), for n rows.
        """
        shared, products = self.products[:-_N_CHANNELS], self.products[-_N_CHANNELS:]
        power = n - np.sum(np.abs(shared) ** 2, axis=0)
        square = self.squares - np.sum(shared**2, axis=0)
        separate = power - np.abs(square) > LEAST_SEPARATION * n
        power, square, products = power[separate], square[separate], products[:, separate]
        # Normal equations of the two columns: c'c = (power + Re square)/2, s's = (power - Re
        # square)/2, c's = Im square / 2; their chi-square of two degrees of freedom has mean 2.
        waves = 2.0 * (products * power - products.conj() * square)
        waves /= power**2 - np.abs(square) ** 2
        chi_square = np.real(products.conj() * waves)
        return separate, np.sqrt(chi_square / 2.0) * np.exp(1j * np.angle(waves))


def _whole_sums(
    rows: NDArray[np.float64], angle: NDArray[np.float64], count: int
) -> NDArray[np.complex128]:
    """Return sums of real rows (q, n) with exp(i k angle), k = 1 .. count, shape (q, count).

    Two rows in one transform: of real ones the sum at -k is the conjugate of that at k.
    """
    half = (len(rows) + 1) // 2
    pairs = rows[:half].astype(complex, order="C")
    pairs.imag[: len(rows) - half] = rows[half:]
    sums = sums_at_whole_lines(angle, pairs, count)
    above, below = sums[..., count + 1 :], sums[..., :count][..., ::-1].conj()
    sums_of_rows = np.vstack([above + below, -1j * (above - below)])[: len(rows)] / 2.0
    return np.asarray(sums_of_rows, dtype=complex)
