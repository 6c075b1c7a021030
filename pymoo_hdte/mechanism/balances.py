"""Inverse dynamics: the residuals of the force balances for the motion of a record.

For every coordinate the forces of inputs, inertia, springs, dampers and laws, and for every force
sensor its reading less what acts at its port, as coefficients of an orthonormal cosine transform up
to the cutoff: for stationary noise they are independent, so that its spectrum is a weight of each.
Linear in the quantities of the mechanism (Gautier, Robotics and Autonomous Systems 1997).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.interpolate import make_interp_spline

from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.motion import finer_than, motion_of, smooth, smoothed_noise
from pymoo_hdte.mechanism.parts import LawAt, Port
from pymoo_hdte.mechanism.port_motion import (
    PortMotion,
    followed_angles,
    law_force,
    load_at_port,
    motion_at_port,
    torsion_noise,
)
from pymoo_hdte.mechanism.records import Record, delayed
from pymoo_hdte.mechanism.rests import moving_rows
from pymoo_hdte.mechanism.working_rate import frequencies, highest_known, working_rows

Values = NDArray[np.float64]

_CACHED = 64


def balance_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the balances: of coordinates, and of force sensors."""
    read = [port.name for port in mechanism.ports if port.read]
    return (*mechanism.coordinates, *read)


