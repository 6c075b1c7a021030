"""Rigs that others measured: verdicts beside known answers and beside other tools.

Without ``--full`` the tables are the committed ones, ``experiments/data/real*.csv``; with it the
records in ``../shared/measured`` are analysed and the files left in the results folder.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.comparing.statistics import rate
from experiments.runner.committed import (
    committed_file,
    read_rows,
    stored_outcome,
    table_with_origin,
)
from experiments.runner.registry import Context
from experiments.runner.result import Cell, Column, Finding, Result, Table, scored
from experiments.runner.store import TIMES, write_atomically
from experiments.runner.texts import paragraphs
from experiments.studies.measured.known_answers import (
    CONFIDENT,
    FALLS_SHORT,
    KNOWN_RIGS,
    RIGHT,
    UNKNOWN,
    KnownRig,
    beside,
    judged,
)
from experiments.studies.measured.other_tools import Answer, answers, terms_of
from experiments.studies.measured.rigs import MEASURED, Study, fitted_values, study
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte.discrepancy._report.mechanism_values import effects
from pymoo_hdte.discrepancy._report.torsion import torsion_document
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import validate_mechanism
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.mechanism.motion import SmoothedMotion
from pymoo_hdte.mechanism.port_motion import law_force
from pymoo_hdte.units import ARCSEC

Values = NDArray[np.float64]

LOST = -10.0
"""R2 below which a prediction is lost."""


def named(machine: Study) -> list[dict[str, Any]]:
    """Return what a verdict names with its values, ripple beyond the band included."""
    beyond = (effect for ripple in machine.finding.ripples.lines for effect in ripple.as_dicts())
    twist = torsion_document(machine.joint)["effects"] if machine.joint else []
    return [*effects(machine.finding), *beyond, *twist]


def torsion_errors(machine: Study) -> list[str]:
    """Return the errors of the held-out torsion before and after, arcseconds, where measured."""
    errors = machine.joint.errors if machine.joint else ()
    sizes = ([getattr(error, side) for error in errors] for side in ("before", "after"))
    return [f"{np.sqrt(np.mean(np.square(each))) / ARCSEC:.4g}" if each else "" for each in sizes]


def share_in_words(value: float | None) -> str:
    """Return an R2 as a text; far below zero, digits mean nothing."""
    return "" if value is None else f"{value:.5f}" if value > LOST else f"below {LOST:g}"


def determinations(machine: Study) -> list[str]:
    """Return R2 of force and simulated position by the accepted model, held out."""
    finding, errors = (
        machine.finding,
        [error for error in machine.errors if error.kind == "balance"],
    )
    (name,) = finding.mechanism.coordinates
    errors = [error for error in errors if error.quantity == name]
    if not errors:
        return ["", ""]
    power = terms_of(finding, "held_out", ()).power
    residual = float(np.mean([error.after**2 for error in errors]))
    return [f"{1.0 - residual / power:.5f}", f"{explained(machine)[1]:.5f}"]


def explained(machine: Study) -> tuple[float, float]:
    """Return R2 of all simulated positions, before and after."""
    errors = [error for error in machine.errors if error.extent is not None]
    if not errors:
        return np.nan, np.nan
    power = np.concatenate([error.measured - error.measured.mean() for error in errors])
    residuals = (
        np.concatenate([error.measured - getattr(error, side) for error in errors])
        for side in ("predicted_before", "predicted_after")
    )
    before, after = (
        1.0 - float(np.mean(residual**2) / np.mean(power**2)) for residual in residuals
    )
    return before, after


def pooled(machine: Study, kind: str, side: int) -> float | None:
    """Return the root mean square over the held-out records, of the first coordinate."""
    name = machine.finding.mechanism.coordinates[0]
    sizes = [
        (error.before, error.after)[side]
        for error in machine.errors
        if (error.kind, error.quantity) == (kind, name)
    ]
    return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else None


def farthest(rig: KnownRig, machine: Study) -> float | None:
    """Return the largest deviation from a known value or from the curve of friction, in %."""
    fitted = fitted_values(machine)
    off = [
        abs(fitted[name.replace("_", " ")]["value"] / value - 1.0)
        for name, value in rig.values
        if name.replace("_", " ") in fitted
    ]
    if rig.friction is not None:
        speed = _speeds(machine)
        off.append(float(np.max(np.abs(_friction(machine, speed) / rig.friction.at(speed) - 1.0))))
    return 100.0 * max(off) if off else None


def _speeds(machine: Study) -> Values:
    """Return speeds at which the records move, between the 10th and the 90th of a hundred."""
    spectra = machine.finding.data.spectra
    (name,) = machine.finding.mechanism.coordinates
    speed = np.concatenate([np.abs(balance.motions[name].speed) for balance in spectra])
    slowest, fastest = np.quantile(speed, (0.1, 0.9)).tolist()
    return np.linspace(slowest, fastest, 30)


def _friction(machine: Study, speed: Values) -> Values:
    """Return the friction of the accepted model, odd part, at speeds (n,)."""
    finding = machine.finding
    damping = sum(
        value
        for parameter, value in zip(
            finding.accepted.parameters, finding.accepted.values, strict=True
        )
        if parameter.name.startswith("damping of ")
    )
    force = damping * speed
    for effect in finding.accepted.effects:
        if effect.law.states or effect.law.orders:
            continue
        there, back = (
            law_force(effect.law, SmoothedMotion(0.0 * speed, way * speed, 0.0 * speed), 0.0)
            for way in (1.0, -1.0)
        )
        force = force + 0.5 * (there - back)
    return np.asarray(force)


def nearest_order(rig: KnownRig, machine: Study) -> float | None:
    """Return the order of a named ripple, that nearest to the known one."""
    if rig.order is None:
        return None
    orders = [
        effect["parameters"]["order"]["value"]
        for effect in named(machine)
        if "order" in effect["parameters"]
    ]
    orders += [order for each in machine.finding.accepted.effects if (order := place_of(each)[2])]
    known = rig.order
    return min(orders, key=lambda order: abs(order - known), default=None)


SECONDS = (Column("rig"), Column("tool"), Column("CPU time", "s", 3))
LONGEST = 20.0
"""s of CPU that reading, verdict and proof of a rig may take."""
TOOL = "workflow"


def timed_study(rig: KnownRig) -> tuple[Study | None, list[str]]:
    """Return the study of a rig, None where its records are not there, and a row of `SECONDS`."""
    began = time.process_time()
    machine = study(rig.name, rig.folder)
    return machine, [rig.name, TOOL, f"{time.process_time() - began:.3g}"]


def cpu_table(rows: Sequence[Sequence[str]]) -> Table:
    """Return rows of `SECONDS`, and whether the workflow is fast enough on every rig."""
    seconds, rig = max((float(row[2]), row[0]) for row in rows if row[1] == TOOL)
    words = f"The workflow takes at most {seconds:.3g} s of CPU ({rig}); {LONGEST:g} are allowed."
    cells = tuple((name, tool, float(taken)) for name, tool, taken in rows)
    finding = Finding(seconds <= LONGEST, words, check=True)
    return Table("seconds", "CPU time", SECONDS, cells, findings=(finding,), wall_times=True)


NAME = "real"
VERDICTS = (
    Column("rig"),
    Column("judged"),
    Column("status"),
    Column("found"),
    Column("known answer"),
    Column("farthest from a known value", "%", 3),
    Column("ripple", "per turn", 5, "order"),
    Column("known", "per turn", 5, "order"),
    Column("before", digits=3, group="held-out force, rms"),
    Column("after", digits=3, group="held-out force, rms"),
    Column("before", digits=3, group="held-out position, rms"),
    Column("after", digits=3, group="held-out position, rms"),
    Column("window", "s", 3, "simulation"),
    Column("R2 before", digits=5, group="simulation"),
    Column("R2 after", digits=5, group="simulation"),
    Column("before", "arcsec", 3, "held-out torsion"),
    Column("after", "arcsec", 3, "held-out torsion"),
)
TOOLS = (
    Column("rig"),
    Column("tool"),
    Column("judged"),
    Column("says"),
    Column("held-out force", digits=5, group="R2"),
    Column("held-out position, simulated", digits=5, group="R2"),
)
ARROW = "silverbox"
"""Rig whose held-out record is simulated without a break as well, which takes a minute."""
SETTING, NOTE, TOOLS_NOTE = paragraphs("real")

Rows = list[list[str]]


@dataclass(frozen=True)
class Examined:
    """Rows of all tables on one rig."""

    verdict: list[str]
    tools: Rows
    seconds: Rows


def run(context: Context) -> Result:
    """Analyse the rigs, or read what was found, and show it."""
    if context.full and not MEASURED.is_dir():
        sentence = f"Skipped: there are no measurements in {MEASURED}."
        return Result("Verdicts on real machines", context.command(NAME), sentence)
    tables = _examined(context) if context.full else _committed()
    order = [FALLS_SHORT.index(row[1]) for row in tables[0]]
    rows = [row for _, row in sorted(zip(order, tables[0], strict=True), key=lambda pair: pair[0])]
    return Result(
        title="Verdicts on real machines",
        command=context.command(NAME),
        answer=_in_one_sentence(rows),
        paragraphs=(*stored_outcome(context, NAME), *shortfalls(rows), SETTING),
        tables=(
            Table(
                "verdicts",
                "Verdicts",
                VERDICTS,
                _cells(rows),
                note=NOTE,
                findings=_findings(rows),
            ),
            allowances_table(),
            Table("tools", "Beside other tools", TOOLS, _cells(tables[1]), note=TOOLS_NOTE),
            cpu_table(tables[2]),
        ),
    )


def examined(rig: KnownRig, tools: bool = True, whole: bool = True) -> Examined | None:
    """Return what is found on a rig; None where its records are not there.

    Parameters
    ----------
    rig : KnownRig
    tools : bool
        Whether other tools are asked, too.
    whole : bool
        Whether the held-out record of `ARROW` is simulated without a break, too.
    """
    machine, taken = timed_study(rig)
    if machine is None:
        return None
    seconds = [taken]
    rows = [[TOOL, *_said(rig, machine), *determinations(machine)]]
    for answer in answers(machine.finding) if tools else []:
        rows.append(_tool_row(rig, answer))
        seconds.append([rig.name, answer.tool, f"{answer.seconds:.3g}"])
    if whole and rig.name == ARROW:
        error = next(
            error
            for error in validate_mechanism(machine.finding, whole=True)
            if error.determination is not None
        )
        assert error.determination is not None
        words = f"the same, {error.record} without a break"
        rows.append([TOOL, "", words, "", f"{error.determination[1]:.5f}"])
    return Examined(verdict_row(rig, machine), [[rig.name, *row] for row in rows], seconds)


def verdict_row(rig: KnownRig, machine: Study) -> list[str]:
    """Return what is said of a rig, in the order of `VERDICTS`."""
    judgement, words = _said(rig, machine)
    off, order = farthest(rig, machine), nearest_order(rig, machine)
    rms = [pooled(machine, kind, side) for kind in ("balance", "simulation") for side in (0, 1)]
    extents = [error.extent.length for error in machine.errors if error.extent is not None]
    numbers = [off, order, rig.order, *rms, min(extents, default=None)]
    shown = ["" if number is None else f"{number:.4g}" for number in numbers]
    by_simulation = [f"{value:.5f}" for value in explained(machine)]
    words_of = rig.name, judgement, machine.status, words, rig.answer
    return [*words_of, *shown, *by_simulation, *torsion_errors(machine)]


def shortfalls(rows: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return what falls short, in sentences, the worst first."""
    short = [row for row in rows if row[1] not in (RIGHT, UNKNOWN)]
    sentences = [f"{row[0]} ({row[1]}): {row[3]}, where {row[4]} is known" for row in short]
    right = [row for row in rows if row[1] == RIGHT]
    known = sum(row[1] != UNKNOWN for row in rows)
    helped = [f"{row[0]} ({_beside(row)})" for row in right if _beside(row)]
    extra = f", with a further effect that is allowed there: {', '.join(helped)}" if helped else ""
    count = f"Right: {len(right)} of {known} whose answer is known{extra}."
    return (f"What falls short. {'; '.join(sentences)}. {count}",) if sentences else (count,)


