"""Closures: what a drive model may hold beside the effects of the ladder, each with its derivation.

A closure changes the values (theta_s, K, J_in, B_fc) that enter Eq. (9), or adds to the DTE that is
read. Each is one equation with one or two open parameters; at their lower bounds, or at 0, it does
nothing. They act in the order of `CLOSURES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import DriveModel

Column = NDArray[np.float64]
Parameters = dict[str, float]


@dataclass(frozen=True)
class Values:
    """What enters Eq. (9) at n points: theta_s in rad, K in N.m/rad, J_in, B_fc in SI; (n,) each.

    ``added`` is what is read beside the peak-to-peak of theta_d, in rad.
    """

    theta_s: Column
    stiffness: Column
    input_inertia: Column
    damping: Column
    added: Column


@dataclass(frozen=True)
class Closure:
    """One equation, its open parameters with their ranges, and a sentence that states it."""

    name: str
    bounds: dict[str, tuple[float, float]]
    sentence: str
    apply: Callable[[Values, DriveModel, Parameters], Values]


def _nominal_stiffness(model: DriveModel) -> float:
    return float(model.nominal[1])


def _preload(values: Values, model: DriveModel, parameters: Parameters) -> Values:
    """Let the damping rise with the stiffness.

    A mesh under more preload F is stiffer, K ~ F^m with m between 1/3 (Hertz's contact) and 1 (more
    teeth), and loses more, c ~ F, so that c ~ K^(1/m): an exponent of 0 to 3.
    """
    ratio = values.stiffness / _nominal_stiffness(model)
    return replace(values, damping=values.damping * ratio ** parameters["preload_exponent"])


def _averaging(values: Values, model: DriveModel, parameters: Parameters) -> Values:
    """Let the static error fall with the stiffness.

    Eq. (2) averages errors over z_t teeth in mesh, theta_s ~ z_t^(-1/2); teeth in parallel give
    K ~ z_t. Where a share s of the differences of K stems from z_t, theta_s ~ K^(-s/2): an
    exponent of 0 to 1/2, here up to 1 for errors that do not average as independent ones.
    """
    ratio = values.stiffness / _nominal_stiffness(model)
    return replace(values, theta_s=values.theta_s * ratio ** -parameters["averaging_exponent"])


def _sharing(values: Values, model: DriveModel, parameters: Parameters) -> Values:
    """Let the stiffness fall where teeth with errors share the load unevenly.

    A tooth carries load once the deflection T/K has closed its gap, which is a share of theta_s.
    The teeth that carry, and with them K, fall as 1 / (1 + s theta_s K / T).
    """
    gap = values.theta_s * values.stiffness / model.sheet.load_torque
    return replace(values, stiffness=values.stiffness / (1.0 + parameters["sharing"] * gap))


def _torsion(values: Values, model: DriveModel, parameters: Parameters) -> Values:
    """Add a share of the torsion under load to what is read: r T / K.

    From a load that is not constant over the output turn (ripple of the brake), or that was not
    wholly applied when the reading began. 5 % of 40 N.m are 16 arcsec at the nominal K.
    """
    torsion = parameters["torsion_share"] * model.sheet.load_torque / values.stiffness
    return replace(values, added=values.added + torsion)


def _startup(values: Values, model: DriveModel, parameters: Parameters) -> Values:
    """Add what is left of the start-up when the window of the DTE opens.

    The load's start makes the torsion ring with a share g of T/K. It decays at c / (2 J), J being
    the two free inertias in series, so that after the time t the window still holds
    g (T/K) exp(-c t / (2 J)), on top of the periodic part.
    """
    table = np.tile(model.nominal, (len(values.stiffness), 1))
    table[:, 1], table[:, 2], table[:, 4] = values.stiffness, values.input_inertia, values.damping
    drive = model.coefficients(table)
    inertia = 1.0 / (1.0 / (drive.input_inertia * drive.ratio**2) + 1.0 / drive.output_inertia)
    left = np.exp(-drive.damping / (2.0 * inertia) * parameters["startup_time"])
    ringing = parameters["startup_share"] * model.sheet.load_torque / values.stiffness * left
    return replace(values, added=values.added + ringing)


CLOSURES = {
    closure.name: closure
    for closure in (
        Closure(
            "preload",
            {"preload_exponent": (0.0, 3.0)},
            "damping rises with stiffness through the preload, c ~ K^p",
            _preload,
        ),
        Closure(
            "averaging",
            {"averaging_exponent": (0.0, 1.0)},
            "theta_s falls with stiffness, as more teeth average it, theta_s ~ K^-q",
            _averaging,
        ),
        Closure(
            "sharing",
            {"sharing": (0.0, 3.0)},
            "stiffness falls with theta_s, as teeth with errors share the load unevenly",
            _sharing,
        ),
        Closure(
            "torsion",
            {"torsion_share": (0.0, 0.3)},
            "a share of the torsion T/K is read as DTE",
            _torsion,
        ),
        Closure(
            "startup",
            {"startup_share": (0.0, 1.0), "startup_time": (0.0, 0.5)},
            "the window still holds some of the start-up",
            _startup,
        ),
    )
}
"""By name, in the order in which they act."""
