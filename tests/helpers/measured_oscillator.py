"""An oscillator in multisine tests: hidden effects of forms that differ from the library's.

And a rotor with the drag of ``docs/examples/eyring_drag.py``, which its model does not know.
"""

import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from kept_results import files_in, kept
from places import DOCS
from scipy.integrate import solve_ivp

from pymoo_hdte.discrepancy import MeasuredMechanism, MechanismAnalysis, analyse
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.simulation import simulate_mechanism

sys.path.insert(0, str(DOCS / "examples"))

from eyring_drag import EYRING_DRAG as EYRING_DRAG
from eyring_drag import EyringDrag as EyringDrag

MASS, STIFFNESS, DAMPING = 1.0, 4000.0, 4.0
RATE, DURATION, HIGHEST = 250.0, 12.0, 12.0
POSITION_NOISE, FORCE_NOISE = 1e-5, 0.02
HELD_OUT = 4.0
"""Duration in s of a held-out record, which is simulated twice, in steps that Python takes."""

OSCILLATOR = Mechanism(
    inertias={"x": BelievedValue(1.0, 0.1)},
    ports=[Port("spring", {"x": 1.0}, BelievedValue(4100.0, 0.1), BelievedValue(5.0, 0.5))],
    inputs=[Input("force", {"x": 1.0})],
)

OF_ROTOR = EyringDrag(level=0.03, knee=8.0)
ROTOR = Mechanism(
    {"angle": BelievedValue(0.01)},
    [Port("bearing", {"angle": 1.0})],
    [Input("torque", {"angle": 1.0})],
)


def multisine(seed, size=20.0, duration=DURATION):
    """Return times and a force of random phases up to `HIGHEST` Hz, root mean square ``size``."""
    time = np.arange(0.0, duration, 1.0 / RATE)
    lines = np.arange(1, int(HIGHEST * duration)) / duration
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(lines))
    force = np.cos(2.0 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    return time, lines, phases, size / force.std()


@cache
def record_of(hidden, role="train", seed=1, size=20.0, duration=DURATION):
    """Return a record of m x'' + c x' + k x + hidden = F.

    ``hidden(x, v, z, t)`` returns a force and the rate of an inner state z.
    """
    time, lines, phases, scale = multisine(seed, size, duration)

    def force(t):
        return scale * np.cos(2.0 * np.pi * lines * t + phases).sum()

    def rates(t, state):
        x, v, z = state
        extra, inner = hidden(x, v, z, t)
        return [v, (force(t) - DAMPING * v - STIFFNESS * x - extra) / MASS, inner]

    found = solve_ivp(
        rates, (0.0, time[-1]), [0.0] * 3, t_eval=time, method="LSODA", rtol=1e-8, atol=1e-11,
        max_step=0.01,
    )  # fmt: skip
    noise = np.random.default_rng(100 + seed)
    return Record(
        f"{role} {seed}",
        role,
        time,
        {
            "x": found.y[0] + POSITION_NOISE * noise.standard_normal(len(time)),
            "force": [force(t) for t in time] + FORCE_NOISE * noise.standard_normal(len(time)),
        },
    )


def with_held_out(hidden):
    """Return a training record and a held-out one."""
    return [record_of(hidden), record_of(hidden, "held_out", seed=3, duration=HELD_OUT)]


def relay_record(seed, force_noise=1e-3):
    """Return a record of the bare oscillator under a force that jumps between its samples.

    Exact: a sum of step responses, at instants that no sample shows.
    """
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    jumps = np.cumsum(generator.uniform(0.4, 2.0, 100))
    sizes = 40.0 * np.where(np.arange(100) % 2, -1.0, 1.0)
    since = np.maximum(time[:, None] - jumps[jumps < DURATION], 0.0)
    decay = DAMPING / (2.0 * MASS)
    omega = np.sqrt(STIFFNESS / MASS - decay**2)
    swing = np.cos(omega * since) + decay / omega * np.sin(omega * since)
    response = (1.0 - np.exp(-decay * since) * swing) / STIFFNESS
    sizes = sizes[: since.shape[1]]
    noise = generator.standard_normal((2, len(time)))
    channels = {
        "x": response @ sizes + POSITION_NOISE * noise[0],
        "force": (since > 0.0) @ sizes + force_noise * noise[1],
    }
    return Record("relay", "train", time, channels)


def decay_record(force_noise=0.0):
    """Return a record of the bare oscillator let go, its force sensor at rest."""
    generator = np.random.default_rng(6)
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    decay = DAMPING / (2.0 * MASS)
    omega = np.sqrt(STIFFNESS / MASS - decay**2)
    x = 0.02 * np.exp(-decay * time) * np.cos(omega * time)
    noise = generator.standard_normal((2, len(time)))
    channels = {"x": x + POSITION_NOISE * noise[0], "force": force_noise * noise[1]}
    return Record("decay", "train", time, channels)


def nothing(x, v, z, t):
    """Nothing is hidden."""
    return 0.0, 0.0


def cubic(x, v, z, t):
    """Duffing's spring."""
    return 4e6 * x**3, 0.0


def bouc_wen(x, v, z, t):
    """Hysteresis after Bouc and Wen, where the library has springs that slip."""
    turning = 0.002
    return 3000.0 * z, v - 0.5 * (abs(v) * z + v * abs(z)) / turning


def swinging_stiffness(x, v, z, t):
    """A stiffness that varies with time by itself, which no law of the library does."""
    return 1500.0 * x * np.sin(np.pi * t), 0.0


@kept
def cubic_analysis() -> tuple[MechanismAnalysis, dict[str, bytes]]:
    """Return what is found on an oscillator with Duffing's spring, and the files of its report."""
    return reported(
        analyse(MeasuredMechanism(OSCILLATOR, with_held_out(cubic), title="oscillator"))
    )


def reported(analysis):
    """Return an analysis with all its parts worked out, and the files of its report by name."""
    with TemporaryDirectory() as top:
        analysis.report(Path(top) / "report")
        files = files_in(Path(top) / "report")
    return analysis, files


def rotor_record(seed, role):
    """A rotor that is driven to and fro, simulated with the drag, and noise of its sensors.

    The drag has to be registered.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0 if role == "train" else 2.0 * HELD_OUT, 0.004)
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
