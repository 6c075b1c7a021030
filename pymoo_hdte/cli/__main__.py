"""Start of the command line, which ends quietly while the rest is imported; see `command_line`."""

from __future__ import annotations

import os
import sys

try:
    from pymoo_hdte._interrupts import ended_quietly
except KeyboardInterrupt:
    os._exit(130)


def console() -> int:
    """Run what the command line of this process asks for; return the exit code."""
    return ended_quietly("pymoo-hdte", main)


def main() -> int:
    """Run the command line and exit without a traceback."""
    from pymoo_hdte.cli.command_line import main as run

    return run()


if __name__ == "__main__":
    sys.exit(console())
