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
    content = plan.as_dict()
    fitted = sum(test["role"] == "train" for test in content["test"])
    held_out = len(content["test"]) - fitted
    reached = sum(effect["power"] >= plan.wanted for effect in content["effect"])
    apart = sum(pair["power"] >= plan.wanted for pair in content["pair"])
    shown = _share(reached, len(content["effect"]), "effect", "effects")
    separated = _share(apart, len(content["pair"]), "pair of effects", "pairs of effects")
    sentences = [
        f"{fitted} tests to fit and {held_out} to hold out: each with a chance of at least "
        f"{100.0 * plan.wanted:g} %, they show {shown} and separate {separated}."
    ]
    document = heading("plan", sentences, plan.missed) | {"model": model} | content
    del document["not_reached"]
    words = {"use": _USE, "in_words": in_words, "chance": _chance, "braking": braking}
    rows = {"weakest": weakest(document), "document": document, "timed": timed(document), **words}
    FOLDER.write(out, page("pymoo_hdte.cli", "plan.html.j2", **rows), document,
                 {PLAN_FILE: toml_text(document)})  # fmt: skip
    return document


def _share(count: int, total: int, what: str, plural: str) -> str:
    """Return words such as ``2 of 3 effects``, ``all 3 effects`` or ``the only effect``."""
    if total < 2:
        return f"the only {what}" if count else f"no {what}"
    amount = {0: "none of", total: "all"}.get(count, f"{count} of")
    return f"{amount} {total} {plural}"


def _chance(power: float | None) -> str:
    return "" if power is None else chance_words(power)


def weakest(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Return for each effect its power, and the competing effect that resembles it most."""
    rows = []
    for effect in document["effect"]:
        name, power = effect["effect"], effect["power"]
        pairs = [pair for pair in document["pair"] if name in (pair["effect"], pair["rival"])]
        nearest = min(pairs, key=lambda pair: pair["power"], default=None)
        rival, apart = "", None
        if nearest is not None:
            rival = nearest["rival"] if nearest["effect"] == name else nearest["effect"]
            apart = nearest["power"]
        rows.append({"effect": name, "power": power, "rival": rival, "apart": apart})
    return rows


def timed(document: dict[str, Any]) -> bool:
    """Return whether the tests have times: a session in which nothing drifts has none."""
    return any(test.get("elapsed_s") for test in document["test"])


def braking(test: dict[str, Any]) -> float:
    """Return the load against the motion of a running test, N.m; negative where it drives."""
    return test["load_torque_Nm"] if test["direction"] == "forward" else -test["load_torque_Nm"]


def plan_table(document: dict[str, Any], out: Path) -> list[str]:
    """Return the lines for the terminal: tests, powers, and what is not reached."""
    start = f" {'s':>7}" if timed(document) else ""
    lines = [*document["sentences"], "", f"{'role':9} {'r/min':>8} {'N.m':>8}{start}  test"]
    for test in document["test"]:
        if test["test"] == "running":
            speed, load = abs(test["input_speed_rpm"]), braking(test)
            time = start and f" {test['elapsed_s']:7.5g}"
            what = f"{time}  {test['direction']}{', the load drives' if load < 0.0 else ''}"
            lines.append(f"{test['role']:9} {speed:8.5g} {load:8.4g}{what}")
        else:
            torque, time = test["largest_torque_Nm"], " " * len(start)
            lines.append(f"{test['role']:9} {'':8} {torque:8.4g}{time}  torsion sweep")
    widest = max((len(effect["effect"]) for effect in document["effect"]), default=6)
    lines += ["", f"{'effect':{widest}}  {'shown':>13}  {'apart':>13}  from"]
    for row in weakest(document):
        shown, apart = _chance(row["power"]), _chance(row["apart"])
        lines.append(f"{row['effect']:{widest}}  {shown:>13}  {apart:>13}  {row['rival']}")
    return [*lines, "", *document["limits"], f"Report: {out / PAGE_FILE}"]
