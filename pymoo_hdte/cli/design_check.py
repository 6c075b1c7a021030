"""A second look at designs of a front: the drive model on other drives than those of the search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive import PARAMETERS
from pymoo_hdte.problems import RobustDTEDirect
from pymoo_hdte.problems.operating_conditions import duty_cycle_dte_where_found
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.surrogate.sparse.measures import Distribution

SETS, DRIVES = 8, 128
"""Independent sets of quasi-random drives, and drives in each: the sets tell the error."""

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Check:
    """Mean and standard deviation of the DTE of one design over each set of drives, arcsec.

    Attributes
    ----------
    means, stds : ndarray, shape (SETS,)
        Of each set; NaN if one of its drives has no steady state. The share of the scatter that is
        linear in the inputs is exact (a control variate), the rest is that of the set.
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
        """Return by how much objectives differ from these beyond chance, in widths.

        Parameters
        ----------
        objectives, width : ndarray, shape (2,)
            Mean and standard deviation, and one unit of each, arcsec.

        Returns
        -------
        float
            What exceeds two standard errors; inf if a drive has no steady state.
        """
        found = np.array([self.mean, self.std])
        doubt = 2.0 * np.array([self.mean_error, self.std_error])
        beyond = np.maximum(np.abs(objectives - found) - doubt, 0.0) / width
        return float(np.nan_to_num(beyond, nan=np.inf).max())


def standard_error(values: Values) -> float:
    """Return the standard error of the mean of independent values."""
    return float(values.std(ddof=1) / len(values) ** 0.5)


def check_designs(
    problem: RobustDTEDirect, designs: Values, rng: np.random.Generator
) -> list[Check]:
    """Ask the drive model for designs, shape (n, 4), on the same drives relative to each."""
    standard, relative = _drives(problem, rng)
    checks = []
    for design in designs:
        drives = relative.reshape(-1, len(PARAMETERS)).copy()
        drives[:, 1:] *= design
        dte = duty_cycle_dte_where_found(problem.model, problem.conditions, drives)
        pairs = zip(standard, dte.reshape(SETS, DRIVES), strict=True)
        means, stds = np.array([_moments(*pair) for pair in pairs]).T
        checks.append(Check(means, stds))
    return checks


def _drives(problem: RobustDTEDirect, rng: np.random.Generator) -> tuple[Values, Values]:
    """Return inputs with mean 0 and variance 1, and as they multiply a design, (sets, drives, 5).

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


def _moments(standard: Values, dte: Values) -> tuple[float, float]:
    """Return mean and standard deviation of one set, its linear part taken as exact."""
    if np.isnan(dte).any():
        return np.nan, np.nan
    basis = np.column_stack([np.ones(len(dte)), standard])
    slopes = np.linalg.lstsq(basis, dte, rcond=None)[0]
    rest = np.sum((dte - basis @ slopes) ** 2) / (len(dte) - len(slopes))
    return float(slopes[0]), float(np.sqrt(np.sum(slopes[1:] ** 2) + rest))
