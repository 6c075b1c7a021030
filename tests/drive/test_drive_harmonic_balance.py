"""Harmonic balance against the integrator and closed forms; laws, hysteresis and the torus."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_cases import EFFECTS, LAWS, memoryless
from night import others_at_night
from scipy.integrate import solve_ivp

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    PRESETS,
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    preset,
    simulate_drive,
)
from pymoo_hdte.drive._effects import (
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    effect_from_fields,
)
from pymoo_hdte.drive._solve.angle_equations import AngleEquations
from pymoo_hdte.drive._solve.free_angle import harmonic_balance
from pymoo_hdte.drive._solve.fundamentals import fundamental_orders, multiples_of
from pymoo_hdte.drive._solve.linear_systems import factored, multiplication, stacked, unstacked
from pymoo_hdte.drive._solve.newton import Place
from pymoo_hdte.drive._solve.recursion import Recollection
from pymoo_hdte.drive._solve.steady_motion import SpeedLoop
from pymoo_hdte.drive._solve.torus import Torus
from pymoo_hdte.effects.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    StribeckFriction,
)
from pymoo_hdte.effects.hysteresis import MaxwellSlip, slip_along
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.units import ARCSEC

MEMORYLESS = memoryless(EFFECTS)


def with_effects(model, *effects):
    return replace(model, effects=(*model.effects, *effects))


@pytest.mark.parametrize("name", others_at_night(PRESETS, "calibrated"))
def test_presets_agree_with_the_integrator_though_the_angle_is_free(name):
    """Hill's method, which prescribes the angle, is off by 2e-3 on ``resonant``."""
    model = preset(name)
    balance = harmonic_balance(model.coefficients(model.nominal[None]))
    found = balance.spectrum().peak_to_peak(model.sheet.ratio)[0] / ARCSEC
    assert found == pytest.approx(
        simulate_drive(model, model.nominal, rtol=1e-9).dte_arcsec(), rel=1e-5
    )


@pytest.mark.parametrize(
    "effect", others_at_night(MEMORYLESS, *MEMORYLESS[::12]), ids=lambda effect: effect.name
)
def test_every_law_agrees_with_the_integrator_along_the_whole_turn(effect):
    model = with_effects(preset("resonant"), effect)
    # What the start left over dies out with J_in / B_in, 0.12 s with ten times the damping B_in.
    design = model.nominal * [1.0, 1.0, 1.0, 10.0, 1.0]
    run = simulate_drive(model, design, settle=1.2)
    balance = harmonic_balance(model.coefficients(design[None]))
    expected = balance.spectrum().at(run.input_angle)[0]
    assert run.transmission_error == pytest.approx(expected, abs=1e-3 * ARCSEC)


def test_a_law_of_no_strength_leaves_the_model_as_it_is():
    model = preset("published")
    idle = with_effects(model, LawAtPort("torque_ripple", "input", PeriodicTorque(6.0, 0.0, 0.0)))
    designs = model.nominal * np.array([[0.8], [1.0], [1.2]])
    assert idle.dte_arcsec(designs) == pytest.approx(model.dte_arcsec(designs), rel=1e-6)


def test_the_motor_does_the_work_of_the_load_and_of_the_damper():
    """With the reaction of theta_s all other torques derive from one energy."""
    model = with_effects(
        preset("published"),
        LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(1e9)),
        DampingReference(3.0),
        KinematicReaction(),
    )
    coefficients = model.coefficients(model.nominal[None])
    smooth = replace(coefficients, input_damping=np.zeros(1), output_damping=0.0)

    def missing_torque(coefficients):
        balance = harmonic_balance(coefficients)
        rate = coefficients.input_speed * balance.torus.derivative(balance.torsion)
        lost = coefficients.damping[0] * np.sum(np.abs(rate) ** 2) / 2.0
        supplied = balance.motor_torque[0, 0].real - coefficients.load_torque / coefficients.ratio
        return supplied - lost / coefficients.input_speed, lost / coefficients.input_speed

    missing, lost = missing_torque(smooth)
    assert abs(missing) < 1e-3 * lost
    missing, lost = missing_torque(replace(smooth, reaction=0.0))
    assert abs(missing) > 0.1 * lost


