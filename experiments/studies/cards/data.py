"""Numbers of the cards: runs of the algorithms and hardness, computed or read.

What ``experiments peers`` has stored already, at the largest budget, is read from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from tqdm import tqdm

from experiments.comparing.contestants import CONTESTANTS
from experiments.runner.committed import committed_file, read_rows, table_with_origin
from experiments.runner.registry import Context
from experiments.studies.cards.hardness import STARTS, Hardness, hardness
from experiments.studies.contest.peers_data import (
    MEASURES,
    STORED,
    Scores,
    committed_scores,
    contest_scores,
)
from experiments.studies.contest.problems import BENCHMARKS, CARDS, problem_of
from pymoo_hdte._runner.store import write_atomically

NAME = "cards"
HARDNESS = "cards_hardness.csv"
BUDGETS = (500, 2_000, 10_000)
SEEDS = 5
DIRECT = "RobustDTE-calibrated_direct"
"""Has no surrogate: 20 ms a design, so that it has the least budget and a few algorithms only."""
OF_DIRECT = ("NSGA-II", "ElitistSwarm", "random search")
FINER = "_order"
"""In the names of members that differ from others by the order of the surrogate only: they have
nearly the same fronts, and are spared the largest budget."""
_QUICK = ("RobustToy", "RobustDTE-calibrated_grades")
_QUICK_STARTS = 4


class Numbers(NamedTuple):
    """Indicators of all runs, and the hardness of each of their problems."""

    scores: Scores
    hardness: dict[str, Hardness]


def numbers_for(context: Context) -> Numbers:
    """Return the stored numbers, or compute them; a full run leaves the files to be stored."""
    if not (context.full or context.quick):
        return committed_numbers()
    if context.quick:
        present = [name for name in OF_DIRECT if CONTESTANTS[name].available]
        scores = contest_scores(context.campaign, _QUICK, present, BUDGETS[:1], (1, 2))
        return Numbers(scores, _hardness_of(_QUICK, _QUICK_STARTS))
    computed = Numbers(_own_scores(context), _hardness_of(list(CARDS), STARTS))
    STORED.leave(computed.scores, NAME, context)
    write_atomically(context.out / NAME / HARDNESS, format_hardness(computed.hardness).encode())
    return computed._replace(scores=_with_peers(computed.scores))


def committed_numbers() -> Numbers:
    """Return the numbers of the last full run; errors as `committed_file`."""
    rows = read_rows(committed_file(HARDNESS, NAME))
    return Numbers(_with_peers(committed_scores(NAME)), read_hardness(rows))


def _own_scores(context: Context) -> Scores:
    present = [name for name, entry in CONTESTANTS.items() if entry.available]
    of_direct = [name for name in OF_DIRECT if name in present]
    known = [name for name in CARDS if name in BENCHMARKS]
    finer = [name for name in CARDS if FINER in name]
    others = [name for name in CARDS if name not in (*known, *finer, DIRECT)]
    seeds = range(1, SEEDS + 1)
    return merged(
        [
            contest_scores(context.campaign, known, present, BUDGETS[:-1], seeds),
            contest_scores(context.campaign, finer, present, BUDGETS[:-1], seeds),
            contest_scores(context.campaign, others, present, BUDGETS, seeds),
            contest_scores(context.campaign, [DIRECT], of_direct, BUDGETS[:1], seeds),
        ]
    )


def _with_peers(own: Scores) -> Scores:
    """Add the runs of ``peers`` at the largest budget, of the same seeds and problems."""
    return merged([own, part_of(committed_scores("peers"), own.problems, BUDGETS, own.seeds)])


def part_of(
    scores: Scores, problems: Sequence[str], budgets: Sequence[int], seeds: Sequence[int]
) -> Scores:
    """Return the scores of those problems, budgets and seeds that there are."""
    rows = [i for i, name in enumerate(scores.problems) if name in problems]
    spent = [i for i, budget in enumerate(scores.budgets) if budget in budgets]
    runs = [i for i, seed in enumerate(scores.seeds) if seed in seeds]
    kept: tuple[Any, ...] = np.ix_(rows, range(len(scores.algorithms)), spent, runs)
    return Scores(
        tuple(scores.problems[i] for i in rows),
        scores.algorithms,
        tuple(scores.budgets[i] for i in spent),
        tuple(scores.seeds[i] for i in runs),
        scores.values[(slice(None), *kept)],
        scores.spent[kept],
        scores.seconds[rows],
    )


def merged(parts: Sequence[Scores]) -> Scores:
    """Return scores of several campaigns as one; what none of them ran has spent nothing."""
    problems = [name for name in CARDS if any(name in part.problems for part in parts)]
    algorithms = list(dict.fromkeys(name for part in parts for name in part.algorithms))
    budgets = sorted({budget for part in parts for budget in part.budgets})
    seeds = sorted({seed for part in parts for seed in part.seeds})
    shape = len(problems), len(algorithms), len(budgets), len(seeds)
    values = np.full((len(MEASURES), *shape), np.nan)
    spent, seconds = np.zeros(shape, dtype=int), np.full(shape[:2], np.nan)
    for part in parts:
        rows = [problems.index(name) for name in part.problems]
        columns = [algorithms.index(name) for name in part.algorithms]
        levels = [budgets.index(budget) for budget in part.budgets]
        place: tuple[Any, ...] = np.ix_(
            rows, columns, levels, [seeds.index(seed) for seed in part.seeds]
        )
        ran = part.spent > 0
        values[(slice(None), *place)] = np.where(ran, part.values, values[(slice(None), *place)])
        spent[place] = np.where(ran, part.spent, spent[place])
        seconds[np.ix_(rows, columns)] = part.seconds
    axes = tuple(problems), tuple(algorithms), tuple(budgets), tuple(seeds)
    return Scores(*axes, values, spent, seconds)


def _hardness_of(problems: Sequence[str], starts: int) -> dict[str, Hardness]:
    # A generator of its own for each, so that no card depends on which others are made.
    return {
        name: hardness(problem_of(name), np.random.default_rng(1), starts)
        for name in tqdm(problems, desc="hardness", unit="problem")
    }


def format_hardness(entries: dict[str, Hardness]) -> str:
    """Return the CSV text, with date and versions in a first comment line."""
    rows = (
        [name, *("" if cell is None else f"{cell:.6g}" for cell in entry)]
        for name, entry in entries.items()
    )
    return table_with_origin(["problem", *Hardness._fields], rows)


def read_hardness(rows: Sequence[dict[str, str]]) -> dict[str, Hardness]:
    """Return what `format_hardness` wrote, from the rows of the table."""
    entries = {}
    for row in rows:
        cells = (float(row[name]) if row[name] else None for name in Hardness._fields)
        entry = Hardness(*cast(Any, cells))
        counts = {
            name: None if getattr(entry, name) is None else int(getattr(entry, name))
            for name in ("optima", "pieces")
        }
        entries[row["problem"]] = entry._replace(**cast(Any, counts))
    return entries
