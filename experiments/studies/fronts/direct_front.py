"""The front of the drive model itself: found twice, on finer quadratures, beside that of order 3.

Writes ``front_calibrated_direct.csv`` beside its report; copied to ``pymoo_hdte/problems/data`` it
is what ``pareto_front()`` of `RobustDTEDirect` returns.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from tqdm import tqdm

from experiments.runner.registry import Context
from pymoo_hdte._comparing.figures import BLUE, ORANGE, grid
from pymoo_hdte._runner.result import Column, Finding, Picture, Result, Table
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.algorithms import interpolated_front
from pymoo_hdte.problems import RobustDTE, RobustDTEDirect
from pymoo_hdte.problems.reference import ReferenceFront, format_reference

SEEDS = (1, 2)
ALLOWED = 0.01
"""Share of the front's width to which it has to be the drive model's."""
FINER_NODES = (24, 5, 5, 2, 3)
_SEARCHED_TO = 0.003
_POINTS = 80
_MOST = 1500
_LEAST_WIDTH = 1e-3
_LOOKED_AT = 25
"""Designs along the front that finer quadratures are asked for."""

Values = NDArray[np.float64]


def run(context: Context) -> Result:
    """Search from two seeds, compare, ask a finer quadrature, and write the front of both."""
    problem = RobustDTEDirect()
    searches = [_search(problem, seed) for seed in tqdm(SEEDS, desc="direct_front", unit="search")]
    designs = _together(searches)
    width = np.ptp(designs.front, axis=0)
    differ = _disagreement(searches[0].front, searches[1].front, width)
    rows = np.linspace(0, len(designs.front) - 1, _LOOKED_AT).round().astype(int)
    finer = problem.moments.with_nodes(FINER_NODES)(designs.designs[rows])
    coarse = float(np.max(np.abs(finer - designs.front[rows]) / width))
    surrogate = RobustDTE()
    elsewhere = surrogate.pareto_set()[:: len(surrogate.pareto_front()) // _LOOKED_AT]
    really = problem.evaluate(elsewhere)
    behind = float(np.median(_behind(really, designs.front, width)))
    columns = (*problem.obj_names, *problem.var_names)
    text = format_reference(designs, problem.settings, columns)
    name = f"front_{problem.variant}.csv"
    write_atomically(context.out / "direct_front" / name, text.encode())
    stored = problem.pareto_front()
    off = np.inf if stored is None else _disagreement(stored, designs.front, width)
    findings = (
        Finding(
            differ + coarse <= ALLOWED,
            f"Two searches differ by {differ:.1e} of the front's width and {problem.moments.nodes} "
            f"nodes from {FINER_NODES} by {coarse:.1e}; {ALLOWED:g} is allowed for both together.",
            check=True,
            answers=True,
        ),
        Finding(
            off <= ALLOWED,
            f"The stored front differs by {off:.1e} of the width."
            if stored is not None
            else "No stored front fits these settings; copy the one written here.",
            check=True,
        ),
        Finding(
            behind > ALLOWED,
            f"The front of the order-3 surrogate, evaluated here, lies {behind:.2f} widths behind "
            "in the median.",
            answers=True,
        ),
    )
    table = Table(
        "agreement",
        "The front of the drive model",
        (
            Column("problem"),
            Column("points"),
            Column("mean", "arcsec", group="width in"),
            Column("std", "arcsec", group="width in"),
            Column("two searches differ by", "of the width", 2),
            Column("finer quadrature differs by", "of the width", 2),
        ),
        ((problem.variant, len(designs.front), *width.tolist(), differ, coarse),),
        findings=findings,
    )
    caption = "Front of the drive model, and that of the order-3 surrogate as the model has it."
    return Result(
        title="The front of the drive model itself",
        command="python -m experiments direct_front",
        paragraphs=(
            "Mean and standard deviation of the DTE by quadrature of the drive model, without a "
            "surrogate. The front is interpolated between evaluated designs until that changes "
            f"nothing beyond {_SEARCHED_TO:g} of its width.",
        ),
        tables=(table,),
        pictures=(Picture(problem.variant, caption, _picture(designs.front, really)),),
    )


def _search(problem: RobustDTEDirect, seed: int) -> ReferenceFront:
    solutions = interpolated_front(
        problem.moments,
        problem.xl,
        problem.xu,
        np.random.default_rng(seed),
        accuracy=_SEARCHED_TO,
        least_width=_LEAST_WIDTH,
        most=_MOST,
        points=_POINTS,
    )
    return ReferenceFront(solutions.front, solutions.designs)


def _together(searches: list[ReferenceFront]) -> ReferenceFront:
    """Return what no design of any search dominates, by rising mean."""
    front = np.vstack([search.front for search in searches])
    designs = np.vstack([search.designs for search in searches])
    rows = NonDominatedSorting().do(front, only_non_dominated_front=True)
    rows = rows[np.argsort(front[rows, 0], kind="stable")]
    return ReferenceFront(front[rows], designs[rows])


def _disagreement(front: Values, rival: Values, width: Values) -> float:
    """Return by how much a point of either front, at worst, is dominated by one of the other."""
    gain = (front[:, None] - rival) / width
    return float(max(0.0, gain.min(axis=2).max(), (-gain).min(axis=2).max()))


def _behind(points: Values, front: Values, width: Values) -> Values:
    """Return the least distance, in widths, by which points are weakly dominated by a front."""
    return np.asarray(((points[:, None] - front) / width).min(axis=2).max(axis=1))


def _picture(front: Values, surrogates: Values) -> Figure:
    figure, axes = grid(1, 1, width=5.0, height=3.6)
    axis = axes.flat[0]
    axis.plot(
        *surrogates.T, ".", color=ORANGE, markersize=3, label="order-3 surrogate, on the model"
    )
    axis.plot(*front.T, ".", color=BLUE, markersize=2, label="drive model")
    axis.set_xlabel("mean DTE [arcsec]")
    axis.set_ylabel("std DTE [arcsec]")
    axis.legend(frameon=False)
    return figure
