"""Plausibility checks of a campaign: they find swapped channels and wrong units.

The limits are wide: they must accept every effect that a campaign may contain and still distinguish
degrees from radians, N.mm from N.m, and one channel from another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.likely_causes import likely_ratio, likely_unit
from pymoo_hdte.discrepancy._records.line_basis import spans_a_turn
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.drive.datasheet import LOST_POWER
from pymoo_hdte.units import ARCSEC

_LEAP = 2.0
"""Least size of a leap in usual steps of an angle: a turn is as many at the fastest motion at which
a wrapped angle can be unwrapped."""
_FRICTION = 0.5
"""Share of the motor's torque under load, up to which friction may change it."""


def check_believed(believed: BelievedDrive, rules: Rules) -> None:
    """Refuse believed values that no drive can have.

    Raises
    ------
    InvalidInput
        If an inertia has a natural frequency on the mesh below `Rules.least_natural_frequency`, the
        static error has no line or an implausibly large one, or a tolerance is below
        `Rules.least_tolerance`.
    """
    for name in ("tolerance", "error_tolerance"):
        value = getattr(believed, name)
        if value < rules.least_tolerance:
            raise InvalidInput(f"believed.{name}", value, f"at least {rules.least_tolerance:g}")
    for name, value in believed.tolerances.items():
        if value < rules.least_tolerance:
            field = f"believed.tolerances.{name}"
            raise InvalidInput(field, value, f"at least {rules.least_tolerance:g}")
    slowest = rules.least_natural_frequency
    heaviest = believed.stiffness / (2.0 * math.pi * slowest) ** 2
    for name, referred in (
        ("input_inertia", believed.ratio**2),
        ("output_inertia", 1.0),
        ("load_inertia", 1.0),
    ):
        value = getattr(believed, name)
        if not value * referred <= heaviest:
            allowed = (
                f"at most {heaviest / referred:.3g} kg.m2, or its natural frequency on the mesh "
                f"of {believed.stiffness:g} N.m/rad would be below {slowest:g} Hz"
            )
            raise InvalidInput(f"believed.{name}", value, allowed)
    if not believed.error_orders:
        raise InvalidInput("believed.error_orders", (), "at least one; its amplitude may be zero")
    least, most = rules.least_error_amplitude, rules.largest_transmission_error
    for amplitude in believed.error_amplitudes:
        if not (amplitude == 0.0 or least <= amplitude <= most):
            allowed = f"zero, or {least / ARCSEC:.2g} to {most / ARCSEC:.2g} arcsec"
            raise InvalidInput("believed.error_amplitudes", amplitude, allowed)


def check_stiffness(believed: BelievedDrive, largest_load: float, rules: Rules) -> None:
    """Refuse a believed stiffness that the loads of the campaign would twist too far.

    Parameters
    ----------
    believed : BelievedDrive
    largest_load : float
        Largest load of all running records, N.m.
    rules : Rules

    Raises
    ------
    InvalidInput
        If the largest load twists the drive by more than `Rules.largest_twist`.
    """
    if largest_load > rules.largest_twist * believed.stiffness:
        allowed = (
            f"at least {largest_load / rules.largest_twist:.3g} N.m/rad, or {largest_load:g} N.m "
            f"would twist the drive by more than {rules.largest_twist:g} rad; {LOST_POWER}"
        )
        raise InvalidInput("believed.stiffness", believed.stiffness, allowed)


def check_noise(
    running: Sequence[RunningRecord],
    torsion: Sequence[TorsionRecord],
    believed: BelievedDrive,
    rig: Rig,
    rules: Rules,
) -> None:
    """Refuse a stated noise far above the scatter of all records: it would hide every misfit.

    A record may scatter more than stated, because an effect moves it from row to row.

    Raises
    ------
    InvalidInput
        If all records scatter less than stated by more than `Rules.overstated_noise_ratio`.
    """
    averaged = np.sqrt([record.samples_averaged for record in running])
    errors = [record.transmission_error(believed.ratio) for record in running]
    shown = {
        # The noise of both encoders enters a transmission error.
        "angle_noise": _scatters(errors) * averaged / math.sqrt(2.0),
        "input_torque_noise": _scatters([record.input_torque for record in running]) * averaged,
        "output_torque_noise": _scatters([record.output_torque for record in running]) * averaged,
    }
    if torsion:
        shown["torsion_angle_noise"] = _scatters([record.output_angle for record in torsion])
    for name, scatters in shown.items():
        stated, largest = getattr(rig, name), float(scatters.max())
        if not stated <= rules.overstated_noise_ratio * largest:
            allowed = (
                f"at most {rules.overstated_noise_ratio:g} times what the records show from row "
                f"to row, which is {largest / stated:.2g} times that"
            )
            raise InvalidInput(f"rig.{name}", stated, allowed)


