"""The report on an identification: page, parameters and data sheet, all or nothing."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import toml_text
from pymoo_hdte._reports.figures import AFTER, BEFORE, GREY, data_uri
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte._reports.html import digits, number, page
from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.identification import (
    LOOPS,
    Identification,
    MeasuredFigure,
    Parameter,
    measured_figures,
)
from pymoo_hdte.drive import DataSheet, drive_of, load_page
from pymoo_hdte.drive.catalogue import FIGURES, figure_text, page_from_fields
from pymoo_hdte.drive.datasheet import NOMINAL_FIELDS, unit_of
from pymoo_hdte.drive.datasheet_file import check_twist
from pymoo_hdte.drive.toml_text import sheet_toml
from pymoo_hdte.effects.quantities import with_unit
from pymoo_hdte.identification import ErrorStatistics, hysteresis_width, lost_energy
from pymoo_hdte.units import ARCSEC, UNITS

SHEET_FILE = "identified_sheet.toml"
DRIVE_FILE = "identified_drive.toml"
FOLDER = ReportFolder("parameters.json", optional=(SHEET_FILE, DRIVE_FILE))

_TOO_EQUAL = 1e-3
"""Scatter over prototypes, as a share of one record's error, too small for separate drives."""


def write_identification_report(
    identification: Identification, sheet: DataSheet | None, out: Path, page: Path | None = None
) -> dict[str, Any]:
    """Write a report; errors as `ReportFolder.write`.

    Parameters
    ----------
    identification : Identification
    sheet : DataSheet or None
        Data sheet that receives the identified values; None for none.
    out : Path
    page : Path, optional
        File of a catalogue page, which receives the measured figures in place of a data sheet.

    Returns
    -------
    dict
        What ``parameters.json`` holds.
    """
    document = identification_document(identification, sheet)
    others = {}
    if page is not None:
        figures = measured_figures(identification, load_page(page))
        document["figures"] = {
            name: {
                "value": figure.value,
                "prototypes": figure.prototypes,
                "std_between_prototypes": figure.scatter if figure.prototypes > 1 else None,
            }
            for name, figure in figures.items()
        }
        document["sentences"].append(_of_page(figures))
        others[DRIVE_FILE] = filled_in(page, figures, identification.folder)
    elif sheet is not None:
        others[SHEET_FILE] = sheet_toml(identified_sheet(identification, sheet))
    FOLDER.write(out, _page(identification, document), document, others)
    return document


def _of_page(figures: Mapping[str, MeasuredFigure]) -> str:
    said = ", ".join(
        f"{name} {figure_text(name, figure.value)}" for name, figure in figures.items()
    )
    return f"Figures of the page: {said}." if said else "No figure of the page was measured."


def filled_in(page: Path, figures: Mapping[str, MeasuredFigure], source: str) -> str:
    """Return a catalogue page as TOML with measured figures in place of its own.

    Raises
    ------
    InvalidInput
        If the drive that follows is none.
    """
    table = tomllib.loads(page.read_text(encoding="utf-8"))
    for name, figure in figures.items():
        table["catalogue"][name] = with_unit(figure.value, FIGURES[name].quantity)
    table["source"] = f"{table['source']}; {', '.join(figures)} identified from {source}"
    text = toml_text(table)
    drive_of(page_from_fields(Fields(tomllib.loads(text), DRIVE_FILE)))
    return text


def identified_sheet(identification: Identification, sheet: DataSheet) -> DataSheet:
    """Return a data sheet with the identified values; what was not identified stays."""
    values = {
        NOMINAL_FIELDS[parameter.name]: parameter.value
        for parameter in identification.parameters
        if parameter.value > 0.0
    }
    sources = sheet.error_sources
    if identification.errors is not None:
        samples = dict(
            zip(identification.errors.symbols, identification.errors.samples, strict=True)
        )
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
        source=f"{sheet.source}; identified from {identification.folder}",
        nominal=replace(sheet.nominal, **values),
        error_sources=sources,
    )


def check_filled_in(identification: Identification, sheet: DataSheet) -> None:
    """Refuse an identified stiffness that the rated load of the data sheet would twist too far.

    Raises
    ------
    InvalidInput
        As `check_twist`.
    """
    cause = "likely torque_Nm or torsion_arcsec is in another unit"
    check_twist(identified_sheet(identification, sheet), f"{LOOPS}: stiffness", cause)


