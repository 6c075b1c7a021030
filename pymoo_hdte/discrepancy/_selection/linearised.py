"""A fit as the hypothesis that its effects and released values are what is missing.

What is assumed beforehand of each unknown follows from how the fit states it. Bounds of the base
are tolerances; a stated deviation is Gaussian; a number of an effect whose range holds zero is a
size, any other one a shape. Shapes that may be several times smaller or larger are known by their
logarithm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.score import Free, Linearised, Member, Sized, Vector
from pymoo_hdte.effects.unknowns import Parameter

SHOULDER = 0.1
"""Standard deviation of a tolerance's shoulder, as a share of the tolerance: who states 10 % does
not mean that 11 % is impossible."""
LEAST_ERROR, MOST_ERROR = 1e-3, 0.3
"""Range of the relative error of a law's form. The lower end is the accuracy of the models; beyond
the upper end it is another law."""
_LEAST_SHARE = 1e-3
"""Least of a size that may vanish, as a share of its largest, unless the data tell that from
nothing. Any other size of a law has to be visible: a law without it has another name."""
_NO_NOISE = 0.03
"""Size at which a change is nothing, in standard deviations of the noise: a hundred of them change
no logarithm of odds by 0.1."""
_BY_LOGARITHM = 5.0
"""Ratio of a shape's bounds from which on it is known by its logarithm."""

Modulations = Callable[[Candidate, slice], Sequence[NDArray[np.float64]]]
"""From a candidate and the places of its unknowns to changes of the residuals by a relative error
of its law, parts of (n, m), as a Gaussian process over its arguments with a standard deviation of
1."""


def linearise(
    fitted: Fit,
    channels: NDArray[np.int_],
    errors: Modulations,
    noise: float = float(np.log(2.0)),
    shares: Vector | None = None,
) -> Linearised:
    """Return a fit as a linearised hypothesis.

    Parameters
    ----------
    fitted : Fit
    channels : ndarray of int, shape (n,)
        Channel of each residual of the data. Those of priors come after them.
    errors : callable
        Relative errors of the laws: see `Modulations`.
    noise, shares
        As of `Linearised`.
    """
    n, columns = len(channels), fitted.jacobian[: len(channels)]
    released = {candidate.releases for candidate in fitted.candidates} - {None}
    base = range(fitted.n_base)
    bounded = [k for k in base if fitted.parameters[k].name not in released]
    priors = [_prior(fitted.parameters[k], float(fitted.values[k])) for k in bounded]
    free, sized = [columns[:, k] for k in bounded], list[Sized]()
    for k in base:
        if (parameter := fitted.parameters[k]).name in released:
            sized.append(_released(parameter, float(fitted.values[k]), columns[:, [k]]))
    members = list[Member]()
    for candidate, place in fitted.places:
        begin = len(free), len(sized)
        for rows in _groups(candidate.parameters):
            parameters = [candidate.parameters[row] for row in rows]
            at = [place.start + row for row in rows]
            if _is_size(parameters[0]):
                sized.append(_size(candidate, parameters, columns[:, at], fitted.values[at]))
            elif _is_ratio(parameters[0]):
                sized.append(_ratio(candidate, parameters[0], columns[:, at], fitted.values[at]))
            else:
                (k,) = at
                prior, unit = _shape(parameters[0], float(fitted.values[k]))
                priors.append(prior)
                free.append(columns[:, k] * unit)
        most = LEAST_ERROR if candidate.exact else MOST_ERROR
        changes = np.column_stack([np.empty((n, 0)), *errors(candidate, place)])
        changes = _that_matter(changes, most)
        if changes.size:
            none, name = np.zeros(changes.shape[1]), f"form of {candidate.label}"
            wide = not candidate.exact
            sized.append(Sized(name, changes, LEAST_ERROR, most, none, none > 0.0, of_form=wide))
        members.append(Member(slice(begin[0], len(free)), slice(begin[1], len(sized))))
    of_free = np.column_stack(free) if free else np.empty((n, 0))
    stated = np.array(priors).reshape(-1, 5).T
    return Linearised(
        fitted.residuals[:n],
        channels,
        Free(of_free, *stated),
        tuple(sized),
        noise,
        shares,
        members=tuple(members),
    )


def _that_matter(changes: NDArray[np.float64], most: float) -> NDArray[np.float64]:
    """Return the directions of normal changes (n, k) that a scale makes as large as the noise.

    Independent changes of one scale may be turned at will: (n, m), the largest last.
    """
    values, vectors = np.linalg.eigh(changes.T @ changes)
    return np.asarray(changes @ vectors[:, values * most**2 > _NO_NOISE**2])


