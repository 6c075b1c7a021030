"""Gain between the record of a force and the force that moves the mechanism.

Inverse dynamics of a force with a wrong gain fits as well, with every inertia, damper and spring
wrong by its inverse. What is stated of them therefore tells the gain: each quantity gives a range,
its stated limits over its fitted value, and the gain lies where these ranges meet. See `input_fit`
for what is fitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pymoo_hdte.discrepancy._evidence.force_balances.delay import Delay
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.input_fit import InputFit
from pymoo_hdte.mechanism import LawAt


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
    fitted = InputFit(data, name, effects)
    force = fitted.force(delay)
    values, chance = fitted.jackknifed(lambda rows: fitted.coefficients(force, rows))
    if not fitted.possible(values):
        return None
    left = fitted.disturbance(force - fitted.columns @ values)
    lower, upper, against = 0.0, math.inf, list[str]()
    for place, (quantity, (least, most)) in enumerate(fitted.stated.items()):
        own = fitted.without(place)
        spread = max(float(chance[place]), left / own)
        smallest, largest = values[place] - spread, values[place] + spread
        low = least / largest if largest > 0.0 else math.inf
        high = most / smallest if smallest > 0.0 else math.inf
        if not low <= 1.0 <= high:
            against.append(quantity)
        lower, upper = max(lower, low), min(upper, high)
    return GainRange(name, lower, upper, tuple(against)) if lower <= upper else None
