"""Effects that vary with the position of a port, at the orders that its records show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.laws.friction import CoulombFriction, PeriodicFriction, PeriodicTorque
from pymoo_hdte.laws.unknowns import Parameter, Values, polar, unknown, wave, wave_starts
from pymoo_hdte.mechanism import LawAt

Parts = tuple[Parameter, ...]

LARGEST = 5.0
"""Largest force of an effect, in units of the largest that the inputs or springs have."""


def _waves(name: str, orders: Sequence[float], largest: float, typical: float) -> Parts:
    """Return cosine and sine parts of lines at several orders, which are one effect."""
    return tuple(
        part for order in orders for part in wave(f"order_{order:g}_{name}", largest, typical)
    )


def _lines(kind: Any, name: str, port: str, orders: Sequence[float]) -> Any:
    def build(v: Values) -> tuple[Any, ...]:
        parts = np.reshape(v, (-1, 2))
        return tuple(
            LawAt(name, port, kind(order, phase, amplitude))
            for order, (amplitude, phase) in zip(
                orders, (polar(*one) for one in parts), strict=True
            )
        )

    return build


def periodic(port: str, orders: Sequence[float], force: float) -> list[Candidate]:
    """Return a ripple, and a friction, that vary with the position of a port at known orders.

    Parameters
    ----------
    port : str
    orders : sequence of float
        Per unit of the port's position; without any there is no candidate.
    force : float
        Size of the force that may be missing there, N or N.m.
    """
    if not orders:
        return []
    most, words = LARGEST * force, _listed(orders, ", ")
    friction = _waves("level", orders, most, force)
    mean = unknown("mean", 0.0, most, force)
    varying = _lines(PeriodicFriction, "position_dependent_friction", port, orders)
    return [
        _ripple(
            "torque_ripple",
            port,
            orders,
            force,
            f"A force at the {port} that varies with its position, orders {words}, and acts on the "
            "motion.",
        ),
        Candidate(
            "position_dependent_friction",
            port,
            (*friction, mean),
            wave_starts((*friction, mean)),
            lambda v: (
                *varying(v[:-1]),
                LawAt("coulomb_friction", port, CoulombFriction(v[-1])),
            ),
            f"Friction that varies with the position of the {port}, orders {words}.",
            form=_listed(orders, "+"),
        ),
    ]


def of_reading(port: str, orders: Sequence[float], force: float) -> list[Candidate]:
    """Return a ripple of a force sensor's reading at known orders; the arguments as `periodic`."""
    if not orders:
        return []
    return [
        _ripple(
            "kinematic_error",
            port,
            orders,
            force,
            f"The reading of {port} varies with the position, orders {_listed(orders, ', ')}, and "
            "has one amplitude at all speeds run: it is kinematic, and no torque that moves "
            "inertias.",
        )
    ]


def _ripple(
    name: str, port: str, orders: Sequence[float], force: float, sentence: str
) -> Candidate:
    parts = _waves("amplitude", orders, LARGEST * force, force)
    build = _lines(PeriodicTorque, name, port, orders)
    form = _listed(orders, "+")
    return Candidate(name, port, parts, wave_starts(parts), build, sentence, form=form)


def _listed(orders: Sequence[float], between: str) -> str:
    return between.join(f"{order:g}" for order in orders)
