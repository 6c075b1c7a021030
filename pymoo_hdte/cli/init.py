"""``pymoo-hdte init``: from a folder of logs to a commented file that describes them."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say

_DETAILS = """example:
  pymoo-hdte init my_logs
  pymoo-hdte discrepancy my_logs --out my_logs/report
  pymoo-hdte init my_logs

The first call looks at the data files of the folder and writes rig.toml or, for records of a drive
on a bench with two encoders and two torques, campaign.toml, with a comment on every guess. It never
replaces a file. Once there is a verdict in a folder below, a second call proposes what to add.
Exit codes: 0 done; 2 the input is at fault."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the logs")


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.discrepancy._records.drafts.draft import write_draft
    from pymoo_hdte.discrepancy._report.proposals import described, proposals

    if described(options.folder) is not None:
        say("reading the verdict")
        document = proposals(options.folder)
        return Outcome(document, "\n".join(document["sentences"]))
    say("looking at the files")
    draft = write_draft(options.folder)
    return Outcome(draft.document, "\n".join(draft.document["sentences"]))


INIT = Command(
    "init",
    "look at a folder of logs and write a commented file that describes them",
    _DETAILS,
    _add_arguments,
    _run,
    out=None,
)
