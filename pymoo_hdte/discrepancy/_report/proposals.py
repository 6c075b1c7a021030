"""What to add to ``rig.toml`` or ``campaign.toml`` once there is a verdict."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pymoo_hdte._io.budget import Budget, regular_file
from pymoo_hdte._io.encodings import decoded
from pymoo_hdte._io.toml import read_toml
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.campaign_keys import CAMPAIGN_FILE
from pymoo_hdte.discrepancy._records.drafts.rig_draft import EDIT
from pymoo_hdte.discrepancy._records.rig_files import RIG_FILE
from pymoo_hdte.discrepancy._report.folder import FOLDER

_PER_INPUT_TURN = 2.0
"""Ripple of a harmonic drive, whose wave generator has two lobes."""
_UNSURE = ("class", "partial", "unlisted")


def described(folder: Path) -> Path | None:
    """Return the file that describes the records of a folder, None where there is none.

    Parameters
    ----------
    folder : Path
    """
    return next(
        (folder / file for file in (RIG_FILE, CAMPAIGN_FILE) if (folder / file).is_file()), None
    )


def proposals(folder: Path) -> dict[str, Any]:
    """Return what to do next with a folder that has been described.

    Parameters
    ----------
    folder : Path
        With `RIG_FILE` or `CAMPAIGN_FILE`.

    Returns
    -------
    dict
        ``file``, ``verdict`` (path, or None), ``edits`` (numbers of lines that still ask for
        something), and ``sentences``.

    Raises
    ------
    InvalidInput
        If there is no such file, it is no TOML, or the verdict is none of this package.
    OSError
        If a file cannot be read.
    """
    path = described(folder)
    if path is None:
        raise InvalidInput("FOLDER", str(folder), f"one with {RIG_FILE} or {CAMPAIGN_FILE}")
    top = read_toml(path)
    stated = {name: top.take(name, "") for name in top.names()}
    edits = _edits(path)
    sentences = [f"{path.name} is there already, and stays as it is."]
    if edits:
        lines = ", ".join(map(str, edits))
        sentences.append(f"Lines of it that still say {EDIT}: {lines}.")
    source = _newest(folder)
    document: dict[str, Any] = {"file": path.name, "verdict": None, "edits": edits}
    if source is None:
        sentences.append(
            f"There is no verdict in a folder below. Run: pymoo-hdte discrepancy {folder} --out "
            f"{folder / 'report'}"
        )
        return document | {"sentences": sentences}
    verdict = _read(source)
    report = source.parent.relative_to(folder).as_posix()
    sentences.append(
        f"Proposed from {report}/{source.name}, whose verdict is: {verdict['status']}."
    )
    sentences += [f"- {text}" for text in _proposed(verdict, stated, report, path.name)]
    return document | {"verdict": str(source), "sentences": sentences}


def _edits(path: Path) -> list[int]:
    lines = decoded(path.read_bytes()).splitlines()
    # The first lines of a draft explain the word.
    return [
        number
        for number, line in enumerate(lines, 1)
        if EDIT in line.partition("#")[2] and number > 2
    ]


def _newest(folder: Path) -> Path | None:
    paths = [path for path in folder.glob(f"*/{FOLDER.document}") if path.is_file()]
    return max(paths, key=lambda path: (path.stat().st_mtime_ns, str(path)), default=None)


def _read(path: Path) -> dict[str, Any]:
    Budget.now().check("bytes", regular_file(path), path.name)
    try:
        verdict = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise InvalidInput(str(path), str(error), "a verdict of pymoo-hdte discrepancy") from None
    if not isinstance(verdict, dict) or not isinstance(verdict.get("status"), str):
        raise InvalidInput(str(path), type(verdict).__name__, "a verdict of pymoo-hdte discrepancy")
    return verdict


def _proposed(
    verdict: Mapping[str, Any], stated: Mapping[str, Any], report: str, file: str
) -> Iterator[str]:
    """Yield one proposal after another, what to correct first."""
    effects = [effect for effect in _tables(verdict.get("effects")) if "name" in effect]
    yield from _at_bounds(verdict)
    yield from _gear(effects, stated)
    for name, table in _named(stated.get("inputs")):
        if "gain" not in table:
            yield (
                f"Sizes are per unit of {name}. If you know its force or torque per unit, add to "
                f"[inputs.{name}]: gain = {{ value = ... }}, and give the other values for it."
            )
    if verdict["status"] in _UNSURE and not effects:
        yield (
            "Nothing of the library explains the misfit: check signs, units and ratios first, and "
            "whether a delay is between the signals."
        )
    for effect in _tables(verdict.get("offered")):
        share = effect.get("removes")
        if isinstance(share, int | float) and "name" in effect:
            yield (
                f"{effect['name']} at the {effect.get('port', 'drive')} would remove "
                f"{100.0 * share:.0f} % of what is left, but is not sure enough to be named: a "
                "further test may show it."
            )
    model = verdict.get("revised_model")
    if effects and isinstance(model, dict) and file == RIG_FILE:
        names = ", ".join(str(effect["name"]) for effect in effects)
        yield (
            f"To ask what is missing beside {names}: add --believed {report}/{model.get('file')}, "
            f'or put model = "{report}/{model.get("file")}" into {file} in the place of its '
            "coordinates, ports, inputs and effects."
        )
    elif effects and isinstance(model, dict):
        yield f"To ask what else is missing: add --believed {report}/{model.get('file')}."
    if not verdict.get("held_out"):
        yield (
            "No record was held out, so that nothing is validated: record a second test of another "
            'kind and list it with role = "held_out".'
        )
    following = verdict.get("next_experiment")
    if isinstance(following, dict) and isinstance(following.get("description"), str):
        yield f"Test to make next: {following['description']}"


def _at_bounds(verdict: Mapping[str, Any]) -> Iterator[str]:
    base = verdict.get("base")
    for name, value in base.items() if isinstance(base, dict) else ():
        bound = isinstance(value, dict) and value.get("at_bound")
        if bound and isinstance(value.get("value"), float):
            yield (
                f"The {name} is at the bound of what is allowed, {value['value']:.3g} "
                f"{value.get('unit', '')}".rstrip()
                + ": allow more by a larger factor, or correct the value, if it is a guess."
            )


def _gear(effects: Sequence[Mapping[str, Any]], stated: Mapping[str, Any]) -> Iterator[str]:
    geared = {name for name, table in _named(stated.get("ports")) if "gear" in table}
    for effect in effects:
        order = (effect.get("parameters") or {}).get("order", {})
        order = order.get("value") if isinstance(order, dict) else None
        port = str(effect.get("port", ""))
        if effect["name"] != "torque_ripple" or port in geared:
            continue
        if isinstance(order, int | float) and order > 10.0 * _PER_INPUT_TURN:
            ratio = order / _PER_INPUT_TURN
            yield (
                f"The ripple of order {order:.5g} is twice per input turn of a harmonic drive of "
                f"ratio {ratio:.4g}. If it has one, add to [ports.{port}]: gear = {{ ratio = "
                f'{round(ratio)}, kind = "harmonic drive" }}'
            )


def _tables(value: Any) -> list[Mapping[str, Any]]:
    return [table for table in value if isinstance(table, dict)] if isinstance(value, list) else []


def _named(value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    pairs = value.items() if isinstance(value, Mapping) else ()
    return [(name, table) for name, table in pairs if isinstance(table, Mapping)]
