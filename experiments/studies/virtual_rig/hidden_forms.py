"""Hidden effects of blind campaigns, by name, each with plausible random parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from experiments.studies.virtual_rig import listed_forms, unlisted_forms
from pymoo_hdte.checks import one_of, real_number
from pymoo_hdte.discrepancy._records.believed import BelievedDrive

_Draw = Callable[[BelievedDrive, np.random.Generator, float], listed_forms.Drawn]


def _by_name(*draws: _Draw) -> dict[str, _Draw]:
    return {draw.__name__: draw for draw in draws}


LISTED_FORMS = _by_name(
    listed_forms.hardening_stiffness,
    listed_forms.soft_windup,
    listed_forms.hysteresis,
    listed_forms.backlash,
    listed_forms.clearance_variation,
    listed_forms.coulomb_friction,
    listed_forms.stribeck_friction,
    listed_forms.position_dependent_friction,
    listed_forms.nonlinear_drag,
    listed_forms.mesh_stiffness_variation,
    listed_forms.kinematic_error,
    listed_forms.kinematic_reaction,
    listed_forms.eccentricity,
    listed_forms.torque_ripple,
    listed_forms.load_inertia,
    listed_forms.damping_reference,
    listed_forms.thermal_drift,
)
"""Effects that the library holds under the same name, in another form."""

UNLISTED_FORMS = _by_name(
    unlisted_forms.output_vibration,
    unlisted_forms.compliant_sensor,
    unlisted_forms.load_ripple,
    unlisted_forms.speed_stiffening,
    unlisted_forms.encoder_interpolation,
    unlisted_forms.friction_bursts,
)
"""Effects that the library does not hold."""

HIDDEN_FORMS = LISTED_FORMS | UNLISTED_FORMS


@dataclass(frozen=True)
class HiddenEffect:
    """One hidden effect.

    Attributes
    ----------
    name : str
        A key of `HIDDEN_FORMS`.
    port : str
        "input", "output", "mesh" or "sensor".
    parameters : dict
        Fields of `laws.Side` (input, output), `laws.Mesh` or
        `sensors.OutputEncoder` and their values, SI.
    """

    name: str
    port: str
    parameters: dict[str, float | tuple[float, ...]]


def draw_effect(
    name: str, believed: BelievedDrive, rng: np.random.Generator, size: float = 1.0
) -> HiddenEffect:
    """Draw one effect of `HIDDEN_FORMS`; ``size`` scales its strength, 1 being typical.

    Raises
    ------
    InvalidInput
        For an unknown name or a size that is not above 0.
    """
    one_of("name of a hidden effect", name, HIDDEN_FORMS)
    size = real_number("size", size, above=0.0)
    port, parameters = HIDDEN_FORMS[name](believed, rng, size)
    return HiddenEffect(name, port, parameters)