def quantity_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the quantities on which balances depend: of the mechanism, and zeros of sensors.

    The zero of a force sensor is added to its force, that of a port with a followed angle to the
    force of its spring.
    """
    zeros = [f"zero of {port.name}" for port in mechanism.ports if port.read or port.followed]
    return (*mechanism.quantities, *zeros)


class ForceBalance:
    """Force balances of one record.

    Parameters
    ----------
    mechanism : Mechanism
    record : Record
    cutoff : float
        Hz, up to which the motion is known. Force sensors are compared with the motion up to ten
        samples in a period.
    known : sequence of LawAt
        Known laws; dry friction among them may hold a port at rest, see `moving_rows`.

    Attributes
    ----------
    frequency : ndarray, shape (n_bins,)
        Frequencies of the coefficients, Hz.
    kept : bool ndarray, shape (n_balances, n_bins)
        Whether a coefficient is within the frequencies up to which a balance is known.
    terms : ndarray, shape (n_balances, n_quantities, n_bins)
        Coefficients of the contribution of each of `quantity_names` to each of `balance_names` per
        unit.
    constant : ndarray, shape (n_balances, n_bins)
        Coefficients of the readings of force sensors.
    noise : ndarray, shape (n_balances, n_bins)
        Standard deviation that the sensors' noise gives them, for the believed quantities.
    ports : dict of str to PortMotion
        At the working rate.
    moving : MovingRows
        Rows of the working rate that are not left out.
    motions : dict of str to Motion
        Motions of the coordinates and of followed angles, at the rate of the record.
    cutoff : float

    Raises
    ------
    InvalidInput
        If a coordinate, an input or a force sensor has no channel, the record is too short, or the
        cutoff beyond ten samples in a period.
    """

    def __init__(
        self, mechanism: Mechanism, record: Record, cutoff: float, known: Sequence[LawAt] = ()
    ) -> None:
        self.mechanism, self.record = mechanism, record
        self._known: dict[tuple[LawAt, float, float], Values] = {}
        self._rows = working_rows(mechanism, record, cutoff)
        stride, highest = self._rows.step, highest_known(mechanism, record, cutoff)
        self.cutoff = cutoff
        self.motions = {
            name: motion_of(self.record.channel(name), record.step, cutoff)
            for name in (*mechanism.coordinates, *followed_angles(mechanism))
        }
        self._acceleration = {
            name: self.motions[name].acceleration[self._rows] for name in mechanism.coordinates
        }
        signals = {
            actuation.name: smooth(self.record.channel(actuation.name), record.step, highest)
            for actuation in mechanism.inputs
        }
        self._inputs = {name: signal[self._rows] for name, signal in signals.items()}
        speed = {name: motion.speed[self._rows] for name, motion in self.motions.items()}
        self.ports = self._port_motions(
            {name: motion.position[self._rows] for name, motion in self.motions.items()},
            speed,
            self._inputs,
        )
        step = record.step * stride
        speeds = {name: speed[name] for name in mechanism.coordinates}
        self.moving = moving_rows(mechanism, record, cutoff, speeds, self.ports, step, known)
        frequency = frequencies(self.moving.count, step)
        self._bins = int(np.count_nonzero(frequency <= highest))
        self.frequency = frequency[: self._bins]
        n_read = len(balance_names(mechanism)) - len(mechanism.coordinates)
        limits = [cutoff] * len(mechanism.coordinates) + [highest] * n_read
        self.kept = self.frequency <= np.array(limits)[:, None]
        self._finer = finer_than(cutoff, step)
        self._fine = self.ports if self._finer == 1 else self._between(stride, signals)
        self.terms = self._terms()
        names = balance_names(mechanism)
        self.constant = np.zeros((len(names), self._bins))
        for port in mechanism.ports:
            if port.read:
                reading = smooth(self.record.channel(port.name), record.step, highest)[self._rows]
                self.constant[names.index(port.name)] = self._transform(reading)
        self.noise = self._noise(stride)

    def forces(
        self,
        effects: Sequence[LawAt],
        stiffness: Mapping[str, float] | None = None,
        zeros: Mapping[str, float] | None = None,
    ) -> Values:
        """Return the coefficients of the forces of laws in the balances, (n_balances, n_bins).

        Parameters
        ----------
        effects : sequence of LawAt
        stiffness : mapping of str to float, optional
            Stiffness of ports, N/m or N.m/rad, for play and curved springs; by default the nominal.
        zeros : mapping of str to float, optional
            Zeros of ports with a followed angle, N or N.m; by default 0.
        """
        names = balance_names(self.mechanism)
        coefficients = np.zeros((len(names), self._bins))
        for effect in effects:
            port = self.mechanism.port(effect.port)
            here = (stiffness or {}).get(port.name, port.stiffness.value)
            zero = (zeros or {}).get(port.name, 0.0) if port.followed else 0.0
            force = self._law_coefficients(effect, here, zero / here if zero else 0.0)
            for name, share in self._rows_of(port).items():
                coefficients[names.index(name)] += share * force
        return coefficients

    def of_port(self, port: str, signal: Values) -> Values:
        """Return the coefficients, (n_balances, n_bins), of a force (n,) at a port, SI."""
        names = balance_names(self.mechanism)
        coefficients = np.zeros((len(names), self._bins))
        for name, share in self._rows_of(self.mechanism.port(port)).items():
            coefficients[names.index(name)] = share * self._transform(signal)
        return coefficients

    def of_input(self, name: str, delay: float = 0.0) -> Values:
        """Return the coefficients, (n_balances, n_bins), of an input per unit of its gain.

        Parameters
        ----------
        name : str
        delay : float
            Time by which it acts later than its channel says, s.
        """
        names, record = balance_names(self.mechanism), self.record
        (actuation,) = (one for one in self.mechanism.inputs if one.name == name)
        coefficients = np.zeros((len(names), self._bins))
        highest = highest_known(self.mechanism, record, self.cutoff)
        signal = smooth(delayed(record.channel(name), record.step, delay), record.step, highest)
        for coordinate, share in actuation.acts.items():
            coefficients[names.index(coordinate)] = share * self._transform(signal[self._rows])
        return coefficients

    def _law_coefficients(self, effect: LawAt, stiffness: float, shift: float) -> Values:
        """Return the coefficients of the force of one effect, (n_bins,), its port being shifted.

        The last results are cached: in a difference quotient all laws but one are unchanged.
        """
        key = effect, stiffness, shift
        if key not in self._known:
            while len(self._known) >= _CACHED:
                self._known.pop(next(iter(self._known)))
            motion = self._fine[effect.port]
            motion = replace(motion, position=motion.position + shift) if shift else motion
            force = law_force(effect.law, motion, stiffness)
            # The finer samples are centred on the others, so that their cosines are the same.
            self._known[key] = self._transform(force) / np.sqrt(self._finer)
        return self._known[key]

    def in_time(self, coefficients: Values) -> Values:
        """Return the signal (n,) of coefficients (n_bins,); it is 0 in rows that are left out."""
        missing = self.moving.count - self._bins
        return self.moving.put(dct(np.pad(coefficients, (0, missing)), type=3, norm="ortho"))

    @property
    def left_out(self) -> int:
        """Number of rows of the record that are left out; see `moving_rows`."""
        return round(self.moving.left_out * len(self.record.time))

    @property
    def time(self) -> Values:
        """Times of the working rate, s, shape (n,)."""
        return self.record.time[self._rows]

    def _port_motions(
        self, position: dict[str, Values], speed: dict[str, Values], inputs: dict[str, Values]
    ) -> dict[str, PortMotion]:
        motions = {}
        for port in self.mechanism.ports:
            load = load_at_port(port, self.mechanism.inputs, inputs)
            motions[port.name] = motion_at_port(port, position, speed, load)
        return motions

    def _between(self, stride: int, signals: dict[str, Values]) -> dict[str, PortMotion]:
        """Return the motion of ports at ``_finer`` moments around each of the working rate."""
        places = np.arange(len(self.record.time))[self._rows]
        offsets = ((np.arange(self._finer) + 0.5) / self._finer - 0.5) * stride
        moments = (places[:, None] + offsets).ravel()
        every = np.arange(len(self.record.time))

        def at_moments(values: Values) -> Values:
            return np.asarray(make_interp_spline(every, values, 3)(moments))

        loads = {name for port in self.mechanism.ports for name in port.load}
        return self._port_motions(
            {name: at_moments(motion.position) for name, motion in self.motions.items()},
            {name: at_moments(motion.speed) for name, motion in self.motions.items()},
            {name: at_moments(signals[name]) for name in loads},
        )

    def _transform(self, signal: Values) -> Values:
        return np.asarray(dct(self.moving.take(signal), type=2, norm="ortho")[: self._bins])

    def _rows_of(self, port: Port) -> dict[str, float]:
        """Return the share of a force at a port in each balance."""
        return {port.name: 1.0} if port.read else dict(port.motion)

    def _terms(self) -> Values:
        names, quantities = balance_names(self.mechanism), quantity_names(self.mechanism)
        terms = np.zeros((len(names), len(quantities), self._bins))

        def add(quantity: str, shares: dict[str, float], signal: Values) -> None:
            if quantity in quantities:
                for name, share in shares.items():
                    row = terms[names.index(name), quantities.index(quantity)]
                    row += share * self._transform(signal)

        for name, acceleration in self._acceleration.items():
            add(f"inertia of {name}", {name: -1.0}, acceleration)
        for port in self.mechanism.ports:
            motion = self.ports[port.name]
            shares = {name: -share for name, share in self._rows_of(port).items()}
            add(f"stiffness of {port.name}", shares, motion.position)
            add(f"damping of {port.name}", shares, motion.speed)
            add(f"zero of {port.name}", shares, np.ones_like(motion.position))
        for actuation in self.mechanism.inputs:
            add(f"gain of {actuation.name}", dict(actuation.acts), self._inputs[actuation.name])
        return terms

    def _noise(self, stride: int) -> Values:
        """Return the sensors' noise in the balances, by the believed mechanism.

        Beside each frequency's own noise the transform contains that of speed and position at the
        ends of the record, because a derivative is no series of cosines: sum x'' cos = [x' cos] -
        ...
        """
        mechanism, names, record = self.mechanism, balance_names(self.mechanism), self.record
        omega = 2.0 * np.pi * self.frequency
        inertia, damping, stiffness = self._matrices()
        power = np.zeros((len(names), self._bins))
        for port in mechanism.ports:
            if port.read:
                power[names.index(port.name)] += self.record.noise_of(port.name, jumps=True) ** 2
        for actuation in mechanism.inputs:
            spread = actuation.gain.value * self.record.noise_of(actuation.name, jumps=True)
            for name, share in actuation.acts.items():
                power[names.index(name)] += (share * spread) ** 2
        for port in mechanism.ports:
            spread = port.stiffness.value * torsion_noise(port, record) if port.followed else 0.0
            for row, share in self._rows_of(port).items():
                power[names.index(row)] += (share * spread) ** 2
        step = record.step * stride
        ends = 4.0 * stride / (self.moving.count * step**2)
        for place, name in enumerate(mechanism.coordinates):
            noise = self.record.noise_of(name)
            position, speed = smoothed_noise(noise, record.step, self.cutoff)
            inertial, viscous = inertia[:, place, None], damping[:, place, None]
            own = (stiffness[:, place, None] - inertial * omega**2) ** 2 + (viscous * omega) ** 2
            power += own * noise**2
            power += ends * ((inertial * speed) ** 2 + (viscous * position) ** 2)
        return np.sqrt(power / stride * self.moving.power)

    def _matrices(self) -> tuple[Values, Values, Values]:
        """Return believed inertia, damping and stiffness, (n_balances, n_coordinates)."""
        mechanism, names = self.mechanism, balance_names(self.mechanism)
        inertia, damping, stiffness = np.zeros((3, len(names), len(mechanism.coordinates)))
        for place, believed in enumerate(mechanism.inertias.values()):
            inertia[place, place] = believed.value
        for port in mechanism.ports:
            for row, share in self._rows_of(port).items():
                for name, part in port.motion.items():
                    at = names.index(row), mechanism.coordinates.index(name)
                    damping[at] += share * part * port.damping.value
                    stiffness[at] += share * part * port.stiffness.value * (not port.followed)
        return inertia, damping, stiffness
