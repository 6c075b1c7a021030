"""The report on a design study: page, document, front and the chosen drive, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.design_study import CHECKED_DRIVES, LITTLE, POPULATION, Check, DesignStudy, Gain
from pymoo_hdte.decision import tolerance_band
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml
from pymoo_hdte.io.text_table import csv_text
from pymoo_hdte.reports.folder import ReportFolder
from pymoo_hdte.reports.front import Front, design_rows, front_svg
from pymoo_hdte.reports.html import number, page

FRONT_FILE = "front.csv"
SHEET_FILE = "optimum_sheet.toml"
MODEL_FILE = "optimum_model.toml"
FOLDER = ReportFolder("optimum.json", (FRONT_FILE, SHEET_FILE, MODEL_FILE))

_WORTHLESS = 0.02
"""Share of an objective below which a gain is hardly worth a change of design."""


def write_optimum_report(study: DesignStudy, notes: Sequence[str], out: Path) -> dict[str, Any]:
    """Write a report and return its document; errors as `ReportFolder.write`.

    ``notes`` are sentences on the drive that belong to the limits of the result.
    """
    document = optimum_document(study, notes)
    optimum = optimum_model(study)
    others = {
        FRONT_FILE: _front_csv(study),
        SHEET_FILE: sheet_toml(optimum.sheet),
        MODEL_FILE: model_toml(optimum),
    }
    FOLDER.write(out, _page(study, document), document, others)
    return document


def optimum_model(study: DesignStudy) -> DriveModel:
    """Return the drive model with the chosen design as its nominal values."""
    model = study.problem.model
    stiffness, input_inertia, input_damping, mesh_damping = study.design.tolist()
    nominal = replace(
        model.sheet.nominal,
        stiffness=stiffness,
        input_inertia=input_inertia,
        input_damping=input_damping,
        mesh_damping=mesh_damping,
    )
    source = f"{study.preference} design of pymoo-hdte optimise, from: {model.sheet.source}"
    return replace(model, sheet=replace(model.sheet, nominal=nominal, source=source))


def optimum_document(study: DesignStudy, notes: Sequence[str]) -> dict[str, Any]:
    """Return what ``optimum.json`` holds; designs in SI, moments of the DTE in arcsec."""
    problem, settings = study.problem, study.settings
    lower, upper = tolerance_band(study.design, settings.tolerance)
    return heading("optimum", sentences(study), limits(study, notes)) | {
        "preference": study.preference,
        "designs": {
            word: {
                "row_of_front": row,
                **_design(study, row),
            }
            for word, row in study.chosen.items()
        },
        "tolerance_band": {
            name: {"lower": low, "upper": high, "unit": problem.units[name]}
            for name, low, high in zip(
                problem.var_names, lower.tolist(), upper.tolist(), strict=True
            )
        },
        "matter_little": list(study.free),
        "initial": dict(zip(problem.obj_names, study.initial.tolist(), strict=True)),
        "checked_on_the_model": {
            "drives": CHECKED_DRIVES,
            "initial": _checked(study.initial_check),
            "optimum": _checked(study.optimum_check),
            "falls_by_arcsec": {
                name: _gained(gain)
                for name, gain in zip(problem.obj_names, study.gains.values(), strict=True)
            },
        },
        "sources_of_scatter": dict(
            zip(study.sources.names, study.sources.first.tolist(), strict=True)
        ),
        "settings": {
            "algorithm": "ElitistSwarm",
            "population": POPULATION,
            "evaluations": settings.evaluations,
            "seed": settings.seed,
            **problem.settings,
        },
        "model": problem.model.to_dict(),
        "front": {"file": FRONT_FILE, "designs": len(study.front)},
    }


def _design(study: DesignStudy, row: int) -> dict[str, Any]:
    problem = study.problem
    entries = zip(problem.var_names, study.designs[row].tolist(), strict=True)
    return {name: {"value": value, "unit": problem.units[name]} for name, value in entries} | dict(
        zip(problem.obj_names, study.front[row].tolist(), strict=True)
    )


def _checked(check: Check) -> dict[str, float]:
    return {
        "mean_dte_arcsec": check.mean,
        "std_dte_arcsec": check.std,
        "standard_error_of_mean_arcsec": check.mean_error,
        "standard_error_of_std_arcsec": check.std_error,
    }


def _gained(gain: Gain) -> dict[str, float]:
    return {"surrogate": gain.promised, "model": gain.found, "standard_error_of_model": gain.error}


def sentences(study: DesignStudy) -> list[str]:
    """Say which design was chosen, what it gains by the model, and what the surrogate promised."""
    problem = study.problem
    changes = 100.0 * (study.design / problem.nominal - 1.0)
    parts = [
        f"{name} {number(float(value), 4)} {problem.units[name]} ({change:+.1f} %)"
        for name, value, change in zip(problem.var_names, study.design, changes, strict=True)
    ]
    mean, std = study.gains.values()
    before, after = study.initial_check, study.optimum_check
    (mean_before, std_before), (mean_after, std_after) = study.initial, study.objectives
    return [
        f"Take {', '.join(parts)}.",
        f"By the drive model {_moved('the mean DTE', before.mean, after.mean)} arcsec "
        f"({_by(mean)}), {_moved('the standard deviation', before.std, after.std)} "
        f"({_by(std)}; two standard errors).",
        f"By its surrogate, which was optimised, {_moved('the mean DTE', mean_before, mean_after)} "
        f"arcsec, {_moved('the standard deviation', std_before, std_after)}.",
    ]


def _moved(what: str, before: float, after: float) -> str:
    return f"{what} {'falls' if after < before else 'rises'} from {before:.2f} to {after:.2f}"


def _by(gain: Gain) -> str:
    return f"by {abs(gain.found):.2f} ± {2.0 * gain.error:.2f}"


def limits(study: DesignStudy, notes: Sequence[str]) -> list[str]:
    """Say what a reader should know before quoting the result; ``notes`` are of the drive."""
    found = list(notes)
    gains = study.gains
    if study.free:
        found.append(
            f"No value of {' or '.join(study.free)} within the box moves mean or standard "
            f"deviation by {100.0 * LITTLE:g} %: what is said of it carries no information."
        )
    found += [
        f"The drive model does not confirm a lower {what}: do not build this design for it."
        for what, gain in gains.items()
        if gain.refuted
    ]
    shares = {what: gain.share for what, gain in gains.items()}
    if max(shares.values()) < _WORTHLESS:
        changes = ", ".join(f"{what} {-100.0 * share:+.1f} %" for what, share in shares.items())
        found.append(
            f"Neither falls by {100.0 * _WORTHLESS:g} % ({changes}): this model has next to "
            "nothing to gain by these design variables."
        )
    found += [
        f"The surrogate is off by {abs(gain.promised - gain.found):.2f} arcsec in how the {what} "
        "changes, more than half of the change; a higher --order is sharper."
        for what, gain in gains.items()
        if gain.coarse
    ]
    return found


def _front_csv(study: DesignStudy) -> str:
    problem = study.problem
    names = [f"{name} [{problem.units[name]}]" for name in problem.var_names]
    rows = np.column_stack([study.front, study.designs])
    return csv_text([*problem.obj_names, *names], rows.tolist())


def _page(study: DesignStudy, document: dict[str, Any]) -> str:
    problem = study.problem
    values = design_rows(study.designs, problem.nominal)
    words = {word.replace("_", " "): row for word, row in study.chosen.items()}
    return page(
        "pymoo_hdte.cli",
        "optimum.html.j2",
        study=study,
        model=problem.model,
        document=document,
        words=words,
        figure=front_svg(
            Front(
                points=study.front,
                marked=words,
                initial=study.initial,
                axes=("mean DTE [arcsec]", "standard deviation of the DTE [arcsec]"),
            )
        ),
        rows=list(zip(study.front.tolist(), values, strict=True)),
        variables=[(name, problem.units[name]) for name in problem.var_names],
        sources=sorted(document["sources_of_scatter"].items(), key=lambda one: -one[1]),
        checked_drives=CHECKED_DRIVES,
    )
