"""The report on a design study: page, document, front and the chosen drive, all or nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte._reports.front import Front, design_rows, front_svg
from pymoo_hdte._reports.html import change, number, page, with_error
from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.design_check import DRIVES, SETS, Check
from pymoo_hdte.cli.design_study import AGREEMENT, HARDLY_WORTH, DesignStudy, Gain
from pymoo_hdte.decision import tolerance_band
from pymoo_hdte.decision.influence import LITTLE
from pymoo_hdte.drive import DriveModel
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml

FRONT_FILE = "front.csv"
SHEET_FILE = "optimum_sheet.toml"
MODEL_FILE = "optimum_model.toml"
_LITTLE_SHARE = 5e-4
"""Share of the variance that would be shown as 0.0 %."""
FOLDER = ReportFolder("optimum.json", (FRONT_FILE,), optional=(SHEET_FILE, MODEL_FILE))


def write_optimum_report(study: DesignStudy, notes: Sequence[str], out: Path) -> dict[str, Any]:
    """Write a report and return its document; errors as `ReportFolder.write`.

    ``notes`` are sentences on the drive that belong to the limits of the result. Without a design
    that may be recommended there are no files of a chosen drive.
    """
    document = optimum_document(study, notes)
    others = {FRONT_FILE: _front_csv(study)}
    if study.recommended:
        optimum = optimum_model(study)
        others |= {SHEET_FILE: sheet_toml(optimum.sheet), MODEL_FILE: model_toml(optimum)}
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
    """Return what ``optimum.json`` holds; designs in SI, moments of the DTE in arcsec.

    Where front and drive model do not agree, ``designs`` and ``tolerance_band`` are empty.
    """
    problem, settings, search = study.problem, study.settings, study.search
    lower, upper = tolerance_band(study.design, settings.tolerance)
    bands = zip(problem.var_names, lower.tolist(), upper.tolist(), strict=True)
    return heading("optimum", sentences(study), limits(study, notes)) | {
        "preference": study.preference,
        "recommended": study.recommended,
        "agreement": {
            "of_width": _finite(study.disagreement),
            "of_interpolation": _finite(search.difference),
            "of_quadrature": _finite(study.quadrature),
            "allowed": AGREEMENT,
            "width_arcsec": search.width.tolist(),
        },
        "designs": {
            word: {"row_of_front": row, **_design(study, row)} for word, row in study.chosen.items()
        }
        if study.recommended
        else {},
        "tolerance_band": {
            name: {"lower": low, "upper": high, "unit": problem.units[name]}
            for name, low, high in bands
            if study.recommended
        },
        "matter_little": list(study.uninfluential),
        "initial": dict(zip(problem.obj_names, study.initial.tolist(), strict=True)),
        "checked_on_the_model": {
            "drives": SETS * DRIVES,
            "initial": _checked(study.initial_check),
            "front": {str(row): _checked(check) for row, check in study.checks.items()},
            "falls_by_arcsec": {
                name: {"model": gain.reduction, "standard_error": gain.error}
                for name, gain in zip(problem.obj_names, study.gains.values(), strict=True)
                if np.isfinite(gain.reduction)
            },
        },
        "sources_of_scatter": dict(
            zip(study.sources.names, study.sources.first.tolist(), strict=True)
        ),
        "settings": {
            "designs": settings.designs,
            "seed": settings.seed,
            **problem.settings,
        },
        "evaluated": {"designs": study.evaluated, "model_runs": problem.moments.n_runs},
        "left_out": {
            "why": "no steady state somewhere within the scatter",
            "variables": list(problem.var_names),
            "designs": search.lost.tolist(),
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


def _finite(value: float) -> float | None:
    """Return a finite number, or None, by which JSON says that there is none."""
    return value if np.isfinite(value) else None


def _checked(check: Check) -> dict[str, float | None]:
    return {
        "mean_dte_arcsec": _finite(check.mean),
        "std_dte_arcsec": _finite(check.std),
        "standard_error_of_mean_arcsec": _finite(check.mean_error),
        "standard_error_of_std_arcsec": _finite(check.std_error),
    }


def sentences(study: DesignStudy) -> list[str]:
    """Say which design was chosen, what it gains, and how far front and drive model agree."""
    if not study.recommended:
        return [
            f"No design is recommended: front and drive model {_apart(study)}, "
            f"{100.0 * AGREEMENT:g} % are allowed.",
            f"Do not build the designs below{_way_out(study)}.",
            _agreement(study),
        ]
    return [
        f"Take {_design_in_words(study)}.",
        _worth(study),
        f"Front and drive model agree to {100.0 * study.disagreement:.1f} % of the front's width "
        f"({100.0 * AGREEMENT:g} % allowed). {_agreement(study)}",
    ]


def _design_in_words(study: DesignStudy) -> str:
    """Return the chosen values in words; a variable without influence may have any value."""
    problem = study.problem
    changes = 100.0 * (study.design / problem.nominal - 1.0)
    parts = [
        f"{name} {number(float(value), 4)} {problem.units[name]} ({change(float(off))})"
        for name, value, off in zip(problem.var_names, study.design, changes, strict=True)
        if name not in study.uninfluential
    ]
    if study.uninfluential:
        parts.append(f"any {' and '.join(study.uninfluential)} of the box")
    return ", ".join(parts)


def _worth(study: DesignStudy) -> str:
    before, after = study.initial_check, study.optimum_check
    if not np.isfinite(before.mean):
        return (
            f"By the drive model the mean DTE is {after.mean:.2f} arcsec, the standard deviation "
            f"{after.std:.2f}; the data sheet's design has no steady state somewhere within its "
            "scatter."
        )
    mean, std = study.gains.values()
    return (
        f"By the drive model {_moved('the mean DTE', before.mean, after.mean)} arcsec "
        f"({_by(mean)}), {_moved('the standard deviation', before.std, after.std)} "
        f"({_by(std)}; two standard errors)."
    )


def _way_out(study: DesignStudy) -> str:
    # More designs bring no more nodes to each.
    return "; more --designs may do" if study.search.difference > AGREEMENT else ""


def _apart(study: DesignStudy) -> str:
    if np.isfinite(study.disagreement):
        return f"differ by {100.0 * study.disagreement:.1f} % of the front's width"
    return "do not agree, as designs along the front have no steady state within their scatter"


def _agreement(study: DesignStudy) -> str:
    """Say what the report calls agreement of front and drive model."""
    search = study.search
    mean, std = (number(float(width)) for width in search.width)
    parts = [
        "Each design of the front is computed by the drive model itself, over "
        f"{math.prod(study.problem.moments.nodes)} drives (Gauss quadrature)."
    ]
    if np.isfinite(search.difference):
        parts.append(
            f"The last of {study.evaluated} designs is within {100.0 * search.difference:.1f} % of "
            "its interpolated value."
        )
    if np.isfinite(study.quadrature):
        parts.append(
            f"On {SETS * DRIVES} other drives {len(study.checks)} designs differ by at most "
            f"{100.0 * study.quadrature:.1f} %, two standard errors included."
        )
    parts.append(
        f"Percentages are of the front's width: {mean} arcsec in the mean, {std} in the standard "
        f"deviation, or {100.0 * HARDLY_WORTH:g} % of the least value if that is more."
    )
    return " ".join(parts)


def _moved(what: str, before: float, after: float) -> str:
    return f"{what} {'falls' if after < before else 'rises'} from {before:.2f} to {after:.2f}"


def _by(gain: Gain) -> str:
    return f"by {with_error(abs(gain.reduction), 2.0 * gain.error)}"


def limits(study: DesignStudy, notes: Sequence[str]) -> list[str]:
    """Say what a reader should know before quoting the result; ``notes`` are of the drive."""
    remarks = list(notes)
    lost = study.search.lost
    if len(lost):
        remarks.append(
            f"Of {study.search.evaluated} designs {len(lost)} are left out, the first for "
            f"{study.problem.without_steady_state(lost[0])}."
        )
    if study.uninfluential:
        names = " and ".join(study.uninfluential)
        remarks.append(
            f"{names} {'have' if len(study.uninfluential) > 1 else 'has'} no influence "
            f"(below {100.0 * LITTLE:g} %)."
        )
    shares = {what: gain.share for what, gain in study.gains.items()}
    if max(shares.values()) < HARDLY_WORTH:
        changes = ", ".join(f"{what} {change(-100.0 * share)}" for what, share in shares.items())
        remarks.append(
            f"Neither falls by {100.0 * HARDLY_WORTH:g} % ({changes}): this model has next to "
            "nothing to gain from these design variables."
        )
    return remarks


def _front_csv(study: DesignStudy) -> str:
    problem = study.problem
    names = [f"{name} [{problem.units[name]}]" for name in problem.var_names]
    rows = np.column_stack([study.front, study.designs])
    return csv_text([*problem.obj_names, *names], rows.tolist())


def _page(study: DesignStudy, document: dict[str, Any]) -> str:
    problem = study.problem
    sources = sorted(document["sources_of_scatter"].items(), key=lambda source: -source[1])
    shown = [(name, share) for name, share in sources if share >= _LITTLE_SHARE]
    values = design_rows(study.designs, problem.nominal)
    # Without agreement no design is pointed at.
    chosen = study.chosen if study.recommended else {}
    words = {word.replace("_", " "): row for word, row in chosen.items()}
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
        checked=[
            ("data sheet", study.initial, study.initial_check),
            *(
                (f"row {row + 1} of the front", study.front[row], check)
                for row, check in study.checks.items()
            ),
        ],
        variables=[(name, problem.units[name]) for name in problem.var_names],
        sources=shown,
        others=len(sources) - len(shown),
        checked_drives=SETS * DRIVES,
    )
