"""The probability of an event with as few runs as it takes: a surrogate refined at its limit state.

Runs are added where they most reduce the probability that points which matter are on the wrong side
of the limit state (stepwise uncertainty reduction: Bect et al., Statistics and Computing 22, 2012),
until what the surrogate leaves open about the probability is small against it. Then some runs are
made where nothing was: at the radius of the limit state on the other side and in other directions.
The event is accepted when two such rounds bring no surprise.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.surrogate._rare.events import Event
from pymoo_hdte.surrogate._rare.importance import Mixture, Sample, adapted, sample_of
from pymoo_hdte.surrogate._rare.posterior import Posterior, draws

Array = NDArray[np.float64]

FIRST_RUNS = 10
"""Runs before the first surrogate, two more for each input; set by hand."""
FIRST_SPREAD = 1.8
"""Deviation of the first runs in standard normal space: failure is far from the origin."""
OPTIMISTIC = 2.0
"""Deviations of the surrogate by which a point may fail and is looked at."""
CHECKS = 3
"""Runs of a round of checks."""
ROUNDS_OF_CHECKS = 2
SURPRISE = 3.0
"""Deviations of the surrogate beyond which a check is a surprise."""
UNALIKE = 0.5
"""A check that is off by less than this share of its distance from the limit is none either."""
POINTS, SAMPLED = 500, 2000
"""Points of a round of `adapted` and of its last one, while the surrogate grows."""
DOUBTFUL, CANDIDATES = 400, 120
"""Points among which reductions are computed, and those of them that are candidates."""
SIMULATED, SIMULATIONS = 800, 400
"""Points, and joint draws of the surrogate there, for the error it leaves in the probability."""
Z = 1.96
"""Standard errors within which an estimate lies with 95 %."""
OF_SURROGATE, OF_SAMPLE = 0.8, 0.6
"""Shares of the accuracy for both errors: their squares add up to 1."""
LEAST = 1e-9
"""Probability below which nothing is resolved: 6 deviations of a normal variable."""
LARGEST_SAMPLE = 2**17


@dataclass(frozen=True)
class LimitState:
    """The event as the surrogate sees it at the end.

    Attributes
    ----------
    probability : float
        Of the event.
    surrogate_error, sampling_error : float
        Standard errors of it.
    sample : Sample
        Points in standard normal space, most of them beyond the limit state or near it.
    chance : ndarray, shape (n,)
        Probability that the event happens at each, by the surrogate.
    n_runs : int
        Calls of the function.
    failed : ndarray, shape (k, d)
        Points in standard normal space at which the function failed.
    confirmed : bool
        Whether the requested accuracy was reached and the checks passed.
    posteriors : dict of str to Posterior
        Surrogate of each response of the event.
    """

    probability: float
    surrogate_error: float
    sampling_error: float
    sample: Sample
    chance: Array
    n_runs: int
    failed: Array
    confirmed: bool
    posteriors: dict[str | None, Posterior]


class _Learner:
    def __init__(
        self,
        function: Callable[[Array], Mapping[str | None, Array]],
        event: Event,
        d: int,
        cube: Callable[[Array], Array],
        random_state: np.random.Generator,
    ) -> None:
        self.function, self.event, self.d, self.cube = function, event, d, cube
        self.random_state = random_state
        self.points = np.empty((0, d))
        self.values: dict[str | None, Array] = {name: np.empty(0) for name in event.responses}
        self.posteriors: dict[str | None, Posterior] = {}

    def run(self, points: Array) -> Mapping[str | None, Array]:
        """Run the function at more points; return the responses there, NaN where it failed."""
        given = self.function(points)
        self.points = np.concatenate([self.points, points])
        for name in self.values:
            self.values[name] = np.append(self.values[name], given[name])
        return given

    @property
    def good(self) -> NDArray[np.bool_]:
        """Which runs did not fail, shape (n,)."""
        return np.isfinite(np.array(list(self.values.values()))).all(axis=0)

    def fit(self) -> None:
        good = self.good
        cube = self.cube(self.points[good])
        for name, values in self.values.items():
            before = self.posteriors.get(name)
            start = None if before is None else before.parameters
            self.posteriors[name] = Posterior(cube, values[good], start)

    def moments(self, points: Array) -> tuple[dict[str | None, Array], dict[str | None, Array]]:
        cube = self.cube(points)
        both = {name: response.moments(cube) for name, response in self.posteriors.items()}
        return {n: mean for n, (mean, _) in both.items()}, {n: std for n, (_, std) in both.items()}

    def optimistic(self, points: Array) -> Array:
        """Return a margin that is above 0 wherever the event is not excluded, shape (n,)."""
        mean, std = self.moments(points)
        slack = {name: OPTIMISTIC * values for name, values in std.items()}
        return self.event.margin(mean, slack)

    def mixture(self, count: int, final: int) -> Mixture:
        return adapted(self.optimistic, self.d, self.random_state, count, final)

    def chance(self, points: Array) -> Array:
        return self.event.chance(*self.moments(points))

    def best(self, sample: Sample, chance: Array, count: int) -> Array:
        """Return the points whose runs are expected to leave least open, shape (count, d)."""
        doubt = sample.weights * np.sqrt(chance * (1.0 - chance))
        chosen = np.argsort(-doubt)[:DOUBTFUL]
        points, weights = sample.points[chosen], sample.weights[chosen]
        cube = self.cube(points)
        mean, _ = self.moments(points)
        left = {name: response.covariance(cube) for name, response in self.posteriors.items()}
        best: list[int] = []
        while len(best) < count:
            variances = {name: np.maximum(np.diag(matrix), 1e-300) for name, matrix in left.items()}
            doubt = weights * self._doubt(mean, variances)
            candidates = np.setdiff1d(np.argsort(-doubt)[:CANDIDATES], best)
            after = {
                name: matrix.diagonal()[:, None]
                - matrix[:, candidates] ** 2 / variances[name][candidates]
                for name, matrix in left.items()
            }
            wide = {name: values[:, None] for name, values in mean.items()}
            remaining = weights @ self._doubt(wide, after)
            place = int(candidates[np.argmin(remaining)])
            best.append(place)
            for name, matrix in left.items():
                column = matrix[:, place]
                left[name] = matrix - np.outer(column, column) / variances[name][place]
        return points[best]

    def _doubt(
        self, mean: Mapping[str | None, Array], variances: Mapping[str | None, Array]
    ) -> Array:
        """Return the probability that the event is on the wrong side of the limit state."""
        std = {name: np.sqrt(np.maximum(values, 1e-300)) for name, values in variances.items()}
        chance = self.event.chance(mean, std)
        return np.minimum(chance, 1.0 - chance)

    def checks(self, sample: Sample, chance: Array, first: bool) -> Array:
        """Return points where a surrogate that missed something would show it."""
        happens = sample.weights * chance
        directions = self.random_state.normal(size=(CHECKS, self.d))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        likeliest = sample.points[np.argmax(happens)]
        points = directions * np.linalg.norm(likeliest)
        total = float(happens.sum())
        if first:
            points[0] = -likeliest
        elif total > 0.0:
            drawn = self.random_state.choice(len(happens), p=happens / total)
            points[0] = sample.points[drawn]
        return points

    def surprised(self, points: Array) -> bool:
        """Run the checks, and return whether one is far from what was predicted."""
        mean, std = self.moments(points)
        true = self.run(points)
        surprises = False
        for limit in self.event.limits:
            off = np.abs(true[limit.response] - mean[limit.response])
            apart = UNALIKE * np.abs(limit.margin(mean))
            surprises |= bool(np.any(off > np.maximum(SURPRISE * std[limit.response], apart)))
        return surprises

    def surrogate_error(self, sample: Sample, chance: Array) -> float:
        """Return the standard error that the surrogate leaves in the mean of the chances."""
        doubt = sample.weights * np.sqrt(chance * (1.0 - chance))
        order = np.argsort(-doubt)
        inside, outside = order[:SIMULATED], order[SIMULATED:]
        points = sample.points[inside]
        cube = self.cube(points)
        mean, _ = self.moments(points)
        drawn = {
            name: draws(mean[name], response.covariance(cube), SIMULATIONS, self.random_state)
            for name, response in self.posteriors.items()
        }
        happens = self.event.margin(drawn) > 0.0
        count = len(sample.points)
        of_draws = float(np.std(happens @ sample.weights[inside])) / count
        return of_draws + float(doubt[outside].sum()) / count


def learnt_limit_state(
    function: Callable[[Array], Mapping[str | None, Array]],
    event: Event,
    d: int,
    cube: Callable[[Array], Array],
    accuracy: float,
    budget: int,
    random_state: np.random.Generator,
    at_once: int = 1,
) -> LimitState:
    """Return the probability of an event, from as few runs as its accuracy takes.

    Parameters
    ----------
    function : callable
        Maps points of shape (n, d) in standard normal space to responses by name, shape (n,) each,
        NaN where it fails.
    event : Event
        Of these responses.
    d : int
        Number of standard normal variables.
    cube : callable
        Maps points of shape (n, d) to the coordinates of the surrogate in -1..1.
    accuracy : float
        Half-width of the 95 % band, as a share of the probability.
    budget : int
        Most runs.
    random_state : numpy.random.Generator
    at_once : int
        Runs that are chosen together.
    """
    learner = _Learner(function, event, d, cube, random_state)
    with warnings.catch_warnings():
        # Any number of points will do here, not only a power of 2.
        warnings.simplefilter("ignore", UserWarning)
        spread = scipy.stats.qmc.Sobol(d, rng=random_state).random(min(first_runs(d), budget))
    learner.run(FIRST_SPREAD * scipy.special.ndtri(np.clip(spread, 1e-9, 1.0 - 1e-9)))
    passed = 0
    while True:
        learner.fit()
        sample = sample_of(learner.mixture(POINTS, SAMPLED), random_state)
        chance = learner.chance(sample.points)
        probability, _ = sample.mean(chance)
        doubt, _ = sample.mean(np.sqrt(chance * (1.0 - chance)))
        certain = Z * doubt <= OF_SURROGATE * accuracy * max(probability, LEAST)
        if (certain and passed >= ROUNDS_OF_CHECKS) or len(learner.points) >= budget:
            break
        left = budget - len(learner.points)
        if certain:
            checks = learner.checks(sample, chance, not passed)[:left]
            passed = 0 if learner.surprised(checks) else passed + 1
        else:
            passed = 0
            learner.run(learner.best(sample, chance, min(at_once, left)))
    return _result(learner, accuracy, certain and passed >= ROUNDS_OF_CHECKS)


def _result(learner: _Learner, accuracy: float, confirmed: bool) -> LimitState:
    count = 2 * SAMPLED
    while True:
        sample = sample_of(learner.mixture(2 * POINTS, count), learner.random_state)
        chance = learner.chance(sample.points)
        probability, sampling = sample.mean(chance)
        if Z * sampling <= OF_SAMPLE * accuracy * probability or count >= LARGEST_SAMPLE:
            break
        count *= 4
    error = learner.surrogate_error(sample, chance)
    good = learner.good
    return LimitState(
        probability,
        error,
        sampling,
        sample,
        chance,
        len(learner.points),
        learner.points[~good],
        confirmed,
        learner.posteriors,
    )


def first_runs(d: int) -> int:
    """Return the number of runs before the first surrogate."""
    return FIRST_RUNS + 2 * d