def _beside(row: Sequence[str]) -> str:
    """Return what a verdict names beyond the known answer, and is allowed to."""
    rigs = [rig for rig in KNOWN_RIGS if rig.name == row[0]]
    names = [words.replace(" ", "_") for words in row[3].split(" + ")]
    return " + ".join(name for rig in rigs for name in beside(rig, names)).replace("_", " ")


def allowances_table() -> Table:
    """Return by which allowances answers are judged."""
    rows = tuple(
        (
            rig.name,
            "; ".join(_any_of(effects) for effects in rig.effects),
            ", ".join(sorted(rig.also)).replace("_", " ") or None,
            rig.order,
            rig.reach if rig.order is not None else None,
        )
        for rig in KNOWN_RIGS
        if rig.effects
    )
    return Table(
        "allowances",
        "What counts as right",
        (
            *(Column("rig"), Column("must be named, the main effect first")),
            Column("may be named beside it"),
            *(Column(name, "per turn", 4, "order of the ripple") for name in ("known", "within")),
        ),
        rows,
        note="Further effects are allowed where they are plausible and no published answer "
        "excludes them. An order is known within the resolution of the travel and its confusion of "
        "housing and output.",
    )


def _any_of(effects: frozenset[str]) -> str:
    return " or ".join(sorted(effects)).replace("_", " ")


