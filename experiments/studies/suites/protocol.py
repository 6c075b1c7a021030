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

First the parts (`PARTS`), on instance 10 and on validation: the swarm with one part left out. A
part is shown to help if the swarm without it is worse beyond chance (Wilcoxon's signed ranks over
problems, p < 0.05 after Holm over all rows of that table) by the share of targets after 500, 2,000
or 10,000 evaluations on instance 10 or by the hypervolume on LZ09 and RE together or on MW and
DAS-CMOP together. Parts that are not shown to help leave the swarm, the one that is missed least
(the largest sum of the mean gains without it) first, as long as the swarm without all that left is
nowhere worse than the whole one with p < 0.05, uncorrected, neither there nor by hypervolume on the
ZDT, moved ZDT and DTLZ2 of tuning after 2,000. Learned shares and the constraints' parts count as
parts. What remains is the swarm, and only then is it run on what follows.

What came of it at first: `Attraction` left (gains without it add up to +.018; nowhere worse), then
the tolerance of violations (+.003 alone; on MW and DAS-CMOP without both p = .15). There it was
ended, because time was over: guests, leaders, learned shares, `Exchange` and `Difference` were in
the swarm without being shown to help by themselves.

The rest of the rule, written down before any of it is run: the order follows from the stored table
of parts left out alone (guests -.014, learned shares -.025, `Exchange` -.037, `Difference` -.051,
several leaders -.093). Each is left out beside all that left before it, and the swarm is held
against the whole one on instance 10 after 500, 2,000 and 10,000 evaluations, on LZ09 and RE, and on
MW and DAS-CMOP after 10,000 with the seeds of the stored runs, and on ZDT, moved ZDT and DTLZ2
after 2,000 with ten seeds, by Wilcoxon's signed ranks over the problems, two-sided, uncorrected,
medians over the seeds. If the whole one is better anywhere with p < .05, the part stays, and the
next one is tried without those that left, and what else was to be run of it is not; else it leaves.
Without constraints, swarms that differ in the handling of constraints alone are run once.
`rule` does this and nothing else. What is left after the last one is the swarm. What came
of it: guests and `Difference` left; learned shares, `Exchange` and several leaders stay, because
without each of them and all that left the swarm is worse on MW and DAS-CMOP.

All this was decided with a normal approximation of the tests where some problems are equal. Later
the equal ones were dropped, as stated, and the p values of the page are those: several leaders are
then shown to help by themselves (p = .043), so that the rule does not come to them; what leaves and
what stays is the same.

Truncation: where the swarm that remains, with the truncation that keeps the ends of three
objectives (`most_hypervolume`), is worse with p < .05, uncorrected, than with that of the time of
the parts, on LZ09 and RE or on MW and DAS-CMOP by the same test as above, it goes back to that.
What came of it: it is better on the five problems of LZ09 and RE that differ (p = .06, the least
that five can give), on MW and DAS-CMOP better on two and worse on three (p = .31); it stays.

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

from experiments.studies.suites.bbob.coco import FUNCTIONS
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.peers import BBOB_PEERS, ON_SUITES, OURS, PEERS, takes
from experiments.studies.suites.problems import SUITES, TUNING, problem_of
from experiments.studies.suites.reduced import (
    CANDIDATES,
    LEFT,
    ON_CONSTRAINED,
    ON_PLAIN,
    SPREAD,
    WHOLE,
    without_all,
)

HELD_OUT, VALIDATION = ("ZCAT",), ("IMOP", "RE", "MW", "DAS-CMOP", "LZ09")
INSTANCES = (8, 9, 10)
OF_PARTS = 10
"""The instance on which parts are left out."""
BESIDE_PEERS = 9
"""The instance of bbob-biobj on which peers are run beside ours."""
DIMENSIONS = (10, 20)
BUDGETS = (500, 2000, 10_000, 25_000)

