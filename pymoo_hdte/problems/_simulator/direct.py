"""Robust statistics without a surrogate: the problem itself, run at common draws of the scatter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.core.variable import Real

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.problems._simulator.around import PARTS, sampling_error
from pymoo_hdte.problems._simulator.requested import requested_of
from pymoo_hdte.problems._simulator.runs import SimulatorFailed
from pymoo_hdte.problems._simulator.sampled_statistics import FEWEST, FailureProbability
from pymoo_hdte.problems._simulator.statistics import RobustConstraint, Statistic
from pymoo_hdte.surrogate._sparse.measures import Distribution

Array = NDArray[np.float64]

_AT_ONCE = 2**16
"""Runs of the problem that are held in memory together."""


class Drawn:
    """One response at common draws around n designs, as `Around` is for a surrogate.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        The response at k draws, the independent parts of a quarter one after the other.

    Attributes
    ----------
    expansion : ndarray, shape (n, k + 1)
        The mean, and what every draw adds to it: its squares sum to the variance.
    beside : dict of str to Drawn
        All responses around these designs by name, itself among them; None stands for the only one.
    """

    resolved = often = 0.0
    weights = success = None
    common_alone = True

    def __init__(self, values: Array) -> None:
        self._values = values
        self.mean, self.std = values.mean(axis=1), values.std(axis=1)
        self.beside: dict[str | None, Drawn] = {None: self}

    @cached_property
    def expansion(self) -> Array:
        """The mean, and the deviation of every draw over the root of their number."""
        apart = self._values - self.mean[:, None]
        return np.column_stack([self.mean, apart / np.sqrt(self._values.shape[1])])

    @property
    def samples(self) -> tuple[Array, Array]:
        """Values at the draws, shape (n, k), and no polynomials there, shape (k, 0)."""
        return self._values, np.empty((self._values.shape[1], 0))

    def quarters(self) -> Iterator[Drawn]:
        """Yield the same with each independent part of the draws."""
        for part in np.split(self._values, PARTS, axis=1):
            yield Drawn(part)

    def extreme(self, side: float) -> tuple[Array, Array]:
        """Return the largest value of the draws, shape (n,), and no slope; the smallest for -1."""
        return side * np.max(side * self._values, axis=1), np.empty((len(self._values), 0))

    @cached_property
    def mean_error(self) -> Array:
        """95 % half-width of the error of the mean, shape (n,)."""
        return sampling_error(np.array([part.mean for part in self.quarters()]))

    @cached_property
    def std_error(self) -> Array:
        """95 % half-width of the error of the standard deviation, shape (n,)."""
        return sampling_error(np.array([part.std for part in self.quarters()]))

    @property
    def success_share(self) -> Array:
        """The probability that a run succeeds, shape (n,): a failing one is refused."""
        return np.ones(len(self._values))

    @property
    def n_runs(self) -> int:
        """Runs behind it, at every design."""
        return self._values.shape[1]


class DirectProblem(Problem):
    """Robust counterpart of a pymoo problem, which is run at common draws around every design.

    Every design costs ``draws`` runs, in every evaluation (Deb and Gupta, Evolutionary Computation
    14, 2006). The draws are the same for all designs (common random numbers), so that the errors of
    designs next to each other are alike. `Robust` makes it. Ask for ``F_band`` in
    ``return_values_of`` to get the 95 % half-width of the error of sampling of F.

    Parameters
    ----------
    problem : pymoo.core.problem.Problem
        With real variables, or mixed ones (``vars``) of which the real ones scatter.
    deviations : mapping of str to float or distribution
        Absolute deviation of every variable that scatters, by name; a number d stands for uniform
        in -d..d.
    objectives : sequence of Statistic
        Of the responses ``F1``, .., ``G1``, ..
    constraints : sequence of RobustConstraint
    draws : int
        Draws of the scatter; a multiple of 4.
    seed : int
        Of the draws.
    clip : bool
        Whether scattered variables are kept within the bounds of the problem.

    Attributes
    ----------
    n_runs : int
        Runs of the problem so far.
    original : pymoo.core.problem.Problem
        The problem that is run.
    draws, clip, objectives, constraints
        As given.
    responses, var_names, obj_names : tuple of str
        Names.

    Raises
    ------
    InvalidInput
        If a statistic needs a probability that so few draws do not resolve.

    Examples
    --------
    >>> from pymoo.problems import get_problem
    >>> problem = Robust(
    ...     get_problem("zdt1"), scatter=0.02, method="direct", clip=True, progress=False
    ... )
    >>> isinstance(problem, DirectProblem), problem.draws
    (True, 128)
    """

    def __init__(
        self,
        problem: Problem,
        deviations: Mapping[str, Any],
        objectives: Sequence[Statistic],
        constraints: Sequence[RobustConstraint],
        draws: int,
        seed: int,
        clip: bool,
    ) -> None:
        self.original, self.draws, self.clip = problem, draws, clip
        self.objectives, self.constraints = tuple(objectives), tuple(constraints)
        self.responses = responses_of(problem)
        self.var_names = names_of(problem)
        self.obj_names = tuple(statistic.name for statistic in objectives)
        self.n_runs = 0
        self._requested = requested_of(objectives, constraints, self.responses)
        _check_resolved(objectives, constraints, draws)
        self._deviations = _drawn_deviations(deviations, self.var_names, draws, seed)
        mixed = is_mixed(problem)
        kind: dict[str, Any] = (
            {"vars": problem.vars}
            if mixed
            else {"n_var": problem.n_var, "xl": problem.xl, "xu": problem.xu}
        )
        super().__init__(n_obj=len(objectives), n_ieq_constr=len(constraints), **kind)

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        """Fill F and G, and F_band if requested.

        Raises
        ------
        InvalidInput
            If a gradient is requested: there is none.
        SimulatorFailed
            If the problem gives no finite numbers at some draw.
        """
        if "dF" in out or "dG" in out:
            raise InvalidInput("return_values_of", "dF or dG", "F, G and F_band: no surrogate")
        step = max(1, _AT_ONCE // self.draws)
        parts = [self._block(x[k : k + step], "F_band" in out) for k in range(0, len(x), step)]
        for key in parts[0]:
            out[key] = np.concatenate([part[key] for part in parts])

    def _block(self, x: Any, banded: bool) -> dict[str, Array]:
        around = self._around(x)
        columns = [
            sign * statistic._value(around[place])[0] - bound
            for statistic, sign, bound, place in self._requested
        ]
        F, G = np.split(np.column_stack(columns), [self.n_obj], axis=1)
        outputs = {"F": F, "G": G} if self.n_ieq_constr else {"F": F}
        if banded:
            objectives = self._requested[: self.n_obj]
            bands = [statistic._half_width(around[place]) for statistic, _, _, place in objectives]
            outputs["F_band"] = np.column_stack(bands)
        return outputs

    def _around(self, x: Any) -> list[Any]:
        scattered = self.scattered(x)
        outputs = self.original.evaluate(scattered, return_as_dictionary=True)
        self.n_runs += len(scattered)
        parts = [np.atleast_2d(outputs["F"])]
        if self.original.n_ieq_constr:
            parts.append(np.atleast_2d(outputs["G"]))
        values = np.column_stack(parts).astype(float)
        if not np.all(np.isfinite(values)):
            row = int(np.argmin(np.isfinite(values).all(axis=1)))
            raise SimulatorFailed(f"the problem gives no finite numbers at {scattered[row]}")
        table = values.reshape(len(x), self.draws, -1)
        around = [Drawn(table[:, :, k]) for k in range(table.shape[2])]
        beside: dict[str | None, Drawn] = dict(zip(self.responses, around, strict=True))
        for response in around:
            response.beside = beside | ({None: around[0]} if len(around) == 1 else {})
        return around

    def scattered(self, x: Any) -> Any:
        """Return the designs as built, ``draws`` of each one after the other.

        Parameters
        ----------
        x : ndarray, shape (n, n_var), or sequence of dict
            Designs.
        """
        lower, upper = _ends(self.original, self.var_names)
        if not is_mixed(self.original):
            columns = [
                x[:, j, None] + self._deviations.get(name, np.zeros(self.draws))
                for j, name in enumerate(self.var_names)
            ]
            values = np.stack(columns, axis=-1).reshape(-1, len(columns))
            return np.clip(values, lower, upper) if self.clip else values
        rows = []
        ends = dict(zip(self.var_names, zip(lower, upper, strict=True), strict=True))
        for design in x:
            for place in range(self.draws):
                row = dict(design)
                for name, deviations in self._deviations.items():
                    value = row[name] + float(deviations[place])
                    row[name] = float(np.clip(value, *ends[name])) if self.clip else value
                rows.append(row)
        return np.array(rows, dtype=object)


def is_mixed(problem: Problem) -> bool:
    """Return whether designs of a problem are dictionaries of variables of several kinds."""
    # The attribute exists only where variables were given by name.
    kinds = (getattr(problem, "vars", None) or {}).values()
    return any(not isinstance(kind, Real) for kind in kinds)


def names_of(problem: Problem) -> tuple[str, ...]:
    """Return the names of a problem's variables: its own if they are mixed, else x1, x2, .."""
    if is_mixed(problem):
        return tuple(map(str, problem.vars))
    return tuple(f"x{j + 1}" for j in range(problem.n_var))


