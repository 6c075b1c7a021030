"""Tables of the blind campaigns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.rig.forms import LISTED
from experiments.studies.blind.runs import BlindRun, total
from experiments.studies.blind.scoring import COMPARED, DETERMINED, PARTS, RIVALS
from experiments.studies.blind.targets import (
    KINDS,
    NOT_RUN,
    NOTHING_STRESSED,
    Judged,
    demands,
    nothing_stressed,
    pooled_demands,
    select,
    share,
    time_demand,
)
from experiments.studies.blind.truth import STATUSES
from pymoo_hdte._comparing.statistics import Estimate, median
from pymoo_hdte._runner.result import SCORE_STATES, Cell, Column, Table, scored, significant

JUDGED_COLUMNS = (
    Column("demand"),
    Column("of what"),
    Column("n"),
    Column("required"),
    Column("value", "", 3, "measured"),
    Column("low", "", 3, "measured"),
    Column("high", "", 3, "measured"),
    Column("verdict"),
)
_ANSWERS = len(LISTED) + 2
"""All names, "adequate" and "unlisted": what chance chooses from."""


_OTHERS = ("class", "partial", "unlisted", "adequate", "error")
"""Statuses beside those of a single answer."""


def must_reach_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what must be reached beside what was measured, what falls short first."""
    judged = _short_first(demands(outcomes))
    note = (
        "What falls short stands first. Confident are the statuses named and parameter; such an "
        "answer is wrong if any name in it is not hidden. A class is right if it has at most three "
        "members and one of them is what is hidden, a partial answer if all its names are hidden. "
        "Intervals are exact: Clopper and Pearson's for rates, order statistics' for medians. What "
        "meets its demand is shown to do so if its whole interval does. A gap that exceeds the "
        "noise floor by less than a tenth cannot shrink and counts for no median."
    )
    return _judged_table(
        "must_reach",
        "Must reach: the cases shown here",
        "Blind campaigns of the last run",
        judged,
        note,
    )


def pooled_table(runs: Sequence[BlindRun]) -> Table:
    """Return what must be reached beside what several runs together came to."""
    cases = f"cases {runs[0].first} to {runs[-1].last}"
    note = "Counted by the rules of now. Intervals are Clopper and Pearson's."
    judged = _short_first(pooled_demands(total(runs)))
    return _judged_table(
        "pooled", f"Must reach: {cases} pooled", "Blind campaigns, pooled", judged, note
    )


def _short_first(judged: Iterable[Judged]) -> list[Judged]:
    order = (*SCORE_STATES[::-1], NOT_RUN)
    return sorted(judged, key=lambda judgement: order.index(judgement.verdict))


