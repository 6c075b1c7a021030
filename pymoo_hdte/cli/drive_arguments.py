"""The drive that a command works on: its data sheet and its model."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pymoo_hdte.checks import InvalidInput

if TYPE_CHECKING:
    from pymoo_hdte.drive import CataloguePage, DataSheet, DriveModel
    from pymoo_hdte.drive.drive_file import DescribedDrive

BUILT_IN_SHEET = "hs_20_100"
RESONANCE_MARGIN = 0.15
"""Relative distance of speed and resonance, within which an undamped vibration has at least three
times its static size: 1 / |1 - 1.15^2| = 3.1, and 1 / (1 - .85^2) = 3.6."""

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


class NamedDrive(NamedTuple):
    """The drive that a command's options name.

    Attributes
    ----------
    model : DriveModel
    page : CataloguePage or None
        None where the drive, or its model, is described otherwise.
    remarks : tuple of str
        Sentences on what is assumed.
    """

    model: DriveModel
    page: CataloguePage | None
    remarks: tuple[str, ...]


def read_drive(options: argparse.Namespace) -> NamedDrive:
    """Return the drive that the options name.

    Raises
    ------
    InvalidInput
        For a wrong field in one of the files.
    OSError
        If one cannot be read.
    """
    from pymoo_hdte.drive import PRESETS, hs_20_100, load_model, preset

    sheet, described, page = read_description(options.datasheet)
    if described is not None and options.model is None:
        return NamedDrive(described, page, () if page is None else remarks_on_estimates(page))
    if described is not None and options.model in PRESETS:
        allowed = f"none, as {Path(options.datasheet).name} has its own model, or a TOML file"
        raise InvalidInput("--model", options.model, allowed)
    options.model = "calibrated" if options.model is None else options.model
    unsaid = () if described is not None else _of_the_held_member(options.datasheet, sheet)
    if options.model not in PRESETS:
        return NamedDrive(load_model(Path(options.model), sheet), None, unsaid)
    model, own = replace(preset(options.model), sheet=sheet), hs_20_100()
    if _make(sheet) != _make(own):
        unsaid += (
            f"Effects, order lines and scatter of theta_s are those of the model {model.name!r}, "
            f"made for the {own.name}; they need not hold for {sheet.name}. Measure them, or give "
            "--model.",
        )
    return NamedDrive(model, None, unsaid)


def read_description(named: str) -> DescribedDrive:
    """Return what that file, or `BUILT_IN_SHEET`, says of a drive; errors as `read_drive`."""
    from pymoo_hdte.drive import hs_20_100
    from pymoo_hdte.drive.drive_file import DescribedDrive, describe_drive

    if named == BUILT_IN_SHEET:
        return DescribedDrive(hs_20_100(), None, None)
    if not named or not Path(named).exists():
        raise InvalidInput("DATASHEET", named, f"a TOML file that is there, or {BUILT_IN_SHEET}")
    return describe_drive(named)


def near_resonances(model: DriveModel) -> tuple[str, ...]:
    """Say which resonances lie near the rated speed of a model."""
    from pymoo_hdte.drive.dte_map import critical_speeds
    from pymoo_hdte.units import REVOLUTION_PER_MINUTE

    rated = model.sheet.input_speed / REVOLUTION_PER_MINUTE
    orders = [
        f"{order:g}"
        for order, speed in critical_speeds(model)
        if abs(rated / speed - 1.0) < RESONANCE_MARGIN
    ]
    if not orders:
        return ()
    where = "resonances of orders" if orders[1:] else "resonance of order"
    return (
        f"{rated:.0f} r/min is within {100.0 * RESONANCE_MARGIN:g} % of the {where} "
        f"{' and '.join(orders)}: the DTE depends strongly on damping and inertia.",
    )


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


def remarks_on_estimates(page: CataloguePage) -> tuple[str, ...]:
    """Say which figures of a catalogue page are estimated, and how far they may be off."""
    from pymoo_hdte.drive import complete
    from pymoo_hdte.drive.catalogue import figure_text

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
