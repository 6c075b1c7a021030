"""A rotor with the drag of ``docs/examples/eyring_drag.py``, which its model does not know."""

import sys

import numpy as np
from places import DOCS

from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.simulation import simulate_mechanism

sys.path.insert(0, str(DOCS / "examples"))

from eyring_drag import EYRING_DRAG, EyringDrag

__all__ = ["EYRING_DRAG", "OF_ROTOR", "ROTOR", "EyringDrag", "rotor_record"]

OF_ROTOR = EyringDrag(level=0.03, knee=8.0)
ROTOR = Mechanism(
    {"angle": BelievedValue(0.01)},
    [Port("bearing", {"angle": 1.0})],
    [Input("torque", {"angle": 1.0})],
)


def rotor_record(seed, role):
    """A rotor that is driven to and fro, simulated with the drag, and noise of its sensors.

    The drag has to be registered.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.004)
    lines = np.arange(1, 20) / 10.0
    phases = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    torque = 0.03 * np.cos(2.0 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    plan = Record(f"{role} {seed}", role, time, {"torque": torque})
    course = simulate_mechanism(ROTOR, plan, [LawAt("eyring_drag", "bearing", OF_ROTOR)])
    channels = {
        "angle": course.position["angle"] + 1e-5 * rng.standard_normal(len(time)),
        "torque": torque + 1e-4 * rng.standard_normal(len(time)),
    }
    return Record(f"{role} {seed}", role, time, channels)
