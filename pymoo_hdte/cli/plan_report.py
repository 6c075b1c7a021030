"""The files of a plan, and its table on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pymoo_hdte._io.toml import toml_text
from pymoo_hdte._reports.folder import PAGE_FILE, ReportFolder
from pymoo_hdte._reports.html import page
from pymoo_hdte.cli.command import heading
from pymoo_hdte.discrepancy._plan.plan import Plan, chance_words
from pymoo_hdte.effects.sentence_blanks import in_words

PLAN_FILE = "plan.toml"
FOLDER = ReportFolder("plan.json", (PLAN_FILE,))
_USE = {"train": "fit", "held_out": "hold out"}


def write_plan(plan: Plan, model: str, out: Path) -> dict[str, Any]:
    """Write a plan and return its document; errors as `ReportFolder.write`.

    ``model`` is the name of the model.
    """
    found = plan.as_dict()
    fitted = sum(one["role"] == "train" for one in found["test"])
    held_out = len(found["test"]) - fitted
    reached = sum(one["power"] >= plan.wanted for one in found["effect"])
    apart = sum(one["power"] >= plan.wanted for one in found["pair"])
    shown = _share(reached, len(found["effect"]), "effect", "effects")
    told = _share(apart, len(found["pair"]), "pair of effects", "pairs of effects")
    sentences = [
        f"{fitted} tests to fit and {held_out} to hold out: each with a chance of at least "
        f"{100.0 * plan.wanted:g} %, they show {shown} and separate {told}."
    ]
    document = heading("plan", sentences, plan.missed) | {"model": model} | found
    del document["not_reached"]
    words = {"use": _USE, "in_words": in_words, "chance": _chance}
    rows = {"weakest": weakest(document), "document": document, **words}
    FOLDER.write(out, page("pymoo_hdte.cli", "plan.html.j2", **rows), document,
                 {PLAN_FILE: toml_text(document)})  # fmt: skip
    return document


def _share(count: int, total: int, what: str, more: str) -> str:
    """Return such as ``2 of 3 effects``, ``all 3 effects`` or ``the only effect``."""
    if total < 2:
        return f"the only {what}" if count else f"no {what}"
    first = {0: "none of", total: "all"}.get(count, f"{count} of")
    return f"{first} {total} {more}"


def _chance(power: float | None) -> str:
    return "" if power is None else chance_words(power)


def weakest(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Return for each effect its power, and the rival from which it is hardest to tell."""
    found = []
    for one in document["effect"]:
        name, power = one["effect"], one["power"]
        pairs = [pair for pair in document["pair"] if name in (pair["effect"], pair["rival"])]
        nearest = min(pairs, key=lambda pair: pair["power"], default=None)
        rival, apart = "", None
        if nearest is not None:
            rival = nearest["rival"] if nearest["effect"] == name else nearest["effect"]
            apart = nearest["power"]
        found.append({"effect": name, "power": power, "rival": rival, "apart": apart})
    return found


def plan_table(document: dict[str, Any], out: Path) -> list[str]:
    """Return the lines for the terminal: tests, powers, and what is not reached."""
    lines = [*document["sentences"], "", f"{'role':9} {'r/min':>8} {'N.m':>8} {'s':>7}  test"]
    for one in document["test"]:
        if one["test"] == "running":
            condition = f"{one['input_speed_rpm']:8.5g} {one['load_torque_Nm']:8.4g}"
            lines.append(f"{one['role']:9} {condition} {one['elapsed_s']:7.5g}  {one['direction']}")
        else:
            torque = one["largest_torque_Nm"]
            lines.append(f"{one['role']:9} {'':8} {torque:8.4g} {'':7}  torsion sweep")
    widest = max((len(one["effect"]) for one in document["effect"]), default=6)
    lines += ["", f"{'effect':{widest}}  {'shown':>13}  {'apart':>13}  from"]
    for row in weakest(document):
        shown, apart = _chance(row["power"]), _chance(row["apart"])
        lines.append(f"{row['effect']:{widest}}  {shown:>13}  {apart:>13}  {row['rival']}")
    return [*lines, "", *document["limits"], f"Report: {out / PAGE_FILE}"]
