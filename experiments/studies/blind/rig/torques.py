"""Torques of a machine beyond its linear part, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import Values

MEAN_OF_BUMP = 1.2660658777520084
"""I0(1), mean of exp(cos x) over a period."""
TRAPEZOID = 3.0
"""How steep the sides of the rounded trapezoid are."""


@njit(cache=True)
def copy_into(target: NDArray[np.float64], source: NDArray[np.float64]) -> None:
    """Copy an array (n,) into another; slices take seconds to compile, for words of an error."""
    for place in range(len(source)):
        target[place] = source[place]


@njit(cache=True)
def wave(form: float, x: float) -> tuple[float, float]:
    """Return a wave of period 2 pi without mean, of amplitude near 1, and its slope.

    0 is a cosine, 1 one with 30 % of its second harmonic, 2 a rounded trapezoid, 3 a narrow crest.
    """
    cosine, sine = math.cos(x), math.sin(x)
    if form == 1.0:
        return cosine + 0.3 * math.cos(2.0 * x + 1.0), -sine - 0.6 * math.sin(2.0 * x + 1.0)
    if form == 2.0:
        value, top = math.tanh(TRAPEZOID * cosine), math.tanh(TRAPEZOID)
        return value / top, -TRAPEZOID * (1.0 - value * value) * sine / top
    if form == 3.0:
        crest = math.exp(cosine)
        return crest - MEAN_OF_BUMP, -crest * sine
    return cosine, -sine


@njit(cache=True)
def decay(form: float, x: float) -> float:
    """Return a curve that falls from 1 at x = 0: Gaussian, exponential or rational."""
    if form == 1.0:
        return math.exp(-abs(x))
    if form == 2.0:
        return 1.0 / (1.0 + x * x)
    return math.exp(-x * x)


@njit(cache=True)
def rounded_sign(form: float, x: float) -> float:
    """Return a sign rounded over x of about 1: tanh, arc tangent or root."""
    if form == 1.0:
        return 2.0 / math.pi * math.atan(0.5 * math.pi * x)
    if form == 2.0:
        return x / math.sqrt(1.0 + x * x)
    return math.tanh(x)


@njit(cache=True)
def beyond_gap(form: float, x: float, half_width: float) -> float:
    """Return the deflection of flanks with a gap: sharp, of soft skin, or of round contact."""
    distance = abs(x) - half_width
    if form == 1.0:
        skin = 0.3 * half_width + 1e-15
        # Two soft contacts, one on each side.
        upper = skin * _softplus((x - half_width) / skin)
        return upper - skin * _softplus((-x - half_width) / skin)
    if distance <= 0.0:
        return 0.0
    if form == 2.0:
        round_off = 0.25 * half_width
        distance = math.sqrt(distance * distance + round_off * round_off) - round_off
    return math.copysign(distance, x)


@njit(cache=True)
def _softplus(x: float) -> float:
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))


@njit(cache=True)
def bouc_wen(z: float, way: float, exponent: float, beta: float) -> float:
    """Return the state after a way in units of the torsion of yield, z between -1 and 1.

    dz/dx = 1 - |z|^n (beta sgn(dx z) + 1 - beta): midpoint steps of a twentieth of the yield.
    """
    steps = 1 + int(20.0 * abs(way))
    part = way / steps
    for _ in range(steps):
        middle = z + 0.5 * part * _bouc_wen_slope(z, part, exponent, beta)
        z += part * _bouc_wen_slope(middle, part, exponent, beta)
        z = min(max(z, -1.0), 1.0)
    return z


@njit(cache=True)
def _bouc_wen_slope(z: float, way: float, exponent: float, beta: float) -> float:
    turn = 1.0 if way * z > 0.0 else -1.0
    return 1.0 - abs(z) ** exponent * (beta * turn + 1.0 - beta)


@njit(cache=True)
def bump(time: float, period: float, width: float) -> float:
    """Return a smooth pulse of height 1 at an irregular moment of every period."""
    number = math.floor(time / period)
    # The golden ratio spreads the moments evenly and never repeats them.
    place = number * 0.6180339887498949
    begin = number * period + (place - math.floor(place)) * (period - width)
    share = (time - begin) / width
    if share <= 0.0 or share >= 1.0:
        return 0.0
    return math.sin(math.pi * share) ** 2


RATED = 40.0
"""N.m, at which friction by load with another exponent than 1 has its share."""
LOAD = 3
"""Place of the load's torque, N.m, behind the three torques that move the machine."""


class Plant(NamedTuple):
    """A machine in one record, as compiled code takes it: see `machine.Machine`.

    ``speed`` (rad/s), ``start`` (rad) and ``clock`` (s) are set speed, input angle and time of the
    session at t = 0; ``load`` is the load's torque and ``motor`` the constant of the speed loop,
    N.m.
    """

    ratio: float
    stiffness: float
    damping: float
    input_damping: float
    output_damping: float
    orders: Values
    amplitudes: Values
    phases: Values
    offset: float
    rows: Values
    speed: float
    start: float
    clock: float
    load: float
    motor: float
    load_row: int


