"""Friction in proportion to the load of a port, where a mechanism states its load."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from kept_results import kept
from scipy.integrate import cumulative_trapezoid

from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse
from pymoo_hdte.discrepancy._records.rig_model import (
    MechanismModel,
    model_from_fields,
    model_text,
)
from pymoo_hdte.effects.load_friction import LoadFriction
from pymoo_hdte.mechanism import (
    BelievedValue,
    Input,
    LawAt,
    Mechanism,
    Port,
    Record,
    simulate_mechanism,
)
from pymoo_hdte.mechanism.balances import ForceBalance

NAME = "load_dependent_friction"
INERTIA, DAMPING, SHARE = 0.05, 0.3, 0.15
TIME = np.arange(4000) / 400.0


def joint(load=True):
    """A joint with a motor and a brake, whose torque its bearing passes on."""
    return Mechanism(
        {"q": BelievedValue(INERTIA, 0.1)},
        [
            Port(
                "bearing",
                {"q": 1.0},
                damping=BelievedValue(DAMPING, 0.5),
                load={"brake": 1.0} if load else {},
            )
        ],
        [Input("motor", {"q": 1.0}), Input("brake", {"q": -1.0})],
    )


def turning(name, role, seed):
    """Return a record whose motor follows by inverse dynamics from a motion and a brake.

    No integrator is needed: the friction is that of the law as the efficiency of a gear defines it.
    """
    rng = np.random.default_rng(seed)
    phases = rng.uniform(0.0, 2.0 * np.pi, 4)
    speed = sum(
        size * np.sin(2.0 * np.pi * rate * TIME + phase)
        for size, rate, phase in zip((2.0, 1.5, 1.0), (0.3, 0.7, 1.3), phases, strict=False)
    )
    acceleration = np.gradient(speed, TIME)
    position = cumulative_trapezoid(speed, TIME, initial=0.0)
    brake = 4.0 * np.sin(2.0 * np.pi * 0.17 * TIME + phases[3])
    friction = SHARE * np.abs(brake) * np.sign(speed)
    motor = INERTIA * acceleration + DAMPING * speed + brake + friction
    noise = rng.standard_normal((3, len(TIME)))
    channels = {
        "q": position + 1e-5 * noise[0],
        "motor": motor + 0.01 * noise[1],
        "brake": brake + 0.01 * noise[2],
    }
    return Record(name, role, TIME, channels)


@kept
def finding(load):
    records = [turning("one", "train", 1), turning("two", "train", 2)]
    analysis = analyse(MeasuredMechanism(joint(load), records))
    return analysis.verdict


def test_it_is_named_where_the_port_states_its_load():
    verdict = finding(True)
    assert (verdict.status, verdict.chosen.label) == ("named", f"{NAME}:bearing")
    (standing,) = verdict.accepted.effects
    assert [standing.law.share, standing.law.driven_share] == pytest.approx([SHARE] * 2, rel=0.05)


@pytest.mark.nightly
def test_nothing_of_the_kind_is_said_where_it_does_not():
    named = {one.name for one in finding(False).accepted.candidates}
    assert NAME not in named
    assert finding(False).accepted.chi_square > finding(True).accepted.chi_square


def test_the_force_in_the_balance_is_the_share_of_the_load():
    record = turning("one", "train", 1)
    balance = ForceBalance(joint(), record, 20.0)
    force = balance.in_time(balance.forces([LawAt(NAME, "bearing", LoadFriction(0.2, 0.2))])[0])
    motion = balance.ports["bearing"]
    expected = 0.2 * np.abs(motion.load) * np.sign(motion.speed)
    # Without what lies beyond the cutoff: the jumps at reversals.
    still = np.abs(motion.speed) > 0.5
    assert np.std((force - expected)[still]) < 0.05 * np.std(expected)


def test_a_simulated_brake_slows_a_joint_by_the_share_more():
    """Constant torques: q'' = (motor - (1 + share) brake) / inertia while the brake opposes."""
    calm = replace(joint().ports[0], damping=BelievedValue(0.0))
    rotor = Mechanism(joint().inertias, [calm], joint().inputs)
    time = np.linspace(0.0, 1.0, 201)
    motor, brake = np.full(201, 5.0), 2.0 + time
    record = Record("ramp", "train", time, {"motor": motor, "brake": brake})
    law = LawAt(NAME, "bearing", LoadFriction(SHARE, 0.0))
    course = simulate_mechanism(rotor, record, [law], start={"q": (0.0, 1.0)})
    acceleration = (motor - (1.0 + SHARE) * brake) / INERTIA
    expected = 1.0 + cumulative_trapezoid(acceleration, time, initial=0.0)
    assert course.speed["q"] == pytest.approx(expected, rel=1e-4)


def test_a_model_with_a_load_is_written_and_read_back():
    law = LawAt(NAME, "bearing", LoadFriction(0.2, 0.1))
    model = MechanismModel("joint", joint(), (law,))
    table = tomllib.loads(model_text(model))
    assert model_from_fields(Fields(table, "rig.toml"), "rig.toml") == model
    table["ports"]["bearing"]["load"] = {"break": 1.0}
    with pytest.raises(InvalidInput, match=r"ports\.bearing\.load is 'break'"):
        model_from_fields(Fields(table, "rig.toml"), "rig.toml")
    del table["ports"]["bearing"]["load"]
    with pytest.raises(InvalidInput, match=r"effects\[0\]\.port is 'bearing'.*load"):
        model_from_fields(Fields(table, "rig.toml"), "rig.toml")


def test_a_load_is_a_share_of_an_input():
    port = joint().ports[0]
    for load, words in (
        ({"brakes": 1.0}, "load of bearing is 'brakes'"),
        ({"brake": np.nan}, "nan"),
    ):
        with pytest.raises(InvalidInput, match=words):
            Mechanism(joint().inertias, [replace(port, load=load)], joint().inputs)
