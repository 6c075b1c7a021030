"""Forces beyond the band of the motion, whitened, over the position and the speed of a port.

Beyond the cutoff a motion is too small to be measured, and so are its forces, but position and
speed of the machine are known all the same. A force that varies with the position shows as a line
whose frequency is proportional to the speed, up to half the sampling rate of the force, or less
where its rows are interpolated.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.signal import welch

from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.mechanism import LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.motion import margin_of, motion_of, smooth
from pymoo_hdte.mechanism.port_motion import motion_at_port

Values = NDArray[np.float64]

FEWEST_ROWS = 30
"""Least number of rows: in sums of fewer, the power of noise is not exponential."""
_PADDED = 4
"""Length of a transform over that of its signal, so that powers between its lines are known."""
_CHANGES = 3
"""Powers of the position, from 0, with which the amplitude of a removed order may change."""
_BEYOND = 1.25
"""Lowest frequency over the cutoff: the slow part that is removed is below 3 % there."""
_SEGMENT, _SEGMENTS = 512, 8
"""Most samples in a window, and fewest windows of a record: for its spectrum, and to tell a fixed
frequency from an order of the position."""


@dataclass(frozen=True, eq=False)
class HighBand:
    """The force at a port in one record beyond the band of the motion.

    Attributes
    ----------
    time, position, speed : ndarray, shape (n,)
        Time, s, and position and speed of the port, SI.
    plain : ndarray, shape (n,)
        Force of the inputs at the port, N or N.m.
    force : ndarray, shape (n,)
        The whitened force, whose noise has the same power at each frequency.
    lowest, highest : float
        Frequencies of the band, Hz.
    window : int
        Samples of a window.
    """

    time: Values
    position: Values
    speed: Values
    plain: Values
    force: Values
    lowest: float
    highest: float
    window: int
    _frequency: Values = field(repr=False)
    _gain: Values = field(repr=False)

    def inside(self, order: float) -> NDArray[np.bool_]:
        """Return where the frequency of an order is between ``lowest`` and ``highest``, (n,)."""
        frequency = order * np.abs(self.speed) / (2.0 * np.pi)
        return np.asarray((frequency >= self.lowest) & (frequency <= self.highest))

    def gain(self, order: float) -> Values:
        """Return the factor of the whitening at the frequency of an order, 1/SI, shape (n,).

        It is zero where that is not between ``lowest`` and ``highest``.
        """
        frequency = order * np.abs(self.speed) / (2.0 * np.pi)
        return np.interp(frequency, self._frequency, self._gain) * self.inside(order)

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def ways(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return where the port moves forward, and where backward, shape (n,) each."""
        return self.speed > 0.0, self.speed < 0.0

    def line_power(self, rows: NDArray[np.int64], frequencies: Values) -> Values:
        """Return the power of a window at frequencies, Hz, per unit of noise, (n_frequencies,)."""
        force = self.force[rows]
        size = next_fast_len(_PADDED * len(force), real=True)
        power = np.abs(np.fft.rfft(force, size)) ** 2 / len(force)
        return np.interp(frequencies, np.fft.rfftfreq(size, self.step), power)

    def without_order(self, order: float) -> HighBand:
        """Return the band without an order, whose amplitude may change slowly with position."""
        gain, force = self.gain(order), self.force.copy()
        middle, half = np.mean(self.position), max(0.5 * float(np.ptp(self.position)), 1e-300)
        for way in self.ways():
            rows = np.flatnonzero(gain * way)
            if len(rows) < FEWEST_ROWS:
                continue
            place = ((self.position[rows] - middle) / half)[:, None] ** np.arange(_CHANGES)
            angle = (order * self.position[rows])[:, None]
            lines = gain[rows, None] * np.hstack([place * np.cos(angle), place * np.sin(angle)])
            force[rows] -= lines @ np.linalg.lstsq(lines, force[rows], rcond=None)[0]
        return replace(self, force=force)

    def without_frequency(self, frequency: float) -> HighBand:
        """Return the band without a frequency in Hz, which is removed window by window."""
        angle, force = 2.0 * np.pi * frequency * self.time, self.force.copy()
        for start in range(0, len(self.time), self.window):
            rows = slice(start, start + self.window)
            lines = np.column_stack([np.cos(angle[rows]), np.sin(angle[rows])])
            force[rows] -= lines @ np.linalg.lstsq(lines, force[rows], rcond=None)[0]
        return replace(self, force=force)


