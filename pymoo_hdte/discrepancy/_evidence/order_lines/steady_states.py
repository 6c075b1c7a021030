"""Steady states of the records of a campaign, those in which a drive has none included.

Where values change a little, as in a fit, they are continued from those known, to first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.drive import Coefficients, SpeedLoop, SteadyMotion, harmonic_balance
from pymoo_hdte.drive._solve.free_angle import STEPS, torus_of
from pymoo_hdte.drive._solve.steady_motion import BY_CASE, Tangents
from pymoo_hdte.drive._solve.torus import Torus


@dataclass(frozen=True)
class Effort:
    """How far steady states are searched for: ``tolerance`` and ``steps`` of `harmonic_balance`.

    For ``slopes`` a record without a steady state in the start has none: a case that had one on one
    side of a difference only would make a slope of the jump.
    """

    tolerance: float
    steps: int = STEPS
    slopes: bool = False


PREDICTION = Effort(1e-7)
"""Far below the noise, and twice as fast as full precision."""
SCREENING = Effort(1e-7, 25)
"""With an effect that is only screened.

Of 143,588 cases that arrived in four campaigns of a test bench none took more than 23 steps; those
that would take longer are no evidence for the effect there.
"""
SLOPES = Effort(3e-7, slopes=True)
"""For difference quotients. Forward quotients give the worst slope of a seen campaign to .3 %; this
moves it by .2 %, and beside a strong ripple of the motor that by the input's inertia by 2 %."""

_LONGEST = 0.5
"""Share of the torsion and of the energy up to which a change to first order is a place to begin.

Set by hand: the energy may go as far in a step of Newton's method.
"""


def steady_motions(
    coefficients: Coefficients,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
    rig: Rig,
    start: SteadyMotion | None = None,
    effort: Effort = PREDICTION,
) -> SteadyMotion:
    """Return the steady state of all rows.

    Where a clearance would open because the load does not hold the flanks together, the drive
    rattles and has no steady state. Such a record, or one for which none is found, is no evidence
    for or against the laws: it is predicted without them, and marked as not converged.
    """
    motor = SpeedLoop(rig.proportional, rig.integral)
    near = start if effort.slopes else None

    def solve(coefficients: Coefficients, rows: NDArray[np.int_], torus: Torus) -> SteadyMotion:
        return harmonic_balance(
            coefficients.rows(rows),
            input_speed=speed[rows],
            load_torque=load[rows],
            motor=motor,
            torus=torus,
            tolerance=effort.tolerance,
            start=None if start is None else start.rows(rows),
            steps=effort.steps,
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


class Continuation:
    """Steady states of r records at the values that were tried last, and where others begin.

    Attributes
    ----------
    motion : SteadyMotion, optional
        None as long as none is known.
    """

    def __init__(self) -> None:
        self.motion: SteadyMotion | None = None
        self._values = self._slopes = np.empty(0)
        self._followed: SteadyMotion | None = None

    def at(self, values: NDArray[np.float64]) -> SteadyMotion | None:
        """Return where to begin at values (n,), to first order; None as long as nothing is known.

        Torsion and energy are predicted, with matrices of the place from which the states were
        followed; the rest is that of the last place. So are records that would move too far.
        """
        near, known = self.motion, self._followed
        if near is None or known is None:
            return near
        if not np.array_equal(near.torus.orders, known.torus.orders):
            return near
        torsion, energy = np.tensordot(values - self._values, self._slopes, 1)
        too_far = np.abs(torsion).sum(axis=1) > _LONGEST * np.abs(near.torsion).sum(axis=1)
        too_far |= np.abs(energy).sum(axis=1) > _LONGEST * np.abs(near.energy[:, 0])
        torsion[too_far] = energy[too_far] = 0.0
        return replace(
            near,
            torsion=near.torsion + torsion,
            energy=near.energy + energy,
            tangents=known.tangents,
        )

    def arrived(self, values: NDArray[np.float64], motion: SteadyMotion) -> None:
        """Keep the steady states at values (n,)."""
        self.motion, self._values = motion, values.copy()

    def depart(self, count: int) -> None:
        """Follow the states, of which ``count`` values are varied, from those tried last."""
        if self.motion is not None:
            self._followed = self.motion
            self._slopes = np.zeros((count, 2, *self.motion.torsion.shape), dtype=complex)

    def follow(self, place: int, step: float, moved: SteadyMotion) -> None:
        """Keep how the states change with one of the values, by those after a step of it."""
        here = self._followed
        if here is not None and np.array_equal(moved.torus.orders, here.torus.orders):
            both = here.converged & moved.converged
            self._slopes[place, 0, both] = (moved.torsion[both] - here.torsion[both]) / step
            self._slopes[place, 1, both] = (moved.energy[both] - here.energy[both]) / step