def test_a_stiff_speed_loop_prescribes_the_angle():
    model = preset("resonant")
    coefficients = model.coefficients(model.nominal[None])
    held = harmonic_balance(coefficients, motor=SpeedLoop(1e4, 0.0))
    assert np.abs(held.lead).max() < 1e-7
    free = harmonic_balance(coefficients)
    assert np.abs(free.lead).max() > 1e-3


def test_the_loop_torque_is_what_its_gains_say():
    model = preset("resonant")
    coefficients = model.coefficients(model.nominal[None])
    loop = SpeedLoop(0.02, 0.5)
    balance = harmonic_balance(coefficients, motor=loop)
    # Linear in the fluctuation: w - Omega is Omega d lead / d alpha but for second order.
    rate = coefficients.input_speed * balance.torus.derivative(balance.lead)
    expected = -loop.proportional * rate - loop.integral * balance.lead
    moving = balance.torus.orders != 0.0
    size = np.abs(expected).max()
    assert balance.motor_torque[:, moving] == pytest.approx(expected[:, moving], abs=5e-3 * size)


def test_the_coupling_torque_is_the_load_and_what_the_load_inertia_takes():
    model = preset("resonant")
    coefficients = model.coefficients(model.nominal[None])
    # With the input held at its speed the output's acceleration is that of -theta_d.
    balance = harmonic_balance(coefficients, motor=SpeedLoop(1e4, 0.0))
    frequency = coefficients.input_speed * balance.torus.orders
    expected = coefficients.load_inertia * frequency**2 * balance.transmission_error
    expected[:, 0] = coefficients.load_torque
    size = np.abs(expected[:, 1:]).max()
    assert balance.coupling_torque == pytest.approx(expected, abs=1e-4 * size)


def test_a_drive_without_static_error_turns_evenly_under_its_load():
    model = preset("published")
    coefficients = model.coefficients(model.nominal[None])
    empty = replace(coefficients, error_orders=np.empty(0), error_phasors=np.empty((1, 0)))
    balance = harmonic_balance(empty, motor=SpeedLoop(10.0, 0.0))
    wound = coefficients.mean_mesh_torque / coefficients.stiffness[0]
    assert balance.torsion[0, 0].real == pytest.approx(wound)
    assert np.abs(balance.torsion[0, 1:]).max() < 1e-12 * wound


def test_laws_have_the_signs_that_their_names_say():
    stiffness = np.array([2.5e4])

    def torque(law, position=0.0, angle=0.0):
        state = PortState(np.array([position]), np.ones(1), periodic_phase(angle), stiffness)
        return float(np.ravel(law.respond(state).torque)[0])

    # Beyond the clearance the spring has lost K b; within it, K d: nothing is left of K d.
    assert torque(DeadZone(1e-4), 5e-4) == pytest.approx(-2.5e4 * 1e-4)
    assert torque(DeadZone(1e-4), 5e-5) == pytest.approx(-2.5e4 * 5e-5, rel=1e-3)
    assert torque(PeriodicClearance(1.0, 0.0, 5e-5, 5e-5), 5e-4) == pytest.approx(-2.5e4 * 1e-4)
    assert torque(PeriodicClearance(1.0, np.pi, 5e-5, 5e-5), 5e-4) == pytest.approx(0.0, abs=1e-6)
    # Where the variation would make it less than none, there is none.
    assert torque(PeriodicClearance(1.0, np.pi, 5e-5, 8e-5), 5e-4) == pytest.approx(0.0, abs=1e-6)
    # Nothing is added before a sharp corner, and a straight line with the added stiffness beyond.
    corner = HardeningStiffness(0.0, 0.2, 1e-4, 20.0)
    assert torque(corner, 5e-5) == pytest.approx(0.0, abs=1e-6)
    assert torque(corner, 5e-4) == pytest.approx(0.2 * 2.5e4 * 4e-4)
    # A ripple drives, everything else opposes.
    assert torque(PeriodicTorque(6.0, 0.0, 0.1)) == pytest.approx(-0.1)
    assert torque(PeriodicFriction(2.0, 0.0, 0.1)) == pytest.approx(0.1)
    line = KinematicErrorLine(3.0, 2.0, 0.7)
    model = preset("published")
    coefficients = line.apply(model.coefficients(model.nominal[None]))
    angle = 0.3
    phasor = coefficients.error_phasors[0, -1] * np.exp(1j * coefficients.error_orders[-1] * angle)
    assert phasor.real == pytest.approx(2.0 * np.sin(3.0 * angle + 0.7))


