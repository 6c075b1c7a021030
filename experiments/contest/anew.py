"""Runs of an algorithm that changed, made anew in a stored outcome of the contest.

``python -m experiments.contest.anew peers OUT NAME,NAME`` runs these algorithms as far as they
stand in ``experiments/data/peers.csv`` (or ``cards``), keeps each run in ``OUT`` and writes the
file there with their new rows, all others as they were.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from experiments.contest.contestants import EVERYONE
from experiments.contest.job import ContestRun
from experiments.contest.peers_data import (
    DIGITS,
    Scores,
    committed_scores,
    format_scores,
    measure,
)
from experiments.runner.campaign import Campaign
from experiments.runner.committed import rounded
from experiments.runner.store import write_atomically
from pymoo_hdte.checks import one_of

OUTCOMES = ("peers", "cards")


def anew(scores: Scores, campaign: Campaign, algorithms: Sequence[str]) -> Scores:
    """Return scores in which every run of these algorithms was made again; seconds stay.

    Raises
    ------
    InvalidInput
        For a name that does not stand in the scores.
    """
    for name in algorithms:
        one_of("NAME", name, scores.algorithms)
    jobs = [
        ContestRun(scores.problems[problem], name, seed, budgets)
        for name in algorithms
        for problem, spent in enumerate(scores.spent[:, scores.algorithms.index(name)])
        for place, seed in enumerate(scores.seeds)
        if (stored := tuple(np.array(scores.budgets)[spent[:, place] > 0].tolist()))
        for budgets in EVERYONE[name].budgets_of_runs(stored)
    ]
    values, spent = scores.values.copy(), scores.spent.copy()
    for job, run in zip(jobs, campaign.run(jobs, "anew"), strict=True):
        where = scores.problems.index(job.problem), scores.algorithms.index(job.algorithm)
        for budget in job.budgets:
            place = (*where, scores.budgets.index(budget), scores.seeds.index(job.seed))
            measured, spent[place] = measure(job.problem, run, budget)
            values[(slice(None), *place)] = [rounded(value, DIGITS) for value in measured]
    return replace(scores, values=values, spent=spent)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the runs anew and write the outcome with them."""
    parser = argparse.ArgumentParser(prog="python -m experiments.contest.anew")
    parser.add_argument("outcome", choices=OUTCOMES)
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("names", metavar="NAME,NAME", help="of algorithms")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)
    with ProcessPoolExecutor(options.workers) as executor:
        campaign = Campaign(options.out, executor)
        scores = anew(committed_scores(options.outcome), campaign, options.names.split(","))
    write_atomically(options.out / f"{options.outcome}.csv", format_scores(scores).encode())


if __name__ == "__main__":
    main()
