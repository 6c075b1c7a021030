"""The report on a decision: one page to print, the same as JSON, and the levers as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._reports.figures import AFTER, GREY, data_uri
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte._reports.html import change, number, page
from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.decision import LITTLE, SPREAD, Decision, Limits, nominal_dte
from pymoo_hdte.cli.drive_arguments import near_resonances
from pymoo_hdte.drive import drive_of
from pymoo_hdte.drive.catalogue import figure_text
from pymoo_hdte.drive.levers import LEVERS, SHARES

LEVERS_FILE = "levers.csv"
FOLDER = ReportFolder("decision.json", (LEVERS_FILE,))

_WORDS = {
    "wall_thickness": "wall thickness",
    "preload": "preload",
    "cam_class": "tolerance class of the cam",
    "tooth_class": "tolerance class of the teeth",
}


def write_decision(decision: Decision, notes: Sequence[str], out: Path) -> dict[str, Any]:
    """Write a report and return its document; errors as `ReportFolder.write`."""
    document = decision_document(decision, notes)
    columns = ("lever", "setting", "mean_arcsec", "std_arcsec", "starting_torque_Nm", "efficiency")
    rows = [
        (name, setting, result.mean, result.std, result.starting, result.efficiency)
        for name, tried in decision.effects.items()
        for setting, result in tried.items()
    ]
    text = page(
        "pymoo_hdte.cli",
        "decision.html.j2",
        decision=decision,
        document=document,
        levers=LEVERS,
        words=_WORDS,
        setting_text=setting_text,
        picture=data_uri(levers_figure(decision)),
    )
    FOLDER.write(out, text, document, {LEVERS_FILE: csv_text(columns, rows)})
    return document


def decision_document(decision: Decision, notes: Sequence[str]) -> dict[str, Any]:
    """Return what ``decision.json`` holds."""
    return heading("decision", sentences(decision), limits(decision, notes)) | {
        "found": [effect.to_dict() for effect in decision.found],
        "before": asdict(decision.before),
        "after": asdict(decision.after),
        "settings": decision.settings,
        "without_influence": list(decision.idle),
        "gain_interval90_arcsec": list(decision.gain),
        "gain_changes_arcsec": decision.gain_changes,
        "formulas": {lever.name: lever.basis for lever in LEVERS},
    }


def setting_text(name: str, setting: float) -> str:
    """Return a setting as words: a change in percent, or classes finer or coarser."""
    if name.endswith("_class"):
        finer = "finer" if setting < 0.0 else "coarser"
        return "as it is" if setting == 0.0 else f"{abs(setting):g} {finer}"
    return "as it is" if setting == 1.0 else change(100.0 * (setting - 1.0))


def sentences(decision: Decision) -> list[str]:
    """Say what to change, what it brings, and what to measure to be sure."""
    before, after = decision.before, decision.after
    if not decision.settings:
        said = [f"Change nothing: no setting within the limits brings {100.0 * LITTLE:g} %."]
    else:
        changes = "; ".join(
            f"{_WORDS[name]} {setting_text(name, setting)}"
            for name, setting in decision.settings.items()
        )
        said = [f"Change: {changes}."]
        low, high = decision.gain
        said.append(
            f"The mean DTE goes from {before.mean:.1f} to {after.mean:.1f} arcsec, its standard "
            f"deviation over drives from {before.std:.1f} to {after.std:.1f}. For the nominal "
            f"drive the reduction is {low:.1f} to {high:.1f} arcsec (90 %, from the estimates "
            "alone)."
        )
        said.append(
            f"It costs: starting torque {number(1e3 * before.starting, 3)} to "
            f"{number(1e3 * after.starting, 3)} mN.m, efficiency "
            f"{number(100.0 * before.efficiency, 3)} to {number(100.0 * after.efficiency, 3)} %, "
            f"bending stress {change(100.0 * (after.stress - 1.0))}."
        )
        said.append(_to_measure(decision))
    if decision.idle:
        names = ", ".join(_WORDS[name] for name in decision.idle)
        said.append(f"No influence (below {100.0 * LITTLE:g} %), so left: {names}.")
    return said


def _to_measure(decision: Decision) -> str:
    """Say which figures decide whether the change pays."""
    least = LITTLE * decision.before.mean
    weighty = [name for name, moved in decision.gain_changes.items() if moved > least][:2]
    if weighty:
        return f"Measure first: {' and '.join(weighty)}, on which the gain depends most."
    return (
        f"No estimate moves the gain by {100.0 * LITTLE:g} % of the DTE. What is to be measured is "
        "the DTE itself, before and after the first change."
    )


def _of_found(decision: Decision) -> str:
    """Say what the effects that the page lacks do to the DTE that ``simulate`` gives for it."""
    names = ", ".join(dict.fromkeys(effect.name for effect in decision.found))
    plain, found = nominal_dte(drive_of(decision.page)), nominal_dte(decision.drives[0])
    return (
        f"What the verdict found ({names}) takes the DTE of the nominal drive from {plain:.1f} "
        f"arcsec, which simulate gives for the page, to {found:.1f}. It has its fitted values "
        "here; their intervals are not in that of the gain."
    )


def _resonances(decision: Decision) -> list[str]:
    """Say what lies near the rated speed, before and after the change."""
    before, after = (near_resonances(drive) for drive in decision.drives)
    if before == after:
        return list(before)
    said = [f"Before the change, {sentence}" for sentence in before]
    return said + [f"After the change, {sentence}" for sentence in after]


def limits(decision: Decision, notes: Sequence[str]) -> list[str]:
    """Say what a reader should know before acting on it."""
    bounds = Limits()
    return [
        *([_of_found(decision)] if decision.found else ()),
        *_resonances(decision),
        *notes,
        "Assumed for the levers, and varied in the interval of the gain: "
        + ", ".join(
            f"{name} {figure_text(name, decision.figures[name].value)} "
            f"(± {100.0 * decision.figures[name].tolerance:.0f} %)"
            for name in SHARES
        )
        + ". Enter your own under [catalogue].",
        f"Limits: starting torque at most times {bounds.starting_torque:g}, bending stress times "
        f"{bounds.stress:g}, efficiency at most {100.0 * bounds.efficiency:g} points lower. The "
        f"goal is mean + {SPREAD:g} standard deviations of the DTE at rated speed and load.",
    ]


def levers_figure(decision: Decision) -> Figure:
    """Draw what each lever does to the goal and to the starting torque, alone."""
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    axis = figure.subplots()
    places = np.arange(len(decision.effects))
    for place, (name, tried) in zip(places, decision.effects.items(), strict=True):
        for setting, result in tried.items():
            moved = 100.0 * (result.goal / decision.before.goal - 1.0)
            if moved == 0.0:
                continue
            axis.barh(place, moved, color=AFTER if moved < 0.0 else GREY, height=0.55)
            axis.annotate(
                setting_text(name, setting),
                (moved, place),
                xytext=(4 if moved > 0.0 else -4, 0),
                textcoords="offset points",
                ha="left" if moved > 0.0 else "right",
                va="center",
                fontsize=8,
            )
    axis.set_yticks(places, [_WORDS[name] for name in decision.effects])
    axis.axvline(0.0, color="black", linewidth=0.8)
    axis.margins(x=0.25)
    axis.set_xlabel(f"change of mean + {SPREAD:g} std of the DTE, each lever alone [%]")
    axis.invert_yaxis()
    return figure
