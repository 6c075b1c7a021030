"""All hidden effects by name, and how many forms each has."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import INPUT, OUTPUT, element
from experiments.studies.blind.rig.hidden import Drawn, Hidden
from experiments.studies.blind.rig.machine import EXTRA, SENSOR, ThirdBody
from experiments.studies.blind.rig.sensors import Drift, ScaleError
from experiments.studies.blind.rig.session import ARCSEC, SHEET

Generator = np.random.Generator
K, WINDUP = SHEET.stiffness, SHEET.windup
RATED_SPEED = 2000.0 * math.pi / 30.0


def phase(rng: Generator) -> float:
    """Draw a phase, rad."""
    return float(rng.uniform(0.0, 2.0 * math.pi))


def hardening_stiffness(rng: Generator, form: int) -> Drawn:
    """Draw a cubic, a hyperbolic sine or a second spring: 4 to 12 % more torque at rated load."""
    corner = rng.uniform(0.3, 0.6) * WINDUP

    def build(share: float) -> Hidden:
        if form == 0:
            row = element(el.CUBIC, share * K / WINDUP**2)
            return Hidden((row,), quantities={"coefficient": share * K / WINDUP**2})
        if form == 1:
            reach = brentq(lambda x: math.sinh(x) / x - 1.0 - share, 1e-6, 20.0)
            return Hidden((element(el.SINH, K, reach / WINDUP),))
        spring = share * K * WINDUP / (WINDUP - corner)
        return Hidden((element(el.OVERLOAD, spring, corner, 0.05 * WINDUP),))

    words = ("cubic", "hyperbolic sine", "second spring beyond a torsion")
    return Drawn("hardening_stiffness", "mesh", words[form], rng.uniform(0.04, 0.12), 0.4, build)


def soft_windup(rng: Generator, form: int) -> Drawn:
    """Draw a mesh softer by 15 to 40 % near zero, wound up at 10 to 35 % of rated torsion."""
    wound = rng.uniform(0.1, 0.35) * WINDUP
    kinds = (el.SOFT_ROOT, el.SOFT_PIECES, el.SOFT_EXPONENTIAL, el.SOFT_ARCTANGENT)
    words = ("root", "straight pieces", "exponential", "arc tangent")

    def build(share: float) -> Hidden:
        return Hidden((element(kinds[form], share * K, wound),))

    return Drawn("soft_windup", "mesh", words[form], rng.uniform(0.15, 0.4), 0.8, build)


def hysteresis(rng: Generator, form: int) -> Drawn:
    """Draw 0.5 to 2.5 N.m that lag: springs that slip, few or many, or Bouc and Wen's law."""
    longest = rng.uniform(0.1, 0.4) * WINDUP
    exponent, beta = float(rng.integers(1, 3)), float(rng.uniform(0.5, 0.8))
    spread = rng.exponential(1.0, 12)
    yields = WINDUP * np.exp(rng.uniform(math.log(0.02), math.log(0.4), 12))

    def build(torque: float) -> Hidden:
        if form == 1:
            row = element(el.BOUC_WEN, torque, 0.4 * longest, exponent, beta)
            return Hidden((row,), quantities={"force": torque})
        shares, slips = spread / spread.sum(), yields
        if form == 0:
            shares, slips = np.full(4, 0.25), np.asarray(longest * np.arange(1, 5) / 4.0)
        rows = [
            element(el.SLIP, share * torque / slip, share * torque)
            for share, slip in zip(shares, slips, strict=True)
        ]
        return Hidden(tuple(rows), quantities={"force": torque})

    words = ("four springs that slip", "Bouc-Wen", "twelve uneven springs that slip")
    return Drawn("hysteresis", "mesh", words[form], rng.uniform(0.5, 2.5), 8.0, build)


CONTACTS = ("sharp", "soft skin", "round contact")


def backlash(rng: Generator, form: int) -> Drawn:
    """Draw a gap of 2 to 8 arcsec on each side: sharp, with soft skin or round contact."""

    def build(half_width: float) -> Hidden:
        row = element(el.PLAY, half_width, 0.0, 1.0, 0.0, form)
        return Hidden((row,), quantities={"half_width": half_width} if form == 0 else {})

    size = rng.uniform(2.0, 8.0) * ARCSEC
    return Drawn("backlash", "mesh", CONTACTS[form], size, 30.0 * ARCSEC, build)


