r"""
Mathematics: exact moments
==========================

A robust design needs the mean and the standard deviation of a response over its scatter, for every
design anew. If the response is a Chebyshev polynomial and the scatter is independent, both are
polynomials of the design, so nothing has to be sampled. This page derives them and holds each step
against an independent quadrature.
"""

import matplotlib.pyplot as plt
import numpy as np
from numpy.polynomial.chebyshev import chebval
from scipy.integrate import nquad, quad
from scipy.stats import norm

from pymoo_hdte.problems import RobustToy
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    SampledMoments,
    TruncatedNormal,
    UniformBand,
    VariableBandMoments,
)

# %%
# The surrogate
# -------------
#
# Let :math:`z_j = (x_j - m_j) / h_j` map the interval of variable :math:`x_j` to :math:`[-1, 1]`.
# The surrogate is
#
# .. math::
#
#    f(x) = \sum_i c_i \prod_j T_{i_j}(z_j) , \quad i_j = 0, \ldots, k
#
# with the Chebyshev polynomials :math:`T_n(\cos \varphi) = \cos (n \varphi)` (the paper's
# surrogate, Eqs. 14-25).
# Its coefficients are those of the interpolation at the :math:`(k + 1)^d` roots of :math:`T_{k+1}`
# in every variable. Here is one of three variables: a noise variable, and two that scatter around a
# design.


def response(points):
    """Return an invented response that is no polynomial."""
    noise, x, y = points.T
    return noise * np.exp(-x * y) + np.sin(2.0 * x) / (1.0 + y)


noise = TruncatedNormal(mean=2.0, std=0.3)
band = UniformBand(0.10)
low, high = noise.support
box = Box(("noise", "x", "y"), [low, 0.4, 0.4], [high, 1.6, 1.6])
surrogate = ChebyshevSurrogate.fit(response, box, order=4)
designs = Box(("x", "y"), [0.5, 0.5], [1.4, 1.4])
moments = ExactMoments(surrogate, [noise, band, band], designs)

# %%
# The mean
# --------
#
# The expectation of a product of independent variables is the product of the expectations, so
#
# .. math::
#
#    \mathrm{E} f = \sum_i c_i \prod_j \mathrm{E} \, T_{i_j}(Z_j) .
#
# **Uniform band.** Around the design :math:`u` a variable is :math:`u (1 + t s)` with :math:`s`
# uniform in :math:`[-1, 1]`; hence :math:`Z = a + b s` with :math:`a = (u - m) / h` and
# :math:`b = u t / h`. The integral of a Chebyshev polynomial is (Mason and Handscomb, *Chebyshev
# Polynomials*, 2003, Section 2.4)
#
# .. math::
#
#    S_n = \int T_n \, \mathrm{d} z = \frac{1}{2} \left( \frac{T_{n+1}}{n + 1} - \frac{T_{n-1}}{n -
#    1} \right) , \quad n \ge 2 ,
#
# and therefore :math:`\mathrm{E} \, T_n(Z) = \left( S_n(a + b) - S_n(a - b) \right) / 2 b`, a
# polynomial of degree :math:`n` in :math:`u`. The package takes a Gauss-Legendre rule instead,
# which is exact for polynomials too. Both agree:


def chebyshev(n, z):
    """Return T_n(z)."""
    return chebval(z, [0.0] * n + [1.0])


def antiderivative(n, z):
    """Return an integral of T_n at z, for n of at least 2."""
    return 0.5 * (chebyshev(n + 1, z) / (n + 1) - chebyshev(n - 1, z) / (n - 1))


a, b = 0.2, 0.15
s, weights = band.quadrature(4)
s = (s - 1.0) / band.tolerance
for n in (2, 3, 4):
    closed = (antiderivative(n, a + b) - antiderivative(n, a - b)) / (2.0 * b)
    gauss = weights @ chebyshev(n, a + b * s)
    print(f"E T_{n}: closed form {closed:.12f}, Gauss-Legendre {gauss:.12f}")

