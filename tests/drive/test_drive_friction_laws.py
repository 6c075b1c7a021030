"""Friction that grows with a power of the speed, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from quick_campaigns import quick_campaign
from virtual_rig_cases import effect

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.drive import LawAtPort, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.effects.friction import SMOOTHING_SPEED, NonlinearDrag
from pymoo_hdte.effects.law import PortState, periodic_phase

STIFF = SpeedLoop(1e4, 0.0)
"""Holds the input at its speed, so that means are those of an even motion."""


def torque_of(law, speed):
    speed = np.atleast_1d(np.asarray(speed, dtype=float))
    state = PortState(0.0 * speed, speed, periodic_phase(0.0), np.ones(1))
    return law.respond(state)


@given(st.floats(0.2, 4.0), st.floats(1e-2, 300.0), st.floats(1.0, 300.0))
def test_drag_is_the_power_of_the_speed_beyond_the_smoothing(exponent, speed, reference):
    law = NonlinearDrag(2e-7, exponent, reference)
    expected = 2e-7 * reference**2 * (speed / reference) ** exponent
    # Below exponent 1 the smoothing changes a hundred times its own speed by 1e-4.
    assert torque_of(law, speed).torque == pytest.approx(expected, rel=1e-4)
    assert torque_of(law, -speed).torque == pytest.approx(-expected, rel=1e-4)


def test_exponent_2_is_the_quadratic_drag_whatever_the_reference():
    speed = np.array([-200.0, -1e-6, 0.0, 3.0, 150.0])
    for reference in (1.0, 77.0):
        found = torque_of(NonlinearDrag(1e-6, 2.0, reference), speed)
        assert found.torque == pytest.approx(1e-6 * speed * np.abs(speed), rel=1e-14)
        assert found.damping == pytest.approx(2e-6 * np.abs(speed), rel=1e-14, abs=1e-150)


@pytest.mark.parametrize("exponent", [0.2, 0.5, 1.0, 1.5, 3.0])
def test_drag_passes_rest_smoothly(exponent):
    law = NonlinearDrag(1e-6, exponent, 100.0)
    speed = np.linspace(-10.0, 10.0, 2001) * SMOOTHING_SPEED
    found = torque_of(law, speed)
    assert found.torque[1000] == 0.0
    assert np.all(np.isfinite(found.damping))
    assert np.all(found.damping >= 0.0)
    climbed = np.cumsum(found.damping[:-1] + found.damping[1:]) * np.diff(speed) / 2.0
    size = np.ptp(found.torque)
    assert found.torque[1:] - found.torque[0] == pytest.approx(climbed, abs=1e-4 * size)


def test_the_motor_overcomes_the_drag_in_both_directions():
    calm = preset("published")
    law = NonlinearDrag(2e-6, 0.5, 100.0)
    draggy = replace(calm, effects=(*calm.effects, LawAtPort("nonlinear_drag", "input", law)))
    speeds = np.array([50.0, 200.0, -200.0])
    plain, more = (
        harmonic_balance(
            model.coefficients(np.tile(calm.nominal, (3, 1))), input_speed=speeds, motor=STIFF
        )
        for model in (calm, draggy)
    )
    added = (more.motor_torque - plain.motor_torque)[:, 0].real
    expected = np.sign(speeds) * 2e-6 * 100.0**2 * np.sqrt(np.abs(speeds) / 100.0)
    assert added == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("bad", [{"exponent": 0.0}, {"exponent": np.nan}, {"reference": 0.0}])
def test_exponents_and_references_are_checked(bad):
    (number,) = bad
    with pytest.raises(InvalidInput, match=f"nonlinear_drag.{number}"):
        NonlinearDrag(1e-6, **bad)


@pytest.mark.parametrize(
    ("exponent", "torque", "word"), [(3.0, 0.02, "faster"), (0.5, 0.03, "slower")]
)
def test_a_planted_power_is_named_with_its_exponent(exponent, torque, word):
    """Of the records, the fastest is at 2000 r/min."""
    rated = 2000.0 * np.pi / 30.0
    planted = effect("input", drag=torque / rated**exponent, drag_exponent=exponent)
    verdict = analyse(quick_campaign(5, planted)).verdict
    assert verdict.status == "named"
    (candidate,) = verdict.chosen.candidates
    assert candidate.name == "nonlinear_drag"
    assert word in candidate.sentence
    fitted = verdict.chosen.fit
    found, spread = fitted.values[-2:], np.sqrt(np.diag(fitted.covariance))[-2:]
    assert np.all(np.abs(found - [torque, exponent]) < 3.0 * spread)
    assert np.all(spread < [0.1 * torque, 0.1 * exponent + 0.05])
