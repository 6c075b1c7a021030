"""Mechanisms in time against closed forms, other integrators, and what must be conserved."""

from dataclasses import replace

import numpy as np
import pytest
from drive_mechanism import drive_mechanism
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import LawAtPort, harmonic_balance, preset, simulate_drive
from pymoo_hdte.drive._effects import KinematicReaction
from pymoo_hdte.effects import Aperiodic, friction
from pymoo_hdte.effects.friction import CoulombFriction, PeriodicFriction
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.law import PortState, Response, periodic_phase
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, SoftWindup
from pymoo_hdte.mechanism import (
    BelievedValue,
    ErrorLine,
    Input,
    LawAt,
    Loop,
    Mechanism,
    Port,
    Record,
    exponential_steps,
)
from pymoo_hdte.mechanism.simulation import simulate_mechanism
from pymoo_hdte.units import ARCSEC


def block(mass=2.0, stiffness=0.0, damping=0.0, loops=(), **of_port):
    port = Port("joint", {"q": 1.0}, BelievedValue(stiffness), BelievedValue(damping), **of_port)
    return Mechanism({"q": BelievedValue(mass)}, [port], [Input("u", {"q": 1.0})], loops)


def record(time, **channels):
    channels = {name: np.broadcast_to(values, len(time)) for name, values in channels.items()}
    return Record("test", "train", time, channels)


def at(law, port="joint"):
    return LawAt(type(law).__name__, port, law)


def test_free_decay_is_the_closed_form():
    time = np.linspace(0.0, 3.0, 61)
    found = simulate_mechanism(
        block(2.0, 800.0, 3.0), record(time, u=0.0), start={"q": (0.4, -1.0)}
    )
    ring = np.sqrt(400.0 - 0.75**2)
    wave = 0.4 * np.cos(ring * time) + (0.75 * 0.4 - 1.0) / ring * np.sin(ring * time)
    assert found.position["q"] == pytest.approx(np.exp(-0.75 * time) * wave, abs=1e-11)


def test_at_resonance_the_response_lags_by_a_quarter_and_inputs_are_straight_between_samples():
    frequency, damping_ratio, rate, time = 50.0, 0.05, 500.0, np.arange(5000) / 500.0
    mechanism = block(2.0, 2.0 * frequency**2, 4.0 * damping_ratio * frequency)
    found = simulate_mechanism(mechanism, record(time, u=3.0 * np.cos(frequency * time)))
    passed = np.sinc(frequency / (2.0 * np.pi * rate)) ** 2
    amplitude = 3.0 * passed / (2.0 * 2.0 * damping_ratio * frequency**2)
    expected = amplitude * np.sin(frequency * time[4700:])
    assert found.position["q"][4700:] == pytest.approx(expected, abs=1e-6 * amplitude)


LAWS = {
    "dry": (friction.StribeckFriction(0.6, 0.4, 0.3),),
    "grease": (friction.NonlinearDrag(20.0, 0.5, 0.3),),
    "cogging": (PeriodicTorque(9.0, 0.3, 0.7), PeriodicFriction(7.0, 1.0, 0.3)),
    "springs": (HardeningStiffness(300.0, 0.4, 0.05), SoftWindup(0.3, 0.02, 4.0)),
    "clearance": (DeadZone(0.02), CoulombFriction(0.2)),
}


def integrated_by_lsoda(port, mass, laws, time, force):
    stiffness, damping = port.stiffness.value, port.damping.value

    def rates(t, state, begin, slope, since):
        d, speed = state[:1], state[1:]
        for line in port.error:
            angle = line.order * state[0] + line.phase
            d = d + line.amplitude * np.sin(angle)
            speed = speed + line.amplitude * line.order * np.cos(angle) * state[1]
        here = PortState(d, speed, periodic_phase(d), np.array([stiffness]))
        resisting = stiffness * d + damping * speed
        resisting = resisting + sum(law.respond(here).torque for law in laws)
        return [state[1], (begin + slope * (t - since) - resisting[0]) / mass]

    path = [np.array([0.1, 0.5])]
    for before, after, begin, end in zip(time[:-1], time[1:], force[:-1], force[1:], strict=True):
        options = {"args": (begin, (end - begin) / (after - before), before), "method": "LSODA"}
        found = solve_ivp(rates, (before, after), path[-1], rtol=1e-10, atol=1e-12, **options)
        path.append(found.y[:, -1])
    return np.array(path).T


