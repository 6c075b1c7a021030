"""Steady states of the records of a campaign, those in which a drive has none included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy.campaign.believed import Rig
from pymoo_hdte.drive import Coefficients, SpeedLoop, SteadyMotion, harmonic_balance
from pymoo_hdte.drive.solve.free_angle import STEPS, torus_of
from pymoo_hdte.drive.solve.steady_motion import BY_CASE, Tangents
from pymoo_hdte.drive.solve.torus import Torus

TOLERANCE = 1e-7
"""Tolerance of the harmonic balance: far below the noise, and twice as fast as full precision."""
_OF_SLOPES = 3e-7
"""The same for difference quotients: on a seen campaign it moves the worst derivative, which
forward quotients give to .3 %, by .2 %."""


def steady_motions(
    coefficients: Coefficients,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
    rig: Rig,
    start: SteadyMotion | None = None,
    steps: int = STEPS,
    for_slopes: bool = False,
) -> SteadyMotion:
    """Return the steady state of all rows.

    Where a clearance would open because the load does not hold the flanks together, the drive
    rattles and has no steady state. Such a record, or one for which none is found, is no evidence
    for or against the laws: it is predicted without them, and marked as not converged. So it is
    ``for_slopes`` by differences from ``start`` where that has none: a case that had a steady state
    on one side of a difference only would make a slope of the jump.
    """
    motor = SpeedLoop(rig.proportional, rig.integral)
    near = start if for_slopes else None
    tolerance = TOLERANCE if near is None else _OF_SLOPES

    def solve(coefficients: Coefficients, rows: NDArray[np.int_], torus: Torus) -> SteadyMotion:
        return harmonic_balance(
            coefficients.rows(rows),
            input_speed=speed[rows],
            load_torque=load[rows],
            motor=motor,
            torus=torus,
            tolerance=tolerance,
            start=None if start is None else start.rows(rows),
            steps=steps,
            tangents=True,
        )

    bare, torus = replace(coefficients, laws=()), torus_of(coefficients)
    rattles, held = False, np.ones(len(speed), dtype=bool)
    if near is not None:
        held = near.converged.copy()
    else:
        rattles = any(law.rattles for _, law in coefficients.laws)
    if rattles:
        plain = solve(bare, np.arange(len(speed)), torus)
        held = np.abs(plain.torsion[:, 0]) > np.abs(plain.torsion[:, 1:]).sum(axis=1)
    balance = solve(coefficients, np.flatnonzero(held), torus)
    held[held] = balance.converged
    if held.all():
        return balance
    lost = np.flatnonzero(~held)
    plain = plain.rows(lost) if rattles else solve(bare, lost, torus)
    plain = replace(plain, converged=np.zeros_like(plain.converged))
    return merged([balance.rows(balance.converged), plain], [np.flatnonzero(held), lost])


def merged(motions: Sequence[SteadyMotion], places: Sequence[NDArray[np.int_]]) -> SteadyMotion:
    """Merge the rows of motions on one torus, each with its places among all rows."""
    order = np.argsort(np.concatenate(places))
    joined = [
        np.concatenate([getattr(motion, name) for motion in motions])[order] for name in BY_CASE
    ]
    each = [motion.tangents for motion in motions if motion.tangents is not None]
    tangents = Tangents.joined(each).rows(order) if len(each) == len(motions) else None
    return SteadyMotion(motions[0].torus, *joined, tangents=tangents)