def modulated(
    candidate: Candidate,
    values: Vector,
    columns: NDArray[np.float64],
    process: NDArray[np.float64],
) -> list[NDArray[np.float64]]:
    """Return what a candidate does if each of its sizes errs by a process, parts of (n, k).

    Parameters
    ----------
    candidate : Candidate
    values : ndarray, shape (m,)
        Of its unknowns.
    columns : ndarray, shape (n, m)
        Change of the residuals by each of them.
    process : ndarray, shape (n, k)
        Relative error of each residual.
    """
    return [
        process * (columns[:, [row]] * amplitude)
        for rows, amplitude in _amplitudes(candidate, values)
        for row in rows
    ]


def _amplitudes(candidate: Candidate, values: Vector) -> list[tuple[list[int], float]]:
    """Return the places of each size of a candidate, and its fitted amplitude in its scales.

    Parts of a line share their amplitude. A factor counts by how far it is from 1.
    """
    found = []
    for rows in _groups(candidate.parameters):
        if _is_ratio(first := candidate.parameters[rows[0]]):
            value = float(values[rows[0]])
            found.append((rows, value / first.scale * abs(float(np.log(value)))))
        elif _is_size(first):
            scales = np.array([candidate.parameters[row].scale for row in rows])
            found.append((rows, float(np.linalg.norm(values[rows] / scales))))
    return found


def _groups(parameters: Sequence[Parameter]) -> list[list[int]]:
    """Return the places of unknowns that share a size: both parts of a line, else one by one."""
    groups, k = list[list[int]](), 0
    while k < len(parameters):
        width = 2 if parameters[k].begins_line else 1
        groups.append(list(range(k, k + width)))
        k += width
    return groups


def _is_size(parameter: Parameter) -> bool:
    return parameter.lower <= 0.0 <= parameter.upper


def _is_ratio(parameter: Parameter) -> bool:
    """Tell whether it is a factor, with which nothing changes at 1."""
    return parameter.lower > 0.0 and abs(parameter.lower * parameter.upper - 1.0) < 1e-9


def _ratio(
    candidate: Candidate, parameter: Parameter, column: NDArray[np.float64], value: Vector
) -> Sized:
    """Return a factor as a size by its logarithm."""
    return Sized(
        f"{candidate.label} {parameter.name}",
        column * value / parameter.scale,
        0.0,
        float(np.log(parameter.upper)),
        np.log(value),
        np.array([False]),
        True,
    )


def _size(
    candidate: Candidate,
    parameters: Sequence[Parameter],
    columns: NDArray[np.float64],
    values: Vector,
) -> Sized:
    scale, may_vanish = parameters[0].scale, parameters[0].may_vanish
    most = max(abs(parameters[0].lower), parameters[0].upper) / scale
    nothing = _NO_NOISE / max(float(np.linalg.norm(columns, axis=0).max()), _NO_NOISE / most)
    return Sized(
        f"{candidate.label} {parameters[0].name}",
        columns,
        min(_LEAST_SHARE * most, nothing) if may_vanish else 0.0,
        most,
        values / scale,
        np.array([parameter.lower >= 0.0 for parameter in parameters]),
        not may_vanish,
        of_effect=True,
    )


def _released(parameter: Parameter, value: float, column: NDArray[np.float64]) -> Sized:
    """Return a base parameter as out of tolerance by its logarithm: by that much at least.

    Its sign is known, so that no linear model may change it.
    """
    start = parameter.start
    bounds = np.log(np.abs([parameter.lower, parameter.upper]) / abs(start))
    return Sized(
        f"parameter:{parameter.name}",
        column * value / parameter.scale,
        float(np.log1p(parameter.scale / abs(start))),
        float(np.abs(bounds).max()),
        np.array([np.log(value / start)]),
        np.array([False]),
        True,
    )


_Prior = tuple[float, float, float, float, float]
"""Lower and upper bound, shoulder, mean and deviation, as of `Free`."""


def _prior(parameter: Parameter, value: float) -> _Prior:
    scale = parameter.scale
    if np.isfinite(parameter.prior):
        return -np.inf, np.inf, 1.0, (parameter.start - value) / scale, parameter.prior / scale
    lower, upper = ((bound - value) / scale for bound in (parameter.lower, parameter.upper))
    return lower, upper, SHOULDER * (upper - lower) / 2.0, 0.0, np.inf


def _shape(parameter: Parameter, value: float) -> tuple[_Prior, float]:
    """Return the prior of a shape, and its unit in those of its scale."""
    if parameter.lower > 0.0 and parameter.upper > _BY_LOGARITHM * parameter.lower:
        lower, upper = (np.log(bound / value) for bound in (parameter.lower, parameter.upper))
        unit = value / parameter.scale
    else:
        unit = 1.0
        lower, upper = (
            (bound - value) / parameter.scale for bound in (parameter.lower, parameter.upper)
        )
    return (lower, upper, SHOULDER * (upper - lower) / 2.0, 0.0, np.inf), unit
