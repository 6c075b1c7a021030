"""Twins of real machines: with nothing missing they are adequate, and what is hidden is named.

The model of a twin knows the effects that were found in the real records, with their values.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from experiments.studies.measured.rigs import MEASURED, RIGS, torques_of
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_simulation import fitted_mechanism
from pymoo_hdte.effects.friction import CoulombFriction, NonlinearDrag
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.linear import LinearSpring
from pymoo_hdte.mechanism import LawAt, Record
from pymoo_hdte.mechanism.motion import motion_of
from pymoo_hdte.mechanism.port_motion import law_force


@dataclass(frozen=True)
class Machine:
    """A machine, and the effect that its twin hides.

    Attributes
    ----------
    folder : str
    hidden : callable
        From the finding on the machine to the effect.
    """

    folder: str
    hidden: Callable[[MechanismFinding], LawAt]


SEED = 5


def drag(port, force):
    """A drag with this force, N or N.m, at the largest speed."""

    def hidden(finding):
        spectra = finding.data.spectra
        speed = max(float(np.abs(balance.ports[port].speed).max()) for balance in spectra)
        return LawAt("nonlinear_drag", port, NonlinearDrag(force / speed**2))

    return hidden


def law(name, port, of):
    return lambda finding: LawAt(name, port, of)


def verdict_on_twin(rig, finding, *hidden):
    """Return the finding on a twin with the fitted values and the effects of the real rig."""
    generator = np.random.default_rng(SEED)
    known = finding.accepted.effects
    # A model that does not fit is no machine: its values lie at the bounds of what is believed.
    fits = finding.verdict.status != "unlisted"
    mechanism = fitted_mechanism(rig.mechanism, finding.accepted) if fits else rig.mechanism
    measured = [record for record in rig.records if record.role == "train"]
    records = [
        twin(mechanism, record, balance, (*known, *hidden), generator)
        for record, balance in zip(measured, finding.data.spectra, strict=True)
    ]
    return examine_mechanism(rig.mechanism, records, finding.cutoff, known)


def twin(mechanism, measured, balance, effects, generator):
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
    force = mechanism.inertias[coordinate].value * motion.acceleration
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


MACHINES = {
    # The axis is vertical; the twin's is not quite.
    "ur10e_joint_1": Machine("ur10e", law("gravity", "bearing", Gravity(6.0, 0.5))),
    "ur10e_joint_4": Machine("ur10e", drag("bearing", 3.0)),
    "ur10e_joint_6": Machine("ur10e", drag("bearing", 2.0)),
    "tx40_joint_4": Machine("tx40_j4", law("gravity", "bearing", Gravity(3.0, 0.5))),
    "bouc_wen": Machine("bouc_wen", law("coulomb_friction", "spring", CoulombFriction(5.0))),
    "silverbox": Machine("silverbox", drag("spring", 0.05)),
    "lara8_joint_3": Machine("lara8_j3", law("linear_stiffness", "bearing", LinearSpring(10.0))),
}
QUICK = ("lara8_joint_3",)
"""Studied and twinned in a second."""
NEAR = 0.15
"""Error of the found force as a share of the hidden one, root mean squares."""


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.nightly) for name in MACHINES],
)
def test_twin_is_adequate_and_what_it_hides_is_named(name):
    machine = MACHINES[name]
    if not (MEASURED / machine.folder).is_dir():
        pytest.skip(f"the measurements are not at {MEASURED / machine.folder}")
    rig = torques_of(read_rig(RIGS / f"{name}.toml", MEASURED / machine.folder))
    finding = examine_mechanism(rig.mechanism, rig.records, rig.cutoff, rig.effects)
    hidden = machine.hidden(finding)
    assert verdict_on_twin(rig, finding).verdict.status == "adequate"
    lacking = verdict_on_twin(rig, finding, hidden)
    assert lacking.verdict.status == "named"
    assert [candidate.name for candidate in lacking.accepted.candidates] == [hidden.name]
    (found,) = lacking.accepted.effects
    stiffness = rig.mechanism.port(hidden.port).stiffness.value
    motions = [balance.ports[hidden.port] for balance in finding.data.spectra]
    there, truth = (
        np.concatenate([law_force(effect.law, motion, stiffness) for motion in motions])
        for effect in (found, hidden)
    )
    assert np.std(there - truth) < NEAR * np.std(truth)
