"""Harmonic balance with strong hysteresis, and what forms of friction its law stands for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from pymoo_hdte.drive import LawAtPort, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.drive._solve.angle_equations import AngleEquations
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.drive._solve.linear_systems import stacked, unstacked
from pymoo_hdte.drive._solve.newton import Place
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.units import ARCSEC

SPRINGS = LawAtPort("hysteresis", "mesh", MaxwellSlip(3.0, 1e-4))
FADING = [
    LawAtPort("bouc_wen_hysteresis", "mesh", BoucWen(3.0, torsion, exponent, share))
    for torsion, exponent, share in [(3e-4, 1.0, 0.6), (5e-4, 2.5, 1.0), (2e-3, 1.5, 0.3)]
]


def drive(name, force, torsion, input_speed=200.0, load_torque=40.0):
    return drive_with(
        name,
        LawAtPort("hysteresis", "mesh", MaxwellSlip(force, torsion)),
        input_speed=input_speed,
        load_torque=load_torque,
    )


def drive_with(name, *effects, input_speed=200.0, load_torque=40.0):
    model = preset(name)
    model = replace(model, effects=(*model.effects, *effects)).at(input_speed, load_torque)
    return model.coefficients(model.nominal[None])


@pytest.mark.parametrize("effects", [(SPRINGS,), *((one,) for one in FADING), (SPRINGS, FADING[0])])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_slope_and_memory_together_are_the_derivative_of_the_torque(direction, effects, rng):
    coefficients = drive_with("resonant", *effects)
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
    memory = torus.recall_matrix(equations.recollection(torsion))

    def along(matrix):
        return unstacked(np.einsum("nij,nj->ni", matrix, stacked(change)))

    scale = np.abs(numerical).max()
    assert along(slope + memory) == pytest.approx(numerical, abs=1e-4 * scale)
    assert np.abs(along(slope) - numerical).max() > 1e-2 * scale


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("ripple", [0.1, 0.01])
def test_the_mean_torque_of_a_loop_is_that_of_its_small_motion(exponent, ripple):
    """It fades: the mean of the motion moves the drive's spring alone, however small the loop."""
    force, torsion = 8.0, 1e-4
    law = BoucWen(force, torsion, exponent, 0.7)
    coefficients = drive_with("calibrated", LawAtPort("bouc_wen_hysteresis", "mesh", law))
    torus = torus_of(coefficients)
    still, load = np.array([200.0]), np.array([40.0])
    equations = AngleEquations(coefficients, still, load, SpeedLoop(), torus)
    there = np.zeros((1, len(torus.orders)), dtype=complex)
    there[:, 0], there[:, torus.place(2.0)[0]] = 1e-3, ripple * torsion
    energy = np.zeros_like(there)
    energy[:, 0] = still**2 / 2.0
    motion = equations.motion(there, energy)
    of_mean = torus.product_matrix(motion.mesh_slope) + torus.recall_matrix(
        equations.recollection(there)
    )
    stiffness = coefficients.stiffness[0]
    assert of_mean[0, 0, 0] == pytest.approx(stiffness, abs=1e-3 * force / torsion)
    mean = torus.phasors(motion.mesh_torque)[0, 0].real
    assert mean == pytest.approx(stiffness * 1e-3, abs=2e-2 * ripple * force)


@pytest.mark.parametrize("name", ["calibrated", "resonant"])
@pytest.mark.parametrize("force", [1.0, 5.0, 8.0])
@pytest.mark.parametrize("torsion", [5e-5, 1e-4, 2e-4])
def test_hysteresis_of_any_strength_converges_under_load(name, force, torsion):
    balance = harmonic_balance(
        drive(name, force, torsion), motor=SpeedLoop(0.02, 0.5), tolerance=1e-8
    )
    assert np.all(balance.converged)


@pytest.mark.parametrize(
    "law",
    [
        *(MaxwellSlip(force, 4e-5) for force in (2.5, 8.0)),
        *(
            BoucWen(force, 8e-5, exponent, share)
            for force in (2.0, 8.0)
            for exponent, share in ((1.0, 0.6), (2.5, 1.0), (4.0, 0.6))
        ),
    ],
)
def test_what_is_stiffer_than_the_gearing_converges_at_any_load_and_speed(law):
    """Most springs stick: without their memory the steps cycle between sticking and slipping."""
    name = "hysteresis" if isinstance(law, MaxwellSlip) else "bouc_wen_hysteresis"
    coefficients = drive_with("calibrated", LawAtPort(name, "mesh", law))
    speed, load = np.meshgrid([20.0, 100.0, 209.4], [0.0, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0])
    balance = harmonic_balance(
        coefficients.rows(np.zeros(speed.size, dtype=int)),
        input_speed=speed.ravel(),
        load_torque=load.ravel(),
        motor=SpeedLoop(0.02, 0.5),
        tolerance=1e-8,
    )
    assert np.all(balance.converged)


