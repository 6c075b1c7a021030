"""Sizes of the ports of a drive, from which effects are guessed: see `pymoo_hdte.laws.guess`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pymoo_hdte.discrepancy.campaign.believed import BelievedDrive
from pymoo_hdte.discrepancy.campaign.campaign import RATED_TORQUE
from pymoo_hdte.drive.effects import DriveSizes
from pymoo_hdte.units import ARCSEC

RATED_SPEED = 209.4
TYPICAL = {"input": 0.01, "output": 1.0, "mesh": 1.0, "sensor": 0.0}
LARGEST = {"input": 0.5, "output": 20.0, "mesh": 20.0, "sensor": 0.0}
_SHAFTS = {"input": (1.0, 2.0), "output": (1.0,), "mesh": (1.0, 2.0), "sensor": (1.0,)}
"""Orders at which a shaft is uneven by its making: once a turn, and twice where it is the wave
generator, which has two lobes."""


def port_sizes(
    believed: BelievedDrive, orders: Sequence[float], seen: Sequence[float], torque_scale: float
) -> dict[str, DriveSizes]:
    """Return the sizes of each port.

    Parameters
    ----------
    believed : BelievedDrive
    orders : sequence of float
        All orders of the features: harmonics beyond them would be guesses.
    seen : sequence of float
        Orders at which something was seen.
    torque_scale : float
    """
    lines = zip(believed.error_orders, believed.error_amplitudes, strict=True)
    shared = DriveSizes(
        force=0.0,
        largest=0.0,
        speed=RATED_SPEED,
        travel=torque_scale * RATED_TORQUE / believed.stiffness,
        stiffness=believed.stiffness,
        loaded=True,
        seen=tuple(sorted(seen)),
        shown=tuple(orders),
        error=2.0 * ARCSEC,
        largest_error=100.0 * ARCSEC,
        # A line believed to be nothing is missing where it is something.
        believed_orders=tuple(order for order, amplitude in lines if amplitude > 0.0),
        ratio=believed.ratio,
        inertia=max(believed.load_inertia, 10.0 * believed.output_inertia),
    )
    slower = {"input": 1.0, "mesh": 1.0, "output": believed.ratio, "sensor": believed.ratio}
    return {
        port: replace(
            shared,
            force=torque_scale * TYPICAL[port],
            largest=torque_scale * LARGEST[port],
            speed=shared.speed / slower[port],
            slower=slower[port],
            expected=_SHAFTS[port],
        )
        for port in slower
    }
