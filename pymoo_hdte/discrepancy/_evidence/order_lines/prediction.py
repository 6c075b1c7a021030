"""Predicted readings of the rig's sensors: order lines and means of every channel.

One call of the harmonic balance serves all records of a campaign and all vectors of parameters that
share their effects. Loads are the measured ones, not the planned ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.bench import IDEAL, Bench
from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import (
    beyond_orders,
    folded_down,
    free_input,
)
from pymoo_hdte.discrepancy._evidence.order_lines.steady_states import (
    PREDICTION,
    Effort,
    Lead,
    merged,
    steady_motions,
)
from pymoo_hdte.discrepancy._records.believed import MECHANICAL, BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.line_fit import CHANNELS
from pymoo_hdte.drive import (
    Coefficients,
    DriveEffect,
    SpeedLoop,
    SteadyMotion,
)
from pymoo_hdte.drive._effects import Session
from pymoo_hdte.drive._solve.lead_response import LeadResponse, lead_response
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.effects.law import Values

LOOP = ("loop_gain", "loop_lag")
"""Unknowns of the speed loop: the share by which it is stronger than stated, and its lag in s."""
_SAME = 1e-8
"""Orders nearer to each other are one; those of a torus are sums of rounded numbers."""
_UNRESOLVED = 0.1
"""Cycles in an output turn within which two lines are read as one; records of a few turns tell
lines further apart."""


@dataclass(frozen=True)
class Conditions:
    """Operating conditions of r records, arrays of shape (r,).

    Attributes
    ----------
    input_speed : ndarray
        Measured mean, rad/s.
    output_torque : ndarray
        Measured mean, N.m: the load with the sensor's gain and zero error.
    elapsed : ndarray
        Middle of the record within the session, s.
    bends : complex ndarray, shape (r, 3, 1 + m)
        Contribution of a drift that is curved within a record: see `OrderLines`.
    temperature : ndarray, optional
        Kelvin, NaN where unknown; by default in all records.
    input_angle, travel : ndarray, optional
        Angle of the input in the middle of the record, and its travel from start to end, rad; by
        default 0.
    fading : complex ndarray, shape (r, k, 1 + m), optional
        Contribution of what fades within a record, see `OrderLines`; by default nothing fades.
    lead : complex ndarray, shape (r, m), optional
        Measured lines of the input angle, rad, near which the input moves; by default it moves as
        the speed loop lets it.
    lead_share : ndarray, shape (r, m), optional
        Weight of these lines against those of the loop, which together excite the drive; by default
        1: the measured motion excites, whatever the loop does.
    unsteady : complex ndarray, shape (r, 2, m), optional
        Lines of the input's speed and acceleration beyond those of a steady motion, rad/s and
        rad/s2: see `unsteady_lines`; by default none.
    folded : complex ndarray, shape (r, k, 2, 1 + m), optional
        Contribution of what a motor does at `COGGING_ORDERS` beyond those that the rows of a record
        show, see `OrderLines`; by default none.
    """

    input_speed: NDArray[np.float64]
    output_torque: NDArray[np.float64]
    elapsed: NDArray[np.float64]
    bends: NDArray[np.complex128]
    temperature: NDArray[np.float64] | None = None
    input_angle: NDArray[np.float64] | None = None
    travel: NDArray[np.float64] | None = None
    fading: NDArray[np.complex128] | None = None
    lead: NDArray[np.complex128] | None = None
    lead_share: NDArray[np.float64] | None = None
    unsteady: NDArray[np.complex128] | None = None
    folded: NDArray[np.complex128] | None = None

    def rows(self, rows: NDArray[np.int_]) -> Conditions:
        """Return the conditions of some of the records."""
        known = {attribute.name: getattr(self, attribute.name) for attribute in fields(self)}
        of_rows = {name: value[rows] for name, value in known.items() if value is not None}
        return replace(self, **of_rows)

    def __len__(self) -> int:
        return len(self.input_speed)


@dataclass(frozen=True)
class Prediction:
    """Means, shape (v, r, 4), and phasors, (v, r, 4, m), of `CHANNELS` for v vectors, r records.

    SI. The mean of the output torque and of the input angle are conditions, not predictions. Where
    the measured lead excites, that of the loop is predicted beside it (`_loop_lead`), and
    ``response`` (v r rows) is how the other channels follow the lead.
    ``balance`` has the steady states, vectors outermost.
    """

    mean: NDArray[np.float64]
    phasors: NDArray[np.complex128]
    balance: SteadyMotion
    response: LeadResponse | None = None


def predict(
    believed: BelievedDrive,
    rig: Rig,
    conditions: Conditions,
    orders: Sequence[float],
    values: dict[str, NDArray[np.float64]],
    effects: Sequence[DriveEffect] = (),
    start: SteadyMotion | None = None,
    effort: Effort = PREDICTION,
    bench: Bench = IDEAL,
) -> Prediction:
    """Return the predicted readings of the sensors.

    Vectors that share the numbers of the believed effects are solved together.

    Parameters
    ----------
    believed, rig
    conditions : Conditions
    orders : sequence of float, length m
        Orders of the predicted lines, in cycles per input turn.
    values : dict of ndarray, shape (v,)
        Parameters by name, those of `parameters.base_parameters`.
    effects : sequence of DriveEffect
        Effects in addition to the believed ones, shared by all vectors.
    start : SteadyMotion, optional
        Steady states of the records for nearby values, to begin from.
    effort : Effort
        How far the steady states are searched for.
    bench : Bench
        Nuisances, whose unknowns are among the values.
    """
    parts = []
    groups = bench.groups(believed.effects, values)
    for rows, known in groups:
        group = {name: column[rows] for name, column in values.items()}
        present = (*known, *effects)
        parts.append(
            _predict_group(believed, rig, conditions, orders, group, present, start, effort)
        )
    if len(parts) == 1:
        return parts[0]
    return _in_order(parts, [rows for rows, _ in groups], len(conditions))


def _predict_group(
    believed: BelievedDrive,
    rig: Rig,
    conditions: Conditions,
    orders: Sequence[float],
    values: dict[str, NDArray[np.float64]],
    present: Sequence[DriveEffect],
    start: SteadyMotion | None,
    effort: Effort,
) -> Prediction:
    """Return the prediction of vectors that share all effects ``present``."""
    count, records = len(values["offset"]), len(conditions)
    present, beyond = beyond_orders(present, orders)
    gain = 1.0 + values["output_torque_gain"][:, None]
    of_torques = _torque_readings(present, conditions)
    load = conditions.output_torque - of_torques[1] - values["output_torque_zero"][:, None]
    load = load / gain
    coefficients = coefficients_of(believed, values, present, records)
    coefficients = replace(coefficients, elapsed=np.tile(conditions.elapsed, count))
    if conditions.temperature is not None:
        coefficients = replace(coefficients, temperature=np.tile(conditions.temperature, count))
    nearby = None if start is None else start.rows(np.tile(np.arange(records), count))
    speed = np.tile(conditions.input_speed, count)
    lead = None
    if conditions.lead is not None:
        lead = Lead(np.array(orders, dtype=float), np.tile(conditions.lead, (count, 1)))
    balance = steady_motions(coefficients, speed, load.ravel(), rig, nearby, effort, lead)
    at_brake = rig.output_torque_at == "brake"
    output_torque = balance.brake_torque if at_brake else balance.coupling_torque
    error = balance.transmission_error
    for effect in present:
        turned = effect.turned_back(balance.torus.orders * speed[:, None])
        error = error if turned is None else error + turned * balance.coupling_torque
    channels = [
        error,
        balance.motor_torque,
        output_torque,
        balance.lead,
        _motor_ripple(balance, coefficients) + np.zeros_like(balance.lead),
        balance.slower,
    ]
    lines = _lines(balance, channels, orders, believed.ratio, conditions)
    response = None
    if lead is not None:
        response = lead_response(coefficients.at_loads(load.ravel()), balance.slopes, speed, orders)
        if rig.output_torque_at == "brake":
            response = response.without_load()
        _follow_lead(lines, response, lead, balance)
        if conditions.unsteady is not None:
            unsteady = np.tile(conditions.unsteady, (count, 1, 1))
            lines[:, :3] += np.einsum("nck,nkm->ncm", response.slow, unsteady)
        loop = {name: np.repeat(values[name], records) for name in LOOP}
        lines[:, 3] = _loop_lead(lines, response, lead, rig, loop)
        if conditions.lead_share is not None:
            rest = np.tile(1.0 - conditions.lead_share, (count, 1))
            lines[:, :3] += response.channels * (rest * (lines[:, 3] - lead.phasors))[:, None]
    lines[:, 1] += lines[:, 4]
    lines = lines[:, : len(CHANNELS)]
    means = np.array([channel[:, 0].real for channel in channels[: len(CHANNELS)]])
    phasors = lines.reshape(count, records, len(CHANNELS), len(orders))
    mean = means.T.reshape(count, records, len(CHANNELS))
    mean[..., 1:3] += of_torques.T
    if beyond and conditions.folded is not None:
        loop = SpeedLoop(rig.proportional, rig.integral)
        free = free_input(coefficients.at_loads(load.ravel()), balance, speed, loop, beyond)
        if at_brake:
            free[:, 2] = 0.0
        of_means, of_lines = folded_down(free, beyond, conditions.folded)
        mean += of_means.reshape(mean.shape)
        phasors += of_lines.reshape(phasors.shape)
    _add_sensor_errors(believed.ratio, conditions, orders, values, present, mean, phasors)
    return Prediction(mean, phasors, balance, response)


def _follow_lead(
    lines: NDArray[np.complex128], response: LeadResponse, lead: Lead, balance: SteadyMotion
) -> None:
    """Add to lines (n, 6, m) what follows the lead at orders that the torus does not hold."""
    beyond = [balance.torus.find(order) is None for order in lead.orders.tolist()]
    phasors = np.where(beyond, lead.phasors, 0.0)
    lines[:, :3] += response.channels * phasors[:, None]
    lines[:, 5] -= response.rate * phasors


def _loop_lead(
    lines: NDArray[np.complex128],
    response: LeadResponse,
    lead: Lead,
    rig: Rig,
    loop: dict[str, NDArray[np.float64]],
) -> NDArray[np.complex128]:
    """Return the lead (n, m), rad, at which the loop's torque would be the one that it takes.

    One step of Newton's method from the measured lead: exact for a drive that is linear in it.
    """
    gain, lag = (1.0 + loop["loop_gain"])[:, None], loop["loop_lag"][:, None]
    answer = gain / (1.0 + lag * response.rate)
    commanded = answer * (rig.proportional * lines[:, 5] - rig.integral * lead.phasors)
    stiffness = response.motor_torque + answer * (rig.proportional * response.rate + rig.integral)
    return np.asarray(lead.phasors - (lines[:, 1] - commanded) / stiffness)


def _in_order(
    parts: Sequence[Prediction], places: Sequence[NDArray[np.int_]], records: int
) -> Prediction:
    """Return predictions of several groups of vectors as one, in the order of their places."""
    order = np.argsort(np.concatenate(places))
    mean = np.concatenate([part.mean for part in parts])[order]
    phasors = np.concatenate([part.phasors for part in parts])[order]
    cases = [np.add.outer(records * rows, np.arange(records)).ravel() for rows in places]
    balance = merged([part.balance for part in parts], cases)
    responses = [part.response for part in parts if part.response is not None]
    rows = np.argsort(np.concatenate(cases))
    response = LeadResponse.joined(responses, rows) if responses else None
    return Prediction(mean, phasors, balance, response)


def coefficients_of(
    believed: BelievedDrive,
    values: dict[str, NDArray[np.float64]],
    effects: Sequence[DriveEffect],
    records: int,
) -> Coefficients:
    """Return the coefficients of all rows, vectors outermost, with all effects; believed first."""
    rows = {name: np.repeat(values[name], records) for name in MECHANICAL}
    lines = [
        sine_phasor(values[f"error_amplitude_{line}"], values[f"error_phase_{line}"])
        for line in range(len(believed.error_orders))
    ]
    coefficients = Coefficients(
        ratio=believed.ratio,
        input_speed=0.0,
        load_torque=0.0,
        stiffness=rows["stiffness"],
        damping=rows["damping"],
        stiffness_depth=0.0,
        stiffness_phase=0.0,
        input_inertia=rows["input_inertia"],
        input_damping=rows["input_damping"],
        output_inertia=believed.output_inertia + rows["load_inertia"],
        output_damping=rows["output_damping"],
        error_orders=np.array(believed.error_orders),
        error_phasors=np.repeat(np.array(lines).T, records, axis=0),
        load_inertia=rows["load_inertia"],
    )
    for effect in effects:
        coefficients = effect.apply(coefficients)
    return coefficients


def _lines(
    balance: SteadyMotion,
    channels: Sequence[NDArray[np.complex128]],
    orders: Sequence[float],
    ratio: float,
    conditions: Conditions,
) -> NDArray[np.complex128]:
    """Return the phasors of k channels at analysed orders, (n, k, m), records innermost.

    A case that has diverged is NaN in all its harmonics, and so at all orders.
    """
    predicted_orders = tuple(balance.torus.orders.tolist())
    angle, travel = (
        np.zeros(len(conditions)) if column is None else column
        for column in (conditions.input_angle, conditions.travel)
    )
    read = _readings(predicted_orders, tuple(orders), ratio)
    lines = np.stack([channel[:, read.columns] for channel in channels], axis=1)
    np.conjugate(lines, out=lines, where=read.conjugate)
    if read.beyond.any():
        turned, passed = (np.outer(angles, read.beyond) for angles in (angle, travel))
        seen = np.exp(1j * turned) * np.sinc(passed / (2.0 * np.pi))
        lines *= np.tile(seen, (len(lines) // len(seen), 1))[:, None]
    return np.asarray(lines @ read.places)


class _Readings(NamedTuple):
    """Harmonics (k,) that are read: their columns, whether conjugate, and the orders beyond.

    ``places`` (k, m) is one where a harmonic is read at an analysed order.
    """

    columns: NDArray[np.int_]
    conjugate: NDArray[np.bool_]
    beyond: NDArray[np.float64]
    places: NDArray[np.float64]


@lru_cache(maxsize=64)
def _readings(predicted: tuple[float, ...], orders: tuple[float, ...], ratio: float) -> _Readings:
    """Return the harmonics that are read, and the analysed orders at which they are read.

    A line is read at its own order, or at the nearest one that a record of one output turn cannot
    tell from it: errors of orders 2 and 2.02 beat at 0.02, which is 2/101 there. Over a longer
    record it turns against that order, which reads less of it. Lines as near to zero are in no
    analysed line, and drift in a record.
    """
    predicted_orders = np.array(predicted)
    nearest = np.abs(np.subtract.outer(np.abs(predicted_orders), orders)).argmin(axis=1)
    beyond = np.abs(predicted_orders) - np.take(orders, nearest)
    columns = np.flatnonzero(np.abs(beyond) * ratio < _UNRESOLVED)
    beyond = np.where(np.abs(beyond) < _SAME, 0.0, beyond)[columns]
    places = np.zeros((len(columns), len(orders)))
    places[np.arange(len(columns)), nearest[columns]] = 1.0
    readings = _Readings(columns, predicted_orders[columns] < 0.0, beyond, places)
    for array in readings:
        array.flags.writeable = False
    return readings


def _motor_ripple(balance: SteadyMotion, coefficients: Coefficients) -> NDArray[np.complex128]:
    """Return the harmonics of a motor's ripple as its torque sensor reads it, (1, n_harmonics)."""
    total = np.zeros((1, len(balance.torus.orders)), dtype=complex)
    for port, law in coefficients.laws:
        for order in law.orders if port == "input" and law.drives else ():
            column, conjugate = balance.torus.place(order)
            total[:, column] += law.driving.conjugate() if conjugate else law.driving
    return total


