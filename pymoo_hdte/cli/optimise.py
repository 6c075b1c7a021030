"""``pymoo-hdte optimise``: from a data sheet to the design with the least and steadiest DTE."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of
from pymoo_hdte.cli.drive_arguments import DRIVE_DETAILS, add_drive_arguments, read_drive

_DETAILS = f"""example:
  pymoo-hdte optimise hs_20_100 --preference balanced --out reports/optimum

{DRIVE_DETAILS}
CYCLE.csv has the columns speed_rpm, load_Nm and weight.
DIR gets report.html, optimum.json, front.csv (all designs of the front), and the chosen drive as
optimum_sheet.toml and optimum_model.toml, which this command and simulate read; an earlier report
there is replaced, anything else refused.
Exit codes: 0 a design was chosen; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_drive_arguments(parser)
    parser.add_argument(
        "--preference",
        default="balanced",
        help="accuracy_first, balanced or robustness_first (default balanced)",
    )
    parser.add_argument("--cycle", type=Path, metavar="CYCLE.csv", help="duty cycle, averaged over")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.05,
        help="scatter of the parts around a design, as a share (default 0.05)",
    )
    parser.add_argument(
        "--box",
        type=float,
        default=0.25,
        help="how far a design may leave the data sheet, as a share (default 0.25)",
    )
    parser.add_argument("--order", type=int, default=3, help="of the surrogate (default 3)")
    parser.add_argument(
        "--evaluations", type=int, default=20_000, help="of the swarm, in hundreds (default 20000)"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers (default 1)")


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from tqdm import tqdm

    from pymoo_hdte.checks import one_of, whole_number
    from pymoo_hdte.cli.design_study import POPULATION, Progress, Settings, run_design_study
    from pymoo_hdte.cli.optimum_report import FOLDER, write_optimum_report
    from pymoo_hdte.decision import PREFERENCES
    from pymoo_hdte.problems import load_conditions

    FOLDER.check(options.out)
    preference = one_of("--preference", options.preference, tuple(PREFERENCES))
    evaluations = whole_number("--evaluations", options.evaluations, POPULATION)
    settings = Settings(
        tolerance=options.tolerance,
        box=options.box,
        order=options.order,
        conditions=load_conditions(options.cycle) if options.cycle is not None else None,
        evaluations=evaluations // POPULATION * POPULATION,
        seed=whole_number("--seed", options.seed, 0),
    )
    model, notes = read_drive(options)
    say("fitting the surrogate to the drive model, and optimising")
    # Without a terminal, or if quiet, there is no bar.
    silent = True if options.quiet else None
    with tqdm(total=settings.evaluations, unit="design", leave=False, disable=silent) as bar:
        study = run_design_study(model, preference, settings, Progress(bar))
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
