"""The suites beside bbob-biobj: problems by name, with their fronts or boxes of objectives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from experiments.runner.committed import committed_file, read_rows
from experiments.studies.suites.formulas.df import NUMBERS, TIMES, df_front, make_df
from experiments.studies.suites.formulas.engineering import MEMBERS, make_engineering
from experiments.studies.suites.formulas.imop import imop_front, make_imop
from experiments.studies.suites.formulas.lz09 import lz09_front, make_lz09
from experiments.studies.suites.formulas.zcat import make_zcat, zcat_front
from pymoo_hdte._comparing.indicators import CORNER

DIFFICULTY = 5
"""Of DAS-CMOP: the fifth triplet of pymoo's sixteen, which are those of its authors."""
BOXES = "suites_boxes"


@dataclass(frozen=True)
class SuiteProblem:
    """A problem of a suite; ``front`` returns its true front where that is known in closed form."""

    name: str
    suite: str
    make: Callable[[], Problem]
    front: Callable[[], NDArray[np.float64]] | None = None


def _numbered(suite: str, count: int) -> list[str]:
    return [f"{suite}{number}" for number in range(1, count + 1)]


def _zcat(n: int, n_obj: int) -> SuiteProblem:
    """Return a problem of ZCAT; all four levels of difficulty take turns."""
    level = 1 + (n + 2 * n_obj - 5) % 4
    make, front = partial(make_zcat, n, n_obj, level), partial(zcat_front, n, n_obj)
    return SuiteProblem(f"ZCAT{n}_{n_obj}", "ZCAT", make, front)


def _df(n: int, time: float) -> SuiteProblem:
    make, front = partial(make_df, n, time), partial(df_front, n, time)
    return SuiteProblem(f"DF{n} at {time}", "DF", make, front)


def _dascmop(number: int) -> Problem:
    return get_problem(f"dascmop{number}", DIFFICULTY)


SUITES: dict[str, tuple[SuiteProblem, ...]] = {
    "IMOP": tuple(
        SuiteProblem(f"IMOP{n}", "IMOP", partial(make_imop, n), partial(imop_front, n))
        for n in range(1, 9)
    ),
    "RE": tuple(SuiteProblem(name, "RE", partial(make_engineering, name)) for name in MEMBERS),
    "MW": tuple(
        SuiteProblem(name, "MW", partial(get_problem, name.lower())) for name in _numbered("MW", 14)
    ),
    "DAS-CMOP": tuple(
        SuiteProblem(f"DAS-CMOP{n}", "DAS-CMOP", partial(_dascmop, n)) for n in range(1, 10)
    ),
    "LZ09": tuple(
        SuiteProblem(f"LZ09-F{n}", "LZ09", partial(make_lz09, n), partial(lz09_front, n))
        for n in range(1, 10)
    ),
    "DF": tuple(_df(n, time) for time in TIMES for n in NUMBERS),
    "ZCAT": tuple(_zcat(n, n_obj) for n_obj in (2, 3) for n in range(1, 21)),
}
"""Problems by suite."""

PROBLEMS = {problem.name: problem for suite in SUITES.values() for problem in suite}
"""The same by name."""


@cache
def problem_of(name: str) -> Problem:
    """Return the problem of that name, built once per process.

    It knows the box ``start`` of first positions, its own, and the point ``reference`` up to which
    hypervolume counts, for algorithms that need to be told.
    """
    problem = PROBLEMS[name].make()
    problem.start = problem.xl, problem.xu
    ideal, nadir = box_of(name)
    problem.reference = ideal + CORNER * (nadir - ideal)
    return problem


@cache
def front_of(name: str) -> NDArray[np.float64] | None:
    """Return the true front of the problem of that name, None where it has no closed form."""
    front = PROBLEMS[name].front
    return None if front is None else front()


@cache
def box_of(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ideal and nadir point by which objectives are normalised, shape (m,) each.

    Those of the true front; where that is not known, of the best found in long runs (`boxes`).
    """
    front = front_of(name)
    if front is not None:
        return front.min(axis=0), front.max(axis=0)
    table = read_rows(committed_file(f"{BOXES}.csv", "suites"))
    rows = [row for row in table if row["problem"] == name]
    ideal, nadir = ([float(row[end]) for row in rows] for end in ("ideal", "nadir"))
    return np.array(ideal), np.array(nadir)
