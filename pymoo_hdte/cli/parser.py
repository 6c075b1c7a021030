"""Argument parser of the package and of its experiments, with errors in one line."""

from __future__ import annotations

import argparse
from typing import NoReturn

MISTAKE = 2
"""Exit code for input that the user can correct, as argparse has it."""


class OneLineParser(argparse.ArgumentParser):
    """Says what is wrong in one line; the usage is for ``--help``."""

    def error(self, message: str) -> NoReturn:
        """Print the line and exit with `MISTAKE`."""
        line = " ".join(message.split())
        self.exit(MISTAKE, f"{self.prog}: error: {line}; see {self.prog} --help\n")
