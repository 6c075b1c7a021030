"""Lines of a motor above those that the rows of a record show, seen at lower orders there.

A row that is the mean of several samples lets through a part of what lies above the Nyquist order
of the rows. It shows at an order that differs from record to record, so that no law of the drive
has it, and an effect would be named for it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.drive import Coefficients, DriveEffect, LawAtPort, SteadyMotion
from pymoo_hdte.drive._solve.lead_response import lead_response
from pymoo_hdte.effects.ripple import COGGING_ORDERS, PeriodicTorque, cogging_of
from pymoo_hdte.effects.unknowns import is_among

Lines = NDArray[np.complex128]


def motor_orders(rig: Rig) -> tuple[float, ...]:
    """Return the orders at which the motor of a bench cogs; none where it is not known."""
    return cogging_of(rig.motor_slots, rig.motor_poles) if rig.motor_slots else ()


def orders_that_fold(rig: Rig) -> tuple[float, ...]:
    """Return the orders that are looked for above the rows: of its motor, or of any usual one."""
    return motor_orders(rig) or COGGING_ORDERS


def beyond_rows(effects: Sequence[DriveEffect], folded: Lines, rig: Rig) -> list[PeriodicTorque]:
    """Return the lines of a motor that the averaged rows of any record fold down.

    Parameters
    ----------
    effects : sequence of DriveEffect
    folded : ndarray of complex, shape (r, n_orders, 2, 1 + m)
        As of `Conditions`.
    rig : Rig
    """
    possible = orders_that_fold(rig)
    orders = [possible[place] for place in np.unique(np.nonzero(folded)[1])]
    laws = [
        effect.law for effect in effects if isinstance(effect, LawAtPort) and effect.port == "input"
    ]
    return [
        law
        for law in laws
        if isinstance(law, PeriodicTorque) and law.drives and is_among(orders, law.order)
    ]


def folded_down(
    coefficients: Coefficients,
    balance: SteadyMotion,
    speed: NDArray[np.float64],
    rig: Rig,
    torques: Sequence[PeriodicTorque],
    folded: Lines,
) -> tuple[NDArray[np.float64], Lines]:
    """Return the means (n, 4) and phasors (n, 4, m) that torques of a motor add to readings.

    The input moves so far that its inertia, the drive and the loop together take each torque. Other
    laws act with their mean slopes.

    Parameters
    ----------
    coefficients : Coefficients
        Coefficients of n cases, r records innermost.
    balance : SteadyMotion
        Their steady states without these torques.
    speed : ndarray, shape (n,)
        Mean speed of the input, rad/s.
    rig : Rig
    torques : sequence of PeriodicTorque
    folded : ndarray of complex, shape (r, n_orders, 2, 1 + m)
        As of `Conditions`.
    """
    orders = [law.order for law in torques]
    response = lead_response(coefficients, balance.slopes, speed, orders)
    if rig.output_torque_at == "brake":
        response = response.without_load()
    held = response.motor_torque + rig.proportional * response.rate + rig.integral
    lead = np.array([law.amplitude * np.exp(1j * law.phase) for law in torques]) / held
    lines = np.concatenate([response.channels * lead[:, None], lead[:, None]], axis=1)
    places = [int(np.argmin(np.abs(np.subtract(orders_that_fold(rig), order)))) for order in orders]
    shares = np.tile(folded[:, places], (len(lines) // len(folded), 1, 1, 1))
    parts = np.stack([lines.real, lines.imag], axis=-1)
    added = np.einsum("nckp,nkpm->ncm", parts, shares)
    return added[..., 0].real, added[..., 1:]


def folded_orders(folded: Lines | None, least: NDArray[np.float64], rig: Rig) -> tuple[float, ...]:
    """Return the orders that show in any record more than noise does.

    Parameters
    ----------
    folded : ndarray of complex, shape (r, n_orders, 2, 1 + m), or None
        As of `Conditions`.
    least : ndarray, shape (r, m)
        Noise of each line over the size that a line may have there.
    rig : Rig
    """
    if folded is None:
        return ()
    seen = np.abs(folded[..., 1:]).max(axis=2) > least[:, None]
    possible = np.array(orders_that_fold(rig))
    return tuple(possible[seen.any(axis=(0, 2))].tolist())
