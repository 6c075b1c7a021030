"""The report on one rig that others measured: verdict, judged values, validation and twins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from experiments.runner.result import Result, Table
from experiments.studies.measured.rigs import (
    Study,
    absent,
    errors_table,
    evidence_table,
    pictures,
    study,
    verdict_paragraphs,
)
from experiments.studies.measured.twins import Twin, drag_at, find_twins, twins_table

Judge = Callable[[Study, tuple[Twin, ...]], Table]
"""Holds the fitted values and the verdict against what is known of the rig."""


@dataclass(frozen=True)
class MeasuredRig:
    """Where the records of a rig are, and what its report says of it.

    Attributes
    ----------
    name : str
        Of the experiment and of its file in ``data``.
    folder : str
        Folder of the records, in `experiments.studies.measured.rigs.MEASURED`.
    title : str
    origin : str
        Where the records are published.
    believed : str
        The model that one starts from, and which records are fitted and held out.
    port : str
        Where the twins hide a drag.
    drag : float
        Its force at the largest speed, N or N.m.
    """

    name: str
    folder: str
    title: str
    origin: str
    believed: str
    port: str
    drag: float


def measured_result(rig: MeasuredRig, judge: Judge) -> Result:
    """Study the records and twins of the rig; say which records are missing if they are."""
    command = f"python -m experiments {rig.name}"
    one = study(rig.name, rig.folder)
    if one is None:
        return absent(rig.title, rig.folder, command, rig.origin)
    found = find_twins(one, drag_at(one, rig.port, rig.drag))
    return Result(
        title=rig.title,
        command=command,
        paragraphs=(rig.believed, *verdict_paragraphs(one)),
        tables=(judge(one, found), errors_table(one), twins_table(found), evidence_table(one)),
        pictures=pictures(one),
    )
