"""``pymoo-hdte discrepancy``: from a folder of records to a verdict on what the model lacks."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from pymoo_hdte._reports.folder import PAGE_FILE
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.command import Command, Outcome, Say
from pymoo_hdte.cli.own_effects import OPTION, errors_by_line, own_effects

ModelFiles = tuple[Path | None, Path | None]
"""Files of a model and its data sheet."""

_DETAILS = """example:
  pymoo-hdte discrepancy campaigns/rig-01 --out reports/rig-01
  pymoo-hdte discrepancy campaigns/rig-01 --believed reports/rig-01/revised_model.toml --out again
  pymoo-hdte discrepancy campaigns/rig-01 --effects my_effects.py --out reports/mine

CAMPAIGN holds records and campaign.toml (a harmonic drive) or rig.toml (any other mechanism).
DIR gets verdict.json, revised_model.toml and report.html; an earlier report there is replaced,
anything else refused.
Exit codes: 0 a verdict was reached, whatever it is; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "campaign", type=Path, metavar="CAMPAIGN", help="folder of the campaign, or its .toml file"
    )
    parser.add_argument(
        "--data", type=Path, metavar="DIR", help="folder of the records that rig.toml names"
    )
    parser.add_argument(
        "--believed",
        type=Path,
        metavar="MODEL.toml",
        help="nominal model in place of the campaign's own, such as a revised_model.toml",
    )
    parser.add_argument(
        "--sheet",
        type=Path,
        metavar="SHEET.toml",
        help="data sheet of a drive's model; by default MODEL_sheet.toml beside it",
    )
    parser.add_argument(
        OPTION,
        type=Path,
        metavar="FILE.py",
        help="Python file with effects of your own to look for as well; the file is run",
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.discrepancy._report.folder import FOLDER
    from pymoo_hdte.discrepancy._report.summary import summary
    from pymoo_hdte.effects import register, registered

    believed = options.believed, options.sheet
    # A file may register its effects itself; and a believed model may have them.
    with FOLDER.held(options.out), registered():
        for effect in () if options.effects is None else own_effects(options.effects):
            register(effect)
        with errors_by_line(options.effects):
            document = _analysed(options, believed, say)
    return Outcome(document, summary(document, str(options.out / PAGE_FILE)))


def _analysed(options: argparse.Namespace, believed: ModelFiles, say: Say) -> dict[str, Any]:
    """Analyse a campaign or a rig and write its report; return the verdict's document."""
    from pymoo_hdte.cli.reading_bar import ReadingBar, SimulationBar
    from pymoo_hdte.discrepancy import analyse

    say("reading the records")
    with closing(ReadingBar(options.quiet)) as bar:
        measured = _believing(_measured(options.campaign, options.data, bar), *believed)
    say("looking for what is missing")
    with closing(SimulationBar(options.quiet)) as simulated:
        analysis = analyse(measured, progress=simulated)
    say("locating the misfit")
    analysis.locate()
    say("validating it on the held-out records")
    analysis.validate()
    say("choosing the next test and writing the report")
    document = analysis.report(options.out)
    for hint in document.get("sensor_hints", ()):
        say(hint)
    return document


def _measured(folder: Path, data: Path | None, progress: Callable[[int, int], None]) -> Any:
    """Read a campaign of a drive, or a rig of any other mechanism."""
    from pymoo_hdte.discrepancy import read_campaign, read_rig
    from pymoo_hdte.discrepancy._records.campaign_keys import CAMPAIGN_FILE
    from pymoo_hdte.discrepancy._records.rig_files import RIG_FILE

    if folder.name == CAMPAIGN_FILE and folder.is_file():
        folder = folder.parent
    if (folder / RIG_FILE).is_file() or folder.suffix == ".toml":
        return read_rig(folder, data, progress)
    if data is not None:
        raise InvalidInput("--data", str(data), f"none without a {RIG_FILE}")
    if folder.is_dir() and not (folder / CAMPAIGN_FILE).is_file():
        allowed = (
            f"a folder with {CAMPAIGN_FILE}, of a harmonic drive on a test bench with two encoders "
            f"and torque sensors, or {RIG_FILE}, of a robot's joint or any other machine"
        )
        raise InvalidInput("CAMPAIGN", str(folder), allowed)
    return read_campaign(folder, progress=progress)


def _believing(measured: Any, model: Path | None, sheet: Path | None) -> Any:
    """Return the measurements, with the model of a file as the nominal one."""
    from pymoo_hdte.discrepancy import Campaign, read_drive_model, read_mechanism_model

    of_drive = isinstance(measured, Campaign)
    if sheet is not None and (model is None or not of_drive):
        raise InvalidInput("--sheet", str(sheet), "none without --believed and a harmonic drive")
    if model is None:
        return measured
    read = read_drive_model(model, sheet) if of_drive else read_mechanism_model(model)
    return measured.believing(read)


DISCREPANCY = Command(
    "discrepancy",
    "find what a model lacks, and validate the corrected model",
    _DETAILS,
    _add_arguments,
    _run,
)
