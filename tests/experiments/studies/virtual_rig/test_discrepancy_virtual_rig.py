"""The virtual rig: its effects, sensors and campaigns."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from virtual_rig_cases import BELIEVED, RIG, SHORT, effect, true_rig

from experiments.studies.virtual_rig import rig as virtual_rig
from experiments.studies.virtual_rig.laws import static_error
from experiments.studies.virtual_rig.rig import (
    DEFAULT_CONDITIONS,
    TorqueErrors,
    TrueRig,
    draw_rig,
    measure,
    repeated,
    run_campaign,
    torque_ripple,
)
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.units import ARCSEC


def test_torsion_record_has_the_slope_of_the_drive(rng):
    campaign = run_campaign(true_rig(), BELIEVED, RIG, rng, SHORT)
    (record,) = campaign.torsion
    slope = np.polyfit(-record.output_angle, record.output_torque, 1)[0]
    # Gain of the torque sensor 0.5 %, noise of 0.2 N.m on 1800 samples over +-40 N.m.
    assert slope == pytest.approx(2.583e4, rel=0.006)


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


def test_same_seed_gives_the_same_campaign():
    def channels(seed):
        rng = np.random.default_rng(seed)
        rig = draw_rig(BELIEVED, (torque_ripple(rng),), rng)
        campaign = run_campaign(rig, BELIEVED, RIG, rng, SHORT)
        return [record.output_angle for record in (*campaign.running, *campaign.torsion)]

    for one, same, other in zip(channels(3), channels(3), channels(4), strict=True):
        assert np.array_equal(one, same)
        assert not np.array_equal(one, other)


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
    assert len(modules) >= 5
    for path in modules:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not (node.module or "").startswith(
                    ("pymoo_hdte.drive", "pymoo_hdte.effects")
                )
