"""CPU time of verdicts on drive campaigns, measured now, and the most that is allowed."""

from __future__ import annotations

from importlib.util import find_spec

from tqdm import tqdm

from experiments.studies.blind.cases import BLOCK, Case, all_cases
from experiments.studies.blind.data import outcome
from experiments.studies.blind.scoring import BlindJob
from experiments.studies.blind.tables import times_tables
from pymoo_hdte._runner.result import Table

CASES = tuple(all_cases()[: len(BLOCK)])
"""The first of the list of blind campaigns, with all kinds in the shares of the whole."""


def verdict_times(cases: tuple[Case, ...] = CASES) -> tuple[Table, ...]:
    """Return the median time of a campaign beside its limit; none where a scored tool is missing.

    Other tools are scored on the same cases, but do not count.
    """
    if find_spec("pysindy") is None:
        return ()
    bar = tqdm(cases, desc="blind campaigns", leave=False)
    judged, _ = times_tables([outcome(case, BlindJob(case).execute()) for case in bar])
    return (judged,)