@pytest.mark.parametrize("laws", LAWS.values(), ids=LAWS)
def test_laws_converge_to_what_another_integrator_finds(laws, rng):
    time = np.linspace(0.0, 0.6, 31)
    force = 3.0 * np.cos(20.0 * time) + rng.standard_normal(31)
    mechanism = block(0.1, 40.0, 0.3, error=(ErrorLine("q", 5.0, 0.02, 0.4),))
    expected = integrated_by_lsoda(mechanism.ports[0], 0.1, laws, time, force)
    missed = []
    for rtol in (1e-3, 1e-5, 1e-7):
        effects, start = [at(law) for law in laws], {"q": (0.1, 0.5)}
        found = simulate_mechanism(
            mechanism, record(time, u=force), effects, start=start, rtol=rtol
        )
        difference = np.abs([found.position["q"], found.speed["q"]] - expected)
        missed.append(np.max(difference.T / np.max(np.abs(expected), axis=1)))
    assert np.all(np.array(missed) < [3e-2, 3e-4, 3e-6])
    assert missed[2] < 0.1 * missed[1] < 0.01 * missed[0]


def test_without_damping_energy_is_kept():
    still, cubic = record(np.linspace(0.0, 4.0, 401), u=0.0), at(HardeningStiffness(5e3))
    found = simulate_mechanism(
        block(2.0, 500.0), still, [cubic], start={"q": (0.2, 0.0)}, rtol=1e-8
    )
    q, v = found.position["q"], found.speed["q"]
    assert v**2 + 250.0 * q**2 + 1250.0 * q**4 == pytest.approx(12.0, rel=1e-6)


@pytest.mark.nightly
def test_hysteresis_takes_the_area_of_masings_loop_in_every_cycle():
    law, step = MaxwellSlip(30.0, 0.08, 1.5), 5e-4
    coarse = np.arange(801) * 0.005
    wave = 40.0 * np.sin(4.0 * np.pi * coarse)
    joint = Port("joint", {"q": 1.0}, BelievedValue(500.0), BelievedValue(2.0))
    sensor = Port("sensor", {"q": 1.0}, read=True)
    mechanism = Mechanism({"q": BelievedValue(2.0)}, [joint, sensor], [Input("u", {"q": 1.0})])
    effects, start = [at(law), at(law, "sensor")], {"q": (0.03, 0.0)}
    force = np.interp(time := np.arange(8001) * step, coarse, wave)
    found = simulate_mechanism(mechanism, record(time, u=force), effects, start=start)
    q, v = found.position["q"], found.speed["q"]
    cycle = slice(-1001, -1)
    taken = np.sum(((force - 2.0 * v) * v)[cycle]) * step
    reach = np.ptp(CubicSpline(time[cycle], q[cycle])(np.linspace(*time[cycle][[0, -1]], 100_000)))
    beyond = np.maximum(0.5 * reach - law._slips, 0.0)
    assert taken == pytest.approx(4.0 * np.sum(law._stiffnesses * law._slips * beyond), rel=1e-4)
    assert np.sum((found.forces["sensor"] * v)[cycle]) * step == pytest.approx(taken, rel=1e-4)
    assert found.forces["sensor"][0] == 0.0
    # Where it turns back between samples is not lost: springs would keep what they slipped.
    seldom = simulate_mechanism(mechanism, record(coarse, u=wave), effects, start=start)
    assert seldom.position["q"] == pytest.approx(q[::10], abs=2e-6)


def test_dry_friction_stops_a_block_after_its_way_and_holds_it_up_to_breakaway():
    time, dry = np.linspace(0.0, 2.0, 201), at(CoulombFriction(3.0))
    thrown = simulate_mechanism(block(), record(time, u=0.0), [dry], start={"q": (1.0, 1.2)})
    assert thrown.position["q"][-1] - 1.0 == pytest.approx(2.0 * 1.2**2 / (2.0 * 3.0), rel=1e-6)
    # Smoothed friction lets it creep at the speed whose tanh is the share of the breakaway.
    pushed = simulate_mechanism(block(), record(time, u=2.4), [dry])
    assert pushed.speed["q"][1:] == pytest.approx(1e-4 * np.arctanh(0.8), rel=1e-5)


def test_what_happens_between_samples_is_not_missed():
    effects, start, found = [at(CoulombFriction(1.0))], {"q": (0.0, 4.0)}, []
    for parts in (1, 20):
        time = np.arange(16 * parts + 1) * np.pi / 10.0 / parts
        run = simulate_mechanism(block(2.0, 800.0), record(time, u=0.0), effects, start=start)
        found.append(run.speed["q"][::parts])
    assert found[0] == pytest.approx(found[1], abs=1e-4)
    # It nearly sticks for less than a sample, and moves as before at the end of it.
    force = np.append(1.64665, np.full(15, 1.7468))
    light = block(0.02), record(np.arange(16) * 1e-3, u=force), [at(CoulombFriction(1.7))]
    start = {"q": (0.0, 8e-4)}
    coarse, fine = (
        simulate_mechanism(*light, start=start, rtol=rtol).speed["q"] for rtol in (1e-3, 1e-8)
    )
    assert coarse[1] == pytest.approx(fine[1], rel=0.02)


