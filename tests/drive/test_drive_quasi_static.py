"""Torsion under a slow load with the input locked: closed forms, and where the way counts."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte.drive import mean_torsion, preset, quasi_static_torsion
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import Aperiodic, Response
from pymoo_hdte.effects.linear import ConstantForce
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


class Brush(Aperiodic):
    """Dry friction of 2 N.m that states no inner states, though a solver in time needs these."""

    def respond(self, state):
        steps = np.diff(state.path(state.position), prepend=0.0)
        return Response(2.0 * state.back(np.sign(np.where(steps == 0.0, 1.0, steps))))


class Idle(Aperiodic):
    """No torque; asks for the way where some torsion is between two points only."""

    def respond(self, state):
        here = np.abs(state.position) / travel()
        asks = np.any((here > 0.2) & (here < 0.3))
        return Response(0.0 * (state.back(state.path(state.position)) if asks else here))


@pytest.mark.parametrize("torsion", [quasi_static_torsion, mean_torsion])
def test_a_law_of_ones_own_that_asks_for_the_way_gets_it(torsion):
    ends = np.array([-30.0, 10.0, 20.0, 40.0, 20.0, 10.0])
    found = torsion(drive(Brush()), ends)[0]
    up, down = found[[-5, -1]] if torsion is quasi_static_torsion else found[[-4, -1]]
    assert down - up == pytest.approx(4.0 / stiffness())


def test_a_law_may_ask_for_the_way_between_the_points_only():
    ends = np.array([40.0, -40.0, 30.0])
    assert mean_torsion(drive(Idle()), ends) == pytest.approx(mean_torsion(drive(), ends))


def test_a_force_without_torsion_moves_the_drive_at_rest():
    held = np.array([0.0, 10.0, 2.0, 1.0, -1.0, -40.0, 0.0, 2.0])
    found = quasi_static_torsion(drive(ConstantForce(3.0)), held)[0]
    assert found == pytest.approx((held - 3.0) / stiffness(), abs=1e-9 * travel())


def test_rows_are_drives_of_their_own():
    coefficients = drive(DeadZone(0.1 * travel()))
    both = replace(
        preset("calibrated").coefficients(np.tile(preset("calibrated").nominal, (2, 1))),
        laws=coefficients.laws,
        stiffness=np.array([1.0, 2.0]) * stiffness(),
    )
    softer, stiffer = mean_torsion(both, SWEEP)
    assert softer == pytest.approx(mean_torsion(coefficients, SWEEP)[0], abs=1e-9 * travel())
    assert np.ptp(stiffer) < 0.7 * np.ptp(softer)


def test_a_torque_that_the_mesh_cannot_carry_is_no_number_and_the_others_are():
    """A spring that softens by a cubic carries at most 2/3 K d, where its slope is zero."""

    class Softening(Aperiodic):
        def respond(self, state):
            share = -stiffness() / travel() ** 2
            return Response(share * state.position**3 / 3.0, share * state.position**2)

    found = quasi_static_torsion(drive(Softening()), np.array([10.0, 40.0, -10.0]))[0]
    assert np.isnan(found).tolist() == [False, True, False]
    assert found[0] == -found[2]


def test_the_whole_path_is_searched_at_once_where_no_law_asks_for_the_way(monkeypatch):
    calls = []
    respond = DeadZone.respond
    monkeypatch.setattr(DeadZone, "respond", lambda *given: calls.append(1) or respond(*given))
    coefficients = drive(DeadZone(0.1 * travel()))
    counts = []
    for repeats in (1, 5):
        calls.clear()
        mean_torsion(coefficients, np.tile(SWEEP, repeats))
        counts.append(len(calls))
    assert counts[0] == counts[1]


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
