"""What a comparison of algorithms runs: what the paper states, or something else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pymoo_hdte.checks import InvalidInput


@dataclass(frozen=True)
class Setting:
    """Problems, algorithms, first seed and budget; by default those of Section 5.1.

    Attributes
    ----------
    problems, algorithms
        Names; without algorithms, those of the table that is asked for.
    first_seed
        The others follow it.
    population, evaluations
        Of every run.

    Raises
    ------
    InvalidInput
        If a name comes twice, or if the evaluations are no whole number of generations.
    """

    problems: tuple[str, ...] = ("calibrated", "resonant")
    algorithms: tuple[str, ...] = ()
    first_seed: int = 1
    population: int = 100
    evaluations: int = 10_000

    def __post_init__(self) -> None:
        for option, names in (("--problems", self.problems), ("--algorithms", self.algorithms)):
            if len(set(names)) < len(names):
                raise InvalidInput(option, ",".join(names), "every name once")
        if self.evaluations % self.population:
            allowed = f"a multiple of the population (--pop {self.population})"
            raise InvalidInput("--evaluations", self.evaluations, allowed)

    @property
    def generations(self) -> int:
        """Generations of a population that spend the evaluations."""
        return self.evaluations // self.population

    @property
    def is_stated(self) -> bool:
        """Whether the paper's numbers may stand beside the outcome: other seeds do not matter."""
        return not list(self.differences())

    def differences(self) -> Iterator[str]:
        """Say what differs from the setting that the paper states, and from its problems."""
        stated = Setting()
        if self.problems != stated.problems:
            instead = " and ".join(stated.problems)
            yield f"problems {', '.join(self.problems)} instead of {instead}"
        if self.algorithms:
            yield f"algorithms {', '.join(self.algorithms)} instead of those of the paper"
        if self.population != stated.population:
            yield f"a population of {self.population} instead of {stated.population}"
        if self.evaluations != stated.evaluations:
            yield f"{self.evaluations:,} evaluations instead of {stated.evaluations:,}"

    def options(self) -> list[str]:
        """Return the options of the command line that say so."""
        stated, given = Setting(), []
        if self.evaluations != stated.evaluations:
            given += ["--evaluations", str(self.evaluations)]
        if self.population != stated.population:
            given += ["--pop", str(self.population)]
        if self.problems != stated.problems:
            given += ["--problems", ",".join(self.problems)]
        if self.algorithms:
            given += ["--algorithms", ",".join(self.algorithms)]
        return given

    def command(self, program: str, seeds: range) -> str:
        """Return the command line by which a program runs this with these seeds."""
        return " ".join([program, "--seeds", counted(seeds), *self.options()])


def counted(numbers: range) -> str:
    """Return a range as the command line takes it."""
    start, end = numbers[0], numbers[-1]
    return f"{end}" if start == 1 else f"{start}-{end}"


def in_words(seeds: range) -> str:
    """Return the seeds for a sentence."""
    start, end = seeds[0], seeds[-1]
    return f"seeds {start} to {end}" if start < end else f"seed {start}"
