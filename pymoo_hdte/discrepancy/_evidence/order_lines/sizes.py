"""Sizes of the ports of a drive, from which effects are guessed: see `pymoo_hdte.effects.guess`.

They come from the records and the believed drive: its speeds and loads, and the residual of the
base in each channel. `LARGEST` and the orders of shafts are the only constants. All ports of a
drive share the stiffness and the travel of its mesh, whose speed is counted at the input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import MEANS, Features
from pymoo_hdte.discrepancy._evidence.order_lines.folded_lines import folded_orders, motor_orders
from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.discrepancy._records.cleaning.session_zero import places_of_change
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.drive._effects import DriveSizes

LARGEST = 5.0
"""Largest missing line of the transmission error, in units of the residual of the base: the base
absorbs no line, but because of a resonance a line may be several times smaller in one record than
in another."""
_SHAFTS = {
    "input": (1.0, 2.0), "output": (1.0,), "mesh": (1.0, 2.0), "sensor": (1.0,), "load": (1.0,),
}  # fmt: skip
"""Orders at which a shaft varies by design or manufacture: once a turn, and twice for the wave
generator, which has two lobes."""


@dataclass(frozen=True)
class Scales:
    """Sizes of the conditions of a campaign, and of the residual of the base; SI.

    Attributes
    ----------
    speed, torque : float
        Largest speed of the input, rad/s, and torque at the output, N.m.
    motor_torque : float
        Largest torque at the input, N.m.
    duration : float
        Time from the first record of the session to the last, s.
    changes : tuple of float
        Times between records, none of them near the ends of the session, s.
    series : tuple of float
        Those between series of measurements, all if the records state no series.
    swept : bool
        Whether there is a torsion sweep.
    error, input_torque, output_torque : float
        Residual of the base in the transmission error, rad, and in the two torques, N.m: root mean
        square over a record, means and lines together.
    driven : bool
        Whether the load opposes the motion in some records and drives it in others.
    temperature : float
        Mean of the records, K, if all have a temperature and these spread enough; else 0.
    loads_differ : bool
        Whether the records are taken under different loads.
    motor : tuple of float
        Orders at which the motor of the bench cogs, if its poles and slots are stated.
    folded : tuple of float
        Orders above those that records analyse at which a motor may show in them all the same.
    """

    speed: float
    torque: float
    motor_torque: float
    duration: float
    error: float
    input_torque: float
    output_torque: float
    driven: bool = False
    temperature: float = 0.0
    changes: tuple[float, ...] = ()
    series: tuple[float, ...] = ()
    swept: bool = False
    loads_differ: bool = False
    motor: tuple[float, ...] = ()
    folded: tuple[float, ...] = ()


def scales_of(data: Data, base: Fit) -> Scales:
    """Return the scales of records with a fitted base."""
    features = data.features
    n_running = features.values.size
    whitened = base.residuals[:n_running].reshape(features.values.shape)
    residual = np.einsum("rij,rj->ri", data.whiteners, whitened)
    noise = np.sqrt(np.diagonal(features.covariance, axis1=1, axis2=2))
    error, input_torque, output_torque = (
        max(_size(features, residual, channel), _size(features, noise, channel))
        for channel in range(3)
    )
    swept = base.residuals[n_running : n_running + data.n_sweep_residuals]
    if len(swept):
        deviation = np.median(np.concatenate([points.deviation for points in data.torsion]))
        error = max(error, float(deviation * np.sqrt(np.mean(swept**2))))
    when = features.conditions
    # A load within the uncertainty of the sensor's zero has no direction.
    least = data.campaign.torque_scale * data.rules.least_held_load
    braking = when.output_torque * np.sign(when.input_speed)
    paths = [np.abs(points.path).max() for points in data.torsion]
    return Scales(
        speed=float(np.abs(when.input_speed).max()),
        torque=float(max([np.abs(when.output_torque).max(), *paths])),
        motor_torque=_largest(features, 1),
        duration=float(np.ptp(when.elapsed)),
        error=error,
        input_torque=input_torque,
        output_torque=output_torque,
        driven=bool(braking.max() > least and braking.min() < -least),
        temperature=_temperature(data),
        changes=_changes(when.elapsed),
        series=_series(features),
        swept=bool(data.torsion),
        loads_differ=bool(np.ptp(when.output_torque) > least),
        motor=motor_orders(data.campaign.rig),
        folded=folded_orders(
            when.folded, noise[:, features.places(1)].min(axis=2) / input_torque, data.campaign.rig
        ),
    )


def _temperature(data: Data) -> float:
    """Return the mean of the records' temperatures, K, if all have one and they spread enough."""
    known = data.features.conditions.temperature
    if known is None or not np.ptp(known) >= data.rules.least_temperature_spread:
        return 0.0
    return float(np.mean(known))