def times_tables(outcomes: Sequence[Outcome]) -> tuple[Table, Table]:
    """Return the demand on time, and the seconds of the parts, by what is hidden."""
    judged = _judged_table(
        "time", "Must reach: time", "Blind campaigns", [time_demand(outcomes)],
        "Processor time of analyse, locate, prove and next experiment.", wall_times=True,
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    groups = [(KINDS[kind], select(outcomes, kind)) for kind in KINDS if kind != "single"]
    groups += [(_plain(name), select(outcomes, "single", name)) for name in LISTED]
    for words, chosen in groups:
        seconds = [outcome.seconds for outcome in chosen if outcome.seconds]
        parts = [median([second[k] for second in seconds]).value for k in range(len(PARTS))]
        whole = median([sum(second) for second in seconds])
        rows.append((words, whole.n, *parts, whole.value, whole.high))
    columns = (
        Column("hidden"),
        Column("cases"),
        *(Column(part.replace("_", " "), "s", 3, "median") for part in PARTS),
        Column("all", "s", 3, "median"),
        Column("upper end", "s", 3, "median"),
    )
    parts_table = Table("time_parts", "Processor time by what is hidden", columns, tuple(rows),
                        folded=True, wall_times=True)  # fmt: skip
    return judged, parts_table


def status_table(outcomes: Sequence[Outcome]) -> Table:
    """Return how often each status is the answer, by kind."""
    groups = [(words, select(outcomes, kind)) for kind, words in KINDS.items()]
    groups.append((NOTHING_STRESSED, nothing_stressed(outcomes)))
    rows: list[tuple[Cell, ...]] = []
    for words, chosen in groups:
        counts = [sum(outcome.status == status for outcome in chosen) for status in STATUSES]
        flags = ("right_answer", "right", "wrong_confident", "wrong_partial")
        scores = [sum(getattr(outcome, flag) for outcome in chosen) for flag in flags]
        partly = sum(outcome.status == "partial" and outcome.true_names for outcome in chosen)
        pairs = sum(outcome.status == "partial" and outcome.two_named for outcome in chosen)
        rows.append((words, len(chosen), *counts, *scores, partly, pairs))
    columns = (
        Column("hidden"),
        Column("cases"),
        *(Column(status, group="status") for status in STATUSES),
        Column("as it must be", group="answer"),
        Column("first name or class right", group="answer"),
        Column("wrong, confident", group="answer"),
        Column("wrong, partial", group="answer"),
        Column("true, partial", group="answer"),
        Column("two named, partial", group="answer"),
    )
    note = (
        "As it must be: adequate where nothing is hidden, the right name or class of one effect, "
        "all of two, two of three, unlisted (or what is certain beside it) where no list holds it. "
        "Error: the workflow raised an exception, which counts as wrong everywhere."
    )
    return Table("statuses", "Verdicts by what is hidden", columns, tuple(rows), note=note)


def effects_table(outcomes: Sequence[Outcome]) -> Table:
    """Return the scores of each listed effect."""
    rows: list[tuple[Cell, ...]] = []
    for name in LISTED:
        chosen = select(outcomes, "single", name)
        right = share([outcome.right for outcome in chosen])
        counts = [sum(outcome.status == status for outcome in chosen)
                  for status in _OTHERS]  # fmt: skip
        biases = [median([outcome.numbers.get(f"bias_{state}") for outcome in chosen]).value
                  for state in ("before", "after", "error")]  # fmt: skip
        errors = [outcome.error("leading") for outcome in chosen]
        rows.append((
            _plain(name), len(chosen), right.value, right.low, right.high,
            sum(outcome.wrong_confident for outcome in chosen), *counts,
            median([outcome.f1 for outcome in chosen]).value, *biases,
            median([outcome.bias_ratio for outcome in chosen]).value,
            median([outcome.shrinkage("transmission_error") for outcome in chosen]).value,
            median([outcome.shrinkage("leading") for outcome in chosen]).value,
            median([g.after / g.noise_floor for g in errors if g is not None]).value,
        ))  # fmt: skip
    columns = (
        Column("hidden"),
        Column("cases"),
        Column("rate", "", 3, "right"),
        Column("low", "", 3, "right"),
        Column("high", "", 3, "right"),
        Column("wrong, confident"),
        *(Column(status, group="status") for status in _OTHERS),
        Column("F1 of cells", "", 3, "median"),
        Column("before", "", 2, "bias of the base, in tolerances"),
        Column("after", "", 2, "bias of the base, in tolerances"),
        Column("standard error", "", 2, "bias of the base, in tolerances"),
        Column("ratio", "", 2, "bias of the base, in tolerances"),
        Column("transmission error", "", 3, "held-out shrinkage"),
        Column("leading channel", "", 3, "held-out shrinkage"),
        Column("end over noise floor", "", 3),
    )
    note = (
        "Medians. The bias is the root mean square distance of mechanical parameters and error "
        "amplitudes from a fit to the same rig and noise without the effect, of those that this "
        f"fit knows to better than {DETERMINED:g} tolerances; beside it the standard error of the "
        "same fit. A ratio counts where the bias exceeds that error. Root mean square over all "
        f"cases: {_pooled(outcomes, 'bias')} of the bias is left, with the parameters that no "
        f"record determines {_pooled(outcomes, 'bias_of_all')}. The leading channel is that in "
        "which the base stands out of the noise most; the end is its."
    )
    return Table("effects", "Each listed effect, alone", columns, tuple(rows),
                 note=note)  # fmt: skip


def _pooled(outcomes: Sequence[Outcome], name: str) -> str:
    """Return the ratio of root mean squares over all cases, after the revision to before it."""
    numbers = [
        outcome.numbers
        for outcome in select(outcomes, "single")
        if f"{name}_before" in outcome.numbers
    ]
    squares = [
        sum(values[f"{name}_{state}"] ** 2 for values in numbers) for state in ("after", "before")
    ]
    return significant((squares[0] / squares[1]) ** 0.5, 2) if numbers else "none"


def tools_table(outcomes: Sequence[Outcome]) -> Table:
    """Return how often simpler tools and chance are right on the same cases."""
    rows: list[tuple[Cell, ...]] = []
    for kind in COMPARED:
        chosen = select(outcomes, kind)
        expected = {"none": "adequate", "unlisted": "unlisted"}.get(kind)
        rates: dict[str, Estimate] = {
            "this workflow, name or class": share([outcome.right_answer for outcome in chosen]),
            "this workflow, first name alone": share([outcome.right_first for outcome in chosen]),
        }
        for tool in RIVALS:
            answers = [outcome.answers.get(tool, "error") == (expected or outcome.case.truth)
                       for outcome in chosen]  # fmt: skip
            rates[_plain(tool)] = share(answers)
        for tool, estimate in rates.items():
            rows.append(
                (KINDS[kind], tool, estimate.n, estimate.value, estimate.low, estimate.high)
            )
        rows.append((KINDS[kind], "chance", None, 1.0 / _ANSWERS, None, None))
    columns = (
        Column("hidden"),
        Column("tool"),
        Column("cases"),
        Column("rate", "", 3, "right"),
        Column("low", "", 3, "right"),
        Column("high", "", 3, "right"),
    )
    note = (
        f"Chance picks one of {_ANSWERS} answers: {len(LISTED)} names, adequate, unlisted. "
        "Right are adequate where nothing is hidden, unlisted, and the effect's name."
    )
    return Table("tools", "What simpler tools say of the same cases", columns, tuple(rows),
                 note=note)  # fmt: skip


def wrong_table(outcomes: Sequence[Outcome]) -> Table:
    """Return every wrong answer that is given with confidence."""
    wrong = [outcome for outcome in outcomes if outcome.wrong_confident]
    title = f"Wrong answers that are given with confidence: {len(wrong)}"
    return _cases_table("wrong", title, wrong, folded=False)


def misses_table(outcomes: Sequence[Outcome]) -> Table:
    """Return every case whose verdict is not what it must be."""
    missed = [outcome for outcome in outcomes if not outcome.right_answer]
    title = f"Cases whose verdict is not what it must be: {len(missed)}"
    return _cases_table("misses", title, missed, folded=True)


def _cases_table(name: str, title: str, chosen: Sequence[Outcome], folded: bool) -> Table:
    rows = tuple(
        (outcome.case.kind, outcome.case.number, outcome.case.truth.replace("+", " + "),
         outcome.case.forms, outcome.case.stress.replace("_", " "), outcome.status,
         outcome.probability, ", ".join(outcome.chosen),
         ", ".join(map(_plain, outcome.equivalents)))
        for outcome in chosen
    )  # fmt: skip
    columns = (
        Column("kind"),
        Column("case"),
        Column("hidden"),
        Column("form"),
        Column("stress"),
        Column("status"),
        Column("probability", "", 3),
        Column("preferred"),
        Column("not told from it"),
    )
    return Table(name, title, columns, rows, folded=folded)


def _judged_table(
    name: str,
    title: str,
    about: str,
    judged: Sequence[Judged],
    note: str,
    wall_times: bool = False,
) -> Table:
    rows = tuple(_judged_row(judgement) for judgement in judged)
    findings = tuple(
        scored(judgement.verdict, f"{about} {_sentence(judgement)}")
        for judgement in judged
        if judgement.measured.n
    )
    return Table(name, title, JUDGED_COLUMNS, rows, note=note, findings=findings,
                 wall_times=wall_times)  # fmt: skip


def _judged_row(judgement: Judged) -> tuple[Cell, ...]:
    measured = judgement.measured
    return (judgement.what, judgement.cases, measured.n, _asked(judgement), measured.value,
            measured.low, measured.high, judgement.verdict.lower())  # fmt: skip


def _sentence(judgement: Judged) -> str:
    measured = judgement.measured
    return (
        f"({judgement.cases}): {judgement.what}, {measured.in_words} of {measured.n}, "
        f"{_asked(judgement)} required."
    )


def _asked(judgement: Judged) -> str:
    return f"at {'least' if judgement.at_least else 'most'} {judgement.required:g}"


def _plain(name: str) -> str:
    return name.replace("_", " ")
