"""Uncertain inputs against closed forms, SciPy and their own samples."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss
from scipy import stats
from scipy.special import ndtr

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.surrogate import TruncatedNormal, UniformBand


@pytest.mark.parametrize("cut", [0.1, 1.0, 3.0, 10.0])
def test_the_normals_moments_follow_the_recurrence(cut):
    """E z^n = (n - 1) E z^(n-2) - 2 c^(n-1) phi(c) / (Phi(c) - Phi(-c)), by parts."""
    values, weights = TruncatedNormal(36.0, 5.6, cut).quadrature(12)
    z = (values - 36.0) / 5.6
    edge = 2 * np.exp(-0.5 * cut**2) / np.sqrt(2 * np.pi) / (ndtr(cut) - ndtr(-cut))
    moment = 1.0
    for n in range(2, 13, 2):
        moment = (n - 1) * moment - cut ** (n - 1) * edge
        # For a small cut the recurrence itself cancels; its rounding is absolute.
        assert weights @ z**n == pytest.approx(moment, rel=1e-12, abs=1e-10 * cut**2)
        assert weights @ z ** (n - 1) == pytest.approx(0.0, abs=1e-13 * max(1.0, cut**n))


@pytest.mark.parametrize("cut", [0.5, 3.0, 8.0])
def test_expectations_of_chebyshev_polynomials_over_the_normal(cut):
    """Against Gauss-Legendre in 64 panels with the density written out."""
    values, weights = TruncatedNormal(36.0, 5.6, cut).quadrature(8)
    nodes, panel = leggauss(20)
    z = (cut / 64 * (nodes + 2 * np.arange(64)[:, None] - 63)).ravel()
    density = np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi) / (ndtr(cut) - ndtr(-cut))
    for degree in range(9):
        series = np.eye(9)[degree]
        integrand = density * chebyshev.chebval(z / (1.1 * cut), series)
        expected = cut / 64 * np.sum(np.tile(panel, 64) * integrand)
        expectation = weights @ chebyshev.chebval((values - 36.0) / (1.1 * cut * 5.6), series)
        assert expectation == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("tolerance", [0.05, 0.35, 0.999])
def test_expectations_of_chebyshev_polynomials_over_the_band(tolerance):
    factors, weights = UniformBand(tolerance).quadrature(8)
    low, high = 1 - tolerance, 1 + tolerance
    for degree in range(9):
        series = np.eye(9)[degree]
        primitive = chebyshev.chebint(series)
        scaled = (factors - 1.0) / 1.2
        edges = chebyshev.chebval(np.array([low - 1, high - 1]) / 1.2, primitive)
        expected = 1.2 * (edges[1] - edges[0]) / (high - low)
        assert weights @ chebyshev.chebval(scaled, series) == pytest.approx(expected, abs=1e-14)


def test_the_bands_power_moments_are_closed_form():
    t = 0.05
    factors, weights = UniformBand(t).quadrature(7)
    for p in range(8):
        expected = ((1 + t) ** (p + 1) - (1 - t) ** (p + 1)) / (2 * t * (p + 1))
        assert weights @ factors**p == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("cut", [0.2, 1.0, 3.0, 9.0])
def test_the_truncated_normal_is_scipys(cut):
    noise = TruncatedNormal(-2.0, 0.7, cut)
    reference = stats.truncnorm(-cut, cut, loc=-2.0, scale=0.7)
    x = np.linspace(-12, 8, 401)
    assert noise.pdf(x) == pytest.approx(reference.pdf(x), rel=1e-12, abs=1e-300)
    assert noise.truncated_std == pytest.approx(reference.std(), rel=1e-9)
    assert noise.truncated_std < noise.std or cut == 9.0
    assert noise.support == pytest.approx(reference.support())


def test_the_usual_cut_narrows_the_scatter_as_documented():
    assert TruncatedNormal(0.0, 1.0).truncated_std ** 2 == pytest.approx(0.97334, abs=5e-6)
    assert TruncatedNormal(0.0, 1.0).truncated_std == pytest.approx(0.9866, abs=5e-5)


@pytest.mark.parametrize(
    ("entry", "reference"),
    [
        (TruncatedNormal(36.0, 5.6), stats.truncnorm(-3, 3, loc=36.0, scale=5.6)),
        (TruncatedNormal(36.0, 5.6, 0.5), stats.truncnorm(-0.5, 0.5, loc=36.0, scale=5.6)),
        (UniformBand(0.05), stats.uniform(0.95, 0.1)),
    ],
)
def test_samples_follow_the_distribution(entry, reference):
    sample = entry.sample(np.random.default_rng(0), 100_000)
    assert sample.shape == (100_000,)
    low, high = entry.support
    assert low <= sample.min() < sample.max() <= high
    assert stats.kstest(sample, reference.cdf).pvalue > 0.01


def test_no_tolerance_means_no_scatter():
    band = UniformBand(0.0)
    assert band.support == (1.0, 1.0)
    assert np.all(band.sample(np.random.default_rng(0), 5) == 1.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: TruncatedNormal(np.nan, 1.0),
        lambda: TruncatedNormal(0.0, 0.0),
        lambda: TruncatedNormal(0.0, -1.0),
        lambda: TruncatedNormal(0.0, np.inf),
        lambda: TruncatedNormal(0.0, 1.0, 0.0),
        lambda: TruncatedNormal(0.0, 1.0, 11.0),
        lambda: TruncatedNormal("36", 1.0),
        lambda: UniformBand(-0.05),
        lambda: UniformBand(1.0),
        lambda: UniformBand(np.nan),
        lambda: UniformBand(True),
    ],
)
def test_parameters_out_of_range_are_refused(make):
    with pytest.raises(InvalidInput):
        make()