def identification_document(
    identification: Identification, sheet: DataSheet | None
) -> dict[str, Any]:
    """Return what ``parameters.json`` holds: parameters in SI, errors in micrometres."""
    return heading("parameters", sentences(identification), limits(identification, sheet)) | {
        "records": identification.folder,
        "parameters": {
            parameter.name: _parameter(parameter) for parameter in identification.parameters
        },
        "torsion_loops": [
            {
                "prototype": prototype,
                "repeat": repeat,
                "hysteresis_width_arcsec": hysteresis_width(loop) / ARCSEC,
                "lost_energy_J": lost_energy(loop),
            }
            for (prototype, repeat), loop in identification.loops.items()
        ],
        "errors_um": {} if identification.errors is None else _errors(identification.errors),
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    over = parameter.series
    return {
        "value": parameter.value,
        "unit": unit_of(parameter.name),
        "interval95": list(parameter.interval),
        "prototypes": len({prototype for prototype, _ in parameter.fits}),
        "runs": len(parameter.fits),
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


def sentences(identification: Identification) -> list[str]:
    """Say what was identified."""
    said = []
    for parameter in identification.parameters:
        low, high = parameter.interval
        over = parameter.series
        scatter = f", {over.between.cv_percent:.1f} % over prototypes" if over else ""
        said.append(
            f"{parameter.name} {number(parameter.value, 4)} {unit_of(parameter.name)} "
            f"(95 %: {number(low, 4)} to {number(high, 4)}{scatter})."
        )
    if identification.errors is not None:
        said.append(
            f"Errors of components: {len(identification.errors.symbols)} with mean and scatter."
        )
    return said


def headline(identification: Identification) -> str:
    """Say in one sentence what was identified and how well; tables have the details."""
    said = []
    for parameter in identification.parameters:
        low, high = parameter.interval
        unit, half = unit_of(parameter.name), 50.0 * (high - low)
        words = f"{parameter.name} {number(parameter.value, digits(low, high))} {unit}"
        said.append(
            f"{words} ± {number(half / abs(parameter.value), 2)} % (95 %)"
            if parameter.value
            else words
        )
    if identification.errors is not None:
        symbols = ", ".join(identification.errors.symbols)
        said.append(f"mean and scatter of the component errors {symbols}")
    return f"Identified: {'; '.join(said)}."


def limits(identification: Identification, sheet: DataSheet | None) -> list[str]:
    """Return what these records leave open, in sentences."""
    said = [
        f"{parameter.name} came out at {number(parameter.value, 3)}: damping and stiffness are "
        "positive, so noise or a zero error outweighs it, and the data sheet keeps its value."
        for parameter in identification.parameters
        if parameter.value <= 0.0
    ]
    single = [parameter.name for parameter in identification.parameters if parameter.series is None]
    if single:
        said.append(f"One prototype says nothing of the scatter of {', '.join(single)}.")
    for parameter in identification.parameters:
        error = max(fit.slope_error for fit in parameter.fits.values())
        if parameter.series is not None and parameter.series.between.std < _TOO_EQUAL * error:
            said.append(
                f"The prototypes agree on {parameter.name} far better than one record determines "
                "it: are they copies of one another?"
            )
    if identification.errors is not None:
        said += identification.errors.advice()
        if sheet is not None:
            said.append(
                "The errors are listed in the data sheet; its theta_s and DTE stay the same. The "
                "Python function sample_static_error computes theta_s from them."
            )
        samples = zip(identification.errors.symbols, identification.errors.samples, strict=True)
        negative = [symbol for symbol, sample in samples if sample.mean < 0.0]
        if negative:
            said.append(f"A data sheet takes no negative mean, so it lacks {', '.join(negative)}.")
        if sheet is not None:
            known = {source.symbol for source in sheet.error_sources}
            strange = [symbol for symbol in identification.errors.symbols if symbol not in known]
            if strange:
                names = ", ".join(f"'{symbol}'" for symbol in strange)
                said.append(f"The data sheet has no error source called {names}.")
    return said


def _page(identification: Identification, document: dict[str, Any]) -> str:
    pictures = {}
    if identification.loops:
        pictures["loops"] = data_uri(_loops_figure(identification))
    return page(
        "pymoo_hdte.cli",
        "identification.html.j2",
        identification=identification,
        document=document,
        headline=headline(identification),
        pictures={**pictures, **_strips(identification)},
    )


def _loops_figure(identification: Identification) -> Figure:
    """Draw all loops, the first in front."""
    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axis = figure.subplots()
    for place, loop in enumerate(identification.loops.values()):
        colour, width = (BEFORE, 1.4) if place == 0 else (GREY, 0.5)
        axis.plot(
            loop.torsion / ARCSEC, loop.torque, color=colour, linewidth=width, zorder=3 - place
        )
    axis.set_xlabel("torsion [arcsec]")
    axis.set_ylabel("torque [N.m]")
    return figure


def _strips(identification: Identification) -> dict[str, str]:
    """Draw the value of every run over the number of its prototype, one figure per parameter."""
    pictures = {}
    for parameter in identification.parameters:
        figure = Figure(figsize=(6.4, 2.4), layout="constrained")
        axis = figure.subplots()
        numbers = [prototype for prototype, _ in parameter.fits]
        errors = [2.0 * fit.slope_error for fit in parameter.fits.values()]
        slopes = [fit.slope for fit in parameter.fits.values()]
        axis.errorbar(numbers, slopes, errors, fmt="o", color=AFTER, markersize=4, elinewidth=0.8)
        axis.axhspan(*parameter.interval, color=BEFORE, alpha=0.2)
        axis.set_xlabel("prototype")
        axis.set_ylabel(f"{parameter.name} [{unit_of(parameter.name)}]")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        pictures[parameter.name] = data_uri(figure)
    return pictures