def _changes(elapsed: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the times in the middle between records that are not taken at once."""
    ordered = np.sort(elapsed)
    late = places_of_change(ordered)
    return tuple(((ordered[late - 1] + ordered[late]) / 2.0).tolist())


def _series(features: Features) -> tuple[float, ...]:
    """Return the times between stated series of measurements, or between all records."""
    elapsed = features.conditions.elapsed
    series = np.array([record.series for record in features.records])
    changes = _changes(elapsed)
    if np.all(series == series[0]):
        return changes
    ordered = series[np.argsort(elapsed, kind="stable")]
    middle = np.sort(elapsed)
    between = (middle[:-1] + middle[1:])[ordered[:-1] != ordered[1:]] / 2.0
    return tuple(time for time in changes if time in between)


def _size(features: Features, values: NDArray[np.float64], channel: int) -> float:
    """Return the root mean square of one channel of all records, for features (r, f)."""
    square = np.sum(values[:, features.places(channel)] ** 2, axis=(1, 2)) / 2.0
    if channel in MEANS:
        square = square + values[:, MEANS.index(channel)] ** 2
    return float(np.sqrt(np.mean(square)))


def _largest(features: Features, channel: int) -> float:
    """Return the largest sum of mean and lines of one channel in any record."""
    lines = features.values[:, features.places(channel)]
    mean = np.abs(features.values[:, MEANS.index(channel)])
    return float(np.max(mean + np.hypot(lines[..., 0], lines[..., 1]).sum(axis=1)))


def port_sizes(
    believed: BelievedDrive,
    orders: Sequence[float],
    seen: Sequence[float],
    scales: Scales,
    clear: Sequence[float] = (),
    highest: float = 0.0,
) -> dict[str, DriveSizes]:
    """Return the sizes of each port.

    Parameters
    ----------
    believed : BelievedDrive
    orders : sequence of float
        All orders of the features: harmonics beyond them could not be determined.
    seen : sequence of float
        Orders of the strongest lines, for each of which an effect may be missing.
    scales : Scales
    clear : sequence of float
        Orders of all significant lines, which may be harmonics of an effect.
    highest : float
        Order up to which lines are looked for.
    """
    at_output = max(scales.output_torque, believed.ratio * scales.input_torque)
    residual = {
        "input": scales.input_torque,
        # A braking torque at the output shows at the input, reduced by the factor N.
        "output": at_output,
        # A missing torsion is converted into a torque by the stiffness.
        "mesh": max(at_output, believed.stiffness * scales.error),
        "sensor": 0.0,
        "load": at_output,
    }
    # Friction cannot exceed the whole torque, whatever part of it the base absorbs.
    largest = {
        "input": scales.motor_torque,
        "output": believed.ratio * scales.motor_torque,
        "mesh": scales.torque,
        "sensor": 0.0,
        "load": believed.ratio * scales.motor_torque,
    }
    damping = dict.fromkeys(residual, 0.0)
    damping |= {"input": believed.input_damping, "mesh": believed.damping}
    lines = zip(believed.error_orders, believed.error_amplitudes, strict=True)
    shared = DriveSizes(
        force=0.0,
        residual=0.0,
        largest=0.0,
        speed=scales.speed,
        travel=scales.torque / believed.stiffness,
        stiffness=believed.stiffness,
        loaded=True,
        driven=scales.driven,
        seen=tuple(sorted(seen)),
        clear=tuple(clear),
        shown=tuple(orders),
        highest=highest,
        error=scales.error,
        largest_error=LARGEST * scales.error,
        # A line believed to have amplitude zero may be missing.
        believed_orders=tuple(order for order, amplitude in lines if amplitude > 0.0),
        ratio=believed.ratio,
        inertia=max(believed.load_inertia, 10.0 * believed.output_inertia),
        duration=scales.duration,
        temperature=scales.temperature,
        changes=scales.changes,
        series=scales.series,
        loads_differ=scales.loads_differ,
        motor=scales.motor,
        folded=scales.folded,
        readings=(scales.input_torque, scales.output_torque),
        largest_readings=(LARGEST * scales.input_torque, LARGEST * scales.output_torque),
    )
    slower = {port: 1.0 if port in ("input", "mesh") else believed.ratio for port in residual}
    return {
        port: replace(
            shared,
            # The missing torque lies between the residual, since the base absorbs a part of it, and
            # the whole torque: the middle on a logarithmic scale.
            force=(residual[port] * largest[port]) ** 0.5,
            residual=residual[port],
            largest=largest[port],
            speed=shared.speed / slower[port],
            damping=damping[port],
            load=scales.torque / believed.ratio if port == "input" else 0.0,
            # The output turns as far as the mesh is twisted.
            swept=scales.swept and port in ("output", "mesh"),
            turns=port == "load",
            coupling=port in ("input", "output", "load"),
            # Under one load a share of it is a torque like any other.
            braked=scales.torque if port == "load" and scales.loads_differ else 0.0,
            slower=slower[port],
            expected=_SHAFTS[port],
        )
        for port in slower
    }
