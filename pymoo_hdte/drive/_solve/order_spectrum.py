"""Signals that are sums of orders of the input angle, and their peak-to-peak over an output turn.

Static error and steady-state transmission error are such signals. Order 2 Z_c / Z_f = 2.02 does not
close over one output turn, so the extremes are searched over the whole turn and refined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number

POINTS_PER_TURN = 60
"""Least number of grid points an input turn before refinement."""

_POINTS_PER_CYCLE = 6
_NEWTON_STEPS = 3
_ROWS_AT_ONCE = 32


def sine_phasor(amplitude: ArrayLike, phase: ArrayLike) -> NDArray[np.complex128]:
    """Return the phasor p of amplitude sin(x + phase) = Re p exp(i x)."""
    return np.asarray(-1j * np.asarray(amplitude) * np.exp(1j * np.asarray(phase)))


@dataclass(frozen=True)
class OrderSpectrum:
    """The signals Re sum_l c_l exp(i o_l theta_in), one for each row.

    Attributes
    ----------
    orders : ndarray, shape (n_lines,)
        Orders o_l in cycles per input turn; may be negative or fractional.
    phasors : ndarray of complex, shape (n, n_lines)
        c_l in rad.

    Raises
    ------
    InvalidInput
        If shapes do not match or a value is not finite.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> spectrum = model.steady_state(model.nominal[np.newaxis])
    >>> print(f"{np.degrees(spectrum.peak_to_peak(101.0)[0]) * 3600:.1f} arcsec")
    86.7 arcsec
    """

    orders: NDArray[np.float64]
    phasors: NDArray[np.complex128]

    def __post_init__(self) -> None:
        finite_array("orders", self.orders, (None,))
        if self.phasors.ndim != 2 or self.phasors.shape[1] != len(self.orders):
            raise InvalidInput(
                "shape of phasors",
                self.phasors.shape,
                f"(n, {len(self.orders)}), a column an order",
            )
        if not np.all(np.isfinite(self.phasors)):
            raise InvalidInput("phasors", self.phasors, "all finite")

    def at(self, input_angle: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the signals at given input angles.

        Parameters
        ----------
        input_angle : ndarray, shape (n_angles,)
            rad.

        Returns
        -------
        ndarray, shape (n, n_angles)
            rad.
        """
        return (self.phasors @ np.exp(1j * np.outer(self.orders, input_angle))).real

    def amplitudes(self) -> dict[float, NDArray[np.float64]]:
        """Return the amplitudes, rad, shape (n,) each, by order in cycles per input turn, rising.

        Lines at +o and -o are one sinusoid: c exp(i o x) and d exp(-i o x) add to c + conj(d).
        """
        folded: dict[float, NDArray[np.complex128]] = {}
        for order, phasor in zip(self.orders, self.phasors.T, strict=True):
            key = round(abs(float(order)), 9)
            folded[key] = folded.get(key, 0.0) + (phasor.conj() if order < 0.0 else phasor)
        return {
            order: np.abs(folded[order].real if order == 0.0 else folded[order])
            for order in sorted(folded)
        }

    def peak_to_peak(self, ratio: float) -> NDArray[np.float64]:
        """Return the peak-to-peak of each signal over one output turn from theta_in = 0.

        Parameters
        ----------
        ratio : float
            Transmission ratio N, dimensionless; the window is 0 <= theta_in <= 2 pi N.

        Returns
        -------
        ndarray, shape (n,)
            rad, exact to rounding.

        Raises
        ------
        InvalidInput
            If the ratio is not above 0.
        """
        real_number("ratio", ratio, above=0.0)
        moving = self.orders != 0.0
        orders, phasors = self.orders[moving], self.phasors[:, moving]
        if not orders.size:
            return np.zeros(len(phasors))
        # Whole orders repeat every input turn; searching all N turns would find N equal peaks.
        turns = min(ratio, 1.0) if np.all(orders == np.round(orders)) else ratio
        result = np.empty(len(phasors))
        for start in range(0, len(phasors), _ROWS_AT_ONCE):
            rows = slice(start, start + _ROWS_AT_ONCE)
            result[rows] = _peak_to_peak(orders, phasors[rows], turns)
        return result


class _Grid:
    """The signals at the angles ``step * column``, where ``step`` divides an input turn.

    Lines whose orders differ by whole numbers repeat every turn up to one common phase, so each
    such family is evaluated on one turn only: P where the orders are whole, Q elsewhere.
    """

    def __init__(
        self, orders: NDArray[np.float64], phasors: NDArray[np.complex128], points: int
    ) -> None:
        self.points = points
        within = 2.0 * np.pi * np.arange(points) / points
        fractions = np.round(np.mod(orders, 1.0), 9) % 1.0
        self.whole = np.zeros((len(phasors), points))
        self.fractional: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
        for fraction in np.unique(fractions):
            family = fractions == fraction
            argument = np.outer(orders[family], within)
            cosine, sine = np.cos(argument), np.sin(argument)
            # Real products, because complex ones even of this size start the threads of BLAS.
            real, imaginary = phasors.real[:, family].copy(), phasors.imag[:, family].copy()
            in_phase = real @ cosine - imaginary @ sine
            if fraction == 0.0:
                self.whole = in_phase
            else:
                quadrature = real @ sine + imaginary @ cosine
                self.fractional.append((float(fraction), in_phase, quadrature))

    def envelope(self) -> NDArray[np.float64]:
        """Return an upper bound over all turns at each point within the turn, shape (n, points)."""
        return self.whole + sum(
            np.hypot(in_phase, quadrature) for _, in_phase, quadrature in self.fractional
        )

    def values(self, rows: NDArray[np.int_], columns: NDArray[np.int_]) -> NDArray[np.float64]:
        """Return the signals ``rows`` at ``columns``, arrays of shapes that broadcast."""
        turn, point = np.divmod(columns, self.points)
        result = self.whole[rows, point]
        for fraction, in_phase, quadrature in self.fractional:
            phase = 2.0 * np.pi * fraction * turn
            result = result + np.cos(phase) * in_phase[rows, point]
            result = result - np.sin(phase) * quadrature[rows, point]
        return result


