"""The next test of a machine of any kind: the record whose repetition separates hypotheses best.

Of two fitted hypotheses the difference of their predictions counts that the unknowns of the base
cannot imitate: see `separation`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy._answers.separation import unimitated
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.own_machine import MachineFinding
from pymoo_hdte.effects.sentence_blanks import in_words


@dataclass(frozen=True)
class Repetition:
    """The record to repeat, and its purpose.

    Attributes
    ----------
    record : str
    separates : tuple of str
        Labels of the two hypotheses that it separates; empty where none competes.
    separation : float
        Expected chi-square between them.
    description : str
    """

    record: str
    separates: tuple[str, ...]
    separation: float
    description: str

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self) | {"separates": list(self.separates)}


def next_repetition(finding: MachineFinding) -> Repetition:
    """Return the record to repeat next."""
    data, verdict = finding.data, finding.verdict
    chosen, competing = verdict.chosen, _nearest(finding)
    record_of, _ = data.layout
    if chosen is None or competing is None:
        misfit = verdict.accepted.residuals[: len(record_of)] ** 2
        most = int(np.argmax(np.bincount(record_of, misfit)))
        name = finding.names[most]
        text = f"Repeat {name} over a wider range: the residual is largest there."
        return Repetition(name, (), 0.0, text)
    difference = chosen.fit.residuals - competing.fit.residuals
    base = chosen.fit.jacobian[:, : len(data.base)]
    separations = []
    for place in range(len(finding.names)):
        rows = np.flatnonzero(record_of == place)
        columns = np.column_stack([difference[rows], base[rows]])
        # What is known of the base beforehand is the width of its bounds.
        gram = columns.T @ columns + np.diag([0.0, *np.ones(base.shape[1])])
        separations.append(float(unimitated(gram, 1)[0, 0]))
    best = int(np.argmax(separations))
    name, separation = finding.names[best], separations[best]
    models = f"{in_words(chosen.label)} from {in_words(competing.label)}"
    text = f"Repeat {name}: it best separates {models} (expected chi-square {separation:.3g})."
    if separation < verdict.rules.separated_chi_square:
        text = f"No repetition of these records separates {models}; that takes another test."
    return Repetition(name, (chosen.label, competing.label), separation, text)


def _nearest(finding: MachineFinding) -> Hypothesis | None:
    """Return the hypothesis that competes most closely with the chosen one, if any does."""
    verdict = finding.verdict
    competing = verdict.equivalent
    if verdict.status == "unlisted":
        competing = verdict.alternatives
    return min(competing, key=lambda hypothesis: hypothesis.bic, default=None)
