"""Bounded least squares of a campaign: base parameters jointly with those of effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate, Layout
from pymoo_hdte.discrepancy._selection.levenberg_marquardt import SETTLED_SHARE, Minimum, minimum
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.effects.unknowns import Parameter

Vector = NDArray[np.float64]
Response = Callable[[Sequence[Any]], Vector]
"""From effects that are added to a fit to the change of its whitened residuals, shape (n,)."""
# Settings of the search; its largest number of steps is in `Rules`.
_STEP = 1e-3
"""Step of difference quotients, in units of a parameter's scale."""
_FREED = 10.0
"""Factor by which a base parameter without tolerance may deviate."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model with its fitted values.

    Attributes
    ----------
    candidates : tuple of Candidate
    parameters : tuple of Parameter
        Base first, then those of the candidates.
    values : ndarray, shape (n_parameters,)
    residuals, jacobian : ndarray, shape (n_residuals,) and (n_residuals, n_parameters)
        Whitened: of running records, of sweeps, of priors; by parameters in units of their scale.
    """

    candidates: tuple[Candidate, ...]
    parameters: tuple[Parameter, ...]
    values: Vector
    residuals: Vector
    jacobian: NDArray[np.float64]

    @property
    def chi_square(self) -> float:
        """Sum of squares of all residuals."""
        return float(self.residuals @ self.residuals)

    @property
    def misfit(self) -> float:
        """Chi-square per degree of freedom, 1 at least: what a residual is beside its noise."""
        return max(self.chi_square / max(len(self.residuals) - len(self.values), 1), 1.0)

    @property
    def minimum(self) -> Minimum:
        """Where the search ended."""
        return Minimum(self.values, self.residuals, self.jacobian)

    @property
    def effects(self) -> tuple[Any, ...]:
        """The fitted effects."""
        return tuple(effect for parts in self.effects_by_candidate for effect in parts)

    @property
    def effects_by_candidate(self) -> tuple[tuple[Any, ...], ...]:
        """The fitted effects of each candidate."""
        return built(self.candidates, self.values[self.n_base :])

    @property
    def n_base(self) -> int:
        """Number of parameters of the base."""
        return len(self.values) - count(self.candidates)

    @property
    def places(self) -> list[tuple[Candidate, slice]]:
        """Each candidate with the places of its unknowns among the values."""
        return places(self.candidates, self.n_base)

    @cached_property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the parameters that ended at a bound."""
        return tuple(
            parameter.name
            for parameter, side in zip(self.parameters, self.bound_sides, strict=True)
            if side != 0.0
        )

    @cached_property
    def bound_sides(self) -> Vector:
        """-1 for parameters at their lower bound, 1 at the upper one, 0 elsewhere; shape (n,)."""
        layout = Layout(self.parameters)
        margin = 1e-3 * layout.array("scale")
        above = self.values >= layout.array("upper") - margin
        below = self.values <= layout.array("lower") + margin
        return above.astype(float) - below.astype(float)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of the values, from the curvature at the optimum and the bounds; shape (n, n).

        A residual beyond the noise counts as noise (Birge, Physical Review 40, 1932), so that an
        approximate form does not get intervals that are too narrow. The bounds count as the
        variance of a uniform distribution between them, which is that of a value that no record
        determines.
        """
        curvature = self.jacobian.T @ self.jacobian / self.misfit
        scale = Layout(self.parameters).array("scale")
        within = np.diag(12.0 / self._widths**2)
        return np.linalg.inv(curvature + within) * np.outer(scale, scale)

    @property
    def evidence(self) -> float:
        """Minus twice the logarithm of the model's probability, by Laplace's approximation.

        Chi-square and, for each parameter, a term for how much the data narrowed its range (MacKay,
        Neural Computation 4, 1992): a value that no record determines costs nothing. A number that
        no fit follows, as the time of a change, is one of as many as were tried.
        """
        information = self.jacobian.T @ self.jacobian * np.outer(self._widths, self._widths) / 12.0
        _, narrowed = np.linalg.slogdet(information + np.eye(len(information)))
        tried = sum(np.log(candidate.among) for candidate in self.candidates)
        return self.chi_square + float(narrowed + 2.0 * tried)

    @property
    def _widths(self) -> Vector:
        layout = Layout(self.parameters)
        return np.asarray((layout.array("upper") - layout.array("lower")) / layout.array("scale"))


def fit(
    data: Evidence,
    candidates: Sequence[Candidate] = (),
    start: Vector | Fit | None = None,
    steps: int | None = None,
    settled: float = SETTLED_SHARE,
    known: Sequence[Fit] = (),
    hopeless: float = np.inf,
) -> Fit:
    """Fit base parameters and those of candidates from ``start`` (by default their own starts).

    An earlier fit of the same candidates to the same data may be the start, with its values or with
    others: its derivatives serve for the first step. The search takes at most ``steps`` steps, by
    default as many as the rules allow, and ends earlier where one removes less than the share
    ``settled`` of chi-square, where it arrives at a ``known`` fit of the same candidates, or where
    it will leave more than a ``hopeless`` chi-square.
    """
    objective = data.objective(candidates)
    most = data.rules.fit_evaluations if steps is None else steps
    start = objective.start if start is None else start
    begin = start.minimum if isinstance(start, Fit) else start
    ends = [fitted.minimum for fitted in known]
    end = minimum(objective, begin, most, settled, ends, hopeless)
    return Fit(objective.candidates, objective.parameters, *end)


