"""``pymoo-hdte decide``: what to change in a drive, what it would bring, what to measure first."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of

_DETAILS = """example:
  pymoo-hdte decide my_gear/gear.toml --out my_gear/decision
  pymoo-hdte decide my_gear/gear.toml --found my_gear/verdict/revised_model.toml --out my_gear/next

GEAR is a catalogue page. Wall thickness, preload, and the tolerance classes of cam and teeth are
tried; formulas say what each does to stiffness, friction and errors of the parts, and the page has
them. --found adds the effects that a verdict found and the page lacks.
DIR gets report.html (one page to print), decision.json and levers.csv; an earlier report there is
replaced, anything else refused.
Exit codes: 0 a report was written; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("gear", metavar="GEAR.toml", help="catalogue page")
    parser.add_argument(
        "--found", type=Path, metavar="MODEL.toml", help="revised model of a verdict"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.checks import InvalidInput
    from pymoo_hdte.cli.decision import decide, found_effects
    from pymoo_hdte.cli.decision_report import FOLDER, write_decision
    from pymoo_hdte.cli.drive_arguments import read_description, remarks_on_estimates
    from pymoo_hdte.discrepancy import read_drive_model

    with FOLDER.held(options.out):
        page = read_description(options.gear).page
        if page is None:
            raise InvalidInput("GEAR.toml", options.gear, "a file with [catalogue]")
        found = (
            () if options.found is None else found_effects(read_drive_model(options.found), page)
        )
        say("trying what can be changed")
        decision = decide(page, found)
        notes = remarks_on_estimates(page)
        return outcome_of(write_decision(decision, notes, options.out), options.out)


DECIDE = Command(
    "decide",
    "say what to change in a drive, what it would bring and what to measure first",
    _DETAILS,
    _add_arguments,
    _run,
)
