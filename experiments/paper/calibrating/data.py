"""Outcomes of calibration fits: as objects, and as the small CSV that the repository keeps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.paper.calibrating.fitting import TRAITS, Bootstrap, Fit
from experiments.paper.calibrating.ladder import EFFECTS, Candidate, ladder_rungs
from experiments.paper.calibrating.predictions import PUBLISHED
from experiments.runner.committed import read_rows, table_with_origin
from pymoo_hdte._runner.campaign import Run

_IDENTITY = ("kind", "direction", "candidate", "seed", "budget", "chi_square")


@dataclass(frozen=True)
class Outcome:
    """One local optimum of a fit, or one replicate of a bootstrap (``kind``)."""

    kind: str
    direction: str
    candidate: Candidate
    seed: int
    budget: str
    chi_square: float
    parameters: dict[str, float]
    predictions: dict[str, float]
    traits: dict[str, float]

    @property
    def n_parameters(self) -> int:
        """How many are open; the shape of theta_s is none where no effect is added.

        The printed equations follow theta_s like a rigid drive, whatever its shape.
        """
        return len(self.parameters) if self.candidate.effects else 1

    def gap(self, names: Sequence[str]) -> float:
        """Return the root mean square relative gap to the published numbers, in percent."""
        return gap(self.predictions, names)


def gap(predictions: dict[str, float], names: Sequence[str]) -> float:
    """Return the root mean square relative gap of predictions to `PUBLISHED`, in percent."""
    relative = [predictions[name] / PUBLISHED[name] - 1.0 for name in names]
    return 100.0 * float(np.sqrt(np.mean(np.square(relative))))


def largest_gap(predictions: dict[str, float], names: Sequence[str]) -> float:
    """Return the largest relative gap of predictions to `PUBLISHED`, in percent."""
    return 100.0 * max(abs(predictions[name] / PUBLISHED[name] - 1.0) for name in names)


def information_criteria(chi_square: float, parameters: int, numbers: int) -> tuple[float, float]:
    """Return AIC and BIC: chi-square and the price of the parameters, 2 k and k ln n."""
    return chi_square + 2.0 * parameters, chi_square + parameters * float(np.log(numbers))


def collect(jobs: Sequence[Fit | Bootstrap], runs: Sequence[Run]) -> list[Outcome]:
    """Turn the runs of jobs into outcomes, all optima of each, the best first."""
    outcomes = []
    for job, run in zip(jobs, runs, strict=True):
        kind = "bootstrap" if isinstance(job, Bootstrap) else "fit"
        for row in run.values:
            cells = dict(zip(run.columns, row.tolist(), strict=True))
            outcomes.append(
                Outcome(
                    kind=kind,
                    direction=job.direction,
                    candidate=job.candidate,
                    seed=job.seed,
                    budget=job.budget.name,
                    chi_square=cells["chi_square"],
                    parameters={name: cells[name] for name in job.candidate.bounds},
                    predictions={name: cells[name] for name in PUBLISHED},
                    traits={name: cells[name] for name in TRAITS},
                )
            )
    return outcomes


def format_outcomes(outcomes: Sequence[Outcome]) -> str:
    """Return the CSV text of outcomes, with date and versions in a first comment line."""
    parameters = list(Candidate(EFFECTS, "peak_to_peak", "R1").bounds)
    rows = []
    for outcome in outcomes:
        identity = (
            outcome.kind,
            outcome.direction,
            outcome.candidate.name,
            outcome.seed,
            outcome.budget,
        )
        numbers = [outcome.chi_square, *(outcome.parameters.get(name) for name in parameters)]
        numbers += [outcome.predictions[name] for name in PUBLISHED]
        numbers += [outcome.traits[name] for name in TRAITS]
        rows.append([*identity, *("" if n is None else f"{n:.7g}" for n in numbers)])
    return table_with_origin([*_IDENTITY, *parameters, *PUBLISHED, *TRAITS], rows)


def read_outcomes(path: Path) -> list[Outcome]:
    """Read what `format_outcomes` wrote."""
    rungs = {rung.name: rung for rung in ladder_rungs()}
    return [
        Outcome(
            kind=row["kind"],
            direction=row["direction"],
            candidate=rungs[row["candidate"]],
            seed=int(row["seed"]),
            budget=row["budget"],
            chi_square=float(row["chi_square"]),
            parameters={name: float(row[name]) for name in rungs[row["candidate"]].bounds},
            predictions={name: float(row[name]) for name in PUBLISHED},
            traits={name: float(row[name]) for name in TRAITS},
        )
        for row in read_rows(path)
    ]
