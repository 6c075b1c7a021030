"""A second look at designs of a front: the drive model on other drives than those of the search."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive import PARAMETERS
from pymoo_hdte.problems import RobustDTEDirect
from pymoo_hdte.problems.operating_conditions import duty_cycle_dte_where_found
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand
from pymoo_hdte.surrogate._sparse.measures import Distribution

SETS, DRIVES = 8, 256
"""Number of independent sets of quasi-random drives, whose scatter is the error, and of drives
in each."""

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Check:
    """Mean and standard deviation of the DTE of one design over each set of drives, arcsec.

    Attributes
    ----------
    means, stds : ndarray, shape (SETS,)
        Values of each set, NaN if one of its drives has no steady state. The part of the scatter
        that is of first or second degree in the inputs is exact (control variates); the residual
        is estimated from the set.
    """

    means: Values
    stds: Values

    @property
    def mean(self) -> float:
        """Mean of the DTE, arcsec."""
        return float(self.means.mean())

    @property
    def std(self) -> float:
        """Standard deviation of the DTE, arcsec."""
        return float(self.stds.mean())

    @property
    def mean_error(self) -> float:
        """Standard error of ``mean``, arcsec."""
        return standard_error(self.means)

    @property
    def std_error(self) -> float:
        """Standard error of ``std``, arcsec."""
        return standard_error(self.stds)

    def differs(self, objectives: Values, width: Values) -> float:
        """Return the largest difference of objectives from these moments, in widths.

        Parameters
        ----------
        objectives, width : ndarray, shape (2,)
            Mean and standard deviation, and one unit of each, arcsec.

        Returns
        -------
        float
            The difference plus two standard errors, so that uncertain moments do not pass for
            agreement; inf if a drive has no steady state.
        """
        moments = np.array([self.mean, self.std])
        doubt = 2.0 * np.array([self.mean_error, self.std_error])
        most = (np.abs(objectives - moments) + doubt) / width
        return float(np.nan_to_num(most, nan=np.inf).max())


def standard_error(values: Values) -> float:
    """Return the standard error of the mean of independent values."""
    return float(values.std(ddof=1) / len(values) ** 0.5)


def check_designs(
    problem: RobustDTEDirect, designs: Values, rng: np.random.Generator
) -> list[Check]:
    """Check designs, shape (n, 4), by the drive model, on the same relative deviations for each."""
    standard, relative = _drives(problem, rng)
    basis = _basis(problem, standard)
    checks = []
    for design in designs:
        drives = relative.reshape(-1, len(PARAMETERS)).copy()
        drives[:, 1:] *= design
        dte = duty_cycle_dte_where_found(problem.model, problem.conditions, drives)
        pairs = zip(basis, dte.reshape(SETS, DRIVES), strict=True)
        means, stds = np.array([_moments(*pair) for pair in pairs]).T
        checks.append(Check(means, stds))
    return checks


def _drives(problem: RobustDTEDirect, rng: np.random.Generator) -> tuple[Values, Values]:
    """Return inputs of mean 0 and variance 1, and as factors of a design, (sets, drives, 5).

    The first input, theta_s, is its value itself.
    """
    samplers = [scipy.stats.qmc.Sobol(len(PARAMETERS), rng=rng) for _ in range(SETS)]
    shares = np.array([sampler.random(DRIVES) for sampler in samplers])
    relative = np.empty_like(shares)
    standard = np.sqrt(3.0) * (2.0 * shares - 1.0)
    for axis, entry in enumerate(problem.inputs):
        if isinstance(entry, TruncatedNormal):
            relative[..., axis] = Distribution("theta_s", entry).quantile(shares[..., axis])
            standard[..., axis] = (relative[..., axis] - entry.mean) / entry.truncated_std
        else:
            relative[..., axis] = 1.0 + entry.tolerance * (2.0 * shares[..., axis] - 1.0)
    return standard, relative


def _basis(problem: RobustDTEDirect, standard: Values) -> Values:
    """Return 1 and the polynomials up to degree 2, orthonormal, (sets, drives, 21)."""
    # All inputs are symmetric, hence their squares uncorrelated with themselves.
    fourth = np.array([_kurtosis(entry) for entry in problem.inputs])
    pairs = combinations(range(len(fourth)), 2)
    parts = [
        np.ones_like(standard[..., :1]),
        standard,
        (standard**2 - 1.0) / np.sqrt(fourth - 1.0),
        np.stack([standard[..., i] * standard[..., j] for i, j in pairs], axis=-1),
    ]
    return np.concatenate(parts, axis=-1)


def _kurtosis(entry: TruncatedNormal | UniformBand) -> float:
    """Return the expectation of the fourth power of an input of mean 0 and variance 1."""
    if isinstance(entry, UniformBand):
        return 9.0 / 5.0
    return 3.0 + float(scipy.stats.truncnorm.stats(-entry.cut, entry.cut, moments="k"))


def _moments(basis: Values, dte: Values) -> tuple[float, float]:
    """Return mean and standard deviation of one set; the part that the basis explains is exact."""
    if np.isnan(dte).any():
        return np.nan, np.nan
    slopes = np.linalg.lstsq(basis, dte, rcond=None)[0]
    residual_variance = np.sum((dte - basis @ slopes) ** 2) / (len(dte) - len(slopes))
    return float(slopes[0]), float(np.sqrt(np.sum(slopes[1:] ** 2) + residual_variance))
