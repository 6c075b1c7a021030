"""The next experiment: the test that best separates the named effect from other hypotheses.

Two models that fit all measurements are compared in tests within the range of measured conditions,
both new conditions and repeats of records, which still average the noise. Their difference is
weighted by the noise and by the uncertainty of both predictions: see `separation`, with which
campaigns are planned, too, and Box and Hill (Technometrics 1967). A test that leaves the answer to
chance is not proposed. Where nothing is missing, the record with the most uncertain prediction is
the most informative one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.planned_tests import Grid, Model, separation
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import labels_by_order
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._selection.candidate import labels_apart
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive._effects import ENCODER_LINE
from pymoo_hdte.effects.effect import effect_named

TESTS = ("running", "torsion_sweep", "reclocked_encoder", "none")

_RIVALS = 2
LARGEST_TURNS = 100
"""Cycles per output turn; the response of the drive identifies faster lines as its own."""


@dataclass(frozen=True)
class Proposal:
    """What to measure next.

    Attributes
    ----------
    description : str
        For the report.
    test : str
        One of `TESTS`; "none" where no test within the limits separates the two models, or where
        no known effect comes near the misfit.
    speed_rpm, load_torque : float or None
        r/min of the input, negative in reverse, and N.m; None for a sweep or no test.
    separates : tuple of str, or None
        Labels of the two models; None where the aim is a less uncertain prediction, or there is no
        model worth a test.
    expected_separation : float
        Expected chi-square between the two models, or of the uncertain prediction; without a test
        the largest of all.
    """

    description: str
    test: str
    speed_rpm: float | None
    load_torque: float | None
    separates: tuple[str, str] | None
    expected_separation: float

    def as_dict(self) -> dict[str, Any]:
        """Return the proposal as plain types."""
        return asdict(self) | {"separates": list(self.separates) if self.separates else None}


def next_experiment(finding: DriveFinding) -> Proposal:
    """Return the test to make next.

    Parameters
    ----------
    finding : DriveFinding
        Of `analysis.examine_drive`.
    """
    verdict, grid = finding.verdict, Grid.of(finding)
    if verdict.chosen is None:
        return _most_uncertain(grid, grid.model(verdict.base))
    if verdict.status == "unlisted" and not verdict.comes_near:
        said = "No effect in the library comes near, so no test between two of them would help."
        return Proposal(said, "none", None, None, None, 0.0)
    chosen = verdict.chosen.fit
    model = grid.model(chosen)
    twin = _encoder_twin(grid, chosen, model) or _zero_twin(grid, finding, chosen, model)
    least = verdict.rules.separated_chi_square
    if twin is not None and verdict.status != "unlisted" and twin.expected_separation >= least:
        return twin
    rivals = nearest_rivals(verdict)
    hypotheses = [grid.model(fitted) for fitted in rivals]
    if not hypotheses:
        return _most_uncertain(grid, model)
    separations = np.array([separation(model, hypothesis) for hypothesis in hypotheses])
    separable = np.flatnonzero(separations.max(axis=1) >= least)
    if not len(separable):
        return _no_test(grid, model.label, hypotheses, separations, verdict)
    # One test for all rivals where there is one, or else for the nearest that a test separates.
    together = separations[separable].min(axis=0)
    if together.max() < least:
        separable = separable[:1]
        together = separations[separable[0]]
    test = int(np.argmax(together))
    closest = int(separable[np.argmin(separations[separable, test])])
    labels = model.label, hypotheses[closest].label
    same = any(hypothesis.fit is rivals[closest] for hypothesis in verdict.equivalent)
    # What two models of a class share is not what a test is to tell apart.
    sets = [chosen.candidates, rivals[closest].candidates]
    preferred, competing = labels_apart(sets) if same else labels
    said = _aim(verdict, _in_words(grid, preferred), _in_words(grid, competing), same)
    proposed = _proposal(grid, test, said, labels, float(separations[closest, test]))
    never = [k for k in range(len(hypotheses)) if separations[k].max() < least]
    if not never:
        return proposed
    left_over = _inseparable(grid, model.label, [hypotheses[k] for k in never])
    return replace(proposed, description=f"{proposed.description} {left_over}")


def _in_words(grid: Grid, label: str) -> str:
    """Return the label of a set of effects in words, lines of the static error by their order."""
    return labels_by_order(label, grid.data.campaign.believed.error_orders)


def _inseparable(grid: Grid, label: str, rivals: Sequence[Model]) -> str:
    others = " or from ".join(_in_words(grid, rival.label) for rival in rivals)
    return (
        f"No test within your speed and load range separates {_in_words(grid, label)} from "
        f"{others}."
    )


def _no_test(
    grid: Grid,
    label: str,
    rivals: Sequence[Model],
    separations: NDArray[np.float64],
    verdict: Verdict,
) -> Proposal:
    """Say that all tests leave it to chance which of the models is right."""
    said = _inseparable(grid, label, rivals)
    if verdict.status == "unlisted":
        neither = f"{_in_words(grid, label)} nor {_in_words(grid, rivals[0].label)}"
        said = f"Neither {neither} explains the data. {said}"
    labels = label, rivals[0].label
    return Proposal(said, "none", None, None, labels, float(separations[0].max()))


def nearest_rivals(verdict: Verdict) -> list[Fit]:
    """Return the fits of the nearest other hypotheses, nearest first."""
    if verdict.chosen is None:
        return []
    names = verdict.chosen.names
    others = [
        *verdict.equivalent,
        *sorted(verdict.alternatives, key=lambda hypothesis: hypothesis.bic),
    ]
    rivals: dict[frozenset[tuple[str, str]], Fit] = {}
    for hypothesis in others:
        # Of nested models the larger one can imitate the chosen one in every test.
        if hypothesis in verdict.equivalent or not names <= hypothesis.names:
            rivals.setdefault(hypothesis.names, hypothesis.fit)
    return list(rivals.values())[:_RIVALS]


def _aim(verdict: Verdict, preferred: str, competing: str, same: bool) -> str:
    """Return what a test is for; ``same`` tells whether both models are of one class."""
    if verdict.status == "unlisted":
        return f"Neither {preferred} nor {competing} explains the data. They differ most in"
    if same:
        return f"These data cannot distinguish {preferred} from {competing}. The best test is"
    return f"These data already favour {preferred}. The best further test against {competing} is"


def _proposal(
    grid: Grid, test: int, said: str, labels: tuple[str, str], expected: float
) -> Proposal:
    what, speed, load, kind = grid.condition(test)
    return Proposal(f"{said} {what}.", kind, speed, load, labels, expected)


def _most_uncertain(grid: Grid, model: Model) -> Proposal:
    """Return the running record with the most uncertain prediction of the fit."""
    running = slice(len(grid.speed_rpm))
    variance = np.sum(model.influence[running] ** 2, axis=(1, 2)) * model.steady[running]
    if not variance.any():
        said = "The drive has no steady state in any test within your speed and load range."
        return Proposal(said, "none", None, None, None, 0.0)
    test = int(np.argmax(variance))
    what, speed, load, kind = grid.condition(test)
    text = f"The prediction is least certain for {what}; run this test next."
    return Proposal(text, kind, speed, load, None, float(variance[test]))


def _encoder_twin(grid: Grid, chosen: Fit, model: Model) -> Proposal | None:
    """Return the test that separates a line of whole cycles per output turn from the encoder's."""
    ratio = grid.data.campaign.believed.ratio
    for place, candidate in enumerate(chosen.candidates):
        if candidate.order is None or candidate.effect is None or not candidate.effect.twin:
            continue
        turns = round(candidate.order * ratio)
        if turns > LARGEST_TURNS or abs(candidate.order * ratio - turns) > 1e-6:
            continue
        twin_effect = effect_named(candidate.effect.twin)
        port = twin_effect.sought_at[0]
        name = ENCODER_LINE if port == "sensor" and turns != 1 else twin_effect.name
        twin = f"{name}:{port}@{candidate.order:.4g}"
        parts = chosen.effects_by_candidate
        base = chosen.values[: len(grid.data.base)]
        others = [effect for k, part in enumerate(parts) if k != place for effect in part]
        without = grid.predict(base, others)
        # Half a period reverses the encoder's line and leaves that of the drive unchanged.
        change = 2.0 * (model.predicted - without)[: len(grid.speed_rpm)]
        expected = np.sum(change**2, axis=1) * model.steady[: len(change)]
        test = int(np.argmax(expected))
        _, speed, load, _ = grid.condition(test)
        text = (
            f"{_in_words(grid, candidate.label)} and {_in_words(grid, twin)} predict nearly the "
            "same in every record. Turn the disc of the output encoder by "
            f"{180.0 / turns:.3g} degrees on its shaft and repeat a "
            f"record at {speed:.4g} r/min with {load:.3g} N.m. A line of the encoder turns "
            "with it; one of the drive stays."
        )
        labels = (candidate.label, twin)
        return Proposal(text, "reclocked_encoder", speed, load, labels, float(expected[test]))
    return None


