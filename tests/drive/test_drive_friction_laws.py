"""Friction that grows with the speed, or with the load, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from drive_mechanism import drive_mechanism
from hypothesis import given
from hypothesis import strategies as st
from planted_features import judged, known_data, library, measured
from quick_campaigns import CONDITIONS, quick_campaign
from virtual_rig_cases import BELIEVED, RIG, effect

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.drive import LawAtPort, SpeedLoop, harmonic_balance, preset
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.friction import SMOOTHING_SPEED, NonlinearDrag
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.load_friction import LoadFriction
from pymoo_hdte.effects.shear_thinning import ShearThinningDrag
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.simulation import simulate_mechanism

STIFF = SpeedLoop(1e4, 0.0)
"""Holds the input at its speed, so that means are those of an even motion."""


def torque_of(law, speed, load=None):
    speed = np.atleast_1d(np.asarray(speed, dtype=float))
    state = PortState(0.0 * speed, speed, periodic_phase(0.0), np.ones(1), load=load)
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


POWERS = [(3.0, 0.02, "faster"), (0.5, 0.03, "slower")]
"""Exponent, torque at the fastest record in N.m, and how the drag grows in words."""


@pytest.mark.slow
@pytest.mark.parametrize(("exponent", "torque", "word"), POWERS[:1])
def test_a_planted_power_comes_back_with_its_exponent(exponent, torque, word):
    """Without records, and beside the drag that grows otherwise only."""
    data = known_data([(600.0, 0.0), (1000.0, 40.0), (1400.0, 20.0), (2000.0, 0.0), (2000.0, 40.0)])
    drags = [one for one in library(data) if one.name == "nonlinear_drag"]
    (planted,) = (one for one in drags if word in one.sentence and one.port == "input")
    data, _ = measured(planted.build((torque, exponent)), np.random.default_rng(5), data)
    judge_power(judged(data, drags), exponent, torque, word)


FORMS = [
    ("load_dependent_friction", "power", (0.12, 0.8)),
    pytest.param("nonlinear_drag", "shear_thinning", (0.03, 8.0), marks=pytest.mark.nightly),
]
"""Effects whose further forms are sought in the place of others only, with values of these."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "form", "values"), FORMS)
def test_a_form_that_stands_for_another_alone_is_named_with_its_values(name, form, values):
    speeds = (30.0, 100.0, 300.0, 600.0, 1000.0, 1400.0, 2000.0)
    data = known_data([(speed, load) for speed in speeds for load in (0.0, 10.0, 20.0, 40.0)])
    laws = [one for one in library(data) if (one.name, one.port) == (name, "input")]
    (planted,) = (one for one in laws if one.form == form)
    assert planted.instead_of
    data, _ = measured(planted.build(values), np.random.default_rng(5), data)
    verdict = judged(data, laws)
    assert verdict.status == "named"
    assert [one.label for one in verdict.chosen.candidates] == [planted.label]
    fitted = verdict.chosen.fit
    found, spread = fitted.values[-2:], np.sqrt(np.diag(fitted.covariance))[-2:]
    assert np.all(np.abs(found - values) < 3.0 * spread)
    assert np.all(spread < 0.1 * np.array(values))


@pytest.mark.nightly
@pytest.mark.parametrize(("exponent", "torque", "word"), POWERS)
def test_a_planted_power_is_named_with_its_exponent(exponent, torque, word):
    """Of the records, the fastest is at 2000 r/min."""
    rated = 2000.0 * np.pi / 30.0
    planted = effect("input", drag=torque / rated**exponent, drag_exponent=exponent)
    judge_power(analyse(quick_campaign(5, planted)).verdict, exponent, torque, word)


