"""
Write your own drive data sheet
===============================

A drive is described by two text files. The *data sheet* holds what its maker and a test bench tell:
teeth, rated speed and load, stiffness, inertias, dampings, errors of the parts. The *model file*
says how the static error is made up and which effects the drive has beside the equations of motion.
Nothing has to be programmed.

The two files here describe an invented drive of ratio 80; their values are plausible but not
measured. They stand in :doc:`/examples`. Copy them and put your own numbers in.
"""

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pymoo.optimize import minimize

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia, tolerance_band
from pymoo_hdte.drive import (
    PARAMETER_UNITS,
    PARAMETERS,
    floquet_multipliers,
    load_datasheet,
    load_model,
    sample_static_error,
    simulate_drive,
)
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import accuracy, latin_hypercube
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

EXAMPLES = Path(sys.argv[0]).resolve().parents[1] / "examples"  # in a notebook: your folder

# %%
# The data sheet
# --------------
#
# .. list-table::
#    :header-rows: 1
#    :widths: 30 70
#
#    * - field
#      - what to put
#    * - ``name``, ``source``
#      - What the drive is called, and where the values come from.
#    * - ``teeth``
#      - Number of teeth of flexspline and circular spline, and which of them is ``held``. The ratio
#        is Z_f / (Z_c - Z_f) with the circular spline held, as most makers have it, and
#        Z_c / (Z_c - Z_f) with the flexspline held; the orders of the errors follow, too. The drive
#        of the paper has the ratio of the one and the orders of the other, and says so with
#        ``orders_as_held``.
#    * - ``rated``
#      - Input speed (``r/min`` or ``rad/s``) and load at the output (``N.m``). The DTE is that
#        under these conditions.
#    * - ``nominal.static_error``
#      - theta_s, the error measured slowly and without load, ``arcsec``, ``deg`` or ``rad``. The
#        model file says whether this is a peak-to-peak or half of one.
#    * - ``nominal.stiffness``
#      - K at the output with the input locked: slope of a torsion test.
#        ``identification.stiffness`` finds it from a CSV record.
#    * - ``nominal.input_inertia``, ``output_inertia``
#      - Of all that turns with the input, and of the output flange. A load on the flange is an
#        effect of the model file.
#    * - ``nominal.input_damping``, ``mesh_damping``, ``output_damping``
#      - Slopes of the no-load torque over speed: bearings of the input, losses of the mesh seen at
#        the input, bearing of the output. ``identification.mesh_damping`` and ``bearing_damping``
#        find them from CSV records.
#    * - ``mesh``
#      - What Eq. (2) of the paper needs to turn an error in micrometres into an angle of the
#        output.
#    * - ``error_source``
#      - One entry for each error of a part: its class, mean and standard deviation over a batch.
#        They serve ``sample_static_error`` alone. Leave out what you do not know, but keep at least
#        one.
#
# Every quantity is written with its unit, as in ``{ value = 45, unit = "arcsec" }``, and becomes SI
# when it is read.

sheet = load_datasheet(EXAMPLES / "my_drive.toml")
print(f"{sheet.name}: ratio {sheet.ratio:g}")
for name, order in sheet.error_orders.items():
    print(f"  errors of class {name} act {order:g} times per input turn")

# %%
# A mistake is reported with the field, the value and what is allowed. Here the unit of the
# stiffness is lost:

text = (EXAMPLES / "my_drive.toml").read_text(encoding="utf-8")
with tempfile.TemporaryDirectory() as folder:
    wrong = Path(folder) / "wrong.toml"
    wrong.write_text(text.replace('{ value = 1.1e4, unit = "N.m/rad" }', "1.1e4"), encoding="utf-8")
    try:
        load_datasheet(wrong)
    except InvalidInput as error:
        print(error)

# %%
# The error sources tell what theta_s to expect before a drive is built: draw prototypes and look at
# their peak-to-peak. The tooth-to-tooth class is left out, as its order lies far above what the
# dynamics pass on.

prototypes = sample_static_error(sheet, 2000, np.random.default_rng(1))
static = prototypes.peak_to_peak(("e_m", "e_g", "e_w", "e_p")) / ARCSEC
print(f"static error of 2000 prototypes: mean {static.mean():.1f}, std {static.std():.1f} arcsec")

# %%
# The model file
# --------------
#
# ``kinematic_error`` holds the shape of theta_s as sines of the input angle. Only the ratios of the
# ``amplitudes`` count, since the wave they add up to is scaled to the static error of the data
# sheet. Take orders and phases from a slow record without load; if you have none, take the orders
# above. ``std`` is the scatter of theta_s from drive to drive.
#
# Each ``effect`` is something that the printed equations do not hold. A model needs none. Three
# matter for most drives: ``load_inertia`` (a link on the output, which brings the torsional
# resonance down), ``damping_reference`` (losses measured at the input act at the output with the
# square of the ratio) and ``mesh_stiffness_variation`` (two lobes pass the teeth per input turn).
# Friction, play, hysteresis and others are listed in the module ``pymoo_hdte.effects``.

