"""Exported models against our own forces and simulation, each in the way of its tool."""

import re
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MechanismModel
from pymoo_hdte.drive._effects import LoadDamping
from pymoo_hdte.drive._effects.warming import WarmingFriction
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    StribeckFriction,
)
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.linear import (
    ConstantForce,
    DirectionalFriction,
    LinearDamper,
    LinearSpring,
)
from pymoo_hdte.effects.load_friction import LoadFriction
from pymoo_hdte.effects.load_sharing import UnevenSharing
from pymoo_hdte.effects.ripple import BrakeRipple, CouplingTorque, PeriodicTorque
from pymoo_hdte.effects.shear_thinning import ShearThinningDrag
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup
from pymoo_hdte.export import to_modelica, to_mujoco, to_python, to_urdf
from pymoo_hdte.export.expressions import MODELICA, PYTHON, written
from pymoo_hdte.mechanism import (
    BelievedValue,
    ErrorLine,
    Input,
    LawAt,
    Loop,
    Mechanism,
    Port,
    Record,
    simulate_mechanism,
)
from pymoo_hdte.mechanism.effects import law_effects

LAWS = {
    "shear_thinning_drag": ShearThinningDrag(0.7, 0.1, 3.0),
    "coulomb_friction": CoulombFriction(1.5),
    "stribeck_friction": StribeckFriction(1.2, 0.6, 0.3),
    "nonlinear_drag": NonlinearDrag(0.3, 0.6, 2.0),
    "position_dependent_friction": PeriodicFriction(3.0, 0.4, 0.2),
    "gravity": Gravity(3.0, 0.7),
    "hysteresis": MaxwellSlip(0.9, 0.05, 1.5),
    "bouc_wen_hysteresis": BoucWen(0.9, 0.05, 1.3, 0.7),
    "force_offset": ConstantForce(0.4),
    "direction_dependent_friction": DirectionalFriction(0.3, 0.1),
    "linear_stiffness": LinearSpring(2.0),
    "viscous_friction": LinearDamper(0.5),
    "load_dependent_damping": LoadDamping(0.6, 4.0),
    "load_dependent_friction": LoadFriction(0.2, 0.1, 0.7, 4.0),
    "torque_ripple": PeriodicTorque(7.0, 1.0, 0.3),
    "hardening_stiffness": HardeningStiffness(5.0, 0.3, 0.4, 3.0),
    "soft_windup": SoftWindup(0.3, 0.2, 4.0),
    "backlash": DeadZone(0.05),
    "clearance_variation": PeriodicClearance(2.0, 0.3, 0.05, 0.08),
    "uneven_load_sharing": UnevenSharing(1.0, 0.3, 0.05, 0.08),
    "brake_ripple": BrakeRipple(3.0, 0.4, 0.02),
    "coupling_ripple": CouplingTorque(1.0, 0.4, 0.2),
    "cogging": PeriodicTorque(6.0, 0.3, 0.1),
    "warming": WarmingFriction(0.3, 0.2, 600.0),
}
"""One law of each effect that a mechanism may have."""
INERTIA, STIFFNESS, DAMPING, GAIN = 0.5, 4.0, 3.0, 7.6


def name_of(law):
    """Name of a law; several effects may share one type."""
    same = [name for name, known in LAWS.items() if known == law]
    return (same or [name for name, known in LAWS.items() if type(known) is type(law)])[0]


def joint(*laws, **of_mechanism):
    """Return a joint with a motor, a spring and these laws."""
    load = {"brake": 1.0}
    values = BelievedValue(STIFFNESS), BelievedValue(DAMPING)
    port = Port("bearing", {"joint": 1.0}, *values, load=load)
    inputs = [
        Input("current", {"joint": 1.0}, BelievedValue(GAIN)),
        Input("brake", {"joint": -1.0}),
    ]
    kinds = {"angles": ["joint"]} | of_mechanism
    mechanism = Mechanism({"joint": BelievedValue(INERTIA)}, [port], inputs, **kinds)
    effects = tuple(LawAt(name_of(law), "bearing", law) for law in laws)
    return MechanismModel("A joint, revised", mechanism, effects)


def python_of(model):
    space = {}
    exec(compile(to_python(model).text, "exported", "exec"), space)
    return space


