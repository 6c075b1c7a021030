"""What an experiment is, and what each gets to work with."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from pymoo_hdte._comparing.setting import Setting, counted
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import Result


class ExtraMissing(RuntimeError):
    """An experiment needs a package of an extra that is not installed."""


def require(package: str, extra: str) -> None:
    """Refuse to go on without a package that comes with an extra; it is not imported.

    Raises
    ------
    ExtraMissing
        It is not installed.
    """
    if find_spec(package) is None:
        raise ExtraMissing(f"{package} is not installed: pip install '.[{extra}]'")


STATED = Setting()


@dataclass(frozen=True)
class Context:
    """What an experiment may use.

    Attributes
    ----------
    seeds
        Number of independent runs of every algorithm of the experiments that take it, with seeds
        from ``setting.first_seed`` on.
    out
        Folder of the results.
    campaign
        Runs jobs on the workers that the user allowed.
    full
        Whether to run long campaigns instead of reading their committed outcome.
    quick
        Whether to run a small version of those that have one.
    cases
        Which cases, counted from 1, of a full run of those that can be limited; None for all.
    setting
        What the comparisons of algorithms run, if not what the paper states.
    """

    seeds: int
    out: Path
    campaign: Campaign
    full: bool = False
    quick: bool = False
    cases: range | None = None
    setting: Setting = STATED

    @property
    def seeds_to_run(self) -> range:
        """The seeds of the experiments that take their number."""
        return range(self.setting.first_seed, self.setting.first_seed + self.seeds)

    def comparison_command(self, experiment: str) -> str:
        """Return the command for this setting of an experiment that compares algorithms."""
        return self.setting.command(f"python -m experiments {experiment}", self.seeds_to_run)

    def command(self, experiment: str) -> str:
        """Return the command for this extent of an experiment."""
        option = " --full" if self.full else " --quick" if self.quick else ""
        if self.full and self.cases is not None:
            option += f" --cases {counted(self.cases)}"
        return f"python -m experiments {experiment}{option}"


@dataclass(frozen=True)
class Experiment:
    """A module of this package with ``run(context: Context) -> Result``.

    Attributes
    ----------
    name
        What the command line calls it.
    module
        Where it stands, below ``experiments``.
    summary
        One line of the list of experiments.
    question
        What it answers; stands on its card and its page.
    by_default
        Whether it belongs to the set that runs when no name is given.
    reads_outcome
        Whether it shows the committed outcome of a long campaign, which ``--full`` runs.
    has_small_version
        Whether it takes ``--quick``.
    takes_cases
        Whether ``--cases`` limits its full run.
    takes_seeds
        Whether ``--seeds`` says how many runs it makes, and further options which; others have
        numbers of their own.
    """

    name: str
    module: str
    summary: str
    question: str
    by_default: bool = True
    reads_outcome: bool = False
    has_small_version: bool = False
    takes_cases: bool = False
    takes_seeds: bool = False

    def run(self, context: Context) -> Result:
        """Import the module and run it; nothing is imported for ``--list``.

        Raises
        ------
        ValueError
            If the result does not say what came out.
        """
        result: Result = import_module(f"experiments.{self.module}").run(context)
        if not result.answer:
            raise ValueError(f"{self.name}: the result has no answer, which its page begins with")
        return result

    def check(self, setting: Setting) -> None:
        """Refuse a setting that the experiment cannot run; for those that take seeds.

        Raises
        ------
        InvalidInput
            For a name that is unknown or does not fit, or a budget that cannot be spent.
        """
        import_module(f"experiments.{self.module}").check_setting(setting)
