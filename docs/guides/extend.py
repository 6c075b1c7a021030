"""
Extend the package
==================

Five things that people add: an effect, a port, a kind of machine, a part of an algorithm and an
experiment. Each is a small class or function of your own; none needs a change in the package.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pymoo.indicators.igd import IGD
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import ElitistSwarm, EntropyWeight, Flat, LinearDecrease, ParticleSwarm
from pymoo_hdte.algorithms.crowding import least_crowded
from pymoo_hdte.algorithms.moves import Attraction, Difference, Exchange
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse
from pymoo_hdte.drive import LawAtPort, harmonic_balance, preset, simulate_drive
from pymoo_hdte.drive.toml_text import model_toml
from pymoo_hdte.effects import register
from pymoo_hdte.mechanism import (
    BelievedValue,
    Input,
    LawAt,
    Mechanism,
    Port,
    Record,
    simulate_mechanism,
)
from pymoo_hdte.problems import RobustDTE

# %%
# An effect
# ---------
#
# An *effect* is a law with everything that the package should know about it, in one file. The
# lubricant whose molecules jump over energy barriers (Eyring, Journal of Chemical Physics 4, 1936)
# has a drag that is proportional to the speed when slow, to its logarithm when fast. This is all of
# it, ``docs/examples/eyring_drag.py``:
#
# .. literalinclude:: ../examples/eyring_drag.py
#    :language: python
#
# The *law* says with which torque (or force) a place answers to the motion there. ``respond`` gets
# the motion at the port as a ``PortState``, arrays of one shape, and returns torque and both
# derivatives, which Newton's method needs. Laws that depend on no angle inherit ``Aperiodic``;
# those that vary with one inherit ``Periodic`` and name their order, so that solvers keep its
# harmonics. What else solvers ask of a law (inner states, clearance, breakaway) has a default in
# ``pymoo_hdte.effects.law.Behaviour``. There ``formula`` and ``lumped`` tell exports to other
# tools what the law is.
#
# The ``Effect`` names the ports of a drive where the law makes sense, its numbers with their units,
# its sentence in a report, what it holds as a special case, and a *guess*: from the sizes of a port
# to the unknowns of a fit, with their bounds and starts. ``register`` makes it known.
#
# Further facts are optional: the family of ``forms`` that the law may have, the effect of which it
# is another form, the base parameter that it ``covers``, and what distinguishes it in a test. Laws
# that depend on the way since the last reversal keep inner states, as the seal in
# ``docs/examples/gripping_seal.py`` does.

HERE = Path(sys.argv[0]).resolve().parent  # in a notebook: the folder docs/guides
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "examples")]

import virtual_campaign
from eyring_drag import EYRING_DRAG, EyringDrag
from ring_down import Oscillator, RingDown

from experiments.studies.virtual_rig.own_effects import with_effects
from experiments.studies.virtual_rig.rig import draw_rig, run_campaign

register(EYRING_DRAG)

# %%
# At a port of a mechanism
# ------------------------
#
# A ``Mechanism`` takes any law at any of its ports. A flywheel turns at 30 rad/s and is slowed down
# by the drag alone. With the small-speed limit of the law its speed would fall exponentially.

drag = EyringDrag(level=0.02, knee=5.0)
flywheel = Mechanism({"angle": BelievedValue(0.01)}, [Port("bearing", {"angle": 1.0})])
time = np.arange(0.0, 8.0, 0.01)
idle = Record("coasting down", "train", time, {})
course = simulate_mechanism(
    flywheel, idle, [LawAt("eyring_drag", "bearing", drag)], start={"angle": (0.0, 30.0)}
)

# %%
# Energy is a check that needs no second solver: what the flywheel loses is the work of the drag.

speed = course.speed["angle"]
lost = 0.5 * 0.01 * (speed[0] ** 2 - speed**2)
power = 0.02 * np.arcsinh(speed / 5.0) * speed
work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * 0.01)])
print(f"energy balance to {np.abs(work / lost[-1] - lost / lost[-1]).max():.0e}")

fig, ax = plt.subplots(figsize=(6.5, 3.5), layout="constrained")
ax.semilogy(time, speed, label="Eyring's drag")
ax.semilogy(time, 30.0 * np.exp(-0.02 / 5.0 / 0.01 * time), "--", label="its small-speed limit")
ax.set(xlabel="time [s]", ylabel="speed [rad/s]")
ax.legend()
plt.show()

# %%
# The effect can also be found in measured records. A motor drives the wheel to and fro; from its
# torque and angle, both with noise, `analyse` finds what a frictionless wheel lacks.

wheel = Mechanism(flywheel.inertias, flywheel.ports, [Input("torque", {"angle": 1.0})])
time = np.arange(0.0, 20.0, 0.004)
generator = np.random.default_rng(1)
phases = generator.uniform(0.0, 2.0 * np.pi, 38)
torque = 0.03 * np.cos(2.0 * np.pi * np.outer(time, np.arange(2, 40) / 20.0) + phases).sum(axis=1)
plan = Record("to and fro", "train", time, {"torque": torque})
course = simulate_mechanism(wheel, plan, [LawAt("eyring_drag", "bearing", drag)])
angle = course.position["angle"] + 1e-5 * generator.standard_normal(len(time))
record = replace(plan, channels={"torque": torque, "angle": angle})
verdict = analyse(MeasuredMechanism(wheel, [record])).verdict
for effect in verdict.accepted.effects:
    print(f"{verdict.status}: {effect.name}, {effect.law}")

# %%
# In a drive
# ----------
#
# A drive model is a data sheet with effects; ``LawAtPort`` puts a law at one of its ports,
# ``input``, ``mesh`` or ``output``.

calm = preset("published")
lubricant = LawAtPort("eyring_drag", "input", EyringDrag(0.05, 20.0))
draggy = replace(calm, name="draggy", effects=(lubricant,))
design = calm.nominal

motor = []
for model in (calm, draggy):
    balance = harmonic_balance(model.coefficients(design[np.newaxis]))
    motor.append(balance.motor_torque[0, 0].real)
expected = 0.05 * np.arcsinh(calm.sheet.input_speed / 20.0)
print(f"mean motor torque {motor[0]:.4f} N.m, with the drag {motor[1]:.4f} N.m")
print(f"difference {motor[1] - motor[0]:.4f} N.m, in closed form {expected:.4f} N.m")

# %%
# The integrator, the robust problem and model files know it as well.

steady = draggy.dte_arcsec(design[np.newaxis])[0]
integrated = simulate_drive(draggy, design, ramp=0.2, settle=0.3).dte_arcsec()
print(f"DTE: steady state {steady:.3f}, integrated {integrated:.3f} arcsec")
scenario = preset("calibrated")
scenario = replace(scenario, name="calibrated_draggy", effects=(*scenario.effects, lubricant))
mean, std = RobustDTE(scenario, order=1).evaluate(scenario.nominal[np.newaxis, 1:])[0]
print(f"robust problem on it: mean {mean:.1f}, std {std:.1f} arcsec")
print(model_toml(scenario)[-170:])

# %%
# A campaign on a rig that has the effect gets it named, with its values and a revised model. Here
# the rig is virtual.

generator = np.random.default_rng(3)
rig = draw_rig(virtual_campaign.BELIEVED, (), generator)
campaign = run_campaign(rig, virtual_campaign.BELIEVED, virtual_campaign.RIG, generator)
analysis = analyse(with_effects(campaign, rig, [lubricant]))
print(f"{analysis.verdict.status}: {analysis.revised_model().effects[-1]}")

# %%
# On the command line, give the file beside the campaign or rig; nothing has to be registered:
#
# .. code-block:: sh
#
#    pymoo-hdte discrepancy my_campaign --effects eyring_drag.py --out report

# %%
# What is no law at a port, such as an inertia or an error of a sensor, is a subclass of
# ``pymoo_hdte.drive.DriveEffect``, registered as the ``change`` of an ``Effect``: see the files in
# ``pymoo_hdte/drive/_effects``.
#
# A port
# ------
#
# The ports of a drive are fixed, those of a mechanism are yours. A port is a place where parts move
# against each other: its motion is a sum of coordinates. Here a motor drives a load through a belt
# of ratio 4. The belt is one port, and each bearing is another.

belt_drive = Mechanism(
    inertias={"motor": BelievedValue(2e-4), "load": BelievedValue(5e-3)},
    ports=[
        Port("belt", {"motor": 0.25, "load": -1.0}, BelievedValue(40.0), BelievedValue(0.01)),
        Port("motor_bearing", {"motor": 1.0}, damping=BelievedValue(1e-4)),
        Port("load_bearing", {"load": 1.0}, damping=BelievedValue(2e-3)),
    ],
    inputs=[Input("torque", {"motor": 1.0})],
)
time = np.arange(0.0, 1.5, 0.001)
step = Record("step", "train", time, {"torque": np.where(time < 0.1, 0.0, 0.05)})
plain = simulate_mechanism(belt_drive, step)
with_drag = simulate_mechanism(
    belt_drive, step, [LawAt("eyring_drag", "load_bearing", EyringDrag(0.02, 1.0))]
)
for name, course in (("plain", plain), ("with drag", with_drag)):
    print(f"{name:9} speed of the load after 1.5 s: {course.speed['load'][-1]:.2f} rad/s")

# %%
# The torsional frequency is the root of K (1/J_load + ratio²/J_motor), here with little damping:

frequency = np.sqrt(40.0 * (1.0 / 5e-3 + 0.25**2 / 2e-4)) / (2.0 * np.pi)
stretch = 0.25 * plain.position["motor"] - plain.position["load"]
ringing = stretch[(time >= 0.1) & (time < 0.6)]
ringing = ringing - ringing.mean()
crossings = np.count_nonzero(ringing[1:] * ringing[:-1] < 0.0)
print(f"belt: expected {frequency:.1f} Hz, {crossings / 2 / 0.5:.0f} Hz counted in half a second")

# %%
# A kind of machine
# -----------------
#
# Where measurements are neither order lines nor force balances, a class with ``records`` and
# ``evidence`` is enough. ``evidence(records)`` returns a ``ModelEvidence`` with three things: the
# unknowns of the model, ``residuals(values, effects)`` that compares predictions with records, and
# the ``sizes`` of the ports at which effects may be. Search, verdict, validation, next test, report
# and revised model come with it. Ring-down tests, of which only turning points are recorded, are
# one such kind, all of it in ``docs/examples/ring_down.py``:
#
# .. literalinclude:: ../examples/ring_down.py
#    :language: python
#
# Turning points of an oscillator with viscous and dry friction are known in closed form
# (Den Hartog, Transactions of the ASME 53, 1931). The model lacks the dry friction.

stiffness, frequency, damping, friction, noise = 4e3, 63.0, 0.8, 0.03, 2e-6
shrink = np.exp(-0.5 * np.pi * damping * frequency / stiffness)
tests = []
for name, deflection in (("wide", 4e-3), ("less", 3e-3), ("narrow", 1.5e-3), ("held", 2e-3)):
    points = [deflection]
    while len(points) < 90 and points[-1] > 5.0 * friction / stiffness:
        points.append((points[-1] - friction / stiffness) * shrink - friction / stiffness)
    points = np.array(points) + noise * generator.standard_normal(len(points))
    tests.append(RingDown(name, "held_out" if name == "held" else "train", points))
analysis = analyse(Oscillator(stiffness, frequency, 0.85, 0.2, noise, tests))
print(f"{analysis.verdict.status}: {analysis.revised_model().effects[0]}, {friction} N is hidden")
print(analysis.locate().sentence)
error = analysis.validate().overall
print(f"prediction error, in standard deviations of the noise: {error.after:.2f}")

# %%
# A part of an algorithm
# ----------------------
#
# An ``ElitistSwarm`` is made of moves, a mutation and a truncation. A *move* is a callable that
# returns the steps of some particles. The swarm gives more particles to a move the more of them
# survive, so that a bad move costs little. Use the random generator that is handed in, and nothing
# else random: then runs repeat to the last bit.


class BareBones:
    """A normal step around the middle of particle and leader (Kennedy 2003)."""

    def __call__(self, X, leaders, swarm, random_state):
        """Return the steps (n, d)."""
        normal = random_state.standard_normal(X.shape)
        return 0.5 * (leaders - X) + np.abs(leaders - X) * normal


# %%
# A *truncation* takes objectives and a size, and returns which rows stay. The default keeps the set
# evenly spread; here crowding distance of NSGA-II takes its place, and beside it a random choice,
# to see what the part is worth.


def random_rows(F, size):
    """Keep rows at random, always the same ones."""
    return np.sort(np.random.default_rng(0).permutation(len(F))[:size])


problem = RobustDTE("resonant")
front = problem.pareto_front()
igd = IGD(front, zero_to_one=True, ideal=front.min(axis=0), nadir=front.max(axis=0))
swarms = {
    "as it is": lambda: ElitistSwarm(),
    "bare bones alone": lambda: ElitistSwarm(moves=[BareBones()]),
    "bare bones as a fourth": lambda: ElitistSwarm(
        moves=[Attraction(), Exchange(), Difference(), BareBones()]
    ),
    "crowding distance": lambda: ElitistSwarm(quality=least_crowded),
    "random truncation": lambda: ElitistSwarm(quality=random_rows),
}
for name, make in swarms.items():
    found = [igd(minimize(problem, make(), ("n_gen", 40), seed=seed).F) for seed in range(1, 12)]
    low, median, high = np.quantile(found, [0.0, 0.5, 1.0])
    print(f"{name:24} median IGD of 11 seeds {median:.4f}, from {low:.4f} to {high:.4f}")

# %%
# The paper's family is made of parts too: a ``ParticleSwarm`` takes a rule for the inertia weight
# and a hierarchy. This rule is a constant weight, to be compared with the paper's entropy weight.


class ConstantWeight:
    """The same weight at all times."""

    def __call__(self, progress, front):
        """Return the weight."""
        return 0.5


for rule in (ConstantWeight(), LinearDecrease(), EntropyWeight()):
    swarm = ParticleSwarm(rule, Flat(), pop_size=100, archive_size=50)
    value = igd(minimize(problem, swarm, ("n_gen", 40), seed=1).F)
    print(f"{type(rule).__name__:15} IGD {value:.4f}")

# %%
# An experiment
# -------------
#
# An experiment is a module in the folder ``experiments`` with a function ``run(context)`` that
# returns a ``Result``: its answer in a sentence, tables, figures. It is listed with one entry in
# ``experiments/runner/catalogue.py``,
#
# .. code-block:: python
#
#    Experiment(
#        "stiffer",
#        "studies.stiffer",
#        "What a stiffer drive would gain",
#        "Does a stiffer drive have a smaller error?",
#    ),
#
# after which ``python -m experiments stiffer`` runs it, stores its tables as CSV and its figures as
# PNG, and gives it a page and a card on ``index.html``. The folder is part of the repository, but
# not of the installed package.
#
# Long work is cut into *jobs*. A job holds all its settings, its seed included, and names itself by
# them. The campaign runs jobs on as many processes or machines as the user allows, keeps every
# finished one on disk, and does not run it again. This is a whole experiment,
# ``docs/examples/stiffer.py``:
#
# .. literalinclude:: ../examples/stiffer.py
#    :language: python
#
# To try it without the entry in the catalogue, all it takes is a folder and a campaign in this
# process:

from stiffer import run

from experiments.runner.registry import Context
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.store import load, save

with tempfile.TemporaryDirectory() as folder:
    out = Path(folder)
    save(out, "stiffer", run(Context(seeds=1, out=out, campaign=Campaign(out))))
    (table,) = load(out, "stiffer").tables
    stored = sorted(path.name for path in (out / "stiffer").iterdir())
print(" | ".join(column.heading for column in table.columns))
for row in table.rows:
    cells = zip(table.columns, row, strict=True)
    print(" | ".join(column.show(cell) for column, cell in cells))
print([finding.sentence for finding in table.findings if finding.agrees])
print(stored)
plt.show()
