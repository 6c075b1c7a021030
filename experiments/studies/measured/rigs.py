"""Shared parts of the studies of published measurements: data, verdict and tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.runner.committed import DATA
from experiments.runner.result import Column, Picture, Result, Table
from pymoo_hdte._reports.html import percent
from pymoo_hdte.discrepancy._answers.next_test_mechanism import next_test
from pymoo_hdte.discrepancy._evidence.force_balances.joint_halves import joint_of, rigid_half
from pymoo_hdte.discrepancy._records.rig_files import MeasuredMechanism, read_rig
from pymoo_hdte.discrepancy._report.mechanism import extent_sentence, validation_sentence
from pymoo_hdte.discrepancy._report.mechanism_document import limits, offered, unexplained
from pymoo_hdte.discrepancy._report.mechanism_figures import misfit_over_motion, overlay
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities
from pymoo_hdte.discrepancy._report.tables import STATUSES
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, examine_joint
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import (
    MechanismPredictionError,
    validate_mechanism,
)
from pymoo_hdte.effects.sentence_blanks import in_words

MEASURED = Path(__file__).resolve().parents[4] / "shared" / "measured"
"""Folder of the measurements, which are not part of the project."""
RIGS = DATA
_BANDS = 12


@dataclass(frozen=True, eq=False)
class Study:
    """A rig, what the workflow finds in its records, and the validation.

    Of a joint with two encoders the rig, the finding and the validation are those of its torques;
    ``joint`` has the torsion as well.
    """

    rig: MeasuredMechanism
    finding: MechanismFinding
    errors: tuple[MechanismPredictionError, ...]
    joint: JointFinding | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that the verdict names, in its order."""
        return tuple(candidate.name for candidate in self.finding.accepted.candidates)

    @property
    def status(self) -> str:
        """Of the verdict; of a joint, of both verdicts."""
        return self.joint.status if self.joint else self.finding.verdict.status


def study(name: str, folder: str) -> Study | None:
    """Return the study of ``data/<name>.toml`` on records in a folder of `MEASURED`, if there."""
    if not (MEASURED / folder).is_dir():
        return None
    rig = read_rig(RIGS / f"{name}.toml", MEASURED / folder)
    believed = rig.records, rig.cutoff, rig.effects
    joint = joint_of(rig.mechanism)
    if joint is None:
        finding = examine_mechanism(rig.mechanism, *believed)
        return Study(rig, finding, validate_mechanism(finding))
    both = examine_joint(joint, *believed)
    return Study(torques_of(rig), both.torque, validate_mechanism(both.torque), both)


def torques_of(rig: MeasuredMechanism) -> MeasuredMechanism:
    """Return a joint with two encoders as a rigid body, and any other rig as it is."""
    joint = joint_of(rig.mechanism)
    if joint is None:
        return rig
    half = rigid_half(joint, rig.records, rig.effects)
    return replace(rig, mechanism=half.mechanism, records=half.records, effects=half.known)


def absent(title: str, folder: str, command: str, source: str) -> Result:
    """Return a result that says which measurements are missing, and where they come from."""
    return Result(
        title=title,
        command=command,
        answer="Skipped, because the measurements, which are not part of this software, are "
        "missing.",
        paragraphs=(
            f"They are published: {source}. Put the files into {MEASURED / folder} and run the "
            "command again.",
        ),
    )


def verdict_paragraphs(one: Study) -> tuple[str, ...]:
    """Return the verdict in words: what is missing, what is left, what cannot be said."""
    named = " Then: ".join(c.sentence for c in one.finding.accepted.candidates)
    second = " ".join(
        f"Beside it {other['name'].replace('_', ' ')} would take {percent(other['removes'])} of "
        "what is left."
        for other in offered(one.finding)
    )
    return (
        f"Verdict: {STATUSES[one.finding.verdict.status]}. {named}",
        f"{unexplained(one.finding)['sentence']} {second}".strip(),
        *limits(one.finding),
        validation_sentence(one.finding, one.errors),
        f"Next test: {next_test(one.finding).description}",
    )


def fitted_values(one: Study) -> dict[str, Any]:
    """Return values with intervals by parameter, those of effects with the effect's name."""
    found = dict(quantities(one.finding))
    for effect in effects(one.finding):
        for name, value in effect["parameters"].items():
            found[f"{effect['name'].replace('_', ' ')}: {name.replace('_', ' ')}"] = value
    return found


