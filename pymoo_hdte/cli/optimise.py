"""``pymoo-hdte optimise``: from a data sheet to the design with the least and steadiest DTE."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of
from pymoo_hdte.cli.drive_arguments import DRIVE_DETAILS, add_drive_arguments, read_drive

LEAST_DESIGNS = 40
"""Designs below which nothing could be said between them."""

_DETAILS = f"""example:
  pymoo-hdte optimise hs_20_100 --preference balanced --out reports/optimum

{DRIVE_DETAILS}
CYCLE.csv has the columns speed_rpm, load_Nm and weight.
DIR gets report.html, optimum.json, front.csv (all designs of the front), and the chosen drive as
optimum_sheet.toml and optimum_model.toml, which this command and simulate read; an earlier report
there is replaced, anything else refused. The front is that of the drive model; where that could
not be shown to 5 % of its width, the first sentence says so, and no drive is chosen.
Exit codes: 0 a report was written; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_drive_arguments(parser)
    parser.add_argument(
        "--preference",
        default="balanced",
        help="accuracy_first, balanced or robustness_first (default balanced)",
    )
    parser.add_argument(
        "--cycle", type=Path, metavar="CYCLE.csv", help="duty cycle to average over"
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.05,
        help="relative scatter of the parts around a design (default 0.05)",
    )
    parser.add_argument(
        "--box",
        type=float,
        default=0.25,
        help="relative distance of designs from the data sheet (default 0.25)",
    )
    parser.add_argument(
        "--designs",
        type=int,
        default=600,
        help="designs that the search may compute by the drive model (default 600)",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="seed of the random numbers (default 1)"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from tqdm import tqdm

    from pymoo_hdte.checks import one_of, whole_number
    from pymoo_hdte.cli.design_study import Settings, run_design_study
    from pymoo_hdte.cli.optimum_report import FOLDER, write_optimum_report
    from pymoo_hdte.decision import PREFERENCES
    from pymoo_hdte.problems import load_conditions

    with FOLDER.held(options.out):
        preference = one_of("--preference", options.preference, tuple(PREFERENCES))
        settings = Settings(
            tolerance=options.tolerance,
            box=options.box,
            conditions=load_conditions(options.cycle) if options.cycle is not None else None,
            designs=whole_number("--designs", options.designs, LEAST_DESIGNS),
            seed=whole_number("--seed", options.seed, 0),
        )
        model, _, notes = read_drive(options)
        say("searching the front on the drive model")
        # Without a terminal, or if quiet, there is no bar.
        silent = True if options.quiet else None
        with tqdm(unit="design", leave=False, disable=silent) as bar:

            def notify(evaluated: int, difference: float) -> None:
                if math.isfinite(difference):
                    bar.set_postfix_str(f"front known to {100.0 * difference:.1f} % of its width")
                bar.update(evaluated - bar.n)

            study = run_design_study(model, preference, settings, notify)
        say("writing the report")
        document = write_optimum_report(study, notes, options.out)
        return outcome_of(document, options.out)


OPTIMISE = Command(
    "optimise",
    "find the design with the least and steadiest transmission error",
    _DETAILS,
    _add_arguments,
    _run,
)
