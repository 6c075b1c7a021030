"""A joint of a robot from its log to a verdict: one file without titles, rig.toml, the command.

    python docs/examples/own_joint.py FOLDER

FOLDER must be new or empty. The log is of a joint with a harmonic drive, and rig.toml believes in
an inertia and a viscous friction only. `docs/bring_your_own_rig.md` explains what is printed.
"""

import sys
from pathlib import Path

import numpy as np

from pymoo_hdte.cli import command_line as cli

INERTIA, VISCOUS, GAIN, RATIO = 0.4, 2.0, 7.6, 101  # kg.m2, N.m.s/rad, N.m/A
TRUTH = {"gravity": 3.0, "coulomb_friction": 1.5, "torque_ripple": 0.3}  # N.m
RIG = """\
title = "A joint of a robot"
[coordinates.joint]
inertia = { value = 0.5, factor = 3.0 }
[ports.bearing]
motion = { joint = 1.0 }
damping = { value = 3.0, tolerance = 1.0 }
gear = { ratio = 101, kind = "harmonic drive" }
[inputs.current]
acts = { joint = 1.0 }
gain = { value = 7.6 }
[table]
time = { column = 0, unit = "s" }
channels.joint = { column = 1, unit = "rad" }
channels.current = { column = 2, unit = "A" }
[[records]]
file = "log.csv"
"""


def log():
    """Return the rows of the log, (n, 3): s, rad and A."""
    generator = np.random.default_rng(6)
    time = np.cumsum(generator.choice([0.010, 0.012], 4000))
    omega = 2.0 * np.pi * np.array([0.021, 0.047, 0.11, 0.19, 0.31, 0.53])
    phase = omega * time[:, None] + generator.uniform(0.0, 2.0 * np.pi, omega.size)
    sizes = np.minimum(0.45 / omega, 1.0)  # rad
    angle, speed = np.sin(phase) @ sizes, np.cos(phase) @ (omega * sizes)
    acceleration = -np.sin(phase) @ (omega**2 * sizes)
    gravity, dry, ripple = TRUTH.values()
    torque = INERTIA * acceleration + VISCOUS * speed + dry * np.sign(speed)
    torque += gravity * np.cos(angle + 0.4) + ripple * np.sin(2 * RATIO * angle)
    rows = np.column_stack([time, angle, torque / GAIN])
    return rows + [0.0, 2e-5, 0.02] * generator.standard_normal(rows.shape)  # noise of the sensors


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: own_joint.py FOLDER")
    rig = Path(sys.argv[1])
    rig.mkdir(parents=True, exist_ok=True)
    if any(rig.iterdir()):
        sys.exit(f"{rig} is not empty")
    np.savetxt(rig / "log.csv", log(), "%.6f", ",")
    (rig / "rig.toml").write_text(RIG, encoding="utf-8")
    if code := cli.main(["discrepancy", str(rig), "--out", str(rig / "report")]):
        sys.exit(code)