def clearance_variation(rng: Generator, form: int) -> Drawn:
    """Draw a gap whose width varies by 50 to 100 % once or twice in an input turn.

    Both flanks move, or one does. A gap that moves as a whole is not drawn: under load it is a
    backlash and a line of the static error, and nothing else.
    """
    order, at, share = float(rng.integers(1, 3)), phase(rng), rng.uniform(0.5, 1.0)
    moves = (0.0, 0.5, 0.0)[form]
    shape = (0.0, 0.0, 1.0)[form]

    def build(half_width: float) -> Hidden:
        row = element(el.PLAY, half_width, share * half_width, order, at, form, moves, shape)
        return Hidden((row,))

    def steady(half_width: float) -> Hidden:
        return Hidden((element(el.PLAY, half_width, 0.0, order, at, form),))

    words = f"{CONTACTS[form]}, {('both flanks', 'one flank', 'with a harmonic')[form]}"
    size = rng.uniform(2.0, 8.0) * ARCSEC
    return Drawn("clearance_variation", "mesh", words, size, 30.0 * ARCSEC, build, simpler=steady)


def mesh_stiffness_variation(rng: Generator, form: int) -> Drawn:
    """Draw a stiffness that varies twice in an input turn, by 1 to 5 %."""
    at = phase(rng)

    def build(depth: float) -> Hidden:
        if form == 2:
            return Hidden((element(el.COMPLIANCE_WAVE, depth, 2.0, at),))
        row = element(el.STIFFNESS_WAVE, depth, 2.0, at, (0.0, 2.0, 0.0, 3.0)[form])
        return Hidden((row,), quantities={"depth": depth} if form == 0 else {})

    words = ("cosine", "trapezoid", "cosine of the compliance", "crest")
    return Drawn("mesh_stiffness_variation", "mesh", words[form], rng.uniform(0.01, 0.05), 0.2,
                 build)  # fmt: skip


def damping_reference(rng: Generator, form: int) -> Drawn:
    """Draw mesh damping 3 to 10 times the believed one, steady or growing with a speed."""

    def build(further: float) -> Hidden:
        grown = (0.0, 0.3 / RATED_SPEED, 0.0)[form], (0.0, 0.0, 20.0)[form]
        return Hidden((element(el.DAMPING, further * SHEET.damping, *grown),))

    words = ("steady", "grows with the speed", "grows with the torsion's rate")
    return Drawn("damping_reference", "mesh", words[form], rng.uniform(2.0, 9.0), 25.0, build)


def kinematic_error(rng: Generator, form: int) -> Drawn:
    """Draw a line of 1 to 4 arcsec of order 3, 4 or 5, or 5 to 60 times in an output turn."""
    fast = rng.random() < 0.5
    order = float(rng.integers(3, 6)) if fast else float(rng.integers(5, 61)) / 101.0
    at = phase(rng)

    def build(amplitude: float) -> Hidden:
        row = element(el.ERROR_WAVE, amplitude, order, at, (0.0, 1.0, 3.0)[form])
        return Hidden((row,), quantities={"amplitude": amplitude} if form < 2 else {})

    words = ("sine", "with a harmonic", "crest")
    size = rng.uniform(1.0, 4.0) * ARCSEC
    return Drawn("kinematic_error", "mesh", words[form], size, 15.0 * ARCSEC, build)


def kinematic_reaction(rng: Generator, form: int) -> Drawn:
    """Return what the mesh torque does on the input through the slope of the static error.

    Its size is that of the principle of virtual work. Foreign forms: the spring alone reacts, or
    the whole with a lag of 0.3 to 1 ms, as through a wave generator that gives way.
    """
    lag = rng.uniform(3e-4, 1e-3)

    def build(share: float) -> Hidden:
        return Hidden((element(el.REACTION, share, float(form == 1), lag if form == 2 else 0.0),))

    words = ("whole", "of the spring alone", "with a lag")
    return Drawn("kinematic_reaction", "input", words[form], 1.0, 1.0, build, scales=False)


ROUNDING = (0.2, 0.002)
"""rad/s over which dry friction of input and output turns, a fifteenth of the slowest speed."""


def coulomb_friction(rng: Generator, form: int) -> Drawn:
    """Draw dry friction: 0.008 to 0.03 N.m at the input or 0.5 to 2.5 at the output.

    Its sign is rounded, or bristles bend before they slip (Dahl), or is a root.
    """
    place = int(rng.integers(2))
    port, low, high, largest = (
        ("input", 0.008, 0.03, 0.1),
        ("output", 0.5, 2.5, 8.0),
    )[place]
    bend = rng.uniform(*((0.02, 0.1), (2.0 * ARCSEC, 8.0 * ARCSEC))[place])

    def build(level: float) -> Hidden:
        if form == 1:
            row = element(el.BRISTLES, level, 0.0, 1.0, bend, 0.0, 0.0, place)
        else:
            row = element(el.DRY, level, ROUNDING[place], form, 0.0, 0.0, 0.0, place)
        return Hidden((row,), quantities={"level": level})

    words = ("rounded sign", "bristles", "root")
    return Drawn("coulomb_friction", port, words[form], rng.uniform(low, high), largest, build)


