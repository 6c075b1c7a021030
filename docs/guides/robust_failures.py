"""
Simulators that fail, scatter, or were run before
=================================================

Real simulators stop converging in some corner of the design space, draw random numbers, or have
been run a hundred times already. ``robust_problem`` counts failures as a response of their own,
takes the simulator's own scatter into mean, deviation and quantiles, and starts from runs in hand.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
from pymoo.optimize import minimize
from scipy.stats import norm, uniform

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.problems import (
    CrashProbability,
    Design,
    Mean,
    Quantile,
    Std,
    UntrustedSurrogate,
    robust_problem,
)

warnings.simplefilter("ignore", RuntimeWarning)

# %%
# A simulator that fails in a region
# ----------------------------------
#
# A valve passes a flow that grows with the root of the pressure above 0.6 bar. Below, its
# simulator gives NaN. It may as well raise, or exceed a ``time_limit``.


def valve(opening, pressure, leak):
    """Return the flow through a valve, NaN where the pressure does not open it."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(opening + pressure - 0.6) + leak


designs = {"opening": Design(0.3, 0.9, deviation=0.1)}
noise = {"pressure": uniform(0.1, 0.9), "leak": uniform(0.0, 0.3)}

problem = robust_problem(
    valve,
    designs,
    noise,
    objectives=[-Mean(), CrashProbability()],
    constraints=[CrashProbability() <= 0.1],
    accuracy=0.05,
    vectorised=True,
    progress=False,
)
print(f"{problem.n_runs} runs, {len(problem.failed)} of which failed")

# %%
# Where runs fail, all statistics are those of the runs that *succeed*, and ``CrashProbability``
# says how often they do not. Both bands grow towards the failing region. The reference is 100,000
# runs at each of 25 designs.

X = np.linspace(0.3, 0.9, 25)[:, None]
F, band = problem.evaluate(X, return_values_of=["F", "F_band"])
rng = np.random.default_rng(1)
draws = [
    rng.uniform(-0.1, 0.1, 100_000),
    rng.uniform(0.1, 1.0, 100_000),
    rng.uniform(0, 0.3, 100_000),
]
flows = [valve(x + draws[0], *draws[1:]) for x in X[:, 0]]
truth = np.array([[-np.nanmean(flow), np.isnan(flow).mean()] for flow in flows])

fig, axes = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
names = "minus mean flow of the runs that succeed", "probability of failing"
for axis, name, value, half, exact in zip(axes, names, F.T, band.T, truth.T, strict=True):
    axis.fill_between(X[:, 0], value - half, value + half, alpha=0.3, label="95 % band")
    axis.plot(X[:, 0], value, label="robust_problem")
    axis.plot(X[:, 0], exact, "k.", ms=4, label="100,000 runs a design")
    axis.set(title=name, xlabel="opening")
axes[0].legend()
plt.show()
inside = np.mean(np.abs(F - truth) <= band + 2e-3)
print("the bands cover at least 95 % of both:", bool(inside >= 0.95))

# %%
# The problem is optimised like any other. A design around which most runs fail is refused where no
# ``CrashProbability`` is asked for: its mean would look like that of any other design.

result = minimize(problem, CompactSwarm(), ("n_eval", 4_000), seed=1)
print("all designs of the front fail in at most 10 %:", bool(np.all(result.G <= 1e-9)))

# %%
# A random simulator
# ------------------
#
# A queue, a particle method or a neural network trained anew gives another result in every run. A
# simulator that takes an argument ``seed`` gets another whole number in each, and every point is
# run twice; ``replicates`` changes that, and is needed for one that takes no seed. The variance
# between the runs of a point is fitted like a response.


def queue(servers, load, seed):
    """Return the time in a queue, which scatters by itself the more, the fuller it is."""
    filled = load / servers
    return 1.0 / (1.0 - filled) + 0.3 * filled * np.random.default_rng(seed).standard_normal()


waiting = robust_problem(
    queue,
    {"servers": Design(2.0, 3.0)},
    {"load": norm(1.0, 0.08)},
    objectives=[Mean(), Std(), Quantile(0.95)],
    accuracy=0.2,
    budget=2000,
    progress=False,
)
print(f"{waiting.n_runs} runs of the queue")

# %%
# The standard deviation holds both kinds of scatter: that of the load, and the queue's own. For
# quantiles the latter is taken as normal.

X = np.linspace(2.0, 3.0, 25)[:, None]
F, band = waiting.evaluate(X, return_values_of=["F", "F_band"])
loads, own = norm(1.0, 0.08).rvs(100_000, random_state=2), rng.standard_normal(100_000)
by_load = np.array([1.0 / (1.0 - loads / x) for x in X[:, 0]])
times = by_load + 0.3 * loads / X * own
truth = np.column_stack([times.mean(axis=1), times.std(axis=1), np.quantile(times, 0.95, axis=1)])

fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.2), layout="constrained")
for k, (axis, name) in enumerate(zip(axes, ("mean", "deviation", "95 % quantile"), strict=True)):
    axis.fill_between(X[:, 0], F[:, k] - band[:, k], F[:, k] + band[:, k], alpha=0.3)
    axis.plot(X[:, 0], F[:, k])
    axis.plot(X[:, 0], truth[:, k], "k.", ms=4)
    axis.set(title=name, xlabel="servers")
axes[1].plot(X[:, 0], by_load.std(axis=1), "k:", label="of the load alone")
axes[1].legend()
plt.show()
inside = np.mean(np.abs(F - truth) <= band)
print("the bands cover at least 95 %:", bool(inside >= 0.95))

# %%
# Nothing is lost
# ---------------
#
# A refusal holds all runs, and the problem on the surrogate that was refused, whose band is as wide
# as its errors are. ``accept="best"`` returns that problem at once, with ``trusted`` False.


def kinked(x, a):
    """Return a response that no polynomial of low degree follows."""
    return np.abs(x - 0.5 + 0.5 * a) + a**2


study = {"x": Design(0.0, 1.0)}, {"a": norm(0.0, 0.3)}
try:
    robust_problem(kinked, *study, budget=60, vectorised=True, progress=False)
except UntrustedSurrogate as refusal:
    print(refusal)
    runs, flagged = refusal.runs, refusal.problem

print("runs in hand:", runs.X.shape, runs.Y.shape)
print("stated error of the flagged problem:", flagged.accuracy.round(2))

# %%
# ``data`` takes runs in hand: these, or those of any other study with the same inputs. They do not
# count in the budget, and with enough of them no simulator is needed.

more = robust_problem(kinked, *study, data=runs, accuracy=0.05, vectorised=True, progress=False)
print(f"{more.n_runs - len(runs.X)} further runs for 5 %")
none = robust_problem(None, *study, data=more.runs, accuracy=0.05, progress=False)
print("without a simulator, the same runs are as accurate:", bool(np.all(none.accuracy <= 0.05)))
