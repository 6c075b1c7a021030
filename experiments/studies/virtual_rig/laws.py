"""Laws of the virtual rig, compiled; their forms differ from those of the library under test.

Where the library is sharp these are rounded, where it is Gaussian these are exponential, and so on:
an analysis that only recognised its own formulas would fail on them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled

_NONE: NDArray[np.float64] = np.zeros(0)


class Side(NamedTuple):
    """One shaft: inertia, damping, friction and torques from outside; neutral by default.

    Attributes
    ----------
    inertia, damping : float
        kg.m2, N.m.s/rad.
    reaction : float
        Share of the reaction of the kinematic error (input only); 1 is the physics.
    coulomb, rounding_speed : float
        Friction coulomb tanh(w / rounding_speed).
    drag, drag_exponent : float
        Drag |w|^drag_exponent sign(w).
    ripple, ripple_order, ripple_phase, ripple_second : float
        Torque of the motor, N.m, that varies with its angle, plus a fifth of it at twice the
        order (input only).
    """

    inertia: float
    damping: float
    reaction: float = 0.0
    coulomb: float = 0.0
    rounding_speed: float = 1.0
    drag: float = 0.0
    drag_exponent: float = 1.0
    ripple: float = 0.0
    ripple_order: float = 1.0
    ripple_phase: float = 0.0
    ripple_second: float = 0.0


class Mesh(NamedTuple):
    """The mesh between the shafts; neutral by default.

    The torsion passes the dead zone, then the corner; the stiffness multiplies.

    Attributes
    ----------
    stiffness, damping : float
        K and c, N.m/rad and N.m.s/rad.
    error_orders, error_amplitudes, error_phases : ndarray
        Static error sum a sin(o alpha + phi), rad.
    error_offset : float
        Constant part of the static error, rad.
    clearance, clearance_rounding : float
        Half width and rounding of the dead zone, rad.
    soft_share, soft_corner, corner_rounding : float
        K (1 - soft_share) up to soft_corner, then K.
    depth, depth_phase, depth_second, depth_clip : float
        K (1 + depth (clipped cos(2 alpha + phase) + fifth of cos(4 alpha + second))).
    """

    stiffness: float
    damping: float
    error_orders: NDArray[np.float64] = _NONE
    error_amplitudes: NDArray[np.float64] = _NONE
    error_phases: NDArray[np.float64] = _NONE
    error_offset: float = 0.0
    clearance: float = 0.0
    clearance_rounding: float = 1.0
    soft_share: float = 0.0
    soft_corner: float = 0.0
    corner_rounding: float = 1.0
    depth: float = 0.0
    depth_phase: float = 0.0
    depth_second: float = 0.0
    depth_clip: float = 1.0


@compiled
def softplus(value: float) -> float:
    """Return log(1 + exp(value)) without overflow."""
    return max(value, 0.0) + math.log1p(math.exp(-abs(value)))


@compiled
def rounded_dead_zone(torsion: float, half_width: float, rounding: float) -> float:
    """Return the torsion beyond a dead zone with rounded corners; slope 1 far out."""
    upper = softplus((torsion - half_width) / rounding)
    return rounding * (upper - softplus(-(torsion + half_width) / rounding))


@compiled
def backbone(mesh: Mesh, torsion: float) -> float:
    """Return the torsion that a linear spring would need for the same elastic torque, rad."""
    bent = torsion
    if mesh.clearance > 0.0:
        bent = rounded_dead_zone(torsion, mesh.clearance, mesh.clearance_rounding)
    if mesh.soft_share != 0.0:
        beyond = rounded_dead_zone(bent, mesh.soft_corner, mesh.corner_rounding)
        bent -= mesh.soft_share * (bent - beyond)
    return bent


@compiled
def static_mesh_torque(mesh: Mesh, torsion: float, angle: float) -> float:
    """Return the mesh torque without its damping at this torsion and input angle, N.m."""
    stiffness = mesh.stiffness
    if mesh.depth != 0.0:
        clip = mesh.depth_clip
        wave = min(max(math.cos(2.0 * angle + mesh.depth_phase), -clip), clip)
        wave += 0.2 * math.cos(4.0 * angle + mesh.depth_second)
        stiffness *= 1.0 + mesh.depth * wave
    return stiffness * backbone(mesh, torsion)


@compiled
def static_error(mesh: Mesh, angle: float) -> tuple[float, float]:
    """Return theta_s, rad, and its derivative by the input angle."""
    value, slope = mesh.error_offset, 0.0
    for line in range(len(mesh.error_orders)):
        order, amplitude = mesh.error_orders[line], mesh.error_amplitudes[line]
        argument = order * angle + mesh.error_phases[line]
        value += amplitude * math.sin(argument)
        slope += amplitude * order * math.cos(argument)
    return value, slope


@compiled
def friction(side: Side, speed: float) -> float:
    """Return the torque that resists a positive speed of this shaft, N.m."""
    torque = side.damping * speed
    if side.coulomb != 0.0:
        torque += side.coulomb * math.tanh(speed / side.rounding_speed)
    if side.drag != 0.0:
        torque += side.drag * math.copysign(abs(speed) ** side.drag_exponent, speed)
    return torque


@compiled
def ripple(side: Side, angle: float) -> float:
    """Return the angle-periodic torque of this shaft, N.m."""
    if side.ripple == 0.0:
        return 0.0
    once = math.cos(side.ripple_order * angle + side.ripple_phase)
    twice = math.cos(2.0 * side.ripple_order * angle + side.ripple_second)
    return side.ripple * (once + 0.2 * twice)
