"""
Use RobustDTE in your study
===========================

A harmonic drive turns 101 turns of a motor into one turn of a joint. Its output is never exactly a
hundred-and-first of its input. The peak-to-peak of the difference over one output turn is the
*dynamic transmission error* (DTE), in arcsec. No two drives of a series are alike, so the DTE
scatters. :class:`~pymoo_hdte.problems.RobustDTE` asks for nominal values of four parameters
(stiffness, inertia, two dampings) that give a small mean DTE and a small standard deviation over
the series.

It is an ordinary pymoo ``Problem`` with two objectives, four real variables and no constraint. It
stands on a polynomial surrogate, whose moments are exact
(:ref:`how <sphx_glr_auto_guides_exact_moments.py>`). The true Pareto front of that surrogate is
known, and an evaluation costs microseconds.

The drive behind it is ``calibrated``: the equations of the paper with three effects added, whose
values were fitted to published statistics. As printed, the equations do not give the published DTE.
"""

import timeit

import matplotlib.pyplot as plt
import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.indicators.hv import HV
from pymoo.indicators.igd import IGD
from pymoo.optimize import minimize
from scipy.optimize import minimize as minimize_one

from pymoo_hdte.algorithms import AMPMOPSO, CompactSwarm
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems import OperatingCondition, RobustDTE, RobustDTETolerance, robust_dte_family
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

problem = RobustDTE()
print(problem)
for name, low, high in zip(problem.var_names, problem.xl, problem.xu, strict=True):
    print(f"{name:5} {low:9.4g} to {high:9.4g} {problem.units[name]}")

# %%
# Any algorithm
# -------------
#
# Nothing is special about the problem: any algorithm of pymoo for real variables runs on it. Here
# are three with 10 000 evaluations each: NSGA-II of pymoo, and two of this package, the paper's
# ``AMPMOPSO`` and ``CompactSwarm``.

algorithms = {
    "NSGA-II": NSGA2(pop_size=100),
    "AMP-MOPSO": AMPMOPSO(pop_size=100, archive_size=50),
    "CompactSwarm": CompactSwarm(),
}
results = {
    name: minimize(problem, algorithm, ("n_eval", 10_000), seed=1)
    for name, algorithm in algorithms.items()
}

# %%
# The true front of the order-3 surrogate
# ---------------------------------------
#
# ``pareto_front()`` and ``pareto_set()`` hold 1000 points or more, found by gradients from many
# starts and even in arc length. No algorithm that you may want to compare produced them. Indicators
# need a scale: give the corners of the front once, and all runs are measured alike (pymoo scales
# the reference point of the hypervolume too, so it is given in arcsec).
#
# The front is that of the surrogate, by default of order 3, and not that of the drive model:
# evaluated on a surrogate of order 5, every one of its designs is dominated.

front = problem.pareto_front()
ideal, nadir = front.min(axis=0), front.max(axis=0)
igd = IGD(front, zero_to_one=True, ideal=ideal, nadir=nadir)
corner = nadir + 0.1 * (nadir - ideal)
hv = HV(ref_point=corner, zero_to_one=True, ideal=ideal, nadir=nadir)

print(f"front of the order-3 surrogate: {len(front)} points, hypervolume {hv(front):.4f}")
for name, result in results.items():
    print(f"{name:12}  {len(result.F):3} points  IGD {igd(result.F):.4f}  HV {hv(result.F):.4f}")

# %%
# One run says little. For a comparison take 20 seeds or more and a paired test, as
# ``python -m experiments table7`` does. IGD depends on the number of points too: the archive of
# ``AMPMOPSO`` holds 50, the others return up to 100.

fig, ax = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
ax.plot(*front.T, color="0.6", lw=3, label="front of the order-3 surrogate")
for (name, result), marker in zip(results.items(), "ox+", strict=True):
    ax.plot(*result.F.T, marker, ms=5, fillstyle="none", label=name)
ax.set(xlabel="mean DTE [arcsec]", ylabel="standard deviation of the DTE [arcsec]")
ax.legend()
plt.show()

# %%
# One design of the front
# -----------------------
#
# The paper chooses by a weighted distance from the ideal point. ``WeightedUtopia`` is a
# ``DecisionMaking`` of pymoo.

F, X = results["CompactSwarm"].F, results["CompactSwarm"].X
for preference, weights in PREFERENCES.items():
    chosen = WeightedUtopia(weights).do(F)
    mean, std = F[chosen]
    stiffness = X[chosen, 0]
    print(f"{preference:17} K = {stiffness:.0f} N.m/rad: mean {mean:.2f}, std {std:.3f} arcsec")

