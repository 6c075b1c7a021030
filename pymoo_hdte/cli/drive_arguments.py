"""The drive that a command works on: its data sheet and its model."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pymoo_hdte.checks import InvalidInput

if TYPE_CHECKING:
    from pymoo_hdte.drive import CataloguePage, DataSheet, DriveModel

BUILT_IN_SHEET = "hs_20_100"

DRIVE_DETAILS = """DATASHEET is a TOML file: a catalogue page (write one with: pymoo-hdte example),
or teeth, rated condition and nominal values; or the word hs_20_100 for the drive of the paper.
MODEL is a TOML file with the make-up of theta_s and the effects beside Eq. (9), or a preset:
calibrated, resonant or published, made for the HS-20-100. A catalogue page has its own."""


def add_drive_arguments(parser: argparse.ArgumentParser) -> None:
    """Add DATASHEET and --model."""
    parser.add_argument("datasheet", metavar="DATASHEET", help=f"TOML file, or {BUILT_IN_SHEET}")
    parser.add_argument(
        "--model", help="TOML file or preset (default: that of DATASHEET, else calibrated)"
    )


def read_drive(options: argparse.Namespace) -> tuple[DriveModel, tuple[str, ...]]:
    """Return the drive that the options name, with remarks on it in sentences.

    Raises
    ------
    InvalidInput
        For a wrong field in one of the files.
    OSError
        If one cannot be read.
    """
    from pymoo_hdte.drive import PRESETS, hs_20_100, load_model, preset

    if (own_model := _whole_drive(options.datasheet)) is not None:
        if options.model is None:
            return own_model, remarks_on_estimates(options.datasheet)
        sheet = own_model.sheet
        if options.model not in PRESETS:
            return load_model(Path(options.model), sheet), ()
        allowed = f"none, as {Path(options.datasheet).name} has its own model, or a TOML file"
        raise InvalidInput("--model", options.model, allowed)
    options.model = "calibrated" if options.model is None else options.model
    sheet = read_sheet(options.datasheet)
    unsaid = _of_the_held_member(options.datasheet, sheet)
    if options.model not in PRESETS:
        return load_model(Path(options.model), sheet), unsaid
    model, own = replace(preset(options.model), sheet=sheet), hs_20_100()
    if _make(sheet) == _make(own):
        return model, unsaid
    return model, (
        *unsaid,
        f"Effects, order lines and scatter of theta_s are those of the model {model.name!r}, made "
        f"for the {own.name}; they need not hold for {sheet.name}. Measure them, or give --model.",
    )


def _whole_drive(named: str) -> DriveModel | None:
    """Return the drive of a file that holds more than a data sheet."""
    from pymoo_hdte.drive import load_drive
    from pymoo_hdte.drive.drive_file import holds_model

    if named == BUILT_IN_SHEET or not named or not Path(named).exists():
        return None
    return load_drive(named) if holds_model(named) else None


def catalogue_page(named: str) -> CataloguePage | None:
    """Return the catalogue page of a file; None for a drive that is described otherwise."""
    from pymoo_hdte._io.toml import read_toml
    from pymoo_hdte.drive import load_page

    if named == BUILT_IN_SHEET or not read_toml(Path(named)).has("catalogue"):
        return None
    return load_page(named)


def exceeded(page: CataloguePage, speed: float, load: float) -> tuple[str, ...]:
    """Say which printed torque and speed of a page a condition, rad/s and N.m, exceeds."""
    from pymoo_hdte.drive.catalogue import FIGURES, figure_text

    given = {"torque": abs(load), "speed": speed}
    above = [
        f"{figure.name.replace('_', ' ')}, {figure_text(figure.name, figure.value)}"
        for figure in page.entered
        if figure.name.split("_")[0] in ("average", "repeated", "momentary", "largest")
        and given[FIGURES[figure.name].quantity] > figure.value
    ]
    return (f"This is above what is printed as the {'; '.join(above)}.",) if above else ()


def remarks_on_estimates(named: str) -> tuple[str, ...]:
    """Say which figures of a catalogue page are estimated, and how far they may be off."""
    from pymoo_hdte.drive import complete
    from pymoo_hdte.drive.catalogue import figure_text

    page = catalogue_page(named)
    if page is None:
        return ()
    estimated = [
        f"{name} {figure_text(name, entry.value)} (± {100.0 * entry.tolerance:.0f} %)"
        for name, entry in complete(page).items()
        if entry.estimated
    ]
    return (f"Not on the page, so estimated: {', '.join(estimated)}.",) if estimated else ()


def _of_the_held_member(named: str, sheet: DataSheet) -> tuple[str, ...]:
    """Say which member is assumed to be held, and the ratio that follows, if the file does not."""
    from pymoo_hdte._io.toml import read_toml
    from pymoo_hdte.drive.datasheet import MEMBERS

    if named == BUILT_IN_SHEET or read_toml(Path(named)).table("teeth").has("held"):
        return ()
    (member,) = set(MEMBERS) - {sheet.held}
    held, alternative = sheet.held.replace("_", " "), member.replace("_", " ")
    return (
        f"{Path(named).name} does not say which member is held (teeth.held). The {held} is taken, "
        f"as makers state their ratios: ratio {sheet.ratio:g}; with the {alternative} held it "
        f"would be {replace(sheet, held=member).ratio:g}.",
    )


def _make(sheet: DataSheet) -> tuple[object, ...]:
    """Return the fields that identify the drive a preset was made for."""
    teeth = sheet.flexspline_teeth, sheet.circular_spline_teeth
    return sheet.name, *teeth, sheet.nominal.static_error


def read_sheet(named: str) -> DataSheet:
    """Return the data sheet of that file, or `BUILT_IN_SHEET`; errors as `read_drive`."""
    from pymoo_hdte.drive import hs_20_100, load_datasheet

    if named == BUILT_IN_SHEET:
        return hs_20_100()
    if (whole := _whole_drive(named)) is not None:
        return whole.sheet
    if not named or not Path(named).exists():
        raise InvalidInput("DATASHEET", named, f"a TOML file that is there, or {BUILT_IN_SHEET}")
    return load_datasheet(Path(named))
