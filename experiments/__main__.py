"""Start of the experiments, which ends quietly while the rest is imported; see `command_line`."""

from __future__ import annotations

import os
import sys

try:
    from pymoo_hdte._interrupts import ended_quietly
except KeyboardInterrupt:
    os._exit(130)


def main() -> int:
    """Run the experiments that the command line of this process asks for; return the exit code."""
    from experiments.command_line import main as run

    return run()


if __name__ == "__main__":
    sys.exit(ended_quietly("python -m experiments", main))
