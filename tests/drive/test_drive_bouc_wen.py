"""Hysteresis of Bouc and Wen: closed forms, memory that fades, drives that run on and on."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import LawAtPort, harmonic_balance, preset, simulate_drive
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.drive._solve.quasi_static import quasi_static_torsion
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.effects.smooth_loop import rise_of
from pymoo_hdte.units import ARCSEC

FORCE, YIELD = 2.0, 1e-4
exponents, shares = st.floats(1.0, 4.0), st.floats(0.05, 1.5)


def torque(law, path, recurs=False):
    """The torque on one path, or on one that recurs after its first half."""
    around = (lambda values: values, lambda values: values)
    state = PortState(path[None], 0.0 * path[None], None, np.ones(1), *around, recurs=recurs)
    return law.respond(state).torque[0]


def back_and_forth(reach, points=200):
    """Up from rest to a reach, down to its opposite and back to zero."""
    return reach * np.interp(np.linspace(0.0, 4.0, 4 * points + 1), [0, 1, 3, 4], [0, 1, -1, 0])


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 1.0])
def test_with_exponent_one_it_rises_and_falls_as_exponentials(share):
    way = np.linspace(0.0, 3.0, 301)
    there = torque(BoucWen(FORCE, YIELD, 1.0, share), YIELD * np.append(way, 3.0 - way[1:]))
    assert there[:301] == pytest.approx(FORCE * (1.0 - np.exp(-way)), abs=1e-5)
    # Back to zero z' = -(1 - a z) with a = 1 - 2 share, and from there as from rest.
    top, a = 1.0 - np.exp(-3.0), 1.0 - 2.0 * share
    down = top - way if a == 0.0 else 1.0 / a - (1.0 / a - top) * np.exp(a * way)
    to_zero = top if a == 0.0 else -np.log1p(-a * top) / a
    beyond = way > to_zero
    down[beyond] = np.exp(to_zero - way[beyond]) - 1.0
    assert there[300:] == pytest.approx(FORCE * down, abs=2e-5)


def test_with_exponent_two_it_rises_as_a_hyperbolic_tangent():
    way = np.linspace(0.0, 4.0, 101)
    assert torque(BoucWen(FORCE, YIELD, 2.0), YIELD * way) == pytest.approx(
        FORCE * np.tanh(way), abs=1e-5
    )


@settings(max_examples=15)
@given(exponents, shares, st.integers(0, 2**32 - 1))
def test_an_integrator_in_time_finds_the_same_torque(exponent, share, seed):
    law = BoucWen(FORCE, YIELD, exponent, share)
    turns = YIELD * np.cumsum(np.random.default_rng(seed).uniform(-2.0, 2.0, 6))
    points = np.concatenate([[0.0], turns])
    path = np.interp(np.linspace(0.0, 6.0, 61), np.arange(7), points)
    kept, found = np.zeros(1), [0.0]
    for leg in range(6):
        speed = points[leg + 1] - points[leg]
        times = np.linspace(0.0, 1.0, 11)
        there = solve_ivp(
            lambda _, z, speed=speed: law.rates(speed, z),
            (0.0, 1.0),
            kept,
            t_eval=times,
            rtol=1e-9,
            atol=1e-13,
            max_step=0.01,
        ).y
        kept = there[:, -1]
        found += [law.torque(one) for one in there.T[1:]]
    assert torque(law, path) == pytest.approx(found, abs=1e-4 * FORCE)
    # And in one step between reversals, as integrators of mechanisms take it.
    state = np.zeros(1)
    for way in np.diff(points):
        state = law.moved(state, way)
    assert law.torque(state) == pytest.approx(found[-1], abs=1e-4 * FORCE)


@given(exponents, shares, st.floats(-0.95, 0.95), st.sampled_from([-1.0, 1.0]))
def test_its_tangent_is_the_slope_of_its_torque(exponent, share, z, direction):
    law, kept, step = BoucWen(FORCE, YIELD, exponent, share), np.array([z * YIELD]), 1e-6 * YIELD
    numerical = (law.torque(law.moved(kept, direction * step)) - law.torque(kept)) / step
    assert law.tangent(kept, direction) == pytest.approx(
        # Between the steps of the rise it follows cubics, whose slopes are as good as this.
        direction * numerical,
        rel=2e-3,
        abs=5e-4 * FORCE / YIELD,
    )


@settings(max_examples=25)
@given(exponents, shares, st.floats(0.05, 4.0))
def test_a_loop_takes_energy(exponent, share, reach):
    path = np.tile(YIELD * back_and_forth(reach)[1:], 2)
    there = torque(BoucWen(FORCE, YIELD, exponent, share), path, recurs=True)[-800:]
    way = np.diff(path[-800:], prepend=path[-1])
    lost = float(np.sum(there * way))
    assert lost > 0.0
    # Never more than dry friction of the same force would.
    assert lost < 4.0 * FORCE * reach * YIELD


@pytest.mark.parametrize(("exponent", "share"), [(1.0, 1.0), (1.5, 0.3), (3.0, 0.6)])
@pytest.mark.parametrize("load", [0.0, 5.0])
@pytest.mark.parametrize("reach", [0.3, 2.0])
def test_a_motion_that_recurs_has_forgotten_how_it_began(exponent, share, load, reach):
    law = BoucWen(FORCE, YIELD, exponent, share)
    passage = YIELD * (load + back_and_forth(reach, 40)[1:])
    found = torque(law, np.tile(passage, 2), recurs=True)[-len(passage) :]
    often = torque(law, np.tile(passage, 4000))[-len(passage) :]
    assert found == pytest.approx(often, abs=1e-6 * FORCE)


def test_a_position_that_is_no_number_leads_to_none():
    path = YIELD * np.array([0.5, np.nan, 1.0, 0.2] * 2)
    for recurs in (False, True):
        last = torque(BoucWen(FORCE, YIELD), path, recurs)[-3:]
        assert np.isnan(last).all()


def test_a_port_that_rests_bears_what_wound_it_up():
    law = BoucWen(FORCE, YIELD)
    rests = np.full(8, 2.0 * YIELD)
    wound_up = pytest.approx(FORCE * (1.0 - np.exp(-2.0)), rel=1e-5)
    assert torque(law, rests, recurs=True) == wound_up
    # Rounding is no motion, and a port that rests keeps all of it.
    assert torque(law, rests * (1.0 + 1e-15 * np.arange(8.0)), recurs=True) == wound_up
    kept, _ = law.recall(rests[None])
    assert np.all(kept[0, 0, 1:] == 1.0)


def with_loop(name, law):
    model = preset(name)
    return replace(model, effects=(*model.effects, LawAtPort("bouc_wen_hysteresis", "mesh", law)))


@pytest.mark.nightly
def test_a_drive_that_runs_on_repeats_itself_as_an_integrator_finds():
    """Where a loop turns back its torque has a corner, which needs more harmonics."""
    model = with_loop("resonant", BoucWen(1.0, YIELD, 1.0, 0.8))
    # What the start left over dies out with J_in / B_in, 0.12 s with ten times the damping B_in.
    design = model.nominal * [1.0, 1.0, 1.0, 10.0, 1.0]
    run = simulate_drive(model, design, settle=1.2)
    coefficients = model.coefficients(design[None])
    few = torus_of(coefficients)
    missed = []
    for finer in (1, 3):
        torus = Torus(few.fundamentals, [finer * most for most in few.highest])
        found = harmonic_balance(coefficients, torus=torus).spectrum().at(run.input_angle)[0]
        missed.append(np.abs(found - run.transmission_error).max() / ARCSEC)
    # Of 80 arcsec.
    assert missed[1] < 0.02
    assert missed[1] < 0.25 * missed[0]


def test_a_sweep_of_the_load_is_carried_by_spring_and_loop_together():
    law = BoucWen(5.0, YIELD, 1.5, 0.7)
    model = with_loop("calibrated", law)
    coefficients = model.coefficients(model.nominal[None])
    load = 40.0 * back_and_forth(1.0, 30)
    torsion = quasi_static_torsion(coefficients, load)[0]
    carried = coefficients.stiffness[0] * torsion + torque(law, torsion)
    assert carried == pytest.approx(load, abs=1e-3)
    # It lags behind: at the same load it is twisted further on the way down.
    assert torsion[45] > torsion[15] + 1e-6


@pytest.mark.parametrize(
    ("field", "bad"),
    [
        ("force", (np.nan, 1e-4)),
        ("torsion", (1.0, 0.0)),
        ("torsion", (1.0, np.inf)),
        ("exponent", (1.0, 1e-4, 0.4)),
        ("exponent", (1.0, 1e-4, 9.0)),
        ("exponent", (1.0, 1e-4, np.nan)),
        ("share", (1.0, 1e-4, 1.0, 0.0)),
        ("share", (1.0, 1e-4, 1.0, -0.5)),
        ("share", (1.0, 1e-4, 1.0, 2.1)),
    ],
)
def test_numbers_that_are_none_of_such_a_loop_are_refused(field, bad):
    with pytest.raises(InvalidInput, match=rf"^bouc_wen_hysteresis\.{field} "):
        BoucWen(*bad)


@given(st.floats(0.5, 8.0), st.floats(0.01, 2.0))
def test_every_rise_goes_up_from_minus_one_to_one(exponent, share):
    z, slope, zero, *_ = rise_of(exponent, share)
    assert np.all(np.diff(z) >= 0.0)
    assert np.all(slope >= 0.0)
    assert (z[zero], z[-1]) == (0.0, pytest.approx(1.0, abs=1e-8))
    assert z[1] > -1.0
    assert z[0] <= -1.0 or zero == 1000
