"""The report on an identification: page, parameters and data sheet, all or nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pymoo_hdte._reports.figures import AFTER, BEFORE, GREY, data_uri
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte._reports.html import digits, number, page
from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.identification import LOOPS, Identification, Parameter
from pymoo_hdte.drive import DataSheet
from pymoo_hdte.drive.datasheet import NOMINAL_FIELDS, unit_of
from pymoo_hdte.drive.datasheet_file import check_twist
from pymoo_hdte.drive.toml_text import sheet_toml
from pymoo_hdte.identification import ErrorStatistics, hysteresis_width, lost_energy
from pymoo_hdte.units import ARCSEC, UNITS

SHEET_FILE = "identified_sheet.toml"
FOLDER = ReportFolder("parameters.json", optional=(SHEET_FILE,))

_TOO_EQUAL = 1e-3
"""Scatter over prototypes, as a share of one record's error, too small for separate drives."""


def write_identification_report(
    found: Identification, sheet: DataSheet | None, out: Path
) -> dict[str, Any]:
    """Write a report; errors as `ReportFolder.write`.

    Parameters
    ----------
    found : Identification
    sheet : DataSheet or None
        Gets the identified values; None for no data sheet.
    out : Path

    Returns
    -------
    dict
        What ``parameters.json`` holds.
    """
    document = identification_document(found, sheet)
    others = {}
    if sheet is not None:
        others[SHEET_FILE] = sheet_toml(identified_sheet(found, sheet))
    FOLDER.write(out, _page(found, document), document, others)
    return document


def identified_sheet(found: Identification, sheet: DataSheet) -> DataSheet:
    """Return a data sheet with the identified values; what was not identified stays."""
    values = {NOMINAL_FIELDS[one.name]: one.value for one in found.parameters if one.value > 0.0}
    sources = sheet.error_sources
    if found.errors is not None:
        samples = dict(zip(found.errors.symbols, found.errors.samples, strict=True))
        sources = tuple(
            replace(
                source,
                mean=samples[source.symbol].mean * UNITS["length"]["um"],
                std=samples[source.symbol].std * UNITS["length"]["um"],
            )
            if source.symbol in samples and samples[source.symbol].mean >= 0.0
            else source
            for source in sheet.error_sources
        )
    return replace(
        sheet,
        source=f"{sheet.source}; identified from {found.folder}",
        nominal=replace(sheet.nominal, **values),
        error_sources=sources,
    )


def check_filled_in(found: Identification, sheet: DataSheet) -> None:
    """Refuse an identified stiffness that the rated load of the data sheet would twist too far.

    Raises
    ------
    InvalidInput
        As `check_twist`.
    """
    cause = "likely torque_Nm or torsion_arcsec is in another unit"
    check_twist(identified_sheet(found, sheet), f"{LOOPS}: stiffness", cause)


def identification_document(found: Identification, sheet: DataSheet | None) -> dict[str, Any]:
    """Return what ``parameters.json`` holds: parameters in SI, errors in micrometres."""
    return heading("parameters", sentences(found), limits(found, sheet)) | {
        "records": found.folder,
        "parameters": {one.name: _parameter(one) for one in found.parameters},
        "torsion_loops": [
            {
                "prototype": prototype,
                "repeat": repeat,
                "hysteresis_width_arcsec": hysteresis_width(loop) / ARCSEC,
                "lost_energy_J": lost_energy(loop),
            }
            for (prototype, repeat), loop in found.loops.items()
        ],
        "errors_um": {} if found.errors is None else _errors(found.errors),
    }


def _parameter(one: Parameter) -> dict[str, Any]:
    over = one.series
    return {
        "value": one.value,
        "unit": unit_of(one.name),
        "interval95": list(one.interval),
        "prototypes": len({prototype for prototype, _ in one.fits}),
        "runs": len(one.fits),
        "std_between_prototypes": over.between.std if over else None,
        "repeatability": over.repeatability if over and np.isfinite(over.repeatability) else None,
    }


def _errors(statistics: ErrorStatistics) -> dict[str, Any]:
    rejected = statistics.rejected.sum(axis=(0, 2))
    return {
        symbol: {
            "mean": sample.mean,
            "std": sample.std,
            "mean_interval95": list(sample.mean_interval()),
            "std_interval95": list(sample.std_interval()),
            "repeatability": float(repeatability),
            "distribution": marginal,
            "rejected_readings": int(lost),
        }
        for symbol, sample, repeatability, marginal, lost in zip(
            statistics.symbols,
            statistics.samples,
            statistics.repeatability,
            statistics.marginals,
            rejected,
            strict=True,
        )
    }


