"""Candidates: every effect that a port of a mechanism may have, with sizes from the records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._evidence.force_balances.evidence import MeasuredData
from pymoo_hdte.discrepancy._selection.candidate import Candidate, candidate_of
from pymoo_hdte.effects.effect import Effect, place_of
from pymoo_hdte.effects.guess import Sizes
from pymoo_hdte.mechanism import LawAt, Port
from pymoo_hdte.mechanism.effects import law_effects
from pymoo_hdte.mechanism.port_motion import PortMotion

LARGEST = 5.0
"""Largest force of an effect, in units of the largest residual of the base in a balance, unless a
larger force acts: the residual says little about how much the base absorbs."""


def mechanism_candidates(
    data: MeasuredData,
    forces: Mapping[str, float],
    orders: Mapping[str, Sequence[float]],
) -> list[Candidate]:
    """Return all candidates.

    Parameters
    ----------
    data : MeasuredData
    forces : mapping of str to float
        Size of the force that may be missing at each port, N or N.m.
    orders : mapping of str to sequence of float
        Orders at which the residual varies with the position of each port, per unit of position.
    """
    candidates = [
        candidate_of(effect, guess, port.name, "force", LawAt)
        for port in data.mechanism.ports
        for effect, sizes in _searched_effects(data, port, forces[port.name], orders)
        for guess in effect.guesses(sizes)
    ]
    known = {place_of(effect) for effect in data.known}
    return [candidate for candidate in candidates if not candidate.places & known]


def _searched_effects(
    data: MeasuredData, port: Port, force: float, orders: Mapping[str, Sequence[float]]
) -> Iterator[tuple[Effect, Sizes]]:
    """Yield the effects that are searched for at a port, each with the sizes of the port."""
    sizes = port_sizes(data, port, force, orders.get(port.name, ()))
    for effect in law_effects():
        if effect.of_reading == port.read:
            yield effect, sizes
        if effect.drives and not effect.of_reading and not port.read:
            for read in data.mechanism.ports:
                # A torque that acts on the motion may also show in the reading of a force sensor.
                if read.read and dict(read.motion) == dict(port.motion):
                    yield effect, replace(sizes, seen=tuple(orders.get(read.name, ())))


def port_sizes(data: MeasuredData, port: Port, force: float, seen: Sequence[float]) -> Sizes:
    """Return the sizes of a port.

    Parameters
    ----------
    data : MeasuredData
    port : Port
    force : float
        Force that may be missing there, N or N.m.
    seen : sequence of float
        Orders of the residual, per unit of the position.

    Raises
    ------
    InvalidInput
        For a port that does not move.
    """
    motions = [balance.ports[port.name] for balance in data.spectra]
    travel = max(float(np.ptp(motion.position)) for motion in motions) / 2.0
    if travel == 0.0:
        raise InvalidInput(f"motion of port {port.name}", 0.0, "one that changes in some record")
    return Sizes(
        force=force,
        residual=force,
        largest=max(LARGEST * force, _peak_force(data, port)),
        speed=max(float(np.abs(motion.speed).max()) for motion in motions),
        travel=travel,
        stiffness=port.stiffness.value,
        damping=port.damping.value,
        both_ways=turns_back(data, port.name),
        load=max(
            0.0 if motion.load is None else float(np.abs(motion.load).max()) for motion in motions
        ),
        driven=_driven(data, motions),
        turns=data.mechanism.turns(port),
        read=port.read,
        seen=tuple(seen),
        together=True,
    )


def _peak_force(data: MeasuredData, port: Port) -> float:
    """Return the largest force of the inputs on a port's motion, or the largest that it reads."""
    peaks = [0.0]
    for record in (balance.record for balance in data.spectra):
        if port.read:
            peaks.append(float(np.abs(record.channels[port.name]).max()))
        for name, share in port.motion.items():
            parts = [
                signal.acts.get(name, 0.0) * signal.gain.value * record.channels[signal.name]
                for signal in data.mechanism.inputs
            ]
            if share and parts and not port.read:
                peaks.append(float(np.abs(np.sum(parts, axis=0)).max()) / abs(share))
    return max(peaks)


def _driven(data: MeasuredData, motions: Sequence[PortMotion]) -> bool:
    """Tell whether the load of a port opposes its motion for some of the time and drives it."""
    powers = [motion.load * motion.speed for motion in motions if motion.load is not None]
    power = np.concatenate([*powers, np.zeros(1)])
    opposing, driving = np.sum(np.maximum(power, 0.0)), np.sum(np.maximum(-power, 0.0))
    return bool(min(opposing, driving) > data.rules.reverse_share * (opposing + driving))


def turns_back(data: MeasuredData, port: str) -> bool:
    """Tell whether a port moves in both directions, in one record or another."""
    speeds = np.concatenate([balance.ports[port].speed for balance in data.spectra])
    forward, backward = np.sum(np.maximum(speeds, 0.0)), np.sum(np.maximum(-speeds, 0.0))
    # A few rows do not count, because noise changes the sign of the speed at rest.
    return bool(min(forward, backward) > data.rules.reverse_share * (forward + backward))
