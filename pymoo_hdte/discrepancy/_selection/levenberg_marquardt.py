"""Bounded nonlinear least squares with few unknowns and slow residuals.

The Levenberg-Marquardt method in Moré's scaling (Lecture Notes in Mathematics 630, 1978), whose
damping follows how much of the promised reduction a step brought (Nielsen, IMM report 1999-05,
Technical University of Denmark), and whose linear problem is solved within the bounds (BVLS: Stark
and Parker, Computational Statistics 10, 1995). A parameter at a bound therefore neither shortens a
step nor has to leave its bound first, which a trust region inside the bounds needs many steps for;
and unknowns in which residuals are linear (gains, zeros, levels, parts of lines) are solved for
exactly in every step.

A line is given by amplitude and phase, since its amplitude is bounded, and residuals are close to
linear in its cosine and sine parts. A step therefore leads straight on in the plane of the two:
along a valley in which a phase is hardly determined a step in polar coordinates leaves the valley.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

# Settings of the search: finer ones do not change a result by more than the tolerances.
SETTLED = 0.01
"""Chi-square that a step promises or brings, below which the search has converged."""
SETTLED_SHARE = 1e-7
"""The same relative to chi-square: where a model is far off, its last digits decide nothing."""
_DAMPING = 1e-3
"""First damping relative to the scaled curvature."""
_LEAST_FACTOR, _LEAST_DAMPING = 0.1, 1e-9
"""Strongest reduction of the damping by one step, and its least value."""
_STEPS_A_JACOBIAN = 5
"""Most steps for each time that derivatives could be computed."""
_TRUSTED = 0.5
"""Share of the promised reduction above which derivatives are updated by what the step showed."""
_ATTEMPTS = 12
"""Most dampings tried for one step."""
SAME = 0.1
"""Chi-square, in units of what a residual is beside its noise, up to which minima are the same.

Verdicts differ by 10 and more.
"""

_LITTLE = 0.5
"""Share of what derivatives promised to leave above which those after them promise little more.

