"""Torque balances of measured records, and what candidate laws would leave in them.

Four equations of motion can be checked with what the sensors show alone::

    mesh   T_out + J_out theta_out'' + B_out theta_out' - K d - c d'    = law of mesh - f_out
    input  T_in - J_in theta_in'' - B_in theta_in' - (T_out + ...) / N  = f_in + f_out / N
    load   T_out - J_L theta_out'' - mean                               = law of load
    motor  T_in + P theta_in' + I theta_in - mean                       = ripple of motor

They are written for means and order lines, where derivatives are exact; a law, which is a function
of time, is evaluated along the measured motion and brought to the same lines. That is the weak form
of a sparse regression (Messenger, Bortz, Multiscale Model. Simul. 19, 2021) with the order lines
for test functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.studies.blind.candidate_terms import RecordMotion, Term
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import stack
from pymoo_hdte.discrepancy._evidence.order_lines.torsion_curve import TorsionPoints
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor

Values = NDArray[np.float64]
Phasors = NDArray[np.complex128]

BALANCES = ("mesh", "input", "load", "motor")
"""In the places of the channels, so that balances are stacked as features are."""
_POINTS = 4096
"""Of the angle over one output turn; the highest order has 1414 cycles."""


@dataclass(frozen=True, eq=False)
class Regression:
    """Whitened linear regression of residual torques.

    Attributes
    ----------
    target : ndarray, shape (n,)
        What the base model leaves in the balances of the records and in the torsion sweep.
    base : ndarray, shape (n, p)
        What the base parameters would leave, in units of their scale.
    library : ndarray, shape (n, q)
        What each term of unit coefficient would leave.
    record : ndarray of int, shape (n,)
        Number of the record or sweep that a row belongs to.
    """

    target: Values
    base: Values
    library: Values
    record: NDArray[np.int_]


def regression(data: Data, values: Values, library: Sequence[Term]) -> Regression:
    """Return the regression of records and sweeps.

    Parameters
    ----------
    data : Data
    values : ndarray, shape (p,)
        Of the base parameters.
    library : sequence of Term
    """
    measured = data.features.values
    size = measured.shape[1]
    units = np.broadcast_to(np.eye(size)[:, None, :], (size, *measured.shape))
    change = balances(data, values, units) - balances(data, values, np.zeros_like(measured))
    maps = np.moveaxis(change, 0, -1)
    covariance = maps @ data.covariance @ np.swapaxes(maps, 1, 2)
    white = np.linalg.inv(np.linalg.cholesky(covariance))
    columns = [balances(data, values, measured)[..., None]]
    columns += [_base_columns(data, values), _library_columns(data, values, library, maps)]
    rows = np.repeat(np.arange(len(measured)), size)
    running = [(white @ column).reshape(-1, column.shape[-1]) for column in columns]
    sweeps = [_sweep(data, values, points, library) for points in data.torsion]
    target, base, laws = (np.vstack(parts) for parts in zip(running, *sweeps, strict=True))
    swept = [np.full(len(part[0]), len(measured) + place) for place, part in enumerate(sweeps)]
    return Regression(target[:, 0], base, laws, np.concatenate([rows, *swept]))


def balances(data: Data, values: Values, features: Values) -> Values:
    """Return what is left of the four equations, stacked as features (..., r, f) are.

    Affine in the features.
    """
    believed, rig = data.campaign.believed, data.campaign.rig
    p = dict(zip((parameter.name for parameter in data.base), values, strict=True))
    speed = data.features.conditions.input_speed
    rate = 1j * data.features.orders * speed[:, None]
    error, input_torque, output_torque, lead = _lines(data, features)
    input_torque = input_torque / (1.0 + p["input_torque_gain"])
    output_torque = output_torque / (1.0 + p["output_torque_gain"])
    output = lead / believed.ratio - error
    mesh_torque = (
        output_torque + (believed.output_inertia * rate**2 + p["output_damping"] * rate) * output
    )
    input_drag = (p["input_inertia"] * rate**2 + p["input_damping"] * rate) * lead
    phasors = [
        mesh_torque - (p["stiffness"] + p["damping"] * rate) * (error - _static_error(data, p)),
        input_torque - input_drag - mesh_torque / believed.ratio,
        output_torque - p["load_inertia"] * rate**2 * output,
        input_torque + (rig.proportional * rate + rig.integral) * lead,
    ]
    steady = _load(data, p) + p["output_damping"] * speed / believed.ratio
    driving = (features[..., 1] - p["input_torque_zero"]) / (1.0 + p["input_torque_gain"])
    mean = np.zeros((*features.shape[:-1], len(BALANCES)))
    mean[..., 0] = steady - p["stiffness"] * (features[..., 0] - p["offset"])
    mean[..., 1] = driving - p["input_damping"] * speed - steady / believed.ratio
    return stack(mean, np.stack(phasors, axis=-2))


def _lines(data: Data, features: Values) -> list[Phasors]:
    """Return the phasors (..., r, m) of each channel."""
    places = [data.features.places(channel).T for channel in range(len(BALANCES))]
    return [features[..., real] + 1j * features[..., imaginary] for real, imaginary in places]


def _load(data: Data, p: dict[str, float]) -> Values:
    measured = data.features.conditions.output_torque
    return (measured - p["output_torque_zero"]) / (1.0 + p["output_torque_gain"])


def _static_error(data: Data, p: dict[str, float]) -> Phasors:
    """Return its phasors (m,)."""
    phasors = np.zeros(len(data.features.orders), dtype=complex)
    for line, order in enumerate(data.campaign.believed.error_orders):
        phasor = sine_phasor(p[f"error_amplitude_{line}"], p[f"error_phase_{line}"])
        phasors[np.isclose(data.features.orders, order)] += phasor
    return phasors


def _base_columns(data: Data, values: Values) -> Values:
    """Return what each base parameter would leave, shape (r, f, p)."""
    step, stands = 1e-3, balances(data, values, data.features.values)
    columns = []
    for place, parameter in enumerate(data.base):
        moved = values.copy()
        moved[place] += step * parameter.scale
        columns.append((stands - balances(data, moved, data.features.values)) / step)
    return np.stack(columns, axis=-1)


def _library_columns(data: Data, values: Values, library: Sequence[Term], maps: Values) -> Values:
    """Return what each term would leave, shape (r, f, q)."""
    orders, ratio = data.features.orders, data.campaign.believed.ratio
    angle = np.linspace(0.0, 2.0 * np.pi * ratio, _POINTS, endpoint=False)
    waves = np.outer(angle, orders)
    columns = [np.ones(_POINTS), np.cos(waves), -np.sin(waves)]
    basis = np.column_stack(columns).astype(np.float64)
    inverse = np.linalg.pinv(basis)
    m = len(orders)
    found = np.zeros((*data.features.values.shape, len(library)))
    for record, motion in enumerate(_motions(data, values, angle, basis)):
        parts = inverse @ np.column_stack([term.torque(motion) for term in library])
        for place, term in enumerate(library):
            mean = parts[0, place]
            phasors: Phasors = parts[1 : 1 + m, place] + 1j * parts[1 + m :, place]
            if term.port == "encoder":
                # The error of the reading goes through the balances as the reading does.
                column = maps[record] @ stack(np.zeros(4), np.eye(4)[:, :1] * phasors)
            elif term.port == "drift":
                column = maps[record][:, 0] * data.features.conditions.elapsed[record]
            else:
                weights = _weights(term.port, ratio)
                column = stack(mean * weights, weights[:, None] * phasors)
            found[record, :, place] = column
    return found


def _weights(port: str, ratio: float) -> Values:
    """Return the share of a port's torque that each balance lacks."""
    if port == "output":
        return np.array([-1.0, 1.0 / ratio, 0.0, 0.0])
    return np.array([float(port == balance) for balance in BALANCES])


