"""The report on a campaign: verdict, revised model and a self-contained page, all or nothing."""

from __future__ import annotations

import errno
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy.effect_words import in_words
from pymoo_hdte.discrepancy.limits import limits
from pymoo_hdte.discrepancy.misfit_map import Location
from pymoo_hdte.discrepancy.next_experiment import Proposal
from pymoo_hdte.discrepancy.optimum import SURROGATE_ORDER, OptimumShift, optimum_shift
from pymoo_hdte.discrepancy.prove import Proof
from pymoo_hdte.discrepancy.report_figures import (
    data_uri,
    gap_by_channel,
    gap_by_order,
    misfit_map,
    misfit_overview,
    optimum_fronts,
    overlay,
)
from pymoo_hdte.discrepancy.report_tables import (
    STATUSES,
    certainty,
    effect_rows,
    gap_sentence,
    metric_rows,
    parameter_rows,
    record_rows,
    rival_rows,
)
from pymoo_hdte.discrepancy.revise import (
    MODEL_FILE,
    SHEET_FILE,
    accepted_fit,
    drive_model,
    model_toml,
    revised_model,
    sheet_toml,
)
from pymoo_hdte.discrepancy.verdict_file import verdict_document
from pymoo_hdte.discrepancy.workflow import Analysis

VERDICT_FILE = "verdict.json"
PAGE_FILE = "report.html"
FILES = (VERDICT_FILE, PAGE_FILE, MODEL_FILE, SHEET_FILE)


def write_report(
    analysis: Analysis,
    location: Location,
    proof: Proof | None,
    proposal: Proposal,
    out: str | Path,
) -> Path:
    """Write a folder with `FILES`: all of them or, after an error, none; return its path.

    Parameters
    ----------
    analysis : Analysis
    location : Location
    proof : Proof or None
        None where no record was held out.
    proposal : Proposal
    out : str or Path
        New, empty, or an earlier report, which is replaced. Without a revised model, for a drive
        that a data sheet cannot hold, its two files are missing and the verdict says why.

    Raises
    ------
    InvalidInput
        If ``out`` holds anything else.
    OSError
        If it cannot be written.
    """
    out = Path(out)
    check_folder(out)
    document = verdict_document(
        analysis, location, None if proof is None else proof.as_dict(), proposal
    )
    document["limits"] = limits(analysis)
    model_files, shift = _revision(analysis)
    document["revised_model"] = {"file": MODEL_FILE if model_files else None}
    document["robust_optimum"] = _shift_document(shift)
    page = _page(analysis, location, proof, document, shift)
    verdict = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    _write_folder(out, {VERDICT_FILE: verdict, PAGE_FILE: page, **model_files})
    return out


def _revision(analysis: Analysis) -> tuple[dict[str, str], OptimumShift]:
    """Return the files of the revised model, and what it does to the robust optimum."""
    try:
        model = revised_model(analysis)
        before = drive_model(analysis.campaign, analysis.verdict.base, "before", "the fitted base")
    except InvalidInput as error:
        return {}, OptimumShift((), f"The revised drive is no drive model: {error}.")
    files = {MODEL_FILE: model_toml(model), SHEET_FILE: sheet_toml(model.sheet)}
    if not accepted_fit(analysis.verdict).candidates:
        return files, OptimumShift((), "No effect was added, so the optimum stays where it was.")
    return files, optimum_shift(before, model)


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
    analysis: Analysis,
    location: Location,
    proof: Proof | None,
    document: dict[str, Any],
    shift: OptimumShift,
) -> str:
    environment = Environment(
        loader=PackageLoader("pymoo_hdte.discrepancy", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    pictures = {
        "overview": data_uri(misfit_overview(location)),
        "map": data_uri(misfit_map(location)),
    }
    if proof is not None:
        pictures |= {
            "channels": data_uri(gap_by_channel(proof)),
            "orders": data_uri(gap_by_order(proof)),
            "overlay": data_uri(overlay(proof)),
        }
    if shift.choices:
        pictures["optimum"] = data_uri(optimum_fronts(shift))
    return environment.get_template("report.html.j2").render(
        campaign=analysis.campaign,
        verdict=analysis.verdict,
        document=document,
        location=location,
        proof=proof,
        status=STATUSES[analysis.verdict.status],
        effects=effect_rows(document["effects"]),
        certainty=certainty(analysis),
        gap=gap_sentence(analysis, proof),
        next_test=in_words(document["next_experiment"]["description"]),
        pictures=pictures,
        rivals=rival_rows(analysis.verdict),
        parameters=parameter_rows(analysis),
        metrics=metric_rows(proof),
        records=record_rows(analysis.campaign, proof),
        shift=shift,
        surrogate_order=SURROGATE_ORDER,
    )


def _number(value: float | None, digits: int = 3) -> str:
    """Return a number for the reader, without an exponent where it can be helped."""
    if value is None or not np.isfinite(value):
        return "\N{EN DASH}"
    size = abs(value)
    if value == 0.0 or 1e-3 <= size < 1e5:
        shown = np.format_float_positional(value, digits, fractional=False, trim="-")
        return shown.replace("-", "\N{MINUS SIGN}")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}·10{power}".replace("-", "\N{MINUS SIGN}")


def check_folder(out: Path) -> None:
    """Refuse a folder that could not take a report, before anybody waits for one.

    Errors as in `write_report`.
    """
    allowed = "a folder that is new, empty or an earlier report"
    if out.is_symlink() or (out.exists() and not out.is_dir()):
        raise InvalidInput("folder of the report", str(out), allowed)
    if out.is_dir():
        present = {path.name for path in out.iterdir()}
        if present and not {VERDICT_FILE, PAGE_FILE} <= present <= set(FILES):
            raise InvalidInput("folder of the report", str(out), allowed)
    parent = next(folder for folder in out.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(parent))
    if not os.access(parent, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(parent))


def _write_folder(out: Path, files: dict[str, str]) -> None:
    """Write files to a draft beside ``out`` and put that in its place."""
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=out.parent) as workshop:
        draft = Path(workshop) / "report"
        draft.mkdir()
        for name, text in files.items():
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
        earlier = Path(workshop) / "earlier"
        try:
            if out.exists():
                out.replace(earlier)
            draft.replace(out)
        except BaseException:
            if earlier.exists() and not out.exists():
                earlier.replace(out)
            raise
