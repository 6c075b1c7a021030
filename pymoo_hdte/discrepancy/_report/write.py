"""The report on a campaign: verdict, revised model and a self-contained page, all or nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pymoo_hdte._reports.figures import data_uri
from pymoo_hdte._reports.html import number, page, percent
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.next_test_drive import Proposal
from pymoo_hdte.discrepancy._answers.revision_drive import (
    MODEL_FILE,
    SHEET_FILE,
    drive_model,
    revised_model,
)
from pymoo_hdte.discrepancy._answers.where.coverage import campaign_limits
from pymoo_hdte.discrepancy._answers.where.map import Location
from pymoo_hdte.discrepancy._records.sensor_hints import sensor_hints
from pymoo_hdte.discrepancy._report.certainty import how_sure
from pymoo_hdte.discrepancy._report.document import believed_in_words, verdict_document
from pymoo_hdte.discrepancy._report.figures import (
    error_by_channel,
    error_by_order,
    misfit_map,
    misfit_overview,
    optimum_fronts,
    overlay,
)
from pymoo_hdte.discrepancy._report.folder import FOLDER
from pymoo_hdte.discrepancy._report.optimum import OptimumShift
from pymoo_hdte.discrepancy._report.plots import Plot, plot_files
from pymoo_hdte.discrepancy._report.plots_drive import drive_plots
from pymoo_hdte.discrepancy._report.tables import (
    effect_rows,
    fault_rows,
    hypothesis_rows,
    metric_rows,
    noise_rows,
    parameter_rows,
    record_rows,
    rows_sentence,
)
from pymoo_hdte.discrepancy._report.words import bench_in_words, limit_sentence
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.discrepancy._verdicts.validation_drive import Validation
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml

OptimumOf = Callable[[DriveModel, DriveModel], OptimumShift]
"""Function that returns how the robust optimum moves from one drive model to another."""


def write_report(
    finding: DriveFinding,
    location: Location,
    validation: Validation | None,
    proposal: Proposal,
    optimum_shift: OptimumOf,
    out: str | Path,
) -> dict[str, Any]:
    """Write a report with verdict and revised model; return the verdict's document.

    Parameters
    ----------
    finding : DriveFinding
    location : Location
    validation : Validation or None
        None where no record was held out.
    proposal : Proposal
    optimum_shift : callable
        Of the fitted base and the revised model; called only where an effect was added. That of
        `pymoo_hdte.discrepancy._robust_optimum` optimises both.
    out : str or Path
        New, empty, or an earlier report, which is replaced. If a data sheet cannot describe the
        drive, there is no revised model: its two files are missing and the verdict states the
        reason.

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
    document = verdict_document(
        finding, location, None if validation is None else validation.as_dict(), proposal
    )
    limits = campaign_limits(finding)
    document["limits"] = [limit_sentence(limit) for limit in limits]
    document["limit_codes"] = [limit.as_dict() for limit in limits]
    model_files, model, shift = _revision(finding, optimum_shift)
    document["revised_model"] = {"file": MODEL_FILE if model_files else None}
    document["robust_optimum"] = _shift_document(shift)
    document["gap_sentence"] = validation_sentence(finding, validation)
    if hints := sensor_hints(finding.campaign):
        document["sensor_hints"] = hints
    plots = drive_plots(finding, model, document)
    document["plots"] = [plot.as_dict() for plot in plots]
    html = _page(finding, location, validation, document, shift, plots)
    FOLDER.write(Path(out), html, document, {**model_files, **plot_files(plots)})
    return document


def _revision(
    finding: DriveFinding, optimum_shift: OptimumOf
) -> tuple[dict[str, str], DriveModel | None, OptimumShift]:
    """Return the files of the revised model, that model, and its effect on the robust optimum."""
    try:
        model = revised_model(finding)
        before = drive_model(finding.campaign, finding.verdict.base, "before", "the fitted base")
    except InvalidInput as error:
        return {}, None, OptimumShift((), f"The revised drive is no drive model: {error}.")
    how_to_read = f'# Read it with load_model("{MODEL_FILE}", load_datasheet("{SHEET_FILE}")).\n'
    files = {MODEL_FILE: how_to_read + model_toml(model), SHEET_FILE: sheet_toml(model.sheet)}
    if not finding.verdict.accepted.candidates:
        stays = "No effect was added, so the optimum stays where it was."
        return files, model, OptimumShift((), stays)
    return files, model, optimum_shift(before, model)


