"""Responses that scatter by themselves, as by a mesh or the tolerance of a solver."""

import numpy as np
import pytest
from scipy.stats import norm, uniform

from pymoo_hdte.problems import Design, Mean, Std, robust_problem


def moments(x):
    """Return mean and deviation of (x + d)^2 u + exp(s) in closed form.

    With d uniform in -0.1..0.1, u uniform in 0..1 and s normal of deviation 0.3.
    """
    square = x**2 + 0.01 / 3.0
    fourth = x**4 + 6.0 * x**2 * 0.01 / 3.0 + 1e-4 / 5.0
    mean = 0.5 * square + np.exp(0.045)
    variance = fourth / 3.0 - 0.25 * square**2 + np.exp(0.09) * (np.exp(0.09) - 1.0)
    return np.column_stack([mean, np.sqrt(variance)])


@pytest.mark.parametrize(
    ("amplitude", "seed"),
    [
        (0.01, 1),
        *(pytest.param(0.003, seed, marks=pytest.mark.nightly) for seed in range(1, 13)),
        *(pytest.param(0.01, seed, marks=pytest.mark.nightly) for seed in range(2, 13)),
    ],
)
def test_the_band_covers_the_moments_of_noisy_runs(amplitude, seed):
    def simulator(x, u, s):
        noise = amplitude * np.sin(1e5 * x + 7e4 * u + 3e4 * s)
        return x**2 * u + np.exp(s) + noise

    problem = robust_problem(
        simulator,
        {"x": Design(1.0, 2.0, deviation=0.1)},
        {"u": uniform(), "s": norm(0.0, 0.3)},
        [Mean(), Std()],
        vectorised=True,
        seed=seed,
        progress=False,
    )
    X = np.linspace(1.0, 2.0, 200)[:, None]
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    assert np.all(np.mean(np.abs(F - moments(X[:, 0])) <= band, axis=0) >= 0.95)
    assert problem.n_runs < 300
