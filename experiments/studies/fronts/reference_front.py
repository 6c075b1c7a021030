"""True fronts of the robust DTE problems on surrogates: computed twice, compared with stored.

Writes ``front_<name>.csv`` beside its report; copied to ``pymoo_hdte/problems/data`` it is what
``pareto_front()`` of that problem returns.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from tqdm import tqdm

from experiments.runner.registry import Context
from experiments.studies.fronts.front_search import Solution, falling, find_true_front
from experiments.studies.fronts.tolerance_front import (
    POINTS,
    TOLERANCES,
    LevelSearch,
    disagreement,
    find_tolerance_front,
    front_designs,
    tolerance_disagreement,
    without_local_optima,
)
from pymoo_hdte._comparing.figures import BLUE, grid
from pymoo_hdte._comparing.quality import GAP, TrueFront
from pymoo_hdte._runner.result import Column, Finding, Picture, Result, Table
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.problems import (
    RobustDTE,
    RobustDTEGrades,
    RobustDTETolerance,
    robust_dte_family,
)
from pymoo_hdte.problems.family import Member
from pymoo_hdte.problems.reference import ReferenceFront, format_reference

N_POINTS = 1000
CONSTRAINED_POINTS = 150
"""With constraints and seven variables a point takes SLSQP twenty times as long."""
DIRECT = "calibrated_direct"
"""The member without a surrogate; its front is that of ``direct_front``."""
SEEDS = (1, 2)
TOLERANCE = 1e-6
OnSurrogate = RobustDTE | RobustDTETolerance | RobustDTEGrades
_RANDOM_DESIGNS = 2**20
_RIVAL_GENERATIONS = 300
_HALVINGS = 4


def run(context: Context) -> Result:
    """Compute, cross-check and write the fronts of the printed model and of the whole family."""
    members: dict[str, Member] = {"published": partial(RobustDTE, "published")}
    members |= {name: build for name, build in robust_dte_family().items() if name != DIRECT}
    rows, findings, pictures = [], [], []
    for name, build in tqdm(members.items(), desc="reference_front", unit="front"):
        problem = build()
        fronts, second = (_search(problem, seed) for seed in SEEDS)
        front = fronts.front
        columns = (*problem.obj_names, *problem.var_names)
        text = format_reference(fronts, problem.settings, columns)
        target = context.out / "reference_front" / f"front_{name}.csv"
        write_atomically(target, text.encode())
        differ = 0.0
        pieces: int | None = 1
        if len(front) > 1:
            differ = _disagreement(problem, fronts, second)
            pieces = len(TrueFront(front).pieces) if problem.n_obj == 2 else None
            caption = f"True front of the surrogate of {name}."
            pictures.append(Picture(name, caption, _picture(fronts)))
        undercut = _undercut(problem, front)
        stored = _distance_to_stored(problem, front)
        span = np.ptp(front, axis=0)[:2]
        rows.append((name, len(front), pieces, *span, differ, undercut, stored))
        findings += _findings(name, differ, undercut, stored)
    table = Table(
        "agreement",
        "Two independent searches, rival solutions, and the stored front",
        (
            Column("problem"),
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
        title="True fronts of the robust DTE problems on their surrogates",
        command="python -m experiments reference_front",
        paragraphs=(
            "Each front is that of a surrogate of the drive model, of order 3 if the name says no "
            f"other. It is searched from two seeds; rivals are {_RANDOM_DESIGNS} random designs "
            f"and NSGA-II after {_RIVAL_GENERATIONS} generations. A negative number means that no "
            "rival undercuts the front. With a free tolerance there is a third objective, and the "
            f"front is a sheet: {POINTS} points at each of {TOLERANCES} tolerances, compared at "
            "each of them.",
        ),
        tables=(table,),
        pictures=tuple(pictures),
    )


def _search(problem: OnSurrogate, seed: int) -> ReferenceFront:
    rng = np.random.default_rng(seed)
    if isinstance(problem, RobustDTETolerance):
        return find_tolerance_front(problem, rng)
    if problem.n_ieq_constr:
        return with_gaps_halved(problem, front_designs(problem, CONSTRAINED_POINTS, rng), rng)
    front = ReferenceFront(*find_true_front(problem, N_POINTS, rng))
    return without_local_optima(problem, front, rng)


def with_gaps_halved(
    problem: Problem, designs: NDArray[np.float64], rng: np.random.Generator
) -> ReferenceFront:
    """Return a front of two objectives after halving, some times, steps of over `GAP`.

    What stays as wide are gaps between its pieces.
    """
    search = LevelSearch(problem, rng)
    cubes = (designs - problem.xl) / (problem.xu - problem.xl)
    front = problem.evaluate(designs, return_values_of=["F"])
    solutions = [Solution(*row) for row in zip(cubes, front, strict=True)]
    width = np.ptp(front, axis=0)
    for _ in range(_HALVINGS):
        between = []
        for low, high in pairwise(solutions):
            ends = low.objectives, high.objectives
            if np.linalg.norm((ends[1] - ends[0]) / width) > GAP:
                level = (ends[0][0] + ends[1][0]) / 2.0
                between.append(search.best(level, [low.cube, high.cube]))
        solutions = falling(
            [*solutions, *(solution for solution in between if solution is not None)]
        )
    kept = search.designs(np.array([solution.cube for solution in solutions]))
    return ReferenceFront(problem.evaluate(kept, return_values_of=["F"]), kept)


def _disagreement(
    problem: OnSurrogate,
    computed: ReferenceFront,
    second: ReferenceFront,
) -> float:
    if isinstance(problem, RobustDTETolerance):
        return tolerance_disagreement(problem, computed, second)
    return disagreement(problem, computed, second, np.ptp(computed.front, axis=0))


def _undercut(problem: Problem, front: NDArray[np.float64]) -> float:
    """Return by how much of the width the best rival dominates the front, negative if none does."""
    rng = np.random.default_rng(SEEDS[0])
    designs = rng.uniform(problem.xl, problem.xu, (_RANDOM_DESIGNS, problem.n_var))
    evolved = minimize(problem, NSGA2(pop_size=200), ("n_gen", _RIVAL_GENERATIONS), seed=1)
    sampled, limits = problem.evaluate(designs, return_values_of=["F", "G"])
    sampled = sampled[np.all(limits <= 0.0, axis=1)]
    good = sampled[np.argsort(sampled @ (1.0 / np.ptp(sampled, axis=0)))[:1000]]
    rivals = np.vstack([good, evolved.F])
    width = np.ptp(front, axis=0) if len(front) > 1 else front[0]
    gain = (front[None, :, :] - rivals[:, None, :]) / width
    return float(gain.min(axis=2).max())


def _distance_to_stored(problem: Problem, front: NDArray[np.float64]) -> float | None:
    stored = problem.pareto_front()
    if stored is None or stored.shape != front.shape:
        return None
    width = np.ptp(front, axis=0) if len(front) > 1 else front[0]
    return float(np.max(np.abs(stored - front) / width))


def _findings(name: str, differ: float, undercut: float, stored: float | None) -> list[Finding]:
    return [
        Finding(
            max(differ, undercut) <= TOLERANCE,
            f"On {name}, two searches differ by {differ:.1e} of the front's width, and the "
            f"best rival undercuts it by {undercut:.1e}; {TOLERANCE:.0e} is allowed.",
            check=True,
            answers=name == "calibrated",
        ),
        Finding(
            stored is not None and stored <= TOLERANCE,
            f"On {name}, the stored front differs by {stored:.1e} of the width."
            if stored is not None
            else f"On {name}, no stored front fits these settings; copy the one written here.",
            check=True,
        ),
    ]


def _picture(computed: ReferenceFront) -> Figure:
    """Draw std over mean, coloured by tolerance where it is free."""
    figure, axes = grid(1, 1, width=5.0, height=3.6)
    axis = axes.flat[0]
    mean, std = computed.front[:, :2].T
    if computed.front.shape[1] == 2:
        axis.plot(mean, std, ".", color=BLUE, markersize=2)
    else:
        tolerance = 100.0 * computed.designs[:, -1]
        points = axis.scatter(mean, std, c=tolerance, s=2, cmap="viridis")
        figure.colorbar(points, ax=axis, label="tolerance [%]")
    axis.set_xlabel("mean DTE [arcsec]")
    axis.set_ylabel("std DTE [arcsec]")
    return figure
