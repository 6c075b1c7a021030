"""Harmonic balance with strong hysteresis: the memory in Newton's step, and that it converges."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import LawAtPort, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.drive.solve.angle_equations import AngleEquations
from pymoo_hdte.drive.solve.free_angle import torus_of
from pymoo_hdte.drive.solve.torus import stacked, unstacked
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.units import ARCSEC


def drive(name, force, torsion, input_speed=200.0, load_torque=40.0):
    model = preset(name)
    effect = LawAtPort("hysteresis", "mesh", MaxwellSlip(force, torsion))
    model = replace(model, effects=(*model.effects, effect)).at(input_speed, load_torque)
    return model.coefficients(model.nominal[None])


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_slope_and_memory_together_are_the_derivative_of_the_torque(direction, rng):
    coefficients = drive("resonant", 3.0, 1e-4)
    torus = torus_of(coefficients)
    speed, load = direction * np.array([200.0]), np.array([40.0])
    equations = AngleEquations(coefficients, speed, load, SpeedLoop(), torus)
    size = len(torus.orders)
    torsion = 1e-4 * (rng.standard_normal((1, size)) + 1j * rng.standard_normal((1, size)))
    change = rng.standard_normal((1, size)) + 1j * rng.standard_normal((1, size))
    torsion[:, 0], change[:, 0] = 1e-3, 1.0
    energy = np.zeros_like(torsion)
    energy[:, 0] = speed**2 / 2.0

    def torque(at):
        # The damper is linear: it stands in the motion's torque but not in its slope.
        motion = equations.motion(at, energy)
        rate = motion.angular_speed * torus.signal(torus.derivative(at))
        return torus.phasors(motion.mesh_torque - coefficients.damping[:, None] * rate)

    # Within 1e-11 rad no spring begins to slip or to stick.
    step = 1e-11
    numerical = (torque(torsion + step * change) - torque(torsion - step * change)) / (2.0 * step)
    slope = torus.product_matrix(equations.motion(torsion, energy).mesh_slope)
    memory = equations.recall_matrix(torsion)

    def along(matrix):
        return unstacked(np.einsum("nij,nj->ni", matrix, stacked(change)))

    scale = np.abs(numerical).max()
    assert along(slope + memory) == pytest.approx(numerical, abs=1e-4 * scale)
    assert np.abs(along(slope) - numerical).max() > 1e-2 * scale


@pytest.mark.parametrize("name", ["calibrated", "resonant"])
@pytest.mark.parametrize("force", [1.0, 5.0, 8.0])
@pytest.mark.parametrize("torsion", [5e-5, 1e-4, 2e-4])
def test_hysteresis_of_any_strength_converges_under_load(name, force, torsion):
    balance = harmonic_balance(
        drive(name, force, torsion), motor=SpeedLoop(0.02, 0.5), tolerance=1e-8
    )
    assert np.all(balance.converged)


def test_springs_that_slip_bear_their_force():
    """Without a static error nothing turns the torsion back: the load has wound it up for good."""
    coefficients = drive("published", 2.0, 1e-12)
    springs = harmonic_balance(
        replace(coefficients, error_phasors=0.0 * coefficients.error_phasors)
    )
    expected = (coefficients.mean_mesh_torque - 2.0) / coefficients.stiffness[0]
    assert springs.torsion[0, 0].real == pytest.approx(expected, abs=1e-3 * ARCSEC)
