"""Rigs that others measured: verdicts beside known answers and beside other tools.

Without ``--full`` the tables are the committed ones, ``experiments/data/real*.csv``; with it the
records in ``../shared`` are analysed and the files left in the results folder. Rows of a tool that
is not installed then stay as they are stored.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from experiments.runner.committed import (
    stored_outcome,
    table_with_origin,
)
from experiments.runner.machine import processor
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.measured.first_verdict import LOGS, FirstVerdict, first_verdict
from experiments.studies.measured.known_answers import (
    CONFIDENT,
    FALLS_SHORT,
    KNOWN_RIGS,
    PARTLY,
    PLAIN,
    RIGHT,
    UNKNOWN,
    KnownRig,
    beside,
    judged,
)
from experiments.studies.measured.other_tools import SYSID, TOOLS, Answer, terms_of
from experiments.studies.measured.rigs import MEASURED, Study, fitted_values, study
from experiments.studies.measured.stored_rows import Rows, cells, headings, stored
from pymoo_hdte._comparing.statistics import rate
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner.result import Column, Finding, Result, Table, scored
from pymoo_hdte._runner.store import TIMES, write_atomically
from pymoo_hdte.discrepancy._answers.descriptive_model import descriptive_model
from pymoo_hdte.discrepancy._report.mechanism_values import effects
from pymoo_hdte.discrepancy._report.torsion import torsion_document
from pymoo_hdte.discrepancy._verdicts.validation_mechanism import validate_mechanism
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.mechanism.motion import SmoothedMotion, motion_of
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
    sizes = (_rms([getattr(error, side) for error in errors]) for side in ("before", "after"))
    return [number_in_words(size / ARCSEC) for size in sizes]


def number_in_words(value: float | None) -> str:
    """Return a number as a text, an empty one where there is none."""
    return "" if value is None or np.isnan(value) else f"{value:.4g}"


def share_in_words(value: float | None) -> str:
    """Return an R2 as a text; far below zero, digits mean nothing."""
    if value is None or np.isnan(value):
        return ""
    return f"{value:.5f}" if value > LOST else f"below {LOST:g}"


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


MODELS = "base", "accepted", "six_terms", "descriptive"
"""Models whose held-out balances are compared, in the order of `HELD_OUT`."""


def balances(machine: Study) -> dict[str, float]:
    """Return what each of `MODELS` leaves of the held-out balance of the coordinate, rms."""
    (name,) = machine.finding.mechanism.coordinates
    model = descriptive_model("", machine.finding)
    errors = [error for error in model.held_out if error.quantity == name]
    return {name: _rms([getattr(error, name) for error in errors]) for name in MODELS}


def reached(machine: Study) -> float:
    """Return the share of held-out rows at positions and speeds that fitted rows span, in %."""
    finding = machine.finding
    (name,) = finding.mechanism.coordinates
    states: dict[str, list[Values]] = {"train": [], "held_out": []}
    for record in finding.records:
        motion = motion_of(record.channels[name], record.step, finding.cutoff)
        states[record.role].append(np.array([motion.position, motion.speed]))
    fitted, rows = (np.concatenate(states[role], axis=1) for role in ("train", "held_out"))
    within = (fitted.min(axis=1) <= rows.T) & (fitted.max(axis=1) >= rows.T)
    return 100.0 * float(np.mean(within.all(axis=1)))


def simulated(machine: Study) -> list[float]:
    """Return the error of all simulated positions of the held-out records, before and after."""
    errors = [error for error in machine.errors if error.kind == "simulation"]
    return [_rms([getattr(error, side) for error in errors]) for side in ("before", "after")]


def _rms(sizes: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else float("nan")


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


SECONDS = (Column("rig"), Column("tool"), Column("time", "s", 3), Column("processor"))
LONGEST = 20.0
"""s of CPU that reading, verdict and proof of a rig may take."""
FIRST = 120.0
"""s that a first verdict may take a newcomer."""
TOOL, INIT, COMMAND = "workflow", "init", "init and discrepancy"


def timed_study(rig: KnownRig) -> tuple[Study | None, list[str]]:
    """Return the study of a rig, None where its records are not there, and a row of `SECONDS`."""
    began = time.process_time()
    machine = study(rig.name, rig.folder)
    return machine, _seconds(rig.name, TOOL, time.process_time() - began)


def _seconds(rig: str, tool: str, taken: float) -> list[str]:
    return [rig, tool, f"{taken:.3g}", processor()]


def seconds_table(rows: Sequence[Sequence[str]], logs: Rows) -> Table:
    """Return rows of `SECONDS`, and whether the workflow is fast enough on every rig and log."""
    seconds, rig = max((float(row[2]), row[0]) for row in rows if row[1] == TOOL)
    words = f"The workflow takes at most {seconds:.3g} s of CPU ({rig}); {LONGEST:g} are allowed."
    findings = [Finding(seconds <= LONGEST, words, check=True)]
    waited = max((float(row[2]) for row in rows if row[1] == COMMAND), default=None)
    if waited is not None:
        most = max(int(row[FIRST_VERDICTS.index(CORRECTED)]) for row in logs)
        words = (
            f"From log to first verdict a newcomer waits at most {waited:.3g} s for the commands, "
            f"the start of Python included, and corrects at most {most} lines of the draft; "
            f"{FIRST:g} s are allowed for both. How long people take for these lines was not "
            "measured."
        )
        findings.append(Finding(waited <= FIRST, words, check=True))
    cells = tuple((rig, tool, float(taken), where) for rig, tool, taken, where in rows)
    note = "CPU time; of init and discrepancy the time that passes until both commands have ended."
    title = "How long it takes"
    return Table(
        "seconds", title, SECONDS, cells, note, tuple(findings), folded=True, wall_times=True
    )


NAME = "real"
VERDICTS = (
    Column("rig"),
    Column("judged"),
    Column("status"),
    Column("found"),
    Column("known answer"),
    Column("off", "%", 3, "known values"),
    Column("ripple", "per turn", 5, "order"),
    Column("known", "per turn", 5, "order"),
)
RATIO = Column("ratio", digits=4, group="force balance, rms")
"""Of the descriptive model and six terms."""
HELD_OUT = (
    *(
        Column(name, digits=3, group="force balance, rms")
        for name in ("before", "verdict", "six terms", "descriptive")
    ),
    RATIO,
    Column("reached", "%", 3),
    Column("before", digits=3, group="simulated position, rms"),
    Column("verdict", digits=3, group="simulated position, rms"),
    Column("window", "s", 3, "simulation"),
    Column("R2 before", digits=5, group="simulation"),
    Column("R2 verdict", digits=5, group="simulation"),
    Column("before", "arcsec", 3, "torsion"),
    Column("verdict", "arcsec", 3, "torsion"),
)
STORED = (*VERDICTS, *HELD_OUT)
"""Columns of ``real.csv``."""
TOOL_COLUMNS = (
    Column("rig"),
    Column("tool"),
    Column("version"),
    Column("judged"),
    Column("says"),
    Column("force", digits=5, group="R2, held out"),
    Column("simulated position", digits=5, group="R2, held out"),
)
CORRECTED = Column("corrected", digits=1, group="lines of the draft")
FIRST_VERDICTS = (
    Column("rig"),
    Column("maker"),
    Column("marked", digits=1, group="lines of the draft"),
    CORRECTED,
    Column("corrections"),
    Column("judged"),
    Column("found"),
)
MOST = 1.05
"""Held-out balance of the descriptive model in units of that of six terms, at most."""
ARROW = "silverbox"
"""Rig whose held-out record is simulated without a break as well, which takes a minute."""
SETTING, NOTE, BALANCE_NOTE, TOOLS_NOTE, FIRST_NOTE = paragraphs("real")


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
    outcome, tools, logs, seconds = _examined(context) if context.full else _committed()
    rows = sorted(outcome, key=lambda row: FALLS_SHORT.index(row[1]))
    verdicts = [row[: len(VERDICTS)] for row in rows]
    by_ratio = sorted(outcome, key=lambda row: -_ratio(row))
    held_out = [[row[0], *row[len(VERDICTS) :]] for row in by_ratio]
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
                cells(verdicts),
                note=NOTE,
                findings=_findings(rows),
            ),
            Table(
                "held_out",
                "Prediction of what was not fitted",
                (Column("rig"), *HELD_OUT),
                cells(held_out),
                note=BALANCE_NOTE,
                findings=(_no_worse_than_six_terms(by_ratio),),
            ),
            Table(
                "first", "From a log to a first verdict", FIRST_VERDICTS, cells(logs), FIRST_NOTE
            ),
            allowances_table(),
            Table(
                "tools",
                "Beside other tools",
                TOOL_COLUMNS,
                cells(tools),
                note=TOOLS_NOTE,
                findings=_no_worse_than_mujoco(tools),
                folded=True,
            ),
            seconds_table(seconds, logs),
        ),
    )


def _ratio(row: Sequence[str]) -> float:
    return float(row[STORED.index(RATIO)])


def _no_worse_than_six_terms(rows: Sequence[Sequence[str]]) -> Finding:
    """Return whether the descriptive model keeps up with least squares everywhere."""
    worse = [f"{row[0]} ({_ratio(row):.3g} times)" for row in rows if _ratio(row) > MOST]
    better = sum(_ratio(row) < 1.0 for row in rows)
    words = (
        f"The descriptive model leaves less of the held-out balance than least squares with six "
        f"terms on {better} of {len(rows)} sets; more than {MOST:g} times as much on: "
        f"{_listed(worse)}."
    )
    return Finding(not worse, words, check=True)


def _no_worse_than_mujoco(rows: Sequence[Sequence[str]]) -> tuple[Finding, ...]:
    """Return whether our models are simulated as well as those of mujoco.sysid."""
    theirs = {row[0]: row[-1] for row in rows if row[1] == SYSID}
    ours = {row[0]: row[-1] for row in reversed(rows) if row[1] == TOOL}
    if not theirs:
        return ()
    told = [f"{rig} {ours[rig]} and {share}" for rig, share in theirs.items()]
    agrees = all(_number(ours[rig]) >= _number(share) for rig, share in theirs.items())
    words = f"R2 of the simulated held-out position by us and by {SYSID}: {', '.join(told)}."
    return (Finding(agrees, words, check=True),)


def _number(share: str) -> float:
    """Return an R2, minus infinity where it is lost."""
    return float(share) if share and not share.startswith("below") else -np.inf


def examined(rig: KnownRig, tools: bool = True, whole: bool = True) -> Examined | None:
    """Return what is found on a rig; None where its records are not there.

    Parameters
    ----------
    rig : KnownRig
    tools : bool
        Whether other tools that are installed are asked, too.
    whole : bool
        Whether the held-out record of `ARROW` is simulated without a break, too.
    """
    machine, taken = timed_study(rig)
    if machine is None:
        return None
    seconds = [taken]
    left, of_force = balances(machine), None
    # What swings freely has no force that a tool could predict.
    forced = bool(machine.finding.mechanism.inputs)
    if forced:
        of_force = 1.0 - left["accepted"] ** 2 / terms_of(machine.finding, "held_out", ()).power
    shares = [share_in_words(share) for share in (of_force, explained(machine)[1])]
    rows = [[TOOL, "", *_said(rig, machine), *shares]]
    for tool in TOOLS if tools and forced else ():
        if tool.version is None or (tool.rigs and rig.name not in tool.rigs):
            continue
        began = time.process_time()
        answer = tool.ask(machine.finding)
        seconds.append(_seconds(rig.name, tool.name, time.process_time() - began))
        rows.append([tool.name, tool.version, *_tool_cells(rig, answer)])
    if whole and rig.name == ARROW:
        error = next(
            error
            for error in validate_mechanism(machine.finding, whole=True)
            if error.determination is not None
        )
        assert error.determination is not None
        words = f"the same, {error.record} without a break"
        rows.append([TOOL, "", "", words, "", f"{error.determination[1]:.5f}"])
    return Examined(verdict_row(rig, machine, left), [[rig.name, *row] for row in rows], seconds)


def verdict_row(rig: KnownRig, machine: Study, left: dict[str, float]) -> list[str]:
    """Return what is said of a rig, and the `balances`, in the order of `STORED`."""
    judgement, words = _said(rig, machine)
    extents = [error.extent.length for error in machine.errors if error.extent is not None]
    numbers = [farthest(rig, machine), nearest_order(rig, machine), rig.order, *left.values()]
    numbers += [left["descriptive"] / left["six_terms"], reached(machine), *simulated(machine)]
    shown = [number_in_words(number) for number in (*numbers, min(extents, default=None))]
    by_simulation = [share_in_words(value) for value in explained(machine)]
    words_of = rig.name, judgement, machine.status, words, rig.answer
    return [*words_of, *shown, *by_simulation, *torsion_errors(machine)]


def shortfalls(rows: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return what falls short, in sentences, the worst first."""
    short = [row for row in rows if row[1] not in (RIGHT, PARTLY, UNKNOWN)]
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
    return f"Verdicts on {len(rows)} sets of records: {counted}{none}."


