r"""
Mathematics: steady states without time stepping
================================================

The transmission error in steady state repeats with the turns of the drive, so that it is a sum of
harmonics. Solving for the harmonics costs a few small linear systems, where integration from rest
costs seconds. This page derives the equations, solves them by hand and holds them against
``scipy.integrate.solve_ivp``.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

from pymoo_hdte.drive import (
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    floquet_multipliers,
    harmonic_balance,
    preset,
    simulate_drive,
)
from pymoo_hdte.units import ARCSEC

# %%
# The equations of motion
# -----------------------
#
# The paper's equations of motion, Eq. (9), with a mesh stiffness that may vary with the input
# angle, are
#
# .. math::
#
#    J_\mathrm{in} \theta_\mathrm{in}^{\prime\prime} + B_\mathrm{in} \theta_\mathrm{in}^\prime + M /
#    N = T_\mathrm{in} ,
#
# .. math::
#
#    J_\mathrm{out} \theta_\mathrm{out}^{\prime\prime} + B_\mathrm{out} \theta_\mathrm{out}^\prime -
#    M = - T_\mathrm{L} ,
#
# .. math::
#
#    M = k \, d + c \, d^\prime , \quad d = \theta_\mathrm{in} / N - \theta_\mathrm{out} -
#    \theta_\mathrm{s}(\theta_\mathrm{in}) , \quad k = K \left( 1 + \kappa \cos (2
#    \theta_\mathrm{in} + \psi) \right) .
#
# The transmission error is
# :math:`\theta_\mathrm{d} = \theta_\mathrm{in} / N - \theta_\mathrm{out} = \theta_\mathrm{s} + d`.
# In steady state :math:`\theta_\mathrm{in} = \Omega t` but for a small fluctuation, which is
# neglected in the arguments of :math:`\theta_\mathrm{s}` and :math:`k` (its effect is measured at
# the end). Everything is then a sum of orders :math:`o`, cycles per input turn:
# :math:`x(t) = \mathrm{Re} \sum_o x_o \, e^{i o \Omega t}`.
#
# For one order with :math:`\omega = o \Omega \ne 0` the first two equations give the angles that
# the mesh torque :math:`M_o` moves the two inertias by, and their difference is
#
# .. math::
#
#    \theta_{\mathrm{d}, o} = - G_o M_o , \quad G_o = \frac{1}{N^2 (i \omega B_\mathrm{in} -
#    \omega^2 J_\mathrm{in})} + \frac{1}{i \omega B_\mathrm{out} - \omega^2 J_\mathrm{out}} .
#
# With :math:`P_o = 1 / G_o` and :math:`\theta_\mathrm{d} = s + d` this is
# :math:`M_o + P_o d_o = - P_o s_o`. For order 0 nothing holds the inertias back, :math:`P_0 = 0`,
# and the mesh torque is what the output needs,
# :math:`T = T_\mathrm{L} + B_\mathrm{out} \Omega / N`.
#
# **Constant stiffness.** :math:`M_o = Z_o d_o` with :math:`Z_o = K + i \omega c`, so that
# :math:`\theta_{\mathrm{d}, o} = H_o s_o`, :math:`H_o = Z_o G_o / (1 + Z_o G_o)`: a transfer
# function (``transfer_function``).
#
# **Varying stiffness.** The product of :math:`\cos (2 \Omega t + \psi)` and order :math:`o` makes
# orders :math:`o \pm 2`. For every order
#
# .. math::
#
#    (P_o + K + i \omega c) \, d_o + \frac{K \kappa}{2} \left( e^{i \psi} d_{o-2} + e^{-i \psi}
#    d_{o+2} \right) = - P_o s_o + T \, [o = 0] .
#
# This is Hill's method (Hill, Acta Mathematica 8, 1886; Nayfeh and Mook, *Nonlinear Oscillations*,
# 1979, Chapter 5). Orders that differ by 2 form one linear system, cut off where its outermost
# harmonics have died out.
#
# By hand
# -------

model = preset("calibrated")
coefficients = model.coefficients(model.nominal[np.newaxis])
ratio, speed = coefficients.ratio, coefficients.input_speed
stiffness, damping = coefficients.stiffness[0], coefficients.damping[0]
inertia_in, bearing_in = coefficients.input_inertia[0], coefficients.input_damping[0]
inertia_out, bearing_out = coefficients.output_inertia, coefficients.output_damping
depth, phase = coefficients.stiffness_depth, coefficients.stiffness_phase
mean_torque = coefficients.load_torque + bearing_out * speed / ratio


def impedance(order):
    """Return P of one order."""
    w = 1j * order * speed
    if order == 0.0:
        return 0.0
    compliance = 1.0 / (ratio**2 * w * (w * inertia_in + bearing_in))
    return 1.0 / (compliance + 1.0 / (w * (w * inertia_out + bearing_out)))


def hill(first, reach=6):
    """Return orders first + 2 m and the torsion d of each."""
    orders = first + 2.0 * np.arange(-reach, reach + 2)
    static = np.zeros(len(orders), dtype=complex)
    for order, phasor in zip(coefficients.error_orders, coefficients.error_phasors[0], strict=True):
        static[np.isclose(orders, order)] += phasor
    P = np.array([impedance(order) for order in orders])
    coupling = 0.5 * stiffness * depth * np.exp(1j * phase)
    system = np.diag(P + stiffness + 1j * orders * speed * damping)
    system += np.diag(np.full(len(orders) - 1, coupling), -1)
    system += np.diag(np.full(len(orders) - 1, coupling.conj()), 1)
    torsion = np.linalg.solve(system, -P * static + mean_torque * (orders == 0.0))
    return orders, torsion, static


parts = [hill(first) for first in (0.0, 1.0, 0.02)]
orders, torsion, static = (np.concatenate(one) for one in zip(*parts, strict=True))


def signal(phasors, angle):
    """Return the signal of these phasors over input angles."""
    return (phasors[:, np.newaxis] * np.exp(1j * orders[:, np.newaxis] * angle)).sum(axis=0).real


angle = np.linspace(0.0, 2.0 * np.pi * ratio, 20_000)
by_hand = signal(static + torsion, angle)
steady = model.steady_state(model.nominal[np.newaxis])
print(f"by hand  {np.ptp(by_hand) / ARCSEC:.3f} arcsec")
print(f"package  {steady.peak_to_peak(ratio)[0] / ARCSEC:.3f} arcsec")

# %%
# Held against an integrator
# --------------------------
#
# Start the differential equations on the solution, with the input angle prescribed as above, and
# integrate over ten input turns. If the harmonics solve the equations, the path stays on them. The
# state is :math:`(\theta_\mathrm{in}^\prime, \theta_\mathrm{d}, \theta_\mathrm{d}^\prime)`.

moving = orders != 0.0
mesh_torque = -np.array([impedance(order) for order in orders]) * (static + torsion)
w = 1j * orders[moving] * speed
lead = np.zeros_like(torsion)
lead[moving] = -mesh_torque[moving] / ratio / (w * (w * inertia_in + bearing_in))
rate = 1j * orders * speed


def right_hand_side(time, state):
    """Return the derivatives of the state, the input angle being speed x time."""
    input_speed, error, error_rate = state
    position = speed * time
    varying = stiffness * (1.0 + depth * np.cos(2.0 * position + phase))
    at = np.exp(1j * orders * position)
    s, s_rate = (static * at).sum().real, (static * rate * at).sum().real
    mesh = varying * (error - s) + damping * (error_rate - s_rate)
    drive = bearing_in * speed + mean_torque / ratio
    input_acceleration = (drive - bearing_in * input_speed - mesh / ratio) / inertia_in
    output_speed = input_speed / ratio - error_rate
    load = coefficients.load_torque + bearing_out * output_speed
    output_acceleration = (mesh - load) / inertia_out
    return [input_acceleration, error_rate, input_acceleration / ratio - output_acceleration]


error = static + torsion
begin = [speed + (lead * rate).sum().real, error.sum().real, (error * rate).sum().real]
turns = 10.0
time = np.linspace(0.0, turns * 2.0 * np.pi / speed, 1000)
run = solve_ivp(
    right_hand_side, (0.0, time[-1]), begin, "DOP853", time, rtol=1e-9, atol=[1e-7, 1e-13, 1e-11]
)
apart = np.abs(run.y[1] - signal(error, speed * time)).max()
print(f"largest distance after {turns:.0f} turns is below 1e-6 of the DTE: "
      f"{apart < 1e-6 * np.ptp(by_hand)}")  # fmt: skip

fig, ax = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
few = speed * time < 6.0 * np.pi
turn = speed * time[few] / (2.0 * np.pi)
level = error[~moving].sum().real
curves = {
    "static error": signal(static, speed * time),
    "harmonics": signal(error, speed * time) - level,
}
for name, curve in curves.items():
    ax.plot(turn, curve[few] / ARCSEC, label=name)
path = (run.y[1][few] - level) / ARCSEC
ax.plot(turn[::12], path[::12], "o", ms=3.5, fillstyle="none", label="solve_ivp")
ax.set(xlabel="input turns", ylabel="error less its mean [arcsec]")
ax.legend(loc="upper right")
plt.show()

# %%
# When there is no steady state
# -----------------------------
#
# A varying stiffness can feed energy into the drive. Hill's method has an answer even then, but no
# drive ever gets there. The package therefore asks first whether small disturbances die out: over
# one period of the stiffness a disturbance is multiplied by the monodromy matrix, and all its
# eigenvalues, the Floquet multipliers, must lie in the unit circle.
#
# For an undamped oscillator of frequency :math:`\omega_0` (Mathieu's equation) the main zone of
# instability lies where the stiffness varies twice per oscillation, here
# :math:`2 \Omega = 2 \omega_0`, and to first order in :math:`\kappa` its borders are at
# :math:`\Omega / \omega_0 = 1 \pm \kappa / 4` (Nayfeh and Mook, Section 5.3). A drive with next to
# no damping shows it:

calm = replace(
    preset("published"),
    effects=(LoadInertia(0.4), DampingReference(0.01), MeshStiffnessVariation(0.2, 0.0)),
)
design = calm.nominal * [1.0, 1.0, 1.0, 1e-6, 1.0]
one = calm.coefficients(design[np.newaxis])
natural = np.sqrt(
    one.stiffness[0] * (1.0 / (one.input_inertia[0] * ratio**2) + 1.0 / one.output_inertia)
)
relative = np.linspace(0.85, 1.15, 121)
largest = [
    np.abs(floquet_multipliers(replace(one, input_speed=float(x * natural)))).max()
    for x in relative
]
unstable = relative[np.array(largest) > 1.0 + 1e-6]
print(f"unstable from {unstable.min():.3f} to {unstable.max():.3f}, first order 0.950 to 1.050")

fig, ax = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
ax.plot(relative, largest)
for border in (0.95, 1.05):
    ax.axvline(border, color="0.6", ls="--")
ax.set(xlabel="input speed / torsional frequency", ylabel="largest Floquet multiplier")
plt.show()

# %%
# Further laws, and the input angle itself
# ----------------------------------------
#
# Friction, play and hysteresis are no linear functions of the torsion, and in truth
# :math:`\theta_\mathrm{s}` and :math:`k` depend on the input angle that itself fluctuates.
# ``harmonic_balance`` follows both. It works over the input angle :math:`\alpha` instead of time,
# which makes all orders exact harmonics. The unknowns are the harmonics of the torsion and of half
# the squared speed, since
# :math:`\alpha^{\prime\prime} = \mathrm{d} (\alpha^{\prime 2} / 2) / \mathrm{d} \alpha`. In every
# step the laws are evaluated on a grid over :math:`\alpha`, their torques are transformed into
# harmonics (Cameron and Griffin, Journal of Applied Mechanics 56, 1989), and Newton's method brings
# the sum of torques to zero, harmonic by harmonic.
#
# Where the motion of the input is known, as from its encoder, ``lead`` prescribes it. Then only the
# torsion is unknown, and the motor's torque is the one that this motion takes.
#
# Orders such as 2 and 2.02 do not close over one input turn. Their beat gets an angle of its own,
# so that the grid is a torus of two angles and no record of many turns is needed.

balance = harmonic_balance(coefficients)
hill_dte = steady.peak_to_peak(ratio)[0] / ARCSEC
full_dte = balance.spectrum().peak_to_peak(ratio)[0] / ARCSEC
integrated = simulate_drive(model, model.nominal).dte_arcsec()
print(f"Hill's method         {hill_dte:.3f} arcsec")
print(f"harmonic balance      {full_dte:.3f} arcsec")
print(f"integrated from rest  {integrated:.3f} arcsec")
print(f"harmonic balance agrees to 1e-4: {abs(full_dte / integrated - 1.0) < 1e-4}")
