"""The machine: data sheet, static error, equations of motion, steady state, time integration."""

from pymoo_hdte.drive._effects import (
    ChangedStaticError,
    CoupledInertia,
    DampingReference,
    DriveEffect,
    Eccentricity,
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadDependentError,
    LoadInertia,
    MeshStiffnessVariation,
    NewZero,
    ThermalDrift,
)
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.free_angle import harmonic_balance
from pymoo_hdte.drive._solve.hill import hill_steady_state, transfer_function
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive._solve.quasi_static import mean_torsion, quasi_static_torsion
from pymoo_hdte.drive._solve.stability import UnstableDrive, floquet_multipliers
from pymoo_hdte.drive._solve.steady_motion import SpeedLoop, SteadyMotion
from pymoo_hdte.drive.catalogue import CataloguePage, Entry, Figure, complete, drive_of
from pymoo_hdte.drive.datasheet import DataSheet
from pymoo_hdte.drive.datasheet_file import hs_20_100, load_datasheet
from pymoo_hdte.drive.drive_file import built_in_page, load_drive, load_page
from pymoo_hdte.drive.dte_map import OperatingMap, operating_map
from pymoo_hdte.drive.estimates import ESTIMATES, Estimate
from pymoo_hdte.drive.figures import (
    Comparison,
    back_driving_torque,
    compared,
    efficiency,
    hysteresis_loss,
    input_torque,
    lost_motion,
    starting_torque,
)
from pymoo_hdte.drive.kinematic_error import KinematicError
from pymoo_hdte.drive.levers import LEVERS, SHARES, Lever, changed_drive
from pymoo_hdte.drive.measurement import low_pass, measured_dte
from pymoo_hdte.drive.model import PRESETS, DriveModel, load_model, preset
from pymoo_hdte.drive.parameters import PARAMETER_UNITS, PARAMETERS
from pymoo_hdte.drive.simulation import Run, simulate_drive
from pymoo_hdte.drive.static_error import StaticErrorSample, class_amplitudes, sample_static_error

__all__ = [
    "ESTIMATES",
    "LEVERS",
    "PARAMETERS",
    "PARAMETER_UNITS",
    "PRESETS",
    "SHARES",
    "CataloguePage",
    "ChangedStaticError",
    "Coefficients",
    "Comparison",
    "CoupledInertia",
    "DampingReference",
    "DataSheet",
    "DriveEffect",
    "DriveModel",
    "Eccentricity",
    "Entry",
    "Estimate",
    "Figure",
    "KinematicError",
    "KinematicErrorLine",
    "KinematicReaction",
    "LawAtPort",
    "Lever",
    "LoadDependentError",
    "LoadInertia",
    "MeshStiffnessVariation",
    "NewZero",
    "OperatingMap",
    "OrderSpectrum",
    "Run",
    "SpeedLoop",
    "StaticErrorSample",
    "SteadyMotion",
    "ThermalDrift",
    "UnstableDrive",
    "back_driving_torque",
    "built_in_page",
    "changed_drive",
    "class_amplitudes",
    "compared",
    "complete",
    "drive_of",
    "efficiency",
    "floquet_multipliers",
    "harmonic_balance",
    "hill_steady_state",
    "hs_20_100",
    "hysteresis_loss",
    "input_torque",
    "load_datasheet",
    "load_drive",
    "load_model",
    "load_page",
    "lost_motion",
    "low_pass",
    "mean_torsion",
    "measured_dte",
    "operating_map",
    "preset",
    "quasi_static_torsion",
    "sample_static_error",
    "simulate_drive",
    "starting_torque",
    "transfer_function",
]
