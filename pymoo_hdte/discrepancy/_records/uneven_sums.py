"""Sums over uneven angles with waves: by finufft, or without it by NumPy and SciPy.

finufft has no wheels for some machines (Linux on aarch64, Windows on Arm). The way around it is the
same method (Barnett, Magland, af Klinteberg, SIAM Journal on Scientific Computing 41, 2019): values
are spread to an even grid by a narrow kernel, transformed, and divided by the kernel's transform.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import ifft, next_fast_len
from scipy.sparse import csr_array

try:
    import finufft
except ImportError:
    finufft = None

SUM_ERROR = 1e-12
"""Relative error of the sums over rows, for two rows in one transform that of the larger."""

_WIDTH = 16
"""Points of the grid under a kernel: with twice as many points as waves it errs 10^(1 - width)."""
_SHAPE = 2.3 * _WIDTH
_NODES = 100
"""Nodes of the Gauss rule for the transform of the kernel, which is smooth."""
_AT_ONCE = 2**16
"""Angles at a time, which bounds the memory."""


def sums_at_whole_lines(
    angle: NDArray[np.float64], rows: NDArray[np.complex128], highest: int
) -> NDArray[np.complex128]:
    """Return sums of rows (q, n) with exp(i k angle), k = -highest .. highest, shape (q, 2 h + 1).

    Parameters
    ----------
    angle : ndarray, shape (n,)
        rad.
    rows : ndarray, shape (q, n)
        In any unit, that of the sums.
    highest : int
    """
    if finufft is not None:
        return finufft.nufft1d1(angle, rows, 2 * highest + 1, isign=1, eps=SUM_ERROR, nthreads=1)
    return spread_sums(angle, rows, highest)


def sums_at_lines(
    angle: NDArray[np.float64], rows: NDArray[np.complex128], lines: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return sums of rows (q, n) with exp(i line angle), shape (q, k), for a few lines (k,)."""
    if finufft is not None:
        # Type 3: neither the angles nor the lines need be evenly spaced.
        return finufft.nufft1d3(angle, rows, lines, isign=1, eps=SUM_ERROR, nthreads=1)
    return direct_sums(angle, rows, lines)


def direct_sums(
    angle: NDArray[np.float64], rows: NDArray[np.complex128], lines: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return what `sums_at_lines` does by its definition, in time n k."""
    sums = np.zeros((len(rows), len(lines)), dtype=complex)
    size = max(1, _AT_ONCE // max(1, len(lines)))
    for start in range(0, len(angle), size):
        part = slice(start, start + size)
        sums += rows[:, part] @ np.exp(1j * np.outer(angle[part], lines))
    return sums


def spread_sums(
    angle: NDArray[np.float64], rows: NDArray[np.complex128], highest: int
) -> NDArray[np.complex128]:
    """Return what `sums_at_whole_lines` does without finufft, to the same error."""
    points = next_fast_len(max(2 * (2 * highest + 1), 2 * _WIDTH))
    step = 2.0 * np.pi / points
    grid = np.zeros((points, len(rows)), dtype=complex)
    for start in range(0, len(angle), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        places = np.mod(angle[part], 2.0 * np.pi) / step
        grid_places = np.ceil(places - _WIDTH / 2.0)[:, None] + np.arange(_WIDTH)
        weights = _kernel((grid_places - places[:, None]) / (_WIDTH / 2.0))
        columns = np.repeat(np.arange(len(places)), _WIDTH)
        where = np.mod(grid_places, points).astype(int).ravel(), columns
        grid += csr_array((weights.ravel(), where), (points, len(places))) @ rows[:, part].T
    waves = np.arange(-highest, highest + 1)
    nodes, shares = np.polynomial.legendre.leggauss(_NODES)
    angles = _WIDTH / 2.0 * step * np.outer(waves, nodes)
    transform = _WIDTH / 2.0 * (np.cos(angles) @ (shares * _kernel(nodes)))
    return (points * ifft(grid, axis=0)[waves] / transform[:, None]).T


def _kernel(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the kernel at distances from -1 to 1."""
    inside = np.sqrt(np.maximum(1.0 - distance**2, 0.0))
    return np.exp(_SHAPE * (inside - 1.0))
