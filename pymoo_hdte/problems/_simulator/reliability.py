"""How probable it is that a simulator's responses fail, down to one in a million and below."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

# Its optimisers and special functions load when they are first used.
import scipy
from numpy.typing import NDArray
from tqdm import tqdm

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.problems._simulator.inputs import Inputs
from pymoo_hdte.problems._simulator.requested import place_of
from pymoo_hdte.problems._simulator.runs import opened
from pymoo_hdte.problems._simulator.statistics import Statistic
from pymoo_hdte.problems._simulator.tails import REACH, TAIL_OF_REACH, NormalScatter
from pymoo_hdte.surrogate._rare.events import Event
from pymoo_hdte.surrogate._rare.limit_state import (
    LEAST,
    LimitState,
    Z,
    first_runs,
    learnt_limit_state,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reliability:
    """The probability of an event, and where it comes from.

    Attributes
    ----------
    probability : float
        Of the event, dimensionless.
    interval : tuple of float
        Ends of its 95 % band, dimensionless: what the surrogate leaves open, and sampling on it.
    beta : float
        Generalised reliability index, the standard normal quantile of ``1 - probability``.
    form_beta : float
        Distance of the most probable point of failure from the origin of standard normal space,
        dimensionless (first-order reliability method); negative where the median inputs fail.
    most_probable_point : dict of str to float
        The inputs there, by name and in their units.
    importance : dict of str to float
        Squared direction cosines of that point, dimensionless: shares of each input, which sum to
        1. Of dependent inputs they belong to the normal variables that make them, in the order of
        their names.
    n_runs : int
        Runs of the simulator.
    confirmed : bool
        Whether the requested accuracy was reached within the budget.
    failed : ndarray, shape (k, d)
        Inputs in their units at which the simulator failed; they are left out.

    Examples
    --------
    >>> import chaospy
    >>> noise = {"load": chaospy.Normal(1.0, 0.1), "strength": chaospy.Normal(2.0, 0.2)}
    >>> rare = failure_probability(
    ...     lambda load, strength: {"margin": strength - load}, noise, Response("margin") < 0.0,
    ...     progress=False,
    ... )
    >>> isinstance(rare, Reliability), round(rare.form_beta, 2)
    (True, 4.47)
    """

    probability: float
    interval: tuple[float, float]
    beta: float
    form_beta: float
    most_probable_point: dict[str, float]
    importance: dict[str, float]
    n_runs: int
    confirmed: bool
    failed: Array


class _NormalSpace:
    """Standard normal variables that make the scatter of all inputs, one for each that scatters."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs, self._scatter = inputs, NormalScatter(inputs.axes)
        self.d = self._scatter.d
        middles = [axis.around(None)[:2] for axis in inputs.axes]
        self._offsets, self._factors = np.array(middles)[..., 0].T

    def cube(self, points: Array) -> Array:
        """Return the coordinates of the surrogate in -1..1, shape (n, axes)."""
        return np.clip(self._offsets + self._factors * self._scatter(points), -1.0, 1.0)

    def values(self, points: Array) -> Array:
        """Return the inputs in their units, shape (n, axes)."""
        return self.inputs.values(self.cube(points))


