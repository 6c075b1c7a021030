"""The swarms on suites of others, held-out ones first; see `protocol` for what is run."""

from __future__ import annotations

from experiments.runner.registry import Context
from experiments.runner.result import Result
from experiments.suites.data import NAME, outcome_for


def run(context: Context) -> Result:
    """Show what came out on the suites."""
    outcome = outcome_for(context)
    return Result(
        title="The swarms on suites of others",
        command=context.command(NAME),
        answer=f"{len(outcome.suites)} runs on suites, {len(outcome.bbob)} on bbob-biobj.",
        tables=(),
    )
