"""The true fronts of `RobustDTE`: computed twice, compared, and held against what is stored.

Writes ``front_<model>.csv`` beside its report; copied to ``pymoo_hdte/problems/data`` it is what
``RobustDTE.pareto_front()`` returns.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from tqdm import tqdm

from experiments.figures import BLUE, grid
from experiments.quality import TrueFront
from experiments.registry import Context
from experiments.result import Column, Finding, Picture, Result, Table
from experiments.runs import robust_problem
from experiments.store import write_atomically
from experiments.true_front import second_objective_at, true_front
from pymoo_hdte.drive import PRESETS
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.problems.reference import ReferenceFront, format_reference

N_POINTS = 1000
SEEDS = (1, 2)
TOLERANCE = 1e-6
_RANDOM_DESIGNS = 2**20
_RIVAL_GENERATIONS = 300


def run(context: Context) -> Result:
    """Compute, cross-check and write the fronts of all presets."""
    rows, findings, pictures = [], [], []
    for name in tqdm(PRESETS, desc="reference_front", unit="front"):
        problem = robust_problem(name)
        (front, designs), second = (
            true_front(problem, N_POINTS, np.random.default_rng(seed)) for seed in SEEDS
        )
        columns = (*problem.obj_names, *problem.var_names)
        text = format_reference(ReferenceFront(front, designs), problem.settings, columns)
        target = context.out / "reference_front" / f"front_{name}.csv"
        write_atomically(target, text.encode())
        span = np.ptp(front, axis=0)
        disagreement = 0.0
        pieces = 1
        if len(front) > 1:
            disagreement = _disagreement(problem, front, *second)
            pieces = len(TrueFront(front).pieces)
            pictures.append(Picture(name, f"True front of {name}.", _picture(front)))
        undercut = _undercut(problem, front)
        stored = _distance_to_stored(problem, front)
        rows.append((name, len(front), pieces, *span, disagreement, undercut, stored))
        findings += _findings(name, disagreement, undercut, stored)
    table = Table(
        "agreement",
        "Two independent searches, rival solutions, and the stored front",
        (
            Column("model"),
            Column("points"),
            Column("pieces"),
            Column("mean", "arcsec", group="width in"),
            Column("std", "arcsec", group="width in"),
            Column("two searches differ by", "of the width", 2),
            Column("rivals undercut by", "of the width", 2),
            Column("stored front differs by", "of the width", 2),
        ),
        tuple(rows),
        findings=tuple(findings),
    )
    return Result(
        title="True fronts of the robust DTE problem",
        command="python -m experiments reference_front",
        paragraphs=(
            f"Each front is searched from two seeds; rivals are {_RANDOM_DESIGNS} random designs "
            f"and NSGA-II after {_RIVAL_GENERATIONS} generations. A negative number means that no "
            "rival undercuts the front.",
        ),
        tables=(table,),
        pictures=tuple(pictures),
    )


def _disagreement(
    problem: RobustDTE,
    front: NDArray[np.float64],
    second_front: NDArray[np.float64],
    second_designs: NDArray[np.float64],
) -> float:
    """Return the largest difference of two searches: at both ends, and at every level of f1."""
    width = np.ptp(front, axis=0)
    rng = np.random.default_rng(SEEDS[1])
    inner = front[1:-1]
    other = second_objective_at(problem, inner[:, 0], second_designs, rng)
    ends = abs(front[0, 0] - second_front[0, 0]), abs(front[-1, 1] - second_front[-1, 1])
    between = np.max(np.abs(other - inner[:, 1])) / width[1]
    return float(max(ends[0] / width[0], ends[1] / width[1], between))


def _undercut(problem: RobustDTE, front: NDArray[np.float64]) -> float:
    """Return by how much of the width the best rival dominates the front, negative if none does."""
    rng = np.random.default_rng(SEEDS[0])
    designs = rng.uniform(problem.xl, problem.xu, (_RANDOM_DESIGNS, problem.n_var))
    evolved = minimize(problem, NSGA2(pop_size=200), ("n_gen", _RIVAL_GENERATIONS), seed=1)
    sampled = problem.evaluate(designs)
    good = sampled[np.argsort(sampled @ (1.0 / np.ptp(sampled, axis=0)))[:1000]]
    rivals = np.vstack([good, evolved.F])
    width = np.ptp(front, axis=0) if len(front) > 1 else front[0]
    gain = (front[None, :, :] - rivals[:, None, :]) / width
    return float(gain.min(axis=2).max())


def _distance_to_stored(problem: RobustDTE, front: NDArray[np.float64]) -> float | None:
    stored = problem.pareto_front()
    if stored is None or stored.shape != front.shape:
        return None
    width = np.ptp(front, axis=0) if len(front) > 1 else front[0]
    return float(np.max(np.abs(stored - front) / width))


def _findings(
    name: str, disagreement: float, undercut: float, stored: float | None
) -> list[Finding]:
    return [
        Finding(
            max(disagreement, undercut) <= TOLERANCE,
            f"On {name}, two searches differ by {disagreement:.1e} of the front's width, and the "
            f"best rival undercuts it by {undercut:.1e}; {TOLERANCE:.0e} is allowed.",
            check=True,
        ),
        Finding(
            stored is not None and stored <= TOLERANCE,
            f"On {name}, the stored front differs by {stored:.1e} of the width."
            if stored is not None
            else f"On {name}, no stored front fits these settings; copy the one written here.",
            check=True,
        ),
    ]


def _picture(front: NDArray[np.float64]) -> Figure:
    figure, axes = grid(1, 1, width=5.0, height=3.6)
    axis = axes.flat[0]
    axis.plot(front[:, 0], front[:, 1], ".", color=BLUE, markersize=2)
    axis.set_xlabel("mean DTE [arcsec]")
    axis.set_ylabel("std DTE [arcsec]")
    return figure