def modelica_of(model):
    """Return a function that evaluates an exported model, written for these tests alone.

    It takes names with values, and returns every equation's left side.
    """
    text = to_modelica(model).text
    declared = dict(
        re.findall(r"^  parameter Real (\w+)(?:\(.*?\))? = (\S+?)(?: \".*\")?;$", text, re.M)
    )
    body = text.split("equation\n")[1]
    equations = re.findall(r"^  (.*?) = (.*);$", body, re.M)
    assert len(equations) == body.count(";") - 1

    def choice(expression):
        inner = r"\(if ((?:(?!\(if ).)*?) then ((?:(?!\(if ).)*?) else ((?:(?!\(if ).)*?)\)"
        while "(if " in expression:
            expression, count = re.subn(inner, r"((\2) if (\1) else (\3))", expression)
            assert count
        return expression

    functions = {
        **{
            name: getattr(np, name) for name in ("cos", "exp", "log", "sign", "sin", "sqrt", "tanh")
        },
        **{"abs": abs, "max": max, "min": min, "asinh": np.arcsinh},
    }

    def evaluate(**values):
        known = functions | {name: float(value) for name, value in declared.items()} | values
        for left, right in equations:
            right = choice(right.replace("Modelica.Math.", "").replace("^", "**"))
            known[left] = eval(right, {}, known)
        return known

    return evaluate


def test_there_is_a_law_of_every_effect():
    effects = [one for one in law_effects() if not one.of_reading]
    ours = {one.name for one in effects if one.law.__module__.startswith("pymoo_hdte.")}
    assert ours == set(LAWS)


def moving(count, rng, end=3.0):
    """Return positions, speeds, currents and brakes of a motion both ways, each (count,)."""
    time = np.linspace(0.0, end, count)
    position = 0.4 * np.sin(5.0 * time) + 0.1 * np.sin(17.0 * time)
    speed = 2.0 * np.cos(5.0 * time) + 1.7 * np.cos(17.0 * time)
    return time, position, speed, rng.normal(size=count), 5.0 * rng.normal(size=count)


def ours(law, position, speed, brake):
    state = PortState(
        position,
        speed,
        periodic_phase(position),
        np.full(1, STIFFNESS),
        path=lambda values: values[None],
        back=lambda values: values[0],
        load=brake,
    )
    return np.broadcast_to(law.respond(state).torque, position.shape)


MEMORYLESS = [name for name, law in LAWS.items() if not law.states]