def test_friction_of_the_output_varies_with_the_output_turn():
    effect = LawAtPort("position_dependent_friction", "output", PeriodicFriction(1.0, 0.0, 1.0))
    model = with_effects(preset("published"), effect)
    coefficients = model.coefficients(model.nominal[None])
    balance = harmonic_balance(coefficients, motor=SpeedLoop(10.0, 0.0))
    place, _ = balance.torus.place(1.0 / 101.0)
    # Slow and with a held input: the mesh carries the friction, torsion by torsion.
    expected = 1.0 / coefficients.stiffness[0]
    assert balance.torsion[0, place] == pytest.approx(expected, rel=1e-2)


def test_an_unstable_drive_is_refused_with_laws_as_without():
    effects = (
        LoadInertia(0.395),
        DampingReference(0.01),
        MeshStiffnessVariation(0.3, 0.0),
    )
    model = replace(preset("published"), effects=effects).at(280.0, 40.0)
    with pytest.raises(UnstableDrive):
        model.dte_arcsec(model.nominal[None])
    for more in (EFFECTS[5], KinematicReaction(1e-9)):
        with pytest.raises(UnstableDrive):
            with_effects(model, more).dte_arcsec(model.nominal[None])


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_no_designs_give_no_values_with_laws_either(effect):
    assert with_effects(preset("published"), effect).dte_arcsec(np.empty((0, 5))).shape == (0,)


@pytest.mark.parametrize("ratio", [60, 96, 101, 120, 161])
def test_orders_of_the_output_turn_share_an_angle(ratio):
    fundamentals = fundamental_orders([1.0, 2.0, 1.0 / ratio, 4.0 / ratio])
    torus = Torus(fundamentals, (2, 4))
    assert len(fundamentals) == 2
    place, _ = torus.place(4.0 / ratio)
    assert torus.orders[place] == pytest.approx(4.0 / ratio)


@pytest.mark.parametrize(
    "law",
    [
        lambda bad: PeriodicClearance(1.0, 0.0, bad, 0.0),
        lambda bad: PeriodicFriction(1.0, 0.0, bad),
        lambda bad: PeriodicTorque(1.0, 0.0, bad),
    ],
)
@pytest.mark.parametrize("bad", [np.nan, "a"])
def test_strengths_of_periodic_laws_are_checked(law, bad):
    with pytest.raises(InvalidInput, match=r"half_width|level|amplitude"):
        law(bad)


def test_every_row_may_have_its_own_condition():
    model = preset("calibrated")
    speeds, loads = np.array([50.0, 200.0]), np.array([10.0, 40.0])
    coefficients = model.coefficients(np.tile(model.nominal, (2, 1)))
    together = harmonic_balance(coefficients, input_speed=speeds, load_torque=loads)
    for row in range(2):
        alone = harmonic_balance(
            model.at(speeds[row], loads[row]).coefficients(model.nominal[None])
        )
        assert together.torsion[row] == pytest.approx(alone.torsion[0], abs=1e-9 * ARCSEC)


