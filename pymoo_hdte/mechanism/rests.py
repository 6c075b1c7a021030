"""Rests: where a machine stands still, dry friction may have any force up to its breakaway.

A joint without compliance does not tell which: a law of the speed would give it the sign of noise.
Such rows bound the friction and determine no force. They are left out whether friction is known or
still looked for, so that mechanisms with and without it are compared on the same rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.motion import smoothed_noise
from pymoo_hdte.mechanism.parts import LawAt
from pymoo_hdte.mechanism.port_motion import PortMotion
from pymoo_hdte.mechanism.records import Record

Values = NDArray[np.float64]

STILL = 6.0
"""Standard deviations of the noise of a speed, below which its sign tells nothing."""
_FADES = 2.5
"""Periods of the cutoff before and after a rest in which smoothed forces still show it: a jump has
faded to 0.2 % there. In the period after, the weight of the rows rises, so that no edge of it looks
like a force."""
_WHOLE = 0.999
"""Weight of a row that counts fully, but for rounding."""
_FEWEST = 100
"""Least number of coefficients of force balances without rests, or rests stay in. They hold
the dozen unknowns of a mechanism with three effects, and their chi-square is known to 14 %."""


@dataclass(frozen=True, eq=False)
class MovingRows:
    """The rows of a record that enter the force balances, one after the other.

    Without those that are left out, so that a transform has no more coefficients than they tell:
    with zeros in their place its coefficients would be correlated, and count as more.

    Attributes
    ----------
    weight : ndarray, shape (n,)
        0 for rows that are left out. It rises from there, so that what follows them joins smoothly.
    rests : bool
        Whether the machine stands still for so long that no rows would remain without its rests,
        which then stay in. Dry friction is not determined by such a record.
    """

    weight: Values
    rests: bool = False

    @property
    def count(self) -> int:
        """Number of rows that are not left out."""
        return int(np.count_nonzero(self.weight))

    @property
    def left_out(self) -> float:
        """Share of rows that are left out."""
        return 1.0 - self.count / len(self.weight)

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Which rows count fully, shape (n,)."""
        return self.weight > _WHOLE

    @property
    def power(self) -> float:
        """Mean square of the weights of these rows."""
        return float(np.sum(self.weight**2) / self.count)

    def take(self, signal: Values) -> Values:
        """Return the weighted values, (k count,), of a signal, (k n,), with k moments a row."""
        weight = np.repeat(self.weight, len(signal) // len(self.weight))
        return (weight * signal)[weight > 0.0]

    def put(self, values: Values) -> Values:
        """Return a signal, (n,), with values (count,) in their places and zeros elsewhere."""
        signal = np.zeros_like(self.weight)
        signal[self.weight > 0.0] = values
        return signal


def moving_rows(
    mechanism: Mechanism,
    record: Record,
    cutoff: float,
    speed: dict[str, Values],
    ports: dict[str, PortMotion],
    step: float,
    known: Sequence[LawAt],
) -> MovingRows:
    """Return the rows of the motion of ports with their weights: 0 at rest, 1 elsewhere.

    At rest all coordinates stand still, or a port that known friction can hold. A rest lasts a
    period of the cutoff at least; a reversal is none.

    Parameters
    ----------
    mechanism : Mechanism
    record : Record
        The record, with the noise of its channels.
    cutoff : float
        Hz, up to which the motion is known.
    speed : dict of str to ndarray, shape (n,)
        Speeds of the coordinates, SI.
    ports : dict of str to PortMotion
    step : float
        Time step of the motions, s.
    known : sequence of LawAt
        Known laws.
    """
    period = max(round(1.0 / (cutoff * step)), 2)

    def still(values: Values, channels: Mapping[str, float]) -> NDArray[np.bool_]:
        return np.abs(values) < STILL * _noise_of_speed(channels, record, cutoff)

    standing = [still(values, {name: 1.0}) for name, values in speed.items()]
    rests = _long(np.logical_and.reduce(standing), period)
    for name in {friction.port for friction in known if friction.law.breakaway > 0.0}:
        port = mechanism.port(name)
        rests |= _long(still(ports[name].speed, {**port.motion, **port.followed}), period)
    around_rests = _spread(rests, round((_FADES + 0.5) * period))
    window = np.hanning(period + 2)
    edges = len(window) // 2, len(window) - 1 - len(window) // 2
    away = np.convolve(
        np.pad(~around_rests, edges, mode="edge"), window / window.sum(), mode="valid"
    )
    enough = 2.0 * np.count_nonzero(away) * step * cutoff >= _FEWEST
    if not rests.any():
        return MovingRows(np.ones_like(away))
    return MovingRows(away) if enough else MovingRows(np.ones_like(away), rests=True)


def _noise_of_speed(channels: Mapping[str, float], record: Record, cutoff: float) -> float:
    noise = [
        share * smoothed_noise(record.noise_of(channel), record.step, cutoff)[1]
        for channel, share in channels.items()
    ]
    return float(np.hypot.reduce(noise))


def _long(still: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """Return only the runs of True with at least `least` rows, (n,)."""
    edges = np.flatnonzero(np.diff(np.pad(still.astype(int), 1)))
    runs = np.zeros_like(still)
    for start, end in edges.reshape(-1, 2):
        runs[start:end] = end - start >= least
    return runs


def _spread(rows: NDArray[np.bool_], way: int) -> NDArray[np.bool_]:
    """Return rows, (n,), and those up to ``way`` rows before and after each of them."""
    count = np.cumsum(np.pad(rows.astype(int), (way + 1, way)))
    return np.asarray(count[2 * way + 1 :] > count[: -2 * way - 1])
