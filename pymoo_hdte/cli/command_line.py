"""Command line of the package; see ``pymoo-hdte --help``."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from pymoo_hdte import __version__
from pymoo_hdte._interrupts import INTERRUPTED
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.command import MISTAKE, OneLineParser
from pymoo_hdte.cli.decide import DECIDE
from pymoo_hdte.cli.discrepancy import DISCREPANCY
from pymoo_hdte.cli.example import EXAMPLE
from pymoo_hdte.cli.export import EXPORT
from pymoo_hdte.cli.identify import IDENTIFY
from pymoo_hdte.cli.init import INIT
from pymoo_hdte.cli.optimise import OPTIMISE
from pymoo_hdte.cli.plan import PLAN
from pymoo_hdte.cli.robust import ROBUST
from pymoo_hdte.cli.simulate import SIMULATE
from pymoo_hdte.cli.table7 import TABLE_7

COMMANDS = (
    *(ROBUST, EXAMPLE, OPTIMISE, SIMULATE, IDENTIFY, PLAN, INIT, DISCREPANCY, DECIDE),
    *(EXPORT, TABLE_7),
)
"""Commands in the order of the help."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for; return the exit code."""
    options = _parser().parse_args(arguments)
    try:
        # Progress is for a terminal only; a log file gets errors alone.
        shows_progress = sys.stderr.isatty() and not options.quiet
        outcome = options.command.run(options, _say if shows_progress else _silent)
        if options.json:
            _print(json.dumps(outcome.document, indent=1, ensure_ascii=False))
        elif not options.quiet:
            _print(outcome.summary)
    except BrokenPipeError:
        # Nobody reads on: no mistake, and nobody to tell.
        raise
    except (InvalidInput, ArithmeticError, OSError) as error:
        for line in _message(error).splitlines():
            print(f"pymoo-hdte: error: {line}", file=sys.stderr)
        return MISTAKE
    except KeyboardInterrupt as stopped:
        kept = str(stopped) or "nothing was written"
        print(f"pymoo-hdte: interrupted, {kept}", file=sys.stderr)
        return INTERRUPTED
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="pymoo-hdte",
        description="Robust design of simulators and of harmonic drives, and what a model lacks.",
        epilog="pymoo-hdte COMMAND --help shows options, an example and the files of a command.",
    )
    parser.add_argument("--version", action="version", version=f"pymoo-hdte {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        summary = command.summary
        subparser = commands.add_parser(
            command.name,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
            epilog=command.details,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        subparser.set_defaults(command=command)
        command.add_arguments(subparser)
        if command.out is not None:
            metavar, words = command.out
            subparser.add_argument("--out", type=Path, required=True, metavar=metavar, help=words)
        output = subparser.add_mutually_exclusive_group()
        output.add_argument("--json", action="store_true", help="print the result as JSON")
        output.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return parser


def _print(text: str) -> None:
    """Print to stdout, replacing characters it cannot show; flush, so that errors show here."""
    encoding = sys.stdout.encoding or "utf-8"
    print(text.encode(encoding, "replace").decode(encoding), flush=True)


def _say(what: str) -> None:
    print(f"{what} ...", file=sys.stderr, flush=True)


def _silent(what: str) -> None:
    pass


def _message(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)