def stribeck_friction(rng: Generator, form: int) -> Drawn:
    """Draw dry friction of the input that falls with speed, or bristles with such a level."""
    level, speed = rng.uniform(0.005, 0.02), rng.uniform(5.0, 40.0)
    bend = rng.uniform(0.02, 0.1)

    def build(excess: float) -> Hidden:
        if form == 3:
            row = element(el.BRISTLES, level, excess, speed, bend, 1.0, 0.0, INPUT)
        else:
            row = element(el.STRIBECK, level, excess, speed, form, ROUNDING[0], 0.0, INPUT)
        return Hidden((row,), quantities={"level": level, "excess": excess} if form == 0 else {})

    words = ("Gaussian", "exponential", "rational", "bristles, exponential")
    return Drawn("stribeck_friction", "input", words[form], rng.uniform(0.01, 0.03), 0.1, build,
                 components=("coulomb_friction",))  # fmt: skip


def position_dependent_friction(rng: Generator, form: int) -> Drawn:
    """Draw friction that varies once or twice in an input turn, or once in an output turn.

    Its mean keeps it positive: a negative friction would excite the bench by itself.
    """
    port, place, order, low, high = (
        ("input", INPUT, 1.0, 0.005, 0.02),
        ("input", INPUT, 2.0, 0.005, 0.02),
        ("output", OUTPUT, 1.0, 0.4, 1.6),
    )[int(rng.integers(3))]
    at = phase(rng)

    def build(level: float) -> Hidden:
        shape, rounding = (0.0, 1.0, 3.0)[form], ROUNDING[int(place)]
        row = element(el.UNEVEN, 1.4 * level, level, order, at, shape, rounding, place)
        return Hidden((row,), quantities={"level": level} if form == 0 else {})

    words = ("cosine", "with a harmonic", "crest")
    return Drawn("position_dependent_friction", port, words[form], rng.uniform(low, high),
                 5.0 * high, build, components=("coulomb_friction",))  # fmt: skip


def nonlinear_drag(rng: Generator, form: int) -> Drawn:
    """Draw drag of the input, 0.01 to 0.04 N.m at rated speed: powers, or a fluid that thins."""
    sheared, foreign = rng.uniform(5.0, 20.0), float(rng.choice([1.7, 3.0]))

    def build(torque: float) -> Hidden:
        if form == 2:
            return Hidden((element(el.SHEAR_DRAG, torque, sheared, RATED_SPEED),))
        power = (2.0, foreign, 0.0, 0.6)[form]
        row = element(el.DRAG, torque, RATED_SPEED, power)
        return Hidden((row,), quantities={"level": torque, "exponent": power})

    words = ("square", f"power {foreign:g}", "Eyring's fluid", "power 0.6")
    return Drawn("nonlinear_drag", "input", words[form], rng.uniform(0.01, 0.04), 0.12, build)


def load_dependent_friction(rng: Generator, form: int) -> Drawn:
    """Draw friction of the input that grows with the load: 3 to 15 % of it."""
    rounding, power = rng.uniform(1.0, 4.0), float(rng.choice([0.9, 1.1]))
    mean = rng.uniform(0.05, 0.2)

    def build(share: float) -> Hidden:
        if form == 3:
            row = element(el.MESH_FRICTION, share, mean)
        else:
            row = element(el.LOAD_FRICTION, share, rounding if form == 1 else 0.0,
                          power if form == 2 else 1.0)  # fmt: skip
        return Hidden((row,), quantities={"share": share} if form in (0, 3) else {})

    words = ("proportional", "rounded at zero", f"power {power:g}", "of the mean mesh torque")
    return Drawn("load_dependent_friction", "input", words[form], rng.uniform(0.03, 0.15), 0.4,
                 build)  # fmt: skip


def eccentricity(rng: Generator, form: int) -> Drawn:
    """Draw an output encoder off centre by 2 to 8 arcsec."""
    at = phase(rng)

    def build(amplitude: float) -> Hidden:
        error = ScaleError(amplitude, 1.0, at, (0.0, 1.0, 3.0)[form])
        return Hidden(scale=(error,), quantities={"amplitude": amplitude} if form < 2 else {})

    words = ("cosine", "with a harmonic", "crest")
    size = rng.uniform(2.0, 8.0) * ARCSEC
    return Drawn("eccentricity", "sensor", words[form], size, 30.0 * ARCSEC, build)


