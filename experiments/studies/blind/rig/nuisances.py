"""Imperfections that every bench has beside what a case hides, each off unless a number is given.

The sheet of the bench states none of them. Phases, orders of a brake, poles of a motor and moments
of a change come from a generator of each group of `GROUPS`, so that a nuisance alone is the same as
among all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from experiments.studies.blind.rig import elements as el
from experiments.studies.blind.rig.elements import INPUT, OUTPUT, element
from experiments.studies.blind.rig.machine import SENSOR, Machine, ThirdBody
from experiments.studies.blind.rig.sensors import Drift, Mount, Sensors, ZeroDrift, ZeroStep
from experiments.studies.blind.rig.session import ARCSEC, Circumstances, Warming

Generator = np.random.Generator
Generators = Callable[[str], Generator]
"""From the name of a group to its generator."""

GROUPS = {
    "lag": ("lag",),
    "wander": ("wander",),
    "input_coupling": ("input_once", "input_twice"),
    "output_coupling": ("output_once", "output_twice"),
    "cogging": ("cogging", "cogging_uneven"),
    "mount": ("mount_compliance", "mount_frequency", "mount_damping"),
    "shaft": ("shaft_stiffness", "shaft_damping"),
    "brake_ripple": ("brake_once", "brake_poles"),
    "gravity": ("gravity",),
    "warming": ("warming", "warming_time"),
    "drift": ("angle_drift", "input_drift", "output_drift", "drift_time"),
    "zeros": ("angle_zero_change", "input_zero_change", "output_zero_change"),
    "saturation": ("input_range", "output_range"),
    "resolution": ("angle_step", "input_step", "output_step"),
    "sensor_at_brake": ("sensor_at_brake",),
}
"""Fields of `Nuisances` that are one nuisance; the last is a place and belongs to no level."""
MOTORS = ((3, 9), (4, 9), (4, 12), (5, 12), (7, 12))
"""Pole pairs and slots of usual servo motors, of which one is drawn."""
WANDERS = (0.07, 0.19, 0.5, 1.3, 3.0)
"""Hz, about which the set speed wanders: slower than the speed loop, faster than a record."""


@dataclass(frozen=True)
class Nuisances:
    """What a bench has, SI; zero is off.

    Attributes
    ----------
    lag : float
        Time by which the current loop lags, s.
    wander : float
        Standard deviation of the set speed, over its mean.
    input_once, input_twice, output_once, output_twice : float
        Torques of misaligned couplings, once and twice per turn of either shaft, N.m. Both act
        between the drive and its torque sensors, which do not show them.
    cogging, cogging_uneven : float
        Torque of the motor at the least common multiple of poles and slots, and at the slots and
        at the poles, as both are never quite even, N.m.
    mount_compliance, mount_frequency, mount_damping : float
        Of the base of the output's encoder, which the load turns: rad/(N.m), Hz, damping ratio.
    shaft_stiffness, shaft_damping : float
        Of the shaft with the torque sensor, behind which the load's inertia turns: N.m/rad,
        N.m.s/rad.
    brake_once, brake_poles : float
        Ripple of the brake once in its turn, and at a number of poles from 6 to 12, over the load.
    gravity : float
        Torque of the load's imbalance, beyond the output's sensor, N.m.
    warming, warming_time : float
        Share of viscous friction that is lost in the end, and the time constant, s.
    angle_drift, input_drift, output_drift, drift_time : float
        Zeros that run away: rad, N.m, N.m, with a time constant of seconds.
    angle_zero_change, input_zero_change, output_zero_change : float
        Changes of zeros between two records in the middle third of a session: rad, N.m, N.m.
    input_range, output_range : float
        Torques beyond which the amplifiers of the sensors show no more, N.m.
    angle_step, input_step, output_step : float
        Resolution of both scales, at the output, rad, and of both torques, N.m.
    sensor_at_brake : bool
        Whether the torque sensor of the output stands at the brake, behind the load's inertia.
    """

    lag: float = 0.0
    wander: float = 0.0
    input_once: float = 0.0
    input_twice: float = 0.0
    output_once: float = 0.0
    output_twice: float = 0.0
    cogging: float = 0.0
    cogging_uneven: float = 0.0
    mount_compliance: float = 0.0
    mount_frequency: float = 0.0
    mount_damping: float = 0.0
    shaft_stiffness: float = 0.0
    shaft_damping: float = 0.0
    brake_once: float = 0.0
    brake_poles: float = 0.0
    gravity: float = 0.0
    warming: float = 0.0
    warming_time: float = 0.0
    angle_drift: float = 0.0
    input_drift: float = 0.0
    output_drift: float = 0.0
    drift_time: float = 0.0
    angle_zero_change: float = 0.0
    input_zero_change: float = 0.0
    output_zero_change: float = 0.0
    input_range: float = 0.0
    output_range: float = 0.0
    angle_step: float = 0.0
    input_step: float = 0.0
    output_step: float = 0.0
    sensor_at_brake: bool = False

    def alone(self, group: str) -> Nuisances:
        """Return one of `GROUPS` alone.

        Raises
        ------
        KeyError
            For an unknown name.
        """
        return Nuisances(**{name: getattr(self, name) for name in GROUPS[group]})

    def has(self, group: str) -> bool:
        """Return whether one of `GROUPS` is on."""
        return any(getattr(self, name) for name in GROUPS[group])

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups that are on, in the order of `GROUPS`."""
        return tuple(group for group in GROUPS if self.has(group))