def judge_power(verdict, exponent, torque, word):
    """Hold a verdict on a drag against the drag that was planted."""
    assert verdict.status == "named"
    (candidate,) = verdict.chosen.candidates
    assert candidate.name == "nonlinear_drag"
    assert word in candidate.sentence
    fitted = verdict.chosen.fit
    found, spread = fitted.values[-2:], np.sqrt(np.diag(fitted.covariance))[-2:]
    assert np.all(np.abs(found - [torque, exponent]) < 3.0 * spread)
    assert np.all(spread < [0.1 * torque, 0.1 * exponent + 0.05])


@given(st.floats(0.01, 300.0), st.floats(-50.0, 50.0), st.floats(0.0, 0.9), st.floats(0.0, 0.9))
def test_the_share_is_that_of_the_direction_of_power(speed, load, share, driven):
    law = LoadFriction(share, driven)
    opposing = (share if load > 0.0 else driven) * abs(load)
    assert torque_of(law, speed, load).torque == pytest.approx(opposing, abs=1e-12)
    # Both turned round are the same drive in a mirror.
    mirrored = torque_of(law, -speed, -load).torque
    assert mirrored == pytest.approx(-torque_of(law, speed, load).torque)


@given(st.floats(0.5, 2.0), st.floats(0.01, 50.0), st.floats(0.1, 40.0))
def test_friction_by_load_grows_with_its_power_beyond_what_the_direction_says(power, load, at):
    law = LoadFriction(0.2, 0.1, power, at)
    grown = at * (load / at) ** power
    assert torque_of(law, 3.0, load).torque == pytest.approx(0.2 * grown)
    assert torque_of(law, 3.0, -load).torque == pytest.approx(0.1 * grown)
    assert torque_of(law, 3.0, 0.0).torque == 0.0
    # At the reference all powers are the friction in proportion.
    proportional = torque_of(LoadFriction(0.2, 0.1), 3.0, at).torque
    assert torque_of(law, 3.0, at).torque == pytest.approx(proportional)


@pytest.mark.parametrize("bad", [{"exponent": 0.0}, {"reference": -1.0}, {"exponent": np.nan}])
def test_powers_of_the_load_are_checked(bad):
    (number,) = bad
    with pytest.raises(InvalidInput, match=f"load_dependent_friction.{number}"):
        LoadFriction(0.1, 0.1, **bad)


@given(st.floats(1e-3, 1e3), st.floats(0.5, 50.0))
def test_a_fluid_that_thins_is_viscous_when_slow_and_logarithmic_when_fast(share, thinning):
    """By the series of asinh, to the first term that is left out of each."""
    law, speed = ShearThinningDrag(0.02, thinning, 200.0), share * thinning
    found = torque_of(law, speed)
    size = 0.02 / np.log(200.0 / thinning + np.hypot(1.0, 200.0 / thinning))
    if share < 1.0:
        assert found.torque / (size * share) == pytest.approx(1.0, abs=share**2 / 6.0 + 1e-9)
    else:
        assert found.torque / size == pytest.approx(np.log(2.0 * share), abs=0.25 / share**2)
    assert torque_of(law, 200.0).torque == pytest.approx(0.02)
    assert torque_of(law, -speed).torque == pytest.approx(-found.torque)
    step = 1e-5 * speed
    rise = torque_of(law, speed + step).torque - torque_of(law, speed - step).torque
    assert found.damping == pytest.approx(rise / (2.0 * step), rel=1e-6)


@pytest.mark.parametrize("bad", [(np.nan, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, -2.0)])
def test_numbers_of_a_fluid_that_thins_are_checked(bad):
    with pytest.raises(InvalidInput, match="shear_thinning_drag"):
        ShearThinningDrag(*bad)


