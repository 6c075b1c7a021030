"""A robust problem on the adaptive surrogate of a simulator."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pymoo.core.problem import Problem

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.problems._simulator import plots
from pymoo_hdte.problems._simulator.around import RESOLVED, Around, CommonSamples
from pymoo_hdte.problems._simulator.crashes import SuccessMoments
from pymoo_hdte.problems._simulator.data import Runs
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.problems._simulator.replicates import OwnMoments
from pymoo_hdte.problems._simulator.requested import (
    Requested,
    by_moments,
    place_of,
    requested_of,
)
from pymoo_hdte.problems._simulator.statistics import RobustConstraint, Statistic
from pymoo_hdte.problems._simulator.stored import read_problem, write_problem
from pymoo_hdte.problems._simulator.worst import WorstOver
from pymoo_hdte.surrogate._sparse.adaptive import AdaptiveFit
from pymoo_hdte.surrogate._sparse.draws import draw_designs
from pymoo_hdte.surrogate.box import Box
from pymoo_hdte.surrogate.moments import divide_or_zero
from pymoo_hdte.surrogate.sensitivity import SobolIndices

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_JUDGED = 64
"""Designs over which the accuracy of an objective is the median."""
_AT_ONCE = 256
"""Designs whose samples are held in memory at once."""


class SimulatorProblem(Problem):
    """Statistics of uncertain responses as objectives and constraints; `robust_problem` makes it.

    An ordinary vectorised `Problem` of pymoo. Ask for ``dF`` and ``dG`` in ``return_values_of`` to
    get gradients, shape (n, n_obj, n_var), exact for the surrogate, and for ``F_band`` to get the
    estimated half-width of the error of F, NaN for a `WorstCase`. What is told of a design beyond
    goals (`scatter`, `sobol_indices`) is at the values of an `Interval` that are worst for the
    first objective. Where runs fail, statistics are
    those of the runs that succeed, there are no gradients, and a `CrashProbability` tells how often
    they fail.

    Parameters
    ----------
    inputs : Inputs
        Designs and noise.
    fit : AdaptiveFit
        Surrogate of all responses and its estimated errors.
    responses : tuple of str
        Names of the responses.
    objectives : sequence of Statistic
        Objectives to be minimised.
    constraints : sequence of RobustConstraint
        Constraints to be met.
    n_runs : int
        Runs of the simulator that were made.
    refusal : str, optional
        Why the surrogate is not what was asked for.
    replicates : Runs, optional
        All runs of a random simulator, of whose means and variances the surrogate is.

    Attributes
    ----------
    n_runs : int
        Runs of the simulator behind the surrogate, those at points it does not use among them.
    accuracy : ndarray, shape (n_obj,)
        Estimated error of each objective as a share of the scatter of its response: the median over
        the design box. Of a `FailureProbability` it is the error itself, of a `WorstCase` NaN.
    response_errors : dict of str to float
        Estimated error of each response as a share of its scatter, the larger one of mean and
        deviation; large perhaps for a response that no objective and no constraint names.
    trusted : bool
        Whether the surrogate is as accurate as was asked for; False only with ``accept="best"``.
    refusal : str or None
        Why it is not trusted.
    runs : Runs or None
        Inputs X and responses Y of all runs; None for a problem that was loaded.
    failed : ndarray, shape (k, d)
        Inputs in their units at which the simulator failed.
    var_names, obj_names, input_names : tuple of str
        In the order of X, in that of F, and of all inputs of the simulator, the designs first.
    design_box : Box
        The search space.
    responses, objectives, constraints
        As given.

    Examples
    --------
    >>> problem = robust_problem(
    ...     lambda x: x**2, {"x": Design(1.0, 2.0, tolerance=0.1)}, progress=False
    ... )
    >>> problem.n_runs < 100, problem.obj_names
    (True, ('mean', 'std'))
    """

    def __init__(
        self,
        inputs: Inputs,
        fit: AdaptiveFit,
        responses: tuple[str, ...],
        objectives: Sequence[Statistic],
        constraints: Sequence[RobustConstraint],
        n_runs: int,
        refusal: str | None = None,
        replicates: Runs | None = None,
    ) -> None:
        self._inputs, self.refusal, self._replicates = inputs, refusal, replicates
        bounds = np.array([axis.design for axis in inputs.axes if axis.designed])
        count = len(inputs.designs)
        self._intervals = None if count == len(bounds) else WorstOver(bounds[count:])
        bounds = bounds[:count]
        self.design_box = Box(inputs.designed[:count], *bounds.T)
        self.objectives, self.constraints = tuple(objectives), tuple(constraints)
        self.responses, self.n_runs, self._fit = responses, n_runs, fit
        self._requested = requested_of(objectives, constraints, responses)
        super().__init__(
            n_var=len(bounds),
            n_obj=len(objectives),
            n_ieq_constr=len(constraints),
            xl=bounds[:, 0].copy(),
            xu=bounds[:, 1].copy(),
        )
        self.var_names, self.input_names = tuple(inputs.designs), inputs.names
        self.obj_names = tuple(statistic.name for statistic in objectives)
        self._common = CommonSamples(fit.moments, seed=1)
        self._success = self._own = None
        if fit.own is not None:
            self._own = OwnMoments(fit.own, inputs.axes, self._common.scatter)
        if fit.success is not None:
            self._success = SuccessMoments(fit.success, inputs.axes, self._common.scatter)
        self.failed = inputs.values(fit.failed) if len(fit.failed) else fit.failed
        errors = fit.errors.max(axis=0).tolist()
        self.response_errors = dict(zip(responses, errors, strict=True))

    @property
    def trusted(self) -> bool:
        """Whether the surrogate is as accurate as was asked for."""
        return self.refusal is None

    @property
    def runs(self) -> Runs | None:
        """Inputs and responses of all runs; None for a problem that was loaded."""
        if not len(self._fit.points):
            return None
        if self._replicates is not None:
            return self._replicates
        return Runs(self._inputs.values(self._fit.points), self._fit.truth.copy())

    @property
    def degrees(self) -> dict[str, int]:
        """Degree of the surrogate in each input, by name."""
        return dict(zip(self._inputs.axis_names, self._fit.polynomial.degrees, strict=True))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the problem to ``path``, replacing it in one step (``docs/file_format.md``).

        Raises
        ------
        InvalidInput
            If a distribution or a statistic is a user's own, or the file would be too large.
        OSError
            If the file cannot be written.
        """
        parts = self.responses, self.objectives, self.constraints, self.n_runs, self.refusal
        write_problem(path, self._inputs, self._fit, *parts)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SimulatorProblem:
        """Return the problem that `save` wrote; it needs the simulator no more.

        Parameters
        ----------
        path : str or path-like
            The file.

        Returns
        -------
        SimulatorProblem

        Raises
        ------
        InvalidInput
            If the file is damaged, incomplete, of another format or of a later version.
        OSError
            If the file cannot be read.
        """
        return cls(*read_problem(path))

    def band(self, designs: ArrayLike) -> Array:
        """Return the half-width of the estimated error of F, shape (n, n_obj), in its units.

        Parameters
        ----------
        designs : array_like, shape (n, n_var)
            In the variables' units.

        Raises
        ------
        ExtrapolationError
            If a design lies outside the box.
        InvalidInput
            If ``designs`` is no array of numbers of shape (n, n_var).
        """
        X = self.design_box.settle(designs)
        if self._intervals is None:
            return self._bands(X, self._requested[: self.n_obj])
        # What a maximum is off by is at most the largest error that its candidates have.
        columns = [
            self._intervals.largest(X, partial(self._bands, requested=[request]))
            for request in self._requested[: self.n_obj]
        ]
        return np.column_stack(columns)

    def _bands(self, X: Array, requested: Sequence[Requested]) -> Array:
        return np.concatenate([_band(self._around(block), requested) for block in _blocks(X)])

    def predict(self, values: ArrayLike) -> Array:
        """Return the surrogate of all responses, shape (n, r), in their units.

        Parameters
        ----------
        values : array_like, shape (n, d)
            All inputs in the order of ``input_names`` and in their units, within their reach.

        Raises
        ------
        InvalidInput
            If ``values`` is no array of finite numbers of shape (n, d).
        """
        points = finite_array("values", values, (None, len(self.input_names)))
        return self._fit.polynomial(self._inputs.cube(points))

    def sobol_indices(self, design: ArrayLike, response: str | None = None) -> SobolIndices:
        """Return how the variance of a response around a design divides among its inputs.

        From the squared coefficients of the expansion (Sudret, Reliability Engineering and System
        Safety 93, 2008). Dependent noise is divided by the independent normal variables that make
        it, in the order of their names.

        Parameters
        ----------
        design : array_like, shape (n_var,)
            In the variables' units.
        response : str, optional
            Its name, where there are several.

        Returns
        -------
        SobolIndices
            Exact for the surrogate.

        Raises
        ------
        ExtrapolationError
            If the design lies outside the box.
        InvalidInput
            If there is no such response, or the design has another shape.
        """
        place, point = self._at(design, response)
        moments = self._fit.moments
        expansion = moments.expansion(point)[0, place]
        variance, first_order, total = moments.divided_variance(expansion)
        return SobolIndices(
            self._inputs.axis_names, float(expansion[0]), variance, first_order, total
        )

    def scatter(self, design: ArrayLike, response: str | None = None) -> tuple[str, Array]:
        """Return the name of a response and its values at the common samples around a design.

        Parameters
        ----------
        design : array_like, shape (n_var,)
            In the variables' units.
        response : str, optional
            Its name, where there are several.

        Returns
        -------
        name : str
        values : ndarray, shape (4096,)
            Of the surrogate, in the response's unit.

        Raises
        ------
        ExtrapolationError
            If the design lies outside the box.
        InvalidInput
            If there is no such response, or the design has another shape.
        """
        place, point = self._at(design, response)
        return self.responses[place], self._around(point)[place].samples[0][0]

    def _at(self, design: ArrayLike, response: str | None) -> tuple[int, Array]:
        """Return the position of a response, and one design in the box, intervals behind it."""
        place = place_of(Statistic(response=response), self.responses)
        X = self.design_box.settle(finite_array("design", design, (self.n_var,))[None])
        return place, X if self._intervals is None else self._at_worst(X, self._requested[0])

    def plot_front(self, result: Any, axes: Axes | None = None) -> Axes:
        """Draw the first two objectives of a result with their error bands.

        Parameters
        ----------
        result : pymoo.core.result.Result
            Of this problem; with a single objective, that is drawn over the first variable.
        axes : matplotlib.axes.Axes, optional
            Where to draw; by default on a new figure.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return plots.plot_front(self, result, axes)

    def plot_scatter(
        self, design: ArrayLike, response: str | None = None, axes: Axes | None = None
    ) -> Axes:
        """Draw how a response scatters around a design.

        Parameters
        ----------
        design : array_like, shape (n_var,)
            In the variables' units.
        response : str, optional
            Its name, where there are several.
        axes : matplotlib.axes.Axes, optional
            Where to draw; by default on a new figure.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ExtrapolationError, InvalidInput
            As `scatter`.
        """
        return plots.plot_scatter(self, design, response, axes)

    def report(
        self,
        path: str | os.PathLike[str],
        result: Any = None,
        design: ArrayLike | None = None,
    ) -> None:
        """Write one HTML page: responses, errors, Sobol indices, the front, one design's scatter.

        Parameters
        ----------
        path : str or path-like
            The file; it needs no other.
        result : pymoo.core.result.Result, optional
            Whose front is shown.
        design : array_like, shape (n_var,), optional
            In the variables' units; by default the design of the result that is nearest to the best
            of every objective.

        Raises
        ------
        InvalidInput
            If neither a result nor a design is given.
        OSError
            If the file cannot be written.
        """
        text = plots.page(self, result, design)
        with open(path, "w", encoding="utf-8") as stream:
            stream.write(text)

    def _around(self, X: Array) -> list[Around]:
        """Return the expansion of each response around the designs."""
        expansion = self._fit.moments.expansion(X)
        success = None if self._success is None else self._success.around(X)
        owns: Sequence[Any] = [None] * len(self.responses)
        if self._own is not None:
            owns = self._own.around(X)
        around = [
            Around(self._common, expansion[:, k], success=success, own=own)
            for k, own in enumerate(owns)
        ]
        beside: dict[str | None, Around] = dict(zip(self.responses, around, strict=True))
        if len(around) == 1:
            beside[None] = around[0]
        for place, response in enumerate(around):
            scatter = np.maximum(response.std, self._fit.smallest_scatter[place])
            response.mean_error = self._fit.mean_error[place] * scatter
            response.std_error = self._fit.std_error[place] * scatter
            response.beside, response.n_runs = beside, self.n_runs
        return around

    @cached_property
    def accuracy(self) -> Array:
        """Estimated error of each objective, as the class says, shape (n_obj,)."""
        designs = draw_designs(self._inputs.axes, _JUDGED, np.random.default_rng(1))
        around = self._around(designs)
        shares = _band(around, self._requested[: self.n_obj])
        for column, (statistic, _, _, place) in enumerate(self._requested[: self.n_obj]):
            if statistic.relative_to_scatter:
                least = self._fit.smallest_scatter[place]
                shares[:, column] /= np.maximum(around[place].std, least)
        return np.median(shares, axis=0)

    def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        """Fill F and G, and dF, dG and F_band if requested.

        Raises
        ------
        ExtrapolationError
            If a design is outside the box or NaN.
        InvalidInput
            If a gradient is requested of a statistic that has none.
        """
        x = self.design_box.settle(x)
        sloped = "dF" in out or "dG" in out
        if self._intervals is None:
            values, gradients = self._values(x, self._requested, sloped)
        else:
            # Each goal at the values of the intervals that are worst for it.
            parts = [self._values(self._at_worst(x, one), [one], sloped) for one in self._requested]
            values = np.concatenate([part[0] for part in parts], axis=1)
            gradients = np.concatenate([part[1] for part in parts], axis=1)
        for key, part in (("F", slice(0, self.n_obj)), ("G", slice(self.n_obj, None))):
            if key == "F" or self.n_ieq_constr:
                out[key] = values[:, part]
                if f"d{key}" in out:
                    out[f"d{key}"] = gradients[:, part, : self.n_var]
        if "F_band" in out:
            out["F_band"] = self.band(x)

    def _at_worst(self, x: Array, request: Requested) -> Array:
        """Return designs with the values of all intervals that are worst for a goal."""
        assert self._intervals is not None
        return self._intervals(x, lambda points: self._values(points, [request], False)[0][:, 0])

    def _values(
        self, x: Array, requested: Sequence[Requested], sloped: bool
    ) -> tuple[Array, Array]:
        """Return what is to be small at designs and their intervals, shape (n, k), and its slopes.

        The slopes have shape (n, k, m); none unless ``sloped``.
        """
        if not sloped and self._success is None and self._own is None:
            quick = by_moments(requested, self._fit.moments, x)
            if quick is not None:
                return quick, np.empty((len(x), len(requested), 0))
        parts = [self._block(block, requested, sloped) for block in _blocks(x)]
        values, gradients = zip(*parts, strict=True)
        return np.concatenate(values), np.concatenate(gradients)

    def _block(self, x: Array, requested: Sequence[Requested], sloped: bool) -> tuple[Array, Array]:
        around = self._around(x)
        values, gradients = [], [np.empty((len(x), 0))] * len(requested)
        for row, (statistic, sign, bound, place) in enumerate(requested):
            value, slope = statistic._value(around[place])
            values.append(sign * value - bound)
            if sloped:
                gradient = self._gradient(x, statistic, slope, around[place], place)
                gradients[row] = sign * gradient
        return np.column_stack(values), np.stack(gradients, axis=1)

    def _gradient(
        self, x: Array, statistic: Statistic, slope: Array, around: Around, place: int
    ) -> Array:
        if not statistic.has_gradient:
            raise InvalidInput("dF or dG", statistic, "statistics that have a gradient")
        if self._success is not None:
            allowed = "no gradient: runs fail, and what their share changes by is not computed"
            raise InvalidInput("dF or dG", statistic, allowed)
        weights = np.zeros((len(x), len(self.responses), slope.shape[1]))
        weights[:, place] = slope
        gradient = self._fit.moments.pulled_back(x, weights)[:, place]
        if around.own is None or self._own is None:
            return gradient
        if statistic.weights is None:
            allowed = "mean, deviation or their sum for a random simulator"
            raise InvalidInput("dF or dG", statistic, allowed)
        # Of the own variance, as far as it is above 0.
        shape = len(x), len(self.responses), around.own.expansion.shape[1]
        weights = np.zeros(shape)
        half = np.where(around.own.expansion[:, 0] > 0.0, 0.5, 0.0)
        weights[:, place, 0] = statistic.weights[1] * divide_or_zero(half, around.std)
        return gradient + self._own.moments.pulled_back(x, weights)[:, place]


def _blocks(X: Array) -> list[Array]:
    """Return the designs in groups that are evaluated at once; of no designs, one empty group."""
    return np.split(X, range(_AT_ONCE, len(X), _AT_ONCE))


def _band(around: Sequence[Around], requested: Sequence[Requested]) -> Array:
    """Return the half-widths of what is requested around n designs, shape (n, len(requested))."""
    return np.column_stack([_half_width(row[0], around[row[3]]) for row in requested])


def _half_width(statistic: Statistic, around: Around) -> Array:
    """Return the half-width of a statistic's band, what is not known of failures included.

    Infinite for a quantile beyond what the samples resolve that know of failures and own scatter.
    """
    if around.common_alone and statistic.relative_to_scatter and statistic.rarest() < RESOLVED:
        return np.full(len(around.mean), np.inf)
    uncertain = around.error_of_success(lambda other: statistic._value(other)[0])
    return statistic._half_width(around) + uncertain