model = load_model(EXAMPLES / "my_drive_model.toml", sheet)
for name, value, unit in zip(PARAMETERS, model.nominal, PARAMETER_UNITS, strict=True):
    print(f"{name:8} {value:10.4g} {unit}")
print("effects:", ", ".join(effect.name for effect in model.effects))

# %%
# Simulate
# --------
#
# The steady state needs no time stepping. ``simulate_drive`` integrates the same equations from
# rest, which takes longer and checks it.

design = model.nominal
steady = model.steady_state(design[np.newaxis])
(dte,) = model.dte_arcsec(design[np.newaxis])
run = simulate_drive(model, design)
print(f"DTE: steady state {dte:.2f} arcsec, integrated from rest {run.dte_arcsec():.2f} arcsec")
print(f"they differ by less than 1 %: {abs(run.dte_arcsec() / dte - 1) < 0.01}")

# %%
# The two differ a little because the input angle itself fluctuates, which the steady state leaves
# out unless a law at a port calls for it.

angle = np.linspace(0.0, 4.0 * np.pi, 500)
speeds = np.linspace(200.0, 2400.0, 300)
over_speed = [
    model.at(speed * REVOLUTION_PER_MINUTE, sheet.load_torque).dte_arcsec(design[np.newaxis])[0]
    for speed in speeds
]

fig, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
left.plot(angle / (2.0 * np.pi), steady.at(angle)[0] / ARCSEC)
left.set(xlabel="input turns", ylabel="transmission error [arcsec]", title="Steady state")
right.plot(speeds, over_speed)
right.axvline(sheet.input_speed / REVOLUTION_PER_MINUTE, color="0.6", ls="--", label="rated")
right.set(xlabel="input speed [r/min]", ylabel="DTE [arcsec]", title="Resonances")
right.legend()
plt.show()

# %%
# The drive runs between two resonances: order 2 meets the torsional frequency near 1100 r/min,
# order 1 above 2000 r/min. A stiffness that varies can also make a drive unstable. Its Floquet
# multipliers must not exceed 1 in size; the solvers check that and refuse otherwise.

largest = np.abs(floquet_multipliers(model.coefficients(design[np.newaxis]))).max()
print(f"largest Floquet multiplier {largest:.3f}")

# %%
# Optimise
# --------
#
# The model is all that ``RobustDTE`` needs. First look whether its surrogate is good enough for
# this drive: near a resonance a polynomial of order 3 may not be, and ``order=5`` costs a second.

box = RobustDTE(model).surrogate.box
test = latin_hypercube(box, 500, 1)
for order in (3, 5):
    problem = RobustDTE(model, order=order)
    error = accuracy(problem.surrogate(test), model.dte_arcsec(test))
    print(f"order {order}: RMSE {error.rmse:.2f} arcsec, R2 {error.r2:.4f}")

# %%

result = minimize(problem, CompactSwarm(), ("n_eval", 10_000), seed=1)
chosen = WeightedUtopia(PREFERENCES["balanced"]).do(result.F)
before = problem.evaluate(problem.nominal[np.newaxis])[0]
print(f"nominal  mean {before[0]:.1f}, std {before[1]:.2f} arcsec")
print(f"balanced mean {result.F[chosen, 0]:.1f}, std {result.F[chosen, 1]:.2f} arcsec")
low, high = tolerance_band(result.X[chosen], 0.05)
for name, start, end in zip(problem.var_names, low, high, strict=True):
    print(f"{name:5} {start:10.4g} to {end:10.4g} {problem.units[name]}")

fig, ax = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
ax.plot(*result.F.T, "o", ms=4, label="front")
ax.plot(*result.F[chosen], "s", ms=9, fillstyle="none", label="balanced")
ax.set(xlabel="mean DTE [arcsec]", ylabel="standard deviation of the DTE [arcsec]")
ax.legend()
plt.show()

# %%
# Check the chosen design on the model itself before you build it: the surrogate only served the
# search.

check = np.append(model.nominal[0], result.X[chosen])[np.newaxis]
print(f"model {model.dte_arcsec(check)[0]:.2f}, surrogate {problem.surrogate(check)[0]:.2f} arcsec")

# %%
# The same from the command line: ``pymoo-hdte simulate DATASHEET --out DIR`` and
# ``pymoo-hdte optimise DATASHEET --preference balanced --out DIR``.