LOOP = Loop("u", "wanted", "q", 200.0, 30.0)


def test_a_closed_loop_is_the_open_one_under_its_own_command():
    time = np.arange(2001) * 1e-3
    wanted, begin = 0.3 * np.sin(3.0 * time) ** 2, {"start": {"q": (0.1, 0.0)}}
    effects = [at(CoulombFriction(1.0)), at(PeriodicTorque(20.0, 0.0, 0.5))]
    mechanism = block(damping=2.0, loops=[LOOP])
    closed = simulate_mechanism(mechanism, record(time, wanted=wanted), effects, **begin)
    command = 200.0 * (wanted - closed.position["q"]) - 30.0 * closed.speed["q"]
    assert closed.inputs["u"] == pytest.approx(command, abs=1e-12)
    driven = record(time, u=command, wanted=wanted)
    for chosen, missed in ((False, 2e-5), (True, 0.0)):
        opened = simulate_mechanism(mechanism, driven, effects, closed_loop=chosen, **begin)
        assert opened.position["q"] == pytest.approx(closed.position["q"], rel=0.0, abs=missed)


def test_a_loop_commands_no_more_than_its_limit():
    time = np.linspace(0.0, 4.0, 401)
    found = simulate_mechanism(
        block(2.0, loops=[replace(LOOP, limit=5.0)]), record(time, wanted=1.0)
    )
    assert found.inputs["u"].max() == 5.0
    assert found.position["q"][:50] == pytest.approx(1.25 * time[:50] ** 2, abs=1e-9)
    assert found.position["q"][-1] == pytest.approx(1.0, abs=1e-3)


def two_masses(read=False, **of_mesh):
    mesh = Port("mesh", {"a": 0.5, "b": -1.0}, BelievedValue(900.0), BelievedValue(0.7), **of_mesh)
    sensor = Port("sensor", {"a": 1.0}, BelievedValue(80.0), BelievedValue(3.0), read=True)
    ground = Port("ground", {"b": 1.0}, BelievedValue(60.0), BelievedValue(0.2))
    return Mechanism(
        {"a": BelievedValue(1.5), "b": BelievedValue(4.0)},
        [mesh, ground, sensor] if read else [mesh],
        [Input("u", {"a": 1.0, "b": -0.2}, BelievedValue(2.0))],
    )