def torque_ripple(rng: Generator, form: int) -> Drawn:
    """Draw a motor torque of 0.005 to 0.025 N.m that varies 2 to 8 times in an input turn."""
    order, at = float(rng.integers(2, 9)), phase(rng)

    def build(amplitude: float) -> Hidden:
        row = element(el.RIPPLE, amplitude, order, at, form)
        return Hidden((row,), quantities={"amplitude": amplitude} if form < 2 else {})

    words = ("cosine", "with a harmonic", "trapezoid")
    return Drawn("torque_ripple", "input", words[form], rng.uniform(0.005, 0.025), 0.1, build)


def load_inertia(rng: Generator, form: int) -> Drawn:
    """Draw 0.02 to 0.08 kg.m2 beyond the believed load: rigid, on a stiff shaft, in a clutch."""
    shaft, clutch = rng.uniform(2e5, 6e5), rng.uniform(60.0, 150.0)

    def build(inertia: float) -> Hidden:
        if form == 0:
            return Hidden(load_inertia=inertia, quantities={"inertia": inertia})
        coupling = (shaft, 5.0) if form == 1 else (0.0, clutch)
        return Hidden(third=ThirdBody(EXTRA, inertia, *coupling))

    words = ("rigid", "on a stiff shaft", "in a viscous clutch")
    # What a clutch loses damps the torsion too.
    damping = ("damping_reference",) if form == 2 else ()
    return Drawn("load_inertia", "output", words[form], rng.uniform(0.02, 0.08), 0.2, build,
                 components=damping)  # fmt: skip


def thermal_drift(rng: Generator, form: int) -> Drawn:
    """Draw a reading of the output angle that drifts by 2 to 10 arcsec as the bench warms up."""
    time, sign = rng.uniform(300.0, 2000.0), float(rng.choice([-1.0, 1.0]))

    def build(size: float) -> Hidden:
        values = {"rate": sign * size / time, "time": time} if form == 0 else {}
        return Hidden(drift=(Drift(sign * size, time, form),), quantities=values)

    words = ("one time constant", "two time constants", "hyperbola", "diffusion")
    size = rng.uniform(2.0, 10.0) * ARCSEC
    return Drawn("thermal_drift", "sensor", words[form], size, 40.0 * ARCSEC, build)


def output_vibration(rng: Generator, form: int) -> Drawn:
    """Draw a torque of 0.1 to 0.6 N.m on the load at 47 to 120 Hz.

    In no list: it has a clock of its own, and laws know position, speed and load only.
    """
    frequency, at = 2.0 * math.pi * rng.uniform(47.0, 120.0), phase(rng)
    return Drawn("output_vibration", "output", "cosine", rng.uniform(0.1, 0.6), 3.0,
                 lambda size: Hidden((element(el.VIBRATION, size, frequency, at),)))  # fmt: skip


def compliant_sensor(rng: Generator, form: int) -> Drawn:
    """Draw a torque sensor of 3e4 to 1e5 N.m/rad between drive and load.

    In no list: it is a third moving body, and the library's drive has two.
    """
    damping = rng.uniform(0.5, 2.0)
    return Drawn("compliant_sensor", "output", "spring", 1.0 / rng.uniform(3e4, 1e5), 1.0 / 2e4,
                 lambda size: Hidden(third=ThirdBody(SENSOR, 0.0, 1.0 / size, damping)),
                 )  # fmt: skip


def load_ripple(rng: Generator, form: int) -> Drawn:
    """Draw a brake whose torque varies by 1 to 5 %, 3 to 9 times in its turn.

    Not to be named, as it is of the bench; no wrong name since the library has the load's port.
    """
    order, at = float(rng.integers(3, 10)), phase(rng)
    return Drawn("load_ripple", "output", "cosine", rng.uniform(0.01, 0.05), 0.2,
                 lambda size: Hidden((element(el.LOAD_RIPPLE, size, order, at),)),
                 components=("torque_ripple",))  # fmt: skip


def speed_stiffening(rng: Generator, form: int) -> Drawn:
    """Draw a stiffness that grows with the speed of the input, by 5 to 15 % up to the rated one.

    In no list: laws of the torsion do not know the speed of the input.
    """
    return Drawn("speed_stiffening", "mesh", "linear", rng.uniform(0.05, 0.15), 0.3,
                 lambda size: Hidden((element(el.STIFFNESS_OF_SPEED, size / RATED_SPEED),)),
                 )  # fmt: skip


