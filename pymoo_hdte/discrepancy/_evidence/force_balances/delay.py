"""Delay between a force and the motion that it causes, by the phase of the force balance.

A delay turns the phase of a force in proportion to frequency, which no mass, damper, spring or
friction does; see `input_fit` for what is fitted beside it. Where the ranges of frequency do not
agree on it, or where much is unexplained, its interval is wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._evidence.force_balances.input_fit import InputFit, Rows
from pymoo_hdte.mechanism import LawAt

_ROUNDS = 20
_SETTLED = 1e-4
"""Change of a delay, in periods of the cutoff, below which it is found."""
_QUOTIENT = 1e-2
"""Half the step of the derivative by a delay, in periods of the cutoff."""
_LONGEST = 2.0
"""Largest delay in periods of the cutoff; the records have twice as much beside their rows."""


@dataclass(frozen=True)
class Delay:
    """The time by which a force acts later than its record says.

    Attributes
    ----------
    input : str
    value : float
        s; negative where the record is late.
    spread : float
        Half the width of its interval, s: of 95 % by chance, or all that a disturbance of the size
        of the residual can do.
    samples : float
        The value in samples of the slowest record.
    """

    input: str
    value: float
    spread: float
    samples: float

    @property
    def evident(self) -> bool:
        """Whether its interval excludes zero."""
        return abs(self.value) > self.spread


def delays(data: MeasuredData, effects: tuple[LawAt, ...] = ()) -> list[Delay]:
    """Return the delay of each input that can be told, each with the others as recorded.

    Parameters
    ----------
    data : MeasuredData
        Force balances of the records.
    effects : tuple of LawAt
        Laws that were found, whose sizes are fitted with the delay.
    """
    found = (_delay(data, one.name, effects) for one in data.mechanism.inputs)
    return [one for one in found if one is not None]


def _delay(data: MeasuredData, name: str, laws: tuple[LawAt, ...]) -> Delay | None:
    """Return the delay of an input, or None where the records do not tell it.

    The best fit is found by the method of Gauss and Newton.
    """
    fitted = InputFit(data, name, laws)
    every = np.arange(len(data.frequency))
    period = 1.0 / data.spectra[0].cutoff
    half, value = _QUOTIENT * period, 0.0

    def change(rows: Rows) -> float:
        sizes = fitted.coefficients(force, rows)
        moved = fitted.beyond(slope, sizes, rows)
        left = force[rows] - fitted.columns[rows] @ sizes
        power = float(moved @ moved)
        return -float(moved @ left) / power if power else float("nan")

    for _ in range(_ROUNDS):
        early, late = fitted.force(value - half), fitted.force(value + half)
        force, slope = fitted.force(value), (late - early) / (2.0 * half)
        step = change(every)
        value += float(np.clip(step, -0.25 * period, 0.25 * period))
        if not abs(value) < _LONGEST * period:
            return None
        if abs(step) < _SETTLED * period:
            break
    else:
        return None
    _, chance = fitted.jackknifed(change)
    sizes = fitted.coefficients(force, every)
    if not fitted.possible(sizes):
        return None
    bias = fitted.disturbance(force - fitted.columns @ sizes) / float(
        np.linalg.norm(fitted.beyond(slope, sizes, every))
    )
    spread = max(float(chance), bias)
    slowest = max(one.record.step for one in data.spectra)
    return Delay(name, value, spread, value / slowest) if spread < period else None
