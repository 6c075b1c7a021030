"""``pymoo-hdte example``: a folder with everything that the other commands take, to try them on."""

from __future__ import annotations

import argparse
from pathlib import Path

from pymoo_hdte.cli.command import Command, Outcome, Say

_DETAILS = """example:
  pymoo-hdte example my_gear
  pymoo-hdte identify my_gear/bench --datasheet my_gear/gear.toml --out my_gear/identified
  pymoo-hdte simulate my_gear/identified/identified_drive.toml --map --out my_gear/map
  pymoo-hdte plan my_gear/identified/identified_drive.toml --limits my_gear/limits.toml --out \\
    my_gear/plan
  pymoo-hdte discrepancy my_gear/campaign --believed my_gear/identified/identified_drive.toml \\
    --out my_gear/verdict
  pymoo-hdte decide my_gear/identified/identified_drive.toml --found \\
    my_gear/verdict/revised_model.toml --out my_gear/decision

FOLDER, which must be new or empty, gets gear.toml (a catalogue page of size 14, 20 or 25 to put
your figures into), limits.toml (what a rig can do, for plan), bench (for identify) and campaign
(for discrepancy). The records are computed, with noise, from a drive that differs from its
page within the usual scatter, and whose mesh stiffness varies, which the page does not say.
Exit codes: 0 written; 2 the folder is not empty."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder to write to")
    parser.add_argument(
        "--size", type=int, default=20, help="of the drive: 14, 20 or 25 (default 20)"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.cli.example_records import write_example

    say("computing the records")
    written = write_example(options.folder, options.size)
    sentences = [
        f"{options.folder}: {', '.join(written)}.",
        f"Put your figures into {options.folder / 'gear.toml'}; pymoo-hdte example --help says "
        "what to type next.",
    ]
    document = {"folder": str(options.folder), "files": written, "sentences": sentences}
    return Outcome(document, "\n".join(sentences))


EXAMPLE = Command(
    "example",
    "write a catalogue page, records and limits to try the other commands on",
    _DETAILS,
    _add_arguments,
    _run,
    out=None,
)
