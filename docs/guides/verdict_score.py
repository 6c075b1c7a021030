r"""
Mathematics: the score of a drive
=================================

``pymoo-hdte discrepancy`` compares sets of effects that a drive, or a machine of your own, may
lack. Each set is a model of all records, and its posterior probability decides what is said. This
page gives the model, and recomputes the posterior of a small campaign by brute force.
"""

import numpy as np

from pymoo_hdte.discrepancy._selection.decision import (
    MOST_IN_CLASS,
    OUTSIDE,
    PRESENT,
    SURE,
    Explanation,
    decide,
    log_prior,
)
from pymoo_hdte.discrepancy._selection.score import VISIBLE, Free, Linearised, Sized, score

# %%
# The model
# ---------
#
# Residuals :math:`r`, predicted minus measured in units of the noise, are linearised at the fit of
# a set:
#
# .. math::
#
#    r + J d + C a + e = 0 .
#
# - :math:`d` are unknowns with a stated prior. A tolerance is flat, with Gaussian shoulders of a
#   tenth of it outside; zeros and gains of sensors are normal.
# - :math:`a` are quantities of unknown size, normal with a common scale :math:`s` each:
#   strengths of effects, relative errors of laws that change smoothly with speed, load and torsion,
#   and what scatters from record to record. :math:`\ln s` is flat within its range. An effect is at
#   least as large as is visible: below a :math:`\chi^2` of `VISIBLE` it is nothing.
# - :math:`e` is noise, with an unknown factor for each channel.
#
# The marginal likelihood is the integral over all of these. Records that were held out count as
# well: their part is the predictive density of what the others leave open.
#
# A small campaign
# ----------------
#
# A motor turns at three speeds in both directions. Its model has viscous damping, known to 20 %,
# and a torque sensor with a zero. In truth it also has dry friction:

rng = np.random.default_rng(1)
speed = np.repeat([-30.0, -20.0, -10.0, 10.0, 20.0, 30.0], 4)
angle = np.tile([0.0, 0.5, 1.0, 1.5], 6) * np.pi
noise, damping, zero = 0.02, 0.01, 0.03
measured = damping * speed + 0.1 * np.sign(speed) + noise * rng.standard_normal(len(speed))
residuals = (damping * speed - measured) / noise
of_damping, of_zero = speed * 0.2 * damping / noise, np.full(len(speed), zero / noise)
effects = {
    "coulomb_friction": np.sign(speed) / noise,
    "torque_ripple": np.cos(angle) / noise,
}
"""Change of the residuals per N.m of each effect."""
MOST = 1.0
"""Largest strength, N.m."""

# %%
# Damping is counted in tolerances, so that its bounds are -1 and 1; the zero in what is stated.

free = Free(
    np.column_stack([of_damping, of_zero]),
    lower=np.array([-1.0, -np.inf]),
    upper=np.array([1.0, np.inf]),
    shoulder=np.array([0.1, 1.0]),
    mean=np.zeros(2),
    deviation=np.array([np.inf, 1.0]),
)
channels = np.zeros(len(speed), dtype=int)
nothing = Linearised(residuals, channels, free, noise=0.0)
"""The noise is known here: its factor is 1."""
none = np.array([False])
ln = {"nothing": score(nothing).ln}
for name, signature in effects.items():
    sized = Sized(name, signature[:, None], 0.0, MOST, np.zeros(1), none, cut=True)
    ln[name] = score(nothing.beside(sized)).ln

# %%
# By brute force
# --------------
#
# The same integrals as sums over a grid of damping, zero and strength. Bounds are integrated by an
# approximation, which is off by half a unit where the data push the damping beyond its tolerance.

d = np.linspace(-1.6, 1.6, 121)
z = np.linspace(-2.0, 2.0, 121)
outside = np.maximum(np.abs(d) - 1.0, 0.0)
prior_d = np.exp(-0.5 * (outside / 0.1) ** 2) / (2.0 + np.sqrt(2.0 * np.pi) * 0.1)
prior_z = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)