def test_mean_torsion_under_a_cubic_spring_is_the_static_one_at_low_speed():
    model = with_effects(preset("published"), EFFECTS[0]).at(0.1, 40.0)
    coefficients = model.coefficients(model.nominal[None])
    mean = harmonic_balance(coefficients).torsion[0, 0].real
    cubic = EFFECTS[0].law.coefficient
    stiffness = coefficients.stiffness[0]
    static = np.roots([cubic, 0.0, stiffness, -coefficients.mean_mesh_torque])
    assert mean == pytest.approx(static[np.abs(static.imag) < 1e-12].real.item(), rel=1e-6)


def test_springs_integrated_over_time_are_those_laid_out_along_the_path():
    law = MaxwellSlip(1.0, 2e-4)
    time = np.linspace(0.0, 3.0, 4001)
    path = 3e-4 * np.sin(2 * np.pi * time) * np.exp(-0.5 * time)

    def rates(t, stretch):
        speed = (
            3e-4
            * np.exp(-0.5 * t)
            * (2 * np.pi * np.cos(2 * np.pi * t) - 0.5 * np.sin(2 * np.pi * t))
        )
        return law.rates(speed, stretch)

    found = solve_ivp(
        rates, (0.0, 3.0), np.zeros(4), t_eval=time, rtol=1e-6, atol=1e-9, max_step=2e-3
    )
    stretch, _ = slip_along(path[None], law._slips)
    expected = np.tensordot(law._stiffnesses, stretch, axes=1)[0]
    assert [law.torque(springs) for springs in found.y.T] == pytest.approx(expected, abs=5e-3)


def along(path):
    """The state of a port that passes these points once."""
    return PortState(path, path, None, None, lambda values: values, lambda values: values)


@given(st.floats(0.1, 5.0), st.floats(1e-5, 1e-3), st.floats(0.05, 3.0))
def test_maxwell_slip_obeys_masing(force, torsion, reach):
    """A loop between +-A is the virgin curve at twice the scale, from either end."""
    law = MaxwellSlip(force, torsion)
    slips, stiffnesses = law._slips, law._stiffnesses

    def virgin(d):
        return float(np.sum(stiffnesses * np.minimum(d, slips)))

    end = reach * torsion
    up, down = np.linspace(0.0, end, 50), np.linspace(end, -end, 99)
    torque = law.respond(along(np.concatenate([up, down])[None])).torque[0]
    assert torque[:50] == pytest.approx([virgin(d) for d in up], abs=1e-9 * force)
    masing = [virgin(end) - 2.0 * virgin((end - d) / 2.0) for d in down]
    assert torque[50:] == pytest.approx(masing, abs=1e-9 * force)
    assert law.torque(np.full(4, 2.0 * torsion)) == pytest.approx(force)


@pytest.mark.parametrize(
    ("law", "positions"),
    [
        (HardeningStiffness(1e9), (1e-4, -2e-3)),
        (SoftWindup(0.3, 2e-4), (1e-5, -2e-4, 1e-3)),
        (HardeningStiffness(0.0, 0.3, 2e-4, 8.0), (1e-5, -2e-4, 1e-3)),
        (DeadZone(1e-4), (5e-5, 3e-4, -2e-4)),
        (PeriodicClearance(2.0, 0.3, 5e-5, 5e-5), (1e-5, 3e-4)),
    ],
)
def test_slopes_are_the_derivatives_of_torques(law, positions):
    def torque(d):
        state = PortState(np.array([d]), np.zeros(1), periodic_phase(0.4), np.array([2.5e4]))
        return law.respond(state)

    for d in positions:
        step = 1e-9
        numerical = (torque(d + step).torque - torque(d - step).torque) / (2 * step)
        # Of a torque of about 1 N.m the difference quotient keeps some seven digits.
        assert torque(d).slope == pytest.approx(numerical, rel=1e-4, abs=1e-2)