def _in_one_sentence(rows: Sequence[Sequence[str]]) -> str:
    """Count the judgements, those that fall short first."""
    counts = [(judgement, sum(row[1] == judgement for row in rows)) for judgement in FALLS_SHORT]
    counted = ", ".join(
        f"{count} with {word}" if word == UNKNOWN else f"{count} {word}"
        for word, count in counts
        if count
    )
    helped = sum(row[1] == RIGHT and bool(_beside(row)) for row in rows)
    counted += f" ({helped} of them with a further effect that is allowed)" if helped else ""
    none = "" if counts[0][1] else f", none {CONFIDENT}"
    return f"Verdicts on {len(rows)} machines that others measured: {counted}{none}."


def _said(rig: KnownRig, machine: Study) -> tuple[str, str]:
    """Return the judgement on a verdict, and what it names."""
    names = list(dict.fromkeys(effect["name"] for effect in named(machine)))
    words = " + ".join(names).replace("_", " ") or "nothing"
    if machine.joint and machine.joint.torsion.verdict.status == "unlisted":
        words += "; of the torsion nothing"
    return judged(rig, machine.status, names), words


def _tool_row(rig: KnownRig, answer: Answer) -> list[str]:
    judgement = "" if answer.names is None else judged(rig, "named", answer.names)
    return [
        answer.tool,
        judgement,
        answer.words,
        *(share_in_words(share) for share in (answer.of_force, answer.of_motion)),
    ]