def test_coupled_coordinates_are_the_matrix_exponential_and_read_ports_act_on_nothing():
    time, start = np.linspace(0.0, 2.0, 41), {"a": (0.1, 0.0), "b": (-0.2, 1.0)}
    effects = [at(friction.StribeckFriction(1.0, 0.5, 0.1), "sensor")]
    found = simulate_mechanism(two_masses(read=True), record(time, u=0.6), effects, start=start)
    mesh, ground = np.array([0.5, -1.0]), np.array([0.0, 1.0])
    inverse, still = np.diag([1.0 / 1.5, 1.0 / 4.0]), np.zeros((2, 2))
    stiffness = 900.0 * np.outer(mesh, mesh) + 60.0 * np.outer(ground, ground)
    damping = 0.7 * np.outer(mesh, mesh) + 0.2 * np.outer(ground, ground)
    system = np.block([[still, np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    rest = np.append(np.linalg.solve(stiffness, [1.2, -0.24]), [0.0, 0.0])
    away = np.array([0.1, -0.2, 0.0, 1.0]) - rest
    expected = np.array([rest + expm(t * system) @ away for t in time]).T
    assert found.position["a"] == pytest.approx(expected[0], abs=1e-10)
    assert found.position["b"] == pytest.approx(expected[1], abs=1e-10)
    a, speed = expected[0], expected[2]
    dry = (1.0 + 0.5 * np.exp(-((speed / 0.1) ** 2))) * np.tanh(speed / 1e-4)
    assert found.forces["sensor"] == pytest.approx(80.0 * a + 3.0 * speed + dry, abs=1e-8)


def test_momentum_is_kept_where_nothing_acts_from_outside():
    time, laws = np.linspace(0.0, 1.0, 101), [CoulombFriction(0.4), DeadZone(0.01)]
    laws.append(MaxwellSlip(2.0, 0.02))
    effects, start = [at(law, "mesh") for law in laws], {"a": (0.0, 2.0), "b": (0.0, 0.5)}
    mechanism = two_masses(error=(ErrorLine("a", 30.0, 0.01, 0.2),))
    found = simulate_mechanism(mechanism, record(time, u=0.0), effects, start=start)
    momentum = 1.5 * found.speed["a"] / 0.5 + 4.0 * found.speed["b"]
    assert momentum == pytest.approx(8.0, abs=1e-9)


AT_PORTS = (
    LawAtPort("coulomb_friction", "input", CoulombFriction(0.02)),
    LawAtPort("torque_ripple", "input", PeriodicTorque(6.0, 1.0, 0.015)),
    LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 2e-4)),
)


@pytest.mark.parametrize("effects", [(), AT_PORTS])
def test_the_drive_is_an_instance(effects):
    """A turn of its output, from the state of the drive's own integrator, to 1e-3 arcsec."""
    model = preset("published")
    sheet = replace(model.sheet, flexspline_teeth=20, circular_spline_teeth=22)
    model = replace(model, sheet=sheet, effects=effects)
    design = model.nominal * [1.0, 1.0, 1.0, 1.0, 4e3]
    run = simulate_drive(model, design, ramp=0.1, settle=0.2)
    torque = harmonic_balance(model.coefficients(design[None])).motor_torque[0, 0].real
    mechanism, laws = drive_mechanism(model, design)
    error = CubicSpline(run.time, run.transmission_error)
    angle, speed = run.input_angle[0], run.input_speed[0]
    start = {
        "input_angle": (angle, speed),
        "output_angle": (angle / 11.0 - error(run.time[0]), speed / 11.0 - error(run.time[0], 1)),
    }
    steady = record(run.time, motor_torque=torque, load_torque=sheet.load_torque)
    found = simulate_mechanism(mechanism, steady, laws, start=start, rtol=1e-3)
    mine = found.position["input_angle"] / 11.0 - found.position["output_angle"]
    assert mine == pytest.approx(run.transmission_error, abs=1e-3 * ARCSEC)


def test_starts_are_read_from_the_record():
    time = 1.0 + np.arange(40) * 0.01
    measured = 0.4 - 0.3 * (time - 1.0) + 2.0 * (time - 1.0) ** 2
    found = simulate_mechanism(two_masses(), record(time, u=0.0, a=measured))
    assert (found.position["a"][0], found.position["b"][0]) == (0.4, 0.0)
    assert found.speed["a"][0] == pytest.approx(-0.3, abs=1e-10)


TIME = np.linspace(0.0, 1.0, 21)


@pytest.mark.parametrize(
    ("mechanism", "channels", "arguments", "named"),
    [
        (block(), {"u": 0.0}, {"effects": [at(CoulombFriction(1.0), "knee")]}, "port of effect"),
        (block(), {"v": 0.0}, {}, "channels of record test"),
        (block(), {"u": 0.0}, {"start": {"p": (0.0, 0.0)}}, "start"),
        (block(), {"u": 0.0}, {"rtol": 0.1}, "rtol"),
        (block(), {"u": 0.0}, {"closed_loop": True}, "closed_loop"),
        (block(loops=[LOOP]), {"u": 0.0}, {"closed_loop": True}, "channels of record test"),
        (block(loops=[LOOP, LOOP]), {"wanted": 0.0}, {}, "inputs of closed loops"),
    ],
)
def test_wrong_arguments_are_named(mechanism, channels, arguments, named):
    with pytest.raises(InvalidInput, match=named):
        simulate_mechanism(mechanism, record(TIME, **channels), **arguments)


@pytest.mark.parametrize(
    ("of_speed", "gain", "message"),
    [
        (lambda speed: 0.0 * speed, -2000.0, "have left"),
        (lambda speed: np.nan * speed, 0.0, "have left"),
        (lambda speed: 3.0 * np.sign(speed), 1.0, "too many steps"),
    ],
)
def test_what_cannot_be_followed_ends_in_an_error(of_speed, gain, message, monkeypatch):
    monkeypatch.setattr(exponential_steps, "_STEPS_ANYWAY", 500)
    mechanism = block(loops=[replace(LOOP, position_gain=gain, speed_gain=0.0)])

    class OfSpeed(Aperiodic):
        def respond(self, state):
            return Response(of_speed(state.speed))

    with pytest.raises(ArithmeticError, match=message):
        simulate_mechanism(
            mechanism, record(TIME, wanted=1.0), [at(OfSpeed())], start={"q": (0.1, 0.5)}
        )


def test_drives_are_refused_that_no_mechanism_can_be():
    reacting = replace(preset("published"), effects=(KinematicReaction(),))
    for model, match in ((reacting, "act back"), (preset("resonant"), "varies with the input")):
        with pytest.raises(InvalidInput, match=match):
            drive_mechanism(model, model.nominal)
