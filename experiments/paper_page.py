"""The page on the paper's numbers, ``docs/paper.md``, from stored outcomes and quick computations.

``python -m experiments.paper_page`` writes it anew; a test holds the file against `page`, so that
no number on it can differ from what the experiments say.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from experiments.paper import later_prototypes, published, table2, table5, table8
from experiments.paper.anytime.data import OF_TABLE_7, Case, Contested, Scores, committed_scores
from experiments.paper.anytime.measures import RETURNED
from experiments.paper.anytime.moments import COMMON, EXACT, FRESH
from experiments.paper.anytime.readings import readings
from experiments.paper.anytime.sentences import EVERY_RIVAL, closest_sentence, totals_of, who_finds
from experiments.paper.anytime.tables import SCALE, STATED
from experiments.paper.calibrating import experiment as calibration
from experiments.paper.calibrating.data import Outcome, read_outcomes
from experiments.paper.calibrating.rigid import N_PARAMETERS, simplest
from experiments.paper.calibrating.tables import best_rungs
from experiments.paper.inference import experiment as inference
from experiments.paper.inference.data import read_fits
from experiments.paper.prototypes import consistency
from experiments.paper.table8 import dominated
from experiments.published_values import TABLE_5, TABLE_8, TABLE_9, Moments
from experiments.runner.committed import committed_file
from experiments.runner.texts import filled
from experiments.studies import cost
from pymoo_hdte._comparing.published import TABLE_7
from pymoo_hdte._comparing.runs import AS_PRINTED, FIRST_STEP, VELOCITIES
from pymoo_hdte._runner.result import WITHIN_PAPER, significant
from pymoo_hdte._runner.store import write_atomically
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems import RobustDTE

PAGE = Path(__file__).parents[1] / "docs" / "paper.md"
MODEL = "calibrated"
ORDER = 3
"""Order of the surrogate that the paper chose."""


def page() -> str:
    """Return the text of the page."""
    return filled("paper.md", **values())


def in_short() -> tuple[str, ...]:
    """Return the sentences of README and ``paper.md`` about the paper."""
    printed, drive = published.printed_equations(), simplest()
    low, high = (printed[reading].dte for reading in published.READINGS)
    scores, best = committed_scores(), _best_of_the_ladder()
    law, free = (totals_of(scores, velocity) for velocity in (AS_PRINTED, FIRST_STEP))
    return (
        "The paper contradicts itself: by its validation figures, prototype "
        f"{consistency.HIGHEST} must be predicted "
        f"{significant(consistency.bounds().least_lead, 3)} arcsec above prototype "
        f"{consistency.LOWEST}, whose static error is {significant(consistency.excess(), 2)} "
        "arcsec larger.",
        f"Its equations as printed give a transmission error of {low:.0f} or {high:.0f} arcsec, "
        "depending on how the static error is read; the paper states "
        f"{TABLE_8['initial'].mean_arcsec:.0f}.",
        f"A rigid drive that reads {significant(100.0 * drive.torsion_share, 1)} % of the torsion "
        f"as error has {N_PARAMETERS} parameters and as good a BIC as our model with "
        f"{best.n_parameters}, though it fits less closely.",
        f"At the stated budget, with the paper's samples, "
        f"{who_finds(scores, Contested(MODEL, COMMON, AS_PRINTED))}.",
        "AMP-MOPSO therefore shows no advantage over NSGA-II there.",
        f"Below 100 particles it is ahead of MOPSO in {law.ahead['MOPSO']} of {law.cells} settings "
        f"and of NSGA-II in {law.ahead['NSGA-II']}; under another law of first velocities in "
        f"{free.ahead['MOPSO']} and {free.ahead['NSGA-II']}.",
    )


def values() -> dict[str, Any]:
    """Return what the template shows, each number with the digits that it is printed with."""
    scores, problem = committed_scores(), RobustDTE()
    front = problem.pareto_front()
    best = front[WeightedUtopia(PREFERENCES["balanced"]).do(front)]
    printed = published.printed_equations()
    igd, spacing = (_stated(scores, EXACT, name) for name in ("igd", "spacing"))
    return {
        "paper": {
            "initial": _moments(TABLE_8["initial"]),
            "balanced": _moments(TABLE_8["balanced"]),
            "rmse": TABLE_5[ORDER].rmse_arcsec,
            "igd": _list(row.igd for row in TABLE_7.values()),
            "spacing": _list(row.spacing for row in TABLE_7.values()),
            "factors": _factors(),
        },
        "initial": _moments(problem.evaluate(problem.nominal)),
        "balanced": _moments(problem.evaluate(np.array(TABLE_9["balanced"]))),
        "best_balanced": _moments(best),
        "printed": {
            reading: _moments((moments.mean, moments.std)) for reading, moments in printed.items()
        },
        "rmse": "{:.2f} ± {:.2f}".format(*table5.rmse_over_hypercubes(MODEL, ORDER)),
        "igd": _list(igd),
        "spacing": _list(spacing),
        "igd_common": _list(_stated(scores, COMMON, "igd")),
        "found": {
            moments: who_finds(scores, Contested(MODEL, moments, AS_PRINTED))
            for moments in (EXACT, COMMON, FRESH)
        },
        "rivals": EVERY_RIVAL,
        "laws": {law: totals_of(scores, law) for law in VELOCITIES},
        "n_seeds": len(scores.values[_case(Contested(MODEL, EXACT, AS_PRINTED), OF_TABLE_7[0])]),
        "closest": closest_sentence(readings(scores)),
        "contradictions": [_sentence(part) for part in _within_paper()],
        "models": [_sentence(part) for part in _of_models(printed)],
    }


def _within_paper() -> Iterator[str]:
    for parts in (
        consistency.of_the_first_page(),
        {WITHIN_PAPER: table2.of_the_first_page()},
        later_prototypes.of_the_first_page(),
        table8.of_the_first_page(),
    ):
        yield from parts.values()


def _of_models(printed: dict[str, published.Printed]) -> Iterator[str]:
    yield published.of_the_first_page(printed)
    yield calibration.of_the_first_page(_best_of_the_ladder())
    yield inference.of_the_first_page(read_fits(committed_file(inference.FITS, inference.NAME)))
    yield dominated(MODEL)
    yield cost.verdict(quick=True)


def _best_of_the_ladder() -> Outcome:
    outcomes = read_outcomes(committed_file(calibration.OUTCOMES, "calibration"))
    return best_rungs(outcomes, "table8")[0]


def _stated(scores: Scores, moments: str, indicator: str) -> list[float]:
    contested = Contested(MODEL, moments, AS_PRINTED)
    return [
        float(scores.of(_case(contested, name), f"{indicator}_{SCALE.suffix}").mean())
        for name in OF_TABLE_7
    ]


def _case(contested: Contested, algorithm: str) -> Case:
    return Case(*contested, RETURNED, *STATED, algorithm)


def _factors() -> str:
    others = [row.igd / TABLE_7["AMP-MOPSO"].igd for row in TABLE_7.values()][:-1]
    return " and ".join(significant(factor, 2) for factor in sorted(others))


def _moments(pair: Moments | Any) -> str:
    return "{:.2f}, {:.2f}".format(*pair)


def _list(numbers: Any) -> str:
    return ", ".join(f"{number:.4f}" for number in numbers)


def _sentence(part: str) -> str:
    return f"{part[0].upper()}{part[1:]}."


if __name__ == "__main__":
    write_atomically(PAGE, page().encode())
