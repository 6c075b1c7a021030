"""How well the parameters of a fit are known when what is left of the records has a colour.

The rest of a real record is not white: neighbouring samples err alike, and the curvature at the
optimum alone would make intervals several times too narrow. The covariance is that of White
(Econometrica 48, 1980) with the power of the rest by frequency in the place of single squares.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.fit import Fit
from pymoo_hdte.discrepancy.parameters import Layout
from pymoo_hdte.measured.data import MeasuredData

_FIRST_BAND = 12
"""Coefficients in the lowest band of frequencies; each further one holds half as many more."""
_GROWTH = 1.5


def covariance(data: MeasuredData, fitted: Fit) -> NDArray[np.float64]:
    """Return the covariance of a fit's values, shape (n, n), SI.

    Parameters
    ----------
    data : MeasuredData
        Those that were fitted.
    fitted : Fit
    """
    layout = Layout(fitted.parameters)
    scale = layout.array("scale")
    widths = (layout.array("upper") - layout.array("lower")) / scale
    # The bounds count as the variance of a uniform distribution, as in `Fit.covariance`.
    curvature = fitted.jacobian.T @ fitted.jacobian + np.diag(12.0 / widths**2)
    inverse = np.linalg.inv(curvature)
    coloured = fitted.jacobian * _powers(data, fitted.residuals)[:, None]
    # What no record determines is as uncertain as its bounds are wide.
    spread = fitted.jacobian.T @ coloured + np.diag(12.0 / widths**2)
    return np.asarray(inverse @ spread @ inverse * np.outer(scale, scale))


def _powers(data: MeasuredData, residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean square of whitened residuals (n,) in the band of frequencies of each."""
    found = np.empty_like(residuals)
    for rows in data.rows_of_parts():
        frequency = data.frequency[rows]
        order = np.argsort(frequency, kind="stable")
        ranks = np.empty(len(rows), dtype=int)
        ranks[order] = np.arange(len(rows))
        band = np.searchsorted(_edges(len(rows)), ranks, side="right")
        counts = np.bincount(band)
        power = np.bincount(band, residuals[rows] ** 2) / np.maximum(counts, 1)
        found[rows] = power[band]
    return found


def _edges(count: int) -> NDArray[np.int_]:
    edges: list[int] = []
    size = float(_FIRST_BAND)
    while sum(edges[-1:]) + 2.0 * size <= count:
        edges.append(int(sum(edges[-1:]) + size))
        size *= _GROWTH
    return np.array(edges, dtype=int)
