"""Our moments and indices beside chaospy's, and whether 1024 model runs are needed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import chaospy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.comparing.runs import robust_problem
from experiments.paper.models import models_of
from experiments.paper.scatter import theta_s_of
from experiments.paper.shares import scatter_indices, study_designs
from experiments.published_values import REEVALUATION_LIMITS
from experiments.runner.registry import Context
from experiments.runner.result import Column, Finding, Picture, Result, Table, significant
from experiments.runner.texts import paragraphs
from experiments.studies.accuracy_per_run import (
    N_TEST,
    PAPER_ORDER,
    PAPER_RUNS,
    error_over_runs,
    needed_table,
    trials_of,
    trials_table,
)
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import SobolIndices, TruncatedNormal, UniformBand
from pymoo_hdte.units import ARCSEC

MODELS = ("calibrated", "resonant")
AGREEMENT = 1e-8

(SETTING,) = paragraphs("crosscheck", n_test=N_TEST)


def run(context: Context) -> Result:
    """Compare with chaospy, then compare surrogates."""
    trials = list(trials_of(MODELS))
    return Result(
        title="Cross-checks with chaospy, and accuracy per model run",
        command="python -m experiments crosscheck",
        paragraphs=(SETTING,),
        models=models_of(*MODELS),
        tables=(
            _distributions_table(),
            _moments_table(),
            needed_table(trials),
            trials_table(trials),
        ),
        pictures=(
            Picture(
                "runs",
                "Test error over model runs. Dotted: the RMSE of the paper's surrogate of "
                f"{PAPER_RUNS} runs, and that number of runs.",
                error_over_runs(trials),
            ),
        ),
    )


def _distributions_table() -> Table:
    band = UniformBand(0.05)
    entries: dict[str, TruncatedNormal | UniformBand] = {f"factor of ±{band.tolerance:.0%}": band}
    for model in PRESETS:
        theta_s = theta_s_of(robust_problem(model))
        in_arcsec = TruncatedNormal(theta_s.mean / ARCSEC, theta_s.std / ARCSEC, theta_s.cut)
        entries[f"theta_s of {model} [arcsec]"] = in_arcsec
    pairs = {name: (_std_and_kurtosis(e), _twin_of(e)) for name, e in entries.items()}
    rows = tuple(
        (name, ours[0], theirs[0], ours[1], theirs[1]) for name, (ours, theirs) in pairs.items()
    )
    worst = max(np.abs(np.divide(ours, theirs) - 1.0).max() for ours, theirs in pairs.values())
    columns = [Column("distribution")]
    for name in ("standard deviation", "excess kurtosis"):
        columns += [Column(by, "", 8, name) for by in ("ours", "chaospy")]
    finding = Finding(
        worst <= AGREEMENT,
        "Standard deviation and kurtosis of our distributions are chaospy's to "
        f"{significant(worst, 2)}.",
        check=True,
    )
    title = "Distributions of the inputs"
    return Table("distributions", title, tuple(columns), rows, findings=(finding,))


def _std_and_kurtosis(entry: TruncatedNormal | UniformBand) -> tuple[float, float]:
    values, weights = entry.quadrature(4)
    deviation = values - weights @ values
    variance = weights @ deviation**2
    return float(np.sqrt(variance)), float(weights @ deviation**4 / variance**2 - 3.0)


def _twin_of(entry: TruncatedNormal | UniformBand) -> tuple[float, float]:
    twin = distribution_of(entry)
    return float(chaospy.Std(twin)), float(chaospy.Kurt(twin))


def _moments_table() -> Table:
    comparisons = list(_comparisons())
    rows = tuple(
        (
            model,
            label,
            comparison.ours.mean,
            float(np.sqrt(comparison.ours.variance)),
            comparison.moments,
            comparison.indices,
            100.0 * comparison.surrogate_mean,
            100.0 * comparison.surrogate_std,
        )
        for model, label, comparison in comparisons
    )
    columns = (
        Column("model"),
        Column("design, band"),
        Column("mean", "arcsec", 5, "ours"),
        Column("std", "arcsec", 5, "ours"),
        Column("moments, relative", "", 2, "largest difference from chaospy"),
        Column("Sobol indices", "", 2, "largest difference from chaospy"),
        Column("mean", "%", 2, "error of the surrogate of 1024 runs"),
        Column("std", "%", 2, "error of the surrogate of 1024 runs"),
    )
    worst = max(max(comparison.moments, comparison.indices) for *_, comparison in comparisons)
    agreement = Finding(
        worst <= AGREEMENT,
        "Exact moments and Sobol indices of the surrogate are chaospy's to "
        f"{significant(worst, 2)}.",
        check=True,
        answers=True,
    )
    by_model = {name: [f for model, _, f in comparisons if model == name] for name in MODELS}
    findings = (agreement, *[_surrogate_finding(*entry) for entry in by_model.items()])
    note = (
        "chaospy integrates by its own Gauss rules and takes indices from an expansion with all "
        f"products up to degree {PAPER_ORDER}. Errors of the surrogate: its mean and standard "
        "deviation against those of the drive model itself, run at the nodes of the same rule."
    )
    title = "Moments and Sobol indices of the DTE"
    return Table("agreement", title, columns, rows, note=note, findings=findings)


def _surrogate_finding(model: str, comparisons: Sequence[Comparison]) -> Finding:
    mean = 100.0 * max(abs(comparison.surrogate_mean) for comparison in comparisons)
    std = 100.0 * max(abs(comparison.surrogate_std) for comparison in comparisons)
    limit = REEVALUATION_LIMITS["mean_percent"]
    return Finding(
        mean <= limit,
        f"On {model}, mean and standard deviation on the surrogate of {PAPER_RUNS} runs are within "
        f"{significant(mean, 2)} % and {significant(std, 2)} % of the drive model's own; the paper "
        f"asks {limit} % of the mean when it samples its surrogate anew.",
        check=True,
    )


def _comparisons() -> Iterator[tuple[str, str, Comparison]]:
    twin = chaos(PAPER_ORDER, theta_s_of(robust_problem(MODELS[0])).cut)
    for name in MODELS:
        problem = robust_problem(name)
        for label, design, tolerance in study_designs(problem):
            yield (
                name,
                f"{label}, ±{100 * tolerance:g} %",
                compare(twin, problem, design, tolerance),
            )


def distribution_of(entry: TruncatedNormal | UniformBand) -> chaospy.Distribution:
    """Return chaospy's distribution of the standard variable of an input, in physical units."""
    low, high = entry.support
    if isinstance(entry, TruncatedNormal):
        return chaospy.TruncNormal(lower=low, upper=high, mu=entry.mean, sigma=entry.std)
    return chaospy.Uniform(low, high)


