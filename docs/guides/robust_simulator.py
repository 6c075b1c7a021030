"""
Make your simulator robust
==========================

Built parts differ from their drawings, and loads from their forecasts. A robust design is good on
average and scatters little. ``robust_problem`` takes a simulator, what is designed and what
scatters, and returns a problem of pymoo whose objectives are mean, standard deviation, quantiles
or other statistics. It builds a polynomial surrogate of the simulator, whose moments are exact, so
it needs some ten to hundred runs in all instead of thousands for each design.
"""

import chaospy
import matplotlib.pyplot as plt
import numpy as np
from pymoo.optimize import minimize
from scipy.stats import norm

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.problems import (
    Design,
    MeanPlusStd,
    Quantile,
    UntrustedSurrogate,
    robust_problem,
)

# %%
# A simulator
# -----------
#
# Any function of named numbers will do, also
# :ref:`one that fails or is random <sphx_glr_auto_guides_robust_failures.py>`. It may return one
# number, or several by name. Here it is an oscillator that stands on a shaking floor: how much of
# the shaking gets through, and how far its spring is stretched.


def mount(stiffness, damping, mass, speed):
    """Return transmissibility and stretch of a mount; stiffness in kN/m, speed in rad/s."""
    spring = 1e3 * stiffness
    loss = damping * speed
    inertia = mass * speed**2
    apart = np.hypot(spring - inertia, loss)
    return {"transmitted": np.hypot(spring, loss) / apart, "stretch": inertia / apart}


# %%
# What is designed has bounds, and a relative ``tolerance`` or an absolute ``deviation``. A number
# stands for a uniform band; any distribution of `chaospy`, or a frozen one of `scipy.stats`, may be
# given in its place. What is noise has a distribution; variables that depend on each other share a
# joint one under a tuple of their names. In the place of a distribution, ``Scenarios`` are values
# with weights, and an ``Interval`` has ends alone: every goal is taken at its worst in between.

designs = {
    "stiffness": Design(20.0, 60.0, tolerance=0.05),
    "damping": Design(200.0, 800.0, tolerance=chaospy.Triangle(-0.1, 0.0, 0.1)),
}
noise = {"mass": chaospy.Uniform(18.0, 22.0), "speed": norm(80.0, 2.0)}

# %%
# Objectives and constraints are statistics of a response. Runs and memory are estimated before the
# first run, with the region in which the simulator will be called (``progress=False`` hides this).

problem = robust_problem(
    mount,
    designs,
    noise,
    objectives=[MeanPlusStd(2.0, response=name) for name in ("transmitted", "stretch")],
    constraints=[Quantile(0.99, response="transmitted") <= 0.8],
    accuracy=0.02,
    vectorised=True,
    positive=True,
    progress=False,
)
print(f"{problem.n_runs} runs of the simulator")
print("degrees found:", problem.degrees)
print("error of mean + 2 std below 6 % of the scatter:", bool(np.all(problem.accuracy <= 0.06)))

# %%
# The response, its surrogate, and the error
# ------------------------------------------
#
# The surrogate is the most probable polynomial given the runs. The runs also tell how much each
# variable matters, and which degrees do. Its accuracy is what this leaves open about mean and
# deviation, scaled by how well each run is predicted from all others, relative to the *scatter*
# around a design: a surrogate that is good over the whole range can be wrong about the little that
# scatters. ``python -m experiments robust`` sets the runs that it takes beside those of others.
#
# There are no runs beyond the quantiles of 1e-5 of an unbounded scatter. What lies there counts as
# the surrogate goes on, if that is tame; otherwise it is left out. An estimate of what it adds, by
# what the last runs before it add, is part of the error.

stiffness, damping = np.meshgrid(np.linspace(20.0, 60.0, 61), np.linspace(200.0, 800.0, 61))
inputs = {"stiffness": stiffness, "damping": damping, "mass": 20.0, "speed": 80.0}
rows = [np.broadcast_to(inputs[name], stiffness.shape).ravel() for name in problem.input_names]
place = problem.responses.index("transmitted")
truth = mount(**inputs)["transmitted"]
found = problem.predict(np.column_stack(rows))[:, place].reshape(truth.shape)

fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.2), layout="constrained", sharey=True)
pictures = {"response": truth, "surrogate": found, "error": found - truth}
for axis, (name, values) in zip(axes, pictures.items(), strict=True):
    colours = axis.contourf(stiffness, damping, values, 20)
    axis.set(title=name, xlabel="stiffness [kN/m]")
    fig.colorbar(colours, ax=axis)
axes[0].set_ylabel("damping [N s/m]")
plt.show()

# %%
# Is it true? Here the simulator is cheap enough to ask 20,000 times at each of 50 designs.

rng = np.random.default_rng(1)
X = rng.uniform(problem.xl, problem.xu, (50, 2))
shares = {
    "stiffness": 1.0 + 0.05 * rng.uniform(-1.0, 1.0, 20_000),
    "damping": 1.0 + rng.triangular(-0.1, 0.0, 0.1, 20_000),
}
drawn = {"mass": rng.uniform(18.0, 22.0, 20_000), "speed": rng.normal(80.0, 2.0, 20_000)}
sampled = []
for row in X:
    scattered = {name: u * shares[name] for name, u in zip(problem.var_names, row, strict=True)}
    values = mount(**scattered, **drawn)
    both = np.array([values["transmitted"], values["stretch"]])
    sampled.append([both.mean(axis=1), both.std(axis=1)])
mean, std = np.moveaxis(np.array(sampled), 1, 0)
F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
own_error = 3.0 * std * 2.0 / np.sqrt(20_000)
covered = np.mean(np.abs(F - mean - 2.0 * std) <= band + own_error, axis=0)
print("the band covers at least 95 % of the designs:", bool(np.all(covered >= 0.95)))

# %%
# The front with its band
# -----------------------
#
# The problem is an ordinary one of pymoo, with gradients (``dF``, ``dG``) for those who want them.
# ``F_band`` is the estimated half-width of the error of each objective: designs that differ by less
# are indistinguishable.

result = minimize(problem, CompactSwarm(), ("n_eval", 6_000), seed=1)
half = problem.band(result.X)
print(f"{len(result.F)} designs, all feasible: {bool(np.all(result.G <= 1e-9))}")

fig, ax = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
ax.errorbar(*result.F.T, xerr=half[:, 0], yerr=half[:, 1], fmt="o", ms=3, lw=0.8)
ax.set(xlabel="transmitted, mean + 2 std", ylabel="stretch, mean + 2 std")
plt.show()

# %%
# When it refuses
# ---------------
#
# A surrogate that misses the wanted accuracy within the budget is refused, as is one that makes a
# positive response negative. The error says how bad it is, and where; it holds
# :ref:`all runs <sphx_glr_auto_guides_robust_failures.py>`, none of which has to be made again.

try:
    robust_problem(
        lambda b, h: 4.0 / (b * h**3),
        {name: Design(0.005, 0.05, tolerance=0.02) for name in ("b", "h")},
        budget=60,
        progress=False,
    )
except UntrustedSurrogate as error:
    print(error)

# %%
# More runs help, as does a narrower box, or ``scale="log"`` where a variable spans a factor of
# three or more: the surrogate then is a polynomial of its logarithm.

wide = robust_problem(
    lambda b, h: 4.0 / (b * h**3),
    {name: Design(0.005, 0.05, tolerance=0.02, scale="log") for name in ("b", "h")},
    progress=False,
)
print(f"with logarithms: {wide.n_runs} runs")

# %%
# Costly and flaky simulators
# ---------------------------
#
# ``executor`` takes any executor of `concurrent.futures`, or a Dask client, and ``at_once`` the
# number of workers. Finished runs go to the file ``cache`` one by one: if the process is killed,
# the same call goes on from there. Only the first run is made again where the simulator may have
# changed, to see whether the file is its own. Files that it reads and programs that it calls are
# not seen: delete the file where these have changed. A run that raises or gives NaN is made again
# before it counts as failed; the coordinates are in ``problem.failed``.
# :ref:`Three simulators <sphx_glr_auto_guides_robust_examples.py>` shows an equation of motion, a
# program that is called by `subprocess`, and the drive.
