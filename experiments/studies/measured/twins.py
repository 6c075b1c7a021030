"""Twins of measured rigs: the same excitation, a truth that is known, noise as the sensors have it.

If a twin without a missing effect is adequate, and another effect hidden in a twin is named, then
the verdicts on the real records come from the data and not from the name of the machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.runner.result import Column, Table
from experiments.runner.result import Finding as Agreement
from experiments.studies.measured.rigs import Study, coloured_rest
from pymoo_hdte.discrepancy._report.tables import STATUSES
from pymoo_hdte.discrepancy._verdicts.held_out import fitted_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.effects.friction import NonlinearDrag
from pymoo_hdte.mechanism import LawAt, Mechanism, Record
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.motion import motion_of
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


def drag_at(one: Study, port: str, force: float) -> LawAt:
    """Return a drag at a port that grows with the square of the speed.

    Parameters
    ----------
    one : Study
    port : str
    force : float
        At the largest speed of the port in the real records, N or N.m.
    """
    speed = max(float(np.abs(each.ports[port].speed).max()) for each in one.finding.data.spectra)
    return LawAt("nonlinear_drag", port, NonlinearDrag(force / speed**2))


def find_twins(
    one: Study, hidden: LawAt, known: Sequence[LawAt] = (), disturbed: bool = True
) -> tuple[Twin, ...]:
    """Return a twin without a missing effect, and one or two in which an effect is hidden.

    Parameters
    ----------
    one : Study
        Of the real rig, whose fitted values the twins have.
    hidden : LawAt
    known : sequence of LawAt
        Effects that all twins have and their model is known to have.
    disturbed : bool
        Whether to hide the effect in a twin with the disturbance of the real rig as well.
    """
    kinds: tuple[tuple[str, Sequence[LawAt], bool], ...] = (
        ("nothing", (), False),
        (hidden.name, (hidden,), False),
        (hidden.name, (hidden,), True),
    )
    return tuple(
        Twin(name, rest, _found(one, known, effects, rest))
        for name, effects, rest in kinds
        if disturbed or not rest
    )


def twins_finding(found: Sequence[Twin]) -> Agreement:
    """Return whether the first twin is adequate and what is hidden in the others is named."""
    first, *others = found
    named = [twin.names == (twin.hidden,) for twin in others]
    agrees = first.finding.verdict.status == "adequate" and all(named)
    words = [
        f"{_words(twin.names)} where {_words([twin.hidden])} is hidden"
        f"{' under a disturbance like the real one' if twin.rest else ''}"
        for twin in found
    ]
    sentence = f"In simulated copies of the rig is found: {', '.join(words)}."
    return Agreement(agrees, sentence, check=True)


def twins_table(found: Sequence[Twin]) -> Table:
    """Return what is hidden in each twin and what is found."""
    return Table(
        "twins",
        "Simulated copies of the rig: what is hidden, and what is found",
        (
            Column("hidden"),
            Column("disturbed like the real rig"),
            Column("verdict"),
            Column("found"),
        ),
        tuple(
            (
                _words([twin.hidden]),
                "yes" if twin.rest else "no",
                STATUSES[twin.finding.verdict.status],
                _words(twin.names),
            )
            for twin in found
        ),
        note="They move as the real rig did, by the fitted model without friction, so that what is "
        "found must come from the records. The disturbance has the spectrum of "
        "what the model leaves unexplained in the real records.",
    )


def _words(names: Sequence[str]) -> str:
    return " and ".join(names).replace("_", " ") or "nothing"


def _found(
    one: Study, known: Sequence[LawAt], hidden: Sequence[LawAt], rest: bool
) -> MechanismFinding:
    generator = np.random.default_rng(SEED)
    mechanism = one.rig.mechanism
    # A model that does not fit is no machine: its values lie at the bounds of what is believed.
    if one.finding.verdict.status != "unlisted":
        mechanism = fitted_mechanism(mechanism, one.finding.accepted)
    disturbances = coloured_rest(one, generator)
    measured = [record for record in one.rig.records if record.role == "train"]
    records = [
        _twin(mechanism, record, balance, (*known, *hidden), rest * disturbance, generator)
        for record, balance, disturbance in zip(
            measured, one.finding.data.spectra, disturbances, strict=True
        )
    ]
    return examine_mechanism(one.rig.mechanism, records, one.finding.cutoff, known)


def _twin(
    mechanism: Mechanism,
    measured: Record,
    balance: ForceBalance,
    effects: Sequence[LawAt],
    disturbance: NDArray[np.float64],
    generator: np.random.Generator,
) -> Record:
    """Return a record of the measured motion with the input that it takes, and noise.

    The measured motion, smoothed, is the truth, so that the excitation is that of the real rig; the
    one input is what the twin's force balance asks for. Where the balance needed a finer record
    than the measured one, the samples between those of the latter are left out again, so that the
    twin is as coarse.
    """
    record = balance.record
    (coordinate,), (drive,) = mechanism.coordinates, mechanism.inputs
    # The smoothing passes up to twice its frequency, and beyond the cutoff the motion is noise.
    motion = motion_of(record.channel(coordinate), record.step, balance.cutoff / 2.0)
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
    every = round(measured.step / record.step)
    return Record(
        f"twin of {record.name}",
        "train",
        record.time[::every],
        {
            name: signal[::every]
            + record.noise_of(name) / every**0.5 * generator.standard_normal(len(signal[::every]))
            for name, signal in channels.items()
        },
    )
