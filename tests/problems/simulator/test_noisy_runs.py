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


def study(amplitude, seed):
    """Return the problem, and the share of designs whose two moments lie in their bands."""

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
    return problem, np.mean(np.abs(F - moments(X[:, 0])) <= band, axis=0)


def test_the_band_covers_the_moments_of_noisy_runs():
    problem, covered = study(0.01, seed=1)
    assert np.all(covered >= 0.95)
    assert problem.n_runs < 300


@pytest.mark.nightly
@pytest.mark.parametrize("amplitude", [0.001, 0.003, 0.01])
def test_bands_of_many_noisy_studies_cover_95_percent(amplitude):
    # All designs of a study have one surrogate and are off together, so that a band of 95 % misses
    # some studies altogether: as a sample, the studies count, not the designs.
    seeds = range(1, 41)
    covered = np.mean([study(amplitude, seed)[1] for seed in seeds], axis=0)
    chance = 1.96 * np.sqrt(0.95 * 0.05 / len(seeds))
    assert np.all(covered >= 0.95 - chance)
