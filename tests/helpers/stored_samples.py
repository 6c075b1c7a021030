"""What the files of tests/stored hold, written out: they were saved once and stay as they are."""

from pymoo_hdte.drive import (
    DampingReference,
    DataSheet,
    DriveModel,
    Eccentricity,
    KinematicError,
    KinematicErrorLine,
    KinematicReaction,
    LawAtPort,
    LoadInertia,
    MeshStiffnessVariation,
    ThermalDrift,
)
from pymoo_hdte.drive.datasheet import ErrorSource, Mesh, Nominal
from pymoo_hdte.effects.effect import effect_named

MODEL = DriveModel(
    name="a sample",
    description="Every effect that a drive model may have.",
    provenance="Invented; θ in rad.",
    sheet=DataSheet(
        name="invented",
        source="tests/stored_samples.py",
        flexspline_teeth=160,
        circular_spline_teeth=162,
        # What files mean that were written before they said it.
        held="flexspline",
        orders_as_held="circular_spline",
        input_speed=123.4,
        load_torque=1.0 / 3.0,
        nominal=Nominal(1.7e-4, 2.5e4, 2e-4, 1.7e-4, 4.4e-4, 8.5e-4, 5e-4),
        mesh=Mesh(0.9, 50, 0.051348, 0.3490658503988659),
        error_sources=(
            ErrorSource("FS", "dFp1", "cumulative pitch deviation", "e_p", 8.33e-6, 8.9e-7),
            ErrorSource("WG", "e31", "radial runout", "e_w", 7.1e-6, 1.4e-6),
        ),
    ),
    kinematic_error=KinematicError(
        (1.0, 2.0, 2.02), (0.9, 1.0, 0.5), (0.0, -0.1, 4.2), "semi_amplitude", 3.5e-5
    ),
    effects=(
        LoadInertia(0.1),
        DampingReference(4.011),
        MeshStiffnessVariation(0.03, 3.852),
        MeshStiffnessVariation(0.01, 0.5, 4.0),
        Eccentricity(1e-5, 0.2),
        Eccentricity(2e-6, -0.2, 2.0),
        ThermalDrift(1e-9, 600.0),
        KinematicErrorLine(3.0, 1e-5, 0.7),
        KinematicReaction(0.9),
        *(
            LawAtPort(name, port, effect_named(name).law(*values))
            for name, port, *values in (
                ("hardening_stiffness", "mesh", 1.2e9, 0.1, 2e-4, 3.0),
                ("soft_windup", "mesh", 0.3, 2e-4),
                ("backlash", "mesh", 2.4e-5),
                ("clearance_variation", "mesh", 2.0, 0.3, 1.5e-5, 1e-5),
                ("hysteresis", "mesh", 1.0, 2e-4, 1.5),
                ("coulomb_friction", "input", 0.01),
                ("coulomb_friction", "output", 2.0),
                ("stribeck_friction", "input", 0.05, 0.05, 50.0),
                ("position_dependent_friction", "input", 1.0, 0.3, 0.02),
                ("nonlinear_drag", "output", 1e-6),
                ("torque_ripple", "input", 6.0, 1.0, 0.015),
            )
        ),
    ),
)
