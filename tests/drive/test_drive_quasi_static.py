"""Torsion under a slow load with the input locked: closed forms, and where the way counts."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import mean_torsion, preset, quasi_static_torsion
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import Aperiodic, Response
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, SoftWindup

TORQUE = 40.0
SWEEP = np.concatenate([np.linspace(a, b, 30) for a, b in [(0.1, 40), (39, -40), (-39, 40)]])


def drive(*laws):
    model = preset("calibrated")
    coefficients = model.coefficients(model.nominal[None])
    return replace(coefficients, laws=tuple(("mesh", law) for law in laws))


def stiffness():
    return float(drive().stiffness[0])


def travel():
    return TORQUE / stiffness()


def test_a_cubic_spring_twists_by_the_root_of_its_cubic():
    cubic = 0.5 * stiffness() / travel() ** 2
    found = quasi_static_torsion(drive(HardeningStiffness(cubic)), SWEEP)[0]
    roots = np.array([np.roots([cubic, 0.0, stiffness(), -torque]) for torque in SWEEP])
    expected = roots.real[np.abs(roots.imag).argmin(axis=1)[:, None] == np.arange(3)]
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "laws",
    [
        lambda: [HardeningStiffness(0.5 * stiffness() / travel() ** 2)],
        lambda: [SoftWindup(0.4, 0.2 * travel(), 3.0)],
        lambda: [DeadZone(0.1 * travel())],
    ],
)
def test_without_memory_the_torsion_follows_the_torque_on_any_way(laws):
    coefficients, way = drive(*laws()), np.random.default_rng(3).permutation(len(SWEEP))
    along = quasi_static_torsion(coefficients, SWEEP)[0]
    assert quasi_static_torsion(coefficients, SWEEP[way])[0] == pytest.approx(along[way], rel=1e-9)


def test_of_a_law_with_memory_the_way_counts():
    slipping = drive(MaxwellSlip(5.0, 0.2 * travel(), 2.0))
    up, down = quasi_static_torsion(slipping, np.array([0.0, 40.0, 20.0, -40.0, 20.0]))[0, [2, 4]]
    assert up > 1.02 * down


def test_a_law_of_ones_own_that_asks_for_the_way_gets_it():
    """Though it states no inner states: a solver in time would need these."""

    class Brush(Aperiodic):
        def respond(self, state):
            steps = np.diff(state.path(state.position), prepend=0.0)
            on_the_way = np.sign(np.where(steps == 0.0, 1.0, steps))
            return Response(2.0 * state.back(on_the_way))

    up, down = quasi_static_torsion(drive(Brush()), np.array([20.0, 40.0, 20.0]))[0, [0, 2]]
    assert down - up == pytest.approx(4.0 / stiffness())


def test_a_clearance_adds_its_half_width_and_leaves_the_unloaded_drive_where_it_is_free():
    half_width = 0.1 * travel()
    found = quasi_static_torsion(drive(DeadZone(half_width)), np.array([0.0, 40.0, 0.0, -40.0]))[0]
    assert found[1] == -found[3] == pytest.approx(travel() + half_width)
    assert np.all(np.abs(found[[0, 2]]) < half_width)


def test_the_mean_between_two_points_is_that_of_many_in_between():
    """Of the clearance in the middle, too, where the torsion jumps."""
    coefficients = drive(DeadZone(0.1 * travel()))
    between = np.linspace(-40.0, 20.0, 4001)
    fine = quasi_static_torsion(coefficients, between)[0]
    (mean,) = mean_torsion(coefficients, between[[0, -1]])[0]
    assert mean == pytest.approx(np.trapezoid(fine, between) / 60.0, abs=1e-3 * travel())
