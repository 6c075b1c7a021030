"""Command line of the package; see ``pymoo-hdte --help``."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pymoo_hdte import __version__
from pymoo_hdte.checks import InvalidInput

MISTAKE = 2
"""Exit code for input that the user can correct, as argparse has it."""
INTERRUPTED = 130
"""Exit code that a shell expects of a program ended by Ctrl-C."""

_EXAMPLE = """example:
  pymoo-hdte discrepancy campaigns/rig-01 --out reports/rig-01

The campaign is a folder with campaign.toml and its records. DIR gets verdict.json,
revised_model.toml and report.html; an earlier report there is replaced, anything else refused.
Exit codes: 0 a verdict was reached, whatever it is; 2 the input is at fault."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for; return the exit code."""
    options = _parser().parse_args(arguments)
    try:
        document = _discrepancy(options.campaign, options.out)
    except (InvalidInput, OSError) as error:
        print(f"pymoo-hdte: error: {_message(error)}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt:
        print("pymoo-hdte: interrupted, nothing was written", file=sys.stderr)
        return INTERRUPTED
    if options.json:
        print(json.dumps(document, indent=1, ensure_ascii=False))
    elif not options.quiet:
        print(_summary(document, options.out))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pymoo-hdte", description="Robust design of harmonic drives, and what a model lacks."
    )
    parser.add_argument("--version", action="version", version=f"pymoo-hdte {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    command = commands.add_parser(
        "discrepancy",
        help="find where model and measurement disagree, name the effect and prove it",
        description="Find where model and measurement disagree, name what is missing and prove it.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("campaign", type=Path, metavar="CAMPAIGN", help="folder of the campaign")
    command.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for verdict and report"
    )
    output = command.add_mutually_exclusive_group()
    output.add_argument("--json", action="store_true", help="print verdict.json to stdout")
    output.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return parser


def _discrepancy(folder: Path, out: Path) -> dict[str, Any]:
    """Analyse a campaign and write its report; return the verdict's document."""
    # The workflow takes a second to import, which --help need not wait for.
    from threadpoolctl import threadpool_limits

    from pymoo_hdte.discrepancy import read_campaign
    from pymoo_hdte.discrepancy.locate import locate
    from pymoo_hdte.discrepancy.next_experiment import next_experiment
    from pymoo_hdte.discrepancy.prove import prove
    from pymoo_hdte.discrepancy.report import VERDICT_FILE, check_folder, write_report
    from pymoo_hdte.discrepancy.workflow import analyse

    check_folder(out)
    analysis = analyse(read_campaign(folder))
    with threadpool_limits(limits=1):
        written = write_report(
            analysis, locate(analysis), prove(analysis), next_experiment(analysis), out
        )
    document: dict[str, Any] = json.loads((written / VERDICT_FILE).read_text(encoding="utf-8"))
    return document


def _message(error: InvalidInput | OSError) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _summary(document: dict[str, Any], out: Path) -> str:
    from pymoo_hdte.discrepancy.effect_words import in_words

    names = " + ".join(f"{one['name']} at the {one['port']}" for one in document["effects"])
    lines = [
        f"{document['status']}{': ' + names if names else ''}",
        document["sentence"],
        document["location"]["sentence"],
        *document["limits"],
        f"Next: {in_words(document['next_experiment']['description'])}",
        f"Report: {out / 'report.html'}",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