def friction_bursts(rng: Generator, form: int) -> Drawn:
    """Draw friction of the input that comes and goes within a tenth of a second.

    In no list: no law depends on time.
    """
    period, width = rng.uniform(0.3, 1.0), rng.uniform(0.05, 0.15)
    return Drawn("friction_bursts", "input", "pulses", rng.uniform(0.01, 0.04), 0.15,
                 lambda size: Hidden((element(el.BURSTS, size, period, width),)))  # fmt: skip


def motor_lag(rng: Generator, form: int) -> Drawn:
    """Draw a motor whose torque lags by 2 to 6 ms.

    In no list: the speed loop is believed to be exact.
    """
    return Drawn("motor_lag", "input", "first order", rng.uniform(2e-3, 6e-3), 7e-3,
                 lambda size: Hidden(lag=size))  # fmt: skip


def creep(rng: Generator, form: int) -> Drawn:
    """Draw a flexspline that creeps by 2 to 6 % of its torsion within 20 to 200 s.

    In no list: the library's hysteresis forgets time, and its drift forgets the load.
    """
    time = rng.uniform(20.0, 200.0)
    return Drawn("creep", "mesh", "one time constant", rng.uniform(0.02, 0.06), 0.2,
                 lambda size: Hidden((element(el.CREEP, size, time),)))  # fmt: skip


def load_growing_error(rng: Generator, form: int) -> Drawn:
    """Draw an error of order 1 or 3 that grows with the load, 2 to 6 % of the torsion.

    Not to be named: the library's stiffness varies with the two lobes of the wave generator, of
    even orders. Its error that grows with the load is the same line, and no wrong name.
    """
    order, at = float(rng.choice([1.0, 3.0])), phase(rng)
    return Drawn("load_growing_error", "mesh", f"order {order:g}", rng.uniform(0.02, 0.06), 0.15,
                 lambda size: Hidden((element(el.STIFFNESS_WAVE, size, order, at),)),
                 components=("load_dependent_error",))  # fmt: skip


def warming_friction(rng: Generator, form: int) -> Drawn:
    """Draw dry friction of 0.01 to 0.04 N.m that loses 50 to 90 % as grease warms up.

    In no list: no law depends on time or temperature. The dry friction in it is one that is.
    """
    time, lost = rng.uniform(100.0, 500.0), rng.uniform(0.5, 0.9)
    return Drawn("warming_friction", "input", "exponential", rng.uniform(0.01, 0.04), 0.12,
                 lambda size: Hidden((element(el.WARMING, size, time, lost),)),
                 components=("coulomb_friction",))  # fmt: skip


def torque_sensor_curvature(rng: Generator, form: int) -> Drawn:
    """Draw a torque sensor of the output that shows 2 to 5 % too much at 40 N.m, none at zero.

    In no list: sensors of torque have gains and zeros.
    """
    return Drawn("torque_sensor_curvature", "sensor", "square", rng.uniform(0.02, 0.05), 0.15,
                 lambda size: Hidden(curvature=size))  # fmt: skip


Draw = Callable[[np.random.Generator, int], Drawn]

_LISTED: tuple[tuple[Draw, int], ...] = (
    (hardening_stiffness, 3),
    (soft_windup, 4),
    (hysteresis, 3),
    (backlash, 3),
    (clearance_variation, 3),
    (coulomb_friction, 3),
    (stribeck_friction, 4),
    (position_dependent_friction, 3),
    (nonlinear_drag, 4),
    (load_dependent_friction, 4),
    (mesh_stiffness_variation, 4),
    (kinematic_error, 3),
    (kinematic_reaction, 3),
    (eccentricity, 3),
    (torque_ripple, 3),
    (load_inertia, 3),
    (damping_reference, 3),
    (thermal_drift, 4),
)
_UNLISTED: tuple[Draw, ...] = (
    output_vibration,
    compliant_sensor,
    load_ripple,
    speed_stiffening,
    friction_bursts,
    motor_lag,
    creep,
    load_growing_error,
    warming_friction,
    torque_sensor_curvature,
)
_DRAWS = {draw.__name__: draw for draw, _ in _LISTED} | {
    effect.__name__: effect for effect in _UNLISTED
}
FORMS = {draw.__name__: count for draw, count in _LISTED}
"""Number of forms of each listed effect, that of the library among them."""
LISTED = tuple(FORMS)
UNLISTED = tuple(effect.__name__ for effect in _UNLISTED)


def draw_effect(name: str, form: int, rng: np.random.Generator) -> Drawn:
    """Draw an effect of `LISTED` or `UNLISTED` in one of its forms.

    Raises
    ------
    KeyError
        For an unknown name.
    """
    return _DRAWS[name](rng, form)
