"""What a case hides: an effect in one of its forms, drawn, and its size made visible."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from experiments.studies.blind.rig.elements import Values
from experiments.studies.blind.rig.machine import Machine, ThirdBody
from experiments.studies.blind.rig.sensors import Drift, ScaleError, Sensors

__all__ = ["Clash", "Drawn", "Hidden", "Values", "equipped"]


class Clash(ValueError):
    """Two effects that one bench cannot have both."""


@dataclass(frozen=True)
class Hidden:
    """One hidden effect as changes of machine and sensors.

    Attributes
    ----------
    elements : tuple of tuple of float
        Added to the machine's.
    load_inertia : float
        Added to the load's, kg.m2.
    third : ThirdBody or None
    lag : float
        Of the motor's torque, s.
    curvature : float
        Of the output's torque sensor.
    scale : tuple of ScaleError
    drift : tuple of Drift
    quantities : mapping
        True values of those unknowns of the library's law that this form has too, SI.
    """

    elements: tuple[tuple[float, ...], ...] = ()
    load_inertia: float = 0.0
    third: ThirdBody | None = None
    lag: float = 0.0
    curvature: float = 0.0
    scale: tuple[ScaleError, ...] = ()
    drift: tuple[Drift, ...] = ()
    quantities: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawn:
    """An effect drawn in one form, whose size may still be changed.

    Attributes
    ----------
    name : str
    port : str
        "input", "output", "mesh" or "sensor".
    form : str
        In a few words.
    size, largest : float
        Drawn size, and the largest that is plausible.
    build : callable
        From a size to what is hidden.
    scales : bool
        Whether the effect has a size at all.
    components : tuple of str
        Names of further effects that it contains: a friction that varies has a mean.
    simpler : callable or None
        From a size to the special case of another name that it is without what must be visible.
    """

    name: str
    port: str
    form: str
    size: float
    largest: float
    build: Callable[[float], Hidden]
    scales: bool = True
    components: tuple[str, ...] = ()
    simpler: Callable[[float], Hidden] | None = None

    @property
    def hidden(self) -> Hidden:
        """What is hidden at the drawn size."""
        return self.build(self.size)

    def times(self, factor: float) -> Drawn:
        """Return the same at a size larger by a factor, at most the largest."""
        return replace(self, size=min(self.size * factor, self.largest))


def equipped(
    machine: Machine, sensors: Sensors, effects: tuple[Hidden, ...]
) -> tuple[Machine, Sensors]:
    """Return machine and sensors with hidden effects.

    Raises
    ------
    Clash
        If two of them need a third body.
    """
    for effect in effects:
        if effect.third is not None and machine.third is not None:
            raise Clash("two third bodies")
        machine = replace(
            machine,
            elements=(*machine.elements, *effect.elements),
            load_inertia=machine.load_inertia + effect.load_inertia,
            third=effect.third or machine.third,
            lag=machine.lag + effect.lag,
        )
        sensors = replace(
            sensors,
            curvature=sensors.curvature + effect.curvature,
            scale=(*sensors.scale, *effect.scale),
            drift=(*sensors.drift, *effect.drift),
        )
    return machine, sensors
