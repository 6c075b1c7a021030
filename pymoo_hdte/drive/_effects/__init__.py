"""Effects of a drive beside the laws at its ports, one file each or a few that belong together."""

from pymoo_hdte import effects as effects_at_ports
from pymoo_hdte.drive._effects.base import (
    DriveEffect,
    DriveSizes,
    LawAtPort,
    Session,
    drive_effects,
    effect_from_fields,
)
from pymoo_hdte.drive._effects.bench_resonance import BenchResonance
from pymoo_hdte.drive._effects.encoder import ENCODER_LINE, Eccentricity
from pymoo_hdte.drive._effects.load_damping import LoadDamping
from pymoo_hdte.drive._effects.load_error import LoadDependentError
from pymoo_hdte.drive._effects.load_shaft import LoadShaft
from pymoo_hdte.drive._effects.mesh_stiffness import MeshStiffnessVariation
from pymoo_hdte.drive._effects.presliding import PreslidingFriction
from pymoo_hdte.drive._effects.sensor_zero import (
    InputTorqueDrift,
    NewInputTorqueZero,
    NewOutputTorqueZero,
    NewZero,
    OutputTorqueDrift,
    ThermalDrift,
)
from pymoo_hdte.drive._effects.series_error import ChangedStaticError
from pymoo_hdte.drive._effects.shafts import CoupledInertia, DampingReference, LoadInertia
from pymoo_hdte.drive._effects.static_error import KinematicErrorLine, KinematicReaction
from pymoo_hdte.drive._effects.warming import WarmingFriction

__all__ = [
    "ENCODER_LINE",
    "BenchResonance",
    "ChangedStaticError",
    "CoupledInertia",
    "DampingReference",
    "DriveEffect",
    "DriveSizes",
    "Eccentricity",
    "InputTorqueDrift",
    "KinematicErrorLine",
    "KinematicReaction",
    "LawAtPort",
    "LoadDamping",
    "LoadDependentError",
    "LoadInertia",
    "LoadShaft",
    "MeshStiffnessVariation",
    "NewInputTorqueZero",
    "NewOutputTorqueZero",
    "NewZero",
    "OutputTorqueDrift",
    "PreslidingFriction",
    "Session",
    "ThermalDrift",
    "WarmingFriction",
    "drive_effects",
    "effect_from_fields",
    "effects_at_ports",
]
