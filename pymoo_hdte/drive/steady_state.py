"""Steady state of the drive without time stepping: transfer function and Hill's method.

Both take theta_in = Omega t as the argument of theta_s and of the varying stiffness. Written for
one order o, w = o Omega, the torsion d of Eq. (9) obeys

    (P_o + K + i w c) d_o + (K kappa / 2) (e^{i psi} d_{o-2} + e^{-i psi} d_{o+2})
        = -P_o s_o + T [o = 0]

where P = 1 / G is the impedance of the two free inertias seen from the mesh, s the static error and
T the mean mesh torque: one small linear system for each family of orders that differ by 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive.coefficients import Coefficients
from pymoo_hdte.drive.order_spectrum import OrderSpectrum
from pymoo_hdte.drive.stability import require_stable

_COUPLINGS = 6
_TAIL = 1e-10
"""Harmonics are kept until the next one is smaller by this factor."""


def transfer_function(
    coefficients: Coefficients, orders: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return H from theta_s to theta_d at constant stiffness, shape (n, n_orders).

    H = Z G / (1 + Z G), Z = K + i w c and G = 1/P the compliance of the two free inertias.
    """
    frequency = orders * coefficients.input_speed
    mesh = coefficients.stiffness[:, None] + 1j * frequency * coefficients.damping[:, None]
    return mesh / (mesh + _free_impedance(coefficients, frequency))


def steady_state(coefficients: Coefficients) -> OrderSpectrum:
    """Return theta_d = theta_s + d as an order spectrum.

    Raises
    ------
    UnstableDrive
        If the varying stiffness makes the motion of a design grow, so that there is no steady
        state for the equations to have.
    """
    if coefficients.stiffness_depth == 0.0:
        orders = coefficients.error_orders
        response = transfer_function(coefficients, orders) * coefficients.error_phasors
        return OrderSpectrum(orders, response)
    require_stable(coefficients)
    families = np.unique(np.round(np.mod(coefficients.error_orders, 2.0), 9) % 2.0)
    parts = [_family(coefficients, first) for first in np.union1d(families, [0.0])]
    return OrderSpectrum(
        np.concatenate([orders for orders, _ in parts]),
        np.concatenate([phasors for _, phasors in parts], axis=1),
    )


def _family(
    coefficients: Coefficients, first: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Solve for all orders ``first + 2 m`` that the couplings reach; return orders and theta_d."""
    depth = coefficients.stiffness_depth
    reach = max(_COUPLINGS, int(np.ceil(np.log(_TAIL) / np.log(depth / 2.0))))
    excited = np.round((coefficients.error_orders - first) / 2.0, 9)
    member = excited == np.round(excited)
    highest = int(excited[member].max(initial=0.0))
    orders = first + 2.0 * np.arange(-reach, highest + reach + 1, dtype=np.float64)

    static = np.zeros((len(coefficients.stiffness), len(orders)), dtype=complex)
    # Several error lines of one order add up, hence no plain assignment.
    for column, phasor in zip(excited[member], coefficients.error_phasors.T[member], strict=True):
        static[:, int(column) + reach] += phasor

    frequency = orders * coefficients.input_speed
    impedance = _free_impedance(coefficients, frequency)
    stiffness, damping = coefficients.stiffness[:, None], coefficients.damping[:, None]
    diagonal = np.arange(len(orders))
    system = np.zeros((*static.shape, len(orders)), dtype=complex)
    system[:, diagonal, diagonal] = impedance + stiffness + 1j * frequency * damping
    coupling = stiffness * depth / 2.0 * np.exp(1j * coefficients.stiffness_phase)
    system[:, diagonal[1:], diagonal[:-1]] = coupling
    system[:, diagonal[:-1], diagonal[1:]] = coupling.conj()
    forcing = -impedance * static
    forcing[:, orders == 0.0] += coefficients.mean_mesh_torque
    torsion = np.linalg.solve(system, forcing[:, :, None])[:, :, 0]
    return orders, static + torsion


def _free_impedance(
    coefficients: Coefficients, frequency: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return P of both free inertias, shape (n, n_frequencies); 0 at rest, where nothing holds."""
    ratio_squared = coefficients.ratio**2
    inertia = coefficients.input_inertia[:, None] * ratio_squared
    damping = coefficients.input_damping[:, None] * ratio_squared
    input_side = 1j * frequency * (damping + 1j * frequency * inertia)
    output_side = (
        1j
        * frequency
        * (coefficients.output_damping + 1j * frequency * coefficients.output_inertia)
    )
    moving = np.broadcast_to(frequency != 0.0, input_side.shape)
    total = np.where(moving, input_side + output_side, 1.0)
    return np.where(moving, input_side * output_side / total, 0.0)
