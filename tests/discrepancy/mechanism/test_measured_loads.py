"""Loads that vary with the position of a joint, and its friction: found, or not where none is.

The motion is a sum of sines, so that its derivatives and the torque have a closed form.
"""

from functools import cache

import numpy as np
import pytest

from pymoo_hdte.discrepancy.mechanism.analysis import examine_mechanism
from pymoo_hdte.discrepancy.report.mechanism_document import effects
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
        pytest.param(lambda v: 4.0 * np.sign(v) * np.abs(v) ** 0.6, id="another exponent"),
    ],
)
def test_friction_that_grows_slower_than_the_speed_is_known_as_a_curve(curve):
    finding = found(lambda q, v: curve(v))
    assert "nonlinear_drag/sublinear" in names(finding)
    fastest = np.abs(motion()[2]).max()
    speed = np.linspace(0.05, 1.0, 20) * fastest
    truth = DAMPING * speed + curve(speed)
    assert friction(finding, speed) == pytest.approx(truth, rel=0.05)
