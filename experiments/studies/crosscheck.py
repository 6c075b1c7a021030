"""Our moments and indices beside chaospy's, and whether 1024 model runs are needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import chaospy
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from tqdm import tqdm

from experiments.paper.choices import scatter_indices, study_designs
from experiments.paper.scatter import theta_s_of
from experiments.paper.table5 import N_TEST, TEST_SEED
from experiments.published_values import REEVALUATION_LIMITS, TABLE_5
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, YELLOW, grid
from pymoo_hdte._comparing.models import models_of
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.result import Cell, Column, Finding, Picture, Result, Table, significant
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    SobolIndices,
    TruncatedNormal,
    UniformBand,
    accuracy,
    latin_hypercube,
    sobol_indices_over_box,
)
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes
from pymoo_hdte.units import ARCSEC

Points = NDArray[np.float64]
Function = Callable[[Points], NDArray[np.float64]]

TENSOR = "Chebyshev tensor grid"
SCREENED = "Chebyshev grid, idle parameters held"
TENSOR_CHAOS = "chaospy, tensor Gauss quadrature"
SPARSE_CHAOS = "chaospy, sparse (Smolyak) quadrature"
SOBOL_CHAOS = "chaospy, total degree, Sobol points"
LATIN_CHAOS = "chaospy, total degree, Latin hypercube"

FAMILIES = (TENSOR, SCREENED, TENSOR_CHAOS, SPARSE_CHAOS, SOBOL_CHAOS, LATIN_CHAOS)

IDLE = 1e-4
"""A parameter whose total Sobol index is below this on the coarsest grid is held at its centre."""

_TENSOR_ORDERS = (1, 2, 3, 4, 5)
_QUADRATURE_ORDERS = (1, 2, 3)
_SPARSE_ORDERS = (1, 2, 3, 4)
_DEGREES = (1, 2, 3, 4, 5, 6)
_POINTS_PER_TERM = 2
_SEED = 4


@dataclass(frozen=True)
class Rival:
    """A surrogate, how it was made, and the model runs it took."""

    family: str
    order: int
    runs: int
    predict: Function


def rivals(function: Function, box: Box) -> Iterator[Rival]:
    """Yield surrogates of ``function`` on the box, of every family and order.

    Parameters
    ----------
    function : callable
        Maps points (n, d) in the box to values (n,).
    box : Box
    """
    for order in _TENSOR_ORDERS:
        surrogate = ChebyshevSurrogate.fit(function, box, order)
        yield Rival(TENSOR, order, (order + 1) ** len(box), surrogate)
    yield from _screened(function, box)
    joint = chaospy.J(*[chaospy.Uniform(-1, 1) for _ in box.names])

    def on_cube(cube: Points) -> NDArray[np.float64]:
        return function(box.from_cube(cube.T))

    for order in _QUADRATURE_ORDERS:
        yield _by_quadrature(TENSOR_CHAOS, on_cube, box, joint, order)
    for order in _SPARSE_ORDERS:
        yield _by_quadrature(SPARSE_CHAOS, on_cube, box, joint, order)
    for degree in _DEGREES:
        expansion = chaospy.generate_expansion(degree, joint, normed=True)
        count = _POINTS_PER_TERM * len(expansion)
        scattered = {
            SOBOL_CHAOS: joint.sample(count, rule="sobol"),
            LATIN_CHAOS: box.to_cube(latin_hypercube(box, count, _SEED)).T,
        }
        for family, nodes in scattered.items():
            fitted = chaospy.fit_regression(expansion, nodes, on_cube(nodes))
            yield Rival(family, degree, count, _predictor(fitted, box))


def _screened(function: Function, box: Box) -> Iterator[Rival]:
    """Yield tensor grids in the parameters that matter on the coarsest grid, whose runs count."""
    coarse = ChebyshevSurrogate.fit(function, box, 1)
    active = sobol_indices_over_box(coarse, box).total >= IDLE
    for order in _TENSOR_ORDERS:
        sizes = np.where(active, order + 1, 1)
        surrogate = fit_grid(function, box, sizes.tolist())
        yield Rival(SCREENED, order, 2 ** len(box) + int(np.prod(sizes)), surrogate)


def fit_grid(function: Function, box: Box, sizes: Sequence[int]) -> ChebyshevSurrogate:
    """Interpolate at a tensor grid with its own number of Chebyshev nodes in every variable."""
    grid = np.meshgrid(*[chebyshev_nodes(size) for size in sizes], indexing="ij")
    nodes = box.from_cube(np.stack(grid, axis=-1).reshape(-1, len(box)))
    return ChebyshevSurrogate(box, coefficients_from_nodes(function(nodes).reshape(sizes)))


def _by_quadrature(
    family: str, on_cube: Function, box: Box, joint: chaospy.Distribution, order: int
) -> Rival:
    sparse = family == SPARSE_CHAOS
    truncation = {} if sparse else {"cross_truncation": np.inf}
    expansion = chaospy.generate_expansion(order, joint, normed=True, **truncation)
    nodes, weights = chaospy.generate_quadrature(order, joint, rule="gaussian", sparse=sparse)
    fitted = chaospy.fit_quadrature(expansion, nodes, weights, on_cube(nodes))
    return Rival(family, order, nodes.shape[1], _predictor(fitted, box))


def _predictor(polynomial: chaospy.ndpoly, box: Box) -> Function:
    def predict(points: Points) -> NDArray[np.float64]:
        return np.asarray(polynomial(*box.to_cube(points).T))

    return predict


PAPER_ORDER = 3
PAPER_RUNS = 1024
ROUGHLY = 1.001
"""An RMSE within this factor of a target reaches it."""

STYLES = dict(
    zip(
        FAMILIES,
        (
            (BLUE, "o-"),
            (GREEN, "s-"),
            (PINK, "D--"),
            (GREY, "v--"),
            (ORANGE, "^--"),
            (YELLOW, "<--"),
        ),
        strict=True,
    )
)


@dataclass(frozen=True)
class Trial:
    """Test error in arcsec of one surrogate of one model."""

    model: str
    family: str
    order: int
    runs: int
    rmse: float
    max_error: float


def trials_of(models: Sequence[str]) -> Iterator[Trial]:
    """Build every surrogate of the models and test it on the first hypercube of Table 5."""
    for name in models:
        problem = robust_problem(name)
        box, model = problem.surrogate.box, problem.model
        points = latin_hypercube(box, N_TEST, TEST_SEED)
        actual = model.dte_arcsec(points)
        for rival in tqdm(
            rivals(model.dte_arcsec, box), desc=f"surrogates of {name}", delay=2.0, leave=False
        ):
            errors = accuracy(rival.predict(points), actual)
            yield Trial(name, rival.family, rival.order, rival.runs, errors.rmse, errors.max_error)


def _models(trials: Sequence[Trial]) -> list[str]:
    return list(dict.fromkeys(trial.model for trial in trials))


def needed_table(trials: Sequence[Trial]) -> Table:
    """Tabulate the least model runs that reach the accuracy of the Chebyshev grid."""
    rows: list[tuple[Cell, ...]] = []
    for model in _models(trials):
        targets = _targets(model, trials)
        for family in STYLES:
            needed = [_least_runs(model, family, rmse, trials) for rmse in targets]
            rows.append((model, family, *needed))
    columns = (
        Column("model"),
        Column("surrogate"),
        Column(f"RMSE of the Chebyshev grid of {PAPER_RUNS}", group="least model runs to reach"),
        Column(
            f"the paper's RMSE, {TABLE_5[PAPER_ORDER].rmse_arcsec} arcsec",
            group="least model runs to reach",
        ),
    )
    note = "Among the orders tried, listed below. A dash: none of them reaches it."
    findings = tuple(_needed_finding(model, trials) for model in _models(trials))
    title = f"Are {PAPER_RUNS} runs needed?"
    return Table("needed", title, columns, tuple(rows), note=note, findings=findings)


def _targets(model: str, trials: Sequence[Trial]) -> tuple[float, float]:
    grids = (t for t in trials if (t.model, t.family) == (model, TENSOR))
    return next(t.rmse for t in grids if t.runs == PAPER_RUNS), TABLE_5[PAPER_ORDER].rmse_arcsec


def _least_runs(model: str, family: str, rmse: float, trials: Sequence[Trial]) -> int | None:
    reached = (
        t.runs
        for t in trials
        if (t.model, t.family) == (model, family) and t.rmse <= rmse * ROUGHLY
    )
    return min(reached, default=None)


def _needed_finding(model: str, trials: Sequence[Trial]) -> Finding:
    least = []
    for rmse in _targets(model, trials):
        runs = {family: _least_runs(model, family, rmse, trials) for family in STYLES}
        reached = {family: count for family, count in runs.items() if count is not None}
        best = min(reached, key=lambda family: reached[family], default=None)
        least.append(None if best is None else (reached[best], best))
    same, paper = least
    texts = [
        "none of the surrogates" if entry is None else f"{entry[0]} runs ({entry[1]})"
        for entry in (same, paper)
    ]
    fewer = any(entry is not None and entry[0] < PAPER_RUNS for entry in least)
    return Finding(
        not fewer,
        f"On {model}, the accuracy of the Chebyshev grid of {PAPER_RUNS} runs is reached by "
        f"{texts[0]}, the RMSE that the paper prints for it by {texts[1]}; the paper spends "
        f"{PAPER_RUNS}.",
        answers=model == "calibrated",
    )


def trials_table(trials: Sequence[Trial]) -> Table:
    """Tabulate all test errors."""
    rows = tuple((t.model, t.family, t.order, t.runs, t.rmse, t.max_error) for t in trials)
    columns = (
        Column("model"),
        Column("surrogate"),
        Column("order or degree"),
        Column("model runs"),
        Column("RMSE", "arcsec", 3),
        Column("max error", "arcsec", 3),
    )
    title = f"Every surrogate tried, at {N_TEST} test points"
    return Table("surrogates", title, columns, rows, folded=True)


def error_over_runs(trials: Sequence[Trial]) -> Figure:
    """Draw the test error over the number of model runs, one panel a model."""
    figure, axes = grid(1, len(_models(trials)), width=5.2, height=4.0)
    for model, axis in zip(_models(trials), axes[0], strict=True):
        for family, (colour, style) in STYLES.items():
            chosen = [t for t in trials if (t.model, t.family) == (model, family)]
            runs, errors = [t.runs for t in chosen], [t.rmse for t in chosen]
            axis.loglog(runs, errors, style, color=colour, markersize=5, mfc="none", label=family)
        axis.axhline(TABLE_5[PAPER_ORDER].rmse_arcsec, color="black", linestyle=":", linewidth=1)
        axis.axvline(PAPER_RUNS, color="black", linestyle=":", linewidth=1)
        axis.yaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_major_formatter("{x:g}")
        axis.set_title(model, fontsize=10)
        axis.set_xlabel("model runs")
    axes[0, 0].set_ylabel("RMSE at the test points [arcsec]")
    labelled = axes[0, 0].get_legend_handles_labels()
    figure.legend(*labelled, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


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