Of 48 fits of single effects in 39 simulated campaigns that ended near the noise the least one went
from 69 to 29 times the noise, to 0.42, and both were below what `SearchRules.outdone_share` asks.
"""


class Minimum(NamedTuple):
    """Where a search ended: values (n_unknowns,), residuals (n,), derivatives (n, n_unknowns).

    Derivatives are by unknowns in units of their scale.
    """

    values: Vector
    residuals: Vector
    jacobian: Matrix


class Differentiable(Protocol):
    """Residuals of bounded unknowns, with derivatives.

    Attributes
    ----------
    scale, lower, upper : ndarray, shape (n_unknowns,)
    lines : ndarray of int, shape (n_lines, 2)
        Places of the amplitude and of the phase of each line among the unknowns.
    """

    scale: Vector
    lower: Vector
    upper: Vector
    lines: NDArray[np.int_]

    def residuals(self, values: Vector) -> Vector:
        """Return residuals (n,) at values (n_unknowns,)."""
        ...

    def jacobian(self, values: Vector) -> Matrix:
        """Return derivatives (n, n_unknowns) by unknowns in units of their scale."""
        ...


def minimum(
    problem: Differentiable,
    start: Vector | Minimum,
    steps: int,
    settled: float = SETTLED_SHARE,
    known: Sequence[Minimum] = (),
    hopeless: float = np.inf,
) -> Minimum:
    """Return where the sum of squares is least near a start.

    Parameters
    ----------
    problem : Differentiable
    start : ndarray, shape (n_unknowns,), or Minimum
        Moved to the nearest bound where it is outside. With a minimum its derivatives serve for the
        first step: another search of the same problem found them, there or, `turned`, elsewhere.
    steps : int
        Most steps with derivatives of their own; several times as many if derivatives are updated.
    settled : float
        Share of the sum of squares that a step has to remove for the search to go on.
    known : sequence of Minimum
        Found from other starts: a search that arrives at one of them ends there.
    hopeless : float
        Sum of squares: a search ends where derivatives promise to leave more than that, twice in a
        row, and hardly less the second time.

    Returns
    -------
    Minimum
    """
    fresh = not isinstance(start, Minimum)
    begin = start.values if isinstance(start, Minimum) else start
    values = np.clip(begin, problem.lower, problem.upper)
    # Those of an earlier search may rest on a way to steady states that this one does not go.
    residuals = problem.residuals(values)
    jacobian = start.jacobian if isinstance(start, Minimum) else problem.jacobian(values)
    size, damping, confirming = np.zeros(len(values)), _DAMPING, False
    promised, seen = list[float](), None
    for step in range(_STEPS_A_JACOBIAN * steps):
        # Not at the start: a part of a law that has vanished shows nothing of its other unknowns.
        if step and any(_arrived(problem, values, residuals, jacobian, end) for end in known):
            break
        if hopeless < np.inf and fresh and jacobian is not seen:
            promised, seen = [*promised, _least_to_first_order(residuals, jacobian)], jacobian
            if is_hopeless(promised, hopeless):
                break
        size = np.maximum(size, np.linalg.norm(jacobian, axis=0))
        trial = _step(problem, values, residuals, jacobian, size, damping)
        before = residuals @ residuals
        slow = trial is None or before - trial.residuals @ trial.residuals <= (
            SETTLED + settled * before
        )
        if trial is not None:
            if not slow and trial.share > _TRUSTED:
                jacobian, fresh = _updated(problem, values, residuals, jacobian, trial), False
            elif not (slow and fresh and confirming):
                jacobian, fresh = problem.jacobian(trial.values), True
            values, residuals, damping = trial.values, trial.residuals, trial.damping
        elif not fresh:
            jacobian, fresh = problem.jacobian(values), True
            continue
        if not slow:
            confirming = False
        elif confirming:
            break
        else:
            # A damped step along a flat valley is short, and brings little far from the minimum.
            size, damping, confirming = np.zeros(len(values)), _LEAST_DAMPING, True
    return Minimum(values, residuals, jacobian)


def way(problem: Differentiable, values: Vector, to: Vector) -> Vector:
    """Return the step (n_unknowns,) that leads from values to others, in units of their scale.

    Of a line it is the straight one in the plane of its parts: along it as it is at ``values``, and
    across it, divided by its amplitude there. From no amplitude there is no way across.
    """
    amplitude, phase = problem.lines.T
    step, turn = to - values, to[phase] - values[phase]
    step[amplitude] = to[amplitude] * np.cos(turn) - values[amplitude]
    step[phase] = to[amplitude] * np.sin(turn) / _not_zero(values[amplitude])
    return np.asarray(step / problem.scale)


def moved(problem: Differentiable, values: Vector, step: Vector) -> Vector:
    """Return values (n_unknowns,) to which a step leads, as of `way`, moved to their bounds."""
    to, (amplitude, phase) = values + step * problem.scale, problem.lines.T
    along, across = to[amplitude], values[amplitude] * (to[phase] - values[phase])
    to[amplitude] = np.hypot(along, across)
    to[phase] = values[phase] + np.arctan2(across, along)
    return np.clip(to, problem.lower, problem.upper)


def turned(problem: Differentiable, values: Vector, to: Vector, jacobian: Matrix) -> Matrix:
    """Return derivatives (n, n_unknowns) at ``to`` of what has those given at ``values``.

    For residuals that are linear in the parts of lines and in all other unknowns.
    """
    (amplitude, phase), turned_jacobian = problem.lines.T, jacobian.copy()
    turn = to[phase] - values[phase]
    along = jacobian[:, amplitude] / problem.scale[amplitude]
    across = jacobian[:, phase] / problem.scale[phase] / _not_zero(values[amplitude])
    turned_jacobian[:, amplitude] = (np.cos(turn) * along + np.sin(turn) * across) * problem.scale[
        amplitude
    ]
    turned_jacobian[:, phase] = (np.cos(turn) * across - np.sin(turn) * along) * problem.scale[
        phase
    ]
    turned_jacobian[:, phase] *= to[amplitude]
    return turned_jacobian


def _not_zero(amplitudes: Vector) -> Vector:
    # Across a line of no amplitude steps and derivatives are zero, whatever they are divided by.
    return np.where(amplitudes == 0.0, 1.0, amplitudes)


def _updated(
    problem: Differentiable, values: Vector, residuals: Vector, jacobian: Matrix, trial: _Step
) -> Matrix:
    """Return derivatives where a step has ended, from those at values and what the step showed.

    Broyden's update (Mathematics of Computation 19, 1965), of those at values, then turned.
    """
    step = way(problem, values, trial.values)
    error = trial.residuals - residuals - jacobian @ step
    shown = jacobian + np.outer(error, step / (step @ step))
    return turned(problem, values, trial.values, shown)


def _arrived(
    problem: Differentiable, values: Vector, residuals: Vector, jacobian: Matrix, at: Minimum
) -> bool:
    """Tell whether values are at a known minimum as far as residuals show it, and no better."""
    changes = (
        at.jacobian @ way(problem, at.values, values),
        jacobian @ way(problem, values, at.values),
    )
    better = residuals @ residuals < at.residuals @ at.residuals
    limit = SAME * max(float(residuals @ residuals) / len(residuals), 1.0)
    return not better and all(change @ change <= limit for change in changes)


def _least_to_first_order(residuals: Vector, jacobian: Matrix) -> float:
    """Return the sum of squares that derivatives promise to leave, whatever the bounds."""
    along = np.linalg.qr(jacobian)[0].T @ residuals
    return float(residuals @ residuals - along @ along)


def is_hopeless(promised: Sequence[float], hopeless: float) -> bool:
    """Tell whether the last two derivatives promise to leave too much, the second hardly less."""
    twice = len(promised) > 1 and min(promised[-2:]) > hopeless
    return twice and promised[-1] > _LITTLE * promised[-2]


class _Step(NamedTuple):
    """Where a step ends: values, residuals, the next damping, and the share of what it promised."""

    values: Vector
    residuals: Vector
    damping: float
    share: float


def _step(
    problem: Differentiable,
    values: Vector,
    residuals: Vector,
    jacobian: Matrix,
    size: Vector,
    damping: float,
) -> _Step | None:
    """Return the next step; None if none reduces the sum of squares by what counts."""
    orthonormal, triangle = np.linalg.qr(jacobian)
    along, before = orthonormal.T @ residuals, residuals @ residuals
    size = np.maximum(size, 1e-12)
    # Values at a bound may exceed it by rounding.
    lower = np.minimum((problem.lower - values) / problem.scale, 0.0) - 1e-14
    upper = np.maximum((problem.upper - values) / problem.scale, 0.0) + 1e-14
    right = np.concatenate([-along, np.zeros(len(size))])
    growth = 2.0
    for _ in range(_ATTEMPTS):
        matrix = np.vstack([triangle, np.diag(np.sqrt(damping) * size)])
        step = lsq_linear(matrix, right, (lower, upper), method="bvls").x
        promised = along @ along - np.sum((along + triangle @ step) ** 2)
        if promised <= SETTLED / 10.0:
            return None
        to = moved(problem, values, step)
        residuals_there = problem.residuals(to)
        gain = before - residuals_there @ residuals_there
        if gain > 0.0:
            share = float(gain / promised)
            factor = max(1.0 - (2.0 * share - 1.0) ** 3, _LEAST_FACTOR)
            return _Step(to, residuals_there, max(factor * damping, _LEAST_DAMPING), share)
        growth *= 2.0
        damping *= growth
    return None