@dataclass(frozen=True)
class Chaos:
    """An expansion with every product of polynomials up to one degree, orthonormal in chaospy.

    Attributes
    ----------
    expansion : chaospy.ndpoly, length t
    values : ndarray, shape (t, n)
        Of every term at the nodes.
    nodes : ndarray, shape (5, n)
        Gauss nodes in standard variables.
    weights : ndarray, shape (n,)
    """

    expansion: chaospy.ndpoly
    values: NDArray[np.float64]
    nodes: NDArray[np.float64]
    weights: NDArray[np.float64]

    def points(
        self, theta_s: TruncatedNormal, design: ArrayLike, tolerance: float
    ) -> NDArray[np.float64]:
        """Return the nodes in physical units, shape (n, 5), for a design (4,) and its bands."""
        centre = np.concatenate([[theta_s.mean], np.asarray(design)])
        scale = np.concatenate([[theta_s.std], tolerance * np.asarray(design)])
        return centre + scale * self.nodes.T

    def moments(self, values: NDArray[np.float64]) -> tuple[float, float]:
        """Return mean and std of an output from its values (n,) at the nodes."""
        mean = self.weights @ values
        return float(mean), float(np.sqrt(self.weights @ (values - mean) ** 2))

    def indices(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return first and total Sobol indices, shape (2, 5), of the expansion of an output."""
        coefficients = self.values @ (self.weights * values)
        first_order = chaospy.FirstOrderSobol(self.expansion, coefficients)
        return np.array([first_order, chaospy.TotalOrderSobol(self.expansion, coefficients)])


def chaos(degree: int, cut: float) -> Chaos:
    """Return the expansion for a normal variable cut at +-``cut`` and four uniform ones."""
    normal = chaospy.TruncNormal(lower=-cut, upper=cut, mu=0.0, sigma=1.0)
    joint = chaospy.J(normal, *[chaospy.Uniform(-1.0, 1.0) for _ in range(4)])
    expansion = chaospy.generate_expansion(degree, joint, cross_truncation=np.inf, normed=True)
    nodes, weights = chaospy.generate_quadrature(degree, joint, rule="gaussian")
    return Chaos(expansion, np.array(expansion(*nodes)), nodes, weights)


@dataclass(frozen=True)
class Comparison:
    """Ours and chaospy's at one design.

    Attributes
    ----------
    ours : SobolIndices
    moments, indices : float
        Largest relative difference of mean and std, largest difference of the indices.
    surrogate_mean, surrogate_std : float
        Relative differences of the surrogate's moments from the drive model's own, both by
        chaospy's quadrature.
    """

    ours: SobolIndices
    moments: float
    indices: float
    surrogate_mean: float
    surrogate_std: float


def compare(twin: Chaos, problem: RobustDTE, design: ArrayLike, tolerance: float) -> Comparison:
    """Compare moments and indices of the DTE at a design (4,) with chaospy's."""
    ours = scatter_indices(problem, design, tolerance)
    points = twin.points(theta_s_of(problem), design, tolerance)
    values = problem.surrogate(points)
    theirs = np.array(twin.moments(values))
    mine = np.array([ours.mean, np.sqrt(ours.variance)])
    by_surrogate = theirs / twin.moments(problem.model.dte_arcsec(points)) - 1.0
    return Comparison(
        ours=ours,
        moments=float(np.abs(mine / theirs - 1.0).max()),
        indices=float(np.abs(twin.indices(values) - [ours.first, ours.total]).max()),
        surrogate_mean=float(by_surrogate[0]),
        surrogate_std=float(by_surrogate[1]),
    )
