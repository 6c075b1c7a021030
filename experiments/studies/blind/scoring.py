"""One blind case run, analysed and scored against its truth, as a job of a campaign."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.studies.blind.campaigns import Hiding, campaign_of, hiding
from experiments.studies.blind.cases import Case
from experiments.studies.blind.truth import (
    ERROR,
    NAMES,
    PORTS,
    STATUSES,
    code,
    code_of_set,
    may_be_named,
    one_name,
    to_be_named,
)
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.discrepancy import Campaign
from pymoo_hdte.discrepancy._answers.next_test_drive import next_experiment
from pymoo_hdte.discrepancy._answers.where.location import locate
from pymoo_hdte.discrepancy._answers.where.map import Flags
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import Features, measure
from pymoo_hdte.discrepancy._evidence.order_lines.observations import (
    cell_chi_square,
    cell_degrees_of_freedom,
)
from pymoo_hdte.discrepancy._records.believed import MECHANICAL
from pymoo_hdte.discrepancy._report.document import effects_of
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit, fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.validation_drive import Validation, validate_drive

PARTS = ("analyse", "locate", "prove", "next_experiment")
RIVALS = ("largest_residual_rule", "sparse_regression")
"""Functions of `simpler_tools`, from an analysis to a name, "adequate" or "unlisted"."""
COMPARED = ("none", "single", "unlisted")
"""Kinds on which the simpler tools are run too."""
REVISED = ("single", "pair", "triple")
"""Kinds in which a right verdict adds listed effects to the model."""
LOCATED = ("none", "unlisted", *REVISED)
"""Kinds whose flagged cells are compared with the cells truly moved."""
GAPS = ("transmission_error", "leading", "overall")
"""Errors on held-out records: that of the verdict's document, that of the channel in which the base
stands out of the noise most, and that of all features."""
DETERMINED = 0.5
"""Standard error, in tolerances, up to which the records and not the bounds say what a parameter
is: damping of the output bearings has one of 150."""
MOST_IN_CLASS = 3
"""Members of a class that still says something."""
PLACES = tuple(f"chosen_{number}" for number in range(1, 13))
"""Of what is named: three effects at most, and as many as nine base parameters."""
VERDICT_COLUMNS = (
    "status",
    "probability",
    *(f"{place}{part}" for place in PLACES for part in ("", "_port", "_order")),
    "equivalents",
    "members",
    "truth_in_class",
)
NUMBERS = (
    "cells_moved",
    "cells_flagged",
    "cells_both",
    "bias_before",
    "bias_after",
    "bias_error",
    "bias_of_all_before",
    "bias_of_all_after",
    "quantities",
    "quantities_covered",
    *(f"{error}_{state}" for error in GAPS for state in ("before", "after", "floor")),
)
COLUMNS = (*VERDICT_COLUMNS, *NUMBERS, *RIVALS)

Scores = dict[str, float]
Tool = Callable[[DriveFinding], str]
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class BlindJob:
    """One case; its run has one row of `COLUMNS`, nan where a kind is not scored."""

    case: Case

    @property
    def key(self) -> str:
        """All fields of the case in one name."""
        return self.case.key

    def execute(self) -> Run:
        """Run, analyse and score; an exception is a defect, shown and scored as wrong.

        Seconds are those of the processor, so that other work on the machine does not count.
        """
        tools = other_tools()
        try:
            scores, parts = score(self.case, tools)
        except Exception:
            _show_defect(self.key)
            scores, parts = {"status": code(ERROR, STATUSES)}, ()
        row = [scores.get(column, np.nan) for column in COLUMNS]
        return Run(COLUMNS, np.array([row]), sum(parts), parts)


def other_tools() -> dict[str, Tool]:
    """Return the simpler tools by name.

    They are imported here only, so that a report of stored outcomes does not need their packages.
    """
    module = import_module("experiments.studies.blind.simpler_tools")
    return {name: getattr(module, name) for name in RIVALS}


def score(case: Case, tools: Mapping[str, Tool]) -> tuple[Scores, tuple[float, ...]]:
    """Return the scores of a case and the seconds of the `PARTS`."""
    hidden = hiding(case)
    campaign = campaign_of(hidden, hidden.session)
    analysis, analysed = _timed(examine_drive, campaign)
    location, located = _timed(locate, analysis)
    validation, validated = _timed(validate_drive, analysis)
    _, proposed = _timed(next_experiment, analysis)
    verdict = analysis.verdict
    scores = verdict_scores(case, verdict)
    if verdict.status == "named":
        scores |= coverage_scores(hidden, verdict)
    if case.kind in LOCATED:
        twin = campaign_of(hidden, hidden.twin) if hidden.effects else campaign
        scores |= location_scores(truly_moved(analysis, twin), location.flagged)
        if case.kind in REVISED:
            scores |= bias_scores(verdict, twin_fit(twin, analysis.data.features))
    if validation is not None:
        scores |= error_scores(validation)
    if case.kind in COMPARED:
        scores |= {name: code(_answer(tool, analysis), NAMES) for name, tool in tools.items()}
    return scores, (analysed, located, validated, proposed)


def verdict_scores(case: Case, verdict: Verdict) -> Scores:
    """Return what the verdict says, and whether its class holds what is hidden."""
    probability = verdict.probability
    scores = {"status": code(verdict.status, STATUSES)}
    scores["probability"] = np.nan if probability is None else float(probability)
    candidates = verdict.chosen.candidates if verdict.chosen is not None else ()
    for place, candidate in zip(PLACES, candidates, strict=False):
        scores[place] = code(candidate.name, NAMES)
        scores[f"{place}_port"] = code(candidate.port, PORTS)
        scores[f"{place}_order"] = np.nan if candidate.order is None else candidate.order
    sets = [_names(hypothesis) for hypothesis in verdict.equivalent]
    scores["equivalents"] = code_of_set(set().union(*sets))
    rivals = verdict.equivalent if verdict.chosen is None else (verdict.chosen, *verdict.equivalent)
    scores["members"] = (
        float(len({_places(hypothesis) for hypothesis in rivals})) if rivals else 0.0
    )
    hidden, allowed = to_be_named(case), may_be_named(case)
    scores["truth_in_class"] = float(
        bool(hidden) and any(hidden <= _names(hypothesis) <= allowed for hypothesis in rivals)
    )
    return scores


def _names(hypothesis: Hypothesis) -> set[str]:
    return {one_name(candidate.name, candidate.port) for candidate in hypothesis.candidates}


def _places(hypothesis: Hypothesis) -> frozenset[tuple[str, str, float | None]]:
    """Return names, ports and orders: forms of one effect are one member of a class."""
    return frozenset((one_name(c.name, c.port), c.port, c.order) for c in hypothesis.candidates)


def coverage_scores(hidden: Hiding, verdict: Verdict) -> Scores:
    """Return how many quantities of named effects have true values, and how many are covered.

    Quantities that the hidden form does not have are left out, and effects that are not hidden.
    """
    total, covered = 0, 0
    for effect in effects_of(verdict):
        for name, stated in effect["parameters"].items():
            true = hidden.quantities.get((one_name(effect["name"], effect["port"]), name))
            if true is not None:
                lower, upper = stated["interval95"]
                total += 1
                covered += lower <= true <= upper
    return {"quantities": float(total), "quantities_covered": float(covered)}


def truly_moved(analysis: DriveFinding, twin: Campaign) -> Flags:
    """Return the cells that the hidden effects move by more than the root mean square of the noise.

    The twin is the same run without them: it differs by nothing else, not even by its noise, but
    for the rounding of the encoders, a hundredth of that noise's variance.
    """
    features = analysis.data.features
    moved: NDArray[np.float64] = cell_chi_square(
        analysis.data, features.values - _features(twin, features).values
    )
    return moved > cell_degrees_of_freedom(analysis.data)


def location_scores(moved: Flags, flagged: Flags) -> Scores:
    """Return the numbers of cells moved, flagged and both."""
    return {
        "cells_moved": float(moved.sum()),
        "cells_flagged": float(flagged.sum()),
        "cells_both": float((moved & flagged).sum()),
    }


def twin_fit(twin: Campaign, features: Features) -> Fit:
    """Fit the base to a campaign without the effect, with the records and orders of ``kept``."""
    return fit(training_data(twin, _features(twin, features)))


def bias_scores(verdict: Verdict, twin: Fit) -> Scores:
    """Return how far the effect moves the base before and after the revision, in tolerances.

    Root mean square over mechanical parameters and amplitudes of the static error: over all of
    them, and over those that twin and revised fit determine (`DETERMINED`), with the twin's
    standard error of these.
    """
    layout = Layout(twin.parameters)
    lines = [p.name for p in twin.parameters if p.name.startswith("error_amplitude_")]
    rows = np.array([layout.index(name) for name in (*MECHANICAL, *lines)])
    scale = layout.array("scale")[rows]
    error, revised = (
        np.sqrt(np.diagonal(fitted.covariance)[rows]) / scale for fitted in (twin, verdict.accepted)
    )
    known = np.maximum(error, revised) < DETERMINED
    # Where nothing is known well enough, there is nothing to compare.
    scores = {"bias_error": _root_mean_square(error[known])} if known.any() else {}
    for state, fitted in (("before", verdict.base), ("after", verdict.accepted)):
        moved = (fitted.values[rows] - twin.values[rows]) / scale
        if known.any():
            scores[f"bias_{state}"] = _root_mean_square(moved[known])
        scores[f"bias_of_all_{state}"] = _root_mean_square(moved)
    return scores


def error_scores(validation: Validation) -> Scores:
    """Return before, after and noise floor of `GAPS`."""
    errors = (
        validation.channels["transmission_error"],
        validation.channels[validation.leading],
        validation.overall,
    )
    scores = {}
    for name, error in zip(GAPS, errors, strict=True):
        scores[f"{name}_before"] = error.before
        scores[f"{name}_after"] = error.after
        scores[f"{name}_floor"] = error.noise_floor
    return scores


def _features(campaign: Campaign, features: Features) -> Features:
    """Return the features of a campaign in the records and at the orders of ``kept``."""
    names = {record.name for record in features.records}
    records = [record for record in campaign.train if record.name in names]
    return measure(campaign, records, features.orders.tolist())


def _root_mean_square(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _answer(tool: Tool, analysis: DriveFinding) -> str:
    """Return what a simpler tool says; its defects must not look like the workflow's."""
    try:
        return tool(analysis)
    except Exception:
        _show_defect(tool.__name__)
        return ERROR


def _show_defect(where: str) -> None:
    tqdm.write(f"{where}\n{traceback.format_exc()}", file=sys.stderr)


def _timed(function: Callable[..., _Result], argument: object) -> tuple[_Result, float]:
    begin = time.process_time()
    result = function(argument)
    return result, time.process_time() - begin
