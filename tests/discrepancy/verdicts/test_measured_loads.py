"""Loads that vary with the position of a joint, and its friction: found, or not where none is.

The motion is a sum of sines, so that its derivatives and the torque have a closed form.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._records.rig_model import model_text, read_mechanism_model
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

INERTIA, DAMPING, TORQUE_NOISE = 0.5, 3.0, 0.05
RATE, DURATION = 100.0, 40.0
HALF_TURN = 1.5
"""Half of the travel of a joint that moves by about half a turn, rad."""


SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3, 4))]


def joint(angles=("q",), *more):
    return Mechanism(
        {"q": BelievedValue(0.6, 0.5)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(3.5, 1.0))],
        [Input("torque", {"q": 1.0}), *more],
        angles=angles,
    )


def motion(reach=HALF_TURN, middle=-0.4):
    """Return time, angle, speed and acceleration; slow and fast, turning back without a rest."""
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    angle, speed, acceleration = np.full((3, len(time)), [[middle], [0.0], [0.0]])
    for share, period, phase in ((0.7, 9.7, 0.0), (0.2, 3.9, 1.0), (0.1, 1.7, 2.0)):
        omega = 2.0 * np.pi / period
        angle = angle + reach * share * np.sin(omega * time + phase)
        speed = speed + reach * share * omega * np.cos(omega * time + phase)
        acceleration = acceleration - reach * share * omega**2 * np.sin(omega * time + phase)
    return time, angle, speed, acceleration


def found(load, angles=("q",), reach=HALF_TURN, seed=1, mechanism=None, **known):
    """Return what is found where ``load(angle, speed)`` acts against the motion of a joint."""
    time, angle, speed, acceleration = motion(reach)
    noise = np.random.default_rng(seed).standard_normal((2, len(time)))
    torque = INERTIA * acceleration + DAMPING * speed + load(angle, speed)
    channels = {"q": angle + 1e-5 * noise[0], "torque": torque + TORQUE_NOISE * noise[1]}
    channels |= {name: one(angle, speed) for name, one in known.items()}
    record = Record("to and fro", "train", time, channels)
    return examine_mechanism(mechanism or joint(angles), [record])


def believing(inertia, damping):
    """Return the joint with other beliefs."""
    port = Port("bearing", {"q": 1.0}, damping=damping)
    return Mechanism({"q": inertia}, [port], [Input("torque", {"q": 1.0})], angles=["q"])


def names(finding):
    return sorted(one.label.split(":")[0] for one in finding.accepted.candidates)


def friction(finding, speed):
    """Return the torque of damping and friction laws at speeds, N.m."""
    fitted = finding.accepted
    torque = fitted.values[[one.name for one in fitted.parameters].index("damping of bearing")]
    state = PortState(0.0 * speed, speed, periodic_phase(0.0 * speed), np.zeros(1))
    return torque * speed + sum(one.law.respond(state).torque for one in fitted.effects)


def dry(angle, speed):
    return 2.3 * np.sign(speed)


def weight(angle, speed):
    return 3.0 * np.cos(angle - 0.3)


@cache
def pendulum():
    return found(lambda q, v: weight(q, v) + dry(q, v))


def test_gravity_is_found_beside_dry_friction():
    finding = pendulum()
    assert finding.verdict.status == "named"
    assert names(finding) == ["coulomb_friction", "gravity"]
    values = {key: one for each in effects(finding) for key, one in each["parameters"].items()}
    for key, truth in (("torque", 3.0), ("torque_phase", -0.3), ("level", 2.3)):
        low, high = values[key]["interval95"]
        assert values[key]["value"] == pytest.approx(truth, rel=0.02), key
        assert low - 0.01 * abs(truth) < truth < high + 0.01 * abs(truth), key


@pytest.mark.parametrize("seed", SEEDS)
def test_a_joint_that_lacks_nothing_gets_no_gravity(seed):
    assert found(lambda q, v: 0.0 * q, seed=seed).verdict.status == "adequate"


@pytest.mark.parametrize("seed", SEEDS)
def test_dry_friction_alone_gets_no_gravity(seed):
    finding = found(dry, seed=seed)
    assert (finding.verdict.status, names(finding)) == ("named", ["coulomb_friction"])


def test_a_linear_axis_has_no_gravity_that_turns():
    every = found(lambda q, v: weight(q, v) + dry(q, v), angles=None).verdict
    sets = [every.chosen, *every.alternatives]
    assert not any(one.name == "gravity" for each in sets for one in each.candidates)


def test_over_a_small_travel_gravity_is_not_told_from_a_spring_with_its_rest_elsewhere():
    finding = found(lambda q, v: 8.0 * np.cos(q - 1.0), reach=0.12)
    assert finding.verdict.status == "class"
    every = [finding.verdict.chosen, *finding.verdict.equivalent]
    assert {"gravity", "linear_stiffness"} <= {
        one.name for each in every for one in each.candidates
    }


def test_a_spring_is_found_beside_dry_friction():
    finding = found(lambda q, v: 1.7 * q + dry(q, v))
    assert finding.verdict.status == "named"
    assert names(finding) == ["coulomb_friction", "linear_stiffness"]
    values = {key: one for each in effects(finding) for key, one in each["parameters"].items()}
    assert values["coefficient"]["value"] == pytest.approx(1.7, rel=0.02)
    assert values["level"]["value"] == pytest.approx(2.3, rel=0.02)


def arm(angle, speed):
    """The torque of a whole arm, which another program knows."""
    return 4.0 * np.cos(angle) + 1.5 * np.sin(2.0 * angle + 0.4)


def test_a_known_torque_is_an_input_of_gain_one():
    knows = joint(("q",), Input("arm", {"q": -1.0}))
    finding = found(lambda q, v: arm(q, v) + dry(q, v), mechanism=knows, arm=arm)
    assert (finding.verdict.status, names(finding)) == ("named", ["coulomb_friction"])
    assert finding.accepted.values[-1] == pytest.approx(2.3, rel=0.02)


@pytest.mark.parametrize(
    "curve",
    [
        pytest.param(lambda v: 6.0 * np.cbrt(v), id="free exponent", marks=pytest.mark.nightly),
        pytest.param(lambda v: 2.0 * np.sign(v) + 3.0 * np.cbrt(v), id="beside dry friction"),
        pytest.param(
            lambda v: 4.0 * np.sign(v) * np.abs(v) ** 0.6,
            id="another exponent",
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_friction_that_grows_slower_than_the_speed_is_known_as_a_curve(curve):
    finding = found(lambda q, v: curve(v))
    assert "nonlinear_drag/sublinear" in names(finding)
    fastest = np.abs(motion()[2]).max()
    speed = np.linspace(0.05, 1.0, 20) * fastest
    truth = DAMPING * speed + curve(speed)
    assert friction(finding, speed) == pytest.approx(truth, rel=0.05)


def test_a_ripple_is_found_beside_gravity_and_friction_that_hide_it():
    finding = found(lambda q, v: weight(q, v) + dry(q, v) + 1.2 * np.cos(16.0 * q + 0.5))
    assert finding.verdict.status == "named"
    assert names(finding) == ["coulomb_friction", "gravity", "torque_ripple/16"]
    (ripple,) = [one.law for one in finding.accepted.effects if one.name == "torque_ripple"]
    assert ripple.amplitude == pytest.approx(1.2, rel=0.02)


@pytest.mark.nightly
def test_at_the_bound_of_a_form_no_name_is_plain():
    finding = found(lambda q, v: 4.0 * np.sign(v) * np.abs(v) ** 0.12)
    assert finding.verdict.status == "partial"
    assert "coulomb_friction" in names(finding)
    bounded = [one for each in effects(finding) for one in each["at_bound"]]
    shown = [
        key
        for each in effects(finding)
        for key, one in each["parameters"].items()
        if one["at_bound"]
    ]
    assert shown == bounded


@pytest.mark.parametrize(
    ("believed", "stuck"),
    [
        (
            believing(BelievedValue(0.9, 0.2), BelievedValue(2.0, 1.0)),
            "inertia of q",
        ),
        pytest.param(
            believing(BelievedValue(0.6, 0.5), BelievedValue(2.0, 0.3)),
            "damping of bearing",
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_a_belief_out_of_its_tolerance_is_named_beside_an_effect(believed, stuck):
    finding = found(dry, mechanism=believed)
    assert finding.verdict.status == "named"
    released = {candidate.releases for candidate in finding.accepted.candidates} - {None}
    assert released == {stuck}
    assert not quantities(finding)[stuck]["at_bound"]
    assert "coulomb_friction" in names(finding)


def test_a_value_of_zero_is_no_bound_but_a_part_that_is_not_there():
    none = believing(BelievedValue(0.6, 0.5), BelievedValue(2.0, 1.0))
    finding = found(lambda q, v: dry(q, v) - DAMPING * v, mechanism=none)
    assert (finding.verdict.status, names(finding)) == ("named", ["coulomb_friction"])
    assert quantities(finding)["damping of bearing"]["at_bound"]


@pytest.mark.parametrize(
    ("unit", "said", "angles"),
    [
        ("deg", "", ("q",)),
        ("mm", "", ()),
        ("mm", "angle = true", ("q",)),
        ("rev", "angle = false", ()),
    ],
)
def test_the_unit_of_a_column_tells_an_angle_unless_the_file_does(unit, said, angles, tmp_path):
    rows = np.column_stack([np.arange(20) / 100.0, np.arange(20.0), np.ones(20)])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,q,i", comments="")
    (tmp_path / "rig.toml").write_text(RIG.replace("UNIT", unit).replace("ANGLE", said))
    rig = read_rig(tmp_path)
    assert rig.mechanism.angles == angles
    (tmp_path / "model.toml").write_text(model_text(rig.model))
    assert read_mechanism_model(tmp_path / "model.toml").mechanism.angles == angles


RIG = """
title = "A joint"
[coordinates.q]
inertia = { value = 0.5 }
ANGLE
[ports.bearing]
motion = { q = 1.0 }
[inputs.torque]
acts = { q = 1.0 }
gain = { value = 1.0 }
[table]
format = "csv"
time = { column = "t", unit = "s" }
channels.q = { column = "q", unit = "UNIT" }
channels.torque = { column = "i", unit = "A" }
[[records]]
file = "run.csv"
role = "train"
"""


def test_gravity_is_looked_for_where_one_shaft_turns():
    angles = {"motor": BelievedValue(1.0), "link": BelievedValue(1.0), "slide": BelievedValue(1.0)}
    ports = {
        "geared": {"motor": 0.01},
        "torsion": {"motor": 0.01, "link": -1.0},
        "rail": {"slide": 1.0},
    }
    arm = Mechanism(angles, [Port(*one) for one in ports.items()], angles=["motor", "link"])
    assert [port.name for port in arm.ports if arm.turns(port)] == ["geared"]
    with pytest.raises(InvalidInput, match="angles"):
        Mechanism(angles, angles=["elbow"])


def test_gravity_is_the_slope_of_its_energy():
    law = Gravity(3.0, -0.3)
    angle, step = np.linspace(-4.0, 4.0, 50), 1e-6
    state = PortState(angle, 0.0 * angle, periodic_phase(angle), np.zeros(1))
    response = law.respond(state)
    energy = [3.0 * np.sin(angle + by - 0.3) for by in (-step, step)]
    assert response.torque == pytest.approx((energy[1] - energy[0]) / (2.0 * step), abs=1e-8)
    # After a turn it is the same, and half a turn on the opposite.
    turned = replace(state, phase=periodic_phase(angle + np.pi))
    assert law.respond(turned).torque == pytest.approx(-response.torque)
