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
    extra_inertia : float
        Beyond the believed one, rigid with the load (output only), kg.m2.
    sensor_stiffness, sensor_damping : float
        Of a compliant torque sensor before the load (output only); 0 for a rigid one.
    reaction : float
        Share of the reaction of the kinematic error (input only); 1 is the physics.
    coulomb, stribeck, stribeck_speed, rounding_speed : float
        Friction (coulomb + stribeck exp(-|w| / stribeck_speed)) tanh(w / rounding_speed).
    periodic, periodic_order, periodic_phase, periodic_second : float
        Friction that varies with the angle of this shaft, plus a fifth of it at twice the order.
    drag, drag_exponent : float
        Drag |w|^drag_exponent sign(w).
    ripple, ripple_order, ripple_phase, ripple_second : float
        Torque of the motor, N.m, or share of the load, that varies with the shaft's angle, plus a
        fifth of it at twice the order.
    vibration, vibration_frequency : float
        Torque from outside at a fixed frequency, N.m and rad/s.
    burst, burst_period, burst_width : float
        Added friction, N.m, for ``burst_width`` seconds about once in ``burst_period``.
    """

    inertia: float
    damping: float
    extra_inertia: float = 0.0
    sensor_stiffness: float = 0.0
    sensor_damping: float = 0.0
    reaction: float = 0.0
    coulomb: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    rounding_speed: float = 1.0
    periodic: float = 0.0
    periodic_order: float = 1.0
    periodic_phase: float = 0.0
    periodic_second: float = 0.0
    drag: float = 0.0
    drag_exponent: float = 1.0
    ripple: float = 0.0
    ripple_order: float = 1.0
    ripple_phase: float = 0.0
    ripple_second: float = 0.0
    vibration: float = 0.0
    vibration_frequency: float = 1.0
    burst: float = 0.0
    burst_period: float = 1.0
    burst_width: float = 0.1


class Mesh(NamedTuple):
    """The mesh between the shafts; neutral by default.

    The torsion passes the dead zone, then the corners, then the sinh; the stiffness multiplies.

    Attributes
    ----------
    stiffness, damping : float
        K and c, N.m/rad and N.m.s/rad.
    error_orders, error_amplitudes, error_phases : ndarray
        Static error sum a sin(o alpha + phi), rad.
    error_offset : float
        Constant part of the static error, rad.
    kinematic, kinematic_order, kinematic_phase, kinematic_second : float
        A further line, rad, with 15 % of it at twice the order.
    clearance, clearance_rounding : float
        Half width and rounding of the dead zone, rad.
    pulse, shift, clearance_order, clearance_phase : float
        Share of the half width by which the width and the centre vary with alpha.
    soft_share, soft_corner, stiff_share, stiff_corner, corner_rounding : float
        K (1 - soft_share) up to soft_corner, then K, then K (1 + stiff_share) from stiff_corner.
    sinh_curvature : float
        q of sinh(q d) / q, 1/rad.
    depth, depth_phase, depth_second, depth_clip : float
        K (1 + depth (clipped cos(2 alpha + phase) + fifth of cos(4 alpha + second))).
    stiffening : float
        Relative growth of K per rad/s of the input.
    damping_factor, damping_growth : float
        c times the factor times (1 + growth |w_in|).
    slip_stiffness, slip_limit : ndarray
        Maxwell elements, N.m/rad and N.m.
    """

    stiffness: float
    damping: float
    error_orders: NDArray[np.float64] = _NONE
    error_amplitudes: NDArray[np.float64] = _NONE
    error_phases: NDArray[np.float64] = _NONE
    error_offset: float = 0.0
    kinematic: float = 0.0
    kinematic_order: float = 1.0
    kinematic_phase: float = 0.0
    kinematic_second: float = 0.0
    clearance: float = 0.0
    clearance_rounding: float = 1.0
    pulse: float = 0.0
    shift: float = 0.0
    clearance_order: float = 1.0
    clearance_phase: float = 0.0
    soft_share: float = 0.0
    soft_corner: float = 0.0
    stiff_share: float = 0.0
    stiff_corner: float = 0.0
    corner_rounding: float = 1.0
    sinh_curvature: float = 0.0
    depth: float = 0.0
    depth_phase: float = 0.0
    depth_second: float = 0.0
    depth_clip: float = 1.0
    stiffening: float = 0.0
    damping_factor: float = 1.0
    damping_growth: float = 0.0
    slip_stiffness: NDArray[np.float64] = _NONE
    slip_limit: NDArray[np.float64] = _NONE


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
def backbone(mesh: Mesh, torsion: float, angle: float) -> float:
    """Return the torsion that a linear spring would need for the same elastic torque, rad."""
    bent = torsion
    if mesh.clearance > 0.0:
        wave = math.cos(mesh.clearance_order * angle + mesh.clearance_phase)
        centred = torsion - mesh.clearance * mesh.shift * wave
        half_width = mesh.clearance * (1.0 + mesh.pulse * wave)
        bent = rounded_dead_zone(centred, half_width, mesh.clearance_rounding)
    result = bent
    if mesh.soft_share != 0.0:
        beyond = rounded_dead_zone(bent, mesh.soft_corner, mesh.corner_rounding)
        result -= mesh.soft_share * (bent - beyond)
    if mesh.stiff_share != 0.0:
        beyond = rounded_dead_zone(bent, mesh.stiff_corner, mesh.corner_rounding)
        result += mesh.stiff_share * beyond
    if mesh.sinh_curvature > 0.0:
        result += math.sinh(mesh.sinh_curvature * bent) / mesh.sinh_curvature - bent
    return result


@compiled
def stiffness_at(mesh: Mesh, angle: float, input_speed: float) -> float:
    """Return K at this input angle and speed, N.m/rad."""
    stiffness = mesh.stiffness * (1.0 + mesh.stiffening * abs(input_speed))
    if mesh.depth == 0.0:
        return stiffness
    clip = mesh.depth_clip
    wave = min(max(math.cos(2.0 * angle + mesh.depth_phase), -clip), clip)
    wave += 0.2 * math.cos(4.0 * angle + mesh.depth_second)
    return stiffness * (1.0 + mesh.depth * wave)


@compiled
def slip_torque(mesh: Mesh, slip: NDArray[np.float64], travel: float, element: int) -> float:
    """Return the torque of one Maxwell element after a further monotone travel, N.m."""
    limit: float = mesh.slip_limit[element]
    stuck: float = slip[element] + mesh.slip_stiffness[element] * travel
    return min(max(stuck, -limit), limit)


@compiled
def static_mesh_torque(
    mesh: Mesh,
    torsion: float,
    angle: float,
    input_speed: float,
    slip: NDArray[np.float64],
    slip_torsion: float,
) -> float:
    """Return the mesh torque without its damping, N.m.

    ``slip`` are the torques of the Maxwell elements when the torsion was ``slip_torsion``.
    """
    torque = stiffness_at(mesh, angle, input_speed) * backbone(mesh, torsion, angle)
    for element in range(len(slip)):
        torque += slip_torque(mesh, slip, torsion - slip_torsion, element)
    return torque


@compiled
def damping_at(mesh: Mesh, input_speed: float) -> float:
    """Return c at this input speed, N.m.s/rad."""
    growth = 1.0 + mesh.damping_growth * abs(input_speed)
    return mesh.damping * mesh.damping_factor * growth


@compiled
def static_error(mesh: Mesh, angle: float) -> tuple[float, float]:
    """Return theta_s, rad, and its derivative by the input angle."""
    value, slope = mesh.error_offset, 0.0
    for line in range(len(mesh.error_orders)):
        order, amplitude = mesh.error_orders[line], mesh.error_amplitudes[line]
        argument = order * angle + mesh.error_phases[line]
        value += amplitude * math.sin(argument)
        slope += amplitude * order * math.cos(argument)
    if mesh.kinematic != 0.0:
        order = mesh.kinematic_order
        angle_of = order * angle + mesh.kinematic_phase
        second = 2.0 * order * angle + mesh.kinematic_second
        value += mesh.kinematic * (math.sin(angle_of) + 0.15 * math.sin(second))
        slope += mesh.kinematic * order * (math.cos(angle_of) + 0.3 * math.cos(second))
    return value, slope


@compiled
def angle_wave(order: float, angle: float, phase: float, second_phase: float) -> float:
    """Return a cosine of the angle plus a fifth of its second harmonic."""
    cosine = math.cos(order * angle + phase)
    return cosine + 0.2 * math.cos(2.0 * order * angle + second_phase)


@compiled
def friction(side: Side, speed: float, angle: float, time: float) -> float:
    """Return the torque that resists a positive speed of this shaft, N.m."""
    torque = side.damping * speed
    level = side.coulomb
    if side.stribeck != 0.0:
        level += side.stribeck * math.exp(-abs(speed) / side.stribeck_speed)
    if side.periodic != 0.0:
        level += side.periodic * angle_wave(
            side.periodic_order, angle, side.periodic_phase, side.periodic_second
        )
    if side.burst != 0.0:
        level += side.burst * burst_envelope(time, side.burst_period, side.burst_width)
    if level != 0.0:
        torque += level * math.tanh(speed / side.rounding_speed)
    if side.drag != 0.0:
        torque += side.drag * math.copysign(abs(speed) ** side.drag_exponent, speed)
    return torque


@compiled
def burst_envelope(time: float, period: float, width: float) -> float:
    """Return a smooth bump of height 1 at an irregular instant of every period."""
    number = math.floor(time / period)
    # The fractional part of a large sine is a cheap hash: irregular, yet the same on every run.
    scatter = math.sin(12.9898 * number) * 43758.5453
    spare = period - width
    centre = number * period + width / 2.0 + spare * (scatter - math.floor(scatter))
    distance = abs(time - centre)
    return 0.0 if distance > width / 2.0 else math.cos(math.pi * distance / width) ** 2


@compiled
def ripple(side: Side, angle: float) -> float:
    """Return the angle-periodic torque of this shaft, in the unit of ``side.ripple``."""
    if side.ripple == 0.0:
        return 0.0
    return side.ripple * angle_wave(side.ripple_order, angle, side.ripple_phase, side.ripple_second)
