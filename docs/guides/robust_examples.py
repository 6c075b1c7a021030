"""
Three simulators made robust
============================

:ref:`Make your simulator robust <sphx_glr_auto_guides_robust_simulator.py>` explains
``robust_problem`` with a formula. Here are three simulators as people have them: an equation of
motion that `scipy` integrates, a program that is called with a file of numbers, and the harmonic
drive of this package. Each ends with the same four pictures: response, surrogate, the error of the
surrogate, and the front with its band.
"""

import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import chaospy
import matplotlib.pyplot as plt
import numpy as np
from pymoo.optimize import minimize
from scipy.integrate import solve_ivp
from scipy.stats import norm

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.drive import preset
from pymoo_hdte.problems import (
    Design,
    Mean,
    MeanPlusStd,
    Quantile,
    RobustDTE,
    SimulatorProblem,
    Std,
    robust_problem,
)


def pictures(problem, simulator, response, fixed, labels):
    """Draw a response over two inputs and the front; ``fixed`` holds the other inputs."""
    first, second = labels
    low, high = (dict(zip(problem.var_names, ends, strict=True)) for ends in problem.bounds())
    sides = [np.linspace(low[name], high[name], 9) for name in labels]
    grid = np.meshgrid(*sides, indexing="ij")
    rows = [fixed | {first: x, second: y} for x, y in zip(*map(np.ravel, grid), strict=True)]
    truth = np.array([float(np.squeeze(simulator(**row)[response])) for row in rows])
    values = [[row[name] for name in problem.input_names] for row in rows]
    found = problem.predict(values)[:, problem.responses.index(response)]

    fig, axes = plt.subplots(1, 4, figsize=(12.5, 3.0), layout="constrained")
    shown = {"response": truth, "surrogate": found, "error of the surrogate": found - truth}
    for axis, (title, z) in zip(axes[:3], shown.items(), strict=True):
        colours = axis.contourf(*grid, z.reshape(grid[0].shape), 16)
        axis.set(title=title, xlabel=labels[first], ylabel=labels[second])
        axis.ticklabel_format(scilimits=(-2, 4))
        fig.colorbar(colours, ax=axis)
    result = minimize(problem, CompactSwarm(), ("n_eval", 6_000), seed=1)
    half = problem.band(result.X)
    order = np.argsort(result.F[:, 0])
    x, y, (dx, dy) = *result.F[order].T, half[order].T
    axes[3].errorbar(x, y, yerr=dy, xerr=dx, fmt="o", ms=2, ecolor="0.7", lw=0.6, errorevery=8)
    axes[3].set(title="front with band", xlabel=problem.obj_names[0], ylabel=problem.obj_names[1])
    plt.show()
    return result


# %%
# An equation of motion
# ---------------------
#
# A quarter of a car drives over a bump. Designed are spring and damper of its suspension; what it
# carries, and its speed, are not known. The simulator integrates the equations of motion and
# returns how strongly the body shakes and how far the wheel moves against it, both as root mean
# squares over two seconds: a polynomial follows them better than a largest value, which has a kink
# where one peak overtakes another. For the same reason the tolerance of the integrator is small.


def quarter_car(stiffness, damping, mass, speed):
    """Return shaking in m/s^2 and travel in mm; stiffness in kN/m, damping in kN s/m."""
    wheel, tyre, height, length = 40.0, 200e3, 0.05, 2.0

    def motion(t, state):
        body, body_speed, hub, hub_speed, *_ = state
        place = speed * t
        road = height * np.sin(np.pi * place / length) ** 2 if place < length else 0.0
        force = 1e3 * (stiffness * (hub - body) + damping * (hub_speed - body_speed))
        shaking = force / mass
        reaction = (tyre * (road - hub) - force) / wheel
        travel = hub - body
        return [body_speed, shaking, hub_speed, reaction, shaking**2, travel**2]

    # The bump's end is a place to begin anew: no step of the integrator runs over it.
    state, ends = np.zeros(6), (0.0, length / speed, 2.0)
    for start, stop in pairwise(ends):
        done = solve_ivp(motion, (start, stop), state, method="DOP853", rtol=1e-6, atol=1e-10)
        state = done.y[:, -1]
    return {"shaking": np.sqrt(state[4] / 2.0), "travel": 1e3 * np.sqrt(state[5] / 2.0)}


car = robust_problem(
    quarter_car,
    designs={
        "stiffness": Design(10.0, 40.0, tolerance=0.05),
        "damping": Design(0.6, 3.0, tolerance=0.1),
    },
    noise={"mass": chaospy.Uniform(250.0, 400.0), "speed": norm(8.0, 0.8)},
    objectives=[MeanPlusStd(2.0, response=name) for name in ("shaking", "travel")],
    accuracy=0.05,
    progress=False,
)
print(f"car: {car.n_runs} runs of the integrator, degrees {car.degrees}")
axes_of_car = {"stiffness": "stiffness [kN/m]", "damping": "damping [kN s/m]"}
result = pictures(car, quarter_car, "shaking", {"mass": 320.0, "speed": 8.0}, axes_of_car)

# %%
# Which input makes the best compromise scatter? Sobol indices of the surrogate are exact.

