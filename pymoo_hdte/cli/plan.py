"""``pymoo-hdte plan``: tests that tell the effects apart, chosen before anything is measured."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say

_DETAILS = """example:
  pymoo-hdte plan joint.toml --limits bench.toml --out plans/joint

MODEL is a drive's model, such as revised_model.toml, with the data sheet MODEL_sheet.toml beside.
LIMITS says what the rig can do: speeds, loads, directions, channels, noise, number of records; the
page on the command line describes it. DIR gets report.html, plan.toml and plan.json; an earlier
plan there is replaced, anything else refused.
Exit codes: 0 there is a plan, and it says what no test separates; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="MODEL.toml", help="nominal model of a drive")
    parser.add_argument(
        "--limits", type=Path, required=True, metavar="LIMITS.toml", help="what can be measured"
    )
    parser.add_argument(
        "--sheet",
        type=Path,
        metavar="SHEET.toml",
        help="data sheet of the model; by default MODEL_sheet.toml beside it",
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.cli.plan_report import FOLDER, plan_table, write_plan
    from pymoo_hdte.discrepancy import plan_tests, read_drive_model, read_limits

    with FOLDER.held(options.out):
        model, limits = read_drive_model(options.model, options.sheet), read_limits(options.limits)
        say("computing what each effect would change in each possible test")
        plan = plan_tests(model, limits)
        document = write_plan(plan, model.name, options.out)
        return Outcome(document, "\n".join(plan_table(document, options.out)))


PLAN = Command(
    "plan",
    "choose tests that separate effects, before anything is measured",
    _DETAILS,
    _add_arguments,
    _run,
)
