"""Records of a campaign: one test each, with its condition and its raw channels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number, whole_number

ROLES = ("train", "held_out")
"""``train`` records are fitted; ``held_out`` ones, running records only, validate the result."""

FEWEST_SAMPLES = 8
"""Least number of rows of a record."""

_NOT_IN_NAMES = frozenset('/\\:*?"<>|')
"""Characters that the name of a file cannot have on one system or another."""

_COLDEST, _HOTTEST = 200.0, 473.0
"""Limits of a temperature, K: no grease serves beyond -73 and 200 degrees Celsius."""


@dataclass(frozen=True)
class Jump:
    """A jump of a sensor that was taken out of the rows of a record.

    Its size is fitted again together with the lines. Nobody knows whether the rows before or after
    it were right, so the mean of the channel counts as uncertain by ``size``.

    Attributes
    ----------
    time : float
        Time of the first row after it, s.
    channel : str
        Attribute of the record.
    size : float
        What was subtracted from this row on, rad or N.m.
    """

    time: float
    channel: str
    size: float


@dataclass(frozen=True)
class ReadingError:
    """By how much a sensor may be wrong in one record, beyond its noise.

    Attributes
    ----------
    channel : str
        Attribute of the record.
    size : float
        Standard deviation of what is added to the mean of the channel, rad or N.m.
    of_lines : bool
        Whether both parts of each order line are as uncertain, as where coarse steps hide them.
    bent : float
        Standard deviation of a drift that is not straight, in the unit of ``size``: the coefficient
        of powers 2, 3 and 4 of the time from the middle of the record, as a share of its length.
    """

    channel: str
    size: float
    of_lines: bool = False
    bent: float = 0.0


@dataclass(frozen=True, eq=False)
class RunningRecord:
    """The drive at constant speed and load, over one output turn or more.

    Attributes
    ----------
    name : str
        In any script, as `is_record_name` has it; also the stem of its file.
    role : {"train", "held_out"}
        To be fitted, or only to validate the result.
    input_speed : float
        Set speed, rad/s; negative in the reverse direction.
    load_torque : float
        N.m at the output; positive against positive rotation.
    sample_rate : float
        Rate of the rows, after averaging, Hz.
    samples_averaged : int
        Number of raw samples averaged into one row.
    elapsed : float
        Time from the start of the session to the start of this record, s.
    time : ndarray, shape (n,)
        Middle of the raw samples of each row, s, increasing; the origin is arbitrary, since only
        ``elapsed`` says when the record began.
    input_angle, output_angle : ndarray, shape (n,)
        rad, absolute and unwrapped, with one common zero over a campaign.
    input_torque, output_torque : ndarray, shape (n,)
        On the input shaft from the motor, and between drive and load inertia, N.m.
    speed_range, load_range : tuple of float, length 2 or 0
        Lowest and highest mean speed, rad/s, and mean load torque, N.m, that the record may have.
        Without them both must be near the values set, within the limits of `Rules`.
    temperature : float, optional
        Of the lubricant in kelvin; the mean over the record.
    series : int
        Number of its series of measurements. Within one the drive stays mounted as it is; between
        two it may have been mounted anew, which changes its static error.
    jumps : tuple of Jump
        Jumps of sensors that were taken out of the rows; none in a record as measured.
    reading_errors : tuple of ReadingError
        Errors of its sensors that the rows show; none in a record as measured.
    settling : float, optional
        Time constant of the decay with which the rows begin, s; it is fitted with the lines. None
        in a record as measured.

    Raises
    ------
    InvalidInput
        For a wrong condition, channels that are not finite, of unequal length or constant, time
        that does not increase, or time that disagrees with the sample rate.

    Examples
    --------
    >>> record = read_campaign("campaign").running[0]
    >>> record.role, len(record.time) == len(record.output_angle)
    ('train', True)
    """

    name: str
    role: str
    input_speed: float
    load_torque: float
    sample_rate: float
    samples_averaged: int
    elapsed: float
    time: NDArray[np.float64]
    input_angle: NDArray[np.float64]
    output_angle: NDArray[np.float64]
    input_torque: NDArray[np.float64]
    output_torque: NDArray[np.float64]
    speed_range: tuple[float, ...] = ()
    load_range: tuple[float, ...] = ()
    temperature: float | None = None
    series: int = 1
    jumps: tuple[Jump, ...] = ()
    settling: float | None = None
    reading_errors: tuple[ReadingError, ...] = ()

    def __post_init__(self) -> None:
        for name, inside in (("speed_range", self.input_speed), ("load_range", self.load_torque)):
            _check_range(name, getattr(self, name), real_number(name, inside))
        if real_number("input_speed", self.input_speed) == 0.0:
            raise InvalidInput("input_speed", self.input_speed, "a speed other than zero")
        real_number("load_torque", self.load_torque)
        whole_number("samples_averaged", self.samples_averaged, 1)
        whole_number("series", self.series, 1)
        real_number("elapsed", self.elapsed, at_least=0.0)
        if self.temperature is not None:
            temperature = real_number("temperature", self.temperature)
            if not _COLDEST <= temperature <= _HOTTEST:
                allowed = f"{_COLDEST:g} to {_HOTTEST:g} K, that of a drive with its lubricant"
                raise InvalidInput("temperature", f"{temperature:g} K", allowed)
        if self.settling is not None:
            real_number("settling", self.settling, above=0.0)
        _check_record(self, ("input_angle", "output_angle", "input_torque", "output_torque"))

    def transmission_error(self, ratio: float) -> NDArray[np.float64]:
        """Return the transmission error, Eq. (10), rad, shape (n,): input / ratio - output angle.

        The ratio is N, dimensionless.
        """
        return self.input_angle / ratio - self.output_angle


@dataclass(frozen=True, eq=False)
class TorsionRecord:
    """Input locked, output torque swept so slowly that only stiffness and friction matter.

    Attributes
    ----------
    name : str
        As in `RunningRecord`.
    role : {"train"}
        A sweep is always fitted: only running records are used for validation.
    sample_rate : float
        Hz.
    time : ndarray, shape (n,)
        s, increasing.
    output_angle : ndarray, shape (n,)
        rad; a positive torque turns the output backwards.
    output_torque : ndarray, shape (n,)
        N.m.

    Raises
    ------
    InvalidInput
        As in `RunningRecord`, and for a sweep that is held out.

    Examples
    --------
    >>> [sweep.role for sweep in read_campaign("campaign").torsion]
    ['train']
    """

    name: str
    role: str
    sample_rate: float
    time: NDArray[np.float64]
    output_angle: NDArray[np.float64]
    output_torque: NDArray[np.float64]

    def __post_init__(self) -> None:
        _check_record(self, ("output_angle", "output_torque"))
        if self.role == "held_out":
            allowed = "'train' for a torsion sweep: only running records can judge the result"
            raise InvalidInput("role", self.role, allowed)


def _check_range(name: str, limits: Any, inside: float) -> None:
    if not isinstance(limits, tuple) or len(limits) not in (0, 2):
        raise InvalidInput(name, limits, "a tuple of two numbers, or an empty one")
    if limits and not real_number(name, limits[0]) <= inside <= real_number(name, limits[1]):
        raise InvalidInput(name, limits, f"lowest and highest, with {inside:g} between them")


def is_record_name(name: Any) -> bool:
    """Tell whether a record may have a name: any system can then have a file of that name."""
    return (
        isinstance(name, str)
        and name.isprintable()
        and bool(name.strip())
        and not name.startswith(".")
        and not set(name) & _NOT_IN_NAMES
    )


def _check_record(record: Any, channels: tuple[str, ...]) -> None:
    if not is_record_name(record.name):
        allowed = (
            f"printable, without a point in front, and none of {' '.join(sorted(_NOT_IN_NAMES))}"
        )
        raise InvalidInput("name", record.name, allowed)
    one_of("role", record.role, ROLES)
    real_number("sample_rate", record.sample_rate, above=0.0)
    time = finite_array("time", record.time, (None,))
    if len(time) < FEWEST_SAMPLES:
        raise InvalidInput("number of samples", len(time), f"at least {FEWEST_SAMPLES}")
    _freeze(record, "time", time)
    for channel in channels:
        values = finite_array(channel, getattr(record, channel), time.shape)
        if np.all(values == values[0]):
            raise InvalidInput(channel, float(values[0]), "a channel that is alive, not constant")
        _freeze(record, channel, values)
    _check_time(time, record.sample_rate)


def _check_time(time: NDArray[np.float64], sample_rate: float) -> None:
    with np.errstate(over="ignore"):
        steps = np.diff(time)
        falls = np.flatnonzero(~(steps > 0.0))
        if falls.size:
            row = int(falls[0]) + 1
            raise InvalidInput(f"time[{row}]", float(time[row]), f"above {time[row - 1]:g}, rising")
        # The median, because a few lost rows are harmless.
        step = float(np.median(steps))
        if not abs(step * sample_rate - 1.0) < 0.05:
            allowed = f"{1.0 / sample_rate:g} s within 5 %, as the sample rate says"
            raise InvalidInput("step of time", step, allowed)


def _freeze(record: Any, channel: str, values: NDArray[np.float64]) -> None:
    values.setflags(write=False)
    object.__setattr__(record, channel, values)
