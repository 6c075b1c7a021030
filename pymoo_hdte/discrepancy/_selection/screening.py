"""Screening: which candidates could explain a misfit, by comparing their signatures with it.

The signature of a candidate is the change of the residuals by a typical strength of it. The part
that base parameters can imitate is projected out. The misfit along the remainder is what the
candidate could remove, to first order, with a free strength. Strongly nonlinear effects deviate
from this: several strengths are tried, and the best candidates are fitted without linearisation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit
from pymoo_hdte.effects.unknowns import HARMONIC_NAMES

_NONE = np.empty((0, 0))
"""Stands for no signatures, and for no moves."""
_RANK = 1e-5
"""Share of the largest singular value above which a direction counts."""


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate, what it could remove of chi-square, and where to start its fit.

    Attributes
    ----------
    candidate : Candidate
    reduction : float
        Reduction of the whole chi-square, to first order.
    start : tuple of float
        Values from which to fit it.
    by_part : tuple of float
        Reduction in each part of the data alone, with parameters at bounds held there; empty for a
        parameter out of tolerance.
    signatures : ndarray, shape (n_starts, n_residuals)
        Change of the residuals by each of its starts; empty for a parameter out of tolerance.
    """

    candidate: Candidate
    reduction: float
    start: tuple[float, ...]
    by_part: tuple[float, ...] = ()
    signatures: NDArray[np.float64] = field(default_factory=lambda: _NONE)


def screen(data: Evidence, fitted: Fit, candidates: Sequence[Candidate]) -> list[Screened]:
    """Return all candidates as screened, by falling reduction.

    Beside effects, parameters that ended at a bound may move inward: the gain of a sensor goes to
    its bound if an effect is missing, and comes back with the effect. Without effects they stay at
    their bounds, so that noise alone removes no more than `Rules.single_effect_gain`.

    Parameters
    ----------
    data : Evidence
    fitted : Fit
        Present model, perhaps with effects, whose misfit is to be explained.
    candidates : sequence of Candidate
    """
    orthonormal, residual = beyond_parameters(fitted)
    response, parts = data.response(fitted), data.rows_of_parts()
    inward = _inward(fitted, orthonormal) if fitted.candidates else _NONE
    screened = []
    for candidate in candidates:
        if candidate.releases is not None:
            screened.append(_released(candidate, fitted, orthonormal, residual))
            continue
        signatures = np.array([response(candidate.build(start)) for start in candidate.starts])
        screened.append(_screened(candidate, signatures, orthonormal, residual, parts, inward))
    return sorted(screened, key=lambda effect: -effect.reduction)


def varied(screened: Sequence[Screened], most: int) -> list[Screened]:
    """Return at most the ``most`` best candidates of each name."""
    names = [effect.candidate.name for effect in screened]
    return [effect for k, effect in enumerate(screened) if names[:k].count(names[k]) < most]


