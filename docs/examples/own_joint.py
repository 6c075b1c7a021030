"""Write the log of a robot's joint, in which gravity, dry friction and a ripple are hidden.

    python docs/examples/own_joint.py FOLDER

FOLDER must be new or empty. The joint has a harmonic drive; its log has no titles, and its clock
jitters. `docs/bring_your_own_rig.md` goes on from here.
"""

import sys
from pathlib import Path

import numpy as np

INERTIA, VISCOUS, GAIN, RATIO = 0.4, 2.0, 7.6, 101  # kg.m2, N.m.s/rad, N.m/A
TRUTH = {"gravity": 3.0, "coulomb_friction": 1.5, "torque_ripple": 0.3}  # N.m


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
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        sys.exit(f"{folder} is not empty")
    np.savetxt(folder / "log.csv", log(), "%.6f", ",")
