"""One function as a robust design task: designs, scatter, points that all methods are judged at."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

# Its statistics load when they are first used.
import scipy
from numpy.typing import NDArray

from experiments.studies.robust.functions import BY_NAME, Normal, Uniform
from pymoo_hdte.problems import Design
from pymoo_hdte.problems._simulator.inputs import Inputs

Array = NDArray[np.float64]

DESIGNS = 200
JUDGED = 256
"""Draws of the scatter at every design at which surrogates are compared with the function."""
OF_FIELD = 4
"""Values of a field that others are tried on, each by itself; ours is on all of them."""
TRUE_DRAWS = 2**14
"""Draws at every design for the true mean and deviation; these are off by some 0.01 %."""
MIDDLE = 0.25
"""Designs are the middle half of an input's range and deviate by a quarter of it to either side."""


class Task:
    """A function, its designs and scatter, and its true moments.

    Parameters
    ----------
    name : str
        Of one of the `FUNCTIONS`.
    """

    def __init__(self, name: str) -> None:
        self.function = BY_NAME[name]
        self.names = tuple(self.function.laws)
        assert self.names[: len(self.function.designed)] == self.function.designed
        rng = np.random.default_rng(7)
        bounds = np.array([(design.lower, design.upper) for design in self.designs.values()])
        lower, upper = bounds.T
        self.X = rng.uniform(lower, upper, (DESIGNS, len(bounds)))

    def __call__(self, values: Array) -> Array:
        """Return the function, shape (n, r), at inputs of shape (n, d) in their units."""
        values = self.function.call(**dict(zip(self.names, values.T, strict=True)))
        return values.reshape(len(values), -1)

    @cached_property
    def designs(self) -> dict[str, Design]:
        """The designed inputs."""
        designs = {}
        for name in self.function.designed:
            low, high = self._ends(name)
            margin = MIDDLE * (high - low)
            deviation: Any = margin
            if self.function.normal_deviation:
                deviation = scipy.stats.norm(0.0, self.function.normal_deviation * (high - low))
            designs[name] = Design(low + margin, high - margin, deviation=deviation)
        return designs

    @cached_property
    def noise(self) -> dict[str, Any]:
        """The other inputs."""
        others = self.names[len(self.function.designed) :]
        return {name: _frozen(self.function.laws[name]) for name in others}

    @cached_property
    def inputs(self) -> Inputs:
        """Designs and noise as the package sees them."""
        return Inputs(self.designs, self.noise)

    @cached_property
    def germ(self) -> list[Uniform | Normal]:
        """What the other libraries build their expansions on, in the order of the inputs.

        The law of the noise, and a uniform one over what a designed input reaches with its scatter.
        """
        reach = self.inputs.reach()
        return [
            Uniform(*reach[name]) if name in self.function.designed else self.function.laws[name]
            for name in self.names
        ]

    def drawn(self, count: int, seed: int) -> Array:
        """Return inputs of shape (200, count, d): the same draws of the scatter at every design."""
        shares = scipy.stats.qmc.Sobol(len(self.names), rng=np.random.default_rng(seed))
        p = np.clip(shares.random(count), 1e-12, 1.0 - 1e-12)
        columns = []
        for j, name in enumerate(self.names):
            if j < self.X.shape[1]:
                deviation = self.designs[name].deviation
                law = (
                    deviation
                    if hasattr(deviation, "ppf")
                    else _frozen(Uniform(-deviation, deviation))
                )
                columns.append(self.X[:, j, None] + law.ppf(p[:, j]))
            else:
                own = self.noise[name].ppf(p[:, j])
                columns.append(np.broadcast_to(own, (DESIGNS, count)))
        return np.stack(columns, axis=-1)

    @cached_property
    def judged(self) -> tuple[Array, Array]:
        """Inputs of shape (200, 256, d) at which surrogates are compared, and the function there.

        The latter is of shape (200, 256, r), NaN where it fails.
        Those of an unbounded scatter are moved to the ends of the reach: no method has runs beyond.
        """
        points = self.drawn(JUDGED, 11)
        low, high = np.array(list(self.inputs.reach().values())).T
        points = np.clip(points, low, high)
        values = self(points.reshape(-1, len(self.names)))
        return points, values.reshape(DESIGNS, JUDGED, -1)

    @cached_property
    def true_moments(self) -> tuple[Array, Array]:
        """Mean and standard deviation at the designs where it does not fail, (200, r) each."""
        points = self.drawn(TRUE_DRAWS, 13)
        values = [self(block) for block in points]
        return (
            np.array([np.nanmean(block, axis=0) for block in values]),
            np.array([np.nanstd(block, axis=0) for block in values]),
        )

    @cached_property
    def tried(self) -> list[int]:
        """Which of the values others are tried on: all, or a few over a field."""
        count = self.judged[1].shape[2]
        return np.unique(np.linspace(0, count - 1, OF_FIELD).round().astype(int)).tolist()

    def errors(self, estimates: Array) -> tuple[float, float]:
        """Return the errors of the standard deviation of a surrogate as shares of the true one.

        Of several values the larger ones, and only where the function does not fail.

        Parameters
        ----------
        estimates : ndarray, shape (200, 256, r) or (200, 256, len(tried))
            The surrogate at the judged points.

        Returns
        -------
        at_designs : float
            What 95 % of the designs stay below.
        overall : float
            Of the deviation over designs and scatter together.
        """
        _, true = self.judged
        if estimates.shape[2] < true.shape[2]:
            true = true[..., self.tried]
        estimates = np.where(np.isfinite(true), estimates, np.nan)
        ratios = np.abs(np.nanstd(estimates, axis=1) / np.nanstd(true, axis=1) - 1.0)
        together = np.nanstd(estimates, axis=(0, 1)) / np.nanstd(true, axis=(0, 1)) - 1.0
        return float(np.quantile(ratios, 0.95, axis=0).max()), float(np.abs(together).max())

    def _ends(self, name: str) -> tuple[float, float]:
        law = self.function.laws[name]
        if not isinstance(law, Uniform):
            raise TypeError(f"{name} is designed and not uniform")
        return law.lower, law.upper


def _frozen(law: Uniform | Normal) -> Any:
    if isinstance(law, Normal):
        return scipy.stats.norm(law.mean, law.std)
    return scipy.stats.uniform(law.lower, law.upper - law.lower)
