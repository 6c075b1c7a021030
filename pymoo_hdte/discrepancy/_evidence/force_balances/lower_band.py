"""The values of a fit by the lower half of its band alone.

Up to which frequency a motion is known is an estimate. What is true of a machine does not depend on
it: values that leave their intervals when the upper half of the band is left out are those of a
model that lacks something there, or of a motion that is noise there (Hausman, Econometrica 46,
1978, compares estimates by all and by some of the data).
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit

_PER_UNKNOWN = 4
"""Least number of coefficients for each unknown: with fewer a fit absorbs much of the noise."""


@dataclass(frozen=True)
class Moved:
    """A value that leaves its interval.

    Attributes
    ----------
    place : int
        Among the values of the fit.
    value : float
        By the lower half of the band, SI.
    """

    place: int
    value: float


def moved_by_band(data: MeasuredData, fitted: Fit) -> list[Moved] | None:
    """Return the values that the lower half of the band puts elsewhere; None where it is too short.

    Parameters
    ----------
    data : MeasuredData
    fitted : Fit
        To all of it.
    """
    spectra = []
    for balance in data.spectra:
        lower = copy.copy(balance)
        frequencies = np.where(balance.kept, balance.frequency, 0.0)
        lower.kept = balance.kept & (
            balance.frequency <= 0.5 * frequencies.max(axis=1, keepdims=True)
        )
        spectra.append(lower)
    half = replace(data, spectra=tuple(spectra))
    if len(half.frequency) < _PER_UNKNOWN * len(fitted.values):
        return None
    again = fit(half, fitted.candidates, fitted.values)
    spread = Spread(half, again)
    reach = spread.reach * np.sqrt(np.diag(spread.covariance))
    return [
        Moved(int(place), float(again.values[place]))
        for place in np.flatnonzero(np.abs(again.values - fitted.values) > reach)
    ]
