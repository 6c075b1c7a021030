"""Predicted readings of the rig's sensors: order lines and means of every channel.

One call of the harmonic balance serves all records of a campaign and all vectors of parameters that
share their effects. Loads are the measured ones, not the planned ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.bench import IDEAL, Bench
from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import beyond_rows, folded_down
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import READING
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
    SteadyMotion,
)
from pymoo_hdte.drive._effects import Session
from pymoo_hdte.drive._solve.lead_response import LeadResponse, lead_response, torque_lines
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.effects.law import Law, Values

LOOP = ("loop_gain", "loop_lag")
"""Unknowns of the speed loop: the share by which it is stronger than stated, and its lag in s."""
_SAME = 1e-8
"""Orders nearer to each other are one; those of a torus are sums of rounded numbers."""
_AROUND = 64
"""Points of a period of the strongest line of the lead, to which its powers are exact."""
_FASTEST = 0.9
"""Slope of the lead at which its powers are cut off: ten times the mean speed."""
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
        Contribution of what a motor does at `orders_that_fold` beyond those that the rows of a
        record show, see `OrderLines`; by default none.
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
    moves = partial(_moves, conditions, _remembers((*believed.effects, *effects)))
    moving = tuple(effect for effect in effects if moves(effect))
    further = tuple(effect for effect in effects if not moves(effect))
    groups = bench.groups(believed.effects, values, moves)
    parts = [
        _predict_group(
            believed,
            rig,
            conditions,
            orders,
            {name: column[rows] for name, column in values.items()},
            (*present, *moving),
            [(places, (*own, *further)) for places, own in parts],
            start,
            effort,
        )
        for rows, present, parts in groups
    ]
    if len(parts) == 1:
        return parts[0]
    return _in_order(parts, [group.rows for group in groups], len(conditions))


def _moves(conditions: Conditions, remembers: bool, effect: DriveEffect) -> bool:
    """Tell whether an effect is a part of the equations of motion as they are solved."""
    return effect.changes_motion and (
        conditions.lead is None or not _is_line_of_bench(effect, remembers)
    )


def _remembers(effects: Sequence[DriveEffect]) -> bool:
    """Tell whether a law has memory, all of which are at the mesh."""
    return any(law.states for _, law in _at_ports(effects))


def _is_line_of_bench(effect: DriveEffect, remembers: bool) -> bool:
    """Tell whether an effect is a torque of the bench that is one line whatever the motion.

    Such lines are small, so that the motion is linear in them or nearly so. A ripple of the drive
    that is looked for may be strong: one of .02 N.m moves the speed of an input by a fifth at 30
    r/min, which makes errors of its order and others. Behind a mesh that remembers even a weak one
    is more than a line: it shakes springs that slip loose, and so moves the mean.
    """
    port_and_law = effect.at_port()
    if port_and_law is None or port_and_law[0] not in effect_named(effect.name).nuisance_at:
        return False
    if remembers and port_and_law[0] != "input":
        return False
    return port_and_law[1].line(np.zeros(1)) is not None


def _predict_group(
    believed: BelievedDrive,
    rig: Rig,
    conditions: Conditions,
    orders: Sequence[float],
    values: dict[str, NDArray[np.float64]],
    moving: Sequence[DriveEffect],
    parts: Sequence[tuple[NDArray[np.int_], tuple[DriveEffect, ...]]],
    start: SteadyMotion | None,
    effort: Effort,
) -> Prediction:
    """Return the prediction of vectors that share all effects ``moving``.

    Those of each of the ``parts`` share the effects that only add to readings, too.
    """
    count, records = len(values["offset"]), len(conditions)
    gain = 1.0 + values["output_torque_gain"][:, None]
    of_torques = np.empty((count, 2, records))
    for places, further in parts:
        of_torques[places] = _torque_readings((*moving, *further), conditions)
    load = conditions.output_torque - of_torques[:, 1] - values["output_torque_zero"][:, None]
    load = (load / gain).ravel()
    coefficients = coefficients_of(believed, values, moving, records)
    coefficients = replace(coefficients, elapsed=np.tile(conditions.elapsed, count))
    if conditions.temperature is not None:
        coefficients = replace(coefficients, temperature=np.tile(conditions.temperature, count))
    speed = np.tile(conditions.input_speed, count)
    lead = None
    if conditions.lead is not None:
        lead = Lead(np.array(orders, dtype=float), np.tile(conditions.lead, (count, 1)))
    solved, again = _different_motions(values, load.reshape(count, records))
    cases = _cases(solved, records)
    balance = steady_motions(
        coefficients.rows(cases),
        speed[cases],
        load[cases],
        rig,
        None if start is None else start.rows(np.tile(np.arange(records), len(solved))),
        effort,
        None if lead is None else lead.rows(cases),
    ).rows(_cases(again, records))
    at_brake = rig.output_torque_at == "brake"
    channels = np.stack(
        [
            balance.transmission_error,
            balance.motor_torque,
            balance.brake_torque if at_brake else balance.coupling_torque,
            balance.lead,
            _motor_ripple(balance, coefficients, load),
            balance.slower,
            balance.coupling_torque,
        ],
        axis=1,
    )
    predicted, channels = _with_further(
        balance, channels, [(_cases(places, records), further) for places, further in parts],
        coefficients, speed, load, at_brake,
    )  # fmt: skip
    lines = _lines(predicted, channels, orders, believed.ratio, conditions)
    under_load = coefficients.at_loads(load)
    response = None
    if lead is not None:
        response = lead_response(under_load, balance.slopes, speed, orders)
        if at_brake:
            response = response.without_load()
        _follow_lead(lines, response, lead, balance, coefficients.input_inertia)
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
    means = channels[:, : len(CHANNELS), 0].real
    phasors = lines.reshape(count, records, len(CHANNELS), len(orders))
    mean = means.reshape(count, records, len(CHANNELS)).copy()
    mean[..., 1:3] += of_torques.swapaxes(1, 2)
    for places, further in parts:
        some = {name: values[name][places] for name in READING}
        readings = mean[places], phasors[places]
        by_rows = conditions.folded
        if by_rows is not None and (beyond := beyond_rows(further, by_rows, rig)):
            rows = _cases(places, records)
            folded = folded_down(
                under_load.rows(rows), balance.rows(rows), speed[rows], rig, beyond, by_rows
            )
            for reading, added in zip(readings, folded, strict=True):
                reading += added.reshape(reading.shape)
        _add_sensor_errors(believed.ratio, conditions, orders, some, (*moving, *further), *readings)
        mean[places], phasors[places] = readings
    return Prediction(mean, phasors, balance, response)


def _follow_lead(
    lines: NDArray[np.complex128],
    response: LeadResponse,
    lead: Lead,
    balance: SteadyMotion,
    inertia: NDArray[np.float64],
) -> None:
    """Add to lines (n, 6, m) what follows the lead at orders that the torus does not hold.

    Over the angle of the input its speed is Omega / (1 - l') for a lead l of slope l' = dl/dangle,
    and its acceleration half the slope of the square of that. So two lines of the lead, as of a
    strong ripple at a low speed, beat to the second order: speed is Omega (1 + l' + l'^2), and its
    square Omega^2 (1 + 2 l' + 3 l'^2). The strongest line beats with its harmonics to any order.
    What ``inertia`` (n,) takes of that at the input, N.m.
    """
    held, within = lead.held(balance.torus), lead.within(balance.torus)
    rates = response.rate * lead.phasors
    phasors = np.where(held, 0.0, lead.phasors)
    lines[:, :3] += response.channels * phasors[:, None]
    lines[:, 5] -= np.where(held, 0.0, rates)
    beats = _beats(*(tuple(values.tolist()) for values in (lead.orders, held, within)))
    speed = (response.rate[:, :1] / (1j * lead.orders[0])).real
    if beats.places.any():
        second = rates[:, beats.second]
        np.conjugate(second, out=second, where=beats.conjugate)
        beating = (rates[:, beats.first] * second) @ beats.places / speed
        losses = balance.slopes[:, 3:] + 1.5 * inertia[:, None] * response.rate
        lines[:, 1] += losses * beating
        lines[:, 5] -= beating
    if not held.all():
        slopes = 1j * lead.orders * lead.phasors
        strongest = int(np.argmax(np.abs(slopes).max(axis=0)))
        multiples = np.rint(lead.orders / lead.orders[strongest]).astype(int)
        family = np.abs(multiples * lead.orders[strongest] - lead.orders) < _SAME
        family &= (multiples > 0) & (multiples < _AROUND // 2)
        powers = np.zeros((2, *slopes.shape), dtype=complex)
        powers[:, :, family] = _higher_powers(slopes[:, family], multiples[family])
        # Those of held lines are in the steady state.
        known = _higher_powers(np.where(held, slopes, 0.0)[:, family], multiples[family])
        powers[:, :, family] -= np.where(within[family], known, 0.0)
        of_speed, of_square = powers
        lines[:, 1] += balance.slopes[:, 3:] * speed * of_speed
        lines[:, 1] += 0.5 * inertia[:, None] * response.rate * speed * of_square
        lines[:, 5] -= speed * of_speed


def _higher_powers(
    slopes: NDArray[np.complex128], multiples: NDArray[np.int_]
) -> NDArray[np.complex128]:
    """Return what speed and its square have from the third order on, in units of the mean speed.

    ``slopes`` (n, m) are the lines of the lead's slope at ``multiples`` (m,) of one order, at which
    the results (2, n, m) are as well.
    """
    angle = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    slope = (slopes @ np.exp(1j * np.outer(multiples, angle))).real
    # An input that turns back has no speed over its angle.
    slope = np.minimum(slope, _FASTEST)
    speed = 1.0 / (1.0 - slope)
    beyond = speed - 1.0 - slope - slope**2, speed**2 - 1.0 - 2.0 * slope - 3.0 * slope**2
    return 2.0 / _AROUND * np.fft.rfft(beyond)[..., multiples]


class _Beats(NamedTuple):
    """Pairs of lines whose product is at an analysed order, with a second that may be conjugate.

    ``places`` (k, m) are the shares of a pair in a square at each order.
    """

    first: NDArray[np.int_]
    second: NDArray[np.int_]
    conjugate: NDArray[np.bool_]
    places: NDArray[np.float64]


@lru_cache(maxsize=64)
def _beats(orders: tuple[float, ...], held: tuple[bool, ...], within: tuple[bool, ...]) -> _Beats:
    """Return the pairs of lines that beat at one of the orders; without those of a torus alone.

    ``held`` and ``within`` are those of `Lead`.
    """
    pairs = list[tuple[int, int, bool, int, float]]()
    for k, order in enumerate(orders):
        for j, lower in enumerate(orders[: k + 1]):
            beats = (False, order + lower, 0.5 if k == j else 1.0), (True, order - lower, 1.0)
            for of_difference, beat, share in beats:
                at = np.flatnonzero(np.abs(np.subtract(orders, beat)) < _SAME)
                pairs += [
                    (k, j, of_difference, place, share)
                    for place in at.tolist()
                    if not (held[k] and held[j] and within[place])
                ]
    places = np.zeros((len(pairs), len(orders)))
    for row, (_, _, _, place, share) in enumerate(pairs):
        places[row, place] = share
    first, second = np.array([pair[:2] for pair in pairs], dtype=int).reshape(-1, 2).T
    conjugate = np.array([pair[2] for pair in pairs], dtype=bool)
    for array in (first, second, conjugate, places):
        array.flags.writeable = False
    return _Beats(first, second, conjugate, places)


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
    cases = [_cases(rows, records) for rows in places]
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


def _cases(vectors: NDArray[np.int_], records: int) -> NDArray[np.int_]:
    """Return the rows of all records of vectors, vectors outermost."""
    return np.add.outer(records * vectors, np.arange(records)).ravel()


def _different_motions(
    values: dict[str, NDArray[np.float64]], load: NDArray[np.float64]
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return vectors of which no two move alike, and for each of all which of them it moves as.

    ``load`` (v, r) is that of all records; what else are readings moves nothing.
    """
    moving = [values[name] for name in values if name in MECHANICAL or name.startswith("error_")]
    table = np.column_stack([*moving, load])
    _, first, again = np.unique(table, axis=0, return_index=True, return_inverse=True)
    # In the order of the vectors, whose first one is where the others come from.
    order = np.argsort(first)
    return first[order], np.argsort(order)[again.ravel()]


def _with_further(
    balance: SteadyMotion,
    channels: NDArray[np.complex128],
    parts: Sequence[tuple[NDArray[np.int_], tuple[DriveEffect, ...]]],
    coefficients: Coefficients,
    speed: NDArray[np.float64],
    load: NDArray[np.float64],
    at_brake: bool,
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Return orders, and k channels at them, with what effects add that do not change the motion.

    The last channel is the torque of the output, which turns what holds the sensor of its angle.
    """
    # All parts have the same effects, with numbers of their own.
    most = len(_at_ports(parts[0][1]))
    of_lines, lines = np.empty(0), np.zeros((*channels.shape[:2], most), dtype=complex)
    for rows, further in parts if most else ():
        laws = _at_ports(further)
        added = torque_lines(
            coefficients.rows(rows), laws, balance.rows(rows), speed[rows], load[rows]
        )
        of_lines, still = added.orders, np.zeros_like(added.torsion)
        of_output = added.brake_torque if at_brake else added.coupling_torque
        of_motor = added.motor_torque, of_output, still, added.ripple, still
        lines[rows] = np.stack([added.torsion, *of_motor, added.coupling_torque], axis=1)
    orders = np.append(balance.torus.orders, of_lines)
    channels = np.concatenate([channels, lines], axis=2)
    for rows, further in parts:
        for effect in further:
            turned = effect.turned_back(orders * speed[rows, None])
            if turned is not None:
                channels[rows, 0] += turned * channels[rows, -1]
    return orders, channels


def _at_ports(effects: Sequence[DriveEffect]) -> list[tuple[str, Law]]:
    return [placed for effect in effects if (placed := effect.at_port()) is not None]


def _lines(
    predicted_orders: NDArray[np.float64],
    channels: NDArray[np.complex128],
    orders: Sequence[float],
    ratio: float,
    conditions: Conditions,
) -> NDArray[np.complex128]:
    """Return the phasors of k channels at analysed orders, (n, k, m), records innermost.

    A case that has diverged is NaN in all its harmonics, and so at all orders.
    """
    angle, travel = (
        np.zeros(len(conditions)) if column is None else column
        for column in (conditions.input_angle, conditions.travel)
    )
    read = _readings(tuple(predicted_orders.tolist()), tuple(orders), ratio)
    lines = channels[:, :, read.columns]
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


def _motor_ripple(
    balance: SteadyMotion, coefficients: Coefficients, load: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return the harmonics of a motor's ripple as its torque sensor reads it, (n, n_harmonics)."""
    total = np.zeros_like(balance.lead)
    for port, law in coefficients.laws:
        if port == "input" and law.drives and (opposing := law.line(load)) is not None:
            column, conjugate = balance.torus.place(law.orders[0])
            total[:, column] -= opposing.conj() if conjugate else opposing
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