SHARES = {(10, 10_000): 0.38, (10, 25_000): 0.42, (20, 10_000): 0.34, (20, 25_000): 0.38}
"""Shares of targets that must be reached, by dimension and evaluations."""
RIVAL_ON_RE = "SMS-EMOA"
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
                taken = [one.name for one in SUITES[self.suite] if _takes(algorithm, one.name)]
                for budgets in ON_SUITES[algorithm].budgets_of_runs(self.budgets):
                    yield [SuiteRun(problem, algorithm, seed, budgets) for problem in taken]


def _takes(algorithm: str, problem: str) -> bool:
    return takes(algorithm, problem_of(problem))


@dataclass(frozen=True)
class BbobPart:
    """One algorithm, told some budgets, on problems of bbob-biobj."""

    algorithm: str
    told: tuple[int, ...]
    instances: tuple[int, ...] = INSTANCES
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
                for told in self.told:
                    for instance in self.instances:
                        yield [
                            BbobRun(function, dimension, instance, self.algorithm, told, seed)
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
SUITE_SEEDS = {"LZ09": 3, "RE": 5, "MW": 5, "DAS-CMOP": 5, TUNING: 10}

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
)
"""What is run of the swarm that remains, beside its peers."""


def where_parts_leave(name: str) -> Iterable[tuple[SuitePart | BbobPart, ...]]:
    """Yield what is tested together of the swarm of one name, in the order of the runs."""
    for suites in (CONSTRAINED, (TUNING,), PLAIN):
        budgets = BUDGETS[1:2] if suites == (TUNING,) else BUDGETS[2:3]
        yield tuple(SuitePart(one, (name,), budgets, SUITE_SEEDS[one]) for one in suites)
    yield (BbobPart(name, (10_000,), (OF_PARTS,)),)


_GUESTS, _SHARES, _EXCHANGE, _DIFFERENCE, _LEADERS = CANDIDATES
_GONE = (*LEFT, _GUESTS, _DIFFERENCE)
"""What left by the rule, in this order."""
_STAY = ((*_GONE[:3], _SHARES), (*_GONE[:3], _EXCHANGE), (*_GONE, _LEADERS))
"""Without what left and the last of each, the swarm is worse on constrained suites."""

LEAVING: tuple[SuitePart | BbobPart, ...] = (
    SuitePart(TUNING, (WHOLE, without_all(_GONE[:1])), BUDGETS[1:2], SUITE_SEEDS[TUNING]),
    *(part for gone in (_GONE[:2], _GONE[:3], *_STAY)
      for part in next(iter(where_parts_leave(without_all(gone))))),
    *(part for place in where_parts_leave(without_all(_GONE)) for part in place),
)  # fmt: skip
"""What the rule came to, beside `PARTS`; swarms alike without constraints are run once there."""

STORED = (*PARTS, *LEAVING, *BESIDE)
"""What is run for the stored outcome, in this order; of a run that is stopped, whole ``groups``.

It is smaller than was asked for: three to five seeds in place of 15, 25,000 evaluations on
bbob-biobj, IMOP and RE only, on bbob-biobj one run an instance and few algorithms beside ours.
"""

FULL: tuple[SuitePart | BbobPart, ...] = (
    *(BbobPart(name, BUDGETS if peer.starts_anew else BUDGETS[-1:], seeds=5)
      for name, peer in BBOB_PEERS.items() if name != "C-TAEA"),
    *(SuitePart(suite, WITHOUT_CONSTRAINTS, BUDGETS, seeds=15) for suite in ("ZCAT", "IMOP")),
    *(SuitePart(suite, WITHOUT_CONSTRAINTS, BUDGETS, seeds=15) for suite in ("RE", "LZ09")),
    *(SuitePart(suite, tuple(PEERS), BUDGETS, seeds=15) for suite in ("MW", "DAS-CMOP")),
)  # fmt: skip
"""The whole: 15 seeds (3 instances with 5 each), all peers, four budgets; some days of a core."""
