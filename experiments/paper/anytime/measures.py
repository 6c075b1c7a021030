"""IGD, Spacing and hypervolume of every run at every budget, in each way the paper may mean."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.paper.anytime.job import sets_of
from pymoo_hdte._comparing.indicators import Indicators, IndicatorsAgainst, front_among
from pymoo_hdte._comparing.runs import FINAL_SIZE
from pymoo_hdte._runner.campaign import Run

TRUE, UNION = "true front", "union of runs"
RAW, NORMALISED = "arcsec", "normalised"
RETURNED, EQUAL = "as returned", "no more than the population"


class Scale(NamedTuple):
    """Against which front, and in which unit, an indicator is measured."""

    reference: str
    unit: str

    @property
    def suffix(self) -> str:
        """Ending of the names of its columns."""
        return f"{self.reference.split()[0]}_{self.unit}"


SCALES = tuple(Scale(*entry) for entry in product((TRUE, UNION), (RAW, NORMALISED)))
MEASURES = (
    "size",
    *(f"{name}_{scale.suffix}" for scale in SCALES for name in ("igd", "spacing")),
    *(f"hypervolume_{scale.suffix}" for scale in SCALES if scale.unit == NORMALISED),
)
"""What is measured of every set: its number of designs, then its indicators in each scale.

A hypervolume in arcsec would only be another multiple of the normalised one.
"""

RunsOfAlgorithms = Mapping[tuple[str, int], Run]
"""By algorithm and seed."""


def measure(
    runs: RunsOfAlgorithms, budget: int, population: int, true_front: NDArray[np.float64]
) -> dict[tuple[str, str, int], list[float]]:
    """Return the `MEASURES` of all runs of one population at one budget.

    The union of runs is that of all given algorithms and seeds at this population and budget. It
    stands beside the objectives as the runs saw them, the true front beside the exact moments of
    the same designs.

    Returns
    -------
    dict of list of float
        By number of designs counted (`RETURNED`, `EQUAL`), algorithm and seed. With 50 particles
        or more nothing is thinned further, and there is no `EQUAL`.
    """
    seen = [sets_of(run, budget, FINAL_SIZE)[0] for run in runs.values()]
    references = {TRUE: true_front, UNION: front_among(np.concatenate(seen))}
    against = {
        scale: _indicators(references[scale.reference], normalised=scale.unit == NORMALISED)
        for scale in SCALES
    }
    counted = {RETURNED: FINAL_SIZE} | ({EQUAL: population} if population < FINAL_SIZE else {})
    measured = {}
    for (counting, most), (who, run) in product(counted.items(), runs.items()):
        as_seen, as_is = sets_of(run, budget, most)
        indicators = {
            scale: _indicators_of(indicators_of, as_is if scale.reference == TRUE else as_seen)
            for scale, indicators_of in against.items()
        }
        measured[counting, *who] = [
            float(len(as_seen)),
            *(
                value
                for scale in SCALES
                for value in (indicators[scale].igd, indicators[scale].spacing)
            ),
            *(indicators[scale].hypervolume for scale in SCALES if scale.unit == NORMALISED),
        ]
    return measured


def _indicators(front: NDArray[np.float64], *, normalised: bool) -> IndicatorsAgainst | None:
    """Return the indicators, or None against a union that is too small to have an extent."""
    if not np.all(np.ptp(front, axis=0) > 0.0):
        return None
    return IndicatorsAgainst(front, normalised=normalised)


def _indicators_of(against: IndicatorsAgainst | None, F: NDArray[np.float64]) -> Indicators:
    return against(F) if against is not None else Indicators(np.nan, np.nan, np.nan, np.nan)
