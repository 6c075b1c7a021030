"""The virtual rig: its effects, sensors and campaigns."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from night import others_at_night
from virtual_rig_cases import BELIEVED, RIG, SHORT, effect, true_rig

from experiments.studies.virtual_rig import rig as virtual_rig
from experiments.studies.virtual_rig.hidden_forms import HIDDEN_FORMS, draw_effect
from experiments.studies.virtual_rig.laws import Mesh, backbone, static_error
from experiments.studies.virtual_rig.rig import (
    DEFAULT_CONDITIONS,
    OutputEncoder,
    TorqueErrors,
    TrueRig,
    draw_rig,
    measure,
    repeated,
    run_campaign,
)
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.units import ARCSEC

NOW = ("backlash", "coulomb_friction", "kinematic_error", "thermal_drift", "output_vibration")
"""One of a kind: a mesh, a friction, an error of the gear, a sensor, and one in no list."""


def test_torsion_record_has_the_slope_of_the_drive(rng):
    campaign = run_campaign(true_rig(), BELIEVED, RIG, rng, SHORT)
    (record,) = campaign.torsion
    slope = np.polyfit(-record.output_angle, record.output_torque, 1)[0]
    # Gain of the torque sensor 0.5 %, noise of 0.2 N.m on 1800 samples over +-40 N.m.
    assert slope == pytest.approx(2.583e4, rel=0.006)


@pytest.mark.parametrize("seed", range(6))
def test_hardening_gives_its_share_at_rated_torque(seed):
    drawn = draw_effect("hardening_stiffness", BELIEVED, np.random.default_rng(seed))
    windup = 40.0 / BELIEVED.stiffness
    share = backbone(Mesh(1.0, 0.0, **drawn.parameters), windup, 0.0) / windup - 1.0
    assert 0.039 < share < 0.121


def test_static_error_slope_is_its_derivative():
    mesh = true_rig(
        effect("mesh", kinematic=1e-5, kinematic_order=0.37, kinematic_second=1.0)
    ).mechanics(RIG).mesh  # fmt: skip
    for angle in (0.0, 1.0, 30.0):
        rise = static_error(mesh, angle + 1e-5)[0] - static_error(mesh, angle - 1e-5)[0]
        assert static_error(mesh, angle)[1] == pytest.approx(rise / 2e-5, rel=1e-6)


def test_repeatability_is_the_rms_of_the_varying_part(rng):
    mesh = true_rig().mechanics(RIG).mesh
    angles = rng.uniform(0.0, 2e3, 60)
    changes = []
    for _ in range(800):
        other = repeated(mesh, RIG.repeatability, rng)._replace(error_offset=0.0)
        changes.append([static_error(other, a)[0] - static_error(mesh, a)[0] for a in angles])
    assert np.sqrt(np.mean(np.square(changes))) == pytest.approx(RIG.repeatability, rel=0.1)


def test_sensors_add_noise_quantisation_gain_and_zero(rng):
    truth = np.zeros((4, 80000)) + np.array([[0.0], [0.0], [0.4], [40.0]])
    truth[:2] = rng.uniform(0.0, 1.0, truth[:2].shape)
    errors = TorqueErrors(0.004, 0.002, -0.003, 0.08)
    reading = measure(truth, 101.0, RIG, errors, 4, rng) - truth.reshape(4, -1, 4).mean(axis=2)
    angle = np.hypot(0.7, 0.3 / 12**0.5) * ARCSEC
    expected = np.array([101.0 * angle, angle, 0.003, 0.2]) / 2.0
    assert reading.std(axis=1) == pytest.approx(expected, rel=0.02)
    offsets = np.array([0.0, 0.0, 0.004 * 0.4 + 0.002, -0.003 * 40.0 + 0.08])
    assert np.all(np.abs(reading.mean(axis=1) - offsets) < 5.0 * expected / 20000**0.5)


def test_output_encoder_reads_what_its_errors_say():
    angle, clock = np.linspace(0.0, 6.0, 50), np.full(50, 600.0)
    encoder = OutputEncoder(eccentricity=1e-5, drift=2e-5, drift_time=600.0, interpolation=3e-6)
    expected = 1e-5 * (np.cos(angle) + 0.2 * np.cos(2 * angle)) + 3e-6 * np.sin(angle)
    expected += 2e-5 * (1.0 - 0.8 * np.exp(-1.0) - 0.2 * np.exp(-3.0))
    # Six radians less six radians: a few units of the last place.
    assert encoder.reading(angle, clock) - angle == pytest.approx(expected, abs=5e-15)


def test_same_seed_gives_the_same_campaign():
    def channels(seed):
        rng = np.random.default_rng(seed)
        rig = draw_rig(BELIEVED, (draw_effect("hysteresis", BELIEVED, rng),), rng)
        campaign = run_campaign(rig, BELIEVED, RIG, rng, SHORT)
        return [record.output_angle for record in (*campaign.running, *campaign.torsion)]

    for one, same, other in zip(channels(3), channels(3), channels(4), strict=True):
        assert np.array_equal(one, same)
        assert not np.array_equal(one, other)


@pytest.mark.parametrize("name", others_at_night(HIDDEN_FORMS, *NOW))
def test_every_hidden_effect_shows_beyond_the_noise(name):
    rng = np.random.default_rng(5)
    hidden = draw_effect(name, BELIEVED, rng)
    quiet = replace(
        RIG, angle_noise=1e-12, angle_quantisation=0.0, input_torque_noise=1e-9,
        output_torque_noise=1e-9, torsion_angle_noise=1e-12,
    )  # fmt: skip
    conditions = (*SHORT, Condition(600.0, 20.0, 500.0, 2, "train"))
    clean, seen = (
        run_campaign(true_rig(*effects), BELIEVED, quiet, np.random.default_rng(6), conditions)
        for effects in ((), (hidden,))
    )
    change = 0.0
    for one, other in zip(clean.running, seen.running, strict=True):
        scale = (len(one.time) / 2.0) ** 0.5
        sizes = (0.7 * ARCSEC, 0.003, 0.2)
        for channel, size in zip(
            ("output_angle", "input_torque", "output_torque"), sizes, strict=True
        ):
            moved = getattr(other, channel) - getattr(one, channel)
            change = max(change, float(np.sqrt(np.mean(moved**2))) / size * scale)
    for one, other in zip(clean.torsion, seen.torsion, strict=True):
        moved = np.sqrt(np.mean((other.output_angle - one.output_angle) ** 2))
        change = max(change, float(moved) / (0.204 * ARCSEC))
    assert change > 3.0


def test_drawn_rig_stays_within_the_tolerances(rng):
    for _ in range(50):
        rig = draw_rig(BELIEVED, (), rng)
        for name in ("stiffness", "damping", "input_inertia", "load_inertia"):
            assert abs(getattr(rig.drive, name) / getattr(BELIEVED, name) - 1.0) <= 0.1
        ratios = np.divide(rig.drive.error_amplitudes, BELIEVED.error_amplitudes)
        assert np.all(np.abs(ratios - 1.0) <= 0.3)


def test_default_conditions_are_those_of_the_shared_rigs(rng):
    assert [c.role for c in DEFAULT_CONDITIONS] == ["train"] * 13 + ["held_out"] * 6
    assert DEFAULT_CONDITIONS[1].name == "run_0010rpm_40Nm"
    assert Condition(-600.0, 0.0, 500.0, 2, "train").name == "run_0600rpm_00Nm_reverse"


def test_wrong_input_is_refused_by_name(rng):
    with pytest.raises(InvalidInput, match="name of a hidden effect"):
        draw_effect("gremlin", BELIEVED, rng)
    with pytest.raises(InvalidInput, match="size"):
        draw_effect("backlash", BELIEVED, rng, 0.0)
    with pytest.raises(InvalidInput, match="coulomb"):
        true_rig(effect("input", coulomb=1.0), effect("input", coulomb=2.0))
    with pytest.raises(InvalidInput, match="port"):
        true_rig(effect("roof", coulomb=1.0))
    with pytest.raises(InvalidInput, match="error_phases"):
        TrueRig(BELIEVED, (0.0,))
    with pytest.raises(InvalidInput, match="integral"):
        run_campaign(true_rig(), BELIEVED, replace(RIG, integral=0.0), rng, SHORT)


def test_the_virtual_rig_knows_nothing_of_the_laws_it_must_test():
    modules = set(Path(virtual_rig.__file__).parent.glob("*.py"))
    # It adds what the library says of a user's effect, and hides nothing.
    modules -= {one for one in modules if one.stem == "own_effects"}
    assert len(modules) >= 6
    for path in modules:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not (node.module or "").startswith(
                    ("pymoo_hdte.drive", "pymoo_hdte.effects")
                )
