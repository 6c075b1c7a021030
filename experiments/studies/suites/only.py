"""Runs of some algorithms only, of the protocol's stored parts.

``python -m experiments.studies.suites.only OUT NAME,NAME`` runs them in the order of the protocol
and keeps each in ``OUT/runs/ORIGIN``, where `gather` finds it and where a further call goes on;
``--missing`` passes over groups that are stored. So the rivals, which do not change, are run once,
and ours is run anew after each change.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

from experiments.runner.campaign import Campaign
from experiments.studies.suites.data import Outcome, stored
from experiments.studies.suites.jobs import BbobRun, SuiteRun
from experiments.studies.suites.peers import ON_SUITES
from experiments.studies.suites.protocol import STORED
from pymoo_hdte.checks import one_of


def groups_of(names: Sequence[str]) -> Iterable[list[SuiteRun] | list[BbobRun]]:
    """Return the groups of the stored protocol that are of these algorithms.

    Raises
    ------
    InvalidInput
        For a name that is none of an algorithm.
    """
    for name in names:
        one_of("NAME", name, [*ON_SUITES])
    for part in STORED:
        for group in part.groups():
            if group[0].algorithm in names:
                yield group


def main(arguments: Sequence[str] | None = None) -> None:
    """Run them, group by group."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.suites.only")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("names", metavar="NAME,NAME", help="of algorithms")
    parser.add_argument("--missing", action="store_true", help="only groups that are not stored")
    options = parser.parse_args(arguments)
    before = stored() if options.missing else Outcome()
    campaign = Campaign(options.out)
    for group in groups_of(options.names.split(",")):
        if not all(map(before.has, group)):
            campaign.run(group, f"{group[0].algorithm}: {group[0].key} and {len(group) - 1} more")


if __name__ == "__main__":
    main()
