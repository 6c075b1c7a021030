"""A rig of your own from end to end: two CSV files, rig.toml, the command, the verdict.

    python docs/examples/own_rig.py FOLDER

FOLDER must be new or empty. A motor pushes a table on a leaf spring, and rig.toml believes that the
spring is linear. In truth it grows stiffer. `docs/bring_your_own_rig.md` explains what is printed.
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from pymoo_hdte.cli import command_line as cli

TRUTH = {  # SI; the first is hidden from the model: force over the cube of the deflection
    "hardening_stiffness: coefficient": 4e5,
    "inertia of position": 5.0,
    "stiffness of spring": 2000.0,
    "damping of spring": 20.0,
}
TIME = np.arange(10_000) / 500.0  # s
RIG = """\
title = "A table on a leaf spring"
[coordinates.position]
inertia = { value = 6.0, tolerance = 0.3 }
[ports.spring]
motion = { position = 1.0 }
stiffness = { value = 2200.0, tolerance = 0.3 }
damping = { value = 25.0, tolerance = 1.0 }
[inputs.force]
acts = { position = 1.0 }
gain = { value = 1.0 }
[table]
format = "csv"
time = { column = "time_s", unit = "s" }
channels.position = { column = "position_mm", unit = "mm" }
channels.force = { column = "force_N", unit = "N" }
[[records]]
file = "multisine.csv"
role = "train"
[[records]]
file = "sweep.csv"
role = "held_out"
"""


def motion(time, state, force):
    """Return speed and acceleration of the true rig."""
    cubic, mass, stiffness, damping = TRUTH.values()
    x, v = state
    return v, (force(time) - damping * v - stiffness * x - cubic * x**3) / mass


def make_folder(rig):
    """Write two records and ``rig.toml``."""
    generator, orders = np.random.default_rng(4), np.arange(1, 41)
    phases = generator.uniform(0.0, 2.0 * np.pi, 40)
    forces = {  # N; both go from 0.2 to 8 Hz
        "multisine.csv": lambda t: 4.5 * np.cos(2.0 * np.pi * 0.2 * orders * t + phases).sum(),
        "sweep.csv": lambda t: 15.0 * np.sin(2.0 * np.pi * (0.2 + 0.195 * t) * t),
    }
    for file, force in forces.items():
        run = solve_ivp(motion, (0, 20), (0, 0), "LSODA", TIME, args=[force], rtol=1e-8, atol=1e-10)
        rows = np.column_stack([TIME, [force(t) for t in TIME], 1e3 * run.y[0]])
        rows += [0.0, 0.1, 0.005] * generator.standard_normal(rows.shape)  # noise of the sensors
        np.savetxt(rig / file, rows, "%.4f", ",", header="time_s,force_N,position_mm", comments="")
    (rig / "rig.toml").write_text(RIG, encoding="utf-8")


def show(verdict):
    """Print what was found beside the truth, and the gaps on the record that was held out."""
    found = dict(verdict["base"])
    for effect in verdict["effects"]:
        found |= {f"{effect['name']}: {name}": one for name, one in effect["parameters"].items()}
    print(f"\n{'SI':32}{'truth':>10}{'found':>10}    95 % interval")
    for name, one in found.items():
        values = f"{TRUTH.get(name, np.nan):10.6g}{one['value']:10.6g}"
        print(f"{name:32}{values}    {'{:.6g} to {:.6g}'.format(*one['interval95'])}")
    for gap in verdict["held_out"]:
        sizes = "{before:.2g} before, {after:.1g} after, sensors {noise_floor:.1g}".format(**gap)
        print(f"Held out: {gap['quantity']} by {gap['kind']}: {sizes}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: own_rig.py FOLDER")
    rig = Path(sys.argv[1])
    rig.mkdir(parents=True, exist_ok=True)
    if any(rig.iterdir()):
        sys.exit(f"{rig} is not empty")
    make_folder(rig)
    if code := cli.main(["discrepancy", str(rig), "--out", str(rig / "report")]):
        sys.exit(code)
    show(json.loads((rig / "report" / "verdict.json").read_text(encoding="utf-8")))
