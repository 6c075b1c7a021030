"""The marginal likelihood against closed forms, quadrature and simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import binom, kstest, multivariate_normal, ncx2, norm

from pymoo_hdte.discrepancy._selection.process import TERMS, sine_of
from pymoo_hdte.discrepancy._selection.score import (
    VISIBLE,
    Free,
    Integral,
    Linearised,
    Sized,
    _chance_beyond,
    score,
    score_with_outside,
)

N = 12


def free(columns, lower=None, upper=None, shoulder=None, mean=None, deviation=None):
    """Return unknowns whose priors are given where they are not None."""

    def of(values, default):
        return np.broadcast_to(default if values is None else values, columns.shape[1:]).astype(
            float
        )

    return Free(
        columns,
        of(lower, -np.inf),
        of(upper, np.inf),
        of(shoulder, 1e-6),
        of(mean, 0.0),
        of(deviation, np.inf),
    )


def sized(columns, least, most, at=None, positive=False, cut=False):
    m = columns.shape[1]
    at = np.zeros(m) if at is None else at
    return Sized("sized", columns, least, most, at, np.full(m, positive), cut)


def hypothesis(residuals, unknowns, *parts, noise=0.0):
    return Linearised(residuals, np.zeros(len(residuals), int), unknowns, parts, noise)


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def flat(value, lower, upper, shoulder):
    """Return a density that is flat within bounds and falls as a Gaussian outside."""
    beyond = max(lower - value, value - upper, 0.0) / shoulder
    return np.exp(-0.5 * beyond**2) / (upper - lower + shoulder * np.sqrt(2.0 * np.pi))


def test_gaussian_priors_give_a_multivariate_normal(rng):
    residuals, columns = 1.5 * rng.normal(size=N), rng.normal(size=(N, 3)) * [1.0, 10.0, 0.1]
    unknowns = free(columns, mean=[0.3, -0.1, 1.0], deviation=[1.0, 0.5, 3.0])
    forms, at = rng.normal(size=(N, 4)), np.array([0.2, 0.0, 0.0, -1.0])
    covariance = np.eye(N) + columns @ np.diag(unknowns.deviation**2) @ columns.T
    covariance += 0.7**2 * forms @ forms.T
    wanted = multivariate_normal.logpdf(
        residuals - forms @ at, -columns @ unknowns.mean, covariance
    )
    part = sized(forms, 0.7, 0.7, at)
    assert score(hypothesis(residuals, unknowns, part)).ln == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(("lower", "upper"), [(-0.5, 0.2), (3.0, 9.0), (-20.0, 30.0)])
def test_bounds_with_shoulders_are_integrated(rng, lower, upper):
    """Also where the data push the value far beyond a bound."""
    residuals, column = rng.normal(size=N), rng.normal(size=(N, 1))

    def density(value):
        return np.exp(np.sum(norm.logpdf(residuals + column[:, 0] * value))) * flat(
            value, lower, upper, 0.07
        )

    points = [value for value in (lower, upper) if abs(value) < 10.0]
    begin, end = max(lower - 1.0, -5.0), min(upper + 1.0, 10.0)
    wanted = np.log(quad(density, begin, end, points=points, limit=200)[0])
    unknowns = free(column, [lower], [upper], [0.07])
    assert score(hypothesis(residuals, unknowns)).ln == pytest.approx(wanted, abs=1e-3)


def test_correlated_bounds_are_integrated_together(rng):
    residuals, first = rng.normal(size=N), rng.normal(size=N)
    columns = np.column_stack([first, 0.9 * first + 0.3 * rng.normal(size=N)])
    lower, upper = np.array([-0.2, 0.1]), np.array([0.3, 0.6])
    values = np.linspace(-0.7, 1.2, 200)
    grid = np.stack(np.meshgrid(values, values, indexing="ij"), axis=-1).reshape(-1, 2)
    likelihood = np.exp(np.sum(norm.logpdf(residuals + grid @ columns.T), axis=1))
    prior = [flat(a, lower[0], upper[0], 0.05) * flat(b, lower[1], upper[1], 0.05) for a, b in grid]
    wanted = np.log(np.sum(likelihood * prior) * (values[1] - values[0]) ** 2)
    found = score(hypothesis(residuals, free(columns, lower, upper, [0.05, 0.05]))).ln
    assert found == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize("positive", [False, True])
def test_an_unknown_scale_is_integrated(rng, positive):
    residuals, column = rng.normal(size=N), rng.normal(size=(N, 1))
    nuisance, at = rng.normal(size=(N, 1)), np.array([0.4])
    beside = np.eye(N) + nuisance @ nuisance.T
    values = np.linspace(0.0 if positive else -6.0, 6.0, 2401)
    likelihood = multivariate_normal.pdf(
        residuals + np.outer(values - at[0], column[:, 0]), np.zeros(N), beside
    )
    logs = np.linspace(np.log(1e-2), np.log(30.0), 300)
    factor = 2.0 if positive else 1.0
    of_scale = [
        np.trapezoid(likelihood * factor * norm.pdf(values, 0.0, np.exp(log)), values)
        for log in logs
    ]
    wanted = np.log(np.trapezoid(of_scale, logs) / (logs[-1] - logs[0]))
    part = sized(column, 1e-2, 30.0, at, positive)
    found = score(hypothesis(residuals, free(nuisance, deviation=[1.0]), part)).ln
    # Expectation propagation stands for the sign at one scale, the most probable one.
    assert found == pytest.approx(wanted, abs=0.15 if positive else 0.01)


def test_two_scales_are_integrated(rng):
    residuals, first, second = (rng.normal(size=shape) for shape in ((N,), (N, 4), (N, 2)))
    logs = np.linspace(np.log(1e-2), np.log(30.0), 60)
    ln = np.array(
        [
            [
                multivariate_normal.logpdf(
                    residuals,
                    np.zeros(N),
                    np.eye(N) + np.exp(2 * a) * first @ first.T + np.exp(2 * b) * second @ second.T,
                )
                for b in logs
            ]
            for a in logs
        ]
    )
    whole = np.trapezoid(np.trapezoid(np.exp(ln), logs), logs) / (logs[-1] - logs[0]) ** 2
    parts = sized(first, 1e-2, 30.0), sized(second, 1e-2, 30.0)
    found = score(hypothesis(residuals, free(np.empty((N, 0))), *parts)).ln
    assert found == pytest.approx(np.log(whole), abs=0.05)


def test_factors_of_the_noise_are_integrated(rng):
    count, spread = 60, np.log(2.0)
    residuals, columns = 2.0 * rng.normal(size=count), rng.normal(size=(count, 2))
    logs = np.linspace(-0.5, 1.8, 400)
    ln = [
        multivariate_normal.logpdf(
            residuals, np.zeros(count), np.exp(2 * log) * np.eye(count) + columns @ columns.T
        )
        + norm.logpdf(log, 0.0, spread)
        for log in logs
    ]
    wanted = np.log(np.trapezoid(np.exp(ln - np.max(ln)), logs)) + np.max(ln)
    unknowns = free(columns, deviation=[1.0, 1.0])
    assert score(hypothesis(residuals, unknowns, noise=spread)).ln == pytest.approx(
        wanted, abs=0.02
    )


def test_units_of_unknowns_do_not_matter(rng):
    residuals, columns = rng.normal(size=N), rng.normal(size=(N, 2))
    lower, upper, width = np.array([-1.0, -2.0]), np.array([0.5, 1.0]), np.array([0.1, 0.2])
    part = rng.normal(size=(N, 1))
    found = [
        score(
            hypothesis(
                residuals,
                free(columns / unit, lower * unit, upper * unit, width * unit),
                sized(part / unit, 0.0, 50.0 * unit, positive=True, cut=True),
            )
        ).ln
        + 2.0 * np.log(1.0)
        for unit in (1.0, 1e6, 1e-6)
    ]
    assert found == pytest.approx([found[0]] * 3, abs=1e-6)


def test_what_would_be_invisible_is_told(rng):
    column = rng.normal(size=(N, 1))
    scale = np.sqrt(VISIBLE) / np.linalg.norm(column)
    for most, invisible in ((0.9 * scale, True), (1.1 * scale, False)):
        part = sized(column, 0.0, most, cut=True)
        found = score(hypothesis(rng.normal(size=N), free(np.empty((N, 0))), part))
        assert bool(found.invisible) is invisible


def test_twice_as_many_functions_of_a_form_change_no_odds(rng):
    """The spectrum of a smooth process ends, so that further functions have no size left."""
    places = np.linspace(-1.0, 1.0, 200)
    law = 300.0 * np.ones(200)
    sines = np.column_stack([sine_of(k, places)[0] for k in range(1, 2 * TERMS + 1)])
    for error in (0.0, 0.02, 0.2):
        left = law * error * np.sin(3.0 * places) + rng.normal(size=200)
        lns = [
            score(
                hypothesis(
                    left,
                    free(law[:, None] / 300.0, [-50.0], [50.0], [5.0]),
                    sized(law[:, None] * sines[:, :terms], 1e-3, 0.3),
                )
            ).ln
            for terms in (TERMS, 2 * TERMS)
        ]
        assert abs(lns[1] - lns[0]) < 1.0


def test_something_outside_is_found_where_it_is(rng):
    places = [
        Sized(
            f"place {k}", np.eye(40)[:, 4 * k : 4 * k + 4], 1.0, 100.0, np.zeros(4), np.zeros(4) > 0
        )
        for k in range(10)
    ]
    residuals = rng.normal(size=40)
    nothing = hypothesis(residuals, free(np.empty((40, 0))))
    without, none = score_with_outside(nothing, places)
    assert none == []
    assert without.ln < score(nothing).ln
    residuals[12:16] += [15.0, -20.0, 10.0, 12.0]
    something = hypothesis(residuals, free(np.empty((40, 0))))
    found, where = score_with_outside(something, places)
    assert where == ["place 3"]
    assert found.ln > score(something).ln + 100.0


def test_a_size_is_no_larger_than_it_may_be(rng):
    """A softening beyond 1 was taken for one of .95, which was likelier than a gap then."""
    column, most = np.full((N, 1), 4.0), 1.0
    residuals = rng.normal(size=N) - 1.3 * column[:, 0]
    part = replace(sized(column, 0.1, most, positive=True), of_effect=True)
    size = np.linspace(0.0, most, 4001)
    scales = np.exp(np.linspace(np.log(0.1), np.log(most), 200))
    prior = np.mean([2.0 * norm.pdf(size, 0.0, s) for s in scales], axis=0)
    ln = -0.5 * np.sum((residuals[:, None] + column * size) ** 2, axis=0)
    ln -= 0.5 * N * np.log(2.0 * np.pi)
    wanted = np.log(np.trapezoid(np.exp(ln - ln.max()) * prior, size)) + ln.max()
    found = score(hypothesis(residuals, free(np.empty((N, 0))), part)).ln
    assert found == pytest.approx(wanted, abs=0.5)


def test_what_another_size_of_an_effect_can_do_is_not_visible(rng):
    """Friction that falls a little from the first to the last speed, beside its level."""
    level = np.full((N, 1), 10.0)
    falling = level * np.linspace(1.0, 0.9, N)[:, None]
    fall = sized(falling, 0.0, 50.0, cut=True)
    beside = replace(sized(level, 0.01, 50.0), of_effect=True)
    nothing = free(np.empty((N, 0)))
    alone, both = (
        Integral(hypothesis(rng.normal(size=N), nothing, fall, *parts)).least[0]
        for parts in ((), (beside,))
    )
    visible = np.sqrt(VISIBLE) / np.linalg.norm(falling)
    assert alone == pytest.approx(visible)
    assert both == pytest.approx(
        np.sqrt(VISIBLE) / np.linalg.norm(falling - falling.mean()), rel=0.05
    )


@pytest.mark.parametrize(("error", "another"), [(0.1, False), (2.0, True)])
def test_a_law_that_errs_by_more_than_its_form_may_is_another_one(error, another):
    law = np.full(40, 50.0)
    wrong = law * np.sin(2.0 * np.pi * np.arange(40) / 40.0)
    form = replace(sized(wrong[:, None], 1e-3, 0.3), of_form=True)
    noise = np.random.default_rng(4).normal(size=40)
    with_law = hypothesis(noise + error * wrong, free(law[:, None]), form)
    beyond, places = score_with_outside(with_law, with_law.other_laws)
    assert (beyond.ln > score(with_law).ln) == another
    assert bool(places) == another


def test_said_probabilities_are_the_shares_that_are_right():
    """With data from the prior: effects along two directions, as likely as nothing, of any size."""
    rng = np.random.default_rng(20)
    first = rng.normal(size=(20, 1))
    directions = first, 0.8 * first + 0.6 * rng.normal(size=(20, 1))
    base = rng.normal(size=(20, 1))
    most, unknowns = 50.0, free(base, [-1.0], [1.0], [0.1])
    empty = [hypothesis(np.zeros(20), unknowns, sized(d, 0.0, most, cut=True)) for d in directions]
    least = [Integral(item).least[0] for item in empty]
    said, right = [], []
    for _ in range(120):
        truth = int(rng.integers(3))
        residuals = rng.normal(size=20) - base[:, 0] * rng.uniform(-1.0, 1.0)
        if truth:
            size = 0.0
            while abs(size) < least[truth - 1]:
                scale = np.exp(rng.uniform(np.log(least[truth - 1]), np.log(most)))
                size = rng.normal() * scale
            residuals = residuals - size * directions[truth - 1][:, 0]
        lns = [score(hypothesis(residuals, unknowns)).ln]
        lns += [
            score(hypothesis(residuals, unknowns, sized(d, 0.0, most, cut=True))).ln
            for d in directions
        ]
        shares = np.exp(lns - np.max(lns))
        shares /= shares.sum()
        said += shares.tolist()
        right += [k == truth for k in range(3)]
    said, right = np.array(said), np.array(right)
    for low, high in ((0.0, 0.05), (0.05, 0.3), (0.3, 0.7), (0.7, 0.95), (0.95, 1.0)):
        bin_ = (said >= low) & (said <= high)
        expected, count = said[bin_].mean(), int(bin_.sum())
        chances = (
            binom.cdf(right[bin_].sum(), count, expected),
            binom.sf(right[bin_].sum() - 1, count, expected),
        )
        assert min(chances) > 0.001, (low, high, expected, right[bin_].mean(), count)


def test_records_kept_out_count_by_their_predictive_density(rng):
    """The likelihood of all records over that of those fitted, with the same unknown form."""
    base, form = rng.normal(size=(20, 2)), rng.normal(size=(20, 3))
    residuals = rng.normal(size=20)
    covariance = np.eye(20) + base @ base.T + 0.5**2 * form @ form.T
    fitted, kept_out = slice(0, 14), slice(14, 20)
    gain = covariance[kept_out, fitted] @ np.linalg.inv(covariance[fitted, fitted])
    wanted = multivariate_normal.logpdf(
        residuals[kept_out],
        gain @ residuals[fitted],
        covariance[kept_out, kept_out] - gain @ covariance[fitted, kept_out],
    )

    def ln(rows):
        unknowns = free(base[rows], deviation=[1.0, 1.0])
        return score(hypothesis(residuals[rows], unknowns, sized(form[rows], 0.5, 0.5))).ln

    assert ln(slice(None)) - ln(fitted) == pytest.approx(wanted, abs=1e-9)


def test_a_chance_beyond_is_that_of_the_residuals(rng):
    """Without unknowns the chance of a record is that of its chi-square, even from 0 to 1."""
    chances = []
    for _ in range(200):
        found = score(hypothesis(rng.normal(size=30), free(np.empty((30, 0)))))
        chances.append(found.worst_chance([np.arange(30)]))
    assert kstest(chances, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("m", [2, 7, 60])
def test_a_chance_beyond_a_distance_is_known_however_far_that_is(m):
    """A ripple of 58,000 times the noise ended in an overflow of the series."""
    sizes = np.logspace(-12.0, 12.0, 481)
    chances = np.array([_chance_beyond(cut, sizes, np.ones(481), m, False) for cut in sizes])
    assert np.all((chances >= 0.0) & (chances <= 1.0))
    # Between these the series and the plane meet, where chances of 1e-150 become 1e-110.
    assert np.all(np.diff(chances[::10, ::10], axis=0) <= 0.0)
    assert np.all(np.diff(chances, axis=0) <= 1e-12)
    assert np.all(np.diff(chances, axis=1) >= -1e-12)
    for centre, beyond in ((90.0, 2.0), (110.0, 2.0), (110.0, -2.0), (1.0, 3.0), (0.0, 40.0)):
        (chance,) = _chance_beyond(centre + beyond, np.array([centre]), np.ones(1), m, False)
        wanted = ncx2.sf((centre + beyond) ** 2, m, max(centre, 1e-6) ** 2)
        assert chance == pytest.approx(wanted, rel=0.02, abs=1e-99)


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("size", [0.0, 1.0, 8.0])
def test_gains_are_those_of_the_whole_integral(rng, cut, size):
    """Of one more quantity beside all that there is, which is exact where nothing has bounds."""
    unknowns = free(rng.normal(size=(N, 2)), mean=[0.0, 0.0], deviation=[1.0, 3.0])
    # What is visible is so beyond unknowns, whatever form laws have.
    present = () if cut else (sized(rng.normal(size=(N, 3)), 0.5, 0.5),)
    column = rng.normal(size=(N, 1))
    further = sized(column, 0.1, 20.0, cut=cut)
    residuals = rng.normal(size=N) - size * column[:, 0]
    without = hypothesis(residuals, unknowns, *present)
    integral = Integral(without)
    before = integral.score().ln
    wanted = score(hypothesis(residuals, unknowns, *present, further)).ln - before
    (gain,) = integral.gains([further])
    assert gain == pytest.approx(wanted, abs=0.1)


def test_a_gain_counts_the_errors_of_records_that_are_left(rng):
    """Each record may err by its own: that takes what an effect explains, and returns it."""
    count, records = 40, 10
    of_records = np.eye(count)[:, :records]
    column = of_records @ rng.normal(size=(records, 1))
    residuals = rng.normal(size=count) - 25.0 * column[:, 0]
    unknowns = free(np.ones((count, 1)), mean=0.0, deviation=1.0)
    errors = replace(sized(of_records, 0.03, 30.0), of_records=True)
    further = sized(column, 0.1, 100.0)
    integral = Integral(hypothesis(residuals, unknowns, errors))
    before = integral.score().ln
    wanted = score(hypothesis(residuals, unknowns, errors, further)).ln - before
    assert wanted > 10.0
    assert integral.gains([further])[0] < 0.5 * wanted
    assert integral.gains([further], renewed=True)[0] == pytest.approx(wanted, rel=0.1)


def test_a_gain_counts_the_noise_that_is_left(rng):
    """Unknown noise takes what an effect explains, and returns it."""
    count = 100
    column = rng.normal(size=(count, 1))
    residuals = 0.3 * rng.normal(size=count) - 40.0 * column[:, 0]
    unknowns = free(np.ones((count, 1)), mean=0.0, deviation=1.0)
    further = sized(column, 0.1, 100.0)
    noise = float(np.log(10.0))
    integral = Integral(hypothesis(residuals, unknowns, noise=noise))
    before = integral.score().ln
    wanted = score(hypothesis(residuals, unknowns, further, noise=noise)).ln - before
    assert integral.gains([further])[0] < 0.5 * wanted
    assert integral.gains([further], renewed=True)[0] == pytest.approx(wanted, rel=0.1)
