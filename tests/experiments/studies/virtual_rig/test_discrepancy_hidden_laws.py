"""Laws of the virtual rig against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.studies.virtual_rig.integrator import quasi_static_torsion
from experiments.studies.virtual_rig.laws import Mesh, Side, backbone, friction, rounded_dead_zone


def test_maxwell_loop_has_the_area_and_the_saturation_of_its_elements():
    stiffness, limits = np.array([2e4, 5e3]), np.array([0.4, 0.6])
    mesh = Mesh(2.583e4, 0.0, slip_stiffness=stiffness, slip_limit=limits)
    legs = [np.linspace(*ends, 4000) for ends in ((0, 40), (40, -40), (-40, 40))]
    torque = np.concatenate(legs)
    torsion = quasi_static_torsion(mesh, 0.0, torque, 0.0, np.zeros(2))
    amplitude = (40.0 - limits.sum()) / 2.583e4
    assert torsion.max() == pytest.approx(amplitude, rel=1e-9)
    loop = slice(3999, None)
    area = -np.trapezoid(torque[loop], torsion[loop])
    assert -area == pytest.approx(4.0 * limits @ (amplitude - limits / stiffness), rel=1e-3)


def test_breakaway_friction_widens_the_torsion_loop():
    torque = np.interp(np.arange(1801.0), [0, 600, 1200, 1800], [0, 40, -40, 40])
    torsion = quasi_static_torsion(Mesh(2.583e4, 0.0), 0.0, torque, 1.5, np.zeros(0))
    up, down = torsion[1500], torsion[900]
    assert torque[1500] == torque[900] == pytest.approx(0.0)
    assert down - up == pytest.approx(3.0 / 2.583e4)


@given(st.floats(-1e-3, 1e-3), st.floats(0.0, 5e-5), st.floats(1e-7, 1e-5))
def test_rounded_dead_zone_is_odd_and_lies_close_to_the_sharp_one(torsion, half_width, rounding):
    value = rounded_dead_zone(torsion, half_width, rounding)
    assert value == pytest.approx(-rounded_dead_zone(-torsion, half_width, rounding), abs=1e-18)
    sharp = np.sign(torsion) * max(abs(torsion) - half_width, 0.0)
    assert abs(value - sharp) <= rounding * np.log(2.0) + 1e-15
    if half_width == 0.0:
        assert value == pytest.approx(torsion, abs=1e-15)


def test_soft_windup_has_the_three_slopes_of_its_pieces():
    mesh = Mesh(
        1.0, 0.0, soft_share=0.3, soft_corner=3e-4, stiff_share=0.1, stiff_corner=1e-3,
        corner_rounding=2e-5,
    )  # fmt: skip
    for torsion, slope in ((0.0, 0.7), (6e-4, 1.0), (-6e-4, 1.0), (1.6e-3, 1.1)):
        rise = backbone(mesh, torsion + 1e-7, 0.0) - backbone(mesh, torsion - 1e-7, 0.0)
        assert rise / 2e-7 == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("form", ["pulse", "shift"])
def test_varying_clearance_moves_the_loaded_flank_by_its_half_width(form):
    mesh = Mesh(
        1.0, 0.0, clearance=2e-5, clearance_rounding=2e-6, clearance_order=2.0, **{form: 0.5}
    )
    flanks = [1e-3 - backbone(mesh, 1e-3, angle) for angle in (0.0, np.pi / 2.0)]
    assert flanks[0] - flanks[1] == pytest.approx(2e-5, rel=1e-9)
    other = [1e-3 + backbone(mesh, -1e-3, angle) for angle in (0.0, np.pi / 2.0)]
    sign = -1.0 if form == "shift" else 1.0
    assert other[0] - other[1] == pytest.approx(sign * 2e-5, rel=1e-9)
    assert np.mean(flanks) == pytest.approx(2e-5)


@given(st.floats(-300.0, 300.0))
def test_friction_takes_power_and_falls_with_speed_as_written(speed):
    side = Side(1.0, 0.0, coulomb=0.01, stribeck=0.02, stribeck_speed=20.0, rounding_speed=0.2)
    torque = friction(side, speed, 0.0, 0.0)
    assert torque * speed >= 0.0
    if abs(speed) > 4.0:
        level = 0.01 + 0.02 * np.exp(-abs(speed) / 20.0)
        assert torque == pytest.approx(np.sign(speed) * level, rel=1e-9)
    drag = Side(1.0, 0.0, drag=1e-5, drag_exponent=1.7)
    assert friction(drag, 2.0 * speed, 0.0, 0.0) == pytest.approx(
        2.0**1.7 * friction(drag, speed, 0.0, 0.0), rel=1e-9
    )


def test_bursts_come_once_in_a_period_at_irregular_instants():
    side = Side(1.0, 0.0, burst=0.5, burst_period=1.0, burst_width=0.1, rounding_speed=1e-3)
    torque = np.array([friction(side, 1.0, 0.0, t) for t in np.arange(0.0, 50.0, 1e-3)])
    by_period = torque.reshape(50, 1000)
    assert by_period.max(axis=1) == pytest.approx(0.5, rel=1e-2)
    assert by_period.mean(axis=1) == pytest.approx(0.5 * 0.1 / 2.0, rel=1e-2)
    assert np.std(by_period.argmax(axis=1)) > 150.0
