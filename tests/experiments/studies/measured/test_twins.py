"""Twins of real machines: with nothing missing they are adequate, and what is hidden is named.

The model of a twin knows the effects that were found in the real records, with their values.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from experiments.studies.measured.rigs import MEASURED, RIGS, Study, torques_of
from experiments.studies.measured.twins import drag_at, find_twins
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.linear import LinearSpring
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.port_motion import law_force


@dataclass(frozen=True)
class Machine:
    """A machine, and the effect that its twin hides.

    Attributes
    ----------
    folder : str
    hidden : callable
        From the study of the machine to the effect.
    """

    folder: str
    hidden: Callable[[Study], LawAt]


def drag(port, force):
    """A drag with this force, N or N.m, at the largest speed."""
    return lambda one: drag_at(one, port, force)


def law(name, port, of):
    return lambda one: LawAt(name, port, of)


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
    one = Study(rig, finding, ())
    hidden = machine.hidden(one)
    complete, lacking = find_twins(one, hidden, finding.accepted.effects, disturbed=False)
    assert complete.finding.verdict.status == "adequate"
    assert (lacking.finding.verdict.status, lacking.names) == ("named", (hidden.name,))
    (found,) = lacking.finding.accepted.effects
    stiffness = rig.mechanism.port(hidden.port).stiffness.value
    motions = [balance.ports[hidden.port] for balance in finding.data.spectra]
    there, truth = (
        np.concatenate([law_force(one.law, motion, stiffness) for motion in motions])
        for one in (found, hidden)
    )
    assert np.std(there - truth) < NEAR * np.std(truth)
