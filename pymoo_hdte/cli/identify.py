"""``pymoo-hdte identify``: from bench records of prototypes to the values of a data sheet."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of
from pymoo_hdte.cli.drive_arguments import BUILT_IN_SHEET, read_description

_DETAILS = """example:
  pymoo-hdte identify bench/series-1 --out reports/series-1

RECORDS is a folder with one or more of these CSV files, each with columns prototype and repeat:
  torsion_loops.csv      torque_Nm, torsion_arcsec: input locked, 0 -> +T -> 0 -> -T -> 0   (K)
  no_load_bearing.csv    speed_r_min, torque_Nm: wave generator and flexible bearing alone  (B_in)
  no_load_complete.csv   the same of the whole drive, at the same speeds                    (B_fc)
  no_load_output.csv     the same of the output bearing, at its own speeds                  (B_out)
  errors.csv             one column SYMBOL_um for each error of a component         (Table 2)
DIR gets report.html, parameters.json and, with --datasheet, identified_sheet.toml: that data sheet
with the identified values in it; or identified_drive.toml, a catalogue page with its K1 to K3,
hysteresis loss and no-load torques as measured. An earlier report there is replaced, anything else
refused.
Exit codes: 0 identified; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("records", type=Path, metavar="RECORDS", help="folder of the CSV files")
    parser.add_argument(
        "--datasheet", metavar="DATASHEET", help=f"TOML file, or {BUILT_IN_SHEET}, to be filled in"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.cli.identification import identify_drive
    from pymoo_hdte.cli.identification_report import (
        FOLDER,
        check_filled_in,
        write_identification_report,
    )

    with FOLDER.held(options.out):
        sheet, page = None, None
        if options.datasheet is not None:
            described = read_description(options.datasheet)
            sheet, page = described.sheet, Path(options.datasheet) if described.page else None
        say("reading the records and fitting")
        identification = identify_drive(options.records)
        if sheet is not None:
            check_filled_in(identification, sheet)
        return outcome_of(
            write_identification_report(identification, sheet, options.out, page), options.out
        )


IDENTIFY = Command(
    "identify",
    "identify stiffness, damping and error statistics from bench records",
    _DETAILS,
    _add_arguments,
    _run,
)
