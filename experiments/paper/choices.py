"""The designs of Tables 8 and 9: the initial one and those that three preferences choose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.paper.scatter import Inputs, dte_samples, exact_moments, scatter_of
from experiments.published_values import TABLE_9, Moments
from pymoo_hdte._comparing.paired import designs, objectives
from pymoo_hdte._comparing.runs import OptimisationRun, robust_problem
from pymoo_hdte._runner.campaign import Campaign
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

MODEL = "calibrated"
INITIAL = "initial"
TRUE_FRONT = "front of the order-3 surrogate"
PAPER_DESIGN = "paper's design"
BAND = 0.05
"""Tolerance of every optimised design."""
RANDOM_DESIGNS = 100_000


@dataclass(frozen=True)
class Choice:
    """A design (K, J_in, B_in, B_fc) in SI units with the moments of its DTE in arcsec."""

    preference: str
    source: str
    design: tuple[float, ...]
    tolerance: float
    moments: Moments

    @property
    def name(self) -> str:
        """The preference in words."""
        return self.preference.replace("_", " ")

    @property
    def label(self) -> str:
        """Name for a legend."""
        return f"{self.name}, {self.source}"


def initial_choices() -> tuple[Choice, Choice]:
    """Return the nominal design under the paper's wide band and under the band of the optima."""
    problem = robust_problem(MODEL)
    wide, narrow = (
        Choice(
            INITIAL,
            f"±{100 * tolerance:g} %",
            tuple(problem.nominal.tolist()),
            tolerance,
            exact_moments(problem, problem.nominal, tolerance),
        )
        for tolerance in (SURROGATE_BOX, BAND)
    )
    return wide, narrow


def paper_choices(model: str = MODEL) -> list[Choice]:
    """Return the paper's own optima (Table 9) as a drive model sees them."""
    problem = robust_problem(model)
    return [
        Choice(preference, PAPER_DESIGN, design, BAND, exact_moments(problem, design, BAND))
        for preference, design in TABLE_9.items()
    ]


@cache
def dominating_shares(model: str) -> dict[str, float]:
    """Return the share of random designs in the box that dominate each of the paper's optima."""
    problem = robust_problem(model)
    rng = np.random.default_rng(1)
    drawn = rng.uniform(problem.xl, problem.xu, (RANDOM_DESIGNS, problem.n_var))
    evaluated = problem.evaluate(drawn)
    return {
        choice.name: float(np.mean(np.all(evaluated < np.array(choice.moments), axis=1)))
        for choice in paper_choices(model)
    }


def preferred_choices(campaign: Campaign) -> list[Choice]:
    """Return what every preference picks from AMP-MOPSO's archive, then from `TRUE_FRONT`."""
    problem = robust_problem(MODEL)
    (archive,) = campaign.run([OptimisationRun(MODEL, "AMP-MOPSO", seed=1)], "table8")
    sources = {
        "AMP-MOPSO": (designs(archive), objectives(archive)),
        TRUE_FRONT: (problem.pareto_set(), problem.pareto_front()),
    }
    return [
        _choose(preference, source, X, F)
        for source, (X, F) in sources.items()
        for preference in PREFERENCES
    ]


def _choose(preference: str, source: str, X: NDArray[np.float64], F: NDArray[np.float64]) -> Choice:
    picked = WeightedUtopia(PREFERENCES[preference]).do(F)
    moments = Moments(*F[picked].tolist())
    return Choice(preference, source, tuple(X[picked].tolist()), BAND, moments)


def dte_at(choice: Choice, n_samples: int, seed: int) -> NDArray[np.float64]:
    """Draw DTE values of a choice in arcsec, shape (n_samples,)."""
    return dte_samples(robust_problem(MODEL), choice.design, choice.tolerance, n_samples, seed)


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