@pytest.mark.parametrize("name", MEMORYLESS)
def test_equations_give_the_force_of_the_law(name, rng):
    _, position, speed, current, brake = moving(60, rng)
    model = joint(LAWS[name])
    force = ours(LAWS[name], position, speed, brake) + STIFFNESS * position + DAMPING * speed
    expected = (GAIN * current - brake - force) / INERTIA
    space = python_of(model)
    motion = [position], [speed]
    found = space["acceleration"](*motion, [current, brake])
    assert found[0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert np.abs(space["residual"](*motion, found, [current, brake])).max() < 1e-9
    evaluate = modelica_of(model)
    for i in range(0, 60, 7):
        known = {"joint": position[i], "joint_speed": speed[i]}
        found = evaluate(**known, current=current[i], brake=brake[i])
        assert found["inertia_joint * der(joint_speed)"] == pytest.approx(
            INERTIA * expected[i], rel=1e-9, abs=1e-9
        )
    assert not to_python(model).notes
    assert not to_modelica(model).notes


@pytest.mark.parametrize("name", [name for name in LAWS if name not in MEMORYLESS])
def test_laws_with_memory_keep_their_states(name, rng):
    time, position, speed, *_ = moving(12001, rng, end=1.2)
    law, model = LAWS[name], joint(LAWS[name])
    expected = ours(law, position, speed, np.zeros_like(time))
    space, step = python_of(model), time[1]
    states, found = np.zeros(law.states), []
    rates, force = space["rates"], space["force"]
    for i in range(len(time)):
        found.append(-force(position[i : i + 1], speed[i : i + 1], [0.0, 0.0], states)[0])
        states = states + step * rates(position[i : i + 1], speed[i : i + 1], states)
    found = np.array(found) - (STIFFNESS * position + DAMPING * speed)
    # Euler's steps, which slip a little late at each reversal.
    assert np.max(np.abs(found - expected)) < 0.02 * law.force
    evaluate = modelica_of(model)
    names = re.findall(r"^  der\((\w+)\) = ", to_modelica(model).text, re.M)
    held = dict(zip([one for one in names if one not in ("joint",)], states, strict=True))
    known = evaluate(joint=0.1, joint_speed=-0.4, current=0.0, brake=0.0, **held)
    rate = space["rates"]([0.1], [-0.4], states)
    assert [known[f"der({one})"] for one in held] == pytest.approx(rate, rel=1e-9)
    assert known["bearing_force"] == pytest.approx(
        -space["force"]([0.1], [-0.4], [0.0, 0.0], states)[0], rel=1e-9
    )


@pytest.mark.parametrize(
    "law",
    [
        *(CoulombFriction(1.5), Gravity(3.0, 0.7), ConstantForce(0.4)),
        *(LinearSpring(2.0), LinearDamper(0.5)),
    ],
)
def test_lumped_elements_are_the_law(law, rng):
    _, position, speed, _, brake = moving(60, rng)
    one = law.lumped
    assert not one.missing
    force = one.stiffness * position + one.damping * speed + one.level * np.sign(speed) + one.force
    force = force + (one.weight * np.exp(1j * position)).real
    assert force == pytest.approx(ours(law, position, speed, brake), abs=1e-6)


@pytest.mark.parametrize("exponent", [0.3, 1.0, 1.7, 2.0])
def test_a_line_over_speed_is_the_closest_one(exponent):
    """Against the closed form of least squares on [0, 1]."""
    line = NonlinearDrag(1.0, exponent, 2.0).lumped
    level = 4.0 / (exponent + 1.0) - 6.0 / (exponent + 2.0)
    slope = 12.0 / (exponent + 2.0) - 6.0 / (exponent + 1.0)
    if level < 0.0:
        level, slope = 0.0, 3.0 / (exponent + 2.0)
    assert (line.level, line.damping * 2.0) == pytest.approx((4.0 * level, 4.0 * slope), abs=0.03)


def test_whatever_a_target_does_not_hold_is_in_notes_and_file():
    model = joint(*LAWS.values())
    held = {"coulomb_friction", "gravity", "force_offset", "linear_stiffness", "viscous_friction"}
    for export in (to_mujoco, to_urdf):
        exported = export(model)
        named = {
            name
            for name in LAWS
            for note in exported.notes
            if note.startswith(f"{name} at bearing")
        }
        assert named == set(LAWS) - held
        flat = " ".join(exported.text.split())
        assert all(" ".join(note.split()) in flat for note in exported.notes)


@dataclass(frozen=True)
class Sticky(CoulombFriction):
    """Changes the force of another law, and states nothing of it."""

    def respond(self, state):
        response = super().respond(state)
        return type(response)(2.0 * response.torque)


def test_a_law_that_changes_the_force_of_another_does_not_pass_for_it():
    model = joint()
    effects = (LawAt("coulomb_friction", "bearing", Sticky(1.5)),)
    model = MechanismModel(model.title, model.mechanism, effects)
    for export in (to_mujoco, to_urdf, to_modelica, to_python):
        (note,) = [one for one in export(model).notes if "coulomb" in one]
        assert "left out" in note
    assert "frictionloss" not in to_mujoco(model).text


def test_what_does_not_act_or_cannot_be_exported_is_told():
    sensor = Port("sensor", {"joint": 1.0}, BelievedValue(9.0), read=True)
    loop = Loop("current", "target", "joint", 1.0, 1.0)
    model = joint()
    ports = [*model.mechanism.ports, sensor]
    mechanism = Mechanism(
        model.mechanism.inertias, ports, model.mechanism.inputs, [loop], angles=["joint"]
    )
    for export in (to_mujoco, to_urdf, to_modelica, to_python):
        notes = export(MechanismModel("m", mechanism)).notes
        assert sum("sensor" in one for one in notes) == sum("loop" in one for one in notes) == 1
    following = Port("torsion", {"joint": 1.0}, followed={"motor": -1.0})
    mechanism = Mechanism(model.mechanism.inertias, [following])
    for export in (to_mujoco, to_urdf, to_modelica, to_python):
        with pytest.raises(InvalidInput, match="followed"):
            export(MechanismModel("m", mechanism))


@pytest.mark.parametrize(
    "name", ["der", "lambda", "a-->b", 'x"""; import os', "]]>\\", "np", "äö", "1"]
)
def test_any_name_is_data(name):
    port = Port(f"{name}p", {name: 1.0}, BelievedValue(4.0))
    mechanism = Mechanism({name: BelievedValue(2.0)}, [port], [Input(f"{name}u", {name: 1.0})])
    model = MechanismModel(f"{name}\n{name}\\", mechanism)
    for export in (to_mujoco, to_urdf):
        root = ElementTree.fromstring(export(model).text)
        assert {one.get("name") for one in root.iter("joint")} == {name}
    assert python_of(model)["acceleration"]([0.5], [0.0], [1.0]) == pytest.approx([-0.5])
    text = to_modelica(model).text
    assert len(re.findall(r"^equation$", text, re.M)) == 1
    assert re.search(r"^  der\(\w+\) = \w+;$", text, re.M)


@pytest.mark.parametrize(
    "text", ["__import__('os')", "a.b", "[1]", "f(1)", "1 +", "lambda: 1", "'a'"]
)
def test_a_formula_outside_the_grammar_is_refused(text):
    for dialect in (PYTHON, MODELICA):
        with pytest.raises(InvalidInput, match="formula"):
            written(text, dialect, {"a": "a"})


@pytest.mark.parametrize(
    "text", ["a - (b - c)", "-(a + b) ** 2", "a / (b * c)", "(-a) ** 2 * -b", "a ** -b", "a - -b"]
)
def test_brackets_stand_where_a_language_needs_them(text):
    values = {"a": 1.3, "b": 0.7, "c": 2.1}
    names = dict.fromkeys(values) | {one: one for one in values}
    expected = eval(text, {}, dict(values))
    assert eval(written(text, PYTHON, names), {"np": np}, dict(values)) == expected
    modelica = written(text, MODELICA, names)
    assert eval(modelica.replace("^", "**"), {}, dict(values)) == expected
    # Modelica has a sign only where an expression begins.
    assert not re.search(r"[-+*/^] ?-", modelica)


def test_urdf_has_dynamics_and_the_whole_inertia():
    model = joint(CoulombFriction(1.5), Gravity(3.0, 0.7), StribeckFriction(0.2, 0.1, 0.3))
    root = ElementTree.fromstring(to_urdf(model).text)
    assert [one.get("name") for one in root.iter("link")] == ["base", "joint_link"]
    (dynamics,) = root.iter("dynamics")
    assert (float(dynamics.get("damping")), float(dynamics.get("friction"))) == (3.0, 1.7)
    (origin,), (mass,), (inertia,) = (root.iter(one) for one in ("origin", "mass", "inertia"))
    x, _, z = map(float, origin.get("xyz").split())
    kilograms = float(mass.get("value"))
    whole = float(inertia.get("iyy")) + kilograms * (x**2 + z**2)
    assert whole == pytest.approx(INERTIA)
    # The weight's moment at angle 0, against the positive motion.
    assert 9.81 * kilograms * x == pytest.approx(3.0 * np.cos(0.7))
    assert 9.81 * kilograms * z == pytest.approx(3.0 * np.sin(0.7))


def run_in_mujoco(text, time, inputs, start):
    """Return positions, (n, joints), for inputs that are straight between samples."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed (extra export)")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start
    steps = round(time[1] / model.opt.timestep)
    assert steps * model.opt.timestep == pytest.approx(time[1])
    found = []
    for _ in time:
        found.append(data.qpos.copy())
        for _ in range(steps):
            moment = data.time + model.opt.timestep / 2.0
            for i, one in enumerate(inputs):
                data.ctrl[i] = np.interp(moment, time, one)
            mujoco.mj_step(model, data)
    return np.array(found)


TIME = np.arange(0.0, 4.0, 0.002)
PUSH = 1.2 * np.sin(4.4 * TIME) + 0.5 * np.sin(19.0 * TIME)


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_mujoco_moves_as_our_simulation(share):
    laws = CoulombFriction(1.5), Gravity(3.0, 0.7), ConstantForce(0.4), LinearSpring(2.0)
    inertias, driven = (
        {"joint": BelievedValue(0.5)},
        Input("current", {"joint": 1.0}, BelievedValue(7.6)),
    )
    port = Port("bearing", {"joint": share}, damping=BelievedValue(3.0))
    effects = tuple(LawAt(name_of(law), "bearing", law) for law in laws)
    model = MechanismModel("m", Mechanism(inertias, [port], [driven], angles=["joint"]), effects)
    record = Record("r", "train", TIME, {"joint": np.zeros_like(TIME), "current": PUSH})
    course = simulate_mechanism(model.mechanism, record, effects, start={"joint": (0.3, 0.0)})
    expected = course.position["joint"]
    found = run_in_mujoco(to_mujoco(model).text, TIME, [PUSH], ([0.3], [0.0]))[:, 0]
    assert np.max(np.abs(found - expected)) < 0.01 * np.ptp(expected)


def test_two_coordinates_with_a_spring_between_them_move_in_mujoco_as_ours():
    """Motor and link, in one frame; the current also pushes on the link, a little."""
    spring = Port("gear", {"motor": 1.0, "link": -1.0}, BelievedValue(60.0), BelievedValue(0.3))
    bearing = Port("bearing", {"link": 1.0}, damping=BelievedValue(0.8))
    mechanism = Mechanism(
        {"motor": BelievedValue(0.2), "link": BelievedValue(0.6)},
        [spring, bearing],
        [Input("torque", {"motor": 1.0, "link": 0.2}, BelievedValue(3.0))],
        angles=["motor", "link"],
    )
    effects = (
        LawAt("coulomb_friction", "bearing", CoulombFriction(0.4)),
        LawAt("coulomb_friction", "gear", CoulombFriction(0.1)),
    )
    still = np.zeros_like(TIME)
    record = Record("r", "train", TIME, {"motor": still, "link": still, "torque": PUSH})
    course = simulate_mechanism(mechanism, record, effects)
    model = MechanismModel("m", mechanism, effects)
    found = run_in_mujoco(to_mujoco(model).text, TIME, [PUSH], ([0.0, 0.0], [0.0, 0.0]))
    for i, name in enumerate(("motor", "link")):
        expected = course.position[name]
        assert np.max(np.abs(found[:, i] - expected)) < 0.01 * np.ptp(expected)
    (note,) = [one for one in to_urdf(model).notes if one.startswith("gear,")]
    assert "60" in note


def test_a_table_slides_in_mujoco_as_ours():
    port = Port("spring", {"x": 1.0}, BelievedValue(2200.0), BelievedValue(25.0))
    mechanism = Mechanism(
        {"x": BelievedValue(6.0)}, [port], [Input("force", {"x": 1.0})], angles=[]
    )
    record = Record("r", "train", TIME, {"x": np.zeros_like(TIME), "force": 9.0 * PUSH})
    expected = simulate_mechanism(mechanism, record).position["x"]
    model = MechanismModel("m", mechanism)
    found = run_in_mujoco(to_mujoco(model).text, TIME, [9.0 * PUSH], ([0.0], [0.0]))[:, 0]
    assert np.max(np.abs(found - expected)) < 0.01 * np.ptp(expected)
    assert 'type="prismatic"' in to_urdf(model).text


def test_errors_of_a_gear_are_in_the_equations(rng):
    error = (ErrorLine("joint", *np.array([5.0, 0.02, 0.4])),)
    believed = BelievedValue(np.float64(40.0)), BelievedValue(0.3)
    port = Port("mesh", {"joint": np.float64(0.5)}, *believed, error=error)
    mechanism = Mechanism({"joint": BelievedValue(0.5)}, [port], angles=["joint"])
    model = MechanismModel("m", mechanism)
    _, position, speed, *_ = moving(20, rng)
    d = 0.5 * position + 0.02 * np.sin(5.0 * position + 0.4)
    rate = speed * (0.5 + 0.1 * np.cos(5.0 * position + 0.4))
    found = python_of(model)["force"]([position], [speed], [])[0]
    assert found == pytest.approx(0.5 * (-40.0 * d - 0.3 * rate))
    known = modelica_of(model)(joint=position[3], joint_speed=speed[3])
    assert 0.5 * known["mesh_force"] == pytest.approx(-found[3])
    assert any("kinematic error" in one for one in to_mujoco(model).notes)
