"""What is run: written and committed before the first run on what is held out.

Sets of problems:

- tuning, on which settings may be chosen: ZDT, moved ZDT and DTLZ2 of ``peers``, and functions 1 to
  20 of bbob-biobj, instances 1 and 2, in 5, 10 and 20 dimensions, on which `ModelStep` was chosen;
- validation, whose outcomes led to the demands: RE, MW, DAS-CMOP, LZ09; on MW it was chosen, after
  the first run of this protocol, that `ModelStep` takes no part with constraints; and instance 10
  of bbob-biobj, on which the parts were chosen; IMOP;
- held out: bbob-biobj, all 55 functions, instance 9, in 10 and 20 dimensions, functions 1 to 20 of
  which are those of tuning in other instances; ZCAT1 to ZCAT20 with two and with three objectives,
  thirty variables, complicated Pareto sets, no bias, levels of difficulty 1 to 4 in turn, the
  others being flat (`formulas.zcat`), of which nothing was ever run. Instances 3 to 9 and IMOP had
  been looked at with earlier swarms; nothing was chosen on these instances. IMOP is validation
  since it showed how truncation by hypervolume loses parts of a front of three objectives.

Settings: all algorithms with the defaults of their libraries and a population of 100; MOEA/D-DE
with those of Li and Zhang, GDE3 with F = CR = 0.5, COMO-CMA-ES with 10 kernels and a first step of
a fifth of the box of first positions. `CompactSwarm()` as it is; without constraints it moves alike
whatever its budget, so that on bbob-biobj one run to 25,000 evaluations is read at all budgets.

First the parts (`PARTS`), on instance 10 and on validation: the swarm that had all parts it was
tried with, and with one left out. A part is shown to help if the swarm without it is worse beyond
chance (Wilcoxon's signed ranks over problems, p < 0.05 after Holm over all rows of that table) by
the share of targets after 500, 2,000 or 10,000 evaluations on instance 10 or by the hypervolume on
LZ09 and RE together or on MW and DAS-CMOP together. Of the others `Attraction`, the tolerance of
violations, guests and `Difference` left the swarm, one after another, because without them it was
nowhere worse; learned shares, `Exchange` and several leaders stay.

Beside peers, then, written down before any of ZCAT is run: ours, `ElitistSwarm`, NSGA-II, SMS-EMOA
and CMOPSO on ZCAT after 500, 2,000, 10,000 and 25,000 evaluations, with seed 1, and with seeds 2
and 3 if there is time for all five; ours alone anew on instance 9, IMOP, RE, MW, DAS-CMOP and LZ09,
which have been looked at before, beside the stored runs of peers. A first run of an earlier swarm
on instance 11 was void: cocoex 2.8 has 1.0 in place of the best known hypervolume for every problem
of an instance above 10, so that targets there are further off, for any algorithm (NSGA-II as well
reaches fewer). `coco` refuses these instances. All held-out suites together are ranked on all
problems of ZCAT and of instance 9, by the hypervolume and by the share of targets, which is a
measure of hypervolume; IGD+ needs a front, which bbob-biobj has not. The two measures have no
common unit, so that each rival is tested by the signs of the differences, corrected after Holm.

A run is kept as long as its algorithm does not change, and compared on the seeds that ours ran
with too. COMO-CMA-ES, which took all 24 GB of memory on IMOP3 after 25,000, has its share there
left out.

A further suite, held out, and chosen and written down before anything of it was run: DF1 to DF14
without DF12 at two fixed times (`formulas.df`), ten variables, two and three objectives, after 500,
2,000, 10,000 and 25,000 evaluations. Ours, `ElitistSwarm`, and NSGA-II, SMS-EMOA and AGE-MOEA-II
twice each: with 100 individuals and what these hold at the end, and with as many individuals as
ours has for the budget (`compact.size_for`) and the front of all that was evaluated. Seed 1 for
all, then seeds 2 to 5 as far as the time of the processor goes, a seed only if all eight have it.
Judged as ZCAT is: average ranks of the medians by the hypervolume and by IGD+, and Wilcoxon's test
over the 26 problems, after Holm over the seven rivals of a budget. It is run once. The time was
enough for seed 1. Later, before any of it was run: seeds 2 to 5 after 500 and 2,000 evaluations.
The time was enough for seed 2.

Beside the best published on bbob-biobj, written down before its run: ours as it is on instance 8,
of which no run was ever stored and which today's swarm has not seen; 3 to 9 were looked at with
earlier ones, nothing was chosen on them, and later ones have no targets. All 55 functions in 10 and
20 dimensions, one run to 25,000 evaluations, run once. Asked: a mean share not below that of
HMO-CMA-ES (`bbob_tables.CITED`) by more than 0.01 at any of the four budgets in either dimension,
and above it in the mean of the eight. Beside it NSGA-II with as many individuals as ours has for
the budget, at all four, and SMS-EMOA and AGE-MOEA-II so sized after 500 and 2,000: longer runs of
these would take more than the 25 minutes of a core that are allowed. COCO's logger is everybody's
archive. The time was enough for NSGA-II to 10,000.

Seeds count from 1. On bbob-biobj each instance is one run, as with COCO, from first positions in
[-5, 5] in the box [-100, 100] that the suite states.

Indicators: on bbob-biobj the share of COCO's 58 targets, every evaluation counted. Elsewhere the
hypervolume up to 1.1 in normalised objectives and, where the front is known in closed form, IGD+,
of at most 100 solutions. Ranks are those of medians over the seeds; tests are Wilcoxon's signed
ranks over problems, corrected after Holm.

Demands, besides: own time per generation at most half of NSGA-II's, which
``python -m experiments.studies.suites.own_time`` measures.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from experiments.studies.suites.coco import FUNCTIONS
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.peers import (
    OF_OUR_SIZE,
    ON_SUITES,
    OURS,
    PEERS,
    RIVALS,
    SIZED,
    takes,
)
from experiments.studies.suites.problems import SUITES, problem_of
from experiments.studies.suites.reduced import ON_CONSTRAINED, ON_PLAIN, SPREAD, WHOLE

HELD_OUT, VALIDATION = ("ZCAT",), ("IMOP", "RE", "MW", "DAS-CMOP", "LZ09")
OF_PARTS = 10
"""The instance on which parts are left out."""
BESIDE_PEERS = 9
"""The instance of bbob-biobj on which peers are run beside ours."""
BESIDE_BEST = 8
"""The instance that no earlier run was stored of, to set ours beside the best published."""
DIMENSIONS = (10, 20)
BUDGETS = (500, 2000, 10_000, 25_000)

LARGEST_SHORTFALL = 0.01
"""By how much a share of targets may lie below a published one, which is read to some .01."""
RIVAL_ON_RE = "SMS-EMOA"
BOTH_SIZES = "DF"
"""The held-out suite on which rivals are also of our size, with an archive of all they found."""
FEASIBLE_RIVALS = ("NSGA-II", "C-TAEA")
"""Those than which ours must not be feasible in fewer runs on MW and DAS-CMOP."""


@dataclass(frozen=True)
class SuitePart:
    """Some algorithms on a suite; slow ones may have fewer budgets in a part of their own."""

    suite: str
    algorithms: tuple[str, ...]
    budgets: tuple[int, ...]
    seeds: int

    def jobs(self) -> Iterable[SuiteRun]:
        """Return the runs, by seed, algorithm, problem."""
        return (job for group in self.groups() for job in group)

    def groups(self) -> Iterable[list[SuiteRun]]:
        """Return what is stored together or not at all: an algorithm with a seed, all problems.

        One that starts anew for each budget has a group for each.
        """
        for seed in range(1, self.seeds + 1):
            for algorithm in self.algorithms:
                taken = [
                    problem.name
                    for problem in SUITES[self.suite]
                    if _takes(algorithm, problem.name)
                ]
                for budgets in ON_SUITES[algorithm].budgets_of_runs(self.budgets):
                    yield [SuiteRun(problem, algorithm, seed, budgets) for problem in taken]


def _takes(algorithm: str, problem: str) -> bool:
    return takes(algorithm, problem_of(problem))


@dataclass(frozen=True)
class BbobPart:
    """One algorithm, told some budgets, on problems of bbob-biobj."""

    algorithm: str
    told: tuple[int, ...]
    instances: tuple[int, ...]
    functions: tuple[int, ...] = tuple(FUNCTIONS)
    dimensions: tuple[int, ...] = DIMENSIONS
    seeds: int = 1

    def jobs(self) -> Iterable[BbobRun]:
        """Return the runs."""
        return (job for group in self.groups() for job in group)

    def groups(self) -> Iterable[list[BbobRun]]:
        """Return what is stored together or not at all: all functions of an instance."""
        for seed in range(1, self.seeds + 1):
            for dimension in self.dimensions:
                for budget in self.told:
                    for instance in self.instances:
                        yield [
                            BbobRun(function, dimension, instance, self.algorithm, budget, seed)
                            for function in self.functions
                        ]


WITHOUT_CONSTRAINTS = tuple(name for name in PEERS if name != "C-TAEA")
SLOW = ("MOEA/D-DE",)
"""Those that take milliseconds an evaluation: budgets up to 2,000 in what is stored."""
QUICK_ENOUGH = tuple(name for name in WITHOUT_CONSTRAINTS if name not in SLOW)

BESIDE_OURS = ("NSGA-II", "SMS-EMOA", "ElitistSwarm")
"""Peers on all held-out suites, to 25,000. They move alike whatever their budget."""
FURTHER = tuple(name for name in QUICK_ENOUGH if name not in (OURS, *BESIDE_OURS))
"""Those that are run last, as far as the time of the processor goes."""

PLAIN, CONSTRAINED = ("LZ09", "RE"), ("MW", "DAS-CMOP")
"""Suites on which parts are left out, beside bbob-biobj."""
SUITE_SEEDS = {"LZ09": 3, "RE": 5, "MW": 5, "DAS-CMOP": 5}

PARTS: tuple[SuitePart | BbobPart, ...] = (
    *(BbobPart(name, (10_000,), (OF_PARTS,)) for name in (WHOLE, *ON_PLAIN)),
    *(SuitePart(suite, (WHOLE, *ON_CONSTRAINED), (10_000,), SUITE_SEEDS[suite])
      for suite in CONSTRAINED),
    *(SuitePart(suite, (WHOLE, *ON_PLAIN), (10_000,), SUITE_SEEDS[suite]) for suite in PLAIN),
)  # fmt: skip
"""What decides which parts the swarm has."""

BESIDE: tuple[SuitePart | BbobPart, ...] = (
    BbobPart(OURS, BUDGETS[-1:], (BESIDE_PEERS,)),
    SuitePart("ZCAT", (OURS, *BESIDE_OURS, "CMOPSO"), BUDGETS, seeds=3),
    SuitePart("IMOP", QUICK_ENOUGH, (500, 2000, 10_000), seeds=3),
    SuitePart("IMOP", (OURS, *BESIDE_OURS), (25_000,), seeds=3),
    SuitePart("RE", (OURS, "ElitistSwarm", "NSGA-II", "SMS-EMOA"), BUDGETS, seeds=5),
    SuitePart("DAS-CMOP", (OURS, "ElitistSwarm", "NSGA-II", "C-TAEA"), (10_000,), seeds=5),
    SuitePart("MW", (OURS, "ElitistSwarm", "NSGA-II", "C-TAEA"), (10_000,), seeds=5),
    SuitePart("LZ09", (OURS, "ElitistSwarm", "NSGA-II", "SMS-EMOA"), (10_000,), seeds=3),
    SuitePart("IMOP", (SPREAD,), BUDGETS, seeds=3),
    SuitePart("IMOP", SLOW, (500, 2000), seeds=3),
    *(BbobPart(name, BUDGETS[-1:], (BESIDE_PEERS,)) for name in BESIDE_OURS),
    SuitePart("IMOP", FURTHER, (25_000,), seeds=3),
    BbobPart("CMOPSO", BUDGETS[-1:], (BESIDE_PEERS,)),
    SuitePart(BOTH_SIZES, (OURS, "ElitistSwarm", *RIVALS, *OF_OUR_SIZE), BUDGETS, seeds=1),
    BbobPart(OURS, BUDGETS[-1:], (BESIDE_BEST,)),
    SuitePart(BOTH_SIZES, (OURS, "ElitistSwarm", *RIVALS, *OF_OUR_SIZE), BUDGETS[:2], seeds=5),
    *(BbobPart(name, BUDGETS if name == "NSGA-II" + SIZED else BUDGETS[:2], (BESIDE_BEST,))
      for name in OF_OUR_SIZE),
)  # fmt: skip
"""What is run of the swarm that remains, beside its peers."""

STORED = (*PARTS, *BESIDE)
"""What is run for the stored outcome, in this order; of a run that is stopped, whole ``groups``.

It is smaller than was asked for: three to five seeds in place of 15, 25,000 evaluations on
bbob-biobj, IMOP and RE only, on bbob-biobj one run an instance and few algorithms beside ours.
"""