middle = result.X[np.argsort(result.F[:, 0])[len(result.X) // 2]]
shares = car.sobol_indices(middle, "shaking")
for name, total in zip(shares.names, shares.total, strict=True):
    print(f"{name:10} takes part in {100.0 * total:4.1f} % of the variance of the shaking")

# %%
# A program that is called
# ------------------------
#
# Many simulators are programs: they read a file and print numbers. The one here computes how much
# hotter than the air the root of a cooling fin is, by finite differences. Threads are enough to
# keep several processes busy. A process that ends with an error raises here, and the run is made
# again; finished runs are kept in a file, from which the same call goes on if all of it is killed.

PROGRAM = """
import sys
length, thickness, film, power = (float(word) for word in open(sys.argv[1]).read().split())
cells, conductivity, depth = 200, 160.0, 0.1
step = length / cells
along = conductivity * thickness * depth / step
across = 2.0 * film * depth * step
# Tridiagonal equations, eliminated from the tip to the root.
stiff = across + film * depth * thickness
for _ in range(cells):
    stiff = across + along * stiff / (along + stiff)
print("rise", power / stiff)
print("mass", 2700.0 * length * thickness * depth)
"""

folder = tempfile.TemporaryDirectory()
program = Path(folder.name) / "fin.py"
program.write_text(PROGRAM)


def fin(length, thickness, film, power):
    """Return temperature rise in K and mass in g; lengths in mm, film in W/m^2/K, power in W."""
    with tempfile.NamedTemporaryFile("w", dir=folder.name, suffix=".txt") as file:
        file.write(f"{1e-3 * length} {1e-3 * thickness} {film} {power}")
        file.flush()
        command = [sys.executable, "-S", "-E", program, file.name]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    found = dict(line.split() for line in done.stdout.splitlines())
    return {"rise": float(found["rise"]), "mass": 1e3 * float(found["mass"])}


with ThreadPoolExecutor(2) as workers:
    cooler = robust_problem(
        fin,
        designs={
            "length": Design(20.0, 60.0, deviation=0.5),
            "thickness": Design(0.5, 3.0, deviation=0.1),
        },
        noise={"film": chaospy.Triangle(45.0, 60.0, 80.0), "power": chaospy.Normal(20.0, 1.0)},
        objectives=[Mean(response="mass"), Quantile(0.95, response="rise")],
        accuracy=0.05,
        executor=workers,
        at_once=2,
        cache=Path(folder.name) / "runs.jsonl",
        progress=False,
    )
print(f"fin: {cooler.n_runs} runs of the program, {len(cooler.failed)} left out")
axes_of_fin = {"length": "length [mm]", "thickness": "thickness [mm]"}
result = pictures(cooler, fin, "rise", {"film": 60.0, "power": 20.0}, axes_of_fin)

# %%
# A problem is saved without its simulator, and comes back with the same numbers.

cooler.save(Path(folder.name) / "fin.npz")
again = SimulatorProblem.load(Path(folder.name) / "fin.npz")
same = np.array_equal(again.evaluate(result.X), cooler.evaluate(result.X))
print("loaded, the problem gives the same bytes:", same)
folder.cleanup()

# %%
# The drive
# ---------
#
# The drive is a simulator like any other. `RobustDTE` fits a tensor polynomial to it, of order 3 to
# 1024 runs, without an error estimate; here the wanted accuracy decides the number of runs.

model = preset("calibrated")
paper = RobustDTE()


def drive(**inputs):
    """Return the dynamic transmission error in arcsec; numbers or arrays in SI units."""
    columns = [np.atleast_1d(inputs[name]) for name in ("theta_s", *paper.var_names)]
    return {"dte": model.dte_arcsec(np.column_stack(columns))}


bounds = zip(paper.var_names, paper.xl.tolist(), paper.xu.tolist(), strict=True)
joint = robust_problem(
    drive,
    designs={name: Design(low, high, tolerance=0.05) for name, low, high in bounds},
    noise={"theta_s": paper.inputs[0]},
    objectives=[Mean(), Std()],
    accuracy=0.05,
    vectorised=True,
    positive=True,
    progress=False,
)
print(f"drive: {joint.n_runs} runs, degrees {joint.degrees}")
nominal = dict(zip(paper.var_names, paper.nominal.tolist(), strict=True))
nominal["theta_s"] = paper.inputs[0].mean
axes_of_drive = {"K": "K [N.m/rad]", "J_in": "J_in [kg.m2]"}
result = pictures(joint, drive, "dte", nominal, axes_of_drive)

# %%
# The band is wide compared with the front: at this accuracy designs along it are indistinguishable.
# Is the band right? The drive model itself is run 2,000 times around each of 20 designs.

rng = np.random.default_rng(1)
scatter = np.column_stack([one.sample(rng, 2_000) for one in paper.inputs])
X = np.random.default_rng(2).uniform(joint.xl, joint.xu, (20, 4))
sampled = []
for design in X:
    drives = model.dte_arcsec(scatter * np.append(1.0, design))
    sampled.append([drives.mean(), drives.std()])
sampled = np.array(sampled)
F, band = joint.evaluate(X, return_values_of=["F", "F_band"])
for name, problem in (("robust_problem", joint), ("order 3", paper)):
    apart = np.abs(problem.evaluate(X) - sampled)
    print(f"{name:14} off by {np.median(apart, axis=0).round(2)} arcsec in the median")
own_error = sampled[:, 1:] * 3.0 / np.sqrt(2_000)
held = np.mean(np.abs(F - sampled) <= band + own_error)
print(f"the band holds {100.0 * held:.0f} % of what the drive model gives")