@pytest.mark.parametrize(
    "law",
    [
        CoulombFriction(0.3),
        StribeckFriction(0.2, 0.1, 20.0),
        PeriodicFriction(1.0, 0.2, 0.1),
        NonlinearDrag(1e-5),
        NonlinearDrag(1e-5, 3.0, 100.0),
        NonlinearDrag(1e-5, 0.4, 100.0),
    ],
)
@given(speed=st.floats(0.5, 300.0), sign=st.sampled_from([-1.0, 1.0]))
def test_friction_opposes_either_direction_alike_and_its_damping_is_its_derivative(
    law, speed, sign
):
    def torque(rate):
        state = PortState(np.zeros(1), np.array([rate]), periodic_phase(0.4), np.ones(1))
        return law.respond(state)

    assert torque(-speed).torque == pytest.approx(-torque(speed).torque)
    step = 1e-4 * speed
    rate = sign * speed
    numerical = (torque(rate + step).torque - torque(rate - step).torque) / (2 * step)
    assert np.broadcast_to(torque(rate).damping, 1) == pytest.approx(numerical, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_effects_survive_their_table(effect):
    assert effect_from_fields(Fields(effect.to_dict(), "effect")) == effect


def test_every_law_is_in_the_list_of_effects_tested_here():
    assert set(LAWS) == {effect.name for effect in EFFECTS if isinstance(effect, LawAtPort)}


def test_a_law_stands_only_where_it_can():
    with pytest.raises(InvalidInput, match=r"backlash\.port is 'input', allowed: one of 'mesh'"):
        LawAtPort("backlash", "input", DeadZone(1e-5))
    with pytest.raises(InvalidInput, match="a DeadZone"):
        LawAtPort("backlash", "mesh", HardeningStiffness(1.0))
    twice = [LawAtPort("coulomb_friction", port, CoulombFriction(0.1)) for port in ("input",) * 2]
    with pytest.raises(InvalidInput, match="at each port"):
        with_effects(preset("published"), *twice)


def test_a_law_reaches_the_robust_problem():
    plain = preset("published")
    softer = with_effects(
        plain,
        LoadInertia(0.4),
        DampingReference(3.0),
        LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 1.0)),
    )
    linear = replace(plain, effects=(LoadInertia(0.4), DampingReference(3.0)))
    # The torsion stays far below 1 rad: the law takes 30 % of the stiffness.
    design = plain.nominal.copy()
    design[1] *= 0.7
    assert softer.dte_arcsec(plain.nominal[None]) == pytest.approx(
        linear.dte_arcsec(design[None]), rel=0.01
    )
    assert RobustDTE(softer, order=1).evaluate(plain.nominal[None, 1:])[0, 0] > 0.0


def test_orders_need_the_fewest_angles():
    assert fundamental_orders([1.0, 2.0, 6.0]) == (1.0,)
    assert fundamental_orders([1.0, 2.0, 2.02]) == pytest.approx((1.0, 0.02))
    assert fundamental_orders([2.02, 4.04, 1 / 101]) == pytest.approx((1.0, 1 / 101, 0.02))
    # Three times 0.02 is 0.06, and 1.98 is 2 - 0.02.
    assert fundamental_orders([2.02, 4.06, 1.98]) == pytest.approx((1.0, 0.02))


def test_a_crest_with_many_harmonics_takes_one_angle_and_moves_alike():
    """Each angle more multiplies the equations: such a pair was judged for 42 minutes."""
    multiples = np.array([1, 2, 5, 10]) / 101.0
    lines = [KinematicErrorLine(order, 2.0 * ARCSEC, 0.7) for order in multiples]
    model = with_effects(
        preset("resonant"), *lines, LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 3e-4))
    )
    coefficients = model.coefficients(model.nominal[None])
    fundamentals = fundamental_orders([1.0, 2.0, *multiples])
    assert fundamentals == pytest.approx((1.0, 1.0 / 101.0))
    one = harmonic_balance(coefficients)
    several = Torus((1.0, 1.0 / 101.0, 5.0 / 101.0), (one.torus.highest[0], 3, 3))
    other = harmonic_balance(coefficients, torus=several)
    assert 2 * len(one.torus.orders) < len(several.orders)
    for order in (1.0, 2.0, *multiples, 1.0 + multiples[3]):
        (here, _), (there, _) = one.torus.place(order), several.place(order)
        size = np.abs(one.torsion).max()
        assert abs(one.torsion[0, here]) == pytest.approx(
            abs(other.torsion[0, there]), abs=1e-6 * size
        )


