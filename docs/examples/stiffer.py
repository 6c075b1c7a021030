"""Stiffness and DTE: an experiment to copy, as the guide "Extend the package" runs it."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np

from experiments.runner.registry import Context
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte._runner.result import Column, Finding, Picture, Result, Table
from pymoo_hdte.problems import RobustDTE

FACTORS = (0.8, 0.9, 1.0, 1.1, 1.2)


@dataclass(frozen=True)
class StifferDrive:
    """Moments of the nominal design with a multiple of its stiffness."""

    factor: float

    @property
    def key(self) -> str:
        """All settings in one name."""
        return f"stiffer_{self.factor:g}"

    def execute(self) -> Run:
        """Return named columns, their values, and the seconds it took (0 if none shall be told)."""
        problem = RobustDTE()
        design = problem.nominal * [self.factor, 1.0, 1.0, 1.0]
        return Run(("mean", "std"), problem.evaluate(design[np.newaxis]), 0.0)


def run(context: Context) -> Result:
    """Compare designs of rising stiffness."""
    jobs = [StifferDrive(factor) for factor in FACTORS]
    runs = context.campaign.run(jobs, "stiffer")
    rows = tuple((job.factor, *one.values[0]) for job, one in zip(jobs, runs, strict=True))
    factors, means, stds = np.array(rows).T
    fig, ax = plt.subplots(figsize=(6.5, 3.5), layout="constrained")
    ax.errorbar(factors, means, yerr=stds, fmt="o", capsize=4)
    ax.set(xlabel="stiffness / nominal stiffness", ylabel="DTE, mean ± std [arcsec]")
    stiffest, nominal = means[-1], means[FACTORS.index(1.0)]
    sentence = (
        f"A drive {FACTORS[-1]} times as stiff has a mean DTE of {stiffest:.1f} arcsec, "
        f"the nominal one {nominal:.1f}."
    )
    table = Table(
        name="moments",
        title="Stiffness and DTE",
        columns=(Column("stiffness"), Column("mean", "arcsec"), Column("std", "arcsec")),
        rows=rows,
        findings=(Finding(stiffest < nominal, sentence, check=True, answers=True),),
    )
    return Result(
        title="What a stiffer drive would gain",
        command="python -m experiments stiffer",
        paragraphs=("Only the stiffness changes. It is given as a multiple of the nominal one.",),
        tables=(table,),
        pictures=(Picture("stiffness", "Mean and standard deviation of the DTE.", fig),),
    )