def real_names(problem: Problem) -> tuple[str, ...]:
    """Return the names of the variables that may scatter."""
    if not is_mixed(problem):
        return names_of(problem)
    return tuple(str(name) for name, kind in problem.vars.items() if isinstance(kind, Real))


def responses_of(problem: Problem) -> tuple[str, ...]:
    """Return the names of objectives, F1, F2, .., and constraints, G1, G2, .."""
    objectives = [f"F{k + 1}" for k in range(problem.n_obj)]
    return (*objectives, *(f"G{k + 1}" for k in range(problem.n_ieq_constr)))


def _ends(problem: Problem, names: tuple[str, ...]) -> tuple[Any, Any]:
    if not is_mixed(problem):
        return problem.bounds()
    kinds = problem.vars
    ends = [kinds[n].bounds if isinstance(kinds[n], Real) else (-np.inf, np.inf) for n in names]
    lower, upper = zip(*ends, strict=True)
    return np.array(lower), np.array(upper)


def _drawn_deviations(
    deviations: Mapping[str, Any], names: tuple[str, ...], draws: int, seed: int
) -> dict[str, Array]:
    """Return the draws of every variable that scatters, shape (draws,), by name."""
    moving = [name for name in names if not _is_zero(deviations.get(name, 0.0))]
    if not moving:
        return {}
    parts = [
        scipy.stats.qmc.Sobol(len(moving), rng=child).random(draws // PARTS)
        for child in np.random.default_rng(seed).spawn(PARTS)
    ]
    shares = np.clip(np.concatenate(parts), 1e-12, 1.0 - 1e-12)
    drawn = {}
    for name, column in zip(moving, shares.T, strict=True):
        given, field = deviations[name], f"scatter of {name!r}"
        if hasattr(given, "pdf"):
            drawn[name] = Distribution(field, given).quantile(column)
        else:
            drawn[name] = real_number(field, given, at_least=0.0) * (2.0 * column - 1.0)
    return drawn


def _is_zero(given: Any) -> bool:
    return not hasattr(given, "pdf") and given == 0.0


def _check_resolved(
    objectives: Sequence[Statistic], constraints: Sequence[RobustConstraint], draws: int
) -> None:
    bounded = [(limit.statistic, limit.rarest) for limit in constraints]
    # A probability as an objective is given with an error, however small it is.
    free = [(s, s.rarest()) for s in objectives if not isinstance(s, FailureProbability)]
    for statistic, rarest in [*bounded, *free]:
        if rarest < min(FEWEST / draws, 0.5):
            least = int(np.ceil(FEWEST / rarest))
            raise InvalidInput("draws", draws, f"at least {least} for {statistic!r}")
