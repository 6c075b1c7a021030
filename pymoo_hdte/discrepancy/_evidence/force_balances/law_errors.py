"""Relative errors of laws in force balances, and what no law of the library holds.

Both are Gaussian processes over the motion at a port: over its position and its speed, the latter
over the time as well. What a real machine leaves is coloured: each band of frequencies has a
noise of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.linearised import linearise
from pymoo_hdte.discrepancy._selection.process import TERMS, sine_of
from pymoo_hdte.discrepancy._selection.score import Linearised, Sized
from pymoo_hdte.effects.law import Law
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force
from pymoo_hdte.mechanism.rests import STILL, speed_noise

Matrix = NDArray[np.float64]

NOISE = float(np.log(10.0))
"""Standard deviation of the logarithm of the noise, which nobody states of a balance."""
TURNS = (1e-3, 1.0)
"""Range of the force around a turn that is not known, as a share of what holds a port at rest."""
_OF_TURN = 3
"""Functions on each side of a turn, which hold 93 % of the variance of what it may do."""
_SMOOTHED = 9
"""Coefficients over which a spectrum is smoothed, to see how coloured it is."""
_FEWEST = 20
"""Fewest coefficients of a band: they know its level to 16 %."""


@dataclass(frozen=True, eq=False)
class BalanceErrors:
    """Hypotheses of a mechanism as the score takes them.

    Attributes
    ----------
    data : MeasuredData
    base : Fit
        Without effects.
    best : Fit or None
        Of the least residuals: where these are lines, as of a motion that repeats, fewer of them
        are independent.
    """

    data: MeasuredData
    base: Fit
    best: Fit | None = None
    _of_turns: dict[str, Matrix] = field(default_factory=dict)

    @cached_property
    def channels(self) -> NDArray[np.int_]:
        """Balance and band of frequencies of each residual, of which each has a noise of its own.

        What a real machine leaves is coloured: its level changes from octave to octave. Bands are
        octaves below the highest frequency of a balance, the lowest ones together.
        """
        channels, count = np.zeros(len(self.data.frequency), dtype=int), 0
        for part in np.unique(self.data._part):
            rows = np.flatnonzero(self.data._part == part)
            frequency = self.data.frequency[rows]
            octave = np.log2(frequency.max() / np.maximum(frequency, 1e-12)).astype(int)
            sizes = np.bincount(np.minimum(octave, len(rows)))
            lowest = int(np.flatnonzero(sizes >= _FEWEST)[-1]) if sizes.max() >= _FEWEST else 0
            octave = np.minimum(octave, lowest)
            channels[rows] = count + octave
            count += lowest + 1
        return channels

    @property
    def groups(self) -> list[NDArray[np.int_]]:
        """Rows of each record and of each balance."""
        return [
            np.flatnonzero(labels == label)
            for labels in (self.data._record, self.data._part)
            for label in np.unique(labels)
        ]

    @cached_property
    def shares(self) -> Matrix:
        """Independent values that each residual counts for, shape (n,).

        By the moments of the residuals' power in each record and band (Satterthwaite, Biometrics
        Bulletin 2, 1946).
        """
        shares = np.ones(len(self.channels))
        if self.best is None:
            return shares
        power = self.best.residuals**2
        for record in np.unique(self.data._record):
            for channel in np.unique(self.channels):
                rows = np.flatnonzero((self.data._record == record) & (self.channels == channel))
                if len(rows) >= _SMOOTHED:
                    smooth = uniform_filter1d(power[rows], _SMOOTHED, mode="reflect")
                    shares[rows] = smooth.mean() ** 2 / np.mean(smooth**2)
        return shares

    @cached_property
    def least_noise(self) -> Matrix:
        """Noise of the sensors as a share of what counts as noise, shape (n_channels,)."""
        shares = np.concatenate(
            [
                (balance.noise / deviation)[balance.kept]
                for balance, deviation in zip(self.data.spectra, self.data.deviation, strict=True)
            ]
        )
        power = np.bincount(self.channels, shares**2) / np.bincount(self.channels)
        return np.asarray(np.sqrt(power))

    def linearised(self, fitted: Fit) -> Linearised:
        """Return a fit as a hypothesis."""

        def errors(candidate: Candidate, place: slice) -> Matrix | None:
            if candidate.releases is not None or not candidate.parameters:
                return None
            values = [float(value) for value in fitted.values[place]]
            columns = [
                self._column(effect.port, over, number, effect.law)
                for effect in candidate.build(values)
                for over in ("position", "speed")
                for number in range(1, TERMS + 1)
            ]
            return np.column_stack(columns)

        hypothesis = linearise(fitted, self.channels, errors, NOISE, self.shares)
        return replace(hypothesis, least_noise=self.least_noise).beside(*self._turning(fitted))

    def _turning(self, fitted: Fit) -> Iterator[Sized]:
        """Yield what dry friction may do where a port turns, starts or stops.

        The motion is smoothed over a period of the cutoff, in which it may turn at any moment, or
        rest for a while. What smoothing does to a kink of the motion is the same at every turn, and
        at every stop or start; by what it is not, turns add to the noise.
        """
        for effect in fitted.effects:
            columns = self._turns(effect.port)
            if not effect.law.breakaway or not columns.size:
                continue
            none = np.zeros(columns.shape[1])
            yield Sized(
                f"turns of {effect.name}:{effect.port}",
                effect.law.breakaway * columns,
                *TURNS,
                none,
                none > 0.0,
            )

    def _turns(self, port: str) -> Matrix:
        """Return whitened balances of a unit force around the turns of a port: see `_of_turn`."""
        if port not in self._of_turns:
            signals = [self._pulses(balance, port) for balance in self.data.spectra]
            columns = np.column_stack(
                [self._whitened(port, pulses) for pulses in zip(*signals, strict=True)]
            )
            self._of_turns[port] = columns[:, columns.any(axis=0)]
        return self._of_turns[port]

    @staticmethod
    def _pulses(balance: ForceBalance, port: str) -> Matrix:
        """Return the force around rests and around turns of a port, (4 _OF_TURN, n)."""
        speed, step = balance.ports[port].speed, float(balance.time[1] - balance.time[0])
        half = 0.5 / (balance.cutoff * step)
        still = speed_noise(balance.mechanism.port(port), balance.record, balance.cutoff)
        pulses = np.zeros((2, 2 * _OF_TURN, len(speed)))
        places = np.arange(len(speed), dtype=np.float64)
        for turn, *signs in _turns_of(speed, STILL * still, half):
            if balance.moving.weight[round(turn)]:
                near = slice(max(int(turn - half), 0), int(turn + half) + 2)
                of_turn = _of_turn((places[near] - turn) / half, *signs)
                pulses[int(signs[0] * signs[1] < 0.0), :, near] += np.array(list(of_turn))
        return pulses.reshape(-1, len(speed))

    def _whitened(self, port: str, signals: Sequence[Matrix]) -> Matrix:
        """Return whitened balances, (n,), of a force at a port in each record."""
        parts = zip(self.data.spectra, self.data.deviation, signals, strict=True)
        return np.concatenate(
            [
                (balance.of_port(port, signal) / deviation)[balance.kept]
                for balance, deviation, signal in parts
            ]
        )

    def _column(self, port: str, over: str, number: int, law: Law | None = None) -> Matrix:
        """Return whitened balances of a function over something, times a law's force, (n,)."""
        signals, reach = [], self._reach(port, over)
        stiffness = self.data.mechanism.port(port).stiffness.value
        for motion in (balance.ports[port] for balance in self.data.spectra):
            signal = sine_of(number, _argument(motion, over) / reach)[0]
            signals.append(signal if law is None else signal * law_force(law, motion, stiffness))
        return self._whitened(port, signals)

    def _reach(self, port: str, over: str) -> float:
        peaks = [
            float(np.abs(_argument(balance.ports[port], over)).max())
            for balance in self.data.spectra
        ]
        return max(*peaks, 1e-12)

    @cached_property
    def outside(self) -> tuple[Sized, ...]:
        """What no law holds: a process over something at each port."""
        return tuple(self._outside())

    def _outside(self) -> Iterator[Sized]:
        # Not over the load: what it does alone is a gain of the input, and as the load is what the
        # inputs do as measured, a steep function of it would cancel their noise.
        for port in self.data.mechanism.ports:
            for over in ("position", "speed", "time"):
                columns = np.column_stack(
                    [self._column(port.name, over, number) for number in range(1, TERMS + 1)]
                )
                size = max(float(self.shares @ np.sum(columns**2, axis=1)), 1e-24)
                misfit = float(self.shares @ self.base.residuals**2)
                most = np.sqrt(max(misfit, 4.0 * float(self.shares.sum())) / size)
                none = np.zeros(TERMS)
                yield Sized(
                    f"outside: {over} at {port.name}",
                    columns,
                    float(np.sqrt(TERMS / size)),
                    float(most),
                    none,
                    none > 0.0,
                )


