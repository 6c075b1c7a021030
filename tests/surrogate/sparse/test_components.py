"""Fields as few components: moments within their bands, and no more regressions than patterns."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.stats import norm

from pymoo_hdte.problems import Design, Mean, Std, robust_problem
from pymoo_hdte.surrogate._sparse import components as module

RATES = np.linspace(0.1, 1.0, 40)


def field(x, a):
    return list(np.exp(-x * a * RATES) + 0.2 * np.sin(3.0 * x) * RATES**2)


def true_moments(x):
    """Return mean and deviation of all values, shape (40,) each; a is normal, x uniform."""
    nodes, weights = leggauss(40)
    u = (x * (1.0 + 0.1 * nodes))[:, None]
    weights = 0.5 * weights
    c, sine = u * RATES, 0.2 * np.sin(3.0 * u) * RATES**2
    once, twice = np.exp(-c + 0.005 * c**2), np.exp(-2.0 * c + 0.02 * c**2)
    mean = weights @ (once + sine)
    square = weights @ (twice + 2.0 * once * sine + sine**2)
    return mean, np.sqrt(square - mean**2)


@pytest.mark.slow
def test_every_value_of_a_field_has_its_own_moments_and_band(monkeypatch):
    fitted, calls = module.fitted, []

    def counted(*arguments):
        calls.append(1)
        return fitted(*arguments)

    monkeypatch.setattr(module, "fitted", counted)
    names = [f"response_{k + 1}" for k in range(len(RATES))]
    problem = robust_problem(
        field,
        {"x": Design(1.0, 2.0, tolerance=0.1)},
        {"a": norm(1.0, 0.1)},
        [statistic(response=name) for statistic in (Mean, Std) for name in names],
        progress=False,
    )
    # Some twelve judgements of at most ten components, and not of forty values.
    assert len(calls) <= problem.n_runs * len(RATES) / 10
    X = np.linspace(1.0, 2.0, 15)[:, None]
    F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
    truth = np.array([np.concatenate(true_moments(x)) for x in X[:, 0]])
    assert np.mean(np.abs(F - truth) <= band) >= 0.95
    scatter = np.tile(truth[:, len(RATES) :], 2)
    assert np.median(np.abs(F - truth) / scatter) < 5e-3
    assert np.median(band / scatter) < 1e-2


def test_responses_without_common_patterns_stay_apart():
    rng = np.random.default_rng(0)
    assert module._components(rng.normal(size=(50, 8)), 1e-3) is None
    patterns = rng.normal(size=(2, 12))
    scores = rng.normal(size=(50, 2))
    common = module._components(scores @ patterns + 3.0, 1e-9)
    assert common.scores.shape == (50, 2)
    np.testing.assert_allclose(
        common.scores @ common.patterns + common.centre, scores @ patterns + 3.0, atol=1e-12
    )