def high_bands(
    mechanism: Mechanism,
    port: Port,
    records: Sequence[Record],
    cutoff: float,
    rules: Rules,
) -> list[HighBand]:
    """Return the forces of the inputs at a port beyond a cutoff, by record.

    Parameters
    ----------
    mechanism : Mechanism
    port : Port
    records : sequence of Record
        Records as they were sampled.
    cutoff : float
        Frequency up to which the motion is known, Hz.
    rules : Rules

    Returns
    -------
    list of HighBand
        One for each record that is long enough and has such a force well beyond the cutoff.
    """
    bands = []
    for record in records:
        lowest, share = _BEYOND * cutoff, 0.5 * rules.nyquist_share
        if record.interpolated:
            share = min(share, rules.interpolated_share)
        highest = share / record.step
        margin = margin_of(cutoff, record.step)
        before, after = (max(margin, rows) for rows in record.context)
        inner = slice(before, len(record.time) - after)
        count = len(record.time[inner])
        window = min(_SEGMENT, count // _SEGMENTS)
        if 2.0 * lowest > highest or window < _SEGMENTS:
            continue
        motions = {
            name: motion_of(record.channel(name), record.step, cutoff)
            for name in mechanism.coordinates
        }
        motion = motion_at_port(
            port,
            {name: coordinate.position for name, coordinate in motions.items()},
            {name: coordinate.speed for name, coordinate in motions.items()},
        )
        force = _force_at(mechanism, port, record)
        # At half the cutoff, because smoothing passes everything up to the frequency that it is
        # given.
        force = (force - smooth(force, record.step, 0.5 * cutoff))[inner]
        if np.ptp(force) == 0.0:
            continue
        frequency, gain = _whitening(force, record.step, window, lowest)
        bands.append(
            HighBand(
                record.time[inner],
                motion.position[inner],
                motion.speed[inner],
                force,
                _filtered(force, record.step, frequency, gain),
                lowest,
                highest,
                window,
                frequency,
                gain,
            )
        )
    return bands


def _force_at(mechanism: Mechanism, port: Port, record: Record) -> Values:
    """Return the force at a port that the inputs balance, (n,); zero where they drive none of it.

    A force F at a port enters the balance of a coordinate as its share times F, so F is the
    least-squares solution of the balances of those coordinates that an input drives.
    """
    driven = {name for signal in mechanism.inputs for name, acts in signal.acts.items() if acts}
    shares = {name: share for name, share in port.motion.items() if share and name in driven}
    size = sum(share**2 for share in shares.values())
    force = np.zeros(len(record.time))
    for signal in mechanism.inputs:
        acts = sum(share * signal.acts.get(name, 0.0) for name, share in shares.items())
        if acts:
            force += acts / size * signal.gain.value * record.channel(signal.name)
    return force


def _whitening(force: Values, step: float, window: int, lowest: float) -> tuple[Values, Values]:
    """Return frequencies, Hz, and the factor at each with which a force becomes white."""
    frequency, power = welch(force, 1.0 / step, nperseg=window, detrend="constant")
    inside = frequency >= lowest
    floor = max(1e-12 * float(power.max()), 1e-300)
    power = np.where(inside, np.maximum(power, floor), np.inf)
    return frequency, np.sqrt(2.0 * step / power)


def _filtered(force: Values, step: float, frequency: Values, gain: Values) -> Values:
    """Return a force with a factor at each frequency, without delay."""
    spectrum = np.fft.rfft(force)
    bins = np.fft.rfftfreq(len(force), step)
    return np.asarray(np.fft.irfft(spectrum * np.interp(bins, frequency, gain), len(force)))


def ports_apart(mechanism: Mechanism) -> list[Port]:
    """Return one port for each motion at which forces of inputs act; one with a gear, if any.

    Proportional motions count as one, because a force at one of their ports is a force at each.
    """
    ports: dict[frozenset[tuple[str, float]], Port] = {}
    for port in mechanism.ports:
        motion = _direction(port)
        if not port.read and (motion not in ports or (port.gear and not ports[motion].gear)):
            ports[motion] = port
    return list(ports.values())


def _shares(port: Port) -> dict[str, float]:
    return {name: port.motion[name] for name in sorted(port.motion) if port.motion[name]}


def _direction(port: Port) -> frozenset[tuple[str, float]]:
    """Return the shares of a port's motion over the first of them, rounded."""
    shares = _shares(port)
    scale = next(iter(shares.values()))
    return frozenset((name, float(f"{share / scale:.9g}")) for name, share in shares.items())


def known_orders(mechanism: Mechanism, port: Port, effects: Collection[LawAt]) -> list[float]:
    """Return the orders of effects at ports of the same motion, per turn of this port."""
    orders = []
    for effect in effects:
        place, order = mechanism.port(effect.port), place_of(effect)[2]
        if order and _direction(place) == _direction(port):
            theirs, ours = (next(iter(_shares(end).values())) for end in (place, port))
            orders.append(abs(order * theirs / ours))
    return orders
