"""The records that possible tests would give of the nominal drive, with noise, as a campaign.

They are treated as measured ones: the same checks refuse limits with which no campaign could be
analysed, and the same line fits give the covariance of their features.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS, Features, measure
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import base_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import (
    Conditions,
    coefficients_of,
    predict,
)
from pymoo_hdte.discrepancy._plan.limits import PlanLimits
from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import expected_orders, highest_order
from pymoo_hdte.drive import DriveEffect, mean_torsion

_ROWS_A_TURN = 40
"""Most rows per input turn; more raw samples are averaged. This suffices for order 14, up to which
lines are fitted, and keeps the information of all samples."""
_SWEEP_ROWS = 480
"""Rows of a sweep from one end to the other."""
_UNMEASURED = 1e12
"""Factor on the variance of a channel that is not measured."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class PlannedTest:
    """One possible test.

    Attributes
    ----------
    kind : str
        ``"running"`` or ``"torsion_sweep"``.
    speed : float
        Input speed, rad/s, negative in reverse; 0 for a sweep.
    load : float
        Load torque, N.m, signed as in `RunningRecord`; for a sweep the largest torque.
    elapsed : float
        Time in the session at which the test starts, s.
    """

    kind: str
    speed: float
    load: float
    elapsed: float = 0.0


def possible_tests(limits: PlanLimits) -> tuple[PlannedTest, ...]:
    """Return all possible tests within limits: running ones first, then sweeps."""
    signs = [1.0 if direction == "forward" else -1.0 for direction in limits.directions]
    times = (0.0, limits.session) if limits.session else (0.0,)
    running = [
        # Adding zero turns a negative zero into zero.
        PlannedTest("running", sign * speed, sign * load + 0.0, time)
        for time, sign, speed, load in product(times, signs, limits.speeds, limits.loads)
    ]
    return (*running, *(PlannedTest("torsion_sweep", 0.0, reach) for reach in limits.sweeps))


def imagined_campaign(
    believed: BelievedDrive,
    limits: PlanLimits,
    tests: Sequence[PlannedTest],
    rng: np.random.Generator,
    effects: Sequence[DriveEffect] = (),
) -> Campaign:
    """Return the records that tests would give, in their order, all with the role to be fitted.

    Parameters
    ----------
    believed : BelievedDrive
    limits : PlanLimits
    tests : sequence of PlannedTest
        At least one running record.
    rng : Generator
        Generator for phases of the static error, and noise.
    effects : sequence of DriveEffect
        Effects that the drive has besides the nominal ones.

    Raises
    ------
    InvalidInput
        If `Campaign` refuses the records.
    """
    phases = rng.uniform(-np.pi, np.pi, len(believed.error_orders))
    base = base_parameters(believed, limits.rig, phases.tolist(), 0.0)
    values = {parameter.name: np.array([parameter.start]) for parameter in base}
    running = [test for test in tests if test.kind == "running"]
    sweeps = [test for test in tests if test.kind != "running"]
    orders = _orders(believed)
    speed, travel = np.array([test.speed for test in running]), _travel(limits, believed.ratio)
    conditions = Conditions(
        speed,
        np.array([test.load for test in running]),
        np.array([test.elapsed for test in running]),
        np.zeros((len(running), 3, 1 + len(orders)), dtype=complex),
        # A line is fitted at the nearest analysed order, as in a record of this length.
        input_angle=np.sign(speed) * travel / 2.0,
        travel=np.full(len(running), travel),
    )
    prediction = predict(believed, limits.rig, conditions, orders, values, effects)
    records = [
        _running(f"run_{k:03d}", test, believed.ratio, limits, orders, lines, mean, rng)
        for k, (test, lines, mean) in enumerate(
            zip(running, prediction.phasors[0], prediction.mean[0], strict=True)
        )
    ]
    swept = [
        _swept(f"sweep_{k:03d}", test.load, believed, limits, values, effects, rng)
        for k, test in enumerate(sweeps)
    ]
    return Campaign("planned", "believed", believed, limits.rig, tuple(records), tuple(swept))


def _travel(limits: PlanLimits, ratio: float) -> float:
    """Return how far the input turns in a record, rad."""
    return float(limits.output_turns * 2.0 * np.pi * ratio)


