"""What came out on bbob-biobj: shares of targets beside published ones, and duels."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.comparing.rivals import RivalTest, holm_against
from experiments.runner.committed import read_rows
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import BBOB_PEERS, ON_BBOB, OURS
from experiments.studies.suites.protocol import BESIDE_BEST, BESIDE_PEERS, BUDGETS, DIMENSIONS
from pymoo_hdte._runner.result import Cell, Column, Table

ANCHORS = Path(__file__).resolve().parents[5] / "shared" / "anchors" / "bbob_biobj.csv"
BEST = "HMO-CMA-ES"
CITED = {
    **{(10, 500): 0.214, (10, 2000): 0.295, (10, 10_000): 0.372, (10, 25_000): 0.414},
    **{(20, 500): 0.183, (20, 2000): 0.250, (20, 10_000): 0.334, (20, 25_000): 0.377},
}
"""Shares of HMO-CMA-ES (Loshchilov, Glasmachers 2016) by dimension and evaluations."""
SHOWN = {
    BEST: "HMO-CMA-ES",
    "best 2016": "best 2016",
    "RM-MEDA": "RM-MEDA",
    "SMS-EMOA-SA": "SMS-EMOA-",
    "NSGA-II (MATLAB)": "NSGA-II-MATLAB",
    "random in [-5, 5]": "RANDOMSEARCH-5",
}
"""Curves that are drawn, with the beginnings of their names in the archive."""
_PREFIX = "share_at_"


def curves(dimension: int, path: Path = ANCHORS) -> dict[str, dict[int, float]]:
    """Return published shares by name and number of evaluations; without the file what is cited."""
    if not path.is_file():
        cited = {n: share for (d, n), share in CITED.items() if d == dimension}
        return {BEST: cited}
    found: dict[str, dict[int, float]] = {}
    rows = [row for row in read_rows(path) if int(row["dimension"]) == dimension]
    for shown, beginning in SHOWN.items():
        for row in rows:
            if row["algorithm"].startswith(beginning) and _of_the_right_year(row):
                found[shown] = {
                    int(name.removeprefix(_PREFIX)): float(value)
                    for name, value in row.items()
                    if name.startswith(_PREFIX) and value
                }
    return found


def _of_the_right_year(row: dict[str, str]) -> bool:
    """Leave out what stands there twice: the best of 2016 again in 2017."""
    return row["year"] == ("2017" if row["algorithm"] == "SMS-EMOA-" else "2016")


def shares_of(
    outcome: Outcome, dimension: int, algorithm: str, instance: int, evaluations: int
) -> list[float]:
    """Return the share of an algorithm after so many evaluations on each function, rising.

    The longest runs tell of shorter ones, unless the algorithm starts anew for each budget.
    """
    told = evaluations if ON_BBOB[algorithm].starts_anew else BUDGETS[-1]
    where = dimension, algorithm, told, instance
    by_function = {
        run.function: shares[evaluations]
        for run, shares in outcome.bbob.items()
        if (run.dimension, run.algorithm, run.told, run.instance) == where and evaluations in shares
    }
    return [by_function[function] for function in sorted(by_function)]


def reached_shares(outcome: Outcome, dimension: int, evaluations: int) -> list[float]:
    """Return the `shares_of` our swarm on the instance that is set beside the best published."""
    return shares_of(outcome, dimension, OURS, BESIDE_BEST, evaluations)


def reached(outcome: Outcome, dimension: int, evaluations: int) -> float | None:
    """Return the mean of `reached_shares`; None if it was not run."""
    shares = reached_shares(outcome, dimension, evaluations)
    return float(np.mean(shares)) if shares else None


class Duel(NamedTuple):
    """Our swarm beside a rival on the problems that both ran; mean shares and the test."""

    rival: str
    evaluations: int
    problems: int
    ours: float
    theirs: float
    test: RivalTest


def duels(
    outcome: Outcome,
    evaluations: int,
    rivals: Iterable[str] = tuple(BBOB_PEERS),
    control: str = OURS,
) -> list[Duel]:
    """Return the duels after so many evaluations, p corrected over the rivals that ran.

    Ours and a rival that move alike whatever their budget may have been told more.
    """
    duels_of = []
    for rival in rivals:
        pairs = _pairs(outcome, control, rival, evaluations)
        if rival != control and len(pairs):
            duels_of.append((rival, pairs))
    # Each rival has problems of its own: its differences are padded with problems without any.
    most = max((len(pairs) for _, pairs in duels_of), default=0)
    values = np.zeros((most, 1 + len(duels_of)))
    for column, (_, pairs) in enumerate(duels_of, start=1):
        values[: len(pairs), column] = pairs[:, 1] - pairs[:, 0]
    if not duels_of:
        return []
    names = [control, *(rival for rival, _ in duels_of)]
    tests = holm_against(control, names, values, smaller_is_better=False)
    return [
        Duel(
            rival,
            evaluations,
            len(pairs),
            float(pairs[:, 0].mean()),
            float(pairs[:, 1].mean()),
            test,
        )
        for (rival, pairs), test in zip(duels_of, tests, strict=True)
    ]


def _pairs(outcome: Outcome, control: str, rival: str, evaluations: int) -> NDArray[np.float64]:
    """Return our share and the rival's on the problems that both ran, shape (problems, 2)."""
    ours = {
        (run.dimension, run.function, run.instance, run.seed): shares[evaluations]
        for run, shares in outcome.bbob.items()
        if run.algorithm == control and evaluations in shares
    }
    anew = ON_BBOB[rival].starts_anew
    pairs = []
    for run, shares in outcome.bbob.items():
        place = run.dimension, run.function, run.instance, run.seed
        fits = run.told == evaluations or (not anew and evaluations in shares)
        if run.algorithm == rival and fits and place in ours:
            pairs.append((ours[place], shares[evaluations]))
    return np.array(pairs).reshape(-1, 2)


