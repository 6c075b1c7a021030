"""Whether a drive model has a trade-off between mean and scatter, and which variables matter."""

from __future__ import annotations

import numpy as np
from scipy.stats import sobol_indices, uniform

from pymoo_hdte.drive import DriveModel
from pymoo_hdte.problems import RobustDTE

_FRONT_SAMPLE = 20_000
_SHARE_SAMPLE = 1024
_VARIABLES = ("K", "J_in", "B_in", "B_fc")

WIDTHS = ("front_mean_width", "front_std_width")
SHARES = tuple(f"{objective}_share_{name}" for objective in ("mean", "std") for name in _VARIABLES)
TRAITS = (*WIDTHS, *SHARES)


def front_traits(model: DriveModel) -> dict[str, float]:
    """Return the width of the Pareto front in arcsec, and total Sobol shares over the design box.

    The width is that of the non-dominated ones among random designs; the shares are those of each
    design variable in the variance of either objective, designs being uniform in the box.
    """
    problem = RobustDTE(model)
    width = problem.xu - problem.xl
    designs = problem.xl + np.random.default_rng(1).random((_FRONT_SAMPLE, problem.n_var)) * width
    objectives = problem.evaluate(designs)
    rising = objectives[np.argsort(objectives[:, 0], kind="stable")]
    front = rising[rising[:, 1] <= np.minimum.accumulate(rising[:, 1])]
    indices = sobol_indices(
        func=lambda cube: problem.evaluate(problem.xl + cube.T * width).T,
        n=_SHARE_SAMPLE,
        dists=[uniform()] * problem.n_var,
        rng=np.random.default_rng(1),
    )
    values = [*np.ptp(front, axis=0), *indices.total_order.ravel()]
    return dict(zip(TRAITS, map(float, values), strict=True))