# %%
# Gradients
# ---------
#
# Ask for ``dF``, shape (n, objectives, variables), and gradients come with the values. They are
# exact: central differences agree as far as rounding lets them.

design = problem.nominal[np.newaxis]
slopes = problem.evaluate(design, return_values_of=["F", "dF"])[1][0]
steps = 1e-5 * np.diag(problem.nominal)
F_up, F_down = (problem.evaluate(design + sign * steps) for sign in (1, -1))
differences = ((F_up - F_down) / (2e-5 * problem.nominal[:, np.newaxis])).T
error = np.abs(slopes / differences - 1.0).max()
print(f"largest relative difference below 1e-6: {error < 1e-6}")

# %%
# With them less than 50 evaluations of a gradient method find an end of the front. Variables are
# scaled to [0, 1], as the inertia is a hundred million times smaller than the stiffness.

span = problem.xu - problem.xl


def mean_dte(scaled):
    """Return the mean DTE and its gradient."""
    F, dF = problem.evaluate(problem.xl + span * scaled, return_values_of=["F", "dF"])
    return F[0], dF[0] * span


found = minimize_one(mean_dte, np.full(4, 0.5), jac=True, bounds=[(0.0, 1.0)] * 4)
print(f"found in less than 50 evaluations: {found.nfev < 50}")
print(f"smallest mean    {found.fun:.4f} arcsec")
print(f"end of the front {front[:, 0].min():.4f} arcsec")

# %%
# The family
# ----------
#
# ``robust_dte_family()`` names all members with a stored front. They differ in what makes a problem
# hard: ``resonant`` has a front of two pieces at order 3, a duty cycle averages over speeds and
# loads, with a free tolerance there are three objectives, and with grades of the error classes two
# constraints. Their fronts are those of their surrogates. The last, `RobustDTEDirect`, has no
# surrogate and asks the drive model itself. Each has a card, which says what makes it hard and how
# twelve algorithms do on it.

for name, build in robust_dte_family().items():
    if "_order" not in name:
        member = build()
        points = len(member.pareto_front())
        print(f"{name:22} {member.n_var} variables, {member.n_obj} objectives, {points} points")

# %%
# A duty cycle of your own
# ------------------------
#
# By default the drive runs at its rated speed and load. Conditions with weights replace them; the
# DTE is then their weighted mean. A problem with your own settings has no stored front:
# ``pareto_front()`` returns ``None``.

conditions = [
    OperatingCondition(2000 * REVOLUTION_PER_MINUTE, load_torque=40.0, weight=0.2),
    OperatingCondition(1000 * REVOLUTION_PER_MINUTE, load_torque=20.0, weight=0.5),
    OperatingCondition(300 * REVOLUTION_PER_MINUTE, load_torque=10.0, weight=0.3),
]
cycle = RobustDTE(conditions=conditions)
result = minimize(cycle, CompactSwarm(), ("n_eval", 5_000), seed=1)
print("stored front:", cycle.pareto_front())
print(f"mean {result.F[:, 0].min():.2f} to {result.F[:, 0].max():.2f} arcsec")

# %%
# The tolerance as a variable
# ---------------------------
#
# ``RobustDTE`` lets each parameter scatter by 5 %. Tighter tolerances cost money.
# ``RobustDTETolerance`` makes the tolerance a fifth variable and its cost, 0.05 / tolerance, a
# third objective.

priced = RobustDTETolerance()
result = minimize(priced, CompactSwarm(), ("n_eval", 10_000), seed=1)
mean, std, cost = result.F.T

fig, ax = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
points = ax.scatter(mean, std, c=100 * result.X[:, -1], s=18)
ax.set(xlabel="mean DTE [arcsec]", ylabel="standard deviation of the DTE [arcsec]")
fig.colorbar(points, label="tolerance [%]")
plt.show()

# %%
# Exact or sampled
# ----------------
#
# The paper integrates over 1000 random samples. ``moments="sample"`` does the same, with common
# random numbers for all designs. It is slower, and its values are off by the error of the sample.

sampled = RobustDTE(moments="sample", n_samples=1000, sample_seed=1)
X = np.random.default_rng(1).uniform(problem.xl, problem.xu, (100, 4))
seconds = {}
for name, one in (("exact", problem), ("sample", sampled)):
    F = one.evaluate(X)
    seconds[name] = min(timeit.repeat(lambda one=one: one.evaluate(X), number=1, repeat=5))
    print(f"{name:6} first design: mean {F[0, 0]:.3f}, std {F[0, 1]:.3f} arcsec")
print(f"exact is more than 20 times as fast: {seconds['sample'] > 20 * seconds['exact']}")
