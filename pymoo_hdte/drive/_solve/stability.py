"""Parametric stability of a drive with varying stiffness, by Floquet multipliers.

Hill's method gives a result for an unstable drive, too, so its callers check stability first.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive._solve.coefficients import Coefficients

_LEAST_STEPS = 64
_MOST_STEPS = 4096
"""Largest number of steps in a cycle of the fastest variation."""
_LARGEST_DENOMINATOR = 1000
_PHASE_PER_STEP = 1.0
"""Radians of the fastest torsional vibration that one step may span."""
_ROUNDING = 1e-9
_IN_MOTION = (
    "stiffness", "damping", "input_inertia", "input_damping", "output_inertia", "output_damping",
)  # fmt: skip
"""Coefficients that determine the free motion, beside the variation of the stiffness."""


class UnstableDrive(ArithmeticError):
    """The motion of a drive grows from period to period: it has no steady state.

    Examples
    --------
    >>> from dataclasses import replace
    >>> model = preset("published")
    >>> loose = replace(model, effects=(MeshStiffnessVariation(0.95, 0.0), LoadInertia(0.45)))
    >>> try:
    ...     _ = loose.dte_arcsec(loose.nominal[np.newaxis])
    ... except UnstableDrive as error:
    ...     print("no steady state")
    ...
    no steady state
    """


def floquet_multipliers(coefficients: Coefficients) -> NDArray[np.complex128]:
    """Return the multipliers over one period of the stiffness, shape (n, 3 + c).

    The period is that of all orders together: half an input turn for order 2, and for a constant
    stiffness. Other laws are left out. The state is (th_in', d', d), by how much inertias in
    clutches are slower than the output, and twist and rate of a shaft ahead of the load: c more.
    The transition matrix is a product of steps with the
    stiffness of their midpoints, each the (2, 2) Pade approximant of the exponential: it is
    A-stable, so stiff damping costs no small steps, and of second order in the step. Steps resolve
    the torsional vibration; see `require_stable` for drives so slow that they cannot. Floquet
    theory: Nayfeh and Mook, Nonlinear Oscillations, Wiley 1979; Pade approximants: Moler and Van
    Loan, SIAM Review 20, 1978.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n designs.

    Returns
    -------
    ndarray of complex, shape (n, 3 + c)
        Dimensionless; a modulus above 1 is a motion that grows.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> multipliers = floquet_multipliers(model.coefficients(model.nominal[np.newaxis]))
    >>> bool((abs(multipliers) < 1.0).all())
    True
    """
    period, cycles = _period(coefficients)
    least, most = _LEAST_STEPS * cycles, _MOST_STEPS * cycles
    steps = int(np.clip(np.ceil(_phase(coefficients, period)), least, most))
    step = period / coefficients.input_speed / steps
    identity = np.eye(_size(coefficients))
    transition = np.tile(identity, (len(coefficients.stiffness), 1, 1))
    for index in range(steps):
        angle = (index + 0.5) * period / steps
        scaled = step * state_matrix(coefficients, angle)
        square = scaled @ scaled / 12.0
        forward, backward = identity + scaled / 2.0 + square, identity - scaled / 2.0 + square
        transition[:] = np.linalg.solve(backward, forward @ transition)
    return np.linalg.eigvals(transition).astype(np.complex128)


def _period(coefficients: Coefficients) -> tuple[float, int]:
    """Return the input angle in which the stiffness repeats, and its fastest cycles therein."""
    orders = [
        Fraction(law.order).limit_denominator(_LARGEST_DENOMINATOR)
        for law in coefficients.stiffness_variations
    ] or [Fraction(2)]
    common = Fraction(
        math.gcd(*(order.numerator for order in orders)),
        math.lcm(*(order.denominator for order in orders)),
    )
    return 2.0 * math.pi / float(common), int(max(orders) / common)


def _phase(coefficients: Coefficients, period: float) -> float:
    """Return the phase of the fastest torsional vibration in one period, in `_PHASE_PER_STEP`."""
    compliance = 1.0 / (coefficients.input_inertia * coefficients.ratio**2)
    compliance += 1.0 / np.asarray(coefficients.near_inertia)
    depth = sum(law.depth for law in coefficients.stiffness_variations)
    stiffest = coefficients.stiffness * (1.0 + depth)
    square = np.max(stiffest * compliance, initial=0.0)
    if coefficients.loaded_shaft is not None:
        mobility = 1.0 / np.asarray(coefficients.near_inertia) + 1.0 / coefficients.load_inertia
        square = square + np.max(mobility) / coefficients.loaded_shaft[0]
    fastest = np.sqrt(square)
    return float(fastest * period / coefficients.input_speed / _PHASE_PER_STEP)


def require_stable(coefficients: Coefficients) -> None:
    """Raise `UnstableDrive`, naming the design, if the motion of one grows (`stable_rows`)."""
    largest = _largest_multipliers(coefficients)
    worst = int(np.argmax(largest)) if len(largest) else 0
    if not np.all(_bounded(largest)):
        raise UnstableDrive(
            f"design {worst} (K = {coefficients.stiffness[worst]:g} N.m/rad, "
            f"c = {coefficients.damping[worst]:g} N.m.s/rad) has a Floquet multiplier of modulus "
            f"{largest[worst]:.6f}, allowed: at most 1"
        )


def stable_rows(coefficients: Coefficients) -> NDArray[np.bool_]:
    """Return whether the multipliers of a design lie within the unit circle, shape (n,).

    A stiffness that varies a thousand times more slowly than the drive vibrates transfers no energy
    to it (tongues of parametric resonance shrink exponentially with their order), so such drives
    pass as stable without integration, as does a constant stiffness.
    """
    return _bounded(_largest_multipliers(coefficients))


def _largest_multipliers(coefficients: Coefficients) -> NDArray[np.float64]:
    """Return the largest modulus of each design, shape (n,); 0 for what passes as stable."""
    n = len(coefficients.stiffness)
    if not (n and coefficients.stiffness_variations):
        return np.zeros(n)
    period, cycles = _period(coefficients)
    if _phase(coefficients, period) > 2.0 * _MOST_STEPS * cycles:
        return np.zeros(n)
    # theta_s has no part in it: designs that differ in nothing else are solved once.
    parts = np.broadcast_arrays(*(getattr(coefficients, name) for name in _IN_MOTION))
    _, rows, which = np.unique(
        np.column_stack(parts), axis=0, return_index=True, return_inverse=True
    )
    largest = np.abs(floquet_multipliers(coefficients.rows(rows))).max(axis=1)
    return np.asarray(largest[which.ravel()])


def _bounded(moduli: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(moduli <= 1.0 + _ROUNDING)


def state_matrix(coefficients: Coefficients, input_angle: float) -> NDArray[np.float64]:
    """Return the rates of the states of `floquet_multipliers` by these, (n, 3 + c, 3 + c)."""
    variation = sum(
        law.depth * np.cos(law.order * input_angle + law.phase)
        for law in coefficients.stiffness_variations
    )
    stiffness = coefficients.stiffness * (1.0 + variation)
    ratio, damping = coefficients.ratio, coefficients.damping
    bearing = coefficients.output_damping
    size, inertia_near = _size(coefficients), coefficients.near_inertia
    matrix = np.zeros((len(stiffness), size, size))
    matrix[:, 0, 0] = -coefficients.input_damping / coefficients.input_inertia
    matrix[:, 0, 1] = -damping / ratio / coefficients.input_inertia
    matrix[:, 0, 2] = -stiffness / ratio / coefficients.input_inertia
    # d'' = th_in''/N - th_out'' with th_out' = th_in'/N - d'.
    matrix[:, 1] = matrix[:, 0] / ratio
    matrix[:, 1, 0] += bearing / ratio / inertia_near
    matrix[:, 1, 1] -= (damping + bearing) / inertia_near
    matrix[:, 1, 2] -= stiffness / inertia_near
    matrix[:, 2, 1] = 1.0
    for place, (inertia, time) in enumerate(coefficients.coupled, 3):
        matrix[:, 1, place] = inertia / time / inertia_near
    if coefficients.loaded_shaft is not None:
        compliance, time = coefficients.loaded_shaft
        matrix[:, 1, -2] = 1.0 / compliance / inertia_near
        matrix[:, 1, -1] = time / compliance / inertia_near
    output = matrix[:, 0] / ratio - matrix[:, 1]
    for place, (_, time) in enumerate(coefficients.coupled, 3):
        matrix[:, place] = output
        matrix[:, place, place] -= 1.0 / time
    if coefficients.loaded_shaft is not None:
        matrix[:, -2, -1] = 1.0
        matrix[:, -1] = output
        matrix[:, -1, -2] -= 1.0 / compliance / coefficients.load_inertia
        matrix[:, -1, -1] -= time / compliance / coefficients.load_inertia
    return matrix


def _size(coefficients: Coefficients) -> int:
    """Return the number of states of `state_matrix`."""
    return 3 + len(coefficients.coupled) + (0 if coefficients.loaded_shaft is None else 2)
