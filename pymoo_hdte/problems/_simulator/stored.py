"""Robust problems on disk: inputs, surrogate and statistics, without the simulator."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.archive import FileFormat
from pymoo_hdte.checks import InvalidInput, whole_number
from pymoo_hdte.problems._simulator.crashes import CrashProbability
from pymoo_hdte.problems._simulator.distributions import described, rebuilt
from pymoo_hdte.problems._simulator.inputs import Design, Inputs
from pymoo_hdte.problems._simulator.requested import least_tail
from pymoo_hdte.problems._simulator.sampled_statistics import CVaR, FailureProbability, Quantile
from pymoo_hdte.problems._simulator.statistics import (
    Mean,
    MeanPlusStd,
    RobustConstraint,
    Statistic,
    Std,
    WorstCase,
)
from pymoo_hdte.surrogate._rare.events import Event, event_from
from pymoo_hdte.surrogate._sparse.adaptive import AdaptiveFit
from pymoo_hdte.surrogate._sparse.moments import SparseMoments
from pymoo_hdte.surrogate._sparse.polynomial import SparsePolynomial
from pymoo_hdte.surrogate._sparse.success import DRAWN, Success, rows_of
from pymoo_hdte.surrogate._sparse.terms import closed

Array = NDArray[np.float64]

STATISTICS: dict[str, type[Statistic]] = {
    kind.__name__: kind
    for kind in (
        *(Mean, Std, MeanPlusStd, WorstCase),
        *(Quantile, CVaR, FailureProbability, CrashProbability),
    )
}
HIGHEST_DEGREE = 100
"""Largest degree that is read from a file; surrogates have 60 at most."""
_OF_RESPONSES = ("mean_error", "std_error", "smallest_scatter")
_OF_SUCCESS = ("success_indices", "success_coefficients", "success_draws")
_OF_OWN = ("own_indices", "own_coefficients")
_OF_POINTS = ("failed", "held_out_points", "points")

FORMAT = FileFormat(
    "pymoo_hdte robust problem",
    version=1,
    fields=(
        *("designs", "noise", "responses", "objectives", "constraints", "n_runs", "tails"),
        "refusal",
    ),
    arrays=(
        *("indices", "coefficients", *_OF_RESPONSES, *_OF_POINTS, "held_out_error", "truth"),
        *(*_OF_SUCCESS, *_OF_OWN),
    ),
)


_OF_FIT = (*_OF_RESPONSES, *_OF_POINTS, "held_out_error", "truth")


def _of_success(fit: AdaptiveFit) -> dict[str, Array]:
    """Return the latent polynomial and its draws on the terms of the latter; nothing for None."""
    if fit.success is None:
        return dict.fromkeys(_OF_SUCCESS, np.empty((0, 0)))
    draws, mode = fit.success.draws, fit.success.polynomial
    places = {tuple(row): place for place, row in enumerate(draws.indices.tolist())}
    coefficients = np.zeros((1, len(draws.indices)))
    coefficients[0, [places[tuple(row)] for row in mode.indices.tolist()]] = mode.coefficients[0]
    parts = draws.indices.astype(float), coefficients, draws.coefficients
    return dict(zip(_OF_SUCCESS, parts, strict=True))


def _read_terms(
    arrays: dict[str, Array], names: tuple[str, ...], inputs: int, rows: tuple[int, ...]
) -> list[Any] | None:
    """Return terms, (p, d), and coefficients of so many rows, (r, p); None where there are none."""
    indices = arrays[names[0]]
    if not len(indices):
        return None
    shapes = (len(indices), inputs), *((count, len(indices)) for count in rows)
    for name, shape in zip(names, shapes, strict=True):
        if arrays[name].shape != shape:
            raise InvalidInput(f"shape of {name}", arrays[name].shape, str(shape))
        if not np.all(np.isfinite(arrays[name])):
            raise InvalidInput(f"{name} of the file", arrays[name].tolist(), "finite")
    _check_indices(indices)
    return [indices.astype(int), *(arrays[name] for name in names[1:])]


def _read_success(arrays: dict[str, Array], inputs: int) -> Success | None:
    parts = _read_terms(arrays, _OF_SUCCESS, inputs, (1, DRAWN))
    if parts is None:
        return None
    indices, mode, draws = parts
    stays = np.isin(rows_of(indices), rows_of(closed(indices[mode[0] != 0.0])))
    polynomial = SparsePolynomial(indices[stays], mode[:, stays])
    return Success(polynomial, SparsePolynomial(indices, draws), np.empty(0))


def write_problem(
    path: str | os.PathLike[str],
    inputs: Inputs,
    fit: AdaptiveFit,
    responses: tuple[str, ...],
    objectives: Sequence[Statistic],
    constraints: Sequence[RobustConstraint],
    n_runs: int,
    refusal: str | None = None,
) -> None:
    """Write the parts of a `SimulatorProblem`, replacing the file in one step.

    Raises
    ------
    InvalidInput
        If a distribution or a statistic cannot be written as words and numbers, or the file would
        be too large (`pymoo_hdte._io.archive`).
    OSError
        If the file cannot be written.
    """
    header = {
        "designs": {name: _design(name, design) for name, design in inputs.designs.items()},
        "noise": [
            [list(key) if isinstance(key, tuple) else key, described(f"noise[{key!r}]", given)]
            for key, given in inputs.noise.items()
        ],
        "responses": list(responses),
        "objectives": [_statistic(statistic) for statistic in objectives],
        "constraints": [
            {
                "statistic": _statistic(constraint.statistic),
                "bound": constraint.bound,
                "side": constraint.side,
            }
            for constraint in constraints
        ],
        "n_runs": n_runs,
        "tails": _with_tails(fit),
        "refusal": refusal,
    }
    arrays = {name: getattr(fit, name) for name in _OF_FIT} | _of_success(fit)
    for prefix, polynomial in (("", fit.polynomial), ("own_", fit.own)):
        for name in ("indices", "coefficients"):
            table = np.empty((0, 0)) if polynomial is None else getattr(polynomial, name)
            arrays[prefix + name] = table.astype(float)
    FORMAT.write(path, header, **arrays)


def read_problem(
    path: str | os.PathLike[str],
) -> tuple[
    Inputs,
    AdaptiveFit,
    tuple[str, ...],
    list[Statistic],
    list[RobustConstraint],
    int,
    str | None,
]:
    """Return the parts from a file that `write_problem` made.

    Raises
    ------
    InvalidInput
        As `FileFormat.read`, or if its parts do not make a problem; names the part.
    OSError
        If the file cannot be read.
    """
    header, arrays = FORMAT.read(path)
    # The parts check themselves; whatever else is wrong with a part is said as it comes.
    try:
        objectives = [_read_statistic(entry) for entry in header["objectives"]]
        constraints = [_read_constraint(entry) for entry in header["constraints"]]
        tail = least_tail(objectives, constraints)
        inputs = Inputs(_designs(header["designs"]), _noise(header["noise"]), tail)
        if not objectives:
            raise ValueError("objectives are missing")
        responses = _responses(header["responses"])
        n_runs = whole_number("n_runs", header["n_runs"], 0)
        refusal = header["refusal"]
        if not isinstance(refusal, str | None):
            raise InvalidInput("refusal", refusal, "a text or nothing")
        fit = _read_fit(inputs, len(responses), n_runs, header["tails"], arrays)
    except InvalidInput:
        raise
    except Exception as error:
        allowed = f"a file of format {FORMAT.name!r} ({type(error).__name__}: {error})"
        raise InvalidInput("path", str(path), allowed) from error
    return inputs, fit, responses, objectives, constraints, n_runs, refusal


def _design(name: str, design: Design) -> dict[str, Any]:
    table: dict[str, Any] = {field.name: getattr(design, field.name) for field in fields(design)}
    for word in ("tolerance", "deviation"):
        if hasattr(table[word], "pdf"):
            table[word] = described(f"{word} of {name!r}", table[word])
    return table


def _designs(tables: dict[str, Any]) -> dict[str, Design]:
    designs = {}
    for name, table in tables.items():
        _check_fields(repr(name), table, Design)
        given = {
            word: rebuilt(f"{word} of {name!r}", value) if isinstance(value, dict) else value
            for word, value in table.items()
        }
        designs[name] = Design(**given)
    return designs


def _check_fields(owner: str, table: Mapping[str, Any], kind: type[Design | Statistic]) -> None:
    """Refuse a table without some field: its default would make another problem."""
    wanted = sorted(field.name for field in fields(kind))
    if sorted(table) != wanted:
        raise InvalidInput(f"fields of {owner}", sorted(table), f"just {wanted}")


def _responses(names: Any) -> tuple[str, ...]:
    words = isinstance(names, list) and all(isinstance(name, str) for name in names)
    if not words or len(set(names)) < len(names):
        raise InvalidInput("names of the responses", names, "a list of different words")
    return tuple(names)


def _noise(rows: list[Any]) -> dict[Any, Any]:
    noise = {}
    for key, given in rows:
        names = tuple(key) if isinstance(key, list) else key
        noise[names] = rebuilt(f"noise[{names!r}]", given)
    return noise


def _statistic(statistic: Statistic) -> dict[str, Any]:
    kind = type(statistic).__name__
    if STATISTICS.get(kind) is not type(statistic):
        raise InvalidInput("statistic", statistic, f"one of {', '.join(STATISTICS)}")
    table = {field.name: getattr(statistic, field.name) for field in fields(statistic)}
    if isinstance(table.get("event"), Event):
        table["event"] = table["event"].table()
    return {"kind": kind} | table


def _read_statistic(table: Mapping[str, Any]) -> Statistic:
    given = dict(table)
    kind = given.pop("kind", None)
    if kind not in STATISTICS:
        raise InvalidInput("statistic of the file", kind, f"one of {', '.join(STATISTICS)}")
    if given.get("event") is not None:
        given["event"] = event_from(given["event"])
    _check_fields(kind, given, STATISTICS[kind])
    _check_sign("sign of a statistic", given["sign"])
    return STATISTICS[kind](**given)


def _read_constraint(table: Mapping[str, Any]) -> RobustConstraint:
    statistic = _read_statistic(table["statistic"])
    if len(table) != 3:
        raise ValueError("a constraint has a statistic, a bound and a side")
    _check_sign("side of a constraint", table["side"])
    return statistic <= table["bound"] if table["side"] > 0 else statistic >= table["bound"]


def _check_sign(field: str, given: Any) -> None:
    if isinstance(given, bool) or given not in (1.0, -1.0):
        raise InvalidInput(field, given, "1 or -1")


def _with_tails(fit: AdaptiveFit) -> list[bool]:
    """Return of which inputs the moments take the scatter beyond all runs into account."""
    whole = SparseMoments(fit.polynomial, fit.moments.axes)
    pairs = zip(whole.orthonormal, fit.moments.orthonormal, strict=True)
    return [np.array_equal(basis.nodes, fitted.nodes) for basis, fitted in pairs]


def _check_indices(indices: Array) -> None:
    """Refuse terms on which `SparseMoments` would not compute the moments of the polynomial."""
    allowed = f"0 to {HIGHEST_DEGREE}"
    if not len(indices) or not np.isin(indices, np.arange(HIGHEST_DEGREE + 1)).all():
        raise InvalidInput("indices of the file", indices.tolist(), allowed)
    rows = set(map(tuple, indices.tolist()))
    below = indices[:, None] - np.eye(indices.shape[1])
    lower = below[indices > 0.0].tolist()
    if len(rows) < len(indices) or not rows.issuperset(map(tuple, lower)):
        allowed += ", each row once, and with a row those of a degree less in each input"
        raise InvalidInput("indices of the file", indices.tolist(), allowed)


def _read_fit(
    inputs: Inputs, responses: int, n_runs: int, tails: Any, arrays: dict[str, Array]
) -> AdaptiveFit:
    indices, coefficients = arrays["indices"], arrays["coefficients"]
    axes, held_out = inputs.axes, len(arrays["held_out_points"])
    shapes: dict[str, tuple[int | None, ...]] = {
        "indices": (coefficients.shape[-1], len(axes)),
        "coefficients": (responses, len(indices)),
        **dict.fromkeys(_OF_RESPONSES, (responses,)),
        **dict.fromkeys(_OF_POINTS, (None, len(axes))),
        "held_out_error": (held_out, responses),
        "truth": (len(arrays["points"]), responses),
    }
    for name, shape in shapes.items():
        actual_shape = arrays[name].shape
        if len(actual_shape) != len(shape) or any(
            wanted not in (None, actual) for wanted, actual in zip(shape, actual_shape, strict=True)
        ):
            raise InvalidInput(f"shape of {name}", actual_shape, str(shape))
    _check_indices(indices)
    for name in ("coefficients", *_OF_RESPONSES):
        if not np.all(np.isfinite(arrays[name])):
            raise InvalidInput(f"{name} of the file", arrays[name].tolist(), "finite")
    for name in _OF_RESPONSES:
        if np.any(arrays[name] < 0.0):
            raise InvalidInput(f"{name} of the file", arrays[name].tolist(), "at least 0")
    if not isinstance(tails, list) or [type(flag) for flag in tails] != [bool] * len(axes):
        raise InvalidInput("tails", tails, f"{len(axes)} times true or false")
    polynomial = SparsePolynomial(indices.astype(int), coefficients)
    pairs = zip(axes, tails, strict=True)
    measures = [axis.measure if has_tail else axis.cut for axis, has_tail in pairs]
    others: dict[str, Any] = {name: np.array(arrays[name]) for name in _OF_FIT}
    others["success"] = _read_success(arrays, len(axes))
    own = _read_terms(arrays, _OF_OWN, len(axes), (responses,))
    others["own"] = None if own is None else SparsePolynomial(*own)
    moments = SparseMoments(polynomial, axes, measures)
    return AdaptiveFit(polynomial=polynomial, moments=moments, n_runs=n_runs, **others)
