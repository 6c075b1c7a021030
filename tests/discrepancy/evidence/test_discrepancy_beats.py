"""Lines that a record cannot tell from an analysed order are read there, as they are measured."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_rig_cases import BELIEVED, PHASES, RIG, SHORT, effect, true_rig

from experiments.studies.virtual_rig.rig import run_campaign
from experiments.studies.virtual_rig.runs import Condition
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import orders_that_fold
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import (
    Conditions,
    coefficients_of,
    predict,
)
from pymoo_hdte.discrepancy._plan.imagined import imagined_campaign, possible_tests
from pymoo_hdte.discrepancy._plan.limits import PlanLimits
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts.drive import _beyond
from pymoo_hdte.drive import LawAtPort, harmonic_balance
from pymoo_hdte.drive._effects import MeshStiffnessVariation
from pymoo_hdte.drive._solve.free_angle import torus_of
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import HardeningStiffness
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

DEPTH, PHASE, SECOND = 0.05, 0.7, 0.2
QUIET = replace(RIG, angle_noise=1e-12, input_torque_noise=1e-9, output_torque_noise=1e-6,
                angle_quantisation=0.0, repeatability=0.0, input_torque_gain=0.0,
                input_torque_zero=0.0, output_torque_gain=0.0, output_torque_zero=0.0)  # fmt: skip
BEATS = (2.0 / 101.0, 200.0 / 101.0)
"""Where a record of one output turn has the orders 0.02 and 1.98."""


@pytest.mark.parametrize(("way", "turns"), [(1.0, 1), (-1.0, 1), (1.0, 15)])
def test_the_beat_of_the_error_with_a_varying_stiffness_is_predicted_where_it_is_measured(
    monkeypatch, way, turns
):
    """Errors of order 2.02 under a stiffness of order 2, against an independent integrator.

    In fifteen turns of the output a beat at 0.02 turns by 0.3 of a cycle against 2/101.
    """
    once = Condition.duration
    monkeypatch.setattr(Condition, "duration", lambda self, ratio: turns * once(self, ratio))
    conditions = [replace(one, speed_rpm=way * one.speed_rpm) for one in SHORT]
    wave = effect("mesh", depth=DEPTH, depth_phase=PHASE, depth_second=SECOND, depth_clip=1.0)
    rng = np.random.default_rng(3)
    campaign = run_campaign(true_rig(wave), BELIEVED, QUIET, rng, tuple(conditions))
    orders = [1.0 / 101.0, BEATS[0], 1.0, BEATS[1], 2.0, 2.02, 4.0]
    features = measure(campaign, campaign.running, orders)
    values = {
        one.name: np.array([one.start]) for one in base_parameters(BELIEVED, QUIET, PHASES, 0.0)
    }
    laws = [
        MeshStiffnessVariation(DEPTH, PHASE, 2.0),
        MeshStiffnessVariation(DEPTH / 5.0, SECOND, 4.0),
    ]
    predicted = predict(BELIEVED, QUIET, features.conditions, orders, values, laws)
    for order in (*BEATS, 2.0):
        real, imaginary = features.places(0)[orders.index(order)]
        measured = features.values[:, real] + 1j * features.values[:, imaginary]
        assert predicted.phasors[0, :, 0, orders.index(order)] == pytest.approx(measured, rel=0.05)


def test_a_planned_campaign_shows_a_beat_as_it_is_predicted():
    """In ten output turns, of which a later reading must not make another beat."""
    limits = PlanLimits(
        rig=QUIET,
        speeds=(2000.0 * REVOLUTION_PER_MINUTE,),
        loads=(40.0,),
        sample_rate=1000.0,
        most_records=4,
        output_turns=10,
    )
    wave = [MeshStiffnessVariation(DEPTH, PHASE, 2.0)]
    tests = possible_tests(limits)
    campaign = imagined_campaign(BELIEVED, limits, tests, np.random.default_rng(3), wave)
    orders = [1.0 / 101.0, BEATS[0], 1.0, 2.0, 2.02, 4.0]
    features = measure(campaign, campaign.running, orders)
    phases = np.random.default_rng(3).uniform(-np.pi, np.pi, 3).tolist()
    base = base_parameters(BELIEVED, QUIET, phases, 0.0)
    values = {one.name: np.array([one.start]) for one in base}
    predicted = predict(BELIEVED, QUIET, features.conditions, orders, values, wave)
    real, imaginary = features.places(0)[1]
    measured = features.values[:, real] + 1j * features.values[:, imaginary]
    assert predicted.phasors[0, :, 0, 1] == pytest.approx(measured, rel=0.05)


@pytest.mark.parametrize("speed", [3.0, -3.0])
@pytest.mark.parametrize(
    ("lead", "beats"),
    [
        ({6.0: 1.2e-3 * np.exp(0.4j), 18.0: 1.5e-3 * np.exp(-1.0j)}, (12.0, 24.0)),
        # A fifth of the speed: what the third and the fourth power do is half of it at these.
        ({6.0: 0.035 * np.exp(0.4j)}, (12.0, 18.0, 24.0)),
    ],
)
def test_two_lines_of_the_input_beat_as_its_inertia_has_it(speed, lead, beats):
    """At a low speed, against the motion of the input alone over its angle: T = J v dv/da + B v."""
    orders = [1.0, 6.0, 12.0, 18.0, 24.0]
    phasors = np.array([[lead.get(order, 0.0) for order in orders]])
    conditions = Conditions(
        np.array([speed]),
        np.zeros(1),
        np.zeros(1),
        np.zeros((1, 3, 6), dtype=complex),
        lead=phasors,
    )
    quiet = replace(BELIEVED, error_amplitudes=(0.0,) * len(BELIEVED.error_orders))
    values = {one.name: np.array([one.start]) for one in base_parameters(quiet, QUIET, PHASES, 0.0)}
    predicted = predict(quiet, QUIET, conditions, orders, values)
    angle = 2.0 * np.pi * np.arange(512) / 512
    slope = sum((1j * k * lead[k] * np.exp(1j * k * angle)).real for k in lead)
    rate = speed / (1.0 - slope)
    # Of the spectrum's lines that of a derivative is i k times as large.
    order = np.fft.rfftfreq(512, 1.0 / 512)
    gradient = np.fft.irfft(1j * order * np.fft.rfft(rate**2 / 2.0), 512)
    torque = quiet.input_inertia * gradient + quiet.input_damping * rate
    for beat in beats:
        expected = 2.0 / 512 * np.fft.rfft(torque)[int(beat)]
        # The load behind the gear adds a few per cent to the inertia.
        found = predicted.phasors[0, 0, 1, orders.index(beat)]
        assert found == pytest.approx(expected, rel=0.05)


STATED = replace(QUIET, motor_slots=36, motor_poles=8)
"""A motor with distributed windings, which is not among the usual ones."""


@pytest.mark.parametrize(
    ("rig", "order", "analysed"), [(QUIET, 24.0, []), (QUIET, 24.0, [24.0]), (STATED, 72.0, [])]
)
def test_what_a_record_folds_down_it_does_whatever_others_show(rig, order, analysed):
    """Two records of one motor: the rows of the first show an order, those of the other fold it."""
    orders = [1.0, 6.0, *analysed]
    possible = orders_that_fold(rig)
    folded = np.zeros((2, len(possible), 2, 1 + len(orders)), dtype=complex)
    folded[1, possible.index(order), :, 2] = 0.3, 0.3j
    conditions = Conditions(
        np.array([3.0, 200.0]),
        np.zeros(2),
        np.zeros(2),
        np.zeros((2, 3, 1 + len(orders)), dtype=complex),
        lead=np.zeros((2, len(orders)), dtype=complex),
    )
    values = {
        one.name: np.array([one.start]) for one in base_parameters(BELIEVED, QUIET, PHASES, 0.0)
    }
    cogging = LawAtPort("cogging", "input", PeriodicTorque(order, 0.4, 2e-3))
    without, present = (
        predict(BELIEVED, rig, some, orders, values, (cogging,)).phasors[0]
        for some in (conditions, replace(conditions, folded=folded))
    )
    shown = (present - without)[..., :2]
    assert not shown[0].any()
    # The motor takes the torque through its inertia, from which the drive is decoupled.
    assert shown[1, 1, 1] == pytest.approx(0.3 * 2e-3 * np.exp(0.4j), rel=0.2)


@pytest.mark.parametrize("slipping", [False, True])
def test_a_weight_shakes_springs_that_slip_loose(slipping):
    """The mean error moves by far more than any linear answer, against the whole balance."""
    weight = LawAtPort("gravity", "load", Gravity(2.0, 0.3))
    springs = LawAtPort("hysteresis", "mesh", MaxwellSlip(8.0, 4e-4))
    present = (springs,) if slipping else ()
    shaken, balance = means_under(weight, present)
    assert shaken == pytest.approx(balance, rel=0.05, abs=0.1 * ARCSEC)
    assert (abs(shaken) > 2.0 * ARCSEC) == slipping


def test_a_weight_that_is_believed_may_be_strong():
    """It was taken for a line of the bench, which moves no mean of a curved stiffness."""
    weight = LawAtPort("gravity", "load", Gravity(10.0, 0.3))
    cubic = LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(1e10))
    shaken, balance = means_under(weight, (cubic,), believed=True)
    assert shaken == pytest.approx(balance, rel=0.05)
    assert abs(shaken) > 2.0 * ARCSEC


def means_under(weight, present, believed=False):
    """Return how far a weight moves the mean error beside effects, predicted and balanced, rad."""
    orders = [1.0 / BELIEVED.ratio, 2.0]
    conditions = Conditions(
        np.array([70.0]),
        np.array([25.0]),
        np.zeros(1),
        np.zeros((1, 3, 3), dtype=complex),
        lead=np.zeros((1, 2), dtype=complex),
    )
    predicted = []
    for some in (present, (*present, weight)):
        known = replace(BELIEVED, effects=some if believed else ())
        starts = base_parameters(known, QUIET, PHASES, 0.0)
        values = {parameter.name: np.array([parameter.start]) for parameter in starts}
        added = () if believed else some
        predicted.append(predict(known, QUIET, conditions, orders, values, added).mean[0, 0, 0])
    rows = [coefficients_of(BELIEVED, values, some, 1) for some in (present, (*present, weight))]
    at = {
        "input_speed": np.array([70.0]),
        "load_torque": np.array([25.0]),
        "torus": torus_of(rows[1]),
    }
    still = np.zeros((1, len(at["torus"].orders)), dtype=complex)
    means = [harmonic_balance(row, lead=still, **at).transmission_error[0, 0].real for row in rows]
    return predicted[1] - predicted[0], means[1] - means[0]


FASTER = ((600.0, 1000.0), (2000.0, 1000.0))
"""Speeds in r/min, and rates of the rows in Hz."""


@pytest.fixture(scope="module")
def led_unevenly():
    """Return the data of a drive whose motor ripples at order 7, at three speeds."""
    ripple = effect("input", ripple=0.015, ripple_order=7.0, ripple_phase=0.9, ripple_second=6.0)
    runs = [Condition(rpm, 0.0, rate, 1, "train") for rpm, rate in ((10.0, 20.0), *FASTER)]
    campaign = run_campaign(true_rig(ripple), BELIEVED, RIG, np.random.default_rng(3), tuple(runs))
    orders = [1.0, 2.0, 2.02, 7.0, 14.0]
    return training_data(campaign, measure(campaign, campaign.train, orders))


@pytest.mark.slow
def test_the_input_s_own_harmonics_excite_and_are_not_judged(led_unevenly):
    """They show at one speed only, where an effect of their order would show at all."""
    data = led_unevenly
    _, exciting = _beyond(data, fit(data))
    assert 21.0 in exciting
    orders = sorted([*data.features.orders.tolist(), *exciting])
    records = data.features.records
    wider = measure(data.campaign, records, orders, only_exciting=exciting)
    assert wider.only_exciting == exciting
    place = orders.index(21.0)
    assert np.abs(wider.conditions.lead[0, place]) > 1e-4
    of_order = np.concatenate([wider.places(channel)[place] for channel in range(4)])
    assert not wider.judged[:, of_order].any()
    assert not wider.values[~wider.judged].any()


@pytest.mark.slow
def test_changes_whitened_by_one_noise_are_whitened_by_another(led_unevenly):
    data = led_unevenly
    rippling = LawAtPort("torque_ripple", "input", PeriodicTorque(7.0, 0.9, 0.015))
    noisier = replace(data, reference_effects=(rippling,))
    changes = np.random.default_rng(1).normal(size=(2, *data.features.values.shape))
    white, other = (some.whiten(changes) for some in (data, noisier))
    np.testing.assert_allclose(noisier.rewhitened(white, data), other, rtol=1e-8, atol=1e-8)
