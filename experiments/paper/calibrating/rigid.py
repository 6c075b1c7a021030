"""The simplest explanation: a rigid drive, and a share of its torsion read as transmission error.

The printed equations follow theta_s with a gain g near 1, whatever the shape of theta_s. Read as a
semi-amplitude, and with a share r of the torsion T/K in what is read, the DTE is
2 g theta_s + r T / K. Two numbers are open, r and std(theta_s); all moments have closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from experiments.paper.calibrating.ladder import NARROW, WIDE
from experiments.paper.calibrating.predictions import (
    BAND,
    PUBLISHED,
    TABLE_8_AND_BOX,
    UNCERTAINTY,
)
from experiments.published_values import TABLE_6, TABLE_8, TABLE_9
from pymoo_hdte.drive import PARAMETERS, preset
from pymoo_hdte.problems.drive_response import SURROGATE_BOX
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.units import ARCSEC

START = (0.05, 8.0)
"""Of a fit: share of the torsion, and std of theta_s in arcsec; the sum of squares has one dip."""
STIFFNESS = PARAMETERS.index("K")
N_PARAMETERS = 2


@dataclass(frozen=True)
class RigidDrive:
    """DTE = gain theta_s + torsion_share T / K, under one reading of the bands.

    Attributes
    ----------
    torsion_share : float
        r, dimensionless.
    std_arcsec : float
        Standard deviation of theta_s before truncation at 3 std, arcsec.
    bands : str
        `NARROW` or `WIDE`.
    """

    torsion_share: float
    std_arcsec: float
    bands: str

    def dte_arcsec(
        self, theta_s_arcsec: NDArray[np.float64], stiffness: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the DTE for theta_s in arcsec and K in N.m/rad, of one shape."""
        return gain() * theta_s_arcsec + self.torsion_share * _torsion(stiffness)

    def predict(self) -> dict[str, float]:
        """Return the nine numbers of `TABLE_8_AND_BOX`, arcsec."""
        nominal = preset("published").nominal
        mean, std = float(nominal[0]) / ARCSEC, self.std_arcsec * _truncation()
        predictions = {}
        for design in TABLE_8:
            initial = design == "initial"
            stiffness = nominal[STIFFNESS] if initial else TABLE_9[design][STIFFNESS - 1]
            band = BAND["initial" if initial else "optimum"][self.bands]
            moments = self._moments(mean, std, stiffness, band)
            predictions[f"mean_{design}"], predictions[f"std_{design}"] = moments
        # Uniform over the box of Table 5: theta_s over mean +- 3 std, or +-35 % of its mean.
        reach = 3.0 * self.std_arcsec if self.bands == WIDE else SURROGATE_BOX * mean
        predictions["box_std"] = self._moments(
            mean, reach / 3**0.5, nominal[STIFFNESS], SURROGATE_BOX
        )[1]
        return {name: predictions[name] for name in TABLE_8_AND_BOX}

    def prototypes(self) -> NDArray[np.float64]:
        """Return the DTE of the five prototypes of Table 6, arcsec."""
        theta_s, stiffness = np.array([(row.theta_s_arcsec, row.K) for row in TABLE_6.values()]).T
        return self.dte_arcsec(theta_s, stiffness)

    @property
    def chi_square(self) -> float:
        """Sum of squares of the misfits of the nine numbers in their uncertainty."""
        return float(np.sum(_residuals(self) ** 2))

    def _moments(
        self, mean: float, std: float, stiffness: float, band: float
    ) -> tuple[float, float]:
        """Return mean and std, arcsec, for K uniform within +-``band`` around a value."""
        inverse, spread = inverse_moments(band)
        torsion = self.torsion_share * float(_torsion(np.array(stiffness)))
        return gain() * mean + torsion * inverse, float(np.hypot(gain() * std, torsion * spread))


def inverse_moments(band: float) -> tuple[float, float]:
    """Return mean and standard deviation of 1/x, x being uniform on 1 - band .. 1 + band.

    E[1/x] = ln((1 + h) / (1 - h)) / (2 h) and E[1/x^2] = 1 / (1 - h^2).
    """
    mean = float(np.log((1.0 + band) / (1.0 - band)) / (2.0 * band))
    return mean, float(np.sqrt(1.0 / (1.0 - band**2) - mean**2))


@cache
def gain() -> float:
    """Return the DTE of the printed equations over theta_s as a semi-amplitude, near 2."""
    model = preset("published")
    error = replace(model.kinematic_error, reading="semi_amplitude")
    model = replace(model, kinematic_error=error)
    return float(model.dte_arcsec(model.nominal[None])[0] * ARCSEC / model.nominal[0])


def fit_rigid(bands: str) -> RigidDrive:
    """Return the rigid drive that meets the nine numbers best under this reading of the bands."""

    def drive(values: NDArray[np.float64]) -> RigidDrive:
        share, std = map(float, values)
        return RigidDrive(share, std, bands)

    solution = least_squares(lambda values: _residuals(drive(values)), START, x_scale=START)
    return drive(solution.x)


def simplest() -> RigidDrive:
    """Return the better one of the two readings of the bands."""
    return min(
        (fit_rigid(bands) for bands in (NARROW, WIDE)), key=lambda outcome: outcome.chi_square
    )


def _residuals(drive: RigidDrive) -> NDArray[np.float64]:
    predicted = drive.predict()
    return np.array([(predicted[n] - PUBLISHED[n]) / UNCERTAINTY[n] for n in TABLE_8_AND_BOX])


def _torsion(stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T/K at the rated load, arcsec."""
    return preset("published").sheet.load_torque / stiffness / ARCSEC


@cache
def _truncation() -> float:
    """Return the std of a standard normal variable cut at 3."""
    nodes, weights = TruncatedNormal(0.0, 1.0).quadrature(2)
    return float(np.sqrt(weights @ nodes**2))
