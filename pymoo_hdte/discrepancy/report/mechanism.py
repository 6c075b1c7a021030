"""The report on measured records: verdict, revised model and a page, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy.mechanism.analysis import MechanismFinding
from pymoo_hdte.discrepancy.mechanism.models import model_text
from pymoo_hdte.discrepancy.mechanism.next_tests import NextTest
from pymoo_hdte.discrepancy.mechanism.proof import MeasuredGap
from pymoo_hdte.discrepancy.mechanism.revision import MODEL_FILE, revised_mechanism
from pymoo_hdte.discrepancy.report.document import believed_in_words
from pymoo_hdte.discrepancy.report.mechanism_document import mechanism_verdict_document
from pymoo_hdte.discrepancy.report.mechanism_figures import gaps as gaps_figure
from pymoo_hdte.discrepancy.report.mechanism_figures import (
    misfit_over_frequency,
    misfit_over_motion,
    overlay,
)
from pymoo_hdte.discrepancy.report.tables import STATUSES
from pymoo_hdte.discrepancy.report.write import FOLDER
from pymoo_hdte.reports.figures import data_uri
from pymoo_hdte.reports.html import page

_SIZES = 5
"""Parameters on the first screen."""


def write_mechanism_report(
    title: str,
    finding: MechanismFinding,
    gaps: Sequence[MeasuredGap],
    test: NextTest,
    out: str | Path,
) -> dict[str, Any]:
    """Write a report with verdict and revised model; return the verdict's document.

    Parameters
    ----------
    title : str
    finding : MechanismFinding
    gaps : sequence of MeasuredGap
        Of the held-out records.
    test : NextTest
    out : str or Path
        New, empty, or an earlier report, which is replaced.

    Returns
    -------
    dict
        What ``verdict.json`` holds.

    Raises
    ------
    InvalidInput
        If ``out`` holds anything else.
    OSError
        If it cannot be written.
    """
    FOLDER.check(Path(out))
    document = mechanism_verdict_document(title, finding, gaps, test)
    document["revised_model"] = {"file": MODEL_FILE}
    model = model_text(revised_mechanism(title, finding))
    FOLDER.write(Path(out), _page(finding, document, gaps), document, {MODEL_FILE: model})
    return document


def _page(finding: MechanismFinding, document: dict[str, Any], gaps: Sequence[MeasuredGap]) -> str:
    pictures = {
        "motion": data_uri(misfit_over_motion(finding)),
        "frequency": data_uri(misfit_over_frequency(finding)),
        "gaps": data_uri(gaps_figure(gaps)) if gaps else "",
    }
    rows = _effect_rows(document["effects"])
    sizes = [row for row in rows if not row["parameter"].endswith("phase")]
    shown = _shown(gaps)
    pictures["overlay"] = data_uri(overlay(shown)) if shown else ""
    return page(
        "pymoo_hdte.discrepancy.report",
        "mechanism.html.j2",
        document=document,
        status=STATUSES[finding.verdict.status],
        rows=rows,
        sizes=sizes[:_SIZES],
        more=len(sizes) > _SIZES,
        gaps=gaps,
        shown=shown,
        pictures=pictures,
        proof_sentence=proof_sentence(finding, gaps),
        believed_effects=believed_in_words(document),
        believed={name: one.value for name, one in finding.mechanism.quantities.items()},
    )


def _shown(gaps: Sequence[MeasuredGap]) -> MeasuredGap | None:
    """Return the gap to be drawn over time: of a simulation that did not diverge, if any."""
    drawn = [gap for gap in gaps if np.isfinite(gap.before) and np.isfinite(gap.after)]
    return max(drawn, key=lambda gap: (gap.kind == "simulation", gap.before), default=None)


def proof_sentence(finding: MechanismFinding, gaps: Sequence[MeasuredGap]) -> str:
    """Return in words the effect of the correction on records that were not fitted."""
    if not gaps:
        return "No record was held out, so that nothing can be proved."
    if not finding.accepted.candidates:
        words = [f"{gap.quantity} by {gap.kind}: {gap.after:.3g}" for gap in gaps]
        return f"Nothing was added; the model is off by {', '.join(words)} (SI)."
    words = []
    for kind in ("simulation", "balance"):
        for quantity in dict.fromkeys(gap.quantity for gap in gaps if gap.kind == kind):
            of_it = [gap for gap in gaps if (gap.kind, gap.quantity) == (kind, quantity)]
            before, after = (
                float(np.sqrt(np.mean([getattr(gap, one) ** 2 for gap in of_it])))
                for one in ("before", "after")
            )
            change = _change(before, after)
            words.append(f"{quantity} by {kind} {change} from {before:.3g} to {after:.3g}")
    return f"Root mean square errors (SI), before and after: {'; '.join(words)}."


def _change(before: float, after: float) -> str:
    if not np.isfinite(before + after):
        return "diverges for one of the models,"
    return "falls" if after < before else "does not fall,"


def _effect_rows(effects: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    return [
        {
            "effect": f"{one['name'].replace('_', ' ')} ({one['port']})",
            "parameter": name.replace("_", " "),
            "value": parameter["value"],
            "lower": parameter["interval95"][0],
            "upper": parameter["interval95"][1],
            "at_bound": parameter["at_bound"],
        }
        for one in effects
        for name, parameter in one["parameters"].items()
    ]