def shares_table(outcome: Outcome) -> Table:
    """Mean shares of targets by dimension and evaluations, ours before the published ones."""
    rows: list[tuple[Cell, ...]] = []
    for dimension, instance in product(DIMENSIONS, (BESIDE_BEST, BESIDE_PEERS)):
        for algorithm in BBOB_PEERS:
            shares = [shares_of(outcome, dimension, algorithm, instance, n) for n in BUDGETS]
            if any(shares):
                means = (float(np.mean(share)) if share else None for share in shares)
                rows.append((algorithm, dimension, f"here, instance {instance}", *means))
    for dimension in DIMENSIONS:
        for name, curve in curves(dimension).items():
            rows.append((name, dimension, "published", *(curve.get(budget) for budget in BUDGETS)))
    return Table(
        "shares",
        "bbob-biobj, held out: share of COCO's 58 targets reached, every evaluation counted",
        (
            *(Column("algorithm"), Column("dimension"), Column("from")),
            *(Column(f"{budget:,}", "", 3, "evaluations") for budget in BUDGETS),
        ),
        tuple(rows),
        note="On all 55 functions, one run each; published are averages over all functions and "
        "instances, read from pictures to some .01.",
    )


def duels_table(outcome: Outcome) -> Table:
    """Our swarm beside others that ran here, problem by problem."""
    rows = [
        (
            *(duel.rival, duel.evaluations, duel.problems, duel.ours, duel.theirs),
            *(duel.test.better, duel.test.worse, duel.test.p),
        )
        for budget in BUDGETS
        for duel in duels(outcome, budget)
    ]
    return Table(
        "bbob_duels",
        f"bbob-biobj, held out: {OURS} beside others on the same problems",
        (
            *(Column("rival"), Column("evaluations"), Column("problems")),
            *(Column(name, "", 3, "mean share") for name in ("ours", "theirs")),
            *(Column("better"), Column("worse"), Column("p", digits=2)),
        ),
        tuple(rows),
        note="Better and worse count problems; p is Wilcoxon's over them, after Holm over the "
        "rivals of a row's budget.",
    )