def values_table(one: Study, known: Mapping[str, float], heading: str, source: str) -> Table:
    """Return the fitted values with their intervals beside values that are known otherwise.

    Parameters
    ----------
    one : Study
    known : mapping of str to float
        The other values by parameter.
    heading : str
        What the other values are, over their column.
    source : str
        Where they come from.
    """
    rows = []
    for name, value in fitted_values(one).items():
        lower, upper = value["interval95"]
        other = known.get(name)
        off = None if other is None else 100.0 * (value["value"] / other - 1.0)
        covers = "" if other is None else "yes" if lower <= other <= upper else "no"
        rows.append((name, value["value"], lower, upper, other, off, covers))
    return Table(
        "values",
        "Parameters of the revised model",
        (
            Column("parameter"),
            Column("ours", "SI", 4),
            Column("lower", "SI", 4, "95 % interval"),
            Column("upper", "SI", 4, "95 % interval"),
            Column(heading, "SI", 5),
            Column("difference", "%", 2),
            Column("interval covers"),
        ),
        tuple(rows),
        note=f"{heading.capitalize()}: {source}",
    )


def errors_table(one: Study) -> Table:
    """Return the errors on held-out records."""
    return Table(
        "held_out",
        "Root mean square errors on held-out records",
        (
            Column("record"),
            Column("quantity"),
            Column("by"),
            Column("before", "SI", 3),
            Column("after", "SI", 3),
            Column("sensors", "SI", 2),
            Column("R2 before", digits=5),
            Column("R2 after", digits=5),
        ),
        tuple(
            (
                *(
                    error.record,
                    error.quantity,
                    error.kind,
                    error.before,
                    error.after,
                    error.noise_floor,
                ),
                *(error.determination or (None, None)),
            )
            for error in one.errors
        ),
        note="Before: the fitted model without the effects. A simulation has the measured inputs. "
        f"{extent_sentence(one.errors)}",
    )


def evidence_table(one: Study) -> Table:
    """Return the explanations that were tried, the best first."""
    verdict = one.finding.verdict
    hypotheses = [verdict.chosen, *verdict.alternatives]
    found = [hypothesis for hypothesis in hypotheses if hypothesis is not None]
    return Table(
        "evidence",
        "Explanations that were tried",
        (Column("effects"), Column("share of the misfit removed", "%", 4), Column("BIC", "", 5)),
        tuple(
            (in_words(hypothesis.label), 100.0 * hypothesis.explained, hypothesis.bic)
            for hypothesis in found
        ),
        folded=True,
    )


def pictures(one: Study) -> tuple[Picture, ...]:
    """Return what is left over the motion, and the held-out record that was missed most."""
    drawn = [
        error for error in one.errors if error.kind == "simulation" and np.isfinite(error.after)
    ]
    found = [
        Picture(
            "misfit",
            "What the model leaves of each balance over speed and position: dots before, crosses "
            "after the correction.",
            misfit_over_motion(one.finding),
        )
    ]
    if drawn:
        worst = max(drawn, key=lambda error: error.before)
        caption = f"Held-out record {worst.record}, simulated."
        found.append(Picture("overlay", caption, overlay(one.finding, worst)))
    return tuple(found)


def coloured_rest(one: Study, generator: np.random.Generator) -> list[NDArray[np.float64]]:
    """Return, by record, a disturbance of the colour of what the study's model leaves.

    Shape (n_balances, n) at the records' rate of samples: Gaussian, with the power of the real rest
    in bands of frequency, so that nothing of its course or of its lines is left.
    """
    found = []
    coefficients = one.finding.data.coefficients(one.finding.accepted.residuals)
    for left, balance in zip(coefficients, one.finding.data.spectra, strict=True):
        edges = np.unique(np.geomspace(1, left.shape[1], _BANDS).astype(int))
        sizes = np.zeros(left.shape)
        for low, high in zip([0, *edges[:-1]], edges, strict=True):
            sizes[:, low:high] = np.sqrt(np.mean(left[:, low:high] ** 2, axis=1, keepdims=True))
        drawn = sizes * generator.standard_normal(left.shape)
        rows = [np.interp(balance.record.time, balance.time, balance.in_time(row)) for row in drawn]
        found.append(np.array(rows))
    return found
