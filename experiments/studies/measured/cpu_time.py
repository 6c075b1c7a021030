"""CPU time of the workflow on rigs that others measured, and the most that is allowed."""

from __future__ import annotations

import time
from collections.abc import Sequence

from experiments.runner.result import Column, Finding, Table
from experiments.studies.measured.known_answers import KnownRig
from experiments.studies.measured.rigs import Study, study

SECONDS = (Column("rig"), Column("tool"), Column("CPU time", "s", 3))
LONGEST = 20.0
"""s of CPU that reading, verdict and proof of a rig may take."""
TOOL = "workflow"


def timed_study(rig: KnownRig) -> tuple[Study | None, list[str]]:
    """Return the study of a rig, None where its records are not there, and a row of `SECONDS`."""
    began = time.process_time()
    one = study(rig.name, rig.folder)
    return one, [rig.name, TOOL, f"{time.process_time() - began:.3g}"]


def cpu_table(rows: Sequence[Sequence[str]]) -> Table:
    """Return rows of `SECONDS`, and whether the workflow is fast enough on every rig."""
    seconds, rig = max((float(row[2]), row[0]) for row in rows if row[1] == TOOL)
    words = f"The workflow takes at most {seconds:.3g} s of CPU ({rig}); {LONGEST:g} are allowed."
    cells = tuple((name, tool, float(taken)) for name, tool, taken in rows)
    finding = Finding(seconds <= LONGEST, words, check=True)
    return Table("seconds", "CPU time", SECONDS, cells, findings=(finding,), wall_times=True)