def test_matrices_of_nearby_cases_lead_to_the_same_states(monkeypatch):
    """In several blocks of rows, and from rows in another order that occur more than once."""
    coefficients = drive("calibrated", 2.5, 1e-4).rows(np.zeros(70, dtype=int))
    speed, load = np.linspace(20.0, 210.0, 70), np.linspace(0.0, 60.0, 70)
    motor = SpeedLoop(0.02, 0.5)
    start = harmonic_balance(
        coefficients, input_speed=speed, load_torque=load, motor=motor, tangents=True
    )
    rows = np.array([*range(69, -1, -1), *range(70), 3, 3, 66])
    nearby = replace(coefficients.rows(rows), stiffness=1.001 * coefficients.stiffness[rows])
    made = []
    systems = Place.systems
    monkeypatch.setattr(Place, "systems", lambda at, of: made.append(len(of)) or systems(at, of))

    def found(near):
        made.clear()
        motion = harmonic_balance(
            nearby, input_speed=speed[rows], load_torque=load[rows], motor=motor, start=near
        )
        return motion, sum(made)

    with_those, few = found(start.rows(rows))
    with_own, many = found(replace(start, tangents=None).rows(rows))
    assert np.all(with_those.converged & with_own.converged)
    scale = np.abs(with_own.torsion).max()
    assert with_those.torsion == pytest.approx(with_own.torsion, abs=1e-10 * scale)
    assert few == 70
    assert many >= len(rows) > 2 * few


def test_springs_that_slip_bear_their_force():
    """Without a static error nothing turns the torsion back: the load has wound it up for good."""
    coefficients = drive("published", 2.0, 1e-12)
    springs = harmonic_balance(
        replace(coefficients, error_phasors=0.0 * coefficients.error_phasors)
    )
    expected = (coefficients.mean_mesh_torque - 2.0) / coefficients.stiffness[0]
    assert springs.torsion[0, 0].real == pytest.approx(expected, abs=1e-3 * ARCSEC)


# --- other forms of friction before breakaway ----------------------------------------------------

FORCE, WAY = 1.5, 3e-4
FULL_LOOPS = 2e-3 * np.interp(
    np.arange(0.0, 6.0, 0.01), [0, 1, 3, 5, 6], [0.0, 1.0, -1.0, 1.0, 0.0]
)
CYCLE = 40
SMALL_LOOPS = 5e-4 - 4e-5 * (1.0 - np.cos(2.0 * np.pi * np.arange(6 * CYCLE + 1) / CYCLE))
LOADED = np.concatenate([np.linspace(0.0, 5e-4, 50, endpoint=False), SMALL_LOOPS])


def bristles(path, duration, breakaway=0.0, rate=0.02):
    """Return the force of Dahl's friction on a path in time; with ``breakaway`` that of LuGre's.

    z' = v - |v| z / slip, force = stiffness z; in LuGre's form the slip falls with the speed.
    """
    step, z, found = duration / len(path), 0.0, []
    for way in np.diff(path, prepend=0.0):
        slip = WAY * (1.0 + breakaway * np.exp(-((way / step / rate) ** 2)))
        end = np.sign(way) * slip
        z = end - (end - z) * np.exp(-np.abs(way) / slip)
        found.append(FORCE / WAY * z)
    return np.array(found)


def maxwell(values, path):
    law = MaxwellSlip(*np.exp(values))
    still = np.zeros((1, len(path)))
    state = PortState(path[None], still, lambda order: still, np.ones(1))
    return law.respond(state).torque[0]


def fitted_to(force, path):
    fits = [
        least_squares(
            lambda one: maxwell(one, path) - force,
            np.log([FORCE, share * WAY, 1.4]),
            diff_step=1e-3,
        )
        for share in (1.0, 2.0)
    ]
    return min(fits, key=lambda one: one.cost)


def creep(force):
    """Return how far the force at the same place moves from one small loop to the next."""
    return np.diff(force[-len(SMALL_LOOPS) :: CYCLE])


@pytest.mark.parametrize("breakaway", [0.0, 0.5], ids=["dahl", "lugre"])
def test_full_loops_of_other_forms_are_those_of_springs_that_slip(breakaway):
    """So that the name of the law stands for all of them, as its sentence says."""
    force = bristles(FULL_LOOPS, 1e3, breakaway)
    fit = fitted_to(force, FULL_LOOPS)
    assert np.sqrt(np.mean(fit.fun**2)) < 0.06 * np.abs(force).max()


@pytest.mark.parametrize("breakaway", [0.0, 0.5], ids=["dahl", "lugre"])
def test_small_reversals_under_a_load_tell_them_apart(breakaway):
    """Springs that slip close each small loop; Dahl's and LuGre's friction creeps."""
    springs = fitted_to(bristles(FULL_LOOPS, 1e3, breakaway), FULL_LOOPS).x
    assert creep(maxwell(springs, LOADED)) == pytest.approx(0.0, abs=1e-9)
    other = creep(bristles(LOADED, 1e3, breakaway))
    assert np.all(other[:3] < -0.03 * FORCE)


def test_only_lugre_changes_with_the_speed():
    slow, fast = (bristles(LOADED, duration, 0.5) for duration in (1e3, 1e-2))
    assert np.abs(slow - fast).max() > 0.1 * FORCE
    slow, fast = (bristles(LOADED, duration) for duration in (1e3, 1e-2))
    assert fast == pytest.approx(slow)
    assert "Dahl's or LuGre's" in effect_named("hysteresis").sentence


def test_a_motion_on_few_harmonics_is_where_one_on_more_begins():
    coefficients = drive_with("resonant", SPRINGS)
    few = harmonic_balance(coefficients)
    (highest, *beats), orders = few.torus.highest, few.torus.fundamentals
    more = Torus(orders, (highest + 4, *(most + 1 for most in beats)))
    whole = harmonic_balance(coefficients, torus=more)
    near = harmonic_balance(coefficients, torus=more, start=few, steps=6)
    assert not harmonic_balance(coefficients, torus=more, steps=6).converged[0]
    assert near.converged[0]
    assert near.torsion == pytest.approx(whole.torsion, abs=1e-9 * np.abs(whole.torsion).max())