def _of_turn(place: Matrix, before: float, after: float) -> Iterator[Matrix]:
    """Yield by what dry friction of 1 may differ from what the sign of a smoothed speed says.

    If the port turns at any moment up to a unit of ``place`` (n,) before or after, the force has
    the other sign than that ``before`` or ``after`` up to then. The covariance of this at s and t
    is 2 (1 - max(s, t)) on each side, that of Brownian motion from its end, whose Karhunen-Loeve
    functions are cosines. A rest is a mean of such turns.
    """
    for number in range(_OF_TURN):
        rate = np.pi * (number + 0.5)
        pulse = 2.0 * np.cos(rate * place) / rate
        for sign, side in ((before, place < 0.0), (after, place >= 0.0)):
            yield -sign * pulse * (side & (np.abs(place) < 1.0))


def _turns_of(speed: Matrix, still: float, apart: float) -> list[tuple[float, float, float]]:
    """Return the rows, perhaps between two, at which a motion turns, stops or starts.

    Each with the signs of the speed before and after it; 0 where that is not known. Where a motion
    is ``still``, it may do so anywhere: at rows that are about so far ``apart``. It does at the
    ends of a record as well where it is within so many rows of a rest.
    """
    turns, moving = list[tuple[float, float, float]](), np.flatnonzero(np.abs(speed) >= still)
    sign = np.sign(speed)
    for before, after in pairwise(moving.tolist()):
        if after - before > 1 or speed[before] * speed[after] < 0.0:
            count = 1 + int((after - before) / apart)
            places = before + (after - before) * (np.arange(count) + 0.5) / count
            turns += [(place, sign[before], sign[after]) for place in places.tolist()]
    last = len(speed) - 1
    near = min(int(apart), last)
    if abs(speed[0]) < abs(speed[near] - speed[0]):
        turns.append((0.0, 0.0, sign[near]))
    if abs(speed[last]) < abs(speed[last - near] - speed[last]):
        turns.append((float(last), sign[last - near], 0.0))
    return turns


def _argument(motion: PortMotion, over: str) -> Matrix:
    """Return what a process is over, (n,): the position counts from its mean."""
    if over == "time":
        return np.linspace(-1.0, 1.0, len(motion.position))
    values = np.asarray(getattr(motion, over))
    return values - np.mean(values) if over == "position" else values
