"""The torsion sweep: closed forms of the quasi-static drive, and points with their covariance."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from night import others_at_night
from places import SHARED
from scipy.integrate import trapezoid
from scipy.stats import chi2

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import Rig, TorsionRecord, read_campaign
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import torsion_points
from pymoo_hdte.drive import mean_torsion, preset, quasi_static_torsion
from pymoo_hdte.effects import Sizes, effect_named
from pymoo_hdte.effects.friction import CoulombFriction, StribeckFriction
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup
from pymoo_hdte.units import ARCSEC

K = 2.583e4
RIG = Rig(0.02, 0.5, 0.7 * ARCSEC, 0.003, 0.2, 0.3 * ARCSEC, 0.204 * ARCSEC)
LOOP = np.interp(np.arange(181.0), [0, 36, 108, 180], [0.0, 40.0, -40.0, 40.0])
LAWS = [
    (),
    (("mesh", HardeningStiffness(2e9)),),
    (("mesh", SoftWindup(0.3, 2e-4)),),
    (("mesh", HardeningStiffness(0.0, 0.3, 5e-4, 6.0)),),
    (("mesh", DeadZone(5.0 * ARCSEC)),),
    (("mesh", MaxwellSlip(1.5, 3e-4)),),
    (("output", CoulombFriction(4.0)),),
    (
        ("mesh", SoftWindup(0.3, 2e-4)),
        ("mesh", MaxwellSlip(1.5, 3e-4)),
        ("output", StribeckFriction(0.5, 0.5, 0.1)),
    ),
]


def names_of(laws):
    return "+".join(type(law).__name__ for _, law in laws) or "linear"


every_law = pytest.mark.parametrize("laws", LAWS, ids=names_of)


def drive(*laws, stiffness=(K,)):
    model = preset("published")
    coefficients = model.coefficients(np.repeat(model.nominal[None], len(stiffness), axis=0))
    return replace(coefficients, stiffness=np.array(stiffness), laws=laws)


TIME = np.arange(1800) / 10.0
STEADY = np.interp(TIME, [0.0, 36.0, 108.0, 180.0], [0.0, 40.0, -40.0, 40.0])
BOWED = STEADY + 0.4 * np.sin(np.pi * TIME / 36.0) ** 2


def swept(laws, rng, torque=STEADY, rig=RIG, constant=3e-4):
    """A noisy sweep of three minutes, row by row."""
    rows = len(torque)
    torsion = quasi_static_torsion(drive(*laws), torque)[0]
    angle = -torsion - constant + rig.torsion_angle_noise * rng.standard_normal(rows)
    reading = torque + rig.output_torque_noise * rng.standard_normal(rows)
    time = np.arange(rows) * 180.0 / rows
    return TorsionRecord("sweep", "train", rows / 180.0, time, angle, reading)


def predicted(points, laws):
    return mean_torsion(drive(*laws), points.path)[0, points.intervals]


def test_without_laws_the_torsion_is_torque_over_stiffness():
    stiffness = np.array([0.9, 1.0, 1.1]) * K
    expected = LOOP / stiffness[:, None]
    assert quasi_static_torsion(drive(stiffness=stiffness), LOOP) == pytest.approx(expected)
    middles = (expected[:, 1:] + expected[:, :-1]) / 2.0
    assert mean_torsion(drive(stiffness=stiffness), LOOP) == pytest.approx(middles)


@given(st.floats(-40.0, 40.0), st.floats(1e8, 1e10))
def test_cubic_stiffness_has_the_root_of_cardano(torque, cubic):
    p, half = K / (3.0 * cubic), torque / (2.0 * cubic)
    spread = 2.0 * p**0.5 * np.sinh(np.arcsinh(half / p**1.5) / 3.0)
    found = quasi_static_torsion(drive(("mesh", HardeningStiffness(cubic))), np.array([torque]))
    assert found[0, 0] == pytest.approx(spread, rel=1e-9, abs=1e-16)


@given(st.floats(1e-2, 1.0) | st.floats(0.0, 1e-9))
def test_within_a_clearance_hardly_any_torque_is_a_long_way(torque):
    found = quasi_static_torsion(drive(("mesh", DeadZone(5.0 * ARCSEC))), np.array([torque]))
    beyond = (found[0, 0] - torque / K) / ARCSEC
    assert (4.0 if torque > 1e-3 else -1e-9) <= beyond <= 5.2


def test_softening_that_carries_no_more_torque_has_no_torsion():
    weak = drive(("mesh", HardeningStiffness(-K / (3.0 * 1e-6))))
    strongest = 2.0 / 3.0 * K * 1e-3
    found = quasi_static_torsion(weak, strongest * np.array([0.5, 0.9, 1.001]))[0]
    assert np.isfinite(found).tolist() == [True, True, False]
    assert found[1] < 1e-3


def test_hysteresis_follows_the_rules_of_masing():
    law = drive(("mesh", MaxwellSlip(1.5, 3e-4)))
    reversal = 30.0
    virgin = np.linspace(0.0, reversal, 61)[1:]
    falling = reversal - 2.0 * virgin
    once = quasi_static_torsion(law, np.concatenate([virgin, falling]))[0]
    first, second = once[:60], once[60:]
    assert second == pytest.approx(first[-1] - 2.0 * first, abs=1e-13)
    # A closed inner loop leaves no trace.
    inner = np.concatenate([virgin, [5.0, 20.0, 5.0], falling[falling < 5.0]])
    assert quasi_static_torsion(law, inner)[0, 63:] == pytest.approx(
        second[falling < 5.0], abs=1e-13
    )


def test_hysteresis_far_beyond_slip_lies_a_constant_force_off_the_spring():
    found = quasi_static_torsion(drive(("mesh", MaxwellSlip(1.5, 3e-4))), LOOP)[0]
    assert found[[36, 90, 108, 180]] == pytest.approx(
        np.array([38.5, -18.5, -38.5, 38.5]) / K, abs=1e-12
    )


def test_output_friction_is_a_play_of_the_torque():
    found = K * quasi_static_torsion(drive(("output", CoulombFriction(2.0))), LOOP)[0]
    expected = np.concatenate(
        [
            np.maximum(LOOP[:37] - 2.0, 0.0),
            np.minimum(LOOP[37:109] + 2.0, 38.0),
            np.maximum(LOOP[109:] - 2.0, -38.0),
        ]
    )
    assert found == pytest.approx(expected, abs=1e-9)


def test_at_rest_the_stribeck_excess_holds_too():
    stribeck = drive(("output", StribeckFriction(1.5, 0.5, 0.1)))
    coulomb = drive(("output", CoulombFriction(2.0)))
    assert np.array_equal(quasi_static_torsion(stribeck, LOOP), quasi_static_torsion(coulomb, LOOP))


@pytest.mark.parametrize("level", 8.0 * np.geomspace(0.05, 1.5, 9))
def test_some_start_of_dry_friction_shows_most_of_its_loop(level, rng):
    sizes = Sizes(force=8.0, residual=1.0, largest=40.0, speed=1.0, travel=1.0, swept=True)
    points = torsion_points(swept((("output", CoulombFriction(level)),), rng), RIG)
    linear = points.whitening @ predicted(points, ())

    def beyond_stiffness(angle):
        values = points.whitening @ angle
        return values - linear * (linear @ values) / (linear @ linear)

    left = beyond_stiffness(points.angle)
    removed = []
    for (start,) in effect_named("coulomb_friction").guesses(sizes)[0].begins:
        loop = beyond_stiffness(predicted(points, (("output", CoulombFriction(start)),)))
        removed.append((loop @ left) ** 2 / (loop @ loop) / (left @ left))
    assert max(removed) > 0.5


@pytest.mark.parametrize("level", [-1.0, 0.0])
def test_friction_that_is_none_moves_nothing(level):
    held = quasi_static_torsion(drive(("output", CoulombFriction(level))), LOOP)
    assert held == pytest.approx(LOOP[None] / K)


def test_the_clearance_adds_its_half_width_on_the_side_of_the_load():
    width = 5.0 * ARCSEC
    found = quasi_static_torsion(drive(("mesh", DeadZone(width))), LOOP[LOOP != 0.0])[0]
    loop = LOOP[LOOP != 0.0]
    assert found == pytest.approx(loop / K + width * np.sign(loop), abs=0.04 * width)


def test_a_clearance_that_varies_with_the_angle_counts_by_its_mean():
    varying = drive(("mesh", PeriodicClearance(2.0, 0.3, 5.0 * ARCSEC, 4.0 * ARCSEC)))
    constant = drive(("mesh", DeadZone(5.0 * ARCSEC)))
    assert np.array_equal(quasi_static_torsion(varying, LOOP), quasi_static_torsion(constant, LOOP))


def test_the_loop_loses_what_friction_takes():
    """Over a closed loop, 4 F times the way between the turning points goes to dry friction."""
    coefficients = drive(("output", CoulombFriction(2.0)))
    fine = np.interp(np.arange(2160.0), [0, 432, 1296, 2159], [0.0, 40.0, -40.0, 40.0])
    torsion = quasi_static_torsion(coefficients, fine)[0, 432:]
    lost = trapezoid(fine[432:], torsion)
    assert lost == pytest.approx(2.0 * 2.0 * np.ptp(torsion), rel=1e-4)


@every_law
def test_what_the_torsion_carries_is_the_load(laws):
    """Without output friction the mesh torque, computed along the whole path, is the load."""
    mesh = [law for port, law in laws if port == "mesh"]
    coefficients = drive(*(("mesh", law) for law in mesh), stiffness=(0.9 * K, K))
    torsion = quasi_static_torsion(coefficients, LOOP)
    zero = np.zeros_like(torsion)
    state = PortState(torsion, zero, lambda order: zero, coefficients.stiffness[:, None])
    carried = coefficients.stiffness[:, None] * torsion
    carried = carried + sum(law.respond(state).torque for law in mesh)
    np.testing.assert_allclose(carried, np.tile(LOOP, (2, 1)), atol=1e-8)


@every_law
def test_means_are_those_of_a_fine_path(laws):
    coarse = LOOP[::6]
    fine = np.interp(np.arange(0.0, 30.0, 1.0 / 400.0), np.arange(31.0), coarse)
    path = quasi_static_torsion(drive(*laws), np.append(fine, coarse[-1]))[0]
    blocks = np.array([path[i : i + 401] for i in range(0, 12000, 400)])
    expected = trapezoid(blocks, axis=1) / 400.0
    assert mean_torsion(drive(*laws), coarse)[0] == pytest.approx(expected, abs=0.04 * ARCSEC)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-40.0, 40.0), min_size=2, max_size=8),
    st.sampled_from(LAWS),
)
# A move so small that its product with the next is zero.
@example([-6.0, 0.0, 5e-324, -1.0], LAWS[5])
def test_the_path_passes_the_same_points_however_finely_it_is_cut(corners, laws):
    corners = np.array(corners)
    cut = np.interp(np.arange(0.0, len(corners) - 0.9, 0.25), np.arange(len(corners)), corners)
    cut[::4] = corners
    found = quasi_static_torsion(drive(*laws), cut)[0, ::4]
    # At zero torque a clearance leaves the torsion free, and rounding decides.
    loaded = np.abs(corners) > 1e-3
    assert found[loaded] == pytest.approx(
        quasi_static_torsion(drive(*laws), corners)[0, loaded], abs=1e-10
    )


@pytest.mark.parametrize("laws", others_at_night(LAWS, LAWS[4], LAWS[-1]), ids=names_of)
def test_residuals_of_the_true_model_are_white_at_the_stated_covariance(laws, rng):
    total, degrees_of_freedom = 0.0, 0
    for _ in range(30):
        points = torsion_points(swept(laws, rng), RIG)
        left = points.whitening @ (points.angle - predicted(points, laws))
        total, degrees_of_freedom = total + left @ left, degrees_of_freedom + len(left)
    # The clearance jumps between two rows, at the same ones in every sweep: a bias of half a row.
    slack = 1.4 if any(isinstance(law, DeadZone) for _, law in laws) else 1.0
    assert chi2.ppf(0.001, degrees_of_freedom) < total < slack * chi2.ppf(0.999, degrees_of_freedom)


@pytest.mark.parametrize("laws", others_at_night(LAWS, LAWS[0], LAWS[-1]), ids=names_of)
def test_a_sweep_whose_rows_are_averaged_first_has_white_residuals_and_no_more_points(laws, rng):
    """30,001 rows: three of them are one, and the last is left out."""
    time = np.linspace(0.0, 180.0, 30_001)
    torque = np.interp(time, [0.0, 36.0, 108.0, 180.0], [0.0, 40.0, -40.0, 40.0])
    points = torsion_points(swept(laws, rng, torque), RIG)
    assert 350 < len(points.angle) <= 500
    left = points.whitening @ (points.angle - predicted(points, laws))
    assert chi2.ppf(0.001, len(left)) < left @ left < chi2.ppf(0.999, len(left))
    # 16.7 times the rows of the short sweep say so much more about the compliance.
    assert information(points) > 16.0 * information(torsion_points(swept(laws, rng), RIG))


def information(points):
    """Return the information of a sweep about the compliance, (N.m/rad)2."""
    line = points.whitening @ points.torque
    return line @ line


def test_the_torque_noise_is_kept_out(rng):
    """The sensor's noise would be 0.33 arcsec in the mean of 24 rows; the encoder's is 0.04."""
    points = torsion_points(swept((), rng), RIG)
    assert 60 <= len(points.angle) <= 90
    assert points.deviation.max() < 0.2 * ARCSEC
    scatter = points.angle - points.torque / K
    assert np.std(scatter) < 0.12 * ARCSEC


def test_a_constant_does_not_count(rng):
    points = torsion_points(swept((), rng), RIG)
    assert points.whitening.shape == (len(points.angle) - 1, len(points.angle))
    assert points.whitening @ np.ones(len(points.angle)) == pytest.approx(0.0, abs=1e-3)
    whole = points.whitening @ points.covariance @ points.whitening.T
    assert whole == pytest.approx(np.eye(len(whole)), abs=1e-9)


def test_an_unsteady_sweep_is_followed(rng):
    total, degrees_of_freedom = 0.0, 0
    for _ in range(20):
        points = torsion_points(swept((), rng, BOWED), RIG)
        left = points.whitening @ (points.angle - predicted(points, ()))
        total, degrees_of_freedom = total + left @ left, degrees_of_freedom + len(left)
    assert total / degrees_of_freedom < 1.3


def test_turning_points_are_found_to_a_fraction_of_a_row(rng):
    points = torsion_points(swept((), rng), RIG)
    assert [points.path.max(), points.path.min()] == pytest.approx([40.0, -40.0], abs=0.06)


def test_a_sweep_without_legs_is_refused(rng):
    time = np.arange(60) / 10.0
    zigzag = 30.0 * np.sin(2.0 * np.pi * time / 2.0)
    record = TorsionRecord("sweep", "train", 10.0, time, -zigzag / K, zigzag)
    with pytest.raises(InvalidInput, match="turning point"):
        torsion_points(record, RIG)


@pytest.mark.parametrize("torque", [[[1.0]], [np.nan], 3.0])
def test_a_wrong_torque_is_refused(torque):
    for function in (quasi_static_torsion, mean_torsion):
        with pytest.raises(InvalidInput, match="torque"):
            function(drive(), torque)


RIGS = SHARED / "rig"


@pytest.mark.skipif(not RIGS.is_dir(), reason="the shared rig data are not here")
def test_the_clean_shared_sweep_is_linear_to_its_noise():
    """The example's only effect, a torque ripple of the motor, is absent with a locked input."""
    campaign = read_campaign(RIGS / "example-torque-ripple")
    points = torsion_points(campaign.torsion[0], campaign.rig)
    line, left = points.whitening @ points.torque, points.whitening @ points.angle
    left = left - line * (line @ left) / (line @ line)
    assert left @ left < chi2.ppf(0.999, len(left) - 1)
