"""A virtual identification campaign: 20 prototypes on the bench, and what is read off them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from experiments.paper.bench.prototypes import draw_prototypes
from experiments.paper.bench.rigs import COMPLETE_DRIVE, INPUT_BEARING, OUTPUT_BEARING, TorsionBench
from experiments.published_values import TABLE_3, TABLE_6
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.identification import (
    LinearFit,
    NoLoadRun,
    Series,
    TorsionLoop,
    bearing_damping,
    mesh_damping,
    series,
    stiffness,
)
from pymoo_hdte.identification.damping import INPUT_SPEEDS, OUTPUT_SPEEDS
from pymoo_hdte.identification.prototypes import RunKey

COEFFICIENTS = ("K", "B_in", "B_fc", "B_out")
N_PROTOTYPES, N_REPEATS = 20, 3
"""Repeats of the no-load runs; the paper prints none for the torsion loop, here there is one."""

TORSION = TorsionBench()

NOMINAL_STIFFNESS = hs_20_100().nominal.stiffness
STIFFNESS_CV = float(
    np.std([p.K for p in TABLE_6.values()], ddof=1) / np.mean([p.K for p in TABLE_6.values()])
)
"""Of the five prototypes of Table 6, since Table 3 prints none."""


@dataclass(frozen=True)
class Records:
    """All records of one campaign, by prototype and repeat."""

    loops: Mapping[RunKey, TorsionLoop]
    bearing: Mapping[RunKey, NoLoadRun]
    complete: Mapping[RunKey, NoLoadRun]
    output: Mapping[RunKey, NoLoadRun]

    def fits(self) -> dict[str, dict[RunKey, LinearFit]]:
        """Identify every coefficient from every record."""
        return {
            "K": {key: stiffness(loop) for key, loop in self.loops.items()},
            "B_in": {key: bearing_damping(run) for key, run in self.bearing.items()},
            "B_fc": {key: mesh_damping(r, self.complete[key]) for key, r in self.bearing.items()},
            "B_out": {key: bearing_damping(run) for key, run in self.output.items()},
        }


@dataclass(frozen=True)
class Truth:
    """What a campaign should find: each coefficient's mean and standard deviation, and of one unit.

    ``std`` is that of a prototype's identified mean, which keeps a third of the repeats' variance.
    ``first`` are the true values of prototype 1.
    """

    mean: Mapping[str, float]
    std: Mapping[str, float]
    first: Mapping[str, float]


def draw_campaign(rng: np.random.Generator) -> tuple[Records, Truth]:
    """Draw prototypes around Tables 3 and 4 and record them on the virtual bench."""
    means = np.array([NOMINAL_STIFFNESS, *(row.mean for row in TABLE_3.values())])
    stds = np.array([STIFFNESS_CV * NOMINAL_STIFFNESS, *(row.std for row in TABLE_3.values())])
    prototypes = draw_prototypes(means, stds, N_PROTOTYPES, rng)
    loops, bearing, complete, output = {}, {}, {}, {}
    for number, (spring, b_in, b_fc, b_out) in enumerate(prototypes, start=1):
        loops[number, 1] = TORSION.record(spring, rng)
        for repeat in range(1, N_REPEATS + 1):
            bearing[number, repeat] = INPUT_BEARING.record(b_in, rng)
            complete[number, repeat] = COMPLETE_DRIVE.record(b_in + b_fc, rng)
            output[number, repeat] = OUTPUT_BEARING.record(b_out, rng)
    truth = Truth(
        mean=_loading(dict(zip(COEFFICIENTS, means, strict=True))),
        std=_identified_stds(dict(zip(COEFFICIENTS, stds, strict=True))),
        first=_loading(dict(zip(COEFFICIENTS, prototypes[0], strict=True))),
    )
    return Records(loops, bearing, complete, output), truth


def summaries(fits: Mapping[str, Mapping[RunKey, LinearFit]]) -> dict[str, Series]:
    """Summarise every coefficient over the prototypes."""
    return {
        name: series({key: fit.slope for key, fit in by_run.items()})
        for name, by_run in fits.items()
    }


def slope_error_per_noise(coefficient: str) -> float:
    """Return the standard error of one damping slope for a torque noise of 1 N.m, rad/s."""
    speeds = OUTPUT_SPEEDS if coefficient == "B_out" else INPUT_SPEEDS
    runs = 2.0 if coefficient == "B_fc" else 1.0
    return float((runs / ((speeds - speeds.mean()) ** 2).sum()) ** 0.5)


def _loading(values: dict[str, float]) -> dict[str, float]:
    """Replace the spring's stiffness by the slope of a1, which friction bends."""
    return values | {"K": TORSION.loading_stiffness(values["K"])}


def _identified_stds(stds: dict[str, float]) -> dict[str, float]:
    step = stds["K"]
    ends = [TORSION.loading_stiffness(NOMINAL_STIFFNESS + sign * step) for sign in (-1.0, 1.0)]
    values = {"K": (ends[1] - ends[0]) / 2.0}
    noises = {"B_in": INPUT_BEARING, "B_fc": COMPLETE_DRIVE, "B_out": OUTPUT_BEARING}
    for name, bench in noises.items():
        error = bench.torque_noise * slope_error_per_noise(name)
        values[name] = (stds[name] ** 2 + error**2 / N_REPEATS) ** 0.5
    return values
