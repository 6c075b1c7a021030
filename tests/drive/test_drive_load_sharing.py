"""One of two zones of engagement has play: two springs side by side, and what a sweep shows."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.drive import LawAtPort, preset, quasi_static_torsion
from pymoo_hdte.drive._effects import effect_from_fields
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.load_sharing import UnevenSharing
from pymoo_hdte.effects.stiffness import PeriodicClearance
from pymoo_hdte.units import ARCSEC

LAW = UnevenSharing(1.0, 0.4, 4.0 * ARCSEC, 3.0 * ARCSEC)
STIFFNESS = 2.6e4


def torque(law, torsion, angle):
    state = PortState(torsion, np.zeros_like(torsion), periodic_phase(angle), STIFFNESS)
    return STIFFNESS * torsion + law.respond(state).torque


def test_the_mesh_is_two_equal_springs_one_of_which_has_play():
    torsion = np.linspace(-30.0, 30.0, 601) * ARCSEC
    for angle in (0.0, 1.0, 3.0):
        play = 4.0 * ARCSEC + 3.0 * ARCSEC * np.cos(angle + 0.4)
        loose = np.sign(torsion) * np.maximum(np.abs(torsion) - play, 0.0)
        expected = STIFFNESS / 2.0 * (torsion + loose)
        # The corners are rounded over a twentieth of the play.
        assert torque(LAW, torsion, angle) == pytest.approx(expected, abs=STIFFNESS * 0.05 * play)


def test_beyond_its_play_it_is_a_clearance_of_half_the_width_and_within_it_is_not():
    """So records under load alone cannot tell the two, and records without can."""
    half = PeriodicClearance(1.0, 0.4, 2.0 * ARCSEC, 1.5 * ARCSEC)
    far = np.array([-60.0, -20.0, 20.0, 60.0]) * ARCSEC
    near = np.array([-1.5, 1.5]) * ARCSEC
    assert torque(LAW, far, 0.7) == pytest.approx(torque(half, far, 0.7), rel=1e-6)
    assert np.all(np.abs(torque(LAW, near, 0.7)) > 2.0 * np.abs(torque(half, near, 0.7)))


def test_a_sweep_with_locked_input_shows_half_of_the_stiffness_near_zero():
    model = replace(preset("published"), effects=(LawAtPort("uneven_load_sharing", "mesh", LAW),))
    coefficients = model.coefficients(model.nominal[None])
    stiffness = coefficients.stiffness[0]
    path = np.array([0.1, 0.2, 20.0, 40.0, 0.0]) * stiffness * LAW.half_width
    torsion = quasi_static_torsion(coefficients, path)[0] / LAW.half_width
    # K d / 2 within the play; beyond it (K / 2) (d + d - 1).
    assert torsion == pytest.approx([0.2, 0.4, 20.5, 40.5, 0.0], abs=1e-6)


def test_exports_state_the_law():
    numbers = {name: getattr(LAW, name) for name in ("half_width", "variation", "order", "phase")}
    numbers |= {name: getattr(np, name) for name in ("cos", "log", "exp", "abs")}
    numbers |= {"max": max, "stiffness": STIFFNESS, "position": 5.0 * ARCSEC, "angle": 0.7}
    expected = torque(LAW, np.array([5.0 * ARCSEC]), 0.7)[0] - STIFFNESS * 5.0 * ARCSEC
    assert eval(LAW.formula.force, numbers) == pytest.approx(expected, rel=1e-9)


def test_a_model_file_keeps_it():
    effect = LawAtPort("uneven_load_sharing", "mesh", LAW)
    assert effect_from_fields(Fields(effect.to_dict(), "effect")) == effect
