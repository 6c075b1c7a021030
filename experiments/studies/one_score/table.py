"""The table of a comparison: what was said of each case, and how it compares with the truth."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from experiments.studies.one_score.comparison import Comparison
from pymoo_hdte.discrepancy._selection.decision import Decision, Name, decide
from pymoo_hdte.discrepancy._selection.verdict import Verdict

COLUMNS = (
    "case", "truth", "status_today", "said_today", "answer_today", "status", "said", "answer",
    "probability", "outside", "next", "next_odds", "without_truth", "sets", "seconds_search",
    "seconds_score",
)  # fmt: skip

Said = tuple[str, Sequence[frozenset[Name]]]
"""A status, and the sets of names that are said; several of a class."""


def said_today(verdict: Verdict) -> Said:
    """Return what a verdict says."""
    if verdict.chosen is None or verdict.status in ("adequate", "unlisted"):
        return verdict.status, []
    return verdict.status, [item.names for item in (verdict.chosen, *verdict.equivalent)]


def said_by(decision: Decision) -> Said:
    """Return what a decision says."""
    plain = decision.status in ("adequate", "unlisted")
    return decision.status, [] if plain else decision.members


def answer(truth: Mapping[str, Any], said: Said, of_bench: Collection[str] = ()) -> str:
    """Return "right", "partly", "missed" or "wrong" (said without qualification, and false).

    Nuisances ``of_bench`` are told beside a drive that lacks nothing.
    """
    status, members = said
    wanted = set(truth["effects"])
    names = [{name for name, _ in member} for member in members]
    first = names[0] if names else set()
    sure = status in ("named", "parameter")
    if truth.get("parameters"):
        only = status == "parameter" or (sure and first == {"parameter"})
        return "right" if only else "wrong" if sure else "missed"
    if not wanted:
        return "right" if status == "adequate" else "wrong" if sure else "missed"
    if wanted == {"unlisted"}:
        listed = truth.get("name_if_listed")
        port = truth.get("port")
        by_name = first == {listed} and all(
            port in (None, place) for _, place in (members[0] if members else ())
        )
        in_part = status == "partial" and (by_name or not first)
        told = status == "adequate" and listed in of_bench
        if status == "unlisted" or in_part or told or (sure and by_name):
            return "right"
        return "wrong" if sure else "missed"
    if status == "named":
        elsewhere = "port" in truth and {port for _, port in members[0]} != {truth["port"]}
        if first == wanted and not elsewhere:
            return "right"
        return "partly" if first < wanted and not elsewhere else "wrong"
    if status == "class":
        return "missed" if wanted not in names else "right" if len(names) <= 5 else "partly"
    if status == "partial" and first and first <= wanted:
        return "partly"
    return "wrong" if status == "parameter" else "missed"


def answer_of_log(truth: Mapping[str, Any], said: Said) -> str:
    """Return "right", "honest" or "wrong" for a log of a real machine.

    ``any`` and ``all`` are names of which one, or each, is there; ``also`` those that may be.
    """
    status, members = said
    names = {name for name, _ in members[0]} if members else set()
    some, every = set(truth.get("any", [])), set(truth.get("all", []))
    found = (not some or bool(names & some)) and every <= names
    sure = status in ("named", "parameter")
    if truth.get("ends"):
        return "right"
    if (
        "absent" not in truth
        and sure
        and not (found and names <= some | every | set(truth.get("also", [])))
    ):
        return "wrong"
    return (
        "right" if (some | every) and found and status not in ("unlisted", "adequate") else "honest"
    )


def row_of(
    case: str, truth: Mapping[str, Any], verdict: Verdict, found: Comparison, seconds: float
) -> dict[str, Any]:
    """Return a row of the table."""
    today, now = said_today(verdict), said_by(found.decision)
    top = found.sets[0]
    of_bench = {candidate.name for candidate in top.candidates if candidate.nuisance}
    of_campaign = "effects" in truth
    other = next(
        (entry for entry in found.sets[1:] if entry.explanation.names != top.explanation.names),
        None,
    )
    return dict(
        zip(
            COLUMNS,
            (
                case,
                _truth(truth),
                today[0],
                _words(today[1]),
                answer(truth, today) if of_campaign else answer_of_log(truth, today),
                now[0],
                _words(now[1]),
                answer(truth, now, of_bench) if of_campaign else answer_of_log(truth, now),
                f"{found.decision.probability:.3f}",
                f"{found.decision.outside:.3f}",
                other.explanation.label if other else "-",
                f"{other.weight - top.weight:.1f}" if other else "-",
                without_truth(truth, found),
                sum(not entry.outside for entry in found.sets),
                f"{seconds:.1f}",
                f"{found.seconds:.1f}",
            ),
            strict=True,
        )
    )


def without_truth(truth: Mapping[str, Any], found: Comparison) -> str:
    """Return what would be said if the library lacked the effects that are there.

    To the first effect only: sets with it are left out. A name that is then said without
    qualification, and is not of the truth, is a false one.
    """
    wanted = [*truth.get("effects", []), *truth.get("any", []), *truth.get("all", [])]
    wanted = [name for name in wanted if name != "unlisted"]
    wanted += [truth["name_if_listed"]] if "name_if_listed" in truth else []
    rest = [
        entry
        for entry in found.sets
        if not any(name == missing for missing in wanted for name, _ in entry.explanation.names)
    ]
    if not wanted or not rest or len(rest) == len(found.sets):
        return "-"
    decision = decide([entry.explanation for entry in rest], [entry.prior for entry in rest])
    status, members = said_by(decision)
    return f"{status} {_words(members)}".strip()


def _truth(truth: Mapping[str, Any]) -> str:
    if truth.get("parameters"):
        return "parameters"
    if "effects" in truth:
        return "+".join(truth["effects"]) or "-"
    return "+".join(truth.get("all", [])) or "|".join(truth.get("any", [])) or "not known"


def _words(members: Sequence[frozenset[Name]]) -> str:
    return " | ".join("+".join(f"{name}:{port}" for name, port in sorted(m)) for m in members)