def _peak_to_peak(
    orders: NDArray[np.float64], phasors: NDArray[np.complex128], turns: float
) -> NDArray[np.float64]:
    upper = _highest(orders, phasors, turns)
    lower = _highest(orders, -phasors, turns)
    return upper + lower


def _highest(
    orders: NDArray[np.float64], phasors: NDArray[np.complex128], turns: float
) -> NDArray[np.float64]:
    """Return the greatest value of each signal on 0 <= angle <= 2 pi turns.

    A grid may straddle the highest peak and hit a lower one, so every peak that could be the
    highest is climbed: first the grid values are compared, allowing for the rise between two
    points, then parabolas through three points, allowing for their own, smaller error.
    """
    points = max(POINTS_PER_TURN, int(np.ceil(_POINTS_PER_CYCLE * np.max(np.abs(orders)))))
    step = 2.0 * np.pi / points
    end = 2.0 * np.pi * turns
    last_point = int(np.floor(turns * points))
    grid = _Grid(orders, phasors, points)
    rise = np.abs(phasors) @ orders**2 * step**2 / 8.0
    # Interpolation error of a parabola, for the one that errs low and the one that errs high.
    doubt = 2.0 * np.abs(phasors) @ np.abs(orders) ** 3 * step**3 / (9.0 * 3.0**0.5)

    rows, columns = _high_points(grid, rise, last_point)
    here = grid.values(rows, columns)
    before, after = grid.values(rows, columns - 1), grid.values(rows, columns + 1)
    slope = (after - before) / 2.0
    curvature = 2.0 * here - before - after
    vertex = np.divide(slope, curvature, out=np.zeros_like(here), where=curvature > 0.0)
    shift = np.clip(vertex, np.maximum(-1.0, -columns), np.minimum(1.0, end / step - columns))
    height = here + shift * (slope - shift * curvature / 2.0)
    starts = np.searchsorted(rows, np.arange(len(phasors)))
    highest = np.maximum.reduceat(height, starts)
    close = height >= (highest - doubt)[rows]
    rows, start = rows[close], step * (columns + shift)[close]
    values = _climb(orders, phasors[rows], start, step, end)
    summits = np.maximum.reduceat(values, np.searchsorted(rows, np.arange(len(phasors))))
    # A signal may still be rising where the turn ends, beyond the last grid point.
    return np.maximum(summits, (phasors * np.exp(1j * end * orders)).real.sum(axis=1))


def _high_points(
    grid: _Grid, rise: NDArray[np.float64], last_point: int
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return rows and columns, by row, of all grid points within ``rise`` of their row's highest.

    Only points within the turn whose envelope could reach that high are followed over all turns.
    """
    envelope = grid.envelope()
    turn_starts = np.arange(0, last_point + 1, grid.points)
    every_row = np.arange(len(envelope))

    def over_turns(
        rows: NDArray[np.int_], points: NDArray[np.int_]
    ) -> tuple[NDArray[np.int_], NDArray[np.float64]]:
        columns = points[:, None] + turn_starts
        values = grid.values(rows[:, None], columns)
        return columns, np.where(columns <= last_point, values, -np.inf)

    highest_there = np.argmax(envelope, axis=1)
    _, values = over_turns(every_row, highest_there)
    # Rounding may lift the values of the smallest numbers above their envelope.
    reached = np.minimum(values.max(axis=1), envelope[every_row, highest_there])
    rows, points = np.nonzero(envelope >= (reached - rise)[:, None])
    columns, values = over_turns(rows, points)
    starts = np.searchsorted(rows, every_row)
    highest = np.maximum.reduceat(values.max(axis=1), starts)
    pair, turn = np.nonzero(values >= (highest - rise)[rows][:, None])
    return rows[pair], columns[pair, turn]


def _climb(
    orders: NDArray[np.float64],
    phasors: NDArray[np.complex128],
    angle: NDArray[np.float64],
    step: float,
    end: float,
) -> NDArray[np.float64]:
    """Move from ``angle`` to the nearby maximum by Newton steps and return its value."""
    low, high = np.maximum(angle - step, 0.0), np.minimum(angle + step, end)
    for _ in range(_NEWTON_STEPS):
        lines = phasors * np.exp(1j * angle[:, None] * orders)
        slope = -(lines.imag @ orders)
        curvature = lines.real @ orders**2
        move = np.divide(slope, curvature, out=np.zeros_like(slope), where=curvature > 0.0)
        angle = np.clip(angle + move, low, high)
    return (phasors * np.exp(1j * angle[:, None] * orders)).real.sum(axis=1)
