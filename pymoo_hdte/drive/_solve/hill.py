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

from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.free_angle import continued_from_neighbours, harmonic_balance
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive._solve.stability import require_stable, stable_rows

_COUPLINGS = (6, 12, 24, 48, 96, 192)
"""Numbers of orders kept beyond the excited ones; the first sufficient one is used."""
_TAIL = 1e-9
"""A number suffices if the outermost harmonics are smaller than the largest by this factor."""


def transfer_function(
    coefficients: Coefficients, orders: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return H from theta_s to theta_d of the motion, Eq. (9), at constant stiffness.

    H = Z G / (1 + Z G), Z = K + i w c and G = 1/P the compliance of the two free inertias.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs; laws at ports and a varying stiffness are left out.
    orders : ndarray, shape (n_orders,)
        Cycles per input turn; w is their multiple of the input speed.

    Returns
    -------
    ndarray of complex, shape (n, n_orders)
        Dimensionless.

    Examples
    --------
    >>> model = preset("published")
    >>> gain = transfer_function(model.coefficients(model.nominal[np.newaxis]), np.array([2.0]))
    >>> print(f"{abs(gain).item():.3f}")
    1.006
    """
    frequency = orders * coefficients.input_speed
    mesh = coefficients.stiffness[:, None] + 1j * frequency * coefficients.damping[:, None]
    return mesh / (mesh + _free_impedance(coefficients, frequency))


def hill_steady_state(coefficients: Coefficients) -> OrderSpectrum:
    """Return theta_d = theta_s + d of Eqs. (9) and (10), rad, as an order spectrum.

    By `transfer_function` at constant stiffness, by Hill's method (Nayfeh and Mook, Nonlinear
    Oscillations, Wiley 1979) where it varies twice per input turn, and by `harmonic_balance` where
    laws stand at ports. The first two take theta_in = Omega t.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs, a row of the spectrum each.

    Returns
    -------
    OrderSpectrum

    Raises
    ------
    UnstableDrive
        If the varying stiffness makes the motion of a design grow, so that the equations have no
        steady state.
    ArithmeticError
        If laws at ports are such that the harmonic balance finds no steady state, or the harmonics
        of a deeply varying stiffness do not die out.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> spectrum = hill_steady_state(model.coefficients(model.nominal[np.newaxis]))
    >>> print(f"{np.degrees(spectrum.peak_to_peak(model.sheet.ratio)[0]) * 3600:.1f} arcsec")
    86.7 arcsec
    """
    require_stable(coefficients)
    solved, spectrum = _solved(coefficients)
    lost = int(np.sum(~solved))
    if lost:
        raise ArithmeticError(f"no steady state found for {lost} of {len(solved)}")
    return spectrum


def found_steady_states(coefficients: Coefficients) -> tuple[NDArray[np.bool_], OrderSpectrum]:
    """Return which of n designs have a steady state, shape (n,), and theta_d of those, rad.

    As `hill_steady_state`, but designs whose motion grows or is not found are left out.

    Raises
    ------
    ArithmeticError
        If the harmonics of a deeply varying stiffness do not die out.
    """
    has_state = stable_rows(coefficients)
    rows = np.flatnonzero(has_state)
    solved, spectrum = _solved(coefficients.rows(rows))
    has_state[rows] = solved
    return has_state, OrderSpectrum(spectrum.orders, spectrum.phasors[solved])


def _solved(coefficients: Coefficients) -> tuple[NDArray[np.bool_], OrderSpectrum]:
    """Return which of n stable designs were solved, and a row of the spectrum for each design.

    Rows that were not are 0.
    """
    coefficients = coefficients.at_loads(coefficients.load_torque)
    if coefficients.laws or coefficients.reaction or coefficients.load_rates:
        balance = continued_from_neighbours(coefficients, harmonic_balance(coefficients))
        phasors = np.where(balance.converged[:, None], balance.transmission_error, 0.0)
        return balance.converged, OrderSpectrum(balance.torus.orders, phasors)
    everywhere = np.ones(len(coefficients.stiffness), dtype=bool)
    if coefficients.stiffness_depth == 0.0:
        orders = coefficients.error_orders
        response = transfer_function(coefficients, orders) * coefficients.error_phasors
        return everywhere, OrderSpectrum(orders, response)
    # The mean torque belongs to the family of order 0, whether or not an error line does.
    orders = np.concatenate([coefficients.error_orders, [0.0]])
    firsts, family = np.unique(np.round(np.mod(orders, 2.0), 9) % 2.0, return_inverse=True)
    parts = [
        _family(coefficients, float(lowest), np.flatnonzero(family[:-1] == number))
        for number, lowest in enumerate(firsts)
    ]
    return everywhere, OrderSpectrum(
        np.concatenate([orders for orders, _ in parts]),
        np.concatenate([phasors for _, phasors in parts], axis=1),
    )


def _family(
    coefficients: Coefficients, lowest: float, lines: NDArray[np.int_]
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Return all orders ``lowest + 2 m`` that matter, and their theta_d.

    ``lines`` are the error lines of this family.

    Raises
    ------
    ArithmeticError
        If the harmonics do not die out within the largest number kept.
    """
    places = np.rint((coefficients.error_orders[lines] - lowest) / 2.0).astype(int)
    highest = int(places.max(initial=0))
    for reach in _COUPLINGS:
        orders = lowest + 2.0 * np.arange(-reach, highest + reach + 1, dtype=np.float64)
        static = np.zeros((len(coefficients.stiffness), len(orders)), dtype=complex)
        # Several error lines of one order add up, hence no plain assignment.
        for place, phasor in zip(places, coefficients.error_phasors.T[lines], strict=True):
            static[:, place + reach] += phasor
        torsion = _torsion(coefficients, orders, static)
        size = np.abs(torsion)
        if np.all(size[:, [0, -1]] <= _TAIL * size.max(axis=1, keepdims=True)):
            return orders, static + torsion
    raise ArithmeticError(
        f"harmonics of a stiffness variation of {coefficients.stiffness_depth:g} at "
        f"{coefficients.input_speed:g} rad/s do not die out within {reach} couplings"
    )


