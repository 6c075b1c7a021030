"""The harmonic drive as one instance of a mechanism: Eq. (9) with the effects that are laws."""

from __future__ import annotations

import cmath

import numpy as np
from numpy.typing import ArrayLike

from pymoo_hdte.checks import InvalidInput, finite_array
from pymoo_hdte.drive.coefficients import Coefficients
from pymoo_hdte.drive.model import PARAMETERS, DriveModel
from pymoo_hdte.drive.port_effects import LawAtPort
from pymoo_hdte.mechanism.mechanism import Believed, ErrorLine, Input, LawAt, Mechanism, Port


def drive_mechanism(
    model: DriveModel, parameters: ArrayLike
) -> tuple[Mechanism, tuple[LawAt, ...]]:
    """Return one design of a drive as a mechanism, and the laws at its ports.

    Coordinates ``input`` and ``output`` are the angles of wave generator and circular spline, rad.
    Ports are ``input_bearing`` and ``output_bearing``, and ``mesh``, whose motion is the torsion
    th_in / N - th_out - theta_s(th_in). Inputs are ``motor_torque``, N.m at the input, and
    ``load_torque``, N.m against the output.

    Parameters
    ----------
    model : DriveModel
        Its operating condition is left to the records.
    parameters : array, shape (5,)
        `PARAMETERS` in SI units.

    Raises
    ------
    InvalidInput
        For wrong parameters, or an effect that no mechanism can have: what varies with the input
        angle at the mesh, where periodic laws of a mechanism depend on the torsion, and a reaction
        of theta_s on the input.
    """
