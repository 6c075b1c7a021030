"""The numbers that the paper prints, as facts to stand beside ours.

Source: Hu, Zhang, Wang, Zhao, Machines 2026, 14(9), 1000, doi:10.3390/machines14091000.
"""

from __future__ import annotations

from typing import NamedTuple

PAPER = "Hu et al., Machines 2026, 14(9), 1000"


DESIGN_BOX = 0.25
"""Share of the nominal values by which the search of Section 5.1 may leave them."""

MODEL_SECONDS, SURROGATE_SECONDS = 0.147, 3e-6
"""Section 3, for one evaluation."""
BATCH_SIZE, BATCH_MODEL_SECONDS, BATCH_SURROGATE_SECONDS = 1000, 128.83, 0.0030
"""Section 3, for a Monte Carlo analysis of so many evaluations."""
SPEED_UPS = (49_000, 42_943)
"""Section 3: ratios of the times of one evaluation, and of those of the analysis."""
MONTE_CARLO, POPULATION, GENERATIONS = 1000, 100, 100
"""Section 5.1: evaluations of the surrogate for a design, designs, and generations of a run."""


class SurrogateAccuracy(NamedTuple):
    """One row of Table 5: errors of the surrogate of one order on 500 test points."""

    mae_arcsec: float
    rmse_arcsec: float
    mape_percent: float
    max_error_arcsec: float
    r2: float


TABLE_5 = {
    2: SurrogateAccuracy(2.330, 3.207, 2.59, 19.922, 0.989),
    3: SurrogateAccuracy(1.074, 1.486, 1.32, 8.001, 0.998),
    4: SurrogateAccuracy(1.230, 1.925, 1.45, 21.109, 0.996),
}
"""By order k of the surrogate."""


class Prototype(NamedTuple):
    """One row of Table 6 (SI units but for theta_s), with the D_i that Section 5.3 prints."""

    theta_s_arcsec: float
    K: float
    J_in: float
    B_in: float
    B_fc: float
    deviation_degree: float

    @property
    def design(self) -> tuple[float, float, float, float]:
        """The design variables (K, J_in, B_in, B_fc)."""
        return self.K, self.J_in, self.B_in, self.B_fc


TABLE_6 = {
    1: Prototype(33.745, 2.724e4, 1.970e-4, 1.714e-4, 5.125e-4, 0.367),
    2: Prototype(30.356, 2.600e4, 1.970e-4, 1.799e-4, 4.691e-4, 0.379),
    3: Prototype(41.972, 2.728e4, 1.970e-4, 1.683e-4, 4.788e-4, 0.371),
    4: Prototype(33.638, 2.393e4, 1.970e-4, 1.442e-4, 4.862e-4, 0.474),
    5: Prototype(42.743, 2.701e4, 1.970e-4, 1.875e-4, 5.360e-4, 0.365),
}
"""By number of the prototype."""


class Moments(NamedTuple):
    """One row of Table 8: mean and standard deviation of the DTE."""

    mean_arcsec: float
    std_arcsec: float


TABLE_8 = {
    "initial": Moments(88.767, 17.251),
    "accuracy_first": Moments(85.506, 16.233),
    "balanced": Moments(85.990, 15.773),
    "robustness_first": Moments(86.458, 15.637),
}
"""By preference; the initial design is the nominal one."""

TABLE_9 = {
    "accuracy_first": (3.229e4, 1.496e-4, 1.891e-4, 4.968e-4),
    "balanced": (2.998e4, 2.282e-4, 1.887e-4, 3.405e-4),
    "robustness_first": (2.941e4, 2.305e-4, 1.739e-4, 3.416e-4),
}
"""Optimal designs (K, J_in, B_in, B_fc) in SI units, by preference."""

REEVALUATION_LIMITS = {"mean_percent": 0.5, "std_arcsec": 0.3, "half_width_arcsec": 0.1}
"""Section 5.3, 100,000 samples: bounds on the error of the mean and the deviation of the standard
deviation, and the approximate half width of the 95 % confidence interval of the mean."""


class ErrorStatistic(NamedTuple):
    """One row of Table 2: Shapiro-Wilk test, mean and standard deviation of one error."""

    shapiro_w: float
    shapiro_p: float
    mean_um: float
    std_um: float


TABLE_2 = {
    "dFp1": ErrorStatistic(0.992, 0.322, 8.33, 0.89),
    "dfi1": ErrorStatistic(0.994, 0.631, 7.44, 1.03),
    "e13": ErrorStatistic(0.993, 0.440, 5.48, 1.10),
    "e14": ErrorStatistic(0.994, 0.620, 5.97, 1.47),
    "dFp2": ErrorStatistic(0.991, 0.235, 6.87, 0.70),
    "dfi2": ErrorStatistic(0.990, 0.206, 10.24, 1.74),
    "e23": ErrorStatistic(0.995, 0.722, 5.62, 0.95),
    "e24": ErrorStatistic(0.987, 0.064, 7.86, 1.19),
    "e31": ErrorStatistic(0.994, 0.612, 7.10, 1.40),
    "e32": ErrorStatistic(0.989, 0.122, 5.40, 0.96),
    "e33": ErrorStatistic(0.992, 0.376, 6.28, 0.68),
    "e34": ErrorStatistic(0.992, 0.382, 3.47, 0.65),
    "e41": ErrorStatistic(0.993, 0.435, 8.45, 0.67),
}
"""By symbol of the error, as in the data sheet."""


class CoefficientStatistics(NamedTuple):
    """One row of Table 3 (N.m.s/rad): a damping coefficient over 20 prototypes."""

    mean: float
    std: float
    cv_percent: float


TABLE_3 = {
    "B_in": CoefficientStatistics(1.700e-4, 0.154e-4, 9.08),
    "B_fc": CoefficientStatistics(4.465e-4, 0.209e-4, 4.68),
    "B_out": CoefficientStatistics(5.022e-4, 0.280e-4, 5.57),
}
"""By coefficient."""
