"""The library: every effect that the workflow can name."""

from __future__ import annotations

from collections.abc import Sequence

from pymoo_hdte.discrepancy.campaign.believed import Believed
from pymoo_hdte.discrepancy.drive.friction_candidates import friction_candidates
from pymoo_hdte.discrepancy.drive.line_candidates import line_candidates
from pymoo_hdte.discrepancy.drive.mesh_candidates import mesh_candidates
from pymoo_hdte.discrepancy.drive.parameters import MECHANICAL
from pymoo_hdte.discrepancy.engine import candidate
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.drive import DampingReference, KinematicReaction, LoadInertia, ThermalDrift
from pymoo_hdte.laws.unknowns import Parameter, unknown

_OF_THEIR_OWN = ("load_inertia", "damping")
"""Base parameters for which an effect of another name stands in the library."""


def candidates(
    believed: Believed, orders: Sequence[float], seen: Sequence[float], torque_scale: float
) -> list[Candidate]:
    """Return all candidates for a drive.

    Parameters
    ----------
    believed : Believed
    orders : sequence of float
        All orders of the features.
    seen : sequence of float
        Orders at which something was seen, for effects whose order is not known beforehand.
    torque_scale : float
        Of the campaign: how much larger its torques are than those the library is sized for.
    """
    return [
        *mesh_candidates(believed, orders, torque_scale),
        *friction_candidates(believed.ratio, orders, torque_scale),
        *line_candidates(believed, orders, seen, torque_scale),
        *_others(believed),
    ]


def out_of_tolerance(base: Sequence[Parameter], at_bounds: Sequence[str]) -> list[Candidate]:
    """Return a candidate for each base parameter that a fit left at a bound.

    What is believed to be nothing is missing where it is something, and not out of tolerance.
    """
    believed = {parameter.name: parameter.start for parameter in base}
    return [
        candidate.out_of_tolerance(name, name.replace("_", " "))
        for name in at_bounds
        if name in MECHANICAL and name not in _OF_THEIR_OWN and believed[name] > 0.0
    ]


def _others(believed: Believed) -> list[Candidate]:
    inertia = max(believed.load_inertia, 10.0 * believed.output_inertia)
    return [
        Candidate(
            "kinematic_reaction",
            "input",
            (unknown("share", -3.0, 3.0, 1.0),),
            ((1.0,),),
            lambda v: (KinematicReaction(v[0]),),
            "The mesh torque acts back on the input through the slope of the static error.",
            exact=True,
        ),
        Candidate(
            "load_inertia",
            "output",
            (unknown("inertia", 0.0, 10 * inertia, 0.3 * inertia),),
            ((0.15 * inertia,), (0.4 * inertia,), (1.0 * inertia,)),
            lambda v: (LoadInertia(v[0]),),
            "There is more inertia on the output than believed.",
            exact=True,
        ),
        Candidate(
            "damping_reference",
            "mesh",
            (unknown("factor", 0.02, 50.0, 2.0),),
            ((3.0,), (0.4,), (8.0,)),
            lambda v: (DampingReference(v[0] / believed.ratio**2),),
            "The damping of the torsion is referred to another shaft than believed.",
        ),
        Candidate(
            "thermal_drift",
            "sensor",
            (unknown("rate", -1e-6, 1e-6, 1e-9), unknown("time", 50.0, 1e5, 1000.0)),
            ((1e-9, 200.0), (1e-9, 1000.0), (1e-9, 1e4)),
            lambda v: (ThermalDrift(v[0], v[1]),),
            "The reading of the output angle drifts with time.",
        ),
    ]
