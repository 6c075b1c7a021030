"""Torsion of a drive with locked input whose output is loaded and unloaded slowly.

Between two turning points of the mesh torque the torsion moves one way only. A law with memory then
follows from the torsions at the turning points, which makes each leg one vectorised root search.
Where no law asks for the way, the torsion follows the torque, and the whole path is one leg.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.checks import finite_array
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.effects.law import Law, PortState, Response, Values, periodic_phase

_STEPS = 100
_TOLERANCE = 1e-10
"""Largest change of the torsion, relative to the length of the leg, that ends the root search.

Away from a kink the next step would be about its square; at one, where the bracket is halved, the
error may be as large as this.
"""
_DOUBLINGS = 20
_LEAST_WAY = 1e-7
"""rad. The search starts no smaller: within a clearance hardly any torque is a long way."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
"""For the integral of torque over the torsion of one interval; its kinks need this many nodes."""


def quasi_static_torsion(coefficients: Coefficients, torque: Values) -> Values:
    """Return the torsion d along a path of slow load with the input locked, from rest.

    Laws at the mesh act unchanged. Dry friction at the output, its level with all of the Stribeck
    excess, holds the mesh torque until the load differs from it by that much, in either direction;
    contacts that bend (`PreslidingFriction`) start unbent, and act as springs across the mesh.
    Where a clearance leaves the torsion free, it is as near to zero as may be or, where a law has
    memory, moves no further than necessary. So it is where the torque falls with the torsion.

    The angle of the locked input is not known: a stiffness and clearances that vary with it are
    taken at their means, which is wrong by up to the depth of the variation and by up to half the
    clearance, and angle-periodic friction as none. The static error is a constant and is left out.
    The test is that of Section 3.

    Parameters
    ----------
    coefficients : Coefficients
        n rows, of which ``stiffness`` and ``laws`` count.
    torque : ndarray, shape (b,)
        Load at the output in the order of the path, which comes from zero, N.m.

    Returns
    -------
    ndarray, shape (n, b)
        rad; not a number where the mesh cannot carry the torque.

    Raises
    ------
    InvalidInput
        For a torque that is not finite or of another shape.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> coefficients = model.coefficients(model.nominal[np.newaxis])
    >>> loop = quasi_static_torsion(coefficients, np.array([0.0, 40.0, 0.0, -40.0, 0.0]))
    >>> print(np.round(np.degrees(loop) * 3600))
    [[   0.  319.    0. -319.    0.]]
    """
    return _by_legs(coefficients, torque, lambda leg: leg.torsion)


def mean_torsion(coefficients: Coefficients, torque: Values) -> Values:
    """Return the mean torsion between consecutive points of the path, the load growing steadily.

    Integration by parts turns the integral of d over T into one of T over d, which averages the
    jump of a clearance and the rest before breakaway exactly, however far apart the points are.

    Parameters, errors and limits are those of `quasi_static_torsion`; b is the number of points.

    Returns
    -------
    ndarray, shape (n, b - 1)
        rad.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> coefficients = model.coefficients(model.nominal[np.newaxis])
    >>> twist = mean_torsion(coefficients, np.array([0.0, 40.0]))
    >>> print(np.round(np.degrees(twist) * 3600))
    [[160.]]
    """
    return _by_legs(coefficients, torque, _means)[:, 1:]


def _means(leg: _Leg) -> Values:
    """Return the mean torsion on the way to each point of a leg, shape (n, m)."""
    half = np.diff(leg.torsion, prepend=leg.before) / 2.0
    low = leg.torsion - 2.0 * half
    inside = (low + half)[..., None] + half[..., None] * _NODES
    carried = leg.mesh.respond(inside.reshape(len(inside), -1), leg.turns).torque
    missing = leg.held[:, None] - carried.reshape(inside.shape)
    area = half * (missing @ _WEIGHTS)
    steady = np.divide(area, leg.steps, out=np.zeros_like(area), where=leg.steps != 0.0)
    return np.asarray(low + steady)


class _PathNeeded(Exception):
    """A law depends on where the torsion was before."""