def _torque_readings(effects: Sequence[DriveEffect], conditions: Conditions) -> Values:
    """Return what effects add to the readings of both torques in each record, N.m, shape (2, r)."""
    added = np.zeros((2, len(conditions)))
    for effect in effects:
        reading = effect.torque_reading(conditions.elapsed)
        added += 0.0 if reading is None else reading
    return added


def with_readings(
    prediction: Prediction,
    effects: Sequence[DriveEffect],
    conditions: Conditions,
    orders: Sequence[float],
    ratio: float,
    input_gain: float,
) -> Prediction:
    """Return the prediction of one vector with effects that only change what is read."""
    mean, phasors = prediction.mean.copy(), prediction.phasors.copy()
    session = Session(orders, ratio, conditions.elapsed, conditions.bends)
    _add_angle_readings(effects, session, mean, phasors)
    mean[..., 1] += input_gain * _torque_readings(effects, conditions)[0]
    return replace(prediction, mean=mean, phasors=phasors)


def _add_angle_readings(
    effects: Sequence[DriveEffect],
    session: Session,
    mean: NDArray[np.float64],
    phasors: NDArray[np.complex128],
) -> None:
    for effect in effects:
        added = effect.reading_lines(session)
        if added is not None:
            mean[..., 0] -= added[0]
            phasors[..., 0, :] -= added[1]


def _add_sensor_errors(
    ratio: float,
    conditions: Conditions,
    orders: Sequence[float],
    values: dict[str, NDArray[np.float64]],
    effects: Sequence[DriveEffect],
    mean: NDArray[np.float64],
    phasors: NDArray[np.complex128],
) -> None:
    """Add the errors of the sensors in place: offset, drift, eccentricity, gains and zeros."""
    mean[..., 0] += values["offset"][:, None]
    session = Session(orders, ratio, conditions.elapsed, conditions.bends)
    _add_angle_readings(effects, session, mean, phasors)
    for channel, name in ((1, "input_torque"), (2, "output_torque")):
        gain = 1.0 + values[f"{name}_gain"][:, None]
        mean[..., channel] = gain * mean[..., channel] + values[f"{name}_zero"][:, None]
        phasors[..., channel, :] *= gain[..., None]