MILD = Nuisances(
    # One or two periods of the current loop of a servo amplifier, at 16 to 20 kHz.
    lag=1e-4,
    # A set point in whole counts per period of the loop; a cheap one wanders by 4e-4.
    wander=1e-5,
    # A bellows coupling with 0.05 mm and 0.1 degree of misalignment: some tenths of a per cent of
    # the rated torque, 0.4 N.m at the input and 40 N.m at the output.
    input_once=1e-3,
    input_twice=5e-4,
    output_once=0.06,
    output_twice=0.03,
    # Makers of servo motors state cogging of 0.5 to 1 % of the rated torque, of about 0.4 N.m.
    cogging=2e-3,
    cogging_uneven=5e-4,
    # A bracket of the encoder on a steel plate: 40 N.m turn it by 0.8 arcsec. First modes of such
    # benches lie between 50 and 150 Hz, and bolted steel has a damping ratio of 0.02 to 0.05.
    mount_compliance=1e-7,
    mount_frequency=85.0,
    mount_damping=0.03,
    # A flange sensor of 100 N.m with its adapters, three times as stiff as the softest sensors that
    # hidden effects have at their least size.
    shaft_stiffness=3e5,
    shaft_damping=2.0,
    # Hysteresis brakes ripple by some tenths of a per cent when they are demagnetised with care.
    brake_once=0.002,
    brake_poles=0.001,
    # 1 kg that is 3 mm off centre: what is left after a careful balance of the load.
    gravity=0.03,
    # Three degrees at 3.7 % a degree, as of an oil of 100 mm2/s at 40 and of 11 at 100 degrees C.
    warming=0.105,
    warming_time=600.0,
    # Three degrees: 0.2 arcsec a degree of the bracket; 0.05 % of the full scale of 2 and 100 N.m
    # in ten degrees, as classes of accuracy of torque sensors allow.
    angle_drift=0.6 * ARCSEC,
    input_drift=3e-4,
    output_drift=0.015,
    drift_time=600.0,
    # A new zero after a pause: what a sensor that was taken to zero again agrees with itself.
    angle_zero_change=0.5 * ARCSEC,
    input_zero_change=5e-4,
    output_zero_change=0.03,
    # Amplifiers set 2.5 % above the largest mean torque, which a fit of the ranges to the loads
    # suggests: only the resonance near the rated speed and the noise touch it.
    input_range=0.44,
    output_range=41.0,
    # A scale of 20 bits; 14 bits over twice 1 and 100 N.m.
    angle_step=2.0 * math.pi / 2**20,
    input_step=2.0 / 2**14,
    output_step=200.0 / 2**14,
)
"""What a good laboratory has. The reason of each number stands above it."""
LEVELS = {"mild": MILD}


def bench_with(about: Circumstances, nuisances: Nuisances, generators: Generators) -> Circumstances:
    """Return the circumstances of a session on a bench with nuisances.

    Parameters
    ----------
    about : Circumstances
    nuisances : Nuisances
    generators : callable
        Called only with the names of groups that are on.

    Returns
    -------
    Circumstances
        The same object where nothing is on.
    """
    if not nuisances.groups:
        return about
    machine = _machine_with(about.machine, nuisances, generators)
    sensors = _sensors_with(about, nuisances, generators)
    warming = Warming(nuisances.warming, nuisances.warming_time) if nuisances.warming else None
    return replace(about, machine=machine, sensors=sensors, warming=warming)