class Residuals(Protocol):
    """Whitened residuals of a model with candidates, and their derivatives."""

    candidates: tuple[Candidate, ...]
    parameters: tuple[Parameter, ...]
    scale: Vector
    start: Vector
    lower: Vector
    upper: Vector
    lines: NDArray[np.int_]

    def residuals(self, values: Vector) -> Vector:
        """Return residuals at values (n_parameters,)."""
        ...

    def jacobian(self, values: Vector) -> NDArray[np.float64]:
        """Return derivatives (n_residuals, n_parameters) in units of the parameters' scale."""
        ...


class Evidence(Protocol):
    """Measurements with which a model of few unknowns and effects can be compared."""

    @property
    def base(self) -> tuple[Parameter, ...]:
        """Unknowns of the model without effects."""
        ...

    @property
    def rules(self) -> Rules:
        """Rules by which it is judged."""
        ...

    @property
    def evident(self) -> frozenset[str]:
        """Names of effects of which one is there, whatever a fit says; empty if none is evident."""
        ...

    def objective(self, candidates: Sequence[Candidate]) -> Residuals:
        """Return the residuals of a model with candidates; see `objective.Objective`."""
        ...

    def response(self, fitted: Fit) -> Response:
        """Return how the residuals of a fit respond to further effects."""
        ...

    def rows_of_parts(self) -> list[NDArray[np.int_]]:
        """Return the indices of the residuals of each part of the data."""
        ...

    def out_of_tolerance(self, at_bounds: Sequence[str], together: bool = False) -> list[Candidate]:
        """Return a candidate for each base parameter that a fit left at a bound.

        Those that an effect covers under another name only if several are freed ``together``.
        """
        ...


class Unknowns:
    """Unknowns of a fit with a set of candidates: base parameters first, then theirs.

    Parameters
    ----------
    base : sequence of Parameter
        Lines of known tolerance by amplitude and phase, whose places are ``lines``, (n_lines, 2).
    candidates : sequence of Candidate
    """

    def __init__(self, base: Sequence[Parameter], candidates: Sequence[Candidate]) -> None:
        self.candidates = tuple(candidates)
        added = [parameter for candidate in candidates for parameter in candidate.parameters]
        freed = {candidate.releases for candidate in candidates}
        bounded_base = [
            _without_tolerance(parameter) if parameter.name in freed else parameter
            for parameter in base
        ]
        self.parameters = (*bounded_base, *added)
        layout = Layout(self.parameters)
        self.scale, self.start = layout.array("scale"), layout.array("start")
        self.lower, self.upper = layout.array("lower"), layout.array("upper")
        self.prior = layout.array("prior")
        self.bounded = np.isfinite(self.prior)
        place = {parameter.name: k for k, parameter in enumerate(base)}
        lines = [
            (place[parameter.phase_of], place[parameter.name])
            for parameter in base
            if parameter.phase_of
        ]
        self.lines = np.array(lines, dtype=np.int_).reshape(-1, 2)

    def steps(self, values: Vector) -> Vector:
        """Return steps of difference quotients; an effect's strength cannot fall below zero."""
        return np.where(values + _STEP * self.scale > self.upper, -_STEP, _STEP)

    def priors(self, values: Vector) -> Vector:
        """Return the residuals of parameters that have a prior."""
        return ((values - self.start) / self.prior)[self.bounded]


def count(candidates: Sequence[Candidate]) -> int:
    """Return the number of parameters of candidates."""
    return sum(len(candidate.parameters) for candidate in candidates)


def built(
    candidates: Sequence[Candidate], values: Sequence[float] | Vector
) -> tuple[tuple[Any, ...], ...]:
    """Return the effects of each of the candidates for their values, one after the other."""
    return tuple(
        candidate.build([float(value) for value in values[place]])
        for candidate, place in places(candidates)
    )


def places(candidates: Sequence[Candidate], begin: int = 0) -> list[tuple[Candidate, slice]]:
    """Return each candidate with the places of its values, the first of all at ``begin``."""
    ends = np.cumsum([begin, *(len(candidate.parameters) for candidate in candidates)]).tolist()
    return [
        (candidate, slice(*ends[place : place + 2])) for place, candidate in enumerate(candidates)
    ]


def _without_tolerance(parameter: Parameter) -> Parameter:
    # A gain may be negative.
    lower, upper = sorted((parameter.start / _FREED, parameter.start * _FREED))
    return replace(parameter, lower=lower, upper=upper)