# %%
# **Truncated normal.** Cut at :math:`c` standard deviations, the standard variable :math:`z` has
# odd moments of zero and even ones by partial integration,
#
# .. math::
#
#    \mu_n = (n - 1) \, \mu_{n-2} - \frac{2 \, c^{n-1} \varphi(c)}{2 \Phi(c) - 1} , \quad \mu_0 = 1
#    .
#
# The package integrates with 128 nodes and more, the density being in the weights, which is exact
# to rounding:

values, weights = noise.quadrature(8)
z, cut = (values - noise.mean) / noise.std, noise.cut
moment = 1.0
for n in (2, 4, 6, 8):
    moment = (n - 1) * moment - 2.0 * cut ** (n - 1) * norm.pdf(cut) / (2.0 * norm.cdf(cut) - 1.0)
    print(f"moment {n}: recurrence {moment:.10f}, rule {weights @ z**n:.10f}")
print(f"standard deviation {noise.truncated_std / noise.std:.4f} of that before the cut")

# %%
# The variance
# ------------
#
# In principle the second moment is as simple, since :math:`T_m T_n = (T_{m+n} + T_{|m-n|}) / 2`.
# But the difference :math:`\mathrm{E} f^2 - (\mathrm{E} f)^2` of two large numbers loses the digits
# of a small variance. The package integrates the variables out one after the other. With some of
# them gone, what is left is a polynomial with random coefficients :math:`C`. When variable
# :math:`j` goes, each new coefficient is :math:`C' = \sum_n T_n(Z_j) C_n`, and by the laws of total
# mean and total covariance
#
# .. math::
#
#    \mathrm{E} \, C' = \sum_n \mathrm{E} \, T_n \; \mathrm{E} \, C_n ,
#
# .. math::
#
#    \mathrm{Cov} \, C' = \sum_{m,n} \mathrm{E} (T_m T_n) \, \mathrm{Cov} (C_m, C_n) + \sum_{m,n}
#    \mathrm{Cov} (T_m, T_n) \, \mathrm{E} \, C_m \, \mathrm{E} \, C_n^\top .
#
# Nothing large is subtracted. After the last variable, :math:`C` is :math:`f` itself, with its mean
# and variance.
#
# An independent check by quadrature of the surrogate itself:

design = np.array([[0.9, 1.1]])


def integrand(power, shift):
    """Return what to integrate for a central moment of the surrogate."""

    def at(value, first, second):
        point = [[value, design[0, 0] * first, design[0, 1] * second]]
        density = noise.pdf(value) / (2.0 * band.tolerance) ** 2
        return float(density * (surrogate(point)[0] - shift) ** power)

    return at


limits = [noise.support, band.support, band.support]
rule = {"epsabs": 1e-9, "limit": 20}
mean, std = (float(one[0]) for one in moments(design))
mean_by_quad = nquad(integrand(1, 0.0), limits, opts=rule)[0]
variance_by_quad = nquad(integrand(2, mean_by_quad), limits, opts=rule)[0]
print(f"mean     exact {mean:.9f}, quadrature {mean_by_quad:.9f}")
print(f"variance exact {std**2:.9f}, quadrature {variance_by_quad:.9f}")

# %%
# As functions of the design
# --------------------------
#
# The mean is a polynomial of degree :math:`k` in each design variable, and the variance is one of
# degree :math:`2 k`. Both are determined by their values on a Chebyshev grid of :math:`2 k + 1`
# designs in each variable. They are computed there once, and their series are summed for any
# design. Derivatives of the series are the exact gradients of :math:`\mathrm{E} f`; that of the
# standard deviation is :math:`\nabla \sigma = \nabla \sigma^2 / 2 \sigma`.
#
# What does sampling cost? Its error falls with the root of the number of samples:

sizes = 2 ** np.arange(5, 18)
errors = []
for size in sizes:
    seeds = range(8)
    found = [SampledMoments(surrogate, [noise, band, band], designs, int(size), k) for k in seeds]
    errors.append([abs(one(design)[1][0] / std - 1.0) for one in found])

fig, ax = plt.subplots(figsize=(6.5, 3.8), layout="constrained")
ax.loglog(sizes, np.sqrt(np.mean(np.square(errors), axis=1)), "o-", label="sampled, 8 seeds")
ax.loglog(
    sizes, 1.0 / np.sqrt(2.0 * sizes), "k--", lw=1, label="$1 / \\sqrt{2 n}$ of a normal response"
)
ax.axvline(1000, color="0.7", lw=1)
ax.annotate("paper", (1050, 0.13), color="0.4")
ax.set(xlabel="number of samples n", ylabel="relative error of the standard deviation")
ax.legend()
plt.show()

# %%
# A tolerance that is a variable
# ------------------------------
#
# If the tolerance :math:`t` is designed too, the second moment is no polynomial of low degree in
# all variables. A polynomial chaos expansion helps (Xiu and Karniadakis, SIAM Journal on Scientific
# Computing 24, 2002). At a given :math:`(u, t)` every :math:`T_n(a + b s)` is a polynomial in
# :math:`s`, and is written in Legendre polynomials that are orthonormal for uniform :math:`s`,
#
# .. math::
#
#    T_n(a + b s) = \sum_{l=0}^{n} q_{nl} \sqrt{2 l + 1} \, P_l(s) , \quad q_{nl} = \frac{1}{2}
#    \int_{-1}^{1} T_n(a + b s) \sqrt{2 l + 1} \, P_l(s) \, \mathrm{d} s .
#
# The noise gets polynomials that are orthonormal under its density. Then
# :math:`f = \sum_r g_r \Psi_r` with orthonormal :math:`\Psi_r`, and without any further integral
#
# .. math::
#
#    \mathrm{E} f = g_0 , \quad \mathrm{Var} f = \sum_{r \ne 0} g_r^2 .
#
# The expansion has a finite degree, so this is exact as well. At a fixed tolerance both ways agree:

space = Box(("x", "y", "tolerance"), [0.5, 0.5, 0.01], [1.4, 1.4, 0.12])
variable = VariableBandMoments(surrogate, {"noise": noise}, space)
(mean_of_both,), (std_of_both,) = variable([[0.9, 1.1, 0.10]])
print(f"mean {mean:.12f} and {mean_of_both:.12f}")
print(f"std  {std:.12f} and {std_of_both:.12f}")

# %%
# A closed form from end to end
# -----------------------------
#
# ``RobustToy`` is a problem whose moments can be written down. It goes through the surrogate and
# the moments like the drive:

toy = RobustToy()
X = np.random.default_rng(1).uniform(toy.xl, toy.xu, (1000, toy.n_var))
F = toy.evaluate(X)
largest = np.abs(F / np.column_stack(toy.closed_form(X)) - 1.0).max()
print(f"largest relative error over 1000 designs is below 1e-12: {largest < 1e-12}")

# %%
# What is exact, and what is not
# ------------------------------
#
# The moments of the surrogate are exact. The surrogate is not the response: its own error is left,
# and only more nodes remove it. Here the mean of the response itself by quadrature, at several
# orders:


def mean_of_response():
    """Return the mean of the response at the design; the noise enters it linearly."""

    def at(first, second):
        point = np.array([[noise.mean, design[0, 0] * first, design[0, 1] * second]])
        return response(point)[0] / (2.0 * band.tolerance) ** 2

    low, high = band.support
    return quad(lambda second: quad(at, low, high, args=(second,))[0], low, high)[0]


true_mean = mean_of_response()
for order in (1, 2, 3, 4, 5):
    fitted = ChebyshevSurrogate.fit(response, box, order)
    (found,), _ = ExactMoments(fitted, [noise, band, band], designs)(design)
    print(f"order {order}: error of the mean {abs(found / true_mean - 1.0):.0e}")
