"""Numbers of the effects that a drive is believed to have, by name: those that a fit may move.

A name joins effect, port, order (if it has them) and number by dots, in a campaign's file and in a
verdict alike: ``coulomb_friction.input.level``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import DriveEffect, LawAtPort
from pymoo_hdte.effects.effect import effect_named, place_of
from pymoo_hdte.effects.law import PORTS

_OF_PLACE = ("order", "phase")
"""Numbers that say where a wave is; a share of them is no tolerance."""


def known_values(effects: Sequence[DriveEffect]) -> dict[str, float]:
    """Return the numbers of effects that may have a tolerance, SI.

    Parameters
    ----------
    effects : sequence of DriveEffect

    Examples
    --------
    >>> from pymoo_hdte.effects.friction import CoulombFriction
    >>> known_values([LawAtPort("coulomb_friction", "input", CoulombFriction(0.05))])
    {'coulomb_friction.input.level': 0.05}
    """
    return {
        f"{_place(effect)}.{number}": float(getattr(_numbers(effect), number))
        for effect in effects
        for number in effect_named(effect.name).quantities
        if number not in _OF_PLACE
    }


def with_known_values(
    effects: Sequence[DriveEffect], values: Mapping[str, float]
) -> tuple[DriveEffect, ...]:
    """Return effects with other numbers.

    Parameters
    ----------
    effects : sequence of DriveEffect
    values : mapping of str to float
        By the names of `known_values`, SI. Absent numbers keep their values; other names are
        ignored.

    Raises
    ------
    InvalidInput
        For a number that its law does not take.
    """
    return tuple(_with_values(effect, values) for effect in effects)


def of_equal_numbers(
    effects: Sequence[DriveEffect], values: Mapping[str, NDArray[np.float64]]
) -> list[tuple[NDArray[np.int_], tuple[DriveEffect, ...]]]:
    """Return groups of vectors that share all numbers of effects, and the effects of each group.

    Parameters
    ----------
    effects : sequence of DriveEffect
    values : mapping of str to ndarray, shape (v,)
        As in `with_known_values`, for v vectors.

    Returns
    -------
    list of tuple
        Indices of the vectors of a group, and the effects with its numbers.
    """
    columns = {name: values[name] for name in known_values(effects) if name in values}
    every = np.arange(len(next(iter(values.values()))))
    return [
        (rows, with_known_values(effects, numbers)) for rows, numbers in equal_rows(columns, every)
    ]


def equal_rows(
    columns: Mapping[str, NDArray[np.float64]], rows: NDArray[np.int_]
) -> list[tuple[NDArray[np.int_], dict[str, float]]]:
    """Return places among rows at which all columns are equal, with their values there.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (v,)
    rows : ndarray of int, shape (k,)
        Those that are grouped; without columns all are equal.
    """
    if not columns:
        return [(np.arange(len(rows)), {})]
    table = np.column_stack([column[rows] for column in columns.values()])
    numbers, group = np.unique(table, axis=0, return_inverse=True)
    return [
        (np.flatnonzero(group.ravel() == place), dict(zip(columns, row, strict=True)))
        for place, row in enumerate(numbers.tolist())
    ]


def known_words(name: str) -> str:
    """Return a name of `known_values` in words.

    Examples
    --------
    >>> known_words("torque_ripple.input.2.amplitude")
    'amplitude of the torque ripple of order 2 at the input'
    """
    effect, _, address = name.partition(".")
    place, _, number = address.rpartition(".")
    port = place.partition(".")[0]
    at = f" at the {port}" if port in PORTS else ""
    order = place.removeprefix(port).removeprefix(".") if at else place
    of = f" of order {order}" if order else ""
    return f"{number} of the {effect}{of}{at}".replace("_", " ")


def known_unit(name: str) -> str:
    """Return the SI unit of a number of `known_values`."""
    return effect_named(name.partition(".")[0]).unit(name.rpartition(".")[2])


def _with_values(effect: DriveEffect, values: Mapping[str, float]) -> DriveEffect:
    given = {
        name.rpartition(".")[2]: float(values[name])
        for name in known_values([effect])
        if name in values
    }
    if not given:
        return effect
    numbers = replace(_numbers(effect), **given)
    return replace(effect, law=numbers) if isinstance(effect, LawAtPort) else numbers


def _numbers(effect: DriveEffect) -> Any:
    return effect.law if isinstance(effect, LawAtPort) else effect


def _place(effect: DriveEffect) -> str:
    name, port, order = place_of(effect)
    return ".".join([name, *([port] if port else []), *([f"{order:g}"] if order else [])])