def _motions(data: Data, values: Values, angle: Values, basis: Values) -> list[RecordMotion]:
    """Return the motion of every record, put together from its lines."""
    believed = data.campaign.believed
    p = dict(zip((parameter.name for parameter in data.base), values, strict=True))
    speed = data.features.conditions.input_speed
    rate = 1j * data.features.orders * speed[:, None]
    error, _, output_torque, lead = _lines(data, data.features.values)
    static = _static_error(data, p)
    output = lead / believed.ratio - error
    load = _load(data, p)
    torsion = data.features.values[:, 0] - p["offset"]

    def along(mean: Values | float, phasors: Phasors) -> Values:
        means = np.broadcast_to(mean, len(speed))[:, None]
        return np.hstack([means, phasors.real, phasors.imag]) @ basis.T

    slope = along(0.0, np.broadcast_to(1j * data.features.orders * static, rate.shape))
    channels = [
        along(speed, rate * lead),
        along(speed / believed.ratio, rate * output),
        along(0.0, rate**2 * output),
        along(torsion, error - static),
        along(0.0, rate * (error - static)),
        along(load, output_torque),
        slope,
    ]
    return [RecordMotion(True, angle, *rows) for rows in zip(*channels, strict=True)]


def _sweep(
    data: Data, values: Values, points: TorsionPoints, library: Sequence[Term]
) -> tuple[Values, Values, Values]:
    """Return target (b, 1), base (b, p) and library (b, q) of a torsion sweep, as angles."""
    names = [parameter.name for parameter in data.base]

    def left(values: Values) -> Values:
        p = dict(zip(names, values, strict=True))
        torque = (points.torque - p["output_torque_zero"]) / (1.0 + p["output_torque_gain"])
        return torque / (p["stiffness"] * p["locked_stiffness"]) - points.angle

    step = 1e-3 * np.diag([parameter.scale for parameter in data.base])
    base = [(left(values) - left(values + row)) / 1e-3 for row in step]
    motion = _at_rest(points)
    stiffness = values[names.index("stiffness")] * values[names.index("locked_stiffness")]
    ratio = data.campaign.believed.ratio
    laws = [
        np.nan_to_num(term.torque(motion)) * _weights(term.port, ratio)[0] / stiffness
        for term in library
    ]
    white = points.whitening
    return white @ left(values)[:, None], white @ np.array(base).T, white @ np.array(laws).T


def _at_rest(points: TorsionPoints) -> RecordMotion:
    """Return the motion of a sweep: slow, at an unknown input angle."""
    unknown, rest = np.full_like(points.angle, np.nan), np.zeros_like(points.angle)
    direction = np.sign(points.path[points.intervals + 1] - points.path[points.intervals])
    intercept = np.polyfit(points.torque, points.angle, 1)[1]
    creeping = 1e-12 * direction
    torsion = points.angle - intercept
    # A positive torque turns the output backwards.
    return RecordMotion(
        False, unknown, rest, -creeping, rest, torsion, creeping, points.torque, unknown
    )
