"""
Use the swarms on your own problem
==================================

The algorithms of this package know nothing of drives. They take any pymoo problem with real
variables, finite bounds and two objectives or more, constrained or not. :doc:`/which_algorithm`
says which to take; here it is ``ElitistSwarm``, which follows no schedule and has nothing to tune.
"""

import pickle
import warnings

import matplotlib.pyplot as plt
import numpy as np
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from pymoo.termination import get_termination

from pymoo_hdte.algorithms import AMPMOPSO, ElitistSwarm

# %%
# A problem
# ---------
#
# Two bars carry a load of 100 kN. The left one is fixed 4 m beside the load, the right one 1 m.
# Choose their cross sections and the height of the joint such that both the volume and the largest
# stress are small. No stress may exceed 100 MPa. (The problem is that of Palli, Azarm, McCluskey
# and Sundararajan, Journal of Mechanical Design 120, 1998, as Deb states it in *Multi-objective
# optimization using evolutionary algorithms*, Wiley 2001.)
#
# ``X`` holds all particles of a generation, shape (n, 3). Fill ``out["F"]`` with (n, 2) objectives,
# all to be minimised, and ``out["G"]`` with (n, 1) constraints, which hold where they are at most
# 0. Variables may differ in size by any factor; the swarms step in shares of the bounds.


class TwoBarTruss(Problem):
    """Volume (m3) and largest stress (kPa) over two cross sections (m2) and a height (m)."""

    def __init__(self):
        super().__init__(
            n_var=3, n_obj=2, n_ieq_constr=1, xl=[1e-5, 1e-5, 1.0], xu=[0.01, 0.01, 3.0]
        )

    def _evaluate(self, X, out, *args, **kwargs):
        left, right, height = X.T
        left_length, right_length = np.sqrt(16.0 + height**2), np.sqrt(1.0 + height**2)
        stress = np.maximum(
            20.0 * left_length / (height * left), 80.0 * right_length / (height * right)
        )
        volume = left * left_length + right * right_length
        out["F"] = np.column_stack([volume, stress])
        out["G"] = stress[:, np.newaxis] / 1e5 - 1.0


truss = TwoBarTruss()
result = minimize(truss, ElitistSwarm(), ("n_eval", 10_000), seed=1)
volume, stress = result.F.T
print(f"{len(result.F)} solutions, all feasible: {bool((result.G <= 0).all())}")
print(f"volume {volume.min():.4f} to {volume.max():.4f} m3")

# %%
# The front has a closed form to hold that against. With equal stress s in both bars the volume is
# (20 (16 + h²) + 80 (1 + h²)) / (h s), which is smallest at h² = (20·16 + 80) / 100 = 4, where it
# is 400 / s. This holds as long as a cross section is not at its bound.

exact = 400.0 / stress
inside = result.X[:, :2].max(axis=1) < 0.0099
excess = (volume / exact - 1.0)[inside]
print(f"median excess over the closed form is below 1 %: {np.median(excess) < 0.01}")

fig, ax = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
range_ = np.geomspace(stress.min(), stress.max(), 200)
ax.loglog(400.0 / range_, range_, color="0.6", lw=3, label="closed form")
ax.loglog(volume, stress, "o", ms=4, fillstyle="none", label="ElitistSwarm")
ax.set(xlabel="volume [m³]", ylabel="largest stress [kPa]")
ax.legend()
plt.show()

# %%
# Three objectives
# ----------------
#
# On DTLZ2 the true front is an eighth of the unit sphere, so the objectives of every solution have
# length 1. With four objectives or more, take pymoo's ``NSGA3``.

result = minimize(get_problem("dtlz2"), ElitistSwarm(), ("n_gen", 150), seed=1)
length = np.linalg.norm(result.F, axis=1)
print(f"{len(result.F)} solutions, median length {np.median(length):.3f}")

ax = plt.figure(figsize=(5.0, 4.5), layout="constrained").add_subplot(projection="3d")
ax.scatter(*result.F.T, s=14)
ax.set(xlabel="f1", ylabel="f2", zlabel="f3")
ax.view_init(elev=25, azim=45)
plt.show()

# %%
# How long a run has
# ------------------
#
# Stop ``ElitistSwarm`` or go on whenever you like. ``AMPMOPSO``, the paper's algorithm, makes
# smaller steps towards the end of a run. ``("n_gen", n)`` and ``("n_eval", n)`` tell it how long
# that is; a limit of time does not:

with warnings.catch_warnings(record=True) as raised:
    warnings.simplefilter("always")
    minimize(truss, AMPMOPSO(), get_termination("time", 1), seed=1)
print(raised[-1].message)

# %%
# There ``n_max_gen`` gives the number that the schedule shall count on.

result = minimize(truss, AMPMOPSO(n_max_gen=100), get_termination("time", 1), seed=1)
print(f"the archive holds {len(result.F)} solutions")

# %%
# Ask and tell
# ------------
#
# Where something else computes the objectives, such as a test rig or a cluster, drive the algorithm
# yourself. ``ask`` gives the particles and evaluates nothing. Evaluate them as you like, in their
# order, and ``tell``.

algorithm = ElitistSwarm(pop_size=40)
algorithm.setup(truss, termination=("n_gen", 60), seed=3)
while algorithm.has_next():
    particles = algorithm.ask()
    outcome = truss.evaluate(particles.get("X"), return_as_dictionary=True)
    for particle, F, G in zip(particles, outcome["F"], outcome["G"], strict=True):
        particle.set("F", F)
        particle.set("G", G)
        particle.evaluated.update({"F", "G"})
    algorithm.evaluator.n_eval += len(particles)
    algorithm.tell(infills=particles)
by_hand = algorithm.result()
whole = minimize(truss, ElitistSwarm(pop_size=40), ("n_gen", 60), seed=3)
print("ask and tell gives the same front:", np.array_equal(by_hand.F, whole.F))

# %%
# Stop and go on
# --------------
#
# An algorithm can be pickled between any two generations. A run that goes on from the file equals
# one that was never interrupted, to the last bit, in another process too.

algorithm = ElitistSwarm(pop_size=40)
algorithm.setup(truss, termination=("n_gen", 60), seed=3)
for _ in range(25):
    algorithm.next()
stored = pickle.dumps(algorithm)
del algorithm

resumed = pickle.loads(stored)
while resumed.has_next():
    resumed.next()
print("resumed equals uninterrupted:", np.array_equal(resumed.result().F, whole.F))

# %%
# Bounds and first positions
# --------------------------
#
# A particle that leaves the box is put back on its border, which finds optima on bounds quickly.
# First positions are random in the box; ``sampling`` takes your own, for instance the outcome of an
# earlier run. A problem without finite bounds, with integers or with one objective is refused, and
# so is a misspelt argument.

first = ElitistSwarm(pop_size=len(whole.X), sampling=whole.X)
better = minimize(truss, first, ("n_gen", 60), seed=4)
print("goes on from an earlier front:", len(better.F), "solutions")
try:
    ElitistSwarm(population=100)
except TypeError as error:
    print(error)
