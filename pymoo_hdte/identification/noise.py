"""Sensor noise of a record, judged from differences so that slow curvature does not count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array

_SIGMA_PER_MEDIAN = 1.0 / 0.6744897501960817
"""Of normal noise: standard deviation over median absolute value."""

_EFFICIENCY = 0.37
"""Statistical efficiency of a variance that is estimated from medians."""

_MOST_CORRELATION = 0.99


@dataclass(frozen=True)
class Noise:
    """Normal noise with a first-order autocorrelation.

    Attributes
    ----------
    std : float
        Standard deviation.
    correlation : float
        From one sample to the next, in [0, 1).
    degrees_of_freedom : float
        Of ``std``, roughly.
    """

    std: float
    correlation: float
    degrees_of_freedom: float

    @property
    def inflation(self) -> float:
        """Factor on the variance of a slope over many samples of slowly varying abscissa.

        n samples count as n / inflation (Bayley and Hammersley, J. R. Stat. Soc. Suppl. 8, 1946).
        """
        return (1.0 + self.correlation) / (1.0 - self.correlation)


def noise_of(signal: ArrayLike) -> Noise:
    """Judge the noise on a smooth signal.

    Differences over one sample have the variance 2 s^2 (1 - r), over two samples 2 s^2 (1 - r^2);
    both are taken from medians, which sharp bends in a few places hardly move. A negative r is
    taken as zero.

    Parameters
    ----------
    signal : array_like, shape (n,)
        At least four samples at about equal spacing.

    Raises
    ------
    InvalidInput
        For fewer samples or a value that is not finite.
    """
    signal = finite_array("signal", signal, (None,))
    if len(signal) < 4:
        raise InvalidInput("number of samples", len(signal), "at least 4")
    one = _variance(signal[1:] - signal[:-1])
    two = _variance(signal[2:] - signal[:-2])
    correlation = min(max(two / one - 1.0, 0.0), _MOST_CORRELATION) if one > 0.0 else 0.0
    freedom = _EFFICIENCY * len(signal) * (1.0 - correlation) / (1.0 + correlation)
    return Noise((one / 2.0 / (1.0 - correlation)) ** 0.5, correlation, max(freedom, 1.0))


def _variance(differences: NDArray[np.float64]) -> float:
    centred = differences - np.median(differences)
    return (_SIGMA_PER_MEDIAN * float(np.median(np.abs(centred)))) ** 2
