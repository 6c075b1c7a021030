"""Steady states of the records of a campaign, and a substitute where a drive has none.

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

    For ``slopes``, a record without a steady state in the start has none. One that had it on one
    side of a difference only would turn the jump into a slope.
    """

    tolerance: float
    steps: int = STEPS
    slopes: bool = False


PREDICTION = Effort(1e-7)
"""Far below the noise, and twice as fast as full precision."""
SCREENING = Effort(1e-7, 25)
"""For an effect that is only screened.

Of 143,588 cases that arrived in four campaigns of a test bench none took more than 23 steps; those
that would take longer are no evidence for the effect there.
"""
SLOPES = Effort(3e-7, slopes=True)
"""For difference quotients. Forward quotients give the worst slope of a seen campaign to .3 %; this
moves it by .2 %, and beside a strong ripple of the motor that by the input's inertia by 2 %."""

_HELD = 0.75
"""Share of the highest harmonic of a torus up to which it holds a line of the lead: from there on
what the line makes of others is cut off."""
_LONGEST = 0.5
"""Largest change to first order from which to begin, as a share of torsion and energy.

Set by hand: the energy may go as far in a step of Newton's method.
"""


def steady_motions(
    coefficients: Coefficients,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
    rig: Rig,
    start: SteadyMotion | None = None,
    effort: Effort = PREDICTION,
    lead: Lead | None = None,
) -> SteadyMotion:
    """Return the steady state of all rows, with the input held by its loop or moving as measured.

    Where the load does not hold the flanks of a clearance together, the drive rattles and has no
    steady state. A record without a steady state is no evidence for or against the laws: it is
    predicted without them, and marked as not converged.
    """
    motor = SpeedLoop(rig.proportional, rig.integral)
    origin = start if effort.slopes else None
    bare, torus = replace(coefficients, laws=()), torus_of(coefficients)
    moving = None if lead is None else lead.on(torus)

    def solve(coefficients: Coefficients, rows: NDArray[np.int_]) -> SteadyMotion:
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
            lead=None if moving is None else moving[rows],
        )

    rattles, held = False, np.ones(len(speed), dtype=bool)
    if origin is not None:
        held = origin.converged.copy()
    else:
        rattles = any(law.rattles for _, law in coefficients.laws)
    if rattles:
        plain = solve(bare, np.arange(len(speed)))
        held = np.abs(plain.torsion[:, 0]) > np.abs(plain.torsion[:, 1:]).sum(axis=1)
    balance = solve(coefficients, np.flatnonzero(held))
    held[held] = balance.converged
    if held.all():
        return balance
    lost = np.flatnonzero(~held)
    plain = plain.rows(lost) if rattles else solve(bare, lost)
    plain = replace(plain, converged=np.zeros_like(plain.converged))
    return merged([balance.rows(balance.converged), plain], [np.flatnonzero(held), lost])


def merged(motions: Sequence[SteadyMotion], places: Sequence[NDArray[np.int_]]) -> SteadyMotion:
    """Merge the rows of motions on one torus, each with its places among all rows."""
    order = np.argsort(np.concatenate(places))
    joined = [
        np.concatenate([getattr(motion, name) for motion in motions])[order] for name in BY_CASE
    ]
    known = [motion.tangents for motion in motions if motion.tangents is not None]
    tangents = Tangents.joined(known).rows(order) if len(known) == len(motions) else None
    return SteadyMotion(motions[0].torus, *joined, tangents=tangents)


@dataclass(frozen=True, eq=False)
class Lead:
    """Measured motion of the input of n rows: phasors (n, m), rad, at orders (m,)."""

    orders: NDArray[np.float64]
    phasors: NDArray[np.complex128]

    def rows(self, rows: NDArray[np.int_]) -> Lead:
        """Return the motion of some of the rows."""
        return Lead(self.orders, self.phasors[rows])

    def within(self, torus: Torus) -> NDArray[np.bool_]:
        """Return which orders are harmonics of a torus, shape (m,)."""
        return np.array([torus.find(order) is not None for order in self.orders.tolist()])

    def held(self, torus: Torus) -> NDArray[np.bool_]:
        """Return which lines a torus holds with what they make of others, shape (m,)."""
        return self.within(torus) & (self.orders <= _HELD * torus.highest[0])

    def on(self, torus: Torus) -> NDArray[np.complex128]:
        """Return the harmonics (n, n_harmonics) of a torus; lines not `held` are left out."""
        return torus.harmonics(self.orders, np.where(self.held(torus), self.phasors, 0.0))


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
        """Return where to begin at values (n,), to first order; None if no state is known.

        Torsion and energy are predicted with the matrices of the place from which the states were
        followed. Everything else, and records that would move too far, stay as at the last place.
        """
        nearest, known = self.motion, self._followed
        if nearest is None or known is None:
            return nearest
        if not np.array_equal(nearest.torus.orders, known.torus.orders):
            return nearest
        torsion, energy = np.tensordot(values - self._values, self._slopes, 1)
        too_far = np.abs(torsion).sum(axis=1) > _LONGEST * np.abs(nearest.torsion).sum(axis=1)
        too_far |= np.abs(energy).sum(axis=1) > _LONGEST * np.abs(nearest.energy[:, 0])
        torsion[too_far] = energy[too_far] = 0.0
        return replace(
            nearest,
            torsion=nearest.torsion + torsion,
            energy=nearest.energy + energy,
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
        """Keep the slope of the states by one of the values, from the states after a step of it."""
        here = self._followed
        if here is not None and np.array_equal(moved.torus.orders, here.torus.orders):
            converged = here.converged & moved.converged
            self._slopes[place, 0, converged] = (
                moved.torsion[converged] - here.torsion[converged]
            ) / step
            self._slopes[place, 1, converged] = (
                moved.energy[converged] - here.energy[converged]
            ) / step
