"""Hidden effects that are in no list of the library: something must be said to be missing.

Each says why no list holds it.
"""

from __future__ import annotations

import math

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import element
from experiments.studies.blind.rig.hidden import Drawn, Hidden
from experiments.studies.blind.rig.machine import SENSOR, ThirdBody
from experiments.studies.blind.rig.mesh_forms import RATED_SPEED, Generator, phase


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

    In no list: the library's ripple is the motor's.
    """
    order, at = float(rng.integers(3, 10)), phase(rng)
    return Drawn("load_ripple", "output", "cosine", rng.uniform(0.01, 0.05), 0.2,
                 lambda size: Hidden((element(el.LOAD_RIPPLE, size, order, at),)))  # fmt: skip


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

    In no list: the library's stiffness varies with the two lobes of the wave generator, of even
    orders, and its errors of other orders do not know the load.
    """
    order, at = float(rng.choice([1.0, 3.0])), phase(rng)
    return Drawn("load_growing_error", "mesh", f"order {order:g}", rng.uniform(0.02, 0.06), 0.15,
                 lambda size: Hidden((element(el.STIFFNESS_WAVE, size, order, at),)))  # fmt: skip


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