def _machine_with(machine: Machine, nuisances: Nuisances, generators: Generators) -> Machine:
    rows: list[tuple[float, ...]] = []
    if nuisances.has("wander"):
        rows += _wandering(machine, nuisances.wander, generators("wander"))
    for port, place in (("input", INPUT), ("output", OUTPUT)):
        if nuisances.has(f"{port}_coupling"):
            rng = generators(f"{port}_coupling")
            torques = getattr(nuisances, f"{port}_once"), getattr(nuisances, f"{port}_twice")
            rows += [
                element(el.COUPLING, torque, order, _phase(rng), 0.0, 0.0, 0.0, place)
                for order, torque in enumerate(torques, start=1)
            ]
    if nuisances.has("cogging"):
        rng = generators("cogging")
        pairs, slots = MOTORS[int(rng.integers(len(MOTORS)))]
        uneven = nuisances.cogging_uneven
        lines = (
            (math.lcm(2 * pairs, slots), nuisances.cogging),
            (slots, uneven),
            (2 * pairs, uneven),
        )
        rows += [element(el.RIPPLE, torque, order, _phase(rng)) for order, torque in lines]
    if nuisances.has("brake_ripple"):
        rng = generators("brake_ripple")
        poles = int(rng.integers(6, 13))
        shares = ((1, nuisances.brake_once), (poles, nuisances.brake_poles))
        rows += [element(el.LOAD_RIPPLE, share, order, _phase(rng)) for order, share in shares]
    if nuisances.has("gravity"):
        rows.append(element(el.GRAVITY, nuisances.gravity, _phase(generators("gravity"))))
    third = machine.third
    if nuisances.has("shaft"):
        third = ThirdBody(SENSOR, 0.0, nuisances.shaft_stiffness, nuisances.shaft_damping)
    return replace(
        machine,
        elements=(*machine.elements, *rows),
        third=third,
        lag=machine.lag + nuisances.lag,
        sensor_at_brake=nuisances.sensor_at_brake,
    )


def _wandering(machine: Machine, size: float, rng: Generator) -> list[tuple[float, ...]]:
    """Return lines of equal share whose squares add up to that of ``size``."""
    amplitude = size * (2.0 / len(WANDERS)) ** 0.5
    return [
        element(
            el.WANDER,
            amplitude,
            2.0 * math.pi * middle * rng.uniform(0.8, 1.25),
            _phase(rng),
            machine.proportional,
            machine.integral,
        )
        for middle in WANDERS
    ]


def _sensors_with(about: Circumstances, nuisances: Nuisances, generators: Generators) -> Sensors:
    sensors = about.sensors
    if nuisances.has("drift"):
        signs, time = generators("drift").choice([-1.0, 1.0], 3), nuisances.drift_time
        sensors = replace(
            sensors,
            drift=(*sensors.drift, Drift(float(signs[0]) * nuisances.angle_drift, time)),
            zero_drift=ZeroDrift(
                float(signs[1]) * nuisances.input_drift,
                float(signs[2]) * nuisances.output_drift,
                time,
            ),
        )
    if nuisances.has("zeros"):
        rng = generators("zeros")
        signs = rng.choice([-1.0, 1.0], 3)
        starts = np.sort(about.clocks)
        # Where the change falls into a record, it falls before it.
        third = len(starts) // 3
        place = int(rng.integers(third, max(2 * third, third + 1)))
        sensors = replace(
            sensors,
            zero_step=ZeroStep(
                float(signs[0]) * nuisances.angle_zero_change,
                float(signs[1]) * nuisances.input_zero_change,
                float(signs[2]) * nuisances.output_zero_change,
                float(starts[place]),
            ),
        )
    if nuisances.has("mount"):
        mount = Mount(
            nuisances.mount_compliance,
            2.0 * math.pi * nuisances.mount_frequency,
            nuisances.mount_damping,
        )
        sensors = replace(sensors, mount=mount)
    if nuisances.has("saturation"):
        sensors = replace(sensors, ranges=(nuisances.input_range, nuisances.output_range))
    if nuisances.has("resolution"):
        sensors = replace(
            sensors,
            angle_step=nuisances.angle_step or sensors.angle_step,
            torque_steps=(nuisances.input_step, nuisances.output_step),
        )
    return sensors


def _phase(rng: Generator) -> float:
    return float(rng.uniform(0.0, 2.0 * math.pi))
