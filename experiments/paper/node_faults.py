"""Why Table 5 has order 4 worse than order 3: noise in all node runs, or a few faulty ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import gamma
from scipy.stats import gennorm

from experiments.published_values import TABLE_5
from experiments.runner.texts import paragraphs
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, grid
from pymoo_hdte._runner.result import Cell, Column, Finding, Table, significant
from pymoo_hdte.drive import PARAMETERS
from pymoo_hdte.surrogate.tensor import chebyshev_basis, coefficients_from_nodes, products

Array = NDArray[np.float64]

LOW, HIGH = 3, 4
"""The order that the paper chose, and the one that it found worse."""

FAULTY_RUNS = {1: "one faulty run", 3: "three faulty runs", 10: "ten faulty runs"}
EVERY_RUN = "noise in every run"
AS_PRINTED = f"as printed at k = {LOW}"
DRAWS = 20
"""Draws of faulty runs, or of noise, on each set of test points."""
SEED = 5
CENTRAL = (2.5, 50.0, 97.5)
WITHIN = 2.45
"""Standard deviations within which 95 % of a normal variable of two dimensions lie."""


(FAULTS_NOTE,) = paragraphs("node_faults", above=HIGH + 1, high=HIGH, low=LOW, within=WITHIN)


def share_of_noise(order: int, variables: int = len(PARAMETERS)) -> float:
    """Return the variance of an interpolant's noise, averaged over the cube, for noise of size 1.

    At p Chebyshev nodes the squares of the cardinal functions sum to
    (1 + 2 sum_m T_m^2) / p, m = 1 .. p - 1. The average of T_m^2 over -1 .. 1 is
    (1 - 1 / (4 m^2 - 1)) / 2, and those fractions sum to (p - 1) / (2 p - 1). One variable
    therefore gives 1 - (p - 1) / (p (2 p - 1)), and several variables its power.
    """
    p = order + 1
    return float((1.0 - (p - 1) / (p * (2 * p - 1))) ** variables)


def cardinal_functions(cube: Array, order: int) -> Array:
    """Return what a unit at each node adds to the interpolant at points, shape (n, p^d).

    Points of shape (n, d) in the cube -1..1; nodes in the order of `ChebyshevSurrogate.fit`.
    """
    coefficients = np.array([coefficients_from_nodes(unit) for unit in np.eye(order + 1)])
    basis = chebyshev_basis(cube.T, order + 1)
    values = np.tensordot(coefficients, basis, axes=(1, 0))
    return products(values, (order + 1,) * cube.shape[1]).T


def least_rmse_below() -> float:
    """Return the least RMSE at the lower order, in arcsec, that noise of any size allows.

    If the error without noise does not grow with the order, equal noise in all runs leaves the
    lower order with at least the ratio of the two shares of the printed mean square at the higher.
    """
    share = share_of_noise(LOW) / share_of_noise(HIGH)
    return float(np.sqrt(share) * TABLE_5[HIGH].rmse_arcsec)


@dataclass(frozen=True)
class FaultEffect:
    """Draws of one explanation of the printed RMSE: size needed, MAE and largest error, arcsec."""

    rest: str
    explanation: str
    size: Array
    mae: Array
    largest: Array

    def central(self, name: str) -> tuple[float, float, float]:
        """Return median and the ends of the central 95 % of a measure, the median second."""
        low, median, high = np.percentile(getattr(self, name), CENTRAL)
        return float(low), float(median), float(high)

    @property
    def distance(self) -> float:
        """Distance of the printed MAE and largest error from the draws, in standard deviations.

        Mahalanobis distance of the pair of logarithms; 95 % of the draws lie within `WITHIN`.
        """
        paper = TABLE_5[HIGH]
        drawn = np.log([self.mae, self.largest])
        off = np.log([paper.mae_arcsec, paper.max_error_arcsec]) - drawn.mean(axis=1)
        return float(np.sqrt(off @ np.linalg.solve(np.cov(drawn), off)))


def fault_effects(rests: Mapping[str, Array], cubes: Sequence[Array]) -> list[FaultEffect]:
    """Make the printed RMSE at k = 4 from each rest of the error by faulty runs, or by noise.

    ``rests`` holds errors at k = 4 of models by name, in arcsec and of shape (hypercubes, points);
    `AS_PRINTED` is added to them.
    """
    random_state = np.random.default_rng(SEED)
    errors: dict[str, dict[str, list[Array]]] = {name: {} for name in (*rests, AS_PRINTED)}
    for number, cube in enumerate(cubes):
        functions = cardinal_functions(cube, HIGH)
        rest_errors = {name: errors[number][:, None] for name, errors in rests.items()}
        rest_errors[AS_PRINTED] = _rest_as_printed(random_state, len(cube))
        for explanation, shape in _shapes(random_state, functions):
            for name, residual in rest_errors.items():
                parts = errors[name].setdefault(explanation, [])
                parts.append(_scaled_to_print(residual, shape))
    return [
        FaultEffect(name, explanation, *np.hstack(parts))
        for name, explanations in errors.items()
        for explanation, parts in explanations.items()
    ]


def _rest_as_printed(random_state: np.random.Generator, n: int) -> Array:
    """Draw errors with the RMSE and the MAE that the paper prints at the lower order.

    From the generalised normal distribution whose exponent gives this ratio: 2 would be the normal
    one, 1 is Laplace's.
    """
    paper = TABLE_5[LOW]
    drawn = gennorm.rvs(_exponent(), size=(n, DRAWS), random_state=random_state)
    return paper.rmse_arcsec * drawn / np.sqrt(np.mean(drawn**2, axis=0))


@cache
def _exponent() -> float:
    wanted = TABLE_5[LOW].mae_arcsec / TABLE_5[LOW].rmse_arcsec

    def missed(exponent: float) -> float:
        square = gamma(1.0 / exponent) * gamma(3.0 / exponent)
        return float(gamma(2.0 / exponent) / np.sqrt(square) - wanted)

    return float(brentq(missed, 0.3, 3.0))


def _shapes(random_state: np.random.Generator, functions: Array) -> Iterator[tuple[str, Array]]:
    """Yield each explanation and the error that one of unit size makes, shape (points, DRAWS)."""
    nodes = functions.shape[1]
    for faulty, words in FAULTY_RUNS.items():
        hit = np.array([random_state.choice(nodes, faulty, replace=False) for _ in range(DRAWS)])
        signs = random_state.choice((-1.0, 1.0), hit.shape)
        yield words, np.einsum("nde,de->nd", functions[:, hit], signs)
    yield EVERY_RUN, functions @ random_state.standard_normal((nodes, DRAWS))


def _scaled_to_print(residual: Array, shape: Array) -> Array:
    """Return size, MAE and largest error (3, draws) where the RMSE becomes the printed one.

    Draws whose rest has at least that RMSE already are left out.
    """
    residual = np.broadcast_to(residual, shape.shape)
    missing = TABLE_5[HIGH].rmse_arcsec ** 2 - np.mean(residual**2, axis=0)
    residual, shape, missing = (
        residual[:, missing > 0.0],
        shape[:, missing > 0.0],
        missing[missing > 0.0],
    )
    square, mixed = np.mean(shape**2, axis=0), np.mean(shape * residual, axis=0)
    size = (np.sqrt(mixed**2 + square * missing) - mixed) / square
    error = np.abs(residual + size * shape)
    return np.array([size, error.mean(axis=0), error.max(axis=0)])


def _within_paper() -> Finding:
    low, high, least = TABLE_5[LOW].rmse_arcsec, TABLE_5[HIGH].rmse_arcsec, least_rmse_below()
    return Finding(
        low >= least,
        f"The paper prints an RMSE of {high} arcsec at k = {HIGH} beside {low} at k = {LOW}. "
        "If the error of the smooth response falls with the order, noise of one size in all runs, "
        f"however large, leaves {significant(least, 3)} arcsec or more at k = {LOW}.",
        within_paper=True,
        answers=True,
    )


def faults_table(effects: Sequence[FaultEffect]) -> Table:
    """Return MAE and largest error that come with the printed RMSE at k = 4."""
    columns = [Column("error without them"), Column("explanation")]
    for group in ("size needed", "MAE", "max error"):
        columns += [
            Column("from", "arcsec", 3, group),
            Column("median", "arcsec", 3, group),
            Column("to", "arcsec", 3, group),
        ]
    columns.append(Column("distance", "std", 2))
    measures = ("size", "mae", "largest")
    rows: list[tuple[Cell, ...]] = [
        (
            e.rest,
            e.explanation,
            *(value for name in measures for value in e.central(name)),
            e.distance,
        )
        for e in effects
    ]
    paper = TABLE_5[HIGH]
    printed = (None, paper.mae_arcsec, None, None, paper.max_error_arcsec, None, None)
    rows.append(("paper", "printed", None, None, None, *printed))
    title = f"Explanations of the RMSE of {paper.rmse_arcsec} arcsec at k = {HIGH}"
    findings = (_within_paper(), _fault_finding(effects), *_misfits(effects))
    return Table("faults", title, tuple(columns), tuple(rows), note=FAULTS_NOTE, findings=findings)


def _fitting(effects: Sequence[FaultEffect]) -> list[FaultEffect]:
    return [effect for effect in effects if effect.distance <= WITHIN]


def _fault_finding(effects: Sequence[FaultEffect]) -> Finding:
    """Say which explanation gives the printed MAE and largest error beside the printed RMSE."""
    paper = TABLE_5[HIGH]
    printed = (
        f"the printed row of k = {HIGH} (MAE {paper.mae_arcsec}, RMSE {paper.rmse_arcsec}, largest "
        f"error {paper.max_error_arcsec} arcsec)"
    )
    fitting = [effect for effect in _fitting(effects) if effect.explanation != EVERY_RUN]
    if not fitting:
        nearest = min(effect.distance for effect in effects)
        return Finding(
            False,
            f"Nothing tried gives {printed}: MAE and largest error are "
            f"{significant(nearest, 2)} standard deviations off or more.",
            answers=True,
        )
    best = fitting[0]
    noise = min(effect.distance for effect in effects if effect.explanation == EVERY_RUN)
    return Finding(
        best.distance < noise,
        f"{best.explanation.capitalize()} among {(HIGH + 1) ** len(PARAMETERS):,} nodes can give "
        f"{printed} if the error without it is {best.rest}. MAE and largest error are then "
        f"{significant(best.distance, 2)} standard deviations off, and {significant(noise, 2)} or "
        f"more with {EVERY_RUN}.",
        answers=True,
    )


def on_the_first_page(effects: Sequence[FaultEffect]) -> str:
    """Say what can and what cannot make the higher order worse."""
    low, high = TABLE_5[LOW].rmse_arcsec, TABLE_5[HIGH].rmse_arcsec
    words = [effect.explanation for effect in _fitting(effects)]
    cause = f"{words[0]} among the nodes can" if words else "faulty runs among the nodes hardly can"
    return (
        f"in Table 5 order {HIGH} is worse than order {LOW} (RMSE {high} against {low} arcsec), "
        f"which equal noise in all runs of a smooth response cannot give; {cause}"
    )


def _misfits(effects: Sequence[FaultEffect]) -> Iterator[Finding]:
    """Say of one faulty run and of noise what they give on every rest of the error."""
    paper = TABLE_5[HIGH]
    for explanation in (FAULTY_RUNS[1], EVERY_RUN):
        chosen = [effect for effect in effects if effect.explanation == explanation]
        parts = [
            f"{significant(e.central('mae')[1], 3)} and {significant(e.central('largest')[1], 2)} "
            f"({e.rest})"
            for e in chosen
        ]
        yield Finding(
            all(effect.distance <= WITHIN for effect in chosen),
            f"With {explanation} the medians of MAE and largest error are {', '.join(parts)}; the "
            f"paper prints {paper.mae_arcsec} and {paper.max_error_arcsec} arcsec.",
        )


def faults_figure(effects: Sequence[FaultEffect]) -> Figure:
    """Draw largest error over MAE of all draws, one panel for each rest of the error."""
    rests = list(dict.fromkeys(effect.rest for effect in effects))
    figure, axes = grid(1, len(rests), width=3.8, height=3.4)
    lowest, *_, highest = FAULTY_RUNS.values()
    shown = {lowest: BLUE, highest: GREEN, EVERY_RUN: ORANGE}
    for residual, axis in zip(rests, axes[0], strict=True):
        for effect in effects:
            if effect.rest == residual and effect.explanation in shown:
                axis.plot(effect.mae, effect.largest, "o", color=shown[effect.explanation],
                          markersize=2, alpha=0.4, label=effect.explanation)  # fmt: skip
        paper = TABLE_5[HIGH]
        axis.plot(paper.mae_arcsec, paper.max_error_arcsec, "*", color="black", markersize=12,
                  label="paper")  # fmt: skip
        axis.axvline(paper.mae_arcsec, color=GREY, linewidth=0.8)
        axis.set_title(residual, fontsize=10)
        axis.set_xlabel("MAE [arcsec]")
    axes[0, 0].set_ylabel("largest error [arcsec]")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return figure
