"""The drive that a command works on: its data sheet and its model."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pymoo_hdte.checks import InvalidInput

if TYPE_CHECKING:
    from pymoo_hdte.drive import DataSheet, DriveModel

BUILT_IN_SHEET = "hs_20_100"

DRIVE_DETAILS = """DATASHEET is a TOML file with teeth, rated condition and nominal values, or the
word hs_20_100 for the drive of the paper. MODEL is a TOML file with the make-up of theta_s and the
effects beside Eq. (9), or a preset: calibrated, resonant or published, made for the HS-20-100."""


def add_drive_arguments(parser: argparse.ArgumentParser) -> None:
    """Add DATASHEET and --model."""
    parser.add_argument("datasheet", metavar="DATASHEET", help=f"TOML file, or {BUILT_IN_SHEET}")
    parser.add_argument(
        "--model", default="calibrated", help="TOML file or preset (default calibrated)"
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
    if not named or not Path(named).exists():
        raise InvalidInput("DATASHEET", named, f"a TOML file that is there, or {BUILT_IN_SHEET}")
    return load_datasheet(Path(named))
