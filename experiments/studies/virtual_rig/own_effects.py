"""Campaigns on a drive with user-defined effects, which the integrator of the rig does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from experiments.studies.virtual_rig.rig import TrueRig
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions, predict
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.drive import DriveEffect, SteadyMotion

_CHANNELS = ("transmission_error", "motor_torque", "coupling_torque", "lead")
_STEPS = 4
"""Steps to the angle of the changed drive; each leaves the lead's slope, some hundredths, of it."""


def with_effects(campaign: Campaign, rig: TrueRig, effects: Sequence[DriveEffect]) -> Campaign:
    """Return a campaign with the change of the rig's steady state by effects added, with its noise.

    By harmonic balance of the true drive with and without them; torsion sweeps stay as they are.

    Parameters
    ----------
    campaign : Campaign
        Of `rig.run_campaign`.
    rig : TrueRig
        The rig of the campaign.
    effects : sequence of DriveEffect
        Laws of friction or drag.

    Returns
    -------
    Campaign
    """
    records = campaign.running
    speed, load = np.array([(record.input_speed, record.load_torque) for record in records]).T
    base = base_parameters(rig.drive, campaign.rig, rig.error_phases, 0.0)
    values = {pair.name: np.array([pair.start]) for pair in base}
    count = len(records)
    elapsed = np.array([record.elapsed for record in records])
    when = Conditions(speed, load, elapsed, np.zeros((count, 3, 2), dtype=complex))
    calm, changed = (
        predict(rig.drive, campaign.rig, when, [1.0], values, added).balance
        for added in ((), tuple(effects))
    )
    running = tuple(
        _changed(record, row, calm, changed, rig.drive.ratio) for row, record in enumerate(records)
    )
    if campaign.rig.output_torque_at == "brake":
        pairs = zip(running, records, strict=True)
        running = tuple(replace(pair, output_torque=old.output_torque) for pair, old in pairs)
    return replace(campaign, running=running)


def _signals(motion: SteadyMotion, row: int, angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the channels (4, n) of a row at angles (n,) of the input."""
    waves = np.exp(1j * np.outer(motion.torus.orders, angle))
    return (np.array([getattr(motion, name)[row] for name in _CHANNELS]) @ waves).real


def _changed(
    record: RunningRecord, row: int, calm: SteadyMotion, changed: SteadyMotion, ratio: float
) -> RunningRecord:
    before = _signals(calm, row, record.input_angle)
    even, angle = record.input_angle - before[3], record.input_angle
    # All signals depend on the angle as it is, which the lead changes; it varies far more slowly.
    for _ in range(_STEPS):
        angle = even + _signals(changed, row, angle)[3]
    error, motor, coupling, _ = _signals(changed, row, angle) - before
    return replace(
        record,
        input_angle=angle,
        output_angle=record.output_angle + (angle - record.input_angle) / ratio - error,
        input_torque=record.input_torque + motor,
        output_torque=record.output_torque + coupling,
    )
