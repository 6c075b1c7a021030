"""A twin of the robust DTE problem whose moments and front are closed form, to test against.

    y = x_1 + x_2 + a_1 (3 - x_1) + a_2 (x_3 - 3/2)

with x_j uniform in u_j (1 +- t) around the design u in [1, 2]^3 and a_1, a_2 independent normals of
mean zero, truncated at three standard deviations. As in the drive, a larger x_1 raises the mean and
lowers the scatter; x_2 has its optimum on the bound and x_3 inside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import real_number
from pymoo_hdte.problems.robust import RobustProblem, make_moments
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, TruncatedNormal, UniformBand

_VARIABLES = ("x_1", "x_2", "x_3")
_NOISE = (TruncatedNormal(0.0, 0.2), TruncatedNormal(0.0, 0.3))
_FRONT_POINTS = 1000


class RobustToy(RobustProblem):
    """The closed-form twin, run through the same surrogate and moments as `RobustDTE`.

    The response is our own, chosen for its closed forms. X has shape (n, 3), F shape (n, 2); all is
    dimensionless.

    Parameters
    ----------
    moments, n_samples, sample_seed, tolerance
        As in `RobustDTE`; the tolerance is at most 0.2, so that x_1 keeps its trade-off.

    Attributes
    ----------
    surrogate : ChebyshevSurrogate
        The response over (a_1, a_2, x_1, x_2, x_3), exact as it is linear in each.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.

    Examples
    --------
    >>> toy = RobustToy()
    >>> X = 0.5 * (toy.xl + toy.xu)[np.newaxis]
    >>> np.allclose(toy.evaluate(X), np.column_stack(toy.closed_form(X)))
    True
    """

    def __init__(
        self,
        moments: str = "exact",
        n_samples: int = 1000,
        sample_seed: int = 1,
        tolerance: float = 0.05,
    ) -> None:
        self.tolerance = real_number("tolerance", tolerance, above=0.0, at_most=0.2)
        bands = [UniformBand(self.tolerance) for _ in _VARIABLES]
        inputs: list[TruncatedNormal | UniformBand] = [*_NOISE, *bands]
        noise = np.array([entry.support for entry in _NOISE])
        reach = np.array([1.0 - self.tolerance, 2.0 * (1.0 + self.tolerance)])
        lower, upper = np.vstack([noise, np.tile(reach, (3, 1))]).T
        self.surrogate = ChebyshevSurrogate.fit(
            response, Box(("a_1", "a_2", *_VARIABLES), lower, upper), order=1
        )
        design_box = Box(_VARIABLES, np.ones(3), np.full(3, 2.0))
        scatter = make_moments(moments, self.surrogate, inputs, design_box, n_samples, sample_seed)
        names = ("mean", "std")
        super().__init__(scatter, names, dict.fromkeys((*_VARIABLES, *names), "1"))

    def closed_form(
        self, designs: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the true mean and standard deviation.

        Parameters
        ----------
        designs : ndarray, shape (n, 3)
            Dimensionless.

        Returns
        -------
        mean, std : ndarray, shape (n,)
            Dimensionless.
        """
        x1, x2, x3 = designs.T
        band = self.tolerance**2 / 3.0
        variance = (
            band * (x1**2 + x2**2)
            + _NOISE[0].truncated_std ** 2 * ((3.0 - x1) ** 2 + band * x1**2)
            + _NOISE[1].truncated_std ** 2 * ((x3 - 1.5) ** 2 + band * x3**2)
        )
        return x1 + x2, np.sqrt(variance)

    def _calc_pareto_set(self) -> NDArray[np.float64]:
        """Return the true set: u_2 = 1 and u_3 = (3/2) / (1 + t^2 / 3), for every u_1."""
        designs = np.empty((_FRONT_POINTS, 3))
        designs[:, 0] = np.linspace(1.0, 2.0, _FRONT_POINTS)
        designs[:, 1] = 1.0
        designs[:, 2] = 1.5 / (1.0 + self.tolerance**2 / 3.0)
        return designs

    def _calc_pareto_front(self) -> NDArray[np.float64]:
        """Return the true front, from the closed form."""
        return np.column_stack(self.closed_form(self._calc_pareto_set()))


def response(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return y, shape (n,), for points (a_1, a_2, x_1, x_2, x_3) of shape (n, 5)."""
    first_noise, second_noise, x1, x2, x3 = points.T
    return x1 + x2 + first_noise * (3.0 - x1) + second_noise * (x3 - 1.5)
