"""Stiffness and damping: against SciPy, closed forms, and the truth of a virtual bench."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from experiments.paper.bench.rigs import COMPLETE_DRIVE, INPUT_BEARING, OUTPUT_BEARING, TorsionBench
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.identification import (
    NoLoadRun,
    TorsionLoop,
    bearing_damping,
    fit_line,
    hysteresis_width,
    loop_branches,
    lost_energy,
    mesh_damping,
    series,
    stiffness,
)
from pymoo_hdte.identification.damping import INPUT_SPEEDS, OUTPUT_SPEEDS
from pymoo_hdte.identification.noise import noise_of
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

K = 2.583e4
QUIET = TorsionBench(torque_noise=0.0, torsion_noise=0.0, torque_zero=0.0, torsion_zero=0.0)


def consistent(successes, trials, rate=0.95):
    """Whether a one-sided exact binomial test at 1 % keeps the hypothesis of at least this rate."""
    return stats.binomtest(int(successes), trials, rate, "less").pvalue >= 0.01


def inside(interval, value):
    return interval[0] <= value <= interval[1]


def test_a_line_is_scipy_s(rng):
    x = rng.uniform(-3.0, 5.0, 12)
    y = 2.0 - 0.7 * x + rng.standard_normal(12)
    ours, theirs = fit_line(x, y), stats.linregress(x, y)
    assert ours.slope == pytest.approx(theirs.slope, rel=1e-12)
    assert ours.intercept == pytest.approx(theirs.intercept, rel=1e-12)
    assert ours.slope_error == pytest.approx(theirs.stderr, rel=1e-12)
    assert ours.intercept_error == pytest.approx(theirs.intercept_stderr, rel=1e-12)
    half = stats.t.ppf(0.95, 10) * theirs.stderr
    assert ours.slope_interval(0.9) == pytest.approx((ours.slope - half, ours.slope + half))


def test_damping_is_scipy_s_slope(rng):
    bearing = INPUT_BEARING.record(1.7e-4, rng)
    complete = COMPLETE_DRIVE.record(6.2e-4, rng)
    single = stats.linregress(bearing.speed, bearing.torque)
    assert bearing_damping(bearing).slope == pytest.approx(single.slope, rel=1e-12)
    difference = stats.linregress(bearing.speed, complete.torque - bearing.torque)
    fit = mesh_damping(bearing, complete)
    assert fit.slope == pytest.approx(difference.slope, rel=1e-12)
    assert fit.slope_error == pytest.approx(difference.stderr, rel=1e-12)
    total = bearing_damping(complete).slope
    assert bearing_damping(bearing).slope + fit.slope == pytest.approx(total, rel=1e-12)


def test_speeds_are_those_of_section_3():
    np.testing.assert_allclose(INPUT_SPEEDS / REVOLUTION_PER_MINUTE, np.arange(200, 2001, 200))
    np.testing.assert_allclose(OUTPUT_SPEEDS / REVOLUTION_PER_MINUTE, np.arange(2, 21, 2))


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("curvature", [0.0, 5.0])
def test_noise_is_judged_in_spite_of_curvature(correlation, curvature, rng):
    n = 40_000
    noise = rng.standard_normal(n)
    for now in range(1, n):
        noise[now] = correlation * noise[now - 1] + (1 - correlation**2) ** 0.5 * noise[now]
    found = noise_of(noise + curvature * np.sin(np.linspace(0.0, 20.0, n)))
    assert found.std == pytest.approx(1.0, rel=0.1)
    assert found.correlation == pytest.approx(correlation, abs=0.03)


def test_constant_signals_have_no_noise():
    assert noise_of(np.ones(10)).std == 0.0


@pytest.mark.parametrize("samples", [4, 7, 200])
def test_branches_of_a_loop_without_noise(samples):
    branches = quiet_loop(samples).branches
    stops = [branches[name].stop for name in ("a1", "a2", "a3", "a4")]
    assert stops == [samples + 1, 2 * samples, 3 * samples + 1, 4 * samples + 1]
    assert branches["a1"].start == 0


def quiet_loop(samples, **settings):
    bench = replace(QUIET, samples_per_branch=samples, **settings)
    return bench.record(K, np.random.default_rng(0))


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.5])
def test_branches_are_found_in_noise_within_what_it_hides(noise, rng):
    step = 40.0 / 200
    for _ in range(50):
        loop = TorsionBench(torque_noise=noise).record(K, rng)
        cuts = np.array([loop.branches[name].stop for name in ("a1", "a2", "a3")])
        error = np.abs(cuts - [201, 400, 601])
        assert error.max() <= 2 + 5 * noise / step


def test_branches_are_found_with_dwells_and_uneven_sampling(rng):
    corners = np.array([0.0, 0.0, 40.0, 40.0, 0.0, 0.0, -40.0, -40.0, 0.0, 0.0])
    at = np.sort(rng.uniform(0.0, 9.0, 900))
    torque = np.interp(at, np.arange(10.0), corners) + rng.normal(0.0, 0.02, 900)
    torque[[0, -1]] = 0.0
    branches = loop_branches(torque)
    cuts = [at[branches[name].stop - 1] for name in ("a1", "a2", "a3")]
    assert 2.0 < cuts[0] < 3.0
    assert 4.0 - 0.05 < cuts[1] < 5.0 + 0.05
    assert 6.0 < cuts[2] < 7.0


TRIANGLE = np.interp(np.arange(41) / 10, np.arange(5.0), [0.0, 40.0, 0.0, -40.0, 0.0])


@pytest.mark.parametrize(
    ("torque", "message"),
    [
        (TRIANGLE[:11], "number of samples is 11, allowed: at least 12"),
        (TRIANGLE[:15], "range of torque .* loads and unloads in both directions"),
        (np.concatenate([TRIANGLE[:11], np.full(10, 40.0)]), "range of torque"),
        (TRIANGLE[:31], r"torque\[30\] is -40.0, allowed: unloaded"),
        (TRIANGLE[5:], r"torque\[0\] is 20.0, allowed: a start within 4 N.m of zero"),
        (-TRIANGLE, "sample of the lowest torque is 10, .*load forward first"),
        (np.concatenate([TRIANGLE, TRIANGLE]), r"setback at torque\[\d+\] .* one loop: branch a1"),
        (np.interp(np.arange(13), [0, 1, 6, 9, 12], [0, 40, 0, -40, 0]), "samples on branch a1"),
        (np.where(TRIANGLE == 20.0, np.nan, TRIANGLE), r"torque\[5\] is nan"),
        (np.zeros(20), "range of torque"),
    ],
)
def test_what_is_no_loop_is_named(torque, message):
    with pytest.raises(InvalidInput, match=message):
        loop_branches(torque)


def test_without_friction_the_loop_is_the_spring():
    loop = quiet_loop(50, friction_torque=0.0)
    np.testing.assert_allclose(loop.torque, K * loop.torsion, atol=1e-9)
    assert stiffness(loop).slope == pytest.approx(K, rel=1e-12)
    assert hysteresis_width(loop) == pytest.approx(0.0, abs=1e-12)
    assert lost_energy(loop) == pytest.approx(0.0, abs=1e-12)


def test_sharp_friction_gives_the_parallelogram_s_width_and_energy():
    friction, peak = 1.5, 40.0
    loop = quiet_loop(4000, friction_angle=0.02 * ARCSEC)
    assert hysteresis_width(loop) == pytest.approx(2 * friction / K, rel=2e-3)
    # Path 0 -> + -> - -> end against the bound; the spring returns all but its last stretch.
    path = (4 * peak - 5 * friction) / K
    spring = friction**2 / K / 2
    assert lost_energy(loop) == pytest.approx(friction * path + spring, rel=2e-3)


def test_friction_obeys_dahl_s_equation():
    loop = quiet_loop(2000)
    friction = loop.torque - K * loop.torsion
    for name, direction in (("a1", 1), ("a2", -1), ("a3", -1), ("a4", 1)):
        samples = slice(loop.branches[name].start + 2, loop.branches[name].stop - 2)
        angle, z = loop.torsion[samples], friction[samples]
        rate = np.gradient(z, angle)[1:-1]
        expected = (QUIET.friction_torque - direction * z[1:-1]) / QUIET.friction_angle
        np.testing.assert_allclose(
            rate, expected, atol=0.01 * QUIET.friction_torque / QUIET.friction_angle
        )


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.7])
def test_stiffness_intervals_cover_the_loading_slope_on_200_campaigns(correlation, rng):
    bench = replace(TorsionBench(), noise_correlation=correlation)
    truth = bench.loading_stiffness(K)
    fits = [stiffness(bench.record(K, rng)) for _ in range(200)]
    assert consistent(sum(inside(fit.slope_interval(), truth) for fit in fits), 200)


def test_taking_correlated_noise_for_independent_would_be_caught(rng):
    bench = replace(TorsionBench(), noise_correlation=0.7, friction_torque=0.0)
    covered = 0
    for _ in range(200):
        loop = bench.record(K, rng)
        a1 = loop.branches["a1"]
        covered += inside(fit_line(loop.torsion[a1], loop.torque[a1]).slope_interval(), K)
    assert not consistent(covered, 200)


def test_damping_intervals_cover_the_truth_on_200_campaigns(rng):
    covered = np.zeros((3, 2))
    for _ in range(200):
        bearing, complete = INPUT_BEARING.record(1.7e-4, rng), COMPLETE_DRIVE.record(6.2e-4, rng)
        fits = (
            (bearing_damping(bearing), 1.7e-4, 0.012 + 1e-3),
            (mesh_damping(bearing, complete), 4.5e-4, 0.045 - 0.012),
            (bearing_damping(OUTPUT_BEARING.record(5e-4, rng)), 5e-4, 2e-3 + 1e-4),
        )
        for row, (fit, slope, intercept) in zip(covered, fits, strict=True):
            row += inside(fit.slope_interval(), slope), inside(fit.intercept_interval(), intercept)
    assert all(consistent(count, 200) for count in covered.flat)


def test_a_series_separates_prototypes_from_repeats(rng):
    effects, noise = rng.normal(5.0, 0.5, 400), rng.normal(0.0, 0.2, (400, 3))
    values = {(p, r): effects[p] + noise[p, r] for p in range(400) for r in range(3)}
    found = series(values)
    np.testing.assert_allclose(found.prototypes, effects + noise.mean(axis=1), rtol=1e-14)
    assert found.between.mean == pytest.approx(found.prototypes.mean(), rel=1e-14)
    assert found.between.std == pytest.approx(found.prototypes.std(ddof=1), rel=1e-12)
    assert found.between.cv_percent == pytest.approx(100 * found.between.std / found.between.mean)
    assert found.repeatability == pytest.approx(noise.std(axis=1, ddof=1).mean(), rel=0.15)
    within = stats.f_oneway(*[[values[p, r] for r in range(3)] for p in range(400)]).statistic
    ratio = 3 * found.between.std**2 / found.repeatability**2
    assert ratio == pytest.approx(within, rel=1e-10)


def test_series_take_unequal_repeats_and_none():
    assert series({(1, 1): 1.0, (1, 2): 3.0, (2, 1): 5.0}).prototypes.tolist() == [2.0, 5.0]
    assert np.isnan(series({(1, 1): 1.0, (2, 1): 5.0}).repeatability)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fit_line([1.0, 2.0], [1.0, 2.0]), "number of points is 2, allowed: at least 3"),
        (lambda: fit_line([1.0] * 3, [1.0, 2.0, 3.0]), "x is 1.0, .*no slope"),
        (lambda: fit_line([1.0, 2.0, 3.0], [1.0, 2.0]), "shape of y"),
        (lambda: fit_line([1, 2, 3], [1, 2, 4]).slope_interval(1.0), "level is 1.0"),
        (lambda: NoLoadRun([1.0, 2.0], [0.1, 0.2]), "number of speeds is 2"),
        (lambda: NoLoadRun([1.0, 3.0, 2.0], [0.1] * 3), r"speed\[2\] is 2.0, .*increasing"),
        (lambda: NoLoadRun([1.0, 2.0, 3.0], [0.1, np.nan, 0.2]), r"torque\[1\] is nan"),
        (lambda: TorsionLoop(TRIANGLE, TRIANGLE[1:]), "shape of torsion"),
        (lambda: series({(1, 1): 1.0}), "number of prototypes is 1, allowed: at least 2"),
        (lambda: series({(1, 1): np.inf, (2, 1): 1.0}), "value of prototype 1, repeat 1"),
        (lambda: noise_of([1.0, 2.0, 3.0]), "number of samples is 3"),
        (lambda: TorsionBench(noise_correlation=1.0), "noise_correlation is 1.0"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidInput, match=message):
        call()


def test_a_loop_without_twist_is_refused():
    torque = 9.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, 40))
    with pytest.raises(InvalidInput, match="not recorded"):
        TorsionLoop(torque, np.full(40, 0.1))


def test_a_loop_that_turns_the_wrong_way_is_refused_with_the_likely_cause():
    loop = TorsionBench().record(K, np.random.default_rng(3))
    with pytest.raises(InvalidInput, match=r"slope of torsion over torque is -.*opposite senses"):
        TorsionLoop(loop.torque, -loop.torsion)
    # Run through in time backwards, and turned about the origin, it is the same loop giving work.
    with pytest.raises(InvalidInput, match=r"work of the loop.* is -0\..*rows stand in reverse"):
        TorsionLoop(-loop.torque[::-1], -loop.torsion[::-1])
    elastic = quiet_loop(200, friction_torque=0.0)
    assert lost_energy(TorsionLoop(elastic.torque, elastic.torque / K)) == pytest.approx(
        0.0, abs=1e-9
    )


def test_assemblies_at_different_speeds_are_refused(rng):
    bearing = INPUT_BEARING.record(1.7e-4, rng)
    slower = replace(COMPLETE_DRIVE, speeds=INPUT_SPEEDS * np.r_[np.ones(4), 0.98, np.ones(5)])
    with pytest.raises(InvalidInput, match=r"speed\[4\] of the complete drive .* within 1 %"):
        mesh_damping(bearing, slower.record(6.2e-4, rng))
    shorter = replace(COMPLETE_DRIVE, speeds=INPUT_SPEEDS[:5])
    with pytest.raises(InvalidInput, match="number of speeds of the complete drive is 5"):
        mesh_damping(bearing, shorter.record(6.2e-4, rng))


def test_records_are_reproducible_and_leave_their_input_alone():
    torque = TRIANGLE.copy()
    loop = TorsionLoop(torque, torque / K)
    loop.torque[0] = 1.0
    assert torque[0] == 0.0
    first, second = (TorsionBench().record(K, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first.torsion, second.torsion)
