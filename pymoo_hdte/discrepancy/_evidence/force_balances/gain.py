"""Gain between the record of a force and the force that moves the mechanism.

Inverse dynamics of a force with a wrong gain fits as well, with every inertia, damper and spring
wrong by its inverse. What is stated of them therefore tells the gain: each quantity gives a range,
its stated limits over its fitted value, and the gain lies where these ranges meet. Friction,
gravity and a constant force are fitted at each port, as for a delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.delay import (
    Delay,
    Values,
    force_of_input,
    free_forces,
    in_units_of_noise,
    jackknifed,
)
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.balances import quantity_names

_SAME = 1e-3
"""Share of a force by which it differs from a sum of others if it is another one. Laws are means
over a step of a fortieth of a period, which lowers a sine by (pi / 40)^2 / 6."""


@dataclass(frozen=True)
class GainRange:
    """The factor by which the force of an input differs from what its record says.

    Attributes
    ----------
    input : str
    lower, upper : float
        95 %, for what is stated of the mechanism within its tolerances; infinite without a limit.
    quantities : tuple of str
        What the factor 1 contradicts.
    """

    input: str
    lower: float
    upper: float
    quantities: tuple[str, ...]

    @property
    def evident(self) -> bool:
        """Whether its interval excludes one."""
        return not self.lower <= 1.0 <= self.upper


def gains(
    data: MeasuredData, effects: tuple[LawAt, ...] = (), delays: tuple[Delay, ...] = ()
) -> list[GainRange]:
    """Return the range of each gain that is stated exactly, where the stated quantities agree.

    Parameters
    ----------
    data : MeasuredData
        Force balances of the records.
    effects : tuple of LawAt
        Laws that were found, whose sizes are fitted with the gain.
    delays : tuple of Delay
        Of inputs; those that are evident are taken out.
    """
    late = {delay.input: delay.value for delay in delays if delay.evident}
    ranges = (
        _gain(data, signal.name, effects, late.get(signal.name, 0.0))
        for signal in data.mechanism.inputs
        if signal.scaled and signal.gain.known
    )
    return [found for found in ranges if found is not None]


def _gain(
    data: MeasuredData, name: str, effects: tuple[LawAt, ...], delay: float
) -> GainRange | None:
    """Return the range of a gain; None where what is stated of the mechanism contradicts itself."""
    limits, columns = _stated(data)
    if not limits:
        return None
    force = force_of_input(data, name, delay)
    for free in free_forces(data, name, effects):
        # Beside a known weight none is looked for.
        known, _ = np.linalg.qr(np.column_stack(columns))
        if np.linalg.norm(free - known @ (known.T @ free)) > _SAME * np.linalg.norm(free):
            columns.append(free)
    every = np.column_stack(columns)
    scale = np.linalg.norm(every, axis=0)
    values, spread = jackknifed(
        data, lambda rows: np.linalg.lstsq(every[rows] / scale, force[rows], rcond=None)[0] / scale
    )
    lower, upper, against = 0.0, math.inf, []
    for place, (quantity, (least, most)) in enumerate(limits.items()):
        smallest, largest = values[place] - spread[place], values[place] + spread[place]
        if largest <= 0.0:
            # It acts the other way round, which no gain explains.
            return None
        low, high = least / largest, most / smallest if smallest > 0.0 else math.inf
        if not low <= 1.0 <= high:
            against.append(quantity)
        lower, upper = max(lower, low), min(upper, high)
    return GainRange(name, lower, upper, tuple(against)) if lower <= upper else None


def _stated(data: MeasuredData) -> tuple[dict[str, tuple[float, float]], list[Values]]:
    """Return the limits of quantities and of known laws that act, and their forces, whitened."""
    limits, columns = {}, []
    for row, quantity in enumerate(quantity_names(data.mechanism)):
        kind = quantity.partition(" of ")[0]
        if kind in ("inertia", "damping", "stiffness"):
            force = in_units_of_noise(data, [-one.terms[:, row] for one in data.spectra])
            believed = data.mechanism.quantities[quantity]
            if believed.value and np.any(force):
                limits[quantity] = believed.limits
                columns.append(force)
    for law in data.known:
        force = in_units_of_noise(data, [one.forces([law]) for one in data.spectra])
        if np.any(force):
            limits[f"{law.name} at {law.port}"] = 1.0, 1.0
            columns.append(force)
    return limits, columns