def beyond_parameters(fitted: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return an orthonormal basis of the parameters' changes (n, k), and what they leave (n,)."""
    # A parameter at its bound cannot move beyond it.
    orthonormal, _ = np.linalg.qr(fitted.jacobian[:, fitted.bound_sides == 0.0])
    return orthonormal, fitted.residuals - orthonormal @ (orthonormal.T @ fitted.residuals)


def _inward(fitted: Fit, orthonormal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the changes by parameters that leave their bounds, beyond the others, shape (k, n)."""
    bounded = fitted.bound_sides != 0.0
    moves = -(fitted.jacobian[:, bounded] * fitted.bound_sides[bounded])
    return np.asarray((moves - orthonormal @ (orthonormal.T @ moves)).T)


def _screened(
    candidate: Candidate,
    signatures: NDArray[np.float64],
    orthonormal: NDArray[np.float64],
    residual: NDArray[np.float64],
    parts: Sequence[NDArray[np.int_]],
    inward: NDArray[np.float64],
) -> Screened:
    """Return what a candidate could remove in total and in each part."""
    beyond = signatures - (signatures @ orthonormal) @ orthonormal.T
    by_part = tuple(
        _best_start(candidate, beyond[:, rows], residual[rows], _NONE).reduction for rows in parts
    )
    best = _best_start(candidate, beyond, residual, inward)
    return replace(best, by_part=by_part, signatures=signatures)


def _released(
    candidate: Candidate,
    fitted: Fit,
    orthonormal: NDArray[np.float64],
    residual: NDArray[np.float64],
) -> Screened:
    """Return the reduction by a parameter at its bound if it could move beyond it."""
    place = [parameter.name for parameter in fitted.parameters].index(str(candidate.releases))
    signature = fitted.jacobian[:, place] * fitted.bound_sides[place]
    signature = signature - orthonormal @ (orthonormal.T @ signature)
    along, size = float(-signature @ residual), float(signature @ signature)
    return Screened(candidate, along**2 / size if along > 0.0 and size > 0.0 else 0.0, ())


def _best_start(
    candidate: Candidate,
    signatures: NDArray[np.float64],
    residual: NDArray[np.float64],
    inward: NDArray[np.float64],
) -> Screened:
    """Return the largest reduction by a candidate, with the values that give it as start."""
    starts = np.array(candidate.starts)
    lower = np.array([parameter.lower for parameter in candidate.parameters])
    upper = np.array([parameter.upper for parameter in candidate.parameters])
    if candidate.linear:
        strengths, reduction = _least_squares(signatures, residual, inward)
        best = strengths @ starts
        harmonic = [
            parameter.name.startswith(HARMONIC_NAMES[1:]) for parameter in candidate.parameters
        ]
        lines = np.hypot(*best[harmonic].reshape(-1, 2).T)
        if lines.size and lines.max() > np.hypot(*best[:2]):
            # A line that is weaker than its harmonic is not the fundamental of that harmonic.
            fundamental = np.flatnonzero(~np.array(harmonic))
            strengths, reduction = _least_squares(signatures[fundamental], residual, inward)
            best = strengths @ starts[fundamental]
    else:
        # The first parameter is the strength; the others are shapes.
        positive = bool(lower[0] >= 0.0)
        strengths, gains = _one_by_one(signatures, residual, inward, positive)
        place = int(np.argmax(gains))
        reduction, best = float(gains[place]), starts[place].copy()
        best[0] *= np.clip(strengths[place], 0.2, 10.0) if positive else strengths[place]
    return Screened(candidate, reduction, tuple(np.clip(best, lower, upper).tolist()))


def _one_by_one(
    signatures: NDArray[np.float64],
    residual: NDArray[np.float64],
    inward: NDArray[np.float64],
    positive: bool,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the strength of each signature (k, n) alone, and its reduction, both (k,)."""
    if len(inward):
        solutions = [
            _least_squares(signature[None], residual, inward, positive) for signature in signatures
        ]
        gains = np.array([gain for _, gain in solutions])
        return np.array([strength for (strength,), _ in solutions]), gains
    sizes = np.einsum("ij,ij->i", signatures, signatures)
    along = -signatures @ residual
    strengths = np.divide(along, sizes, out=np.zeros_like(along), where=sizes > 1e-12)
    return strengths, np.where((strengths > 0.0) | (not positive), along * strengths, 0.0)


def _least_squares(
    signatures: NDArray[np.float64],
    residual: NDArray[np.float64],
    inward: NDArray[np.float64],
    positive: bool = False,
) -> tuple[NDArray[np.float64], float]:
    """Return the strengths of signatures (k, n) with the largest reduction, and that reduction.

    Strengths of moves ``inward`` (m, n) cannot be negative, nor can those of signatures if
    ``positive``.
    """
    moves, columns = len(inward), signatures.T
    if moves:
        columns = np.concatenate([inward, signatures]).T
        sizes = np.maximum(np.linalg.norm(columns, axis=0), 1e-9)
        orthonormal, triangle = np.linalg.qr(columns / sizes)
        least = np.full(len(sizes), 0.0 if positive else -np.inf)
        least[:moves] = 0.0
        strengths = (
            lsq_linear(triangle, -orthonormal.T @ residual, (least, np.inf), "bvls").x / sizes
        )
    else:
        strengths, *_ = np.linalg.lstsq(columns, -residual, rcond=1e-10)
    unexplained = residual + columns @ strengths
    return strengths[moves:], float(residual @ residual - unexplained @ unexplained)


def basis_of(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an orthonormal basis (n, k) of columns (n, m), which may be dependent."""
    sizes = np.linalg.norm(columns, axis=0)
    nonzero = sizes > 0.0
    vectors, values, _ = np.linalg.svd(columns[:, nonzero] / sizes[nonzero], full_matrices=False)
    return np.asarray(vectors[:, values > _RANK * values.max(initial=0.0)])