@dataclass(frozen=True)
class _Mesh:
    """Mesh torque over torsion with the input locked."""

    stiffness: Values
    laws: tuple[Law, ...]

    def respond(self, torsion: Values, turns: Values | None) -> Response:
        """Return the torque at torsions (n, m) that each follow the turning points (n, k).

        Without these a law that depends on the path raises `_PathNeeded`.
        """

        def path(values: Values) -> Values:
            if turns is None:
                raise _PathNeeded
            return np.column_stack([np.repeat(turns, torsion.shape[1], axis=0), values.ravel()])

        def back(values: Values) -> Values:
            return values[:, -1].reshape(torsion.shape)

        still = np.zeros_like(torsion)
        state = PortState(torsion, still, periodic_phase(0.0), self.stiffness, path, back)
        torque, slope = self.stiffness * torsion, self.stiffness + still
        for law in self.laws:
            response = law.respond(state)
            torque, slope = torque + response.torque, slope + response.slope
        return Response(torque, slope)

    def torsion_at(
        self, held: Values, before: Values, turns: Values | None, direction: Values | float
    ) -> Values:
        """Return the first torsions beyond ``before`` (n, 1) that carry the torques (m,).

        The torsion moves in a ``direction``, 1 or -1, perhaps of each row and torque (n, m).
        Newton's method in a bracket; a step that would leave it, as at a kink, halves it instead.
        Without a law the torsion follows the torque.
        """
        if not self.laws:
            return np.asarray(held / self.stiffness)

        def beyond(way: Values) -> tuple[Values, Values]:
            response = self.respond(before + direction * way, turns)
            return direction * (response.torque - held), np.asarray(response.slope)

        low = np.zeros((len(before), len(held)))
        excess_at_rest = beyond(low)[0]
        high = np.maximum(np.abs(excess_at_rest) / self.stiffness, _LEAST_WAY)
        excess, slope = beyond(high)
        for _ in range(_DOUBLINGS):
            short = excess < 0.0
            if not short.any():
                break
            high = np.where(short, 2.0 * high, high)
            excess, slope = beyond(high)
        tolerance = _TOLERANCE * high
        # Within a clearance a torque of zero is carried from the start.
        way, excess = (np.where(excess_at_rest == 0.0, 0.0, values) for values in (high, excess))
        for _ in range(_STEPS):
            low, high = np.where(excess < 0.0, way, low), np.where(excess < 0.0, high, way)
            step = np.divide(excess, slope, out=np.full_like(way, np.inf), where=slope > 0.0)
            inside = (way - step >= low) & (way - step <= high)
            moved = np.where(inside, way - step, (low + high) / 2.0)
            unsettled = np.any(np.abs(moved - way) > tolerance)
            way = moved
            if not unsettled:
                break
            excess, slope = beyond(way)
        return np.where(short, np.nan, before + direction * way)

    def whole(self, steps: Values, held: Values) -> _Leg:
        """Return the path as one leg: of each torque the torsion nearest to zero that carries it.

        Raises `_PathNeeded` where a law depends on more.
        """
        before = np.zeros((len(self.stiffness), 1))
        # A law may make a torque without any torsion.
        at_rest = self.respond(before, None).torque
        torsion = self.torsion_at(held, before, None, np.where(held < at_rest, -1.0, 1.0))
        return _Leg(self, steps, held, torsion, before, None)

    def legs(self, steps: Values, held: Values) -> Iterator[_Leg]:
        """Yield the legs of the path from rest, on each of which the mesh torque moves one way."""
        moves = np.diff(held, prepend=0.0)
        moving = np.flatnonzero(moves)
        # Signs, since the product of two small moves may be zero.
        turning = moving[1:][np.diff(np.sign(moves[moving])) != 0.0]
        before, turns = np.zeros((len(self.stiffness), 1)), np.empty((len(self.stiffness), 0))
        for rows in np.split(np.arange(len(held)), turning):
            direction = 1.0 if moves[rows].sum() >= 0.0 else -1.0
            torsion = self.torsion_at(held[rows], before, turns, direction)
            yield _Leg(self, steps[rows], held[rows], torsion, before, turns)
            before = torsion[:, -1:]
            turns = np.hstack([turns, before])


@dataclass(frozen=True)
class _Leg:
    """Part of the path on which the mesh torque moves one way, or all of it where no way counts.

    ``steps`` of the load (m,), N.m; ``held`` (m,) is the mesh torque, N.m; ``torsion`` (n, m) and
    that ``before`` the leg (n, 1), rad; ``turns`` (n, k) are the torsions at the turning points,
    None where they do not matter.
    """

    mesh: _Mesh
    steps: Values
    held: Values
    torsion: Values
    before: Values
    turns: Values | None


def _by_legs(
    coefficients: Coefficients, torque: Values, of_leg: Callable[[_Leg], Values]
) -> Values:
    """Return what the legs of the path give, side by side."""
    torque = finite_array("torque", torque, (None,))
    locked = [law.with_input_locked() for port, law in coefficients.laws if port == "mesh"]
    at_output = [law for port, law in coefficients.laws if port == "output"]
    # The output turns as far as the mesh is twisted, and its contacts bend as far.
    locked += [law.before_slip for law in at_output]
    mesh_laws = tuple(law for law in locked if law is not None)
    mesh = _Mesh(coefficients.stiffness[:, None], mesh_laws)
    held = _play(torque, sum(law.breakaway for law in at_output if law.before_slip is None))
    steps = np.diff(torque, prepend=0.0)
    try:
        return of_leg(mesh.whole(steps, held))
    except _PathNeeded:
        return np.hstack([*map(of_leg, mesh.legs(steps, held))])


def _play(torque: Values, breakaway: float) -> Values:
    """Return the torque that dry friction transmits to the mesh, from rest."""
    if breakaway == 0.0:
        return torque
    held = np.empty_like(torque)
    current = 0.0
    for sample, load in enumerate(torque):
        held[sample] = current = min(max(current, load - breakaway), load + breakaway)
    return held