@given(st.lists(st.floats(0.05, 6.0), min_size=1, max_size=3), st.integers(1, 3))
def test_all_orders_are_sums_of_their_fundamentals(orders, harmonics):
    multiples = [k * order for order in orders for k in range(1, harmonics + 1)]
    fundamentals = fundamental_orders([1.0, 2.02, *multiples])
    # The harmonics of an order need no angle besides that of the order.
    assert len(fundamentals) <= 2 + len(orders)
    for order in (1.0, 2.02, *multiples):
        assert multiples_of(fundamentals, order) @ fundamentals == pytest.approx(order, abs=1e-7)


TORUS = Torus((1.0, 0.02), (4, 2))


@given(st.integers(0, 2**32 - 1))
def test_products_and_derivatives_on_the_torus(seed):
    rng = np.random.default_rng(seed)
    size = len(TORUS.orders)
    phasors = rng.standard_normal((2, size)) + 1j * rng.standard_normal((2, size))
    phasors[:, 0] = phasors[:, 0].real
    values = TORUS.signal(phasors)
    assert TORUS.phasors(values) == pytest.approx(phasors, abs=1e-12)
    assert unstacked(stacked(phasors)) == pytest.approx(phasors)
    factor = rng.standard_normal((2, TORUS.size))
    product = np.einsum("nij,nj->ni", TORUS.product_matrix(factor), stacked(phasors))
    assert unstacked(product) == pytest.approx(TORUS.phasors(factor * values), abs=1e-10)
    turned = np.einsum("nij,nj->ni", multiplication(1j * phasors), stacked(phasors))
    assert unstacked(turned) == pytest.approx(1j * phasors**2, abs=1e-10)
    back = TORUS.integral(TORUS.derivative(phasors))
    assert back[:, 1:] == pytest.approx(phasors[:, 1:])
    path = TORUS.path(values)
    assert path.shape == (2, 2 * TORUS.size)
    assert np.array_equal(TORUS.back(path), values)


def test_places_of_orders():
    place, conjugate = TORUS.place(2.02)
    assert TORUS.orders[place] == pytest.approx(2.02)
    assert not conjugate
    angle = 0.7
    assert TORUS.phase(2.02) == pytest.approx(
        2 * TORUS.phase(1.0) + TORUS.phase(0.02), abs=angle * 1e-12
    )
    with pytest.raises(InvalidInput, match=r"order is 9\.5"):
        TORUS.place(9.5)


@pytest.mark.parametrize("highest", [(4, 2), (9, 2, 3)])
def test_harmonics_on_a_grid_are_their_sum_there_and_come_back(highest, rng):
    torus = Torus((1.0, 0.02, 0.37)[: len(highest)], highest)
    phasors = rng.standard_normal((3, len(torus.orders), 2)) @ [1.0, 1j]
    phasors[:, 0] = phasors[:, 0].real
    phases = np.array([torus.phase(order) for order in torus.orders])
    values = torus.signal(phasors)
    assert values == pytest.approx((phasors @ np.exp(1j * phases)).real, abs=1e-10)
    assert np.abs(torus.phasors(values) - phasors).max() < 1e-12


