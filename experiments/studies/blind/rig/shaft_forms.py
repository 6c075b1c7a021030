"""Hidden effects of shafts, motor, load and encoder that the library has too; as `mesh_forms`."""

from __future__ import annotations

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import INPUT, OUTPUT, element
from experiments.studies.blind.rig.hidden import Drawn, Hidden
from experiments.studies.blind.rig.machine import EXTRA, ThirdBody
from experiments.studies.blind.rig.mesh_forms import RATED_SPEED, Generator, phase
from experiments.studies.blind.rig.sensors import Drift, ScaleError
from experiments.studies.blind.rig.session import ARCSEC

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
        found = {"rate": sign * size / time, "time": time} if form == 0 else {}
        return Hidden(drift=(Drift(sign * size, time, form),), quantities=found)

    words = ("one time constant", "two time constants", "hyperbola", "diffusion")
    size = rng.uniform(2.0, 10.0) * ARCSEC
    return Drawn("thermal_drift", "sensor", words[form], size, 40.0 * ARCSEC, build)
