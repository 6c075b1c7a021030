"""The designs of Tables 8 and 9: the initial one and those that three preferences choose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.paired import designs, objectives
from experiments.comparing.runs import OptimisationRun, robust_problem
from experiments.paper.scatter import dte_samples, exact_moments
from experiments.published_values import TABLE_9, Moments
from experiments.runner.campaign import Campaign
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems.drive_response import SURROGATE_BOX

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
