"""Bounded nonlinear least squares with few unknowns and slow residuals.

The Levenberg-Marquardt method in Moré's scaling (Lecture Notes in Mathematics 630, 1978), whose
damping follows how much of the promised reduction a step brought (Nielsen, IMM report 1999-05,
Technical University of Denmark), and whose linear problem is solved within the bounds (BVLS: Stark
and Parker, Computational Statistics 10, 1995). A parameter at a bound therefore does not shorten a
step, and need not leave its bound first, which takes a trust region inside the bounds many steps.
Unknowns in which residuals are linear (gains, zeros, levels, parts of lines) are solved for exactly
in every step.

A line is given by amplitude and phase, since its amplitude is bounded, but residuals are close to
linear in its cosine and sine parts. A step is therefore straight in the plane of these parts. In
polar coordinates it would leave a valley in which the phase is hardly determined.
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
"""Predicted or actual reduction of chi-square by a step below which the search has converged."""
SETTLED_SHARE = 1e-7
"""The same relative to chi-square: if a model is far off, the last digits decide nothing."""
_DAMPING = 1e-3
"""First damping relative to the scaled curvature."""
_LEAST_FACTOR, _LEAST_DAMPING = 0.1, 1e-9
"""Strongest reduction of the damping by one step, and its least value."""
_STEPS_A_JACOBIAN = 5
"""Most steps for each computation of derivatives that is allowed."""
_TRUSTED = 0.5
"""Share of the predicted reduction above which derivatives are updated from the step itself."""
_ATTEMPTS = 12
"""Most dampings tried for one step."""
SAME = 0.1
"""Difference of chi-square, in units of a fit's misfit, up to which two minima are the same.

Verdicts depend on differences of 10 and more.
"""

_LITTLE = 0.5
"""Ratio of two successive predictions of what is left above which a search hardly improves.

The least ratio of 48 fits that ended near the noise was 0.42, from 69 to 29 times the noise; both
are below what `SearchRules.outdone_share` asks.
"""


class Minimum(NamedTuple):
    """End of a search: values (n_unknowns,), residuals (n,), derivatives (n, n_unknowns).

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
        Values outside the bounds are moved to them. Derivatives of a minimum, of another search of
        the same problem, serve for the first step.
    steps : int
        Most steps with computed derivatives; with updated ones several times as many are allowed.
    settled : float
        Share of the sum of squares that a step has to remove for the search to go on.
    known : sequence of Minimum
        Minima from other starts; a search that arrives at one of them ends there.
    hopeless : float
        Sum of squares. A search ends if derivatives predict to leave more twice in a row, and
        hardly less the second time.

    Returns
    -------
    Minimum
    """
    fresh = not isinstance(start, Minimum)
    begin = start.values if isinstance(start, Minimum) else start
    values = np.clip(begin, problem.lower, problem.upper)
    # Residuals of an earlier search may depend on a path to steady states that this one never took.
    residuals = problem.residuals(values)
    jacobian = start.jacobian if isinstance(start, Minimum) else problem.jacobian(values)
    size, damping, confirming = np.zeros(len(values)), _DAMPING, False
    promised, seen = list[float](), None
    for step in range(_STEPS_A_JACOBIAN * steps):
        # Not at the start: a part of a law that has vanished says nothing about its other unknowns.
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
            # A damped step along a flat valley is short and gains little even far from the minimum.
            size, damping, confirming = np.zeros(len(values)), _LEAST_DAMPING, True
    return Minimum(values, residuals, jacobian)


def way(problem: Differentiable, values: Vector, to: Vector) -> Vector:
    """Return the step (n_unknowns,) that leads from ``values`` to ``to``, in units of the scale.

    For a line it is straight in the plane of its parts: along the line at ``values``, and across it
    divided by the amplitude there. At zero amplitude there is no step across.
    """
    amplitude, phase = problem.lines.T
    step, turn = to - values, to[phase] - values[phase]
    step[amplitude] = to[amplitude] * np.cos(turn) - values[amplitude]
    step[phase] = to[amplitude] * np.sin(turn) / _not_zero(values[amplitude])
    return np.asarray(step / problem.scale)


def moved(problem: Differentiable, values: Vector, step: Vector) -> Vector:
    """Return the values (n_unknowns,) to which a step as of `way` leads, within their bounds."""
    to, (amplitude, phase) = values + step * problem.scale, problem.lines.T
    along, across = to[amplitude], values[amplitude] * (to[phase] - values[phase])
    to[amplitude] = np.hypot(along, across)
    to[phase] = values[phase] + np.arctan2(across, along)
    return np.clip(to, problem.lower, problem.upper)


def turned(problem: Differentiable, values: Vector, to: Vector, jacobian: Matrix) -> Matrix:
    """Return derivatives (n, n_unknowns) at ``to`` from those at ``values``.

    Residuals are taken as linear in the parts of lines and in all other unknowns.
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
    """Return derivatives at the end of a step, from those at its start and the change of residuals.

    This is Broyden's update (Mathematics of Computation 19, 1965), `turned` afterwards.
    """
    step = way(problem, values, trial.values)
    error = trial.residuals - residuals - jacobian @ step
    shown = jacobian + np.outer(error, step / (step @ step))
    return turned(problem, values, trial.values, shown)


def _arrived(
    problem: Differentiable, values: Vector, residuals: Vector, jacobian: Matrix, at: Minimum
) -> bool:
    """Tell whether values are at a known minimum, as far as residuals show, and no better."""
    changes = (
        at.jacobian @ way(problem, at.values, values),
        jacobian @ way(problem, values, at.values),
    )
    better = residuals @ residuals < at.residuals @ at.residuals
    limit = SAME * max(float(residuals @ residuals) / len(residuals), 1.0)
    return not better and all(change @ change <= limit for change in changes)


def _least_to_first_order(residuals: Vector, jacobian: Matrix) -> float:
    """Return the sum of squares that derivatives predict to leave, whatever the bounds."""
    along = np.linalg.qr(jacobian)[0].T @ residuals
    return float(residuals @ residuals - along @ along)


def is_hopeless(promised: Sequence[float], hopeless: float) -> bool:
    """Tell whether the last two predictions leave too much, and the second hardly less."""
    twice = len(promised) > 1 and min(promised[-2:]) > hopeless
    return twice and promised[-1] > _LITTLE * promised[-2]


class _Step(NamedTuple):
    """End of a step: values, residuals, next damping, and share of the predicted reduction."""

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
    """Return the next step; None if no damping reduces the sum of squares noticeably."""
    if not values.size:  # lsq_linear of older versions of SciPy refuses it.
        return None
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
