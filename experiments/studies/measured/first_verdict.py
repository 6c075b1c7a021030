"""From logs to a first verdict by the command alone: what a newcomer waits for and corrects."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.studies.measured.known_answers import KNOWN_RIGS, judged
from experiments.studies.measured.rigs import SHARED


@dataclass(frozen=True)
class Log:
    """Data files of a machine, and what is wrong in the draft that ``init`` makes of them.

    Attributes
    ----------
    rig : str
        Of `KNOWN_RIGS`.
    maker : str
    files : tuple of str
        In the folder of the rig.
    corrections : tuple of (str, str)
        Lines of the draft, and what whoever knows the machine writes instead.
    """

    rig: str
    maker: str
    files: tuple[str, ...]
    corrections: tuple[tuple[str, str], ...] = ()


LOGS = (
    Log(
        "ur10e_joint_4",
        "Universal Robots",
        ("joint_4.csv",),
        (
            ("# gain = { value = 10.0 }", "gain = { value = 9.0 }"),
            (
                'channels.drive = { column = 16, unit = "1" }',
                'channels.drive = { column = 16, unit = "A" }',
            ),
            (
                '# gear = { ratio = 101, kind = "harmonic drive" }  # if the joint has one',
                'gear = { ratio = 101, kind = "harmonic drive" }',
            ),
        ),
    ),
    Log(
        "tx40_joint_4",
        "Staubli",
        ("position.csv", "torque.csv"),
        (
            ("sample_rate = 1000", "sample_rate = 5000"),
            (
                'channels.joint = { column = "Joint_4", unit = "deg" }',
                'channels.joint = { column = "Joint_4", unit = "rad", divided_by = -48.0 }',
            ),
            ("gain = { value = 1.0 }  # the column is a force already", "gain = { value = -48.0 }"),
        ),
    ),
    Log("dm4310", "Damiao", ("round2.csv", "round3.csv")),
)


@dataclass(frozen=True)
class FirstVerdict:
    """What comes of a log.

    Attributes
    ----------
    log : Log
    marks : int
        Lines of the draft that ask to be corrected or confirmed.
    judgement : str
        As in `known_answers`.
    names : tuple of str
    seconds : (float, float)
        Wall time of ``init`` and of ``discrepancy``, the start of Python included.
    """

    log: Log
    marks: int
    judgement: str
    names: tuple[str, ...]
    seconds: tuple[float, float]


def first_verdict(log: Log) -> FirstVerdict | None:
    """Return what comes of a log; None where it is not there.

    Raises
    ------
    ValueError
        The draft does not hold a line that is to be corrected.
    """
    rig = next(rig for rig in KNOWN_RIGS if rig.name == log.rig)
    if not (SHARED / rig.folder).is_dir():
        return None
    with TemporaryDirectory() as place:
        folder = Path(place) / log.rig
        folder.mkdir()
        for name in log.files:
            shutil.copy(SHARED / rig.folder / name, folder)
        seconds = [_timed(["init", str(folder)])]
        draft = folder / "rig.toml"
        lines = draft.read_text(encoding="utf-8").splitlines()
        draft.write_text("\n".join(corrected(lines, log.corrections)) + "\n", encoding="utf-8")
        seconds.append(_timed(["discrepancy", str(folder), "--out", str(folder / "report")]))
        text = (folder / "report" / "verdict.json").read_text(encoding="utf-8")
    verdict = json.loads(text)
    names = tuple(dict.fromkeys(effect["name"] for effect in verdict["effects"]))
    return FirstVerdict(
        log,
        sum("EDIT" in line for line in lines[len(_head(lines)) :]),
        judged(rig, verdict["status"], names),
        names,
        (seconds[0], seconds[1]),
    )


def corrected(lines: Sequence[str], corrections: Sequence[tuple[str, str]]) -> list[str]:
    """Return the lines of a draft with corrections.

    Raises
    ------
    ValueError
        A line that is to be corrected is not there, or more than once.
    """
    text = list(lines)
    for wrong, right in corrections:
        if text.count(wrong) != 1:
            raise ValueError(f"the draft holds {text.count(wrong)} times the line: {wrong}")
        text[text.index(wrong)] = right
    return text


def _head(lines: Sequence[str]) -> list[str]:
    """Return the comment with which a draft begins."""
    first = next((place for place, line in enumerate(lines) if not line.startswith("#")), 0)
    return list(lines[:first])


def _timed(arguments: Sequence[str]) -> float:
    began = time.perf_counter()
    command = [sys.executable, "-m", "pymoo_hdte.cli", *arguments]
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - began