@pytest.mark.parametrize("load", [-3.0, 0.0, 5.0])
@pytest.mark.parametrize("exponent", [1.0, 0.6, 1.7])
def test_damping_of_friction_by_load_is_its_derivative(load, exponent):
    law = LoadFriction(0.2, 0.05, exponent, 4.0)
    speed, step = np.array([-0.3, -2e-4, -5e-5, 0.0, 3e-5, 1e-4, 0.2]), 1e-9
    rise = torque_of(law, speed + step, load).torque - torque_of(law, speed - step, load).torque
    found = torque_of(law, speed, load).damping
    assert found == pytest.approx(rise / (2.0 * step), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("shares", [(0.15, 0.05), (0.9, 0.6)])
def test_the_motor_pays_the_share_of_the_load_and_a_driving_load_keeps_the_other(shares):
    calm = preset("resonant")
    law = LawAtPort("load_dependent_friction", "input", LoadFriction(*shares))
    rubbing = replace(calm, effects=(*calm.effects, law))
    speeds, loads = np.array([50.0, 200.0, -200.0, 100.0]), np.array([20.0, 40.0, 40.0, -30.0])
    plain, more = (
        harmonic_balance(
            model.coefficients(np.tile(calm.nominal, (4, 1))),
            input_speed=speeds,
            load_torque=loads,
            motor=STIFF,
        )
        for model in (calm, rubbing)
    )
    assert np.all(more.converged)
    # Bearings of the output are part of its load.
    coefficients = calm.coefficients(calm.nominal[None])
    delivered = coefficients.torque_at(speeds, loads) / coefficients.ratio
    share = np.array([shares[0], shares[0], shares[1], shares[1]])
    expected = share * np.abs(delivered) * np.sign(speeds)
    added = (more.motor_torque - plain.motor_torque)[:, 0].real
    assert added == pytest.approx(expected, rel=1e-6)


def test_one_share_is_guessed_where_loads_only_oppose_and_none_where_no_load_is_known():
    sizes = Sizes(force=0.1, residual=0.01, largest=0.5, speed=200.0, travel=1e-3, load=0.4)
    known = effect_named("load_dependent_friction")
    guess, power = known.guesses(sizes)
    ((_, law),) = known.parts(guess, (0.3,))
    assert law == LoadFriction(0.3, 0.3)
    ((_, law),) = known.parts(power, (0.3, 0.8))
    assert law == LoadFriction(0.3, 0.3, 0.8, 0.4)
    guess, power = known.guesses(replace(sizes, driven=True))
    assert [one.name for one in guess.unknowns] == ["share", "driven_share"]
    ((_, law),) = known.parts(power, (0.3, 0.1, 0.8))
    assert law == LoadFriction(0.3, 0.1, 0.8, 0.4)
    assert known.guesses(replace(sizes, load=0.0)) == []


def test_mechanisms_refuse_friction_by_load():
    law = LoadFriction(0.1, 0.1)
    calm = preset("published")
    rubbing = replace(calm, effects=(LawAtPort("load_dependent_friction", "input", law),))
    with pytest.raises(InvalidInput, match="what load"):
        drive_mechanism(rubbing, calm.nominal)
    rotor = Mechanism(
        {"q": BelievedValue(1.0)}, [Port("joint", {"q": 1.0})], [Input("u", {"q": 1.0})]
    )
    time = np.arange(100) * 1e-3
    record = Record("run", "train", time, {"u": np.ones(100)})
    with pytest.raises(InvalidInput, match="port of load_dependent_friction"):
        simulate_mechanism(rotor, record, [LawAt("load_dependent_friction", "joint", law)])


@pytest.mark.nightly
def test_planted_friction_by_load_is_named_with_its_share():
    rng = np.random.default_rng(7)
    rig = draw_rig(BELIEVED, (), rng)
    campaign = run_campaign(rig, BELIEVED, RIG, rng, CONDITIONS)
    law = LawAtPort("load_dependent_friction", "input", LoadFriction(0.12, 0.12))
    verdict = analyse(with_effects(campaign, rig, [law])).verdict
    assert verdict.status == "named"
    (candidate,) = verdict.chosen.candidates
    assert candidate.label == "load_dependent_friction:input"
    fitted = verdict.chosen.fit
    spread = np.sqrt(fitted.covariance[-1, -1])
    assert abs(fitted.values[-1] - 0.12) < 3.0 * spread
    assert spread < 0.02
