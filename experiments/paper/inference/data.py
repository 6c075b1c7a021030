"""Outcomes of searches, profiles and posteriors: as objects, and as the CSV that is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.paper.calibrating.ladder import EFFECTS, NARROW, Candidate
from experiments.paper.inference.closures import CLOSURES
from experiments.paper.inference.likelihood import OBSERVED, Evaluation, evaluate
from experiments.paper.inference.posterior import OPTIMA, Posterior, Profile
from experiments.paper.inference.rungs import Rung, rung_named
from experiments.paper.inference.search import BASIN, Search
from experiments.runner.committed import read_rows, table_with_origin
from pymoo_hdte._runner.campaign import Run

PARAMETERS = tuple(Rung(Candidate(EFFECTS, "semi_amplitude", NARROW), tuple(CLOSURES)).bounds)
_FIT = ("target", "rung", "seed", "effort", "starts", "followed", "reached", "deviance")
_DRAW = ("target", "rung", "deviance")
_PROFILE = ("target", "rung", "parameter", "value", "deviance")


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


@dataclass(frozen=True)
class Draws:
    """Draws of a posterior: n values of each parameter, physical, and of `OPTIMA`, by name."""

    target: str
    rung: Rung
    deviance: NDArray[np.float64]
    parameters: dict[str, NDArray[np.float64]]
    optima: dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Profiled:
    """Least deviances over values of each parameter on the searched scale, (n, 2) by name."""

    target: str
    rung: Rung
    curves: dict[str, NDArray[np.float64]]


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


def format_draws(jobs: Sequence[Posterior], runs: Sequence[Run]) -> str:
    """Return the CSV text of posteriors, a row a draw."""
    rows = []
    for job, run in zip(jobs, runs, strict=True):
        size = len(job.rung.bounds)
        for values in run.values:
            parameters = job.rung.physical(values[1 : 1 + size])
            rows.append([job.target, job.rung.name, f"{values[0]:.7g}", *_cells(parameters),
                         *(f"{value:.7g}" for value in values[1 + size :])])  # fmt: skip
    return table_with_origin([*_DRAW, *PARAMETERS, *OPTIMA], rows)


def read_draws(path: Path) -> list[Draws]:
    """Read what `format_draws` wrote, in its order."""
    groups: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in read_rows(path):
        groups.setdefault((row["target"], row["rung"]), []).append(row)
    draws = []
    for (target, name), rows in groups.items():
        rung = rung_named(name)

        def column(key: str, rows: list[dict[str, str]] = rows) -> NDArray[np.float64]:
            return np.array([float(row[key]) for row in rows])

        parameters = {key: column(key) for key in rung.bounds}
        optima = {key: column(key) for key in OPTIMA}
        draws.append(Draws(target, rung, column("deviance"), parameters, optima))
    return draws


def format_profiles(jobs: Sequence[Profile], runs: Sequence[Run]) -> str:
    """Return the CSV text of profiles, a row a value."""
    rows = [
        [
            job.target,
            job.rung.name,
            list(job.rung.bounds)[int(axis)],
            f"{value:.7g}",
            f"{least:.7g}",
        ]
        for job, run in zip(jobs, runs, strict=True)
        for axis, value, least in run.values
    ]  # fmt: skip
    return table_with_origin(_PROFILE, rows)


def read_profiles(path: Path) -> list[Profiled]:
    """Read what `format_profiles` wrote; values rise in each curve."""
    groups: dict[tuple[str, str], dict[str, list[tuple[float, float]]]] = {}
    for row in read_rows(path):
        curves = groups.setdefault((row["target"], row["rung"]), {})
        point = (float(row["value"]), float(row["deviance"]))
        curves.setdefault(row["parameter"], []).append(point)
    return [
        Profiled(target, rung_named(name), {key: np.array(sorted(c)) for key, c in curves.items()})
        for (target, name), curves in groups.items()
    ]


def _cells(parameters: dict[str, float]) -> list[str]:
    return [f"{parameters[n]:.9g}" if n in parameters else "" for n in PARAMETERS]