def _said(rig: KnownRig, machine: Study) -> tuple[str, str]:
    """Return the judgement on a verdict, and what it names."""
    names = list(dict.fromkeys(effect["name"] for effect in named(machine)))
    words = " + ".join(names).replace("_", " ") or "nothing"
    if machine.joint and machine.joint.torsion.verdict.status == "unlisted":
        words += "; of the torsion nothing"
    verdict = machine.finding.verdict
    others = {effect.name for member in verdict.equivalent for effect in member.effects}
    return judged(rig, machine.status, names, others), words


def _tool_cells(rig: KnownRig, answer: Answer) -> list[str]:
    judgement = "" if answer.names is None else judged(rig, "named", answer.names)
    return [
        judgement,
        answer.words,
        *(share_in_words(share) for share in (answer.of_force, answer.of_motion)),
    ]


def _findings(rows: Sequence[Sequence[str]]) -> tuple[Finding, ...]:
    """Return whether the demands on real machines hold."""
    confident = [row[0] for row in rows if row[1] == CONFIDENT]
    wrong = rate(len(confident), sum(row[1] != UNKNOWN for row in rows))
    before, after = (len(VERDICTS) + HELD_OUT.index(column) for column in HELD_OUT[6:8])
    named = [row for row in rows if row[2] in ("named", "class", "partial")]
    worse = [
        row[0]
        for row in named
        if row[before] and row[after] and not float(row[after]) < float(row[before])
    ]
    sure = [row[0] for row in rows if row[1] == PARTLY and row[2] in PLAIN]
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
            "sets with a known answer; none should be.",
        ),
        Finding(
            not sure,
            "Named without a caveat, though not all is named that is known, or more: "
            f"{_listed(sure)}.",
            check=True,
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


def _examined(context: Context) -> tuple[Rows, Rows, Rows, Rows]:
    verdicts, tools, seconds = Rows(), Rows(), Rows()
    absent = {tool.name for tool in TOOLS if tool.version is None}
    _, stored_tools, _, stored_seconds = _committed()
    for rig in tqdm(KNOWN_RIGS, desc="real rigs", leave=False):
        found = examined(rig)
        if found is not None:
            verdicts.append(found.verdict)
            tools += found.tools
            seconds += found.seconds
            for rows, before in ((tools, stored_tools), (seconds, stored_seconds)):
                rows += [row for row in before if row[0] == rig.name and row[1] in absent]
    first = [outcome for log in LOGS if (outcome := first_verdict(log)) is not None]
    logs = [first_row(outcome) for outcome in first]
    for outcome in first:
        seconds.append(_seconds(outcome.log.rig, INIT, outcome.seconds[0]))
        seconds.append(_seconds(outcome.log.rig, COMMAND, sum(outcome.seconds)))
    files = (
        (context.out / NAME / f"{NAME}.csv", STORED, verdicts),
        (context.out / NAME / f"{NAME}_tools.csv", TOOL_COLUMNS, tools),
        (context.out / NAME / f"{NAME}_first.csv", FIRST_VERDICTS, logs),
    )
    for path, columns, rows in files:
        write_atomically(path, table_with_origin(headings(columns), rows).encode())
    path = context.out / TIMES / NAME / f"{NAME}_seconds.csv"
    write_atomically(path, csv_text(headings(SECONDS), seconds).encode())
    return verdicts, tools, logs, seconds


def first_row(outcome: FirstVerdict) -> list[str]:
    """Return what comes of a log, in the order of `FIRST_VERDICTS`."""
    log = outcome.log
    corrections = "; ".join(right.partition("  #")[0] for _, right in log.corrections)
    found = " + ".join(outcome.names).replace("_", " ") or "nothing"
    counts = str(outcome.marks), str(len(log.corrections))
    words = corrections or "none", outcome.judgement, found
    return [log.rig, log.maker, *counts, *words]


def _committed() -> tuple[Rows, Rows, Rows, Rows]:
    verdicts, tools, logs, seconds = (
        stored(f"{NAME}{part}.csv", NAME) for part in ("", "_tools", "_first", "_seconds")
    )
    return verdicts, tools, logs, seconds