def _findings(rows: Sequence[Sequence[str]]) -> tuple[Finding, ...]:
    """Return whether the demands on real machines hold."""
    confident = [row[0] for row in rows if row[1] == CONFIDENT]
    wrong = rate(len(confident), sum(row[1] != UNKNOWN for row in rows))
    named = [row for row in rows if row[2] in ("named", "class", "partial") and row[10] and row[11]]
    worse = [row[0] for row in named if not float(row[11]) < float(row[10])]
    missed = [
        rig.name
        for rig in KNOWN_RIGS
        for row in rows
        if row[0] == rig.name and rig.order is not None
        if not row[6] or abs(float(row[6]) - rig.order) > rig.reach
    ]
    return (
        scored(
            wrong.state(0.0, at_least=False),
            f"Confidently wrong: {_listed(confident)}, a share of {wrong.in_words} of {wrong.n} "
            "machines with a known answer; none should be.",
        ),
        Finding(
            not worse,
            f"Named, though it makes the simulated held-out position worse: {_listed(worse)}.",
            check=True,
        ),
        Finding(
            not missed,
            "Ripple not found at the known order, within what is allowed for it: "
            f"{_listed(missed)}.",
            check=True,
        ),
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"


def _examined(context: Context) -> tuple[Rows, Rows, Rows]:
    verdicts, tools, seconds = Rows(), Rows(), Rows()
    for rig in tqdm(KNOWN_RIGS, desc="real rigs", leave=False):
        found = examined(rig)
        if found is not None:
            verdicts.append(found.verdict)
            tools += found.tools
            seconds += found.seconds
    files = (
        (context.out / NAME / f"{NAME}.csv", VERDICTS, verdicts),
        (context.out / NAME / f"{NAME}_tools.csv", TOOLS, tools),
    )
    for path, columns, rows in files:
        write_atomically(path, table_with_origin(_headings(columns), rows).encode())
    path = context.out / TIMES / NAME / f"{NAME}_seconds.csv"
    write_atomically(path, csv_text(_headings(SECONDS), seconds).encode())
    return verdicts, tools, seconds


def _headings(columns: Sequence[Column]) -> list[str]:
    return [column.heading for column in columns]


def _committed() -> tuple[Rows, Rows, Rows]:
    first, second, third = (
        [list(row.values()) for row in read_rows(committed_file(f"{NAME}{part}.csv", NAME))]
        for part in ("", "_tools", "_seconds")
    )
    return first, second, third


def _cells(rows: Rows) -> tuple[tuple[Cell, ...], ...]:
    return tuple(tuple(_cell(text) for text in row) for row in rows)


def _cell(text: str) -> Cell:
    try:
        return float(text) if text else None
    except ValueError:
        return text
