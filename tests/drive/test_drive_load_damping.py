"""Damping that grows with the load: the damper of each load, the energy that it takes, exports."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    KinematicReaction,
    LawAtPort,
    harmonic_balance,
    mean_torsion,
    preset,
)
from pymoo_hdte.drive._effects import LoadDamping
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.problems import RobustDTE

LAW = LoadDamping(20.0, reference=40.0)
DAMPING = LawAtPort("load_dependent_damping", "mesh", LAW)


def with_effects(model, *effects):
    return replace(model, effects=(*model.effects, *effects))


def test_each_load_has_the_damper_of_its_size_whatever_its_direction():
    model = preset("calibrated")
    growing = with_effects(model, DAMPING).coefficients(np.repeat(model.nominal[None], 3, axis=0))
    loads = np.array([-20.0, 0.0, 40.0])
    found = harmonic_balance(growing, load_torque=loads)
    plain = replace(growing, laws=(), damping=growing.damping + 20.0 * np.abs(loads) / 40.0)
    expected = harmonic_balance(plain, load_torque=loads, torus=found.torus)
    for name in ("transmission_error", "motor_torque", "energy"):
        size = np.abs(getattr(expected, name)).max()
        assert getattr(found, name) == pytest.approx(getattr(expected, name), abs=1e-8 * size)


def test_the_motor_does_the_work_that_the_damping_takes():
    """Without other losses, and with the reaction of theta_s, all else derives from one energy."""
    model = with_effects(preset("published"), KinematicReaction(), DAMPING)
    coefficients = model.coefficients(model.nominal[None])
    smooth = replace(
        coefficients, input_damping=np.zeros(1), output_damping=0.0, damping=np.zeros(1)
    )
    balance = harmonic_balance(smooth)
    speed = smooth.input_speed
    rate = speed * balance.torus.derivative(balance.torsion)
    lost = LAW.damping * smooth.load_torque / 40.0 * np.sum(np.abs(rate) ** 2) / 2.0
    supplied = balance.motor_torque[0, 0].real - smooth.load_torque / smooth.ratio
    assert supplied * speed == pytest.approx(lost, rel=2e-3)


def test_a_slow_sweep_with_locked_input_knows_no_damping():
    model, path = preset("published"), np.array([0.0, 20.0, 40.0, 0.0])
    torsions = [
        mean_torsion(with_effects(model, *added).coefficients(model.nominal[None]), path)
        for added in ((), (DAMPING,))
    ]
    assert np.array_equal(*torsions)


def test_the_robust_problem_is_damped_by_it():
    """Beside a resonance more damping is a smaller error."""
    calm = preset("resonant")
    design = calm.nominal[None, 1:]
    damped, without = (
        RobustDTE(model, order=1).evaluate(design)[0]
        for model in (with_effects(calm, DAMPING), calm)
    )
    assert 0.0 < damped[0] < without[0]


def test_exports_state_the_law_and_the_damper_of_its_reference():
    state = PortState(np.zeros(1), np.array([0.3]), periodic_phase(0.0), np.ones(1), load=-10.0)
    numbers = {"damping": 20.0, "reference": 40.0, "load": -10.0, "speed": 0.3, "abs": abs}
    assert LAW.respond(state).torque[0] == pytest.approx(eval(LAW.formula.force, numbers))
    assert LAW.lumped.damping == LAW.respond(replace(state, load=40.0)).damping


def test_what_means_nothing_is_refused():
    with pytest.raises(InvalidInput, match="reference"):
        LoadDamping(1.0, 0.0)
    state = PortState(np.zeros(1), np.ones(1), periodic_phase(0.0), np.ones(1))
    with pytest.raises(InvalidInput, match="port of load_dependent_damping"):
        LAW.respond(state)
