"""Draw docs/which_algorithm.png from the stored outcome of ``python -m experiments suites``."""

from pathlib import Path

from experiments.runner.committed import committed_file
from experiments.studies.suites.data import BBOB, NAME, read_outcome
from experiments.studies.suites.figures import how_to_choose

PICTURE = Path(__file__).with_name("which_algorithm.png")


def draw(target: Path = PICTURE) -> None:
    """Draw ranks over the budget and shares of targets."""
    outcome = read_outcome(*(committed_file(f"{name}.csv", NAME) for name in (NAME, BBOB)))
    how_to_choose(outcome).savefig(target, dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    draw()
