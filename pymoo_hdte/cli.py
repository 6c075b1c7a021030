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

The campaign is a folder with campaign.toml and its records, of a harmonic drive, or with rig.toml
and its records, of any other mechanism. DIR gets verdict.json, revised_model.toml and report.html;
an earlier report there is replaced, anything else refused.
Exit codes: 0 a verdict was reached, whatever it is; 2 the input is at fault."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for; return the exit code."""
    options = _parser().parse_args(arguments)
    try:
        document = _discrepancy(options.campaign, options.out, options.data)
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
    command.add_argument(
        "--data", type=Path, metavar="DIR", help="folder of the records that rig.toml names"
    )
    output = command.add_mutually_exclusive_group()
    output.add_argument("--json", action="store_true", help="print verdict.json to stdout")
    output.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return parser


def _discrepancy(folder: Path, out: Path, data: Path | None) -> dict[str, Any]:
    """Analyse a campaign or a rig and write its report; return the verdict's document."""
    # The workflow takes a second to import, which --help need not wait for.
    from pymoo_hdte.discrepancy.report_folder import check_folder
    from pymoo_hdte.measured.rig_files import RIG_FILE

    check_folder(out)
    if (folder / RIG_FILE).is_file() or folder.suffix == ".toml":
        return _of_mechanism(folder, out, data)
    if data is not None:
        raise InvalidInput("--data", str(data), f"none without a {RIG_FILE}")
    return _of_drive(folder, out)


def _of_mechanism(folder: Path, out: Path, data: Path | None) -> dict[str, Any]:
    from threadpoolctl import threadpool_limits

    from pymoo_hdte.measured import investigate
    from pymoo_hdte.measured.report import write_measured_report
    from pymoo_hdte.measured.rig_files import read_rig

    rig = read_rig(folder, data)
    with threadpool_limits(limits=1):
        finding = investigate(rig.mechanism, rig.records, rig.cutoff, rig.effects)
        return write_measured_report(rig.title, finding, out)


def _of_drive(folder: Path, out: Path) -> dict[str, Any]:
    from threadpoolctl import threadpool_limits

    from pymoo_hdte.discrepancy import read_campaign
    from pymoo_hdte.discrepancy.locate import locate
    from pymoo_hdte.discrepancy.next_experiment import next_experiment
    from pymoo_hdte.discrepancy.prove import prove
    from pymoo_hdte.discrepancy.report import write_report
    from pymoo_hdte.discrepancy.report_folder import VERDICT_FILE
    from pymoo_hdte.discrepancy.workflow import analyse

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

    names = " + ".join(_name(one) for one in document["effects"])
    lines = [
        f"{document['status']}{': ' + names if names else ''}",
        document["sentence"],
        document["location"]["sentence"],
        *document["limits"],
        f"Next: {in_words(document['next_experiment']['description'])}",
        f"Report: {out / 'report.html'}",
    ]
    return "\n".join(lines)


def _name(effect: dict[str, Any]) -> str:
    if effect["name"] == "parameter":
        return str(effect["port"]).replace("_", " ")
    return f"{effect['name']} at the {effect['port']}"


if __name__ == "__main__":
    sys.exit(main())
