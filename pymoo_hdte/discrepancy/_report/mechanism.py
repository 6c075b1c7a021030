"""The report on measured records: verdict, revised model and a page, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte._reports.figures import data_uri
from pymoo_hdte._reports.html import number, page, percent
from pymoo_hdte.discrepancy._answers.descriptive_model import (
    DESCRIPTIVE_FILE,
    BalanceErrors,
    DescriptiveModel,
)
from pymoo_hdte.discrepancy._answers.next_test_mechanism import NextTest
from pymoo_hdte.discrepancy._answers.revision_mechanism import MODEL_FILE, revised_mechanism
from pymoo_hdte.discrepancy._records.rig_model import model_text
from pymoo_hdte.discrepancy._report.certainty import how_sure_of_records
from pymoo_hdte.discrepancy._report.document import believed_in_words
from pymoo_hdte.discrepancy._report.folder import FOLDER
from pymoo_hdte.discrepancy._report.mechanism_document import evidence, mechanism_verdict_document
from pymoo_hdte.discrepancy._report.mechanism_figures import (
    errors_figure,
    misfit_over_frequency,
    misfit_over_motion,
    overlay,
)
from pymoo_hdte.discrepancy._report.plots import Plot, plot_files
from pymoo_hdte.discrepancy._report.plots_mechanism import mechanism_plots
from pymoo_hdte.discrepancy._report.tables import (
    compared_rows,
    effect_rows,
    mechanism_parameter_rows,
)
from pymoo_hdte.discrepancy._report.torsion import torsion_document, torsion_picture
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding, revised_joint
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import MechanismPredictionError

_SIZES = 5
"""Parameters on the first screen."""


def write_mechanism_report(
    title: str,
    finding: MechanismFinding,
    errors: Sequence[MechanismPredictionError],
    test: NextTest,
    out: str | Path,
    joint: JointFinding | None = None,
    descriptive: DescriptiveModel | None = None,
) -> dict[str, Any]:
    """Write a report with verdict and revised model; return the verdict's document.

    Parameters
    ----------
    title : str
    finding : MechanismFinding
    errors : sequence of MechanismPredictionError
        Of the held-out records.
    test : NextTest
    out : str or Path
        New, empty, or an earlier report, which is replaced.
    joint : JointFinding, optional
        Of a joint with two encoders, ``finding`` being on its torques.
    descriptive : DescriptiveModel, optional
        Model with all terms that predict better, which becomes a section and a file.

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
    document = mechanism_verdict_document(title, finding, errors, test)
    document["revised_model"] = {"file": MODEL_FILE}
    document["gap_sentence"] = validation_sentence(finding, errors)
    revised = revised_mechanism(title, finding)
    if joint is not None:
        revised = revised_joint(title, joint)
        torsion = torsion_document(joint)
        words = f"Torques: {document['sentence']} Torsion: {torsion['sentence']}"
        document |= {"status": joint.status, "sentence": words, "torsion": torsion}
        document["location"]["sentence"] += f" {torsion['location']}"
    plots = mechanism_plots(finding, joint)
    document["plots"] = [plot.as_dict() for plot in plots]
    files = {MODEL_FILE: model_text(revised), **plot_files(plots)}
    if descriptive is not None:
        files[DESCRIPTIVE_FILE] = model_text(descriptive.model)
        sentence = descriptive_sentence(descriptive)
        document["descriptive_model"] = {
            "file": DESCRIPTIVE_FILE,
            "sentence": sentence,
            **descriptive.as_dict(),
        }
    page_text = _page(finding, document, errors, joint, plots)
    FOLDER.write(Path(out), page_text, document, files)
    return document