def failure_probability(
    simulator: Callable[..., Any],
    noise: Mapping[Any, Any],
    event: Event,
    accuracy: float = 0.1,
    budget: int = 500,
    vectorised: bool = False,
    executor: Any = None,
    at_once: int = 1,
    tries: int = 2,
    time_limit: float | None = None,
    cache: str | os.PathLike[str] | None = None,
    seed: int = 1,
    progress: bool = True,
) -> Reliability:
    """Return the probability of an event of a simulator's responses, down to 1e-9.

    A surrogate of every response of the event is refined near the limit state, where a run reduces
    most what is open about the probability; the probability is sampled on it by importance. It is
    accepted when that is certain enough and two rounds of three runs elsewhere, the other side of
    the most probable point among them, bring no surprise. A region of failure that no run meets is
    not seen.

    Parameters
    ----------
    simulator : callable
        Takes all noise by name; returns a number, a mapping of names to numbers, or a sequence.
    noise : mapping
        As in `robust_problem`; at most 20 inputs.
    event : Event
        As ``Response("stress") > 250e6``, or several of them joined by ``|`` and ``&``.
    accuracy : float
        Wanted half-width of the 95 % band, as a share of the probability.
    budget : int
        Most points at which the simulator is run.
    vectorised, executor, at_once, tries, time_limit, cache, seed, progress
        As in `robust_problem`.

    Returns
    -------
    Reliability

    Raises
    ------
    InvalidInput
        For an argument that is not allowed.
    SimulatorFailed
        If every run so far failed.

    Warns
    -----
    RuntimeWarning
        If runs failed, or the budget is spent before the accuracy is reached: the band then is as
        wide as it has to be.

    Examples
    --------
    >>> from scipy.stats import norm
    >>> result = failure_probability(
    ...     lambda load, strength: load - strength,
    ...     {"load": norm(2.0, 0.3), "strength": norm(4.0, 0.4)},
    ...     Response() > 0.0,
    ...     progress=False,
    ... )
    >>> print(f"{result.beta:.1f} {result.form_beta:.1f}")
    4.0 4.0
    """
    inputs = Inputs({}, noise, tail=TAIL_OF_REACH, designed=False)
    if inputs.designed:
        allowed = "distributions: an Interval has no probability (robust_problem takes the worst)"
        raise InvalidInput(f"noise[{inputs.designed[0]!r}]", noise[inputs.designed[0]], allowed)
    space = _NormalSpace(inputs)
    if not isinstance(event, Event):
        allowed = "an event, as Response('stress') > 250e6 makes it"
        raise InvalidInput("event", event, allowed)
    accuracy = real_number("accuracy", accuracy, above=0.0, below=1.0)
    budget = whole_number("budget", budget, first_runs(len(inputs.axes)))
    batch = whole_number("at_once", at_once, 1)
    random_state = np.random.default_rng(whole_number("seed", seed, 0))

    def bar() -> tqdm:
        return tqdm(total=budget, desc="runs", unit="run", disable=not progress, file=sys.stderr)

    making = vectorised, executor, tries, time_limit, cache, bar
    with opened(simulator, inputs.names, *making) as simulate:

        def responses(points: Array) -> dict[str | None, Array]:
            values = simulate(space.values(points))
            return {
                name: values[:, place_of(Statistic(response=name), simulate.responses)]
                for name in event.responses
            }

        state = learnt_limit_state(
            responses, event, space.d, space.cube, accuracy, budget, random_state, batch
        )
    if len(state.failed):
        message = f"{len(state.failed)} of {state.n_runs} runs failed and are left out"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    if not state.confirmed:
        message = f"the budget of {state.n_runs} runs is used up before the band is narrow enough"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    return _reliability(state, event, space)


def _reliability(state: LimitState, event: Event, space: _NormalSpace) -> Reliability:
    probability = state.probability
    error = Z * np.hypot(state.surrogate_error, state.sampling_error)
    factor = float(np.exp(min(error / max(probability, np.finfo(float).tiny), 700.0)))
    interval = probability / factor, max(min(probability * factor, 1.0), LEAST)
    point = _most_probable(state, event, space)
    inputs, values = space.inputs, space.values(point[None])[0].tolist()
    length = float(np.linalg.norm(point))
    shares = (point / max(length, np.finfo(float).tiny)) ** 2
    inside = _margin(state, event, space, np.zeros((1, space.d)))[0] > 0.0
    return Reliability(
        probability,
        interval,
        -float(scipy.special.ndtri(probability)),
        (-length if inside else length) if length else (-np.inf if inside else np.inf),
        dict(zip(inputs.names, values, strict=True)),
        dict(zip(inputs.axis_names, shares.tolist(), strict=True)),
        state.n_runs,
        state.confirmed,
        space.values(state.failed) if len(state.failed) else np.empty((0, space.d)),
    )


def _margin(state: LimitState, event: Event, space: _NormalSpace, points: Array) -> Array:
    cube = space.cube(points)
    means = {name: response.moments(cube)[0] for name, response in state.posteriors.items()}
    return event.margin(means)


def _most_probable(state: LimitState, event: Event, space: _NormalSpace) -> Array:
    """Return the point of the limit state nearest to the origin, shape (d,).

    From the point of the sample that is nearest; that itself where the search does not end.
    """
    inside = _margin(state, event, space, np.zeros((1, space.d)))[0] > 0.0
    beyond = (state.chance > 0.5) != inside
    if not beyond.any():
        return np.zeros(space.d)
    squares = np.sum(state.sample.points**2, axis=1)
    start = state.sample.points[np.argmin(np.where(beyond, squares, np.inf))]
    scale = abs(float(_margin(state, event, space, start[None])[0])) or 1.0

    def margin(u: Array) -> float:
        return float(_margin(state, event, space, u[None])[0]) / scale

    optimum = scipy.optimize.minimize(
        lambda u: 0.5 * float(u @ u),
        start,
        jac=lambda u: u,
        bounds=[(-REACH, REACH)] * space.d,
        constraints=[{"type": "eq", "fun": margin}],
        method="SLSQP",
    )
    nearer = optimum.success and np.linalg.norm(optimum.x) <= np.linalg.norm(start)
    return np.asarray(optimum.x if nearer else start, dtype=float)
