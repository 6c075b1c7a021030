"""The rig that the tests of the virtual rig share."""

from dataclasses import replace

from pymoo_hdte.discrepancy.campaign import Believed, Rig
from pymoo_hdte.discrepancy.hidden_forms import HiddenEffect
from pymoo_hdte.discrepancy.rig_runs import Condition
from pymoo_hdte.discrepancy.virtual_rig import TrueRig
from pymoo_hdte.units import ARCSEC

BELIEVED = Believed(
    ratio=101.0,
    stiffness=2.583e4,
    damping=4.5,
    input_inertia=1.97e-4,
    input_damping=1.7e-4,
    output_damping=5.022e-4,
    output_inertia=8.505e-4,
    load_inertia=0.08,
    error_orders=(1.0, 2.0, 2.02),
    error_amplitudes=(4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC),
)
RIG = Rig(
    proportional=0.02,
    integral=0.5,
    angle_noise=0.7 * ARCSEC,
    input_torque_noise=0.003,
    output_torque_noise=0.2,
    repeatability=0.3 * ARCSEC,
    torsion_angle_noise=0.204 * ARCSEC,
)
PHASES = (0.3, 1.9, 4.0)
FAST = Condition(2000.0, 40.0, 1000.0, 1, "train")
SHORT = (FAST, Condition(2000.0, 0.0, 1000.0, 1, "held_out"))


def true_rig(*effects: HiddenEffect, **changes: float | tuple[float, ...]) -> TrueRig:
    """Return a rig that is as believed but for the changes."""
    return TrueRig(replace(BELIEVED, **changes), PHASES, effects)


def effect(port: str, **parameters: float | tuple[float, ...]) -> HiddenEffect:
    """Return a planted effect."""
    return HiddenEffect("planted", port, parameters)
