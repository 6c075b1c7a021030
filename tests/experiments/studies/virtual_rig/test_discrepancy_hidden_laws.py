"""Laws of the virtual rig against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.studies.virtual_rig.integrator import quasi_static_torsion
from experiments.studies.virtual_rig.laws import Mesh, Side, backbone, friction, rounded_dead_zone


def test_breakaway_friction_widens_the_torsion_loop():
    torque = np.interp(np.arange(1801.0), [0, 600, 1200, 1800], [0, 40, -40, 40])
    torsion = quasi_static_torsion(Mesh(2.583e4, 0.0), 0.0, torque, 1.5)
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


def test_soft_windup_has_the_two_slopes_of_its_pieces():
    mesh = Mesh(1.0, 0.0, soft_share=0.3, soft_corner=3e-4, corner_rounding=2e-5)
    for torsion, slope in ((0.0, 0.7), (6e-4, 1.0), (-6e-4, 1.0)):
        rise = backbone(mesh, torsion + 1e-7) - backbone(mesh, torsion - 1e-7)
        assert rise / 2e-7 == pytest.approx(slope, rel=1e-4)


@given(st.floats(-300.0, 300.0))
def test_friction_takes_power_and_is_as_written(speed):
    side = Side(1.0, 0.0, coulomb=0.01, rounding_speed=0.2)
    torque = friction(side, speed)
    assert torque * speed >= 0.0
    if abs(speed) > 4.0:
        assert torque == pytest.approx(np.sign(speed) * 0.01, rel=1e-9)
    drag = Side(1.0, 0.0, drag=1e-5, drag_exponent=1.7)
    assert friction(drag, 2.0 * speed) == pytest.approx(2.0**1.7 * friction(drag, speed), rel=1e-9)
