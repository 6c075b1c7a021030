"""A drive that turns backwards: against the integrator, and as its own mirror image."""

from dataclasses import replace

import numpy as np
import pytest
from law_cases import EFFECTS as FORWARD
from law_cases import LAWS, memoryless
from night import others_at_night
from scipy.integrate import solve_ivp

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import MeshStiffnessVariation, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.drive._effects import LawAtPort
from pymoo_hdte.drive._solve.time_domain import StartUp, equations_of_motion
from pymoo_hdte.effects.friction import CoulombFriction, PeriodicFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.law import Periodic
from pymoo_hdte.units import ARCSEC

# Friction that varies over an output turn shakes the speed of a constant torque in cubes of its
# level, of which few harmonics are kept: it is as weak as the agreement with the integrator asks.
EFFECTS = [
    *FORWARD,
    LawAtPort("position_dependent_friction", "output", PeriodicFriction(1.0, 0.3, 0.1)),
    MeshStiffnessVariation(0.05, 0.7, 4.0),
]
# Hysteresis is tested by the mirror image instead.
MEMORYLESS = memoryless(EFFECTS)


def label(effect):
    return f"{effect.name} {getattr(effect, 'port', '')}"


def reverse(effect):
    """Return the coefficients of ``resonant``, which varies in stiffness too, turning back."""
    model = preset("resonant")
    model = replace(model, effects=(*model.effects, effect))
    coefficients = model.coefficients(model.nominal[None])
    return replace(coefficients, input_speed=-coefficients.input_speed)


@pytest.mark.parametrize(
    "effect", others_at_night(MEMORYLESS, *MEMORYLESS[::3], MEMORYLESS[-1]), ids=label
)
def test_every_law_agrees_with_the_integrator_in_reverse(effect):
    """A motion that starts on the steady state must stay on it."""
    coefficients = reverse(effect)
    balance = harmonic_balance(coefficients)
    assert np.all(balance.converged)
    orders, turns = balance.torus.orders, 20
    course = StartUp(coefficients.input_speed, 1e-3, 0.0)
    begin = course.ramp
    end = begin + 2 * np.pi * turns / abs(coefficients.input_speed)
    rate = 1j * orders * balance.transmission_error[0]
    speed = -np.sqrt(2.0 * balance.energy[0].real.sum())
    start = [0.0, speed, balance.transmission_error[0].real.sum(), speed * rate.real.sum()]
    run = solve_ivp(
        equations_of_motion(coefficients, course, prescribed=False),
        (begin, end),
        start,
        method="LSODA",
        t_eval=np.linspace(begin, end, 500),
        rtol=1e-9,
        atol=[1e-9, 1e-7, 1e-5 * ARCSEC, 1e-3 * ARCSEC],
    )
    assert run.y[0, -1] == pytest.approx(-2 * np.pi * turns, rel=0.1)
    expected = balance.spectrum().at(run.y[0])[0]
    assert run.y[2] == pytest.approx(expected, abs=1e-3 * ARCSEC)


def mirror(coefficients):
    """Return the drive seen in a mirror: every angle and torque has the other sign."""

    def mirrored(law):
        if isinstance(law, Gravity):
            return Gravity(-law.torque, -law.phase)
        if not isinstance(law, Periodic):
            return law
        turned = replace(law, phase=-law.phase)
        return replace(turned, amplitude=-law.amplitude) if hasattr(law, "amplitude") else turned

    return replace(
        coefficients,
        input_speed=-coefficients.input_speed,
        load_torque=-coefficients.load_torque,
        stiffness_phase=-coefficients.stiffness_phase,
        error_phasors=-coefficients.error_phasors.conj(),
        # The load has turned round as well.
        load_errors=tuple(
            (order, by_load.conjugate()) for order, by_load in coefficients.load_errors
        ),
        laws=tuple((port, mirrored(law)) for port, law in coefficients.laws),
    )


@pytest.mark.parametrize("effect", EFFECTS, ids=label)
def test_the_mirrored_drive_moves_as_the_mirror_image(effect):
    coefficients, loop = reverse(effect), SpeedLoop(0.02, 0.5)
    back = harmonic_balance(coefficients, motor=loop)
    forth = harmonic_balance(mirror(coefficients), motor=loop, torus=back.torus)
    assert np.all(back.converged & forth.converged)
    for name in ("transmission_error", "torsion", "motor_torque", "coupling_torque", "lead"):
        expected = -getattr(forth, name).conj()
        size = np.abs(expected).max()
        assert getattr(back, name) == pytest.approx(expected, abs=1e-9 * size), name
    size = np.abs(forth.energy[:, 0]).max()
    assert back.energy == pytest.approx(forth.energy.conj(), abs=1e-9 * size)


def test_dry_friction_turns_round_and_the_load_does_not():
    """Half the difference of the directions is friction, half the sum the load."""
    model = preset("published")
    friction = LawAtPort("coulomb_friction", "output", CoulombFriction(2.0))
    model = replace(model, effects=(*model.effects, friction))
    coefficients = model.coefficients(np.tile(model.nominal, (2, 1)))
    speed = coefficients.input_speed * np.array([1.0, -1.0])
    torsion = harmonic_balance(coefficients, input_speed=speed).torsion[:, 0].real
    torque = coefficients.stiffness[0] * torsion
    bearing = coefficients.output_damping * speed[0] / coefficients.ratio
    assert np.mean(torque) == pytest.approx(coefficients.load_torque, rel=1e-6)
    assert (torque[0] - torque[1]) / 2.0 == pytest.approx(2.0 + bearing, rel=1e-6)


def test_rows_of_both_directions_are_solved_as_if_alone():
    coefficients = reverse(EFFECTS[4])
    rows = coefficients.rows(np.array([0, 0]))
    speed = coefficients.input_speed * np.array([1.0, -1.0])
    both = harmonic_balance(rows, input_speed=speed)
    for row in range(2):
        alone = harmonic_balance(coefficients, input_speed=speed[row : row + 1])
        assert both.torsion[row] == pytest.approx(alone.torsion[0], abs=1e-6 * ARCSEC)
    assert np.abs(both.torsion[0] - both.torsion[1]).max() > 1e-2 * ARCSEC


def test_a_drive_at_rest_is_refused():
    with pytest.raises(InvalidInput, match="input_speed is 0"):
        harmonic_balance(replace(reverse(EFFECTS[0]), input_speed=0.0))


def test_every_law_turns_back_here():
    assert set(LAWS) == {effect.name for effect in EFFECTS if isinstance(effect, LawAtPort)}
