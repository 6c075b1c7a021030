"""Types and helpers that all commands of the command line share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from pymoo_hdte import __version__
from pymoo_hdte._reports.folder import PAGE_FILE

MISTAKE = 2
"""Exit code for input that the user can correct, as argparse has it."""
Say = Callable[[str], None]
"""Shows the user what is being done."""


class OneLineParser(argparse.ArgumentParser):
    """Parser whose errors are one line; the usage is for ``--help``."""

    def error(self, message: str) -> NoReturn:
        """Print the line and exit with `MISTAKE`."""
        line = " ".join(message.split())
        self.exit(MISTAKE, f"{self.prog}: error: {line}; see {self.prog} --help\n")


class Outcome(NamedTuple):
    """The result of a command: a document for JSON, and a few lines for the terminal."""

    document: dict[str, Any]
    summary: str


def heading(kind: str, sentences: Sequence[str], limits: Sequence[str]) -> dict[str, Any]:
    """Return the first fields of a command's document: format, version, sentences and limits."""
    return {
        "format": f"pymoo_hdte {kind}",
        "version": 1,
        "made_by": f"pymoo_hdte {__version__}",
        "sentences": list(sentences),
        "limits": list(limits),
    }


def outcome_of(document: dict[str, Any], out: Path) -> Outcome:
    """Return the outcome of a document that begins with a `heading`, naming the page in ``out``."""
    lines = [*document["sentences"], *document["limits"], f"Report: {out / PAGE_FILE}"]
    return Outcome(document, "\n".join(lines))


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes
    ----------
    name, summary : str
        The word on the command line, and what it does in a line.
    details : str
        Example, files and exit codes, shown below the options.
    add_arguments : callable
        Adds the options to the command's parser.
    run : callable
        Takes the parsed options and `Say`. Heavy modules are imported there, not before, so that
        ``--help`` need not wait for them. It raises `InvalidInput`, `ArithmeticError` (such as
        `UnstableDrive`) or OSError for what a user can mend, and then leaves nothing half-written.
    out : (str, str) or None
        Placeholder of ``--out`` in the help, and what it is; None for a command without output.
    """

    name: str
    summary: str
    details: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, Say], Outcome]
    out: tuple[str, str] | None = ("DIR", "folder for the report")
