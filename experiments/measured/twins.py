"""Twins of measured rigs: the same excitation, a truth that is known, noise as the sensors have it.

If a twin without a missing effect is adequate, and another effect hidden in a twin is named, then
the verdicts on the real records come from the data and not from the name of the machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.measured.rigs import Study, coloured_rest
from experiments.runner.result import Column, Table
from experiments.runner.result import Finding as Agreement
from pymoo_hdte.discrepancy.mechanism.analysis import MechanismFinding, examine_mechanism
from pymoo_hdte.discrepancy.mechanism.held_out import fitted_mechanism
from pymoo_hdte.effects.friction import NonlinearDrag
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.motion import noise_of
from pymoo_hdte.mechanism.port_motion import law_force

SEED = 5


@dataclass(frozen=True, eq=False)
class Twin:
    """A twin: what it holds, and what was found in it."""

    hidden: str
    rest: bool
    finding: MechanismFinding

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that were found."""
        return tuple(candidate.name for candidate in self.finding.accepted.candidates)


def find_twins(one: Study, port: str, force: float) -> tuple[Twin, ...]:
    """Return a twin without a missing effect, and two in which a drag is hidden.

    Parameters
    ----------
    one : Study
        Of the real rig, whose fitted values the twins have.
    port : str
        Where the drag acts.
    force : float
        Its force at the largest speed, N or N.m.
    """
    speed = max(float(np.abs(each.ports[port].speed).max()) for each in one.finding.data.spectra)
    drag = LawAt("nonlinear_drag", port, NonlinearDrag(force / speed**2))
    return tuple(
        Twin("nonlinear_drag" if effects else "nothing", rest, _found(one, effects, rest))
        for effects, rest in (((), False), ((drag,), False), ((drag,), True))
    )


def twins_finding(found: Sequence[Twin]) -> Agreement:
    """Return whether the first twin is adequate and what is hidden in the others is named."""
    first, *others = found
    named = [twin.names == (twin.hidden,) for twin in others]
    agrees = first.finding.verdict.status == "adequate" and all(named)
    words = ", ".join(" + ".join(twin.names) or "nothing" for twin in found)
    return Agreement(agrees, f"Twins: {words}.", check=True)


def twins_table(found: Sequence[Twin]) -> Table:
    """Return what is hidden in each twin and what is found."""
    return Table(
        "twins",
        "Twins of the rig: what is hidden, and what is found",
        (
            Column("hidden"),
            Column("disturbed like the real rig"),
            Column("verdict"),
            Column("found"),
        ),
        tuple(
            (
                twin.hidden.replace("_", " "),
                "yes" if twin.rest else "no",
                twin.finding.verdict.status,
                " + ".join(twin.names).replace("_", " ") or "nothing",
            )
            for twin in found
        ),
        note="Without friction, whatever the real rig has. The disturbance has the spectrum of "
        "what the model leaves unexplained in the real records.",
    )


def _found(one: Study, effects: Sequence[LawAt], rest: bool) -> MechanismFinding:
    generator = np.random.default_rng(SEED)
    mechanism = fitted_mechanism(one.rig.mechanism, one.finding.accepted)
    disturbances = coloured_rest(one, generator)
    records = [
        _twin(mechanism, balance, effects, disturbance if rest else 0.0 * disturbance, generator)
        for balance, disturbance in zip(one.finding.data.spectra, disturbances, strict=True)
    ]
    return examine_mechanism(one.rig.mechanism, records, one.finding.cutoff)


def _twin(
    mechanism: Mechanism,
    balance: ForceBalance,
    effects: Sequence[LawAt],
    disturbance: NDArray[np.float64],
    generator: np.random.Generator,
) -> Record:
    """Return a record of the measured motion with the input that it takes, and noise.

    The measured motion, smoothed, is the truth, so that the excitation is that of the real rig; the
    one input is what the twin's force balance asks for.
    """
    record = balance.record
    (coordinate,), (drive,) = mechanism.coordinates, mechanism.inputs
    exact = ForceBalance(mechanism, record, balance.cutoff)
    motion = exact.motions[coordinate]
    force = mechanism.inertias[coordinate].value * motion.acceleration - disturbance[0]
    for port in mechanism.ports:
        if not port.read:
            force = force + port.motion[coordinate] * (
                port.stiffness.value * motion.position + port.damping.value * motion.speed
            )
    for effect in effects:
        stiffness = mechanism.port(effect.port).stiffness.value
        force = force + law_force(effect.law, motion, stiffness)
    channels = {
        coordinate: motion.position,
        drive.name: force / (drive.gain.value * drive.acts[coordinate]),
    }
    for row, port in enumerate(port for port in mechanism.ports if port.read):
        channels[port.name] = np.array(disturbance[1 + row])
    return Record(
        f"twin of {record.name}",
        "train",
        record.time,
        {
            name: signal + noise_of(record.channels[name]) * generator.standard_normal(len(signal))
            for name, signal in channels.items()
        },
    )
