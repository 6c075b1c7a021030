"""The report on a machine of any kind: verdict, revised model and a page, all or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pymoo_hdte._reports.html import number, page, percent
from pymoo_hdte.discrepancy._answers.next_test_own_machine import Repetition
from pymoo_hdte.discrepancy._answers.revision_own_machine import MODEL_FILE, revised_values
from pymoo_hdte.discrepancy._answers.where.parts import PartLocation
from pymoo_hdte.discrepancy._report.certainty import how_sure_of_records
from pymoo_hdte.discrepancy._report.document import (
    SCHEMA_VERSION,
    alternatives_of,
    base_parameters,
    believed_in_words,
    effects_of,
    sentence,
    versions,
    with_believed_effects,
)
from pymoo_hdte.discrepancy._report.folder import FOLDER
from pymoo_hdte.discrepancy._report.tables import (
    effect_rows,
    hypothesis_rows,
    mechanism_parameter_rows,
)
from pymoo_hdte.discrepancy._report.words import caveats
from pymoo_hdte.discrepancy._verdicts.own_machine import HeldOutErrors, MachineFinding
from pymoo_hdte.mechanism.effects import table_of


def write_machine_report(
    finding: MachineFinding,
    location: PartLocation,
    errors: HeldOutErrors | None,
    test: Repetition,
    out: str | Path,
) -> dict[str, Any]:
    """Write a report with verdict and revised model; return the verdict's document.

    Parameters
    ----------
    finding : MachineFinding
    location : PartLocation
    errors : HeldOutErrors or None
        None where no record was held out.
    test : Repetition
    out : str or Path
        New, empty, or an earlier report, which is replaced.

    Raises
    ------
    InvalidInput
        If ``out`` holds anything else.
    OSError
        If it cannot be written.
    """
    FOLDER.check(Path(out))
    verdict, unit_of = finding.verdict, lambda name: finding.data.model.units.get(name, "1")
    document: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "campaign": finding.title,
        "status": verdict.status,
        "sentence": sentence(finding.verdict, nominal="nominal model"),
        "probability": verdict.probability,
        "doubts": caveats(verdict),
        "reasons": [reason.as_dict() for reason in verdict.reasons],
        "effects": effects_of(verdict, unit_of),
        "alternatives": alternatives_of(verdict),
        "base": {
            "chi_square": verdict.base.chi_square,
            "degrees_of_freedom": verdict.degrees_of_freedom,
            "parameters": base_parameters(verdict.accepted, verdict.rules, unit_of),
        },
        **with_believed_effects([table_of(effect) for effect in finding.data.model.known]),
        "location": location.summary(),
        "held_out": {"reason": "no record was held out"} if errors is None else errors.as_dict(),
        "gap_sentence": error_sentence(finding, errors),
        "next_experiment": test.as_dict(),
        "revised_model": {"file": MODEL_FILE},
        "versions": versions(),
    }
    nominal = {parameter.name: parameter.start for parameter in finding.data.base}
    html = page(
        "pymoo_hdte.discrepancy._report",
        "own_machine.html.j2",
        document=document,
        rows=effect_rows(document["effects"], ()),
        hypotheses=hypothesis_rows(verdict, ()),
        parameters=mechanism_parameter_rows(document["base"]["parameters"], nominal),
        errors=errors,
        certainty=how_sure_of_records(verdict),
        known=believed_in_words(document),
    )
    FOLDER.write(Path(out), html, document, {MODEL_FILE: revised_values(finding).to_toml()})
    return document


def error_sentence(finding: MachineFinding, errors: HeldOutErrors | None) -> str:
    """Return in words how the error of prediction on held-out records changed."""
    if errors is None:
        return "No record was held out, so the correction is not validated."
    error = errors.overall
    before, after = f"{number(error.before)} times the noise", number(error.after)
    if not finding.verdict.accepted.candidates:
        return f"Nothing was added. Prediction error on held-out records: {before}."
    words = f"Prediction error on held-out records: {before} before, {after} after."
    if error.shrinkage is not None:
        words += f" The correction removes {percent(min(error.shrinkage, 1.0))} of the excess."
    if errors.worse:
        words += f" Worse than before: {', '.join(errors.worse)}."
    return words
