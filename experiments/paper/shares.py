"""Sobol indices of a robust problem: of the DTE over its scatter, of the moments over designs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from experiments.paper.choices import BAND, INITIAL
from experiments.paper.scatter import Inputs, scatter_of
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.problems.drive_response import SURROGATE_BOX
from pymoo_hdte.surrogate import (
    ChebyshevSurrogate,
    SobolIndices,
    TruncatedNormal,
    UniformBand,
    sobol_indices,
    sobol_indices_over_box,
)


def study_designs(problem: RobustDTE) -> Iterator[tuple[str, tuple[float, ...], float]]:
    """Yield name, design (4,) and band of the initial and the chosen designs.

    The initial design comes with the range of the surrogate and with the band of the optima; the
    three preferences choose from the true front of the order-3 surrogate.
    """
    initial = tuple(problem.nominal.tolist())
    yield INITIAL, initial, SURROGATE_BOX
    yield INITIAL, initial, BAND
    front, designs = problem.pareto_front(), problem.pareto_set()
    for preference, weights in PREFERENCES.items():
        chosen = designs[WeightedUtopia(weights).do(front)]
        yield preference.replace("_", " "), tuple(chosen.tolist()), BAND


def halved(inputs: Inputs, axis: int) -> Inputs:
    """Return the scatter with that of one parameter halved."""
    entry = inputs[axis]
    narrower: TruncatedNormal | UniformBand
    if isinstance(entry, TruncatedNormal):
        narrower = replace(entry, std=entry.std / 2.0)
    else:
        narrower = UniformBand(entry.tolerance / 2.0)
    return [*inputs[:axis], narrower, *inputs[axis + 1 :]]


def scatter_indices(problem: RobustDTE, design: ArrayLike, tolerance: float) -> SobolIndices:
    """Return the indices of the DTE of a design (4,) over `PARAMETERS`, in arcsec."""
    return sobol_indices(problem.surrogate, scatter_of(problem, tolerance), design)


def falls_when_halved(
    problem: RobustDTE, design: ArrayLike, tolerance: float
) -> tuple[float, list[float]]:
    """Return the std of the DTE in arcsec, and by how many percent it falls for each parameter."""
    inputs = scatter_of(problem, tolerance)

    def std(scatter: Inputs) -> float:
        return float(np.sqrt(sobol_indices(problem.surrogate, scatter, design).variance))

    now = std(inputs)
    after = [std(halved(inputs, axis)) for axis in range(len(inputs))]
    return now, [100.0 * (1.0 - value / now) for value in after]


def design_indices(problem: RobustDTE) -> dict[str, SobolIndices]:
    """Return the indices of mean and variance of the DTE for designs uniform over the design box.

    Both are polynomials of the design, of the surrogate's degree and of twice that (see
    `ExactMoments`), so interpolating them at these orders is exact.
    """
    order = max(problem.surrogate.orders)
    box = problem.moments.design_box
    mean = ChebyshevSurrogate.fit(lambda u: problem.moments(u)[0], box, order)
    variance = ChebyshevSurrogate.fit(lambda u: problem.moments(u)[1] ** 2, box, 2 * order)
    return {
        "mean": sobol_indices_over_box(mean, box),
        "variance": sobol_indices_over_box(variance, box),
    }