def _torsion(
    coefficients: Coefficients, orders: NDArray[np.float64], static: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Solve the coupled equations of one family; shape (n, n_orders)."""
    frequency = orders * coefficients.input_speed
    impedance = _free_impedance(coefficients, frequency)
    stiffness, damping = coefficients.stiffness[:, None], coefficients.damping[:, None]
    diagonal = np.arange(len(orders))
    system = np.zeros((*static.shape, len(orders)), dtype=complex)
    system[:, diagonal, diagonal] = impedance + stiffness + 1j * frequency * damping
    rotation = np.exp(1j * coefficients.stiffness_phase)
    coupling = stiffness * coefficients.stiffness_depth / 2.0 * rotation
    system[:, diagonal[1:], diagonal[:-1]] = coupling
    system[:, diagonal[:-1], diagonal[1:]] = coupling.conj()
    forcing = -impedance * static
    forcing[:, orders == 0.0] += coefficients.mean_mesh_torque
    return np.asarray(np.linalg.solve(system, forcing[:, :, None])[:, :, 0], np.complex128)


def _free_impedance(
    coefficients: Coefficients, frequency: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return P of both free inertias, shape (n, n_frequencies); 0 at frequency zero."""
    ratio_squared = coefficients.ratio**2
    inertia = coefficients.input_inertia[:, None] * ratio_squared
    damping = coefficients.input_damping[:, None] * ratio_squared
    input_side = 1j * frequency * (damping + 1j * frequency * inertia)
    on_output = coefficients.output_inertia + coefficients.loose_inertia(frequency)
    output_side = 1j * frequency * (coefficients.output_damping + 1j * frequency * on_output)
    moving = np.broadcast_to(frequency != 0.0, input_side.shape)
    total = np.where(moving, input_side + output_side, 1.0)
    return np.where(moving, input_side * output_side / total, 0.0)