def _shift_document(shift: OptimumShift) -> dict[str, Any]:
    names = ("promised", "delivered", "reached")
    return {
        "sentence": shift.sentence,
        "obstacle": shift.obstacle,
        "choices": [
            {
                "preference": choice.preference,
                "distance": choice.distance,
                "factors_before": choice.before.tolist(),
                "factors_after": choice.after.tolist(),
            }
            | {f"{name}_mean_std_arcsec": getattr(choice, name).tolist() for name in names}
            for choice in shift.choices
        ],
    }


def _page(
    finding: DriveFinding,
    location: Location,
    validation: Validation | None,
    document: dict[str, Any],
    shift: OptimumShift,
    plots: Sequence[Plot],
) -> str:
    orders = finding.campaign.believed.error_orders
    pictures = {
        "overview": data_uri(misfit_overview(location)),
        "map": data_uri(misfit_map(location)),
    }
    if validation is not None:
        pictures |= {
            "channels": data_uri(error_by_channel(validation)),
            "orders": data_uri(error_by_order(validation)),
            "overlay": data_uri(overlay(validation)),
        }
    if shift.choices:
        pictures["optimum"] = data_uri(optimum_fronts(shift))
    return page(
        "pymoo_hdte.discrepancy._report",
        "report.html.j2",
        campaign=finding.campaign,
        verdict=finding.verdict,
        document=document,
        location=location,
        validation=validation,
        effects=effect_rows(document["effects"], orders),
        certainty=how_sure(finding),
        bench=bench_in_words(document["nuisances"]),
        next_test=document["next_experiment"]["description"],
        pictures=pictures,
        plots=plots,
        hypotheses=hypothesis_rows(finding.verdict, orders),
        parameters=parameter_rows(finding),
        metrics=metric_rows(validation),
        records=record_rows(finding.campaign, validation),
        rows_found=" ".join(
            [rows_sentence(finding.rows), *document.get("sensor_hints", [])]
        ).strip(),
        faults=fault_rows(finding.rows),
        all_faults=len(finding.rows.faults),
        noise=noise_rows(finding.rows),
        shift=shift,
        believed_effects=believed_in_words(document),
    )


_SHOWN = 3
"""Most records that a sentence names."""


def validation_sentence(finding: DriveFinding, validation: Validation | None) -> str:
    """Return how much the prediction error on held-out records shrank, in words."""
    if validation is None:
        return "No record was held out, so the correction is not validated."
    leading = validation.channels[validation.leading]
    plural = "s" if len(validation.records) > 1 else ""
    records = f"{len(validation.records)} held-out record{plural}"
    where = f"{records}, {validation.leading.replace('_', ' ')}"
    noise = f"(noise alone: {number(leading.noise_floor)})"
    if not finding.verdict.accepted.candidates:
        size = f"{number(leading.before)} {leading.unit} {noise}"
        return f"Nothing was added. On {where}: prediction error {size}."
    words = f"On {where}: prediction error {number(leading.before)} {leading.unit} before, "
    words += f"{number(leading.after)} after {noise}"
    if leading.shrinkage is not None:
        words += f"; the correction removes {percent(min(leading.shrinkage, 1.0))} of the excess"
    error = validation.channels["transmission_error"]
    if error is not leading:
        words += (
            f". Transmission error: {number(error.before)} {error.unit} before, "
            f"{number(error.after)} after (noise alone: {number(error.noise_floor)})"
        )
    return f"{words}.{_worse(validation)}"


def _worse(validation: Validation) -> str:
    """Return what the correction made worse, with its numbers; nothing where nothing is worse."""
    errors = {name.replace("_", " "): error for name, error in validation.channels.items()}
    errors["all channels together"] = validation.overall
    parts = [
        f"{name} {number(error.before)} before, {number(error.after)} after, in {error.unit}"
        for name, error in errors.items()
        if error.worse
    ]
    records = [
        name
        for name, error in zip(validation.records, validation.by_record, strict=True)
        if error.worse
    ]
    if len(records) > _SHOWN:
        parts.append(f"transmission error of {len(records)} of {len(validation.records)} records")
    elif records:
        parts.append(f"transmission error of {', '.join(records)}")
    return f" Worse than before: {'; '.join(parts)}." if parts else ""