@njit(cache=True)
def static_error(plant: Plant, angle: float) -> tuple[float, float]:
    """Return theta_s, rad, and its slope over the input angle."""
    value, slope = plant.offset, 0.0
    for line in range(len(plant.orders)):
        order, amplitude = plant.orders[line], plant.amplitudes[line]
        x = order * angle + plant.phases[line]
        value += amplitude * math.sin(x)
        slope += amplitude * order * math.cos(x)
    for row in plant.rows:
        if row[0] == el.ERROR_WAVE:
            height, rise = wave(row[4], row[2] * angle + row[3])
            value += row[1] * height
            slope += row[1] * row[2] * rise
    return value, slope


@njit(cache=True)
def elastic_torque(
    plant: Plant,
    torsion: float,
    angle: float,
    speed: float,
    time: float,
    memory: Values,
    before: Values,
    moved: Values,
) -> float:
    """Return the mesh torque without damping, N.m; write states of memory to ``moved``.

    ``kept`` are the states when the torsion was ``before`` (of each element, rad).
    """
    d, factor, further = torsion, 1.0, 0.0
    for e in range(len(plant.rows)):
        row = plant.rows[e]
        if row[0] == el.PLAY:
            height = wave(row[7], row[3] * angle + row[4])[0] if row[2] != 0.0 else 0.0
            half_width = max(row[1] + row[2] * height * (1.0 - row[6]), 0.0)
            d = beyond_gap(row[5], d - row[2] * height * row[6], half_width)
        elif row[0] == el.CREEP:
            d -= memory[e]
    for e in range(len(plant.rows)):
        row = plant.rows[e]
        kind = row[0]
        if kind > el.STIFFNESS_OF_SPEED:
            continue
        size = abs(d)
        if kind == el.CUBIC:
            further += row[1] * d**3
        elif kind == el.SINH:
            further += row[1] * (math.sinh(row[2] * d) / row[2] - d)
        elif kind == el.OVERLOAD:
            x = size - row[2]
            pressed = 0.5 * (x + math.sqrt(x * x + row[3] * row[3]))
            resting = 0.5 * (-row[2] + math.sqrt(row[2] * row[2] + row[3] * row[3]))
            further += row[1] * math.copysign(pressed - resting, d)
        elif kind == el.SOFT_ROOT:
            further -= row[1] * d / math.sqrt(1.0 + (d / row[2]) ** 2)
        elif kind == el.SOFT_PIECES:
            further -= row[1] * min(max(d, -row[2]), row[2])
        elif kind == el.SOFT_EXPONENTIAL:
            further -= row[1] * row[2] * math.copysign(-math.expm1(-size / row[2]), d)
        elif kind == el.SOFT_ARCTANGENT:
            reach = 2.0 * row[2] / math.pi
            further -= row[1] * reach * math.atan(d / reach)
        elif kind == el.SLIP:
            stuck = memory[e] + row[1] * (torsion - before[e])
            moved[e] = min(max(stuck, -row[2]), row[2])
            further += moved[e]
        elif kind == el.BOUC_WEN:
            moved[e] = bouc_wen(memory[e], (torsion - before[e]) / row[2], row[3], row[4])
            further += row[1] * moved[e]
        elif kind == el.STIFFNESS_WAVE:
            factor += row[1] * wave(row[4], row[2] * angle + row[3])[0]
        elif kind == el.COMPLIANCE_WAVE:
            give = 1.0 + row[1] * math.cos(row[2] * angle + row[3])
            factor += math.sqrt(1.0 - row[1] * row[1]) / give - 1.0
        elif kind == el.STIFFNESS_OF_SPEED:
            factor += row[1] * abs(speed)
    return plant.stiffness * factor * d + further


@njit(cache=True)
def friction_torque(
    plant: Plant, row: Values, speed: float, angle: float, clock: float, mean_mesh: float
) -> float:
    """Return the torque of an element of friction without memory, N.m, against a positive speed."""
    kind, fast = row[0], abs(speed)
    if kind == el.DRY:
        return row[1] * rounded_sign(row[3], speed / row[2])
    if kind == el.STRIBECK:
        level = row[1] + row[2] * decay(row[4], speed / row[3])
        return level * math.tanh(speed / row[5])
    if kind == el.UNEVEN:
        height = wave(row[5], row[3] * angle + row[4])[0]
        return (row[1] + row[2] * height) * math.tanh(speed / row[6])
    if kind == el.DRAG:
        return row[1] * math.copysign((fast / row[2]) ** row[3], speed)
    if kind == el.SHEAR_DRAG:
        return row[1] * math.asinh(speed / row[2]) / math.asinh(row[3] / row[2])
    turning = math.tanh(speed / 0.05)
    if kind == el.LOAD_FRICTION:
        load = math.sqrt(plant.load * plant.load + row[2] * row[2]) - row[2]
        load = RATED * (load / RATED) ** row[3]
        return row[1] * load / plant.ratio * turning
    if kind == el.MESH_FRICTION:
        return row[1] * abs(mean_mesh) / plant.ratio * turning
    if kind == el.BURSTS:
        return row[1] * bump(clock, row[2], row[3]) * turning
    if kind == el.WARMING:
        return row[1] * (1.0 + row[3] * math.expm1(-clock / row[2])) * turning
    return 0.0