def _orders(believed: BelievedDrive) -> list[float]:
    """Return the orders of lines in the records: of the error, their sums, and both shafts."""
    lines = believed.error_orders
    sums = [order + partner for order in lines for partner in lines]
    orders = [1.0 / believed.ratio, 2.0 / believed.ratio, *map(float, range(1, 9)), *lines, *sums]
    return sorted({round(order, 9) for order in orders if order < _ROWS_A_TURN / 2})


def imagined_data(campaign: Campaign, limits: PlanLimits, orders: Sequence[float]) -> Data:
    """Return the features of a campaign at the usual orders and at those of stated effects."""
    looked_at = expected_orders(campaign, RULES)
    apart = RULES.line_separation / campaign.believed.ratio
    for order in orders:
        distance = min(abs(order - known) for known in looked_at)
        if distance >= apart and order <= highest_order(campaign, RULES):
            looked_at.append(order)
    features = measure(campaign, campaign.running, sorted(looked_at))
    return training_data(campaign, _measured_only(features, limits), RULES)


def _measured_only(features: Features, limits: PlanLimits) -> Features:
    """Return features in which channels that are not measured carry no information."""
    covariance = features.covariance.copy()
    for channel, name in enumerate(CHANNELS):
        if name not in limits.channels:
            mean = [MEANS.index(channel)] if channel in MEANS else []
            places = np.append(mean, features.places(channel)).astype(int)
            covariance[:, places, places] *= _UNMEASURED
    return replace(features, covariance=covariance)


def _running(
    name: str,
    test: PlannedTest,
    ratio: float,
    limits: PlanLimits,
    orders: Sequence[float],
    lines: NDArray[np.complex128],
    mean: Values,
    rng: np.random.Generator,
) -> RunningRecord:
    """Return a record of lines (4, m) and means (4,) with the noise of the sensors."""
    rig, speed = limits.rig, abs(test.speed)
    averaged = max(int(limits.sample_rate * 2.0 * np.pi / (_ROWS_A_TURN * speed)), 1)
    rate = limits.sample_rate / averaged
    duration = _travel(limits, ratio) / speed
    time = np.arange(int(np.ceil(duration * rate)) + 1) / rate
    angle = test.speed * time
    waves = np.exp(1j * np.outer(orders, angle))
    error, motor, load, lead = (lines @ waves).real + mean[:, None]
    noise = rng.standard_normal((4, len(time))) / averaged**0.5
    angle = angle + (lead - mean[3])
    return RunningRecord(
        name=name,
        role="train",
        input_speed=test.speed,
        load_torque=test.load,
        sample_rate=rate,
        samples_averaged=averaged,
        elapsed=test.elapsed,
        time=time,
        input_angle=angle + ratio * rig.angle_noise * noise[0],
        output_angle=angle / ratio - error + rig.angle_noise * noise[1],
        input_torque=motor + rig.input_torque_noise * noise[2],
        output_torque=load - mean[2] + test.load + rig.output_torque_noise * noise[3],
    )


def _swept(
    name: str,
    reach: float,
    believed: BelievedDrive,
    limits: PlanLimits,
    values: dict[str, Values],
    effects: Sequence[DriveEffect],
    rng: np.random.Generator,
) -> TorsionRecord:
    """Return a sweep 0, reach, -reach, reach N.m with the noise of the sensors."""
    whole, half = _SWEEP_ROWS, _SWEEP_ROWS // 2
    legs = ((0.0, reach, half), (reach, -reach, whole), (-reach, reach, whole))
    path = [np.linspace(start, end, rows + 1)[1:] for start, end, rows in legs]
    ends = np.concatenate([[0.0], *path])
    every = (*believed.effects, *effects)
    torsion = mean_torsion(coefficients_of(believed, values, every, 1), ends)[0]
    torque, rate = (ends[1:] + ends[:-1]) / 2.0, limits.sample_rate
    noise = rng.standard_normal((2, len(torque)))
    return TorsionRecord(
        name=name,
        role="train",
        sample_rate=rate,
        time=np.arange(len(torque)) / rate,
        output_angle=-torsion + limits.rig.torsion_angle_noise * noise[0],
        output_torque=torque + limits.rig.output_torque_noise * noise[1],
    )
