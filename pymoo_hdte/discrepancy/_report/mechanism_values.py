"""Effects and parameters of a mechanism as a verdict has them: values, intervals and units."""

from __future__ import annotations

from typing import Any

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.intervals import Spread
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.unknowns import line_with_variance
from pymoo_hdte.mechanism import Mechanism
from pymoo_hdte.mechanism.quantity_units import base_unit, unit_of_number


def effects(finding: MechanismFinding) -> list[dict[str, Any]]:
    """Return the accepted effects with values and 95 % intervals."""
    fitted = finding.accepted
    spread = Spread(finding.data, fitted)
    documents = []
    for candidate, place in fitted.places:
        rows = range(place.start, place.stop)
        parameters = _parameters(fitted, spread, _rows(fitted, candidate, rows))
        for name, document in parameters.items():
            document["unit"] = _unit(finding.mechanism, candidate, name)
        documents.append(
            {
                "name": candidate.name,
                "port": candidate.port,
                "sentence": candidate.sentence,
                "parameters": parameters,
                "at_bound": [
                    fitted.parameters[row].name for row in rows if fitted.bound_sides[row] != 0.0
                ],
            }
        )
    return documents


def ripples(finding: MechanismFinding) -> list[dict[str, Any]]:
    """Return the ripples beyond the band as effects, with values and 95 % intervals."""
    documents = [effect for line in finding.ripples.lines for effect in line.as_dicts()]
    for effect in documents:
        of_shaft = effect_named(effect["name"]).unit
        for name, document in effect["parameters"].items():
            document["unit"] = unit_of_number(
                finding.mechanism, effect["port"], name, of_shaft(name)
            )
    return documents


def _unit(mechanism: Mechanism, candidate: Candidate, name: str) -> str:
    if candidate.releases is not None or candidate.unit is None:
        return base_unit(mechanism, name)
    return unit_of_number(mechanism, candidate.port, name, candidate.unit(name))


def _rows(fitted: Fit, candidate: Candidate, rows: range) -> range:
    """Return the rows of a candidate's parameters, or of the quantity that it frees."""
    if candidate.releases is None:
        return rows
    place = [parameter.name for parameter in fitted.parameters].index(candidate.releases)
    return range(place, place + 1)


def quantities(finding: MechanismFinding) -> dict[str, Any]:
    """Return the fitted values of the mechanism with 95 % intervals."""
    spread = Spread(finding.data, finding.accepted)
    by_name = _parameters(finding.accepted, spread, range(len(finding.data.base)))
    for name, document in by_name.items():
        document["unit"] = base_unit(finding.mechanism, name)
    return by_name


def _parameters(fitted: Fit, spread: Spread, rows: range) -> dict[str, Any]:
    """Return values with intervals, SI; cosine and sine parts as amplitude and phase.

    The interval of a value that ended at a bound ends there too, and does not hold: it says so.
    """
    by_name: dict[str, Any] = {}
    for row in rows:
        parameter, value = fitted.parameters[row], float(fitted.values[row])
        name, reach = parameter.name, float(spread.reach[row])
        if not parameter.line:
            # The fit could not exceed its bounds.
            bounds = parameter.lower, parameter.upper
            by_name[name] = _with_interval(value, spread.covariance[row, row], reach, *bounds)
            by_name[name]["at_bound"] = bool(fitted.bound_sides[row])
        if not parameter.begins_line:
            continue
        pair = slice(row, row + 2)
        cosine, sine = fitted.values[pair]
        amplitude, phase = line_with_variance(cosine, sine, spread.covariance[pair, pair])
        reach = float(spread.reach[pair].max())
        name = parameter.line
        by_name[name] = _with_interval(*amplitude, reach, lower=0.0)
        by_name[f"{name}_phase"] = _with_interval(*phase, reach)
        for part in (name, f"{name}_phase"):
            by_name[part]["at_bound"] = bool(np.any(fitted.bound_sides[pair]))
    return by_name


def _with_interval(
    value: float, variance: float, reach: float, lower: float = -np.inf, upper: float = np.inf
) -> dict[str, Any]:
    half = reach * float(np.sqrt(max(variance, 0.0)))
    interval = np.clip([value - half, value + half], lower, upper)
    return {"value": value, "interval95": interval.tolist()}