def _zero_twin(grid: Grid, finding: DriveFinding, chosen: Fit, model: Model) -> Proposal | None:
    """Return the test that separates dry friction at the input from a zero error of the sensor.

    In reverse friction changes its sign and a zero error does not. Everything else is mirrored, so
    that the forward record gives the uncertainty of the rest of the mean input torque.
    """
    one_way = len({record.input_speed > 0.0 for record in finding.campaign.train}) == 1
    for candidate, parts in zip(chosen.candidates, chosen.effects_by_candidate, strict=True):
        placed = parts[0].at_port() if parts else None
        if not one_way or placed is None or placed[0] != "input" or not placed[1].constant:
            continue
        level = placed[1].constant
        triangles = grid.data.whiteners
        row = triangles[:, MEANS.index(CHANNELS.index("input_torque"))]
        influence = model.influence[: len(row)]
        known = np.sum(np.einsum("rf,rfp->rp", row, influence) ** 2, axis=1)
        expected = (2.0 * level) ** 2 / (np.sum(row**2, axis=1) + known)
        expected *= model.steady[: len(row)]
        test = int(np.argmax(expected))
        speed, load = float(grid.speed_rpm[test]), float(grid.load_torque[test])
        twin = "zero error of the input torque sensor"
        what = "" if placed[1].breakaway == level else "The level of "
        text = (
            f"{what}{_in_words(grid, candidate.label)} and a {twin} of {level:.2g} N.m predict the "
            "same as long as the input turns one way. Repeat the record at "
            f"{speed:.4g} r/min with {load:.3g} N.m in reverse, or tare the sensor with the motor "
            "uncoupled."
        )
        labels = (candidate.label, twin)
        return Proposal(text, "running", -speed, 0.0 - load, labels, float(expected[test]))
    return None
