"""What would be chosen on a surrogate whose nodes carry noise: the spread of the optima.

The optimiser saw one surrogate with one noise polynomial, and chose what that made best. Many such
polynomials say which fronts and which designs a model can give. Where the published ones lie within
that spread, the model and the noise explain them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.paper.inference.likelihood import BAND, BOX, FRONT_WIDTHS
from experiments.paper.inference.moments import TensorSurrogate
from experiments.paper.inference.node_noise import grid_influence
from experiments.paper.inference.rungs import Rung
from experiments.published_values import TABLE_9
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia

PER_AXIS = 5
"""Designs on each axis of the box: K, J_in, B_in and B_fc. Noise makes B_in matter, too."""
DRAWN = 400
SEED = 3
RANGE = (2.5, 97.5)
"""Percentiles of a 95 % range."""
FEATURES = ("width of the mean", "width of the std", *(f"K {name}" for name in PREFERENCES))
"""Of a front, arcsec, and of the three designs chosen from it, as a share of the nominal K."""


@dataclass(frozen=True)
class NoisyChoice:
    """Ranges of `FEATURES` over noise polynomials, (5, 2), and the published values, (5,)."""

    ranges: NDArray[np.float64]
    published: NDArray[np.float64]

    @property
    def holds_the_published(self) -> bool:
        """Whether every published value lies within its range."""
        low, high = self.ranges.T
        return bool(np.all((low <= self.published) & (self.published <= high)))


def noisy_choice(
    rung: Rung, parameters: dict[str, float], node_noise: float, n: int = DRAWN
) -> NoisyChoice:
    """Return what preferences choose under n noise polynomials of this size in arcsec."""
    surrogate = TensorSurrogate.fit(rung, parameters)
    nominal = surrogate.model.nominal[1:]
    shares = 1.0 + np.linspace(-BOX, BOX, PER_AXIS)
    grid = np.stack(np.meshgrid(*[shares] * len(nominal), indexing="ij"), axis=-1)
    designs = grid.reshape(-1, len(nominal))
    found = grid_influence(surrogate, nominal * designs, BAND)
    noise = node_noise * np.random.default_rng(SEED).standard_normal((n, found.of_means.shape[1]))
    objectives = np.stack(
        [found.means + noise @ found.of_means.T, found.stds + noise @ found.of_stds.T], axis=-1
    )
    features = np.array([_features(values, designs[:, 0]) for values in objectives])
    # Rounded to four digits, one of the printed values lies outside the box.
    stiffness = [min(TABLE_9[name][0] / nominal[0], 1.0 + BOX) for name in PREFERENCES]
    published = np.array([*FRONT_WIDTHS, *stiffness])
    return NoisyChoice(np.percentile(features, RANGE, axis=0).T, published)


def _features(
    objectives: NDArray[np.float64], stiffness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `FEATURES` of designs with objectives (n, 2) and shares of the nominal K, (n,)."""
    order = np.lexsort((objectives[:, 1], objectives[:, 0]))
    lowest = np.minimum.accumulate(objectives[order, 1])
    front = order[np.concatenate([[True], objectives[order[1:], 1] < lowest[:-1]])]
    chosen = [
        front[WeightedUtopia(weights).do(objectives[front])] for weights in PREFERENCES.values()
    ]
    first, last = objectives[chosen[0]], objectives[chosen[-1]]
    return np.array([last[0] - first[0], first[1] - last[1], *stiffness[chosen]])
