r"""
Mathematics: the rules of a mechanism
=====================================

``pymoo-hdte discrepancy`` says whether a model lacks something that its measurements show, and
what. Of drives and of machines of your own a :doc:`score <verdict_score>` decides; of joints and
other mechanisms rules. This page gives them, and the statistics behind them. All thresholds are in
`pymoo_hdte.discrepancy._selection.rules.Rules`, from which this page reads them.
"""

from dataclasses import replace
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad
from scipy.stats import chi2, ncx2

from pymoo_hdte.discrepancy import MeasuredMechanism, analyse
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import adequate
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._selection.verdict import STATUSES
from pymoo_hdte.effects.unknowns import Parameter
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

# %%
# Residuals in units of their noise
# ---------------------------------
#
# Records become *features*: the spectrum of the force balance. Prediction minus feature, divided by
# the noise (*whitened*, which removes correlations of the noise), gives residuals :math:`r` that
# are independent and of unit variance if the model is right. The misfit is
#
# .. math::
#
#    \chi^2 = \sum_n r_n^2 .
#
# Base parameters are fitted first, within their stated tolerances. A right model then leaves
# :math:`\chi^2` near its degrees of freedom :math:`\nu` (residuals less fitted parameters), with
# standard deviation :math:`\sqrt{2 \nu}`.
#
# Is anything missing?
# --------------------
#
# The model is adequate if :math:`\chi^2 / \nu \le 1 + 4 \sqrt{2 / \nu}`, four standard deviations,
# and no known effect would reduce :math:`\chi^2` by a given gain; a single line may be lost among a
# thousand features.

for degrees_of_freedom in (100, 1400):
    limit = adequate(degrees_of_freedom, RULES)
    chance = chi2.sf(limit * degrees_of_freedom, degrees_of_freedom)
    print(
        f"nu = {degrees_of_freedom:4}: limit {limit:.3f}, "
        f"passed by noise with probability {chance:.0e}"
    )
print(f"gain that speaks against an adequate model: {RULES.single_effect_gain:g}")

# %%
# An effect that adds a signal of :math:`\lambda` to the sum of squares (:math:`\lambda` = features
# times signal to noise, squared) makes :math:`\chi^2` non-central. From the sizes at which it
# passes the limit follows what a campaign can detect at all:

degrees_of_freedom = 400
limit = adequate(degrees_of_freedom, RULES)
size = np.linspace(0.0, 250.0, 200)
x = np.linspace(0.6, 2.0, 400)
fig, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.5), layout="constrained")
left.plot(
    x,
    chi2.pdf(x * degrees_of_freedom, degrees_of_freedom) * degrees_of_freedom,
    label="nothing missing",
)
left.plot(
    x,
    ncx2.pdf(x * degrees_of_freedom, degrees_of_freedom, 200.0) * degrees_of_freedom,
    label="$\\lambda = 200$",
)
left.axvline(limit, color="k", ls="--", lw=1, label="limit")
left.set(xlabel="$\\chi^2 / \\nu$", ylabel="density", title="400 degrees of freedom")
left.legend()
right.plot(size, ncx2.sf(limit * degrees_of_freedom, degrees_of_freedom, np.maximum(size, 1e-9)))
right.set(xlabel="$\\lambda$", ylabel="probability to be noticed", title="by the total alone")
plt.show()

# %%
# Which effect?
# -------------
#
# *Screening* asks, to first order, how much each candidate could remove: its signature less what
# the base parameters can imitate of it. The best few are fitted jointly with the base, without
# linearisation. Sets of effects are then compared by two numbers.
#
# The **Bayesian information criterion** (Schwarz, Annals of Statistics 6, 1978), with :math:`p`
# fitted unknowns and :math:`n` residuals,
#
# .. math::
#
#    \mathrm{BIC} = \chi^2 + p \, \ln \, n ,
#
# ranks them; the smallest is chosen. The **evidence** decides whether the data separate two of
# them. It is minus twice the logarithm of the probability of the data under a model, by Laplace's
# approximation (MacKay, Neural Computation 4, 1992),
#
# .. math::
#
#    E = \chi^2 + \ln \, \det \left( I + W J^\top J \, W / 12 \right) ,
#
# with the derivatives :math:`J` of the residuals and the widths :math:`W` between the bounds of the
# parameters. It stands for a normal prior with the variance :math:`w^2 / 12` of a uniform one. What
# no record determines costs nothing. For a linear model with one unknown the integral can be done
# by brute force:

signature = np.array([1.0, 2.0, 3.0])
data = np.array([1.9, 4.2, 5.7])
width = 40.0
best = signature @ data / (signature @ signature)
found = Fit(
    (),
    (Parameter("strength", 0.0, -width / 2, width / 2, 1.0),),
    np.array([best]),
    data - best * signature,
    -signature[:, np.newaxis],
)
spread = np.sqrt(width**2 / 12.0)


def probability(strength):
    """Return likelihood times prior, but for the constant that all models share."""
    square = np.sum((data - strength * signature) ** 2)
    prior = np.exp(-0.5 * (strength / spread) ** 2) / (np.sqrt(2.0 * np.pi) * spread)
    return np.exp(-0.5 * square) * prior


integral = quad(probability, best - 8.0, best + 8.0)[0]
print(f"evidence {found.evidence:.3f}, by integration {-2.0 * np.log(integral):.3f}")

# %%
# The difference is the prior at the best value, which the package leaves out: within its tolerance
# every value is as good as any other. As a rule, a distance of 10 in twice the logarithm is very
# strong (Kass and Raftery, Journal of the American Statistical Association 90, 1995).
#
# When is it named?
# -----------------
#
# A set of effects *explains* the misfit of the base if it gains enough in BIC, and if it fits down
# to the noise or removes most of the excess :math:`\chi^2 - \nu`: of the whole, and of each part of
# the data by itself. An effect whose form is certain, such as a sensor's zero, must do better than
# a friction curve whose form is only ever close.

print(f"gain of BIC at least                       {RULES.bic_gain:g}")
print(f"share of the excess removed at least       {RULES.explained_share:g}")
print(f"  in each part of the data                 {RULES.explained_part_share:g}")
print(f"  by effects of an exact form              {RULES.exact_share:.6f}")
print(f"chi-square / nu that does for exact forms  {RULES.exact_chi_square:g}")
print(f"a second effect removes of the residual    {RULES.second_share:g}")
print(f"indistinguishable within an evidence of    {RULES.evidence_distance:g}")
print(f"  or, of forms not exact, if they leave    {RULES.form_ratio:g} times as much")

# %%
# The verdict follows:
#
# .. list-table::
#    :header-rows: 1
#    :widths: 20 80
#
#    * - status
#      - rule
#    * - ``adequate``
#      - The base passes the limit, and no candidate would gain enough.
#    * - ``unlisted``
#      - It does not, and no set explains the misfit either, or the prediction error on held-out
#        records does not shrink as it should: less than half of what a true effect would remove is
#        gone, beyond chance.
#    * - ``class``
#      - A set explains it, and another set of as many effects that explains it too lies within the
#        distances above. Where even the chosen form leaves more than noise, that of the evidence is
#        stretched by :math:`\chi^2 / \nu`. So are a law and its special case if the data leave
#        both open.
#    * - ``named``
#      - A set explains it, and no other comes near. A law that contains the named one and ended at
#        a bound is no other. A corner that ended as sharp as points can resolve is at no bound.
#    * - ``partial``
#      - As before, but one of its values ended at a bound, the interval of a strength contains
#        nothing, a sensor's zero or gain ended far outside its stated limits, values out of
#        tolerance stand beside a curve that leaves more than noise, or more than three times the
#        noise is left.
#    * - ``parameter``
#      - The set that explains it is no effect but a base parameter beyond its tolerance.

print(", ".join(STATUSES))

# %%
# Two of these rules simplify a set before it is selected. A law gives way to its special case if
# it ended at a bound, or if the special case leaves no more than noise and no more beyond the law
# than a model is off by: friction that falls by a hundredth may be dry friction, and both are in
# one class. Fewer values out of tolerance may stand beside the special case, if any do. And beside
# effects that leave no more than noise, a further one is dropped if its strength may be nothing, or
# if the held-out records deny it.

print(f"a model is off by                          {RULES.model_accuracy:g} of an amplitude")

# %%
# Probability
# -----------
#
# Every set that was compared has a weight, :math:`\exp(-E / 2)` of its evidence :math:`E` (in units
# of what even the best one leaves). The share of the sets that hold all names of the verdict is how
# sure the data make it; that the truth is in none of them, or that no fit reached it, they cannot
# tell. How often verdicts of a kind were right on campaigns with a known truth was counted instead:

for status, right in (
    ("named", RULES.named_right),
    ("class", RULES.class_right),
    ("partial", RULES.partial_right),
    ("adequate", RULES.adequate_right),
):
    print(f"{status:8} right with a probability of at most {right:.2f}")

# %%
# Intervals
# ---------
#
# Values come with the covariance of the fit,
#
# .. math::
#
#    C = \left( J^\top J / \max(\chi^2 / \nu, 1) + 12 \, W^{-2} \right)^{-1} .
#
# An unexplained residual counts as noise (Birge, Physical Review 40, 1932), and bounds count as the
# variance of a uniform distribution. A value that no record determines is therefore as uncertain as
# its tolerance. For the line above the interval is that of ordinary least
# squares, since the bounds are wide:

sigma = float(np.sqrt(found.covariance[0, 0]))
residual_variance = max(found.chi_square / 2.0, 1.0)
ordinary = np.sqrt(residual_variance / (signature @ signature))
print(f"standard deviation {sigma:.4f}, ordinary least squares {ordinary:.4f}")

# %%
# The rules at work
# -----------------
#
# A joint with inertia, viscous damping and, hidden from its model, dry friction:


def record_of(friction, seed=1):
    """Return a record of the joint, SI, with noise."""
    time = np.arange(0.0, 6.0, 0.002)
    angle = np.sin(4.4 * time) + 0.3 * np.sin(14.5 * time)
    speed = 4.4 * np.cos(4.4 * time) + 4.35 * np.cos(14.5 * time)
    acceleration = -(4.4**2) * np.sin(4.4 * time) - 14.5 * 4.35 * np.sin(14.5 * time)
    torque = 0.05 * acceleration + 0.4 * speed + friction * np.sign(speed)
    noise = np.random.default_rng(seed).standard_normal((2, len(time)))
    channels = {"q": angle + 1e-6 * noise[0], "torque": torque + 0.01 * noise[1]}
    return Record("joint", "train", time, channels)


joint = Mechanism(
    inertias={"q": BelievedValue(0.06, tolerance=0.5)},
    ports=[Port("bearing", {"q": 1.0}, damping=BelievedValue(0.5, tolerance=0.5))],
    inputs=[Input("torque", {"q": 1.0})],
)
for friction in (0.0, 0.3):
    verdict = analyse(MeasuredMechanism(joint, [record_of(friction)])).verdict
    degrees_of_freedom = verdict.degrees_of_freedom
    ratio = verdict.base.chi_square / degrees_of_freedom
    print(f"friction {friction:g} N.m: chi-square / nu of the base {ratio:.3g}, {verdict.status}")

# %%
# All that was fitted, best first. ``gain`` is that of BIC over the base, ``share`` the part of the
# excess that is removed.

base_bic = verdict.base.chi_square + len(verdict.base.values) * np.log(len(verdict.base.residuals))
print(f"{'set':58}{'gain':>10}{'share':>9}{'evidence':>12}")
for one in sorted([verdict.chosen, *verdict.alternatives], key=lambda one: one.bic)[:6]:
    mark = "*" if one is verdict.chosen else " "
    gain = base_bic - one.bic
    print(f"{mark} {one.label:56}{gain:10.0f}{one.explained:9.4f}{one.fit.evidence:12.0f}")

# %%
# No model of a machine other than a drive fits down to the noise of its sensors. There all of this
# is measured in units of the *residual* that up to three effects leave, and four rules are added:
#
# - a named effect removes at least half of the power of the misfit beyond sensor noise;
# - of models with about the same residual, the one with the fewest unknowns is named;
# - a law that merely contains the named one is no other explanation;
# - one of the effects that define the residual is `partial` if it removes less than nine tenths of
#   that power. These are compared even if the search names nothing, and the largest force is named
#   first.

# %%
# Change a rule
# -------------
#
# `analyse` takes rules of your own. If a name should remove nearly all of a
# misfit, and not only the better half, ask for it:

measured = MeasuredMechanism(joint, [record_of(0.3)])
strict = analyse(measured, rules=replace(RULES, main_share=1.0)).verdict
print(f"main_share {RULES.main_share:g}: {verdict.status}; main_share 1: {strict.status}")

# %%
# All rules
# ---------
#
# Each with its value, its unit, what it decides and where it comes from:

for one in RULES.explained():
    print(f"{one.name} = {one.value:g} ({one.unit})")
    print(fill(one.meaning, 96, initial_indent="    ", subsequent_indent="    "))
    print(fill(one.derivation, 96, initial_indent="    ", subsequent_indent="    "))