def sentences(found: Identification) -> list[str]:
    """Say what was identified."""
    said = []
    for one in found.parameters:
        low, high = one.interval
        over = one.series
        scatter = f", {over.between.cv_percent:.1f} % over prototypes" if over else ""
        said.append(
            f"{one.name} {number(one.value, 4)} {unit_of(one.name)} "
            f"(95 %: {number(low, 4)} to {number(high, 4)}{scatter})."
        )
    if found.errors is not None:
        said.append(f"Errors of components: {len(found.errors.symbols)} with mean and scatter.")
    return said


def headline(found: Identification) -> str:
    """Say in one sentence what was identified and how well; the rest stands in tables."""
    said = []
    for one in found.parameters:
        low, high = one.interval
        unit, half = unit_of(one.name), 50.0 * (high - low)
        words = f"{one.name} {number(one.value, digits(low, high))} {unit}"
        said.append(
            f"{words} ± {number(half / abs(one.value), 2)} % (95 %)" if one.value else words
        )
    if found.errors is not None:
        symbols = ", ".join(found.errors.symbols)
        said.append(f"mean and scatter of the component errors {symbols}")
    return f"Identified: {'; '.join(said)}."


def limits(found: Identification, sheet: DataSheet | None) -> list[str]:
    """Return what these records leave open."""
    said = [
        f"{one.name} came out at {number(one.value, 3)}: damping and stiffness are positive, so "
        "noise or a zero error outweighs it, and the data sheet keeps its value."
        for one in found.parameters
        if one.value <= 0.0
    ]
    single = [one.name for one in found.parameters if one.series is None]
    if single:
        said.append(f"One prototype says nothing of the scatter of {', '.join(single)}.")
    for one in found.parameters:
        error = max(fit.slope_error for fit in one.fits.values())
        if one.series is not None and one.series.between.std < _TOO_EQUAL * error:
            said.append(
                f"The prototypes agree on {one.name} far better than one record determines it: are "
                "they copies of one another?"
            )
    if found.errors is not None:
        said += found.errors.advice()
        if sheet is not None:
            said.append(
                "The errors are listed in the data sheet; its theta_s and DTE stay the same. The "
                "Python function sample_static_error computes theta_s from them."
            )
        samples = zip(found.errors.symbols, found.errors.samples, strict=True)
        negative = [symbol for symbol, sample in samples if sample.mean < 0.0]
        if negative:
            said.append(f"A data sheet takes no negative mean, so it lacks {', '.join(negative)}.")
        if sheet is not None:
            known = {source.symbol for source in sheet.error_sources}
            strange = [symbol for symbol in found.errors.symbols if symbol not in known]
            if strange:
                names = ", ".join(f"'{one}'" for one in strange)
                said.append(f"The data sheet has no error source called {names}.")
    return said


def _page(found: Identification, document: dict[str, Any]) -> str:
    pictures = {}
    if found.loops:
        pictures["loops"] = data_uri(_loops_figure(found))
    return page(
        "pymoo_hdte.cli",
        "identification.html.j2",
        found=found,
        document=document,
        headline=headline(found),
        pictures={**pictures, **_strips(found)},
    )


def _loops_figure(found: Identification) -> Figure:
    """Draw all loops, the first one in front."""
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axis = figure.subplots()
    for place, loop in enumerate(found.loops.values()):
        colour, width = (BEFORE, 1.4) if place == 0 else (GREY, 0.5)
        axis.plot(
            loop.torsion / ARCSEC, loop.torque, color=colour, linewidth=width, zorder=3 - place
        )
    axis.set_xlabel("torsion [arcsec]")
    axis.set_ylabel("torque [N.m]")
    return figure


def _strips(found: Identification) -> dict[str, str]:
    """Draw the value of every run over the number of its prototype, one figure per parameter."""
    pictures = {}
    for one in found.parameters:
        figure = Figure(figsize=(6.4, 2.4), layout="constrained")
        axis = figure.subplots()
        numbers = [prototype for prototype, _ in one.fits]
        errors = [2.0 * fit.slope_error for fit in one.fits.values()]
        slopes = [fit.slope for fit in one.fits.values()]
        axis.errorbar(numbers, slopes, errors, fmt="o", color=AFTER, markersize=4, elinewidth=0.8)
        axis.axhspan(*one.interval, color=BEFORE, alpha=0.2)
        axis.set_xlabel("prototype")
        axis.set_ylabel(f"{one.name} [{unit_of(one.name)}]")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        pictures[one.name] = data_uri(figure)
    return pictures
