"""The stored outcome with some algorithms run anew, those that changed.

``python -m experiments.studies.suites.renew OUT "NAME;NAME"`` runs these on the stored parts of the
protocol, with ``--suites`` on some suites only, and writes the CSV files that the repository keeps;
all other runs stay. Finished runs lie in ``OUT/runs/ORIGIN``, from where a further call goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from experiments.runner.committed import DATA
from experiments.studies.suites.data import Outcome, stored, write_outcome
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.peers import ON_BBOB, ON_SUITES
from experiments.studies.suites.protocol import STORED, BbobPart, SuitePart
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import Cell, Column, Table
from pymoo_hdte.checks import one_of

COMMAND = "python -m experiments.studies.suites.renew; runs of unchanged algorithms are kept"


def renewed(
    campaign: Campaign,
    names: Collection[str],
    before: Outcome,
    suites: Collection[str] | None = None,
) -> Outcome:
    """Return new runs of some algorithms beside what another outcome has of the protocol.

    On all suites and bbob-biobj, or on ``suites`` only.

    Raises
    ------
    InvalidInput
        For a name that is none of an algorithm.
    """
    for name in names:
        one_of("NAME", name, [*ON_SUITES, *ON_BBOB])
    outcome = Outcome()
    for part in STORED:
        groups: Iterable[Sequence[SuiteRun | BbobRun]] = part.groups()
        reached = suites is None or (isinstance(part, SuitePart) and part.suite in suites)
        for group in groups:
            algorithm = group[0].algorithm
            if reached and algorithm in names:
                title = f"{algorithm}: {group[0].key} and {len(group) - 1} more"
                outcome.add(group, campaign.run(group, title))
            elif all(map(before.has, group)):
                for job in group:
                    outcome.take(job, before)
    return outcome


def kept_table(outcome: Outcome) -> Table:
    """Show of which parts of the stored protocol how many groups are there."""
    rows: list[tuple[Cell, ...]] = []
    for part in STORED:
        groups = [*part.groups()]
        whole = sum(all(map(outcome.has, group)) for group in groups)
        if isinstance(part, BbobPart):
            instances = ", ".join(map(str, part.instances))
            name, budgets = f"bbob-biobj, instance {instances}", part.told
        else:
            name, budgets = f"{part.suite}, {part.seeds} seeds", part.budgets
        who = (part.algorithm,) if isinstance(part, BbobPart) else part.algorithms
        budgets_of = ", ".join(f"{budget:,}" for budget in budgets)
        algorithms = ", ".join(who) if len(who) < 4 else f"{len(who)} algorithms"
        rows.append((name, algorithms, budgets_of, whole, len(groups)))
    columns = ("part", "algorithms", "evaluations", "kept", "of groups")
    return Table(
        "kept",
        "What was run of the stored protocol",
        tuple(Column(name) for name in columns),
        tuple(rows),
        note="A group is one algorithm with one seed on all functions of bbob-biobj of one "
        "dimension, instance and budget, or on all problems of a suite. What is missing was not "
        "run to its end: COMO-CMA-ES took all memory on IMOP3 after 25,000 evaluations. Every "
        "group that was whole is kept, no other choice was made. Runs of algorithms that did not "
        "change are kept from before.",
        folded=True,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run some algorithms anew and write the stored outcome."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.suites.renew")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("names", metavar="NAME;NAME", help="of algorithms, or all")
    parser.add_argument("--suites", metavar="SUITE,SUITE", help="only these")
    options = parser.parse_args(arguments)
    names = list(ON_SUITES) if options.names == "all" else options.names.split(";")
    suites = None if options.suites is None else options.suites.split(",")
    outcome = renewed(Campaign(options.out), names, stored(), suites)
    write_outcome(outcome, DATA, COMMAND)


if __name__ == "__main__":
    main()
