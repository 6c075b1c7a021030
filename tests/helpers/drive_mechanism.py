"""The harmonic drive as one instance of a mechanism: Eq. (9) with the effects that are laws."""

from __future__ import annotations

import cmath
import math

from numpy.typing import ArrayLike

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.drive.parameters import PARAMETERS
from pymoo_hdte.mechanism.believed import BelievedValue
from pymoo_hdte.mechanism.error_line import ErrorLine
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.parts import Input, LawAt, Port


def drive_mechanism(
    model: DriveModel, parameters: ArrayLike
) -> tuple[Mechanism, tuple[LawAt, ...]]:
    """Return one design of a drive as a mechanism, and the effects at its ports.

    Coordinates are ``input_angle`` and ``output_angle``, rad. Ports are those of `effects.law`:
    ``input`` and ``output``, against the housing, and ``mesh``, whose motion is the torsion
    th_in / N - th_out - theta_s(th_in). Inputs are ``motor_torque``, N.m at the input, and
    ``load_torque``, N.m against the output.

    Parameters
    ----------
    model : DriveModel
        Its speed and load are not used: records have their own.
    parameters : array, shape (5,)
        `PARAMETERS` in SI units.

    Raises
    ------
    InvalidInput
        For wrong parameters, or an effect that ports of a mechanism cannot have.
    """
    if not isinstance(model, DriveModel):
        raise InvalidInput("model", model, "a DriveModel, e.g. preset('published')")
    values = finite_array("parameters", parameters, (len(PARAMETERS),))
    coefficients = model.coefficients(values[None])
    _refuse(coefficients)
    mesh = {"input_angle": 1.0 / coefficients.ratio, "output_angle": -1.0}
    # The static error is subtracted: -Re(p exp(i x)) = |p| sin(x + arg p - pi / 2).
    error = tuple(
        ErrorLine("input_angle", float(order), abs(phasor), cmath.phase(phasor) - math.pi / 2.0)
        for order, phasor in zip(
            coefficients.error_orders, coefficients.error_phasors[0].tolist(), strict=True
        )
    )
    stiffness, damping = float(coefficients.stiffness[0]), float(coefficients.damping[0])
    bearings = float(coefficients.input_damping[0]), float(coefficients.output_damping)
    mechanism = Mechanism(
        {
            "input_angle": BelievedValue(float(coefficients.input_inertia[0])),
            "output_angle": BelievedValue(float(coefficients.output_inertia)),
        },
        (
            Port("input", {"input_angle": 1.0}, damping=BelievedValue(bearings[0])),
            Port("output", {"output_angle": 1.0}, damping=BelievedValue(bearings[1])),
            Port("mesh", mesh, BelievedValue(stiffness), BelievedValue(damping), error=error),
        ),
        (
            Input("motor_torque", {"input_angle": 1.0}),
            Input("load_torque", {"output_angle": -1.0}),
        ),
    )
    standing = [(effect.name, effect.at_port()) for effect in model.effects]
    return mechanism, tuple(LawAt(name, *place) for name, place in standing if place is not None)


def _refuse(coefficients: Coefficients) -> None:
    """Raise `InvalidInput` for what ports of a mechanism cannot have."""
    if coefficients.reaction != 0.0:
        allowed = "0: errors of a port do not act back on the coordinate that makes them"
        raise InvalidInput("reaction of the static error", coefficients.reaction, allowed)
    if coefficients.coupled:
        allowed = "inertias that turn with a coordinate: none in a clutch"
        raise InvalidInput("effects at the output", "coupled_inertia", allowed)
    # Periodic laws of a mechanism vary with the motion of their port, which here is the torsion.
    if any(law.loaded for _, law in coefficients.laws):
        allowed = "effects of motion only: its ports do not know what load the output passes on"
        raise InvalidInput("effects at the input", "load_dependent_friction", allowed)
    if any(law.before_slip is not None for _, law in coefficients.laws):
        allowed = "hysteresis, which says the same where a port turns back"
        raise InvalidInput("effects at the output", "presliding_friction", allowed)
    allowed = "no effect that varies with the input angle"
    if coefficients.stiffness_depth != 0.0:
        raise InvalidInput("effects at the mesh", "mesh_stiffness_variation", allowed)
    for port, law in coefficients.laws:
        if port == "mesh" and law.orders:
            raise InvalidInput("effects at the mesh", type(law).__name__, allowed)