def integral(signature=None):
    """Return the logarithm of the marginal likelihood."""
    strength, weight = np.zeros(1), np.ones(1)
    if signature is not None:
        strength, weight = prior_of_strength(signature)
    steps = (d[1] - d[0]) * (z[1] - z[0]) / (2.0 * np.pi) ** (len(speed) / 2)
    whole = 0.0
    for size, share in zip(strength, weight, strict=True):
        shifted = residuals + (0.0 if signature is None else size * signature)
        left = shifted[:, None] + np.outer(of_damping, d)
        # Sum of squares over the records, for each damping and zero.
        square = np.sum(left**2, axis=0)[:, None] + len(speed) * (of_zero[0] * z) ** 2
        square = square + 2.0 * of_zero[0] * np.outer(left.sum(axis=0), z)
        whole += share * (prior_d @ np.exp(-0.5 * square) @ prior_z)
    return np.log(whole * steps)


def prior_of_strength(signature):
    """Return strengths and their prior probabilities: normal of any visible scale."""
    # Visible beside damping, whose flat prior counts by its variance at first, and the zero.
    known = np.column_stack([of_damping, of_zero])
    inner = known.T @ known + np.diag([12.0 / (2.0 + 2.0 * 0.1) ** 2, 1.0])
    across = known.T @ signature
    curvature = signature @ signature - across @ np.linalg.solve(inner, across)
    least = np.sqrt(VISIBLE / curvature)
    strength = np.linspace(-0.2, 0.2, 201)
    scales = np.exp(np.linspace(np.log(least), np.log(MOST), 200))
    every = np.linspace(-6.0, 6.0, 12001)
    density = sum(np.exp(-0.5 * (every / s) ** 2) / s for s in scales)
    density[np.abs(every) < least] = 0.0
    density /= density.sum() * (every[1] - every[0])
    return strength, np.interp(strength, every, density) * (strength[1] - strength[0])


for name, value in ln.items():
    print(f"{name:17} score {value:8.2f}, by brute force {integral(effects.get(name)):8.2f}")

# %%
# The posterior
# -------------
#
# Each name of an effect has the same prior probability, which its ports, orders and forms share.
# Something outside of the library may be there as well; here it is left out.

names = {name: frozenset() if name == "nothing" else frozenset({(name, "input")}) for name in ln}
prior = {name: log_prior(list(named), [1] * len(named), False) for name, named in names.items()}
weight = np.array([ln[name] + prior[name] for name in ln])
posterior = np.exp(weight - np.logaddexp.reduce(weight))
for name, share in zip(ln, posterior, strict=True):
    print(f"{name:17} posterior {share:.4f}")

decision = decide([Explanation(name, names[name], ln[name]) for name in ln], list(prior.values()))
print(decision.status, [sorted(member) for member in decision.members])
print(f"prior of a name {PRESENT}, of something outside of the library {OUTSIDE}")

# %%
# What is said
# ------------
#
# .. list-table::
#    :header-rows: 1
#    :widths: 20 80
#
#    * - status
#      - posterior probability
#    * - ``adequate``
#      - That nothing is missing is likelier than not.
#    * - ``named``, ``parameter``
#      - One set has `SURE`, and that nothing else is outside of the library has it too.
#    * - ``class``
#      - A few sets have `SURE` together, and something outside is less likely than not.
#    * - ``partial``
#      - Some names have it, whatever else is missing. Of values alone that is said only where
#        something outside is less likely than not.
#    * - ``class`` again
#      - One of a few names is there with `SURE`, whatever else is missing.
#    * - ``unlisted``
#      - Neither.
#
# One check is absolute: if the likeliest explanation leaves what noise would leave once in 10,000
# campaigns in some record or channel, nothing is named without qualification.

print(f"sure from {SURE} on, at most {MOST_IN_CLASS} sets in a class")
