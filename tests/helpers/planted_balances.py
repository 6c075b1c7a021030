"""Effects to plant for the simpler tools, and sweeps without noise."""

from dataclasses import replace

import numpy as np

from experiments.studies.blind.candidate_terms import terms
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import TorsionPoints
from pymoo_hdte.drive import (
    Eccentricity,
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadInertia,
    MeshStiffnessVariation,
    ThermalDrift,
)
from pymoo_hdte.effects.friction import CoulombFriction, NonlinearDrag
from pymoo_hdte.effects.ripple import PeriodicTorque
from pymoo_hdte.effects.stiffness import HardeningStiffness
from pymoo_hdte.units import ARCSEC

EFFECTS = {
    "hardening_stiffness": LawAtPort("hardening_stiffness", "mesh", HardeningStiffness(1e9)),
    "coulomb_friction": LawAtPort("coulomb_friction", "output", CoulombFriction(1.5)),
    "nonlinear_drag": LawAtPort("nonlinear_drag", "input", NonlinearDrag(5e-7)),
    "kinematic_reaction": KinematicReaction(1.0),
    "eccentricity": Eccentricity(4.0 * ARCSEC, 0.7),
    "thermal_drift": ThermalDrift(3.0 * ARCSEC / 1000.0),
    "mesh_stiffness_variation": MeshStiffnessVariation(0.02, 1.1),
    "torque_ripple": LawAtPort("torque_ripple", "input", PeriodicTorque(6.0, 0.4, 0.01)),
    "kinematic_error": KinematicErrorLine(3.0, 2.0 * ARCSEC, 0.3),
    "load_inertia": LoadInertia(0.03),
}


def library_of(data):
    return terms(data.campaign.believed, data.features.orders.tolist())


def swept(data, torsion_of):
    """Data with a sweep 0 -> 40 -> -40 -> 40 N.m without noise."""
    path = np.concatenate([np.linspace(0, 40, 21), np.linspace(40, -40, 41)[1:]])
    path = np.concatenate([path, np.linspace(-40, 40, 41)[1:]])
    middle = (path[1:] + path[:-1]) / 2.0
    covariance = (0.1 * ARCSEC) ** 2 * np.eye(len(middle))
    intervals = np.arange(len(middle))
    points = TorsionPoints(middle, torsion_of(middle) + 1e-3, covariance, path, intervals)
    return replace(data, torsion=(points,))