@pytest.mark.parametrize("highest", [(3,), (4, 2), (3, 2, 1)])
def test_what_is_recalled_is_a_recursion_once_it_repeats(highest, rng):
    """Of parts that slip now and then, that fade, and that keep all, as from the first passage."""
    torus = Torus((1.0, 0.02, 0.37)[: len(highest)], highest)
    n, size = 2, torus.size
    phasors = rng.standard_normal((n, len(torus.orders), 2)) @ [1.0, 1j]
    phasors[:, 0] = phasors[:, 0].real
    slips, keeps = rng.random((2, n, size)) < 0.3, np.ones((n, size))
    kept = np.array([1.0 - slips[0], rng.uniform(0.8, 1.0, (n, size)), keeps])
    gained = rng.standard_normal(kept.shape) * (kept > 0.0)
    # The last part slips in its first passage only, and is then stretched and released.
    gained[2] = 1.5
    first = np.array([kept[0], kept[1], 1.0 - slips[1]])
    places = np.array([rng.permutation(size) for _ in range(n)])
    values = np.take_along_axis(torus.signal(phasors), places, axis=1)
    parts, before, recalled = np.zeros((3, n)), np.zeros(n), np.empty((n, size))
    for passage in range(60):
        for step in range(size):
            keep = (kept if passage else first)[..., step]
            parts = keep * parts + gained[..., step] * (values[:, step] - before)
            before = values[:, step]
            there = parts.sum(axis=0) - gained[..., step].sum(axis=0) * before
            recalled[np.arange(n), places[:, step]] = there
    both = np.concatenate([first, kept], axis=2), np.concatenate([gained, gained], axis=2)
    matrix = torus.recall_matrix(Recollection(*both, places))
    product = unstacked(np.einsum("nij,nj->ni", matrix, stacked(phasors)))
    assert product == pytest.approx(torus.phasors(recalled), abs=1e-9 * np.abs(product).max())


def test_springs_together_pull_as_much_as_one_after_the_other(rng):
    path = np.cumsum(rng.standard_normal((3, 200)), axis=1)
    law = MaxwellSlip(2.0, 1.5, 1.3)
    found = law.respond(along(path))
    stretch, sticking = slip_along(path, law._slips)
    weights = law.force / (4 * law._slips)
    assert found.torque == pytest.approx(np.tensordot(weights, stretch, axes=1))
    assert found.slope == pytest.approx(np.tensordot(weights, sticking, axes=1))


def test_a_singular_matrix_leads_to_no_number():
    singular = factored(np.array([[1.0, 2.0], [2.0, 4.0]]))
    assert not np.isfinite(singular.solve(np.ones(2))).any()


@pytest.mark.parametrize("motor", [SpeedLoop(), SpeedLoop(0.02, 0.5)])
@pytest.mark.parametrize(
    "effects",
    [
        (),
        (LawAtPort("coulomb_friction", "output", CoulombFriction(0.3)),),
        (LawAtPort("soft_windup", "mesh", SoftWindup(0.2, 1e-4)),),
        (LawAtPort("hysteresis", "mesh", MaxwellSlip(5.0, 1e-4)),),
    ],
)
def test_the_place_of_some_rows_is_what_is_evaluated_there(effects, motor):
    """A step of those rows alone goes where it would with places of their own."""
    model = with_effects(preset("calibrated"), *effects)
    coefficients = model.coefficients(np.tile(model.nominal, (4, 1)))
    speed, load = np.array([20.0, -60.0, 90.0, 150.0]), np.array([5.0, 20.0, -20.0, 40.0])
    motion = harmonic_balance(coefficients, input_speed=speed, load_torque=load, motor=motor)
    equations = AngleEquations(coefficients, speed, load, motor, motion.torus)
    torsion = 1.1 * motion.torsion
    rows = np.array([1, 3])
    some = equations.rows(rows)
    kept = Place(equations, torsion, motion.energy).rows(some, rows)
    fresh = Place(some, torsion[rows], motion.energy[rows])
    np.testing.assert_allclose(kept.distance, fresh.distance, rtol=1e-12)
    both = [one.newton_step(np.ones((2, 1)), one.systems(np.arange(2))) for one in (kept, fresh)]
    for found, expected in zip(*both, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