def _scatters(channels: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the standard deviation of the noise of each channel's rows, or an upper bound."""
    # Third differences of white noise have 1 + 9 + 9 + 1 times its variance.
    with np.errstate(over="ignore"):
        return np.array([np.sqrt(np.mean(np.diff(rows, 3) ** 2) / 20.0) for rows in channels])


def check_running(
    record: RunningRecord, believed: BelievedDrive, rig: Rig, largest_load: float, rules: Rules
) -> None:
    """Refuse a running record whose channels contradict its condition or the drive.

    Parameters
    ----------
    record : RunningRecord
    believed : BelievedDrive
    rig : Rig
    largest_load : float
        Largest load of the campaign, N.m: the scale of torques where a record has no load.
    rules : Rules

    Raises
    ------
    InvalidInput
        If the speed is off by more than `Rules.speed_mismatch`, the record is shorter than one
        output turn, the transmission error is not small, or a torque is far from the one that the
        load requires.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            _check_travel(record, believed.ratio, rules)
            _check_error(record, believed.ratio, rules)
        except InvalidInput as refused:
            allowed = f"{refused.allowed}{_leaps(record, rules)}"
            raise InvalidInput(refused.field, refused.value, allowed) from None
        _check_torques(record, believed.ratio, rig, largest_load, rules)


def check_torsion(record: TorsionRecord, believed: BelievedDrive, rules: Rules) -> None:
    """Refuse a torsion record whose slope differs from that of the drive by more than a factor.

    Raises
    ------
    InvalidInput
        If the stiffness has the wrong sign or order of magnitude.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        torque = record.output_torque - np.mean(record.output_torque)
        slope = -float(torque @ record.output_angle / (torque @ torque))
        relative = slope * believed.stiffness
    factor = rules.slope_mismatch
    if not 1.0 / factor < relative < factor:
        cause = (
            "the unit of either, or the power of ten of the stiffness"
            if relative > 0.0
            else "the sign of one of the columns: here a positive torque turns the output backwards"
        )
        allowed = (
            f"{1.0 / believed.stiffness:.3g} rad/(N.m), as the nominal stiffness of "
            f"{believed.stiffness:.4g} N.m/rad, within a factor of {factor:g}. Likely {cause}"
        )
        raise InvalidInput(
            "slope of -output_angle over output_torque", float(f"{slope:.3g}"), allowed
        )


def _check_travel(record: RunningRecord, ratio: float, rules: Rules) -> None:
    travel = float(record.input_angle[-1] - record.input_angle[0])
    speed = travel / float(record.time[-1] - record.time[0])
    if record.speed_range:
        lowest, highest = record.speed_range
        if not lowest <= speed <= highest:
            allowed = f"{lowest:g} to {highest:g} rad/s, the range of the record"
            raise InvalidInput("mean speed of input_angle", speed, allowed)
    elif not abs(speed - record.input_speed) <= rules.speed_mismatch * abs(record.input_speed):
        within = f"{100.0 * rules.speed_mismatch:g} %"
        cause = likely_unit("angle", speed / record.input_speed)
        allowed = (
            f"{record.input_speed:g} rad/s within {within}, the input speed of the record{cause}"
        )
        raise InvalidInput("mean speed of input_angle", speed, allowed)
    if not spans_a_turn(record, ratio):
        allowed = f"at least {2.0 * math.pi * ratio:.6g} rad, one output turn"
        raise InvalidInput("travel of input_angle", abs(travel), allowed)


def _check_error(record: RunningRecord, ratio: float, rules: Rules) -> None:
    # Without the outermost hundredth, because rows that an encoder read wrongly are left out later.
    errors = np.abs(record.transmission_error(ratio))
    largest = float(np.quantile(errors, 1.0 - rules.spike_share))
    most = rules.largest_transmission_error
    if not largest <= most:
        travels = [float(np.ptp(angle)) for angle in (record.input_angle, record.output_angle)]
        turns = [float(angle[-1] - angle[0]) for angle in (record.input_angle, record.output_angle)]
        # Where an angle wraps, its ends say nothing about the ratio.
        steady = all(0.9 * wide <= abs(turn) for wide, turn in zip(travels, turns, strict=True))
        cause = likely_ratio(turns[0] / turns[1], ratio) if steady and turns[1] else ""
        allowed = (
            f"at most {most:g} rad at a ratio of {ratio:g}, both angles in rad with one common zero"
            f"{cause}"
        )
        raise InvalidInput("largest transmission error", largest, allowed)


def _leaps(record: RunningRecord, rules: Rules) -> str:
    """Return where an angle leaps, as a counter that wraps does, as the end of a sentence.

    Rows that are missing are no leap, nor is a row that was misread, which the next step undoes.
    """
    leaps, steps = [], np.diff(record.time)
    for name in ("input_angle", "output_angle"):
        moved = np.diff(getattr(record, name))
        usual = float(np.median(moved / steps))
        off = moved - usual * steps
        least = max(_LEAP * abs(float(np.median(moved))), rules.largest_transmission_error)
        leaping = np.abs(off) > least
        undone = leaping[:-1] & (np.abs(off[:-1] + off[1:]) < least)
        leaping[:-1] &= ~undone
        leaping[1:] &= ~undone
        if leaping.any():
            row = int(np.argmax(leaping))
            leaps.append(f"; {name} leaps by {off[row]:.4g} rad after row {row + 1}")
    which = "an angle that begins anew is continued by `unwrap` or `wraps`"
    return f"{''.join(leaps)}: {which}" if leaps else ""


def _check_torques(
    record: RunningRecord, ratio: float, rig: Rig, largest_load: float, rules: Rules
) -> None:
    load, multiple = record.load_torque, rules.torque_mismatch
    measured = float(np.mean(record.output_torque))
    # A single outlier moves the mean, but not the middle 95 %.
    spread = float(np.ptp(np.quantile(record.output_torque, (0.025, 0.975))))
    slack = multiple * rig.output_torque_zero + spread
    if record.load_range:
        lowest, highest = record.load_range
        zero = rig.output_torque_zero
        if not lowest - zero <= measured <= highest + zero:
            allowed = f"{lowest:g} to {highest:g} N.m, the range of the record, or the zero beside"
            raise InvalidInput("mean of output_torque", measured, allowed)
    elif not abs(measured - load) <= rules.load_mismatch * abs(load) + slack:
        cause = likely_unit("torque", measured / load) if load else ""
        raise InvalidInput(
            "mean of output_torque", measured, f"near the load of {load:g} N.m{cause}"
        )
    motor = float(np.mean(record.input_torque))
    slack = multiple * rig.input_torque_zero
    if load == 0.0:
        most = multiple * largest_load / ratio + slack if largest_load else math.inf
        # Without load the motor only has to overcome friction.
        if not -slack <= math.copysign(1.0, record.input_speed) * motor <= most:
            allowed = "a torque that overcomes friction, small beside that under load"
            raise InvalidInput("mean of input_torque", motor, allowed)
        return
    share = abs(load) / ratio
    # Friction adds to the load when the motor drives it; when the load drives, it may reverse the
    # torque.
    least = rules.load_mismatch * share - slack if load * record.input_speed > 0.0 else -math.inf
    if not (least <= math.copysign(1.0, load) * motor and abs(motor) <= multiple * share + slack):
        # Friction takes its share of the motor's torque, so that only large factors are clear.
        cause = likely_unit("torque", motor * ratio / load, _FRICTION)
        allowed = f"near load / ratio = {load / ratio:.3g} N.m{cause}"
        raise InvalidInput("mean of input_torque", motor, allowed)
