"""All hidden effects by name, and how many forms each has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from experiments.studies.blind.rig import mesh_forms as mesh
from experiments.studies.blind.rig import shaft_forms as shaft
from experiments.studies.blind.rig import unlisted_forms as unlisted
from experiments.studies.blind.rig.hidden import Drawn

Draw = Callable[[np.random.Generator, int], Drawn]

_LISTED: tuple[tuple[Draw, int], ...] = (
    (mesh.hardening_stiffness, 3),
    (mesh.soft_windup, 4),
    (mesh.hysteresis, 3),
    (mesh.backlash, 3),
    (mesh.clearance_variation, 3),
    (shaft.coulomb_friction, 3),
    (shaft.stribeck_friction, 4),
    (shaft.position_dependent_friction, 3),
    (shaft.nonlinear_drag, 4),
    (shaft.load_dependent_friction, 4),
    (mesh.mesh_stiffness_variation, 4),
    (mesh.kinematic_error, 3),
    (mesh.kinematic_reaction, 3),
    (shaft.eccentricity, 3),
    (shaft.torque_ripple, 3),
    (shaft.load_inertia, 3),
    (mesh.damping_reference, 3),
    (shaft.thermal_drift, 4),
)
_UNLISTED: tuple[Draw, ...] = (
    unlisted.output_vibration,
    unlisted.compliant_sensor,
    unlisted.load_ripple,
    unlisted.speed_stiffening,
    unlisted.friction_bursts,
    unlisted.motor_lag,
    unlisted.creep,
    unlisted.load_growing_error,
    unlisted.warming_friction,
    unlisted.torque_sensor_curvature,
)
_DRAWS = {draw.__name__: draw for draw, _ in _LISTED} | {one.__name__: one for one in _UNLISTED}
FORMS = {draw.__name__: count for draw, count in _LISTED}
"""Number of forms of each listed effect, that of the library among them."""
LISTED = tuple(FORMS)
UNLISTED = tuple(one.__name__ for one in _UNLISTED)


def draw_effect(name: str, form: int, rng: np.random.Generator) -> Drawn:
    """Draw an effect of `LISTED` or `UNLISTED` in one of its forms.

    Raises
    ------
    KeyError
        For an unknown name.
    """
    return _DRAWS[name](rng, form)
