"""Uncertainty of the parameters of a fit with coloured (correlated) residuals.

The residual of a real record is not white: errors of neighbouring samples are correlated, and the
curvature at the optimum alone would make intervals several times too narrow. The covariance is that
of White (Econometrica 48, 1980) with the power of the residual by frequency instead of single
squares. These powers are corrected for the noise that a fit absorbs (MacKinnon and White, Journal
of Econometrics 29, 1985). A few powers alone leave the deviation uncertain, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit

Values = NDArray[np.float64]

_FIRST_BAND = 12
"""Coefficients in the lowest band of frequencies; each further band is `_GROWTH` times larger."""
_GROWTH = 1.5
_CENTRAL = 0.975
"""Quantile at which a central 95 % interval ends."""


class Spread:
    """How far the values of a fit may lie from the truth.

    Parameters
    ----------
    data : MeasuredData
        The fitted data.
    fitted : Fit

    Attributes
    ----------
    covariance : ndarray, shape (n, n)
        Covariance of the values, SI.
    reach : ndarray, shape (n,)
        Half-widths of central 95 % intervals in standard deviations: Student's quantile at the
        degrees of freedom of each variance after Satterthwaite (Biometrics Bulletin 2, 1946).
    """

    covariance: Values
    reach: Values

    def __init__(self, data: MeasuredData, fitted: Fit) -> None:
        layout = Layout(fitted.parameters)
        scale = layout.array("scale")
        widths = (layout.array("upper") - layout.array("lower")) / scale
        # The bounds count as the variance of a uniform distribution, as in `Fit.covariance`, which
        # is the variance of a value that no record determines.
        bounds = np.diag(12.0 / widths**2)
        inverse = np.linalg.inv(fitted.jacobian.T @ fitted.jacobian + bounds)
        influence = inverse @ fitted.jacobian.T
        freedom = 1.0 - np.einsum("np,pn->n", fitted.jacobian, influence)
        band = _bands(data)
        degrees_of_freedom = np.maximum(np.bincount(band, freedom), 1.0)
        power = np.bincount(band, fitted.residuals**2) / degrees_of_freedom
        spread = (influence * power[band]) @ influence.T + inverse @ bounds @ inverse
        self.covariance = spread * np.outer(scale, scale)
        shares = np.array([np.bincount(band, row**2) * power for row in influence])
        # The shape matters where every value is certain and none is fitted.
        shares = shares.reshape(len(influence), len(power))
        uncertain = np.sum(shares**2 / degrees_of_freedom, axis=1)
        # A variance that only the bounds determine is exact: infinite degrees of freedom.
        with np.errstate(divide="ignore"):
            self.reach = np.asarray(t.ppf(_CENTRAL, np.diag(spread) ** 2 / uncertain))


def _bands(data: MeasuredData) -> NDArray[np.int_]:
    """Return the number of the band of frequencies of each residual, shape (n,), by part."""
    bands, start = np.empty(len(data.frequency), dtype=int), 0
    for rows in data.rows_of_parts():
        order = np.argsort(data.frequency[rows], kind="stable")
        edges = _edges(len(rows))
        bands[rows[order]] = start + np.searchsorted(edges, np.arange(len(rows)), side="right")
        start += len(edges) + 1
    return bands


def _edges(count: int) -> NDArray[np.int_]:
    edges: list[int] = []
    size = float(_FIRST_BAND)
    while sum(edges[-1:]) + 2.0 * size <= count:
        edges.append(int(sum(edges[-1:]) + size))
        size *= _GROWTH
    return np.array(edges, dtype=int)