@njit(cache=True)
def relaxed(state: float, aim: float, share: float) -> float:
    """Return a state that runs to an aim for ``share`` time constants."""
    return aim + (state - aim) * math.exp(-share)


@njit(cache=True)
def torques(
    plant: Plant,
    time: float,
    y: Values,
    memory: Values,
    before: Values,
    since: float,
    moved: Values,
    now: Values,
    f: Values,
) -> float:
    """Write torques beyond the linear part to ``f``; return the motor's further torque, N.m.

    ``f`` has the torques of `machine.LinearPart` and, at `LOAD`, that of the load alone.

    States of memory ``kept`` belong to positions ``before`` at time ``since``; those at this time
    are written to ``moved`` and ``now``.
    """
    turned, clock = plant.start + plant.speed * time, plant.clock + time
    angle, speed = turned + y[0], plant.speed + y[2]
    out_angle, out_speed = turned / plant.ratio + y[1], plant.speed / plant.ratio + y[3]
    value, slope = static_error(plant, angle)
    d = y[0] / plant.ratio - y[1] - value
    rate = y[2] / plant.ratio - y[3] - slope * speed
    copy_into(moved, memory)
    for e in range(len(now)):
        now[e] = d
    spring = elastic_torque(plant, d, angle, speed, time, memory, before, moved)
    dashpot = plant.damping * rate
    motor, on_input, on_output, load = plant.motor, 0.0, 0.0, plant.load
    for row in plant.rows:
        if row[0] == el.DAMPING:
            growth = (1.0 + row[2] * abs(speed)) * (1.0 + row[3] * abs(rate))
            dashpot += row[1] * rate * growth
    mesh = spring + dashpot
    for e in range(len(plant.rows)):
        row = plant.rows[e]
        kind = row[0]
        if kind == el.CREEP:
            moved[e] = relaxed(memory[e], row[1] * d, (time - since) / row[2])
        elif kind == el.REACTION:
            aim = slope * (spring if row[2] == 1.0 else mesh)
            if row[3] > 0.0:
                moved[e] = relaxed(memory[e], aim, (time - since) / row[3])
                aim = moved[e]
            on_input += row[1] * aim
        elif kind == el.BRISTLES:
            out = row[7] == el.OUTPUT
            now[e] = out_angle if out else angle
            w = out_speed if out else speed
            way = now[e] - before[e]
            moved[e] = relaxed(memory[e], math.copysign(1.0, way), abs(way) / row[4])
            torque = (row[1] + row[2] * decay(row[5], w / row[3])) * moved[e]
            if out:
                on_output -= torque
            else:
                on_input -= torque
        elif kind == el.RIPPLE:
            motor += row[1] * wave(row[4], row[2] * angle + row[3])[0]
        elif kind == el.VIBRATION:
            load += row[1] * math.cos(row[2] * clock + row[3])
        elif kind == el.LOAD_RIPPLE:
            load += plant.load * row[1] * wave(row[4], row[2] * out_angle + row[3])[0]
        elif kind == el.GRAVITY:
            load += row[1] * math.sin(out_angle + row[2])
        elif kind == el.WANDER:
            # The loop follows a set speed and its integral, neither of which is quite even.
            size, x = row[1] * plant.speed, row[2] * clock + row[3]
            motor += size * (row[4] * math.cos(x) + row[5] / row[2] * math.sin(x))
        elif kind == el.COUPLING:
            if row[7] == el.OUTPUT:
                on_output += row[1] * math.cos(row[2] * out_angle + row[3])
            else:
                on_input += row[1] * math.cos(row[2] * angle + row[3])
        elif kind >= el.DRY:
            if kind == el.MESH_FRICTION:
                moved[e] = relaxed(memory[e], mesh, (time - since) / row[2])
            if row[7] == el.OUTPUT:
                on_output -= friction_torque(plant, row, out_speed, out_angle, clock, moved[e])
            else:
                on_input -= friction_torque(plant, row, speed, angle, clock, moved[e])
    linear = plant.stiffness * (y[0] / plant.ratio - y[1])
    linear += plant.damping * (y[2] / plant.ratio - y[3])
    f[0] = motor + on_input - (mesh - linear) / plant.ratio - plant.input_damping * plant.speed
    f[1] = on_output + mesh - linear - plant.output_damping * plant.speed / plant.ratio
    f[2] = 0.0
    f[plant.load_row] -= load
    f[LOAD] = load
    return motor
