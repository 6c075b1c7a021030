"""A record of a mechanism: signals at a uniform rate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from pymoo_hdte._io.even_steps import STEP_SPREAD
from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number, whole_number
from pymoo_hdte.mechanism.motion import noise_of, timing_noise

ROLES = ("train", "held_out")
FEWEST_SAMPLES = 16


@dataclass(frozen=True, eq=False)
class Record:
    """Signals of one test.

    Attributes
    ----------
    name : str
        Name of the test.
    role : {"train", "held_out"}
        Whether the record is fitted, or only used to judge the result.
    time : ndarray, shape (n,)
        s, uniform within 1 % of a step; at least 16 of them.
    channels : dict of str to ndarray, shape (n,)
        Coordinates, inputs, references and force sensors by name, SI.
    noise : dict of str to float
        Standard deviation of the white noise of channels, SI, where it is known; of the others it
        is estimated, see `noise_of`.
    dropped : int
        Rows of its file that had values that are not finite: left out at the ends, interpolated
        inside. A report states their number.
    remarks : tuple of str
        What else was done to the signals, in sentences, which a report repeats.
    interpolated : bool
        Whether rows stand where none was measured, on a cubic spline, which takes ten in a period.
    context : (int, int)
        Rows at its beginning and at its end that belong to other records: smoothing leans on them,
        and nothing is concluded from them.

    Raises
    ------
    InvalidInput
        For another role, times that are not uniform, a channel of another length or with a value
        that is not finite, a noise that is not positive or of no channel, or a ``dropped`` that is
        no count.

    Examples
    --------
    >>> time = np.arange(0.0, 2.0, 0.01)
    >>> record = Record("one", "train", time, {"q": np.sin(time), "torque": np.cos(time)})
    >>> record.step
    0.01
    """

    name: str
    role: str
    time: NDArray[np.float64]
    channels: Mapping[str, NDArray[np.float64]]
    noise: Mapping[str, float]
    dropped: int
    remarks: tuple[str, ...]
    interpolated: bool
    context: tuple[int, int]

    def __init__(
        self,
        name: str,
        role: str,
        time: ArrayLike,
        channels: Mapping[str, ArrayLike],
        noise: Mapping[str, float] | None = None,
        dropped: int = 0,
        remarks: Sequence[str] = (),
        interpolated: bool = False,
        context: tuple[int, int] = (0, 0),
    ) -> None:
        if not isinstance(name, str):
            raise InvalidInput("name of a record", name, "a text")
        one_of(f"role of record {name}", role, ROLES)
        moments = finite_array(f"time of record {name}", time, (None,))
        if len(moments) < FEWEST_SAMPLES:
            raise InvalidInput(
                f"samples of record {name}", len(moments), f"at least {FEWEST_SAMPLES}"
            )
        steps = np.diff(moments)
        step = (moments[-1] - moments[0]) / len(steps)
        worst = int(np.argmax(np.abs(steps - step)))
        if not (step > 0.0 and abs(steps[worst] - step) <= STEP_SPREAD * step):
            raise InvalidInput(
                f"step {worst} of the time of record {name}",
                float(steps[worst]),
                f"{step:g} s within {100.0 * STEP_SPREAD:g} %, as the mean of the record; "
                "pymoo_hdte._io.even_steps brings signals to even steps",
            )
        for what, given in (("channels", channels), ("noise", {} if noise is None else noise)):
            if not isinstance(given, Mapping):
                raise InvalidInput(f"{what} of record {name}", given, "a mapping by name")
        n = len(moments)
        checked = {
            channel: finite_array(f"channel {channel} of record {name}", values, (n,))
            for channel, values in channels.items()
        }
        known = {} if noise is None else dict(noise)
        for channel, deviation in known.items():
            one_of(f"noise of record {name}", channel, tuple(checked))
            real_number(f"noise of channel {channel} of record {name}", deviation, above=0.0)
        for attribute, value in (
            ("noise", known),
            ("dropped", whole_number(f"dropped of record {name}", dropped, at_least=0)),
            ("remarks", tuple(remarks)),
            ("interpolated", interpolated),
            ("context", context),
            ("name", name),
            ("role", role),
            ("time", moments),
            ("channels", checked),
        ):
            object.__setattr__(self, attribute, value)

    def channel(self, name: str) -> NDArray[np.float64]:
        """Return the channel of that name, SI, shape (n,); `InvalidInput` where there is none."""
        if name not in self.channels:
            allowed = f"with {name!r}, which the mechanism needs"
            raise InvalidInput(f"channels of record {self.name}", sorted(self.channels), allowed)
        return self.channels[name]

    def noise_of(self, channel: str, jumps: bool = False) -> float:
        """Return the standard deviation of the white noise of a channel: known, or estimated.

        Parameters
        ----------
        channel : str
            Name of the channel.
        jumps : bool
            Whether its signal may jump, as that of a force: `timing_noise` is then part of it.

        Returns
        -------
        float
            SI.
        """
        signal = self.channels[channel]
        own = self.noise.get(channel) or noise_of(signal, jumps)
        return math.hypot(own, timing_noise(signal)) if jumps else own

    def finer(self, factor: int) -> Record:
        """Return the record with ``factor`` times as many samples, on a smooth curve through them.

        The curve is a cubic spline; n samples become factor (n - 1) + 1. Linear interpolation
        between samples has an error of three per cent at ten samples per period, and more at a
        resonance.
        """
        n = len(self.time)
        places, between = np.arange(n), np.arange(factor * (n - 1) + 1) / factor
        channels = {
            name: make_interp_spline(places, channel, 3)(between)
            for name, channel in self.channels.items()
        }
        return Record(
            self.name,
            self.role,
            self.time[0] + self.step * between,
            channels,
            self.noise,
            context=(factor * self.context[0], factor * self.context[1]),
        )

    def with_delays(self, delays: Mapping[str, float]) -> Record:
        """Return the record with channels later by their delays, s, and a remark about each.

        Rows at either end that a delay leaves without a sample are left out.

        Parameters
        ----------
        delays : mapping of str to float
            s, by the name of a channel of a force; a negative delay makes it earlier.

        Raises
        ------
        InvalidInput
            If too few samples remain, or there is no such channel.
        """
        taken = {name: delay for name, delay in delays.items() if delay}
        early, late = (
            math.ceil(max([0.0, *(sign * delay for delay in taken.values())]) / self.step)
            for sign in (1.0, -1.0)
        )
        rows = slice(early, len(self.time) - late)
        channels = {
            name: delayed(channel, self.step, taken.get(name, 0.0))[rows]
            for name, channel in self.channels.items()
        }
        told = [
            f"{name} is taken to act {1e3 * abs(delay):.4g} ms "
            f"{'later' if delay > 0.0 else 'earlier'} than its column says."
            for name, delay in taken.items()
        ]
        return Record(
            self.name,
            self.role,
            self.time[rows],
            channels,
            # As recorded: between two samples the curve has less noise than they have.
            {name: noise_of(self.channel(name), jumps=True) for name in taken} | dict(self.noise),
            self.dropped,
            (*self.remarks, *told),
            self.interpolated,
            (max(self.context[0] - early, 0), max(self.context[1] - late, 0)),
        )

    @property
    def step(self) -> float:
        """Mean time between samples, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))


def delayed(signal: NDArray[np.float64], step: float, delay: float) -> NDArray[np.float64]:
    """Return a signal, (n,), later by a delay, on a cubic spline; its ends are held.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    step, delay : float
        s. A negative delay makes it earlier.
    """
    if delay == 0.0:
        return signal
    places = np.arange(len(signal))
    moments = np.clip(places - delay / step, 0.0, len(signal) - 1.0)
    return np.asarray(make_interp_spline(places, signal, 3)(moments))
