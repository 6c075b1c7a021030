"""Outcomes of searches: as objects, and as the CSV that is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from experiments.paper.calibrating.ladder import EFFECTS, NARROW, Candidate
from experiments.paper.inference.closures import CLOSURES
from experiments.paper.inference.likelihood import OBSERVED, Evaluation, evaluate
from experiments.paper.inference.rungs import Rung, rung_named
from experiments.paper.inference.search import BASIN, Search
from experiments.runner.committed import read_rows, table_with_origin
from pymoo_hdte._runner.campaign import Run

PARAMETERS = tuple(Rung(Candidate(EFFECTS, "semi_amplitude", NARROW), tuple(CLOSURES)).bounds)
_FIT = ("target", "rung", "seed", "effort", "starts", "followed", "reached", "deviance")


@dataclass(frozen=True)
class Fit:
    """The best end of a search, how many starts were made and followed, and how many reached it."""

    target: str
    rung: Rung
    seed: int
    effort: str
    starts: int
    followed: int
    reached: int
    deviance: float
    parameters: dict[str, float]

    @cached_property
    def evaluation(self) -> Evaluation:
        """What the rung predicts there."""
        return evaluate(self.rung, self.parameters)

    @property
    def n_parameters(self) -> int:
        """How many are open; the size of the node noise is one where it is fitted."""
        return len(self.parameters) + (self.target == "noise")

    @property
    def node_noise(self) -> float:
        """Standard deviation of the nodes' noise, arcsec; 0 where none is fitted."""
        return self.evaluation.node_noise if self.target == "noise" else 0.0

    @property
    def bic(self) -> float:
        """Deviance and the price of the parameters, k ln n, for nine numbers."""
        return self.deviance + self.n_parameters * float(np.log(len(OBSERVED)))


def fits_of(jobs: Sequence[Search], runs: Sequence[Run]) -> list[Fit]:
    """Return the best end of every search."""
    return [
        Fit(
            target=job.target,
            rung=job.rung,
            seed=job.seed,
            effort=job.effort.name,
            starts=job.effort.starts,
            followed=len(run.values),
            reached=int(np.sum(run.values[:, 0] <= run.values[0, 0] + BASIN)),
            deviance=float(run.values[0, 0]),
            parameters=job.rung.physical(run.values[0, 1:]),
        )
        for job, run in zip(jobs, runs, strict=True)
    ]


def format_fits(fits: Sequence[Fit]) -> str:
    """Return the CSV text of fits, with date and versions in a first comment line."""
    rows = [
        [fit.target, fit.rung.name, fit.seed, fit.effort, fit.starts, fit.followed, fit.reached,
         f"{fit.deviance:.7g}", *_cells(fit.parameters)]
        for fit in fits
    ]  # fmt: skip
    return table_with_origin([*_FIT, *PARAMETERS], rows)


def read_fits(path: Path) -> list[Fit]:
    """Read what `format_fits` wrote."""
    fits = []
    for row in read_rows(path):
        rung = rung_named(row["rung"])
        fits.append(
            Fit(
                target=row["target"],
                rung=rung,
                seed=int(row["seed"]),
                effort=row["effort"],
                starts=int(row["starts"]),
                followed=int(row["followed"]),
                reached=int(row["reached"]),
                deviance=float(row["deviance"]),
                parameters={name: float(row[name]) for name in rung.bounds},
            )
        )
    return fits


def _cells(parameters: dict[str, float]) -> list[str]:
    return [f"{parameters[n]:.9g}" if n in parameters else "" for n in PARAMETERS]
