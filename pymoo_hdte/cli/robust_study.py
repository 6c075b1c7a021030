"""A study of robust design as a TOML file: simulator, inputs, goals, surrogate and search."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import exp, log1p, sqrt
from pathlib import Path
from string import Template
from typing import Any

from pymoo.core.algorithm import Algorithm

from pymoo_hdte._io.budget import LARGEST_TOML
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.toml import toml_with_lines
from pymoo_hdte.checks import Complaints, InvalidInput, SeveralComplaints, real_number
from pymoo_hdte.cli.own_effects import on_one_line
from pymoo_hdte.cli.program import Program, digest_of, program_at
from pymoo_hdte.problems import (
    CrashProbability,
    CVaR,
    Design,
    Event,
    FailureProbability,
    Interval,
    Mean,
    MeanPlusStd,
    Quantile,
    Response,
    RobustConstraint,
    Scenarios,
    Std,
    WorstCase,
)
from pymoo_hdte.problems._simulator.distributions import rebuilt
from pymoo_hdte.problems._simulator.statistics import Statistic

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_FUNCTION = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):([A-Za-z_]\w*)", re.ASCII)
_RESERVED = ("input_file", "output_file", "study")
_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
_MOST_WORKERS = 256
ALGORITHMS = {
    "several": ("ElitistSwarm", "CompactSwarm", "NSGA2", "SMSEMOA"),
    "one": ("DE", "GA"),
}
"""Algorithms of this package and of pymoo by the number of objectives, the default first."""
_DISTRIBUTIONS: dict[str, tuple[str, ...]] = {
    "normal": ("mean", "std"),
    "uniform": ("lower", "upper"),
    "triangle": ("lower", "mode", "upper"),
    "log_normal": ("mean", "std"),
}


@dataclass(frozen=True)
class RobustStudy:
    """What a study's file asks for.

    Attributes
    ----------
    title : str
    simulator : callable
        A function of a module, or a `Program`.
    inputs : dict
        ``designs`` and ``noise`` of `robust_problem`.
    goals : dict
        Its ``objectives`` and ``constraints``.
    settings : dict
        Its further arguments.
    algorithm : Algorithm
    generations, seed : int
        Of the search.
    """

    title: str
    simulator: Callable[..., Any]
    inputs: dict[str, Any]
    goals: dict[str, Any]
    algorithm: Algorithm
    generations: int
    seed: int
    settings: dict[str, Any] = field(default_factory=dict)


@contextmanager
def read_study(path: Path) -> Iterator[RobustStudy]:
    """Give the study of a file; modules beside it can be imported until the block ends.

    Raises
    ------
    InvalidInput
        If something in it is not allowed; names the line, the field, its value and what is allowed.
    OSError
        If it cannot be read.
    """
    path = Path(os.path.abspath(path))
    with _importable(path.parent):
        with toml_with_lines(path) as fields:
            study = _study(fields, path.parent)
        yield study


@contextmanager
def _importable(folder: Path) -> Iterator[None]:
    """Have modules of a folder come first within, and forget those that were loaded from it."""
    before = sys.path[:]
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path[:] = before
        for name, module in list(sys.modules.items()):
            file = getattr(module, "__file__", None)
            if file and Path(file).parent == folder and name != "__main__":
                del sys.modules[name]


def _study(fields: Fields, folder: Path) -> RobustStudy:
    complaints = Complaints()
    parts: dict[str, Any] = {}
    title = fields.text("title") if fields.has("title") else "Robust design"
    for name, part in (("inputs", _inputs), ("goals", _goals), ("settings", _settings)):
        with complaints.noted():
            parts[name] = part(fields)
    with complaints.noted():
        goals = parts.get("goals", {"objectives": ()})
        parts["search"] = _search(fields, len(goals["objectives"]))
    with complaints.noted():
        names = _names_of(parts["inputs"]) if "inputs" in parts else None
        simulator, running = _simulator(fields.table("simulator"), folder, names)
    with complaints.noted():
        fields.finish()
    complaints.finish()
    algorithm, generations, seed = parts["search"]
    return RobustStudy(
        title,
        simulator,
        parts["inputs"],
        parts["goals"],
        algorithm,
        generations,
        seed,
        parts["settings"] | running,
    )


@contextmanager
def _at(place: str) -> Iterator[None]:
    """Have errors of a constructor name the table of the file where its arguments stand."""
    try:
        yield
    except SeveralComplaints:
        raise
    except InvalidInput as error:
        if error.field.startswith(place):
            raise
        raise InvalidInput(f"{place}.{error.field}", error.value, error.allowed) from None


# --- the simulator


def _simulator(
    fields: Fields, folder: Path, names: tuple[str, ...] | None
) -> tuple[Callable[..., Any], dict[str, Any]]:
    """Return the simulator, and arguments of `robust_problem` on how it is run."""
    running: dict[str, Any] = {}
    if fields.has("workers"):
        workers = fields.whole("workers", 1)
        if workers > _MOST_WORKERS:
            allowed = f"1 to {_MOST_WORKERS}"
            raise InvalidInput(fields.name_of("workers"), workers, allowed)
        running |= {"executor": workers, "at_once": workers} if workers > 1 else {}
    if fields.has("time_limit_s"):
        running["time_limit"] = fields.number("time_limit_s", above=0.0)
    for name, least in (("tries", 1), ("replicates", 2)):
        if fields.has(name):
            running[name] = fields.whole(name, least)
    if fields.has("function"):
        if fields.has("vectorised"):
            running["vectorised"] = fields.truth("vectorised")
        simulator = _function(fields.name_of("function"), fields.text("function"))
    else:
        simulator = _program(fields, folder, names)
    fields.finish()
    return simulator, running


def _function(field_name: str, given: str) -> Callable[..., Any]:
    match = _FUNCTION.fullmatch(given)
    if match is None:
        raise InvalidInput(field_name, given, "MODULE:FUNCTION, as beam:deflection")
    try:
        module = importlib.import_module(match[1])
    except (Exception, SystemExit) as error:  # A module may raise anything.
        why = f"{type(error).__name__}: {error}"
        own = Path(sys.path[0], *match[1].split(".")).with_suffix(".py")
        if own.is_file():
            why = on_one_line(error, own)
        allowed = f"a module beside the study, or installed, that can be imported ({why})"
        raise InvalidInput(field_name, given, allowed) from None
    function = getattr(module, match[2], None)
    if not callable(function):
        known = [name for name, value in vars(module).items() if callable(value) and name[0] != "_"]
        allowed = f"a function of {match[1]} ({', '.join(known[:10]) or 'which has none'})"
        raise InvalidInput(field_name, given, allowed)
    return function


def _program(fields: Fields, folder: Path, names: tuple[str, ...] | None) -> Program:
    if not fields.has("command"):
        allowed = "a function (MODULE:FUNCTION), or a command (a list of program and arguments)"
        raise InvalidInput(fields.name_of("command"), None, allowed)
    where = fields.name_of("command")
    parts = fields.texts("command")
    if not parts:
        raise InvalidInput(where, list(parts), "a list of program and arguments")
    program = program_at(f"{where}[0]", parts[0], folder)
    files: dict[str, str | None] = {"input_file": None, "output_file": None}
    for name in files:
        if fields.has(name):
            files[name] = _file_name(fields.name_of(name), fields.text(name))
    if files["input_file"] is not None and files["input_file"] == files["output_file"]:
        # What was written for the program would be taken for what it answers.
        allowed = "another name than that of the input_file"
        raise InvalidInput(fields.name_of("output_file"), files["output_file"], allowed)
    template, read = None, [program]
    if fields.has("template"):
        if files["input_file"] is None:
            allowed = "the name of the file that is made from the template"
            raise InvalidInput(fields.name_of("input_file"), None, allowed)
        file = _inside(fields.name_of("template"), fields.text("template"), folder)
        template = _text_of_template(fields.name_of("template"), file)
        read.append(file)
    marks = _responses(fields)
    given_files = [name for name, file in files.items() if file is not None]
    used = set()
    allowed_names = None if names is None else {*names, "study", *given_files}
    texts = [(f"{where}[{place}]", part) for place, part in enumerate(parts)]
    texts += [] if template is None else [(fields.name_of("template"), template)]
    for place, text in texts:
        if "\0" in text:
            raise InvalidInput(place, text, "a text without a zero byte")
        pattern = Template(text)
        if not pattern.is_valid():
            raise InvalidInput(place, text, "a text in which $ begins ${name} or is written $$")
        identifiers = set(pattern.get_identifiers())
        used |= identifiers
        if allowed_names is not None and (unknown := sorted(identifiers - allowed_names)):
            words = ", ".join(f"${{{name}}}" for name in sorted(allowed_names))
            raise InvalidInput(place, f"${{{unknown[0]}}}", f"one of {words}; a plain $ is $$")
    whole = files["input_file"] is not None and template is None
    if names is not None and not whole and (unused := [name for name in names if name not in used]):
        allowed = f"a command or template in which ${{{unused[0]}}} stands, or an input_file"
        raise InvalidInput(where, list(parts), allowed)
    # What stands beside the study and is named in the command belongs to the program.
    for part in parts[1:]:
        file = Path(Template(part).safe_substitute(study=str(folder)))
        if "${study}" in part and file.is_file():
            read.append(file)
    return Program(
        (str(program).replace("$", "$$"), *parts[1:]),
        str(folder),
        marks,
        files["input_file"],
        files["output_file"],
        template,
        digest_of(read),
    )


def _file_name(field_name: str, given: str) -> str:
    if not _FILE.fullmatch(given) or given in ("stdout.txt", "stderr.txt"):
        allowed = "the name of a file in the folder of a run: letters, digits, . _ and -"
        raise InvalidInput(field_name, given, allowed)
    return given


def _inside(field_name: str, given: str, folder: Path) -> Path:
    """Return a file that stands in the folder of the study or below it."""
    try:
        path = (folder / given).resolve()
        inside = path.is_file() and path.is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):  # A link to itself, a zero byte.
        inside = False
    if not inside:
        raise InvalidInput(field_name, given, "a file in the folder of the study")
    return path


def _text_of_template(field_name: str, path: Path) -> str:
    if path.stat().st_size > LARGEST_TOML:
        raise InvalidInput(field_name, path.name, f"a file of at most {LARGEST_TOML} bytes")
    content = path.read_bytes()
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise InvalidInput(field_name, path.name, "a text in UTF-8") from None


def _responses(fields: Fields) -> tuple[tuple[str, str | None], ...]:
    if not fields.is_table("responses"):
        names = fields.texts("responses")
        marks: dict[str, str | None] = dict.fromkeys(names)
    else:
        table = fields.table("responses")
        marks = {name: table.text(name) for name in table.names()}
    if not marks:
        raise InvalidInput(fields.name_of("responses"), [], "one name or more")
    for name in marks:
        _check_name(fields.name_of("responses"), name)
    return tuple(marks.items())


# --- inputs


def _check_name(field_name: str, name: str) -> None:
    if not _NAME.fullmatch(name) or name in _RESERVED:
        allowed = "a name of letters, digits and _ that begins with a letter"
        reserved = f", and is none of {', '.join(_RESERVED)}" if name in _RESERVED else ""
        raise InvalidInput(field_name, name, allowed + reserved)


def _names_of(inputs: Mapping[str, Any]) -> tuple[str, ...]:
    names = [key if isinstance(key, tuple) else (key,) for key in inputs["noise"]]
    return (*inputs["designs"], *(name for group in names for name in group))


def _inputs(fields: Fields) -> dict[str, Any]:
    designs: dict[str, Design] = {}
    noise: dict[Any, Any] = {}
    table = fields.table("design")
    if not table.names():
        raise InvalidInput(fields.name_of("design"), {}, "one design variable or more")
    complaints = Complaints()
    for name in table.names():
        with complaints.noted():
            _check_name(table.name_of(name), name)
            designs[name] = _design(table.table(name), table.name_of(name))
    if fields.has("noise"):
        table = fields.table("noise")
        for name in table.names():
            with complaints.noted():
                _check_name(table.name_of(name), name)
                noise[name] = _noise(table.table(name), table.name_of(name))
    if fields.has("scenarios"):
        for table in fields.tables("scenarios"):
            with complaints.noted():
                names, scenarios = _scenarios(table)
                if names in noise:
                    allowed = "other names than of the scenarios before"
                    raise InvalidInput(table.name_of("names"), list(names), allowed)
                noise[names] = scenarios
    complaints.finish()
    return {"designs": designs, "noise": noise}


def _design(fields: Fields, place: str) -> Design:
    given: dict[str, Any] = {name: fields.number(name) for name in ("lower", "upper")}
    for name in ("tolerance", "deviation"):
        if fields.is_table(name):
            given[name] = _distribution(fields.table(name), fields.name_of(name))
        elif fields.has(name):
            given[name] = fields.number(name)
    if fields.has("scale"):
        given["scale"] = fields.text("scale")
    fields.finish()
    with _at(place):
        design = Design(**given)
        design.axis(place.rpartition(".")[2])
        return design


def _noise(fields: Fields, place: str) -> Any:
    if fields.has("interval"):
        ends = fields.numbers("interval")
        fields.finish()
        if len(ends) != 2:
            raise InvalidInput(fields.name_of("interval"), list(ends), "[lower, upper]")
        with _at(place):
            return Interval(*ends)
    if fields.has("scenarios"):
        values = fields.numbers("scenarios")
        weights = fields.numbers("weights") if fields.has("weights") else None
        fields.finish()
        with _at(place):
            return Scenarios(values, weights)
    return _distribution(fields, place)


def _scenarios(fields: Fields) -> tuple[tuple[str, ...], Scenarios]:
    """Return scenarios that set several inputs at once, and the names of these."""
    names, rows = fields.texts("names"), fields.take("rows", "a list of rows, a value each name")
    weights = fields.numbers("weights") if fields.has("weights") else None
    fields.finish()
    for name in names:
        _check_name(fields.name_of("names"), name)
    whole = isinstance(rows, list) and all(
        isinstance(row, list) and len(row) == len(names) for row in rows
    )
    if len(names) < 2 or not whole or not rows:
        allowed = f"rows of {len(names)} values, one for each of two names or more"
        raise InvalidInput(fields.name_of("rows"), rows, allowed)
    with _at(fields.name_of("rows").removesuffix(".rows")):
        return names, Scenarios(rows, weights)


def _distribution(fields: Fields, place: str) -> Any:
    """Return a distribution: of some words, or one of `scipy.stats` with its own arguments."""
    name = fields.text("distribution")
    own = _DISTRIBUTIONS.get(name)
    names = fields.names() if own is None else own
    numbers = {argument: fields.number(argument) for argument in names}
    fields.finish()
    if own is not None:
        if "std" in numbers:
            real_number(f"{place}.std", numbers["std"], above=0.0)
        name, numbers = _of_scipy(name, numbers, place)
    try:
        return rebuilt(place, {"scipy": [name, [], numbers]})
    except InvalidInput as error:
        allowed = (
            f"one of {', '.join(_DISTRIBUTIONS)}, or a continuous distribution of scipy.stats"
            f" with its arguments; {error.allowed.rpartition('(')[2].rstrip(')')}"
        )
        raise InvalidInput(f"{place}.distribution", name, allowed) from None


def _of_scipy(name: str, numbers: Mapping[str, float], place: str) -> tuple[str, dict[str, float]]:
    """Return name and arguments of `scipy.stats` of one of our words."""
    if name == "normal":
        return "norm", {"loc": numbers["mean"], "scale": numbers["std"]}
    if name == "log_normal":
        mean = real_number(f"{place}.mean", numbers["mean"], above=0.0)
        # The variance of the logarithm is ln(1 + (std / mean)^2).
        variance = log1p((numbers["std"] / mean) ** 2)
        return "lognorm", {"s": sqrt(variance), "scale": mean * exp(-0.5 * variance)}
    lower = numbers["lower"]
    upper = real_number(f"{place}.upper", numbers["upper"], above=lower)
    if name == "uniform":
        return "uniform", {"loc": lower, "scale": upper - lower}
    mode = real_number(f"{place}.mode", numbers["mode"], at_least=lower, at_most=upper)
    return "triang", {"c": (mode - lower) / (upper - lower), "loc": lower, "scale": upper - lower}


# --- goals


def _goals(fields: Fields) -> dict[str, Any]:
    complaints = Complaints()
    objectives: list[Statistic] = []
    constraints: list[RobustConstraint] = []
    with complaints.noted():
        for place, table in enumerate(fields.tables("objective")):
            with complaints.noted():
                statistic = _statistic(table, fields.name_of(f"objective[{place}]"))
                if table.has("maximise") and table.truth("maximise"):
                    statistic = -statistic
                table.finish()
                objectives.append(statistic)
    if fields.has("constraint"):
        for place, table in enumerate(fields.tables("constraint")):
            with complaints.noted():
                constraints.append(_constraint(table, fields.name_of(f"constraint[{place}]")))
    complaints.finish()
    return {"objectives": objectives, "constraints": constraints}


def _constraint(fields: Fields, place: str) -> RobustConstraint:
    statistic = _statistic(fields, place)
    bounds = [name for name in ("at_most", "at_least") if fields.has(name)]
    if len(bounds) != 1:
        raise InvalidInput(f"{place}.at_most", bounds, "either at_most or at_least")
    bound = fields.number(bounds[0])
    fields.finish()
    with _at(place):
        return statistic <= bound if bounds[0] == "at_most" else statistic >= bound


_STATISTICS: dict[str, tuple[type[Statistic], tuple[str, ...]]] = {
    "mean": (Mean, ()),
    "std": (Std, ()),
    "mean_plus_std": (MeanPlusStd, ("k",)),
    "quantile": (Quantile, ("p",)),
    "cvar": (CVaR, ("p",)),
    "worst_case": (WorstCase, ()),
    "failure_probability": (FailureProbability, ()),
    "crash_probability": (CrashProbability, ()),
}


def _statistic(fields: Fields, place: str) -> Statistic:
    kind, numbers = _STATISTICS[fields.choice("statistic", tuple(_STATISTICS))]
    given: dict[str, Any] = {name: fields.number(name) for name in numbers}
    if fields.has("response"):
        given["response"] = fields.text("response")
    if kind is WorstCase and fields.has("side"):
        given["side"] = fields.text("side")
    if kind is FailureProbability:
        for name in ("above", "below"):
            if fields.has(name):
                given[name] = fields.number(name)
        joined = {"any_of": Event.__or__, "all_of": Event.__and__}
        several = [name for name in joined if fields.has(name)]
        if len(several) > 1:
            raise InvalidInput(place, several, "either any_of or all_of")
        for name in several:
            given["event"] = _event(fields, name, joined[name])
    with _at(place):
        return kind(**given)


def _event(fields: Fields, name: str, joined: Callable[[Any, Any], Event]) -> Event:
    event: Event | None = None
    for place, table in enumerate(fields.tables(name)):
        response = Response(table.text("response"))
        sides = [side for side in ("above", "below") if table.has(side)]
        if len(sides) != 1:
            where = fields.name_of(f"{name}[{place}].above")
            raise InvalidInput(where, sides, "either above or below")
        bound = table.number(sides[0])
        table.finish()
        part = response > bound if sides[0] == "above" else response < bound
        event = part if event is None else joined(event, part)
    assert event is not None
    return event


# --- surrogate and search


def _settings(fields: Fields) -> dict[str, Any]:
    if not fields.has("surrogate"):
        return {}
    table = fields.table("surrogate")
    given: dict[str, Any] = {}
    if table.has("accuracy"):
        given["accuracy"] = table.number("accuracy", above=0.0, below=1.0)
    for name, least in (("budget", 1), ("seed", 0)):
        if table.has(name):
            given[name] = table.whole(name, least)
    if table.has("accept"):
        given["accept"] = table.choice("accept", ("accurate", "best"))
    if table.has("kind"):
        given["surrogate"] = table.choice("kind", ("polynomial", "auto"))
    if table.has("positive"):
        given["positive"] = table.texts("positive")
    table.finish()
    return given


def _search(fields: Fields, n_objectives: int) -> tuple[Algorithm, int, int]:
    table = fields.table("search") if fields.has("search") else Fields({}, "search")
    several, single = ALGORITHMS["several"], ALGORITHMS["one"]
    # Where the objectives are at fault, any name will do.
    names = single if n_objectives == 1 else several if n_objectives else (*several, *single)
    name = table.choice("algorithm", names) if table.has("algorithm") else names[0]
    population = table.whole("population", 4) if table.has("population") else None
    generations = table.whole("generations", 1) if table.has("generations") else 100
    seed = table.whole("seed", 0) if table.has("seed") else 1
    table.finish()
    return _algorithm(name, population), generations, seed


def _algorithm(name: str, population: int | None) -> Algorithm:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.algorithms.moo.sms import SMSEMOA
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.algorithms.soo.nonconvex.ga import GA

    from pymoo_hdte.algorithms import CompactSwarm, ElitistSwarm

    known = ElitistSwarm, CompactSwarm, NSGA2, SMSEMOA, GA, DE
    kinds: dict[str, Callable[..., Algorithm]] = {kind.__name__: kind for kind in known}
    return kinds[name](**({} if population is None else {"pop_size": population}))
