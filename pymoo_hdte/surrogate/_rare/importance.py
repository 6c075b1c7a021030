"""Small probabilities of a function of standard normal variables, by adaptive importance sampling.

Points are drawn from mixtures of normal distributions that move, level by level, to where the
function fails and the normal density is largest; every region of failure gets its own component.
The estimate is made with fresh points of the last mixture (deterministic mixture weights: Owen and
Zhou, Journal of the American Statistical Association 95, 2000; adaptive mixtures: Cappe et al.,
Statistics and Computing 18, 2008). A wide component for the whole bounds the weights, so that a
region of failure that was missed shows itself if it is not much smaller than the found ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Margin = Callable[[Array], Array]
"""Maps points of shape (n, d) to (n,) values in any unit; what is above a level counts."""

FIRST_SCALES = (1.0, 1.6, 2.5)
"""Deviations of the first points: the normal distribution itself, and wider ones that see more."""
ROUNDS = 16
"""Most mixtures; each lowers the probability of its level by a factor of about ten."""
AT_LEVEL = 1.0 / 15.0
"""Points above a level, as a share of those of one round."""
AT_THE_END = 3
"""Rounds at the last level: the first has few points there."""
MOST_CLUSTERS = 8
SAME_CLUSTER = 0.6
"""Cosine of the angle, seen from the origin, within which points belong to one cluster."""
ROUND = 1.5
"""Deviation of a second, round component of every cluster, for what lies at its edges."""
LEFT_OUT = 0.005
"""Share of the probability that may lie in no cluster; the wide component covers it."""
WIDER = 1.3
"""Factor on the variances of a cluster: a component narrower than what it stands for is costly."""


@dataclass(frozen=True)
class Mixture:
    """A number of points from each of several normal distributions.

    Attributes
    ----------
    centres : ndarray, shape (k, d)
    factors : ndarray, shape (k, d, d)
        Lower triangular; their squares are the covariances.
    counts : ndarray of int, shape (k,)
        Points of each component.
    """

    centres: Array
    factors: Array
    counts: NDArray[np.int_]

    @classmethod
    def around_origin(cls, d: int, scales: tuple[float, ...], count: int) -> Mixture:
        """Return normal distributions of these deviations, ``count`` points each."""
        factors = np.array([scale * np.eye(d) for scale in scales])
        return cls(np.zeros((len(scales), d)), factors, np.full(len(scales), count))

    def beside(self, other: Mixture) -> Mixture:
        """Return the components of both."""
        parts = zip(
            (self.centres, self.factors, self.counts),
            (other.centres, other.factors, other.counts),
            strict=True,
        )
        return Mixture(*(np.concatenate(pair) for pair in parts))

    def draw(self, random_state: np.random.Generator) -> Array:
        """Return the points, shape (n, d)."""
        d = self.centres.shape[1]
        parts = zip(self.centres, self.factors, self.counts.tolist(), strict=True)
        return np.concatenate(
            [
                centre + random_state.normal(size=(count, d)) @ factor.T
                for centre, factor, count in parts
            ]
        )

    def log_weights(self, points: Array) -> Array:
        """Return the logarithm of the normal density over that of the mixture, shape (n,)."""
        terms = np.empty((len(points), len(self.centres)))
        for column, centre, factor in zip(terms.T, self.centres, self.factors, strict=True):
            z = (points - centre) @ np.linalg.inv(factor).T
            column[:] = -0.5 * np.einsum("nd,nd->n", z, z) - np.log(np.diag(factor)).sum()
        terms += np.log(self.counts / self.counts.sum())
        largest = terms.max(axis=1)
        mixture = largest + np.log(np.exp(terms - largest[:, None]).sum(axis=1))
        return -0.5 * np.sum(points**2, axis=1) - mixture


@dataclass(frozen=True)
class Sample:
    """Points of a mixture and what they weigh: the mean of weights times values estimates theirs.

    Attributes
    ----------
    points : ndarray, shape (n, d)
    weights : ndarray, shape (n,)
        Normal density over that of the mixture.
    counts : ndarray of int, shape (k,)
        Points of each component, in their order.
    """

    points: Array
    weights: Array
    counts: NDArray[np.int_]

    def mean(self, values: NDArray[Any]) -> tuple[float, float]:
        """Return the normal expectation of values, shape (n,), and its standard error."""
        terms = self.weights * values
        parts = np.split(terms, np.cumsum(self.counts)[:-1])
        variances = np.array([part.var(ddof=1) if len(part) > 1 else 0.0 for part in parts])
        error = float(np.sqrt(self.counts @ variances)) / len(terms)
        return float(terms.mean()), error


def sample_of(mixture: Mixture, random_state: np.random.Generator) -> Sample:
    """Return fresh points of a mixture with their weights."""
    points = mixture.draw(random_state)
    return Sample(points, np.exp(mixture.log_weights(points)), mixture.counts)


def adapted(
    margin: Margin,
    d: int,
    random_state: np.random.Generator,
    count: int = 1000,
    final: int = 4000,
    target: Callable[[Array, Array], float] = lambda values, weights: 0.0,
) -> Mixture:
    """Return a mixture for points above the target level of a margin.

    Parameters
    ----------
    margin : callable
        As `Margin`.
    d : int
        Number of variables.
    random_state : numpy.random.Generator
    count : int
        Points of one round, all of which the margin is asked for.
    final : int
        Points, about, of the mixture that is returned.
    target : callable
        The level, from values and weights of all points so far, shape (n,) each; 0 by default.
    """
    first = Mixture.around_origin(d, FIRST_SCALES, count // len(FIRST_SCALES))
    wide = Mixture.around_origin(d, FIRST_SCALES[:1], count // 10)
    points = first.draw(random_state)
    rounds = [(first, points, margin(points))]
    few, at_the_end = int(AT_LEVEL * count), 0
    for _ in range(ROUNDS):
        reached, clusters = _at_level(rounds, few, target)
        at_the_end += reached
        if at_the_end > AT_THE_END:
            break
        new = _of_clusters(clusters, int(0.9 * count)).beside(wide)
        points = new.draw(random_state)
        # The first round sees most of the whole, the last ones most of the level.
        rounds = [rounds[0], *rounds[1:][-2:], (new, points, margin(points))]
    narrow = _of_clusters(clusters, int(0.8 * final))
    round_ones = Mixture(
        narrow.centres,
        np.tile(ROUND * np.eye(d), (len(narrow.centres), 1, 1)),
        np.maximum(narrow.counts // 5, 2),
    )
    whole = Mixture.around_origin(d, FIRST_SCALES[:1], final // 20)
    return narrow.beside(round_ones).beside(whole)


Clusters = list[tuple[Array, Array, float]]
"""Centre, factor of the covariance and share of the probability."""


def _at_level(
    rounds: list[tuple[Mixture, Array, Array]],
    few: int,
    target: Callable[[Array, Array], float],
) -> tuple[bool, Clusters]:
    """Return whether enough points are above the target, and clusters of the highest points."""
    mixture = rounds[0][0]
    for other, _, _ in rounds[1:]:
        mixture = mixture.beside(other)
    points, values = (np.concatenate(arrays) for arrays in list(zip(*rounds, strict=True))[1:])
    log_weights = mixture.log_weights(points)
    wanted, highest = target(values, np.exp(log_weights)), float(np.sort(values)[-few])
    above = values >= min(wanted, highest)
    return wanted <= highest, _clusters(points[above], log_weights[above])


def _clusters(points: Array, log_weights: Array) -> Clusters:
    """Return clusters of weighted points by their direction, the weightiest first."""
    d = points.shape[1]
    weights = np.exp(log_weights - log_weights.max())
    total = float(weights.sum())
    directions = points / np.maximum(np.linalg.norm(points, axis=1), 1e-12)[:, None]
    free = np.ones(len(points), dtype=bool)
    clusters: Clusters = []
    while free.any() and len(clusters) < MOST_CLUSTERS and weights[free].sum() > LEFT_OUT * total:
        first = int(np.argmax(np.where(free, weights, -1.0)))
        near = free & (directions @ directions[first] > SAME_CLUSTER)
        near[first] = True
        free &= ~near
        own = weights[near]
        mass = float(own.sum())
        centre = own @ points[near] / mass
        apart = points[near] - centre
        # As many independent points as the weights are worth; d + 1 more say it is round.
        worth = mass**2 / float(own @ own)
        covariance = (worth * (own * apart.T) @ apart / mass + (d + 1) * np.eye(d)) / (
            worth + d + 1
        )
        clusters.append((centre, np.linalg.cholesky(WIDER * covariance), mass / total))
    left = float(weights[free].sum()) / total
    if left > LEFT_OUT:
        # All around, as outside a sphere: one component about the origin.
        spread = (weights * points.T) @ points / total
        clusters.append((np.zeros(d), np.linalg.cholesky(spread + 0.1 * np.eye(d)), left))
    return clusters


def _of_clusters(clusters: Clusters, count: int) -> Mixture:
    centres, factors, shares = zip(*clusters, strict=True)
    counts = np.maximum((count * np.array(shares) / sum(shares)).astype(int), max(count // 40, 2))
    return Mixture(np.array(centres), np.array(factors), counts)
