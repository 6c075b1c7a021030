"""Which experiments there are, and what each gets to work with."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from experiments.runner.campaign import Campaign
from experiments.runner.result import Result
from experiments.runner.setting import Setting


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

    @property
    def seeds_in_words(self) -> str:
        """The seeds for a title."""
        first, last = self.seeds_to_run[0], self.seeds_to_run[-1]
        return f"seeds {first} to {last}" if first < last else f"seed {first}"

    def comparison_command(self, experiment: str) -> str:
        """Return the command for this setting of an experiment that compares algorithms."""
        options = " ".join(["--seeds", _counted(self.seeds_to_run), *self.setting.options()])
        return f"python -m experiments {experiment} {options}"

    def command(self, experiment: str) -> str:
        """Return the command for this extent of an experiment."""
        option = " --full" if self.full else " --quick" if self.quick else ""
        if self.full and self.cases is not None:
            option += f" --cases {_counted(self.cases)}"
        return f"python -m experiments {experiment}{option}"


def _counted(numbers: range) -> str:
    """Return a range as the command line takes it."""
    first, last = numbers[0], numbers[-1]
    return f"{last}" if first == 1 else f"{first}-{last}"


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
    by_default: bool = True
    reads_outcome: bool = False
    has_small_version: bool = False
    takes_cases: bool = False
    takes_seeds: bool = False

    def run(self, context: Context) -> Result:
        """Import the module and run it; nothing is imported for ``--list``."""
        return import_module(f"experiments.{self.module}").run(context)

    def check(self, setting: Setting) -> None:
        """Refuse a setting that the experiment cannot run; for those that take seeds.

        Raises
        ------
        InvalidInput
            For a name that is unknown or does not fit, or a budget that cannot be spent.
        """
        import_module(f"experiments.{self.module}").check_setting(setting)


EXPERIMENTS = (
    Experiment(
        "table7",
        "paper.table7",
        "Table 7 and Fig. 18: AMP-MOPSO against MOPSO and NSGA-II",
        takes_seeds=True,
    ),
    Experiment(
        "ablation",
        "paper.ablation",
        "Fig. 17: AMP-MOPSO without its pyramid, its entropy weight, or both",
        takes_seeds=True,
    ),
    Experiment(
        "anytime",
        "anytime.experiment",
        "Table 7 and Fig. 17 at every budget, and what the printed numbers may mean",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "table5",
        "paper.table5",
        "Table 5 and Fig. 11: accuracy of the Chebyshev surrogate by order",
    ),
    Experiment(
        "table8",
        "paper.table8",
        "Tables 8 and 9, Fig. 19: the designs that three preferences choose",
    ),
    Experiment(
        "published",
        "paper.published",
        "What Eq. (9) gives as printed, order by order, beside an integrator",
    ),
    Experiment(
        "table2", "paper.table2", "Table 2, Figs. 4 and 5: error statistics and the static error"
    ),
    Experiment(
        "table3",
        "paper.table3",
        "Tables 3 and 4, Figs. 9 and 10: stiffness and damping from records",
    ),
    Experiment("fig12", "paper.fig12", "Fig. 12: distribution of the DTE at the nominal design"),
    Experiment(
        "table6", "paper.table6", "Table 6, Figs 14 and 15: five prototypes, predicted and measured"
    ),
    Experiment(
        "sensitivity",
        "studies.sensitivity",
        "Sobol indices of the DTE: which tolerance deserves money",
    ),
    Experiment(
        "crosscheck",
        "studies.crosscheck",
        "chaospy beside ours, and accuracy per model run: is 1024 needed?",
    ),
    Experiment(
        "dte_map",
        "studies.dte_map",
        "DTE over input speed and load, with the resonances of each preset",
    ),
    Experiment(
        "calibration",
        "paper.calibrating.experiment",
        "Which effects the printed equations lack: a ladder of fitted models",
        reads_outcome=True,
    ),
    Experiment(
        "blind",
        "blind.experiment",
        "Blind campaigns: what the discrepancy workflow finds of what is hidden",
        reads_outcome=True,
        takes_cases=True,
    ),
    Experiment(
        "sealed_rigs",
        "measured.sealed_rigs",
        "Verdicts on fourteen rigs whose truth is not known here",
        reads_outcome=True,
    ),
    Experiment(
        "real",
        "measured.real",
        "Machines that others measured: verdicts beside known answers and other tools",
        reads_outcome=True,
    ),
    Experiment(
        "emps", "measured.emps", "EMPS: friction of a positioning system, measured by others"
    ),
    Experiment(
        "kinova",
        "measured.kinova",
        "Kinova Gen3: friction and ripple of a robot joint, measured by others",
    ),
    Experiment(
        "peers",
        "contest.peers",
        "The elitist swarm against the best algorithms of other libraries",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "cards",
        "cards.experiment",
        "Problem cards: what makes each robust problem hard, and which separate algorithms",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "swarm_parts",
        "contest.swarm_parts",
        "What each part of the elitist swarm is worth",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "robust",
        "robust.experiment",
        "Model runs of a robust surrogate, beside chaospy and OpenTURNS",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "reliability",
        "reliability.experiment",
        "Ten thousand wrong inputs, kills at any moment, full disks, memory",
        reads_outcome=True,
        has_small_version=True,
    ),
    Experiment(
        "benchmark",
        "studies.benchmark",
        "Speed ratios and agreement with integration",
        by_default=False,
    ),
    Experiment(
        "reference_front",
        "fronts.reference_front",
        "The true fronts of the surrogates, computed anew and compared: 35 minutes",
        by_default=False,
    ),
    Experiment(
        "direct_front",
        "fronts.direct_front",
        "The front of the drive model itself, found twice, on a finer quadrature too: 5 minutes",
        by_default=False,
    ),
)
"""In the order in which they run and are reported."""
