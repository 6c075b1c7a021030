"""Accuracy for the cost: test error of several surrogates over their model runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import chaospy
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, YELLOW, grid
from experiments.comparing.runs import robust_problem
from experiments.paper.table5 import N_TEST, TEST_SEED
from experiments.published_values import TABLE_5
from experiments.runner.result import Cell, Column, Finding, Table
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    accuracy,
    latin_hypercube,
    sobol_indices_over_box,
)
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes

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
