"""What the records say of the output's torque sensor: where it sits, and which unit it reads."""

from __future__ import annotations

import numpy as np

from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.likely_causes import LARGEST_DISTANCE, likely_unit

_ERRORS = 3.0
"""Standard errors within which the factor of a unit explains the mean torques."""
_SURE = 5.0
"""Standard errors between a sensor that feels the load's inertia and one that does not."""
_HALF = 0.5
"""Share of the load inertia within which a reading belongs to the nearer of both places."""


def inertia_felt(campaign: Campaign) -> tuple[float, float]:
    """Return the share of the load inertia that the output torque shows, and its standard error.

    At each order of the static error the output swings, and a sensor at the drive feels the load
    inertia times the acceleration: the share is 1 there and 0 at the brake, both dimensionless.

    Parameters
    ----------
    campaign : Campaign
        A campaign of a drive with a load inertia.

    Returns
    -------
    share, error : float
        0 and infinity where nothing swings or there is no load inertia.
    """
    weights, moments = 0.0, 0.0
    for record in campaign.running:
        angle = record.input_angle
        orders = np.array(campaign.believed.error_orders)
        phases = np.outer(angle, orders)
        time = (record.time - record.time.mean()) / max(np.ptp(record.time), 1e-30)
        basis = np.column_stack([np.ones_like(time), time, np.cos(phases), np.sin(phases)])
        measured = np.column_stack([record.output_angle, record.output_torque])
        lines, *_ = np.linalg.lstsq(basis, measured, rcond=None)
        noise = float(np.std(measured[:, 1] - basis @ lines[:, 1])) + 1e-30
        speed = (angle[-1] - angle[0]) / (record.time[-1] - record.time[0])
        swing = np.tile((orders * speed) ** 2, 2) * lines[2:, 0]
        expected = -campaign.believed.load_inertia * swing
        # Each coefficient of a line has this weight in least squares.
        weight = len(time) / (2.0 * noise**2)
        weights += weight * float(expected @ expected)
        moments += weight * float(expected @ lines[2:, 1])
    return (moments / weights, weights**-0.5) if weights > 0.0 else (0.0, np.inf)


def sensor_hints(campaign: Campaign) -> list[str]:
    """Return what is to be checked at the output's torque sensor, each in a sentence.

    Parameters
    ----------
    campaign : Campaign
    """
    return [hint for hint in (_place_hint(campaign), _unit_hint(campaign)) if hint]


def _unit_hint(campaign: Campaign) -> str:
    """Return which unit the mean torques are in, if it is not that of the loads that were set.

    A factor may differ by its standard error and by the stated errors of gain and zero.
    """
    records = [
        record for record in campaign.running if record.load_torque and not record.load_range
    ]
    load = np.array([record.load_torque for record in records])
    measured = np.array([np.mean(record.output_torque) for record in records])
    power = float(load @ load)
    factor = float(load @ measured) / power if power else 0.0
    if not factor:
        return ""
    error = float(np.std(measured - factor * load)) / power**0.5
    zero = campaign.rig.output_torque_zero * float(np.abs(load).sum()) / power
    distance = campaign.rig.output_torque_gain + (zero + _ERRORS * error) / abs(factor)
    cause = likely_unit("torque", factor, min(distance, LARGEST_DISTANCE))
    return f"The output torque is{cause.removeprefix(';')}" if cause else ""


def _place_hint(campaign: Campaign) -> str:
    """Return where the output's torque sensor seems to sit, if it is not where it is stated.

    The reading must differ from the stated place by half of the inertia and several standard
    errors.
    """
    share, error = inertia_felt(campaign)
    at_drive = campaign.rig.output_torque_at == "drive"
    stated, alternative = (1.0, 0.0) if at_drive else (0.0, 1.0)
    if abs(share - stated) <= max(_HALF, _SURE * error) or abs(share - alternative) >= _HALF:
        return ""
    where, place = ("behind", "brake") if at_drive else ("in front of", "drive")
    return (
        f"The output torque shows {100.0 * abs(share):.0f} % of the nominal load inertia: if its "
        f'sensor sits {where} the load, put output_torque_at = "{place}" into [rig].'
    )
