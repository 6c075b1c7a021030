"""One effect of every law, which the forward and the reverse tests of the drive share."""

from pymoo_hdte.drive._effects import (
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadDamping,
    LoadDependentError,
    PreslidingFriction,
    drive_effects,
)
from pymoo_hdte.drive._effects.warming import WarmingFriction
from pymoo_hdte.effects.bouc_wen import BoucWen
from pymoo_hdte.effects.friction import (
    CoulombFriction,
    NonlinearDrag,
    PeriodicFriction,
    StribeckFriction,
)
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.hysteresis import MaxwellSlip
from pymoo_hdte.effects.load_friction import LoadFriction
from pymoo_hdte.effects.load_sharing import UnevenSharing
from pymoo_hdte.effects.ripple import BrakeRipple, CouplingTorque, PeriodicTorque
from pymoo_hdte.effects.shear_thinning import ShearThinningDrag
from pymoo_hdte.effects.stiffness import DeadZone, HardeningStiffness, PeriodicClearance, SoftWindup
from pymoo_hdte.effects.temperature_friction import TemperatureFriction
from pymoo_hdte.units import ARCSEC

LAWS = {one.name: one for one in drive_effects() if one.change is None}
"""Effects that are a law at a port of a drive."""

EFFECTS = [
    LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(1.2e9)),
    LawAtPort("soft_windup", "mesh", SoftWindup(0.3, 2e-4)),
    LawAtPort("backlash", "mesh", DeadZone(5 * ARCSEC)),
    LawAtPort("clearance_variation", "mesh", PeriodicClearance(2.0, 0.3, 3 * ARCSEC, 2 * ARCSEC)),
    LawAtPort("hysteresis", "mesh", MaxwellSlip(1.0, 2e-4)),
    LawAtPort("bouc_wen_hysteresis", "mesh", BoucWen(1.0, 1e-4, 1.5, 0.7)),
    LawAtPort("coulomb_friction", "output", CoulombFriction(2.0)),
    LawAtPort("presliding_friction", "output", PreslidingFriction(2.0, 4e-5, 1.4)),
    LawAtPort("stribeck_friction", "input", StribeckFriction(0.05, 0.05, 50.0)),
    LawAtPort("position_dependent_friction", "input", PeriodicFriction(1.0, 0.3, 0.02)),
    LawAtPort("nonlinear_drag", "input", NonlinearDrag(1e-6)),
    LawAtPort("torque_ripple", "input", PeriodicTorque(6.0, 1.0, 0.015)),
    LawAtPort("nonlinear_drag", "input", NonlinearDrag(2e-6, 0.5, 100.0)),
    LawAtPort("load_dependent_friction", "input", LoadFriction(0.2, 0.1)),
    LawAtPort("load_dependent_friction", "input", LoadFriction(0.2, 0.1, 0.7, 40.0)),
    LawAtPort("shear_thinning_drag", "input", ShearThinningDrag(0.02, 10.0, 200.0)),
    LawAtPort("temperature_dependent_friction", "input", TemperatureFriction(1e-4, 0.03, 300.0)),
    KinematicErrorLine(3.0, 2 * ARCSEC, 0.7),
    KinematicReaction(),
    LoadDependentError(3.0, 2 * ARCSEC, 0.7, 40.0),
    LawAtPort("load_dependent_damping", "mesh", LoadDamping(4.0, 40.0)),
    LawAtPort("uneven_load_sharing", "mesh", UnevenSharing(1.0, 0.3, 4 * ARCSEC, 3 * ARCSEC)),
    # Few harmonics of an output turn are kept: they are as weak as integrators are to agree.
    LawAtPort("torque_ripple", "load", PeriodicTorque(3.0, 1.0, 0.1)),
    LawAtPort("gravity", "load", Gravity(0.1, 0.4)),
    LawAtPort("brake_ripple", "load", BrakeRipple(3.0, 0.4, 0.0025)),
    LawAtPort("coupling_ripple", "input", CouplingTorque(1.0, 0.4, 0.005)),
    LawAtPort("cogging", "input", PeriodicTorque(6.0, 0.3, 0.01)),
    LawAtPort("warming", "input", WarmingFriction(1e-4, 0.2, 600.0)),
]


def memoryless(effects):
    """Return the effects without those that remember: springs make an integrator chatter."""
    return [one for one in effects if not getattr(getattr(one, "law", None), "states", 0)]