def _page(
    finding: MechanismFinding,
    document: dict[str, Any],
    errors: Sequence[MechanismPredictionError],
    joint: JointFinding | None,
    plots: Sequence[Plot],
) -> str:
    pictures = {
        "torsion": data_uri(torsion_picture(joint)) if joint else "",
        "motion": data_uri(misfit_over_motion(finding)),
        "frequency": data_uri(misfit_over_frequency(finding)),
        "errors": data_uri(errors_figure(errors)) if errors else "",
    }
    rows = effect_rows(document["effects"])
    sizes = [row for row in rows if row.is_headline]
    nominal = {name: value.value for name, value in finding.mechanism.quantities.items()}
    shown = _shown(errors)
    pictures["overlay"] = data_uri(overlay(finding, shown)) if shown else ""
    chosen, torsion = finding.verdict.chosen, document.get("torsion")
    compared = [evidence(finding, chosen)] if chosen else []
    return page(
        "pymoo_hdte.discrepancy._report",
        "mechanism.html.j2",
        document=document,
        torsion=torsion,
        torsion_parameters=mechanism_parameter_rows(torsion["base"], {}) if torsion else [],
        torsion_compared=compared_rows(torsion["alternatives"]) if torsion else [],
        torsion_rows=effect_rows(document["torsion"]["effects"]) if joint else [],
        rows=rows,
        sizes=sizes[:_SIZES],
        more=len(sizes) > _SIZES,
        descriptive=document.get("descriptive_model"),
        errors=errors,
        shown=shown,
        pictures=pictures,
        plots=plots,
        certainty=how_sure_of_records(finding.verdict),
        compared=compared_rows([*compared, *document["alternatives"]]),
        extent_sentence=extent_sentence(errors),
        believed_effects=believed_in_words(document),
        parameters=mechanism_parameter_rows(document["base"], nominal),
    )


def _shown(errors: Sequence[MechanismPredictionError]) -> MechanismPredictionError | None:
    """Return the error to be drawn over time: of a simulation that did not diverge, if any."""
    drawn = [error for error in errors if np.isfinite(error.before) and np.isfinite(error.after)]
    return max(drawn, key=lambda error: (error.kind == "simulation", error.before), default=None)


def validation_sentence(
    finding: MechanismFinding, errors: Sequence[MechanismPredictionError]
) -> str:
    """Return in words the effect of the correction on records that were not fitted."""
    if not errors:
        return "No record was held out, so the correction is not validated."
    if not finding.accepted.candidates:
        words = [
            f"{error.quantity} by {error.kind}: {error.after:.3g} {error.unit}" for error in errors
        ]
        return f"Nothing was added. Errors: {', '.join(words)}. {extent_sentence(errors)}"
    words = []
    for kind in ("simulation", "balance"):
        for quantity in dict.fromkeys(error.quantity for error in errors if error.kind == kind):
            of_it = [error for error in errors if (error.kind, error.quantity) == (kind, quantity)]
            before, after = (
                float(np.sqrt(np.mean([getattr(error, side) ** 2 for error in of_it])))
                for side in ("before", "after")
            )
            change, unit = _change(before, after), of_it[0].unit
            words.append(
                f"{quantity} by {kind} {change} from {number(before)} to {number(after)} {unit}"
            )
    return f"Root mean square errors: {'; '.join(words)}. {extent_sentence(errors)}"


def descriptive_sentence(model: DescriptiveModel) -> str:
    """Return in words what a descriptive model holds, and how it predicts what was held out."""
    effects = dict.fromkeys(
        f"{effect.name.replace('_', ' ')} ({effect.port})" for effect, _ in model.effects
    )
    holds = f"Its effects: {', '.join(effects)}." if effects else "It has no effects."
    words = [
        f"This model is made for prediction: it holds the terms that predict better. {holds}"
        " Only the verdict says whether a term is a cause."
    ]
    by_quantity: dict[str, list[BalanceErrors]] = {}
    for errors in model.held_out or model.cross_validated:
        by_quantity.setdefault(errors.quantity, []).append(errors)
    where = "held-out records" if model.held_out else "records, each part predicted from the others"
    for quantity, several in by_quantity.items():
        base, accepted, ours, six = (
            float(np.sqrt(np.mean([getattr(one, name) ** 2 for one in several])))
            for name in ("base", "accepted", "descriptive", "six_terms")
        )
        words.append(
            f"Root mean square residual of the force balance of {quantity} in the {where}: "
            f"{number(ours)} {several[0].unit} with this model, {number(six)} with least squares "
            f"of six terms, {number(base)} with the nominal model and {number(accepted)} with the "
            "revised one."
        )
        if ours > accepted:
            words.append("There the revised model predicts better.")
    return " ".join(words)


def extent_sentence(errors: Sequence[MechanismPredictionError]) -> str:
    """Return in words how much of the held-out records was simulated."""
    of_records = {error.record: error.extent for error in errors if error.extent is not None}
    words = [
        f"{extent.windows} of {extent.room} windows of {extent.length:.3g} s in {record}"
        for record, extent in of_records.items()
    ]
    return f"Simulated, each window from its measured state: {', '.join(words)}."


def _change(before: float, after: float) -> str:
    if not np.isfinite(before + after):
        return "diverges for one of the models,"
    return f"falls by {percent(1.0 - after / before)}" if after < before else "does not fall,"
