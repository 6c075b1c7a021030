"""A record of a mechanism: signals at a uniform rate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from pymoo_hdte.checks import InvalidInput, finite_array, one_of

ROLES = ("train", "held_out")
FEWEST_SAMPLES = 16
FINER = 4
"""Samples for each of a record in a simulation."""
_JITTER = 0.01
"""Largest deviation of a step from the mean one, relative."""


@dataclass(frozen=True, eq=False)
class Record:
    """Signals of one test.

    Attributes
    ----------
    name : str
    role : str
        One of `ROLES`.
    time : ndarray, shape (n,)
        s, uniform within 1 % of a step; at least `FEWEST_SAMPLES` of them.
    channels : dict of str to ndarray, shape (n,)
        Coordinates, inputs, references and force sensors by name, SI.

    Raises
    ------
    InvalidInput
        For times that are not uniform, or a channel of another length or with a value that is not
        finite.
    """

    name: str
    role: str
    time: NDArray[np.float64]
    channels: Mapping[str, NDArray[np.float64]]

    def __init__(
        self, name: str, role: str, time: ArrayLike, channels: Mapping[str, ArrayLike]
    ) -> None:
        one_of(f"role of record {name}", role, ROLES)
        moments = finite_array(f"time of record {name}", time, (None,))
        if len(moments) < FEWEST_SAMPLES:
            raise InvalidInput(
                f"samples of record {name}", len(moments), f"at least {FEWEST_SAMPLES}"
            )
        steps = np.diff(moments)
        step = (moments[-1] - moments[0]) / len(steps)
        worst = int(np.argmax(np.abs(steps - step)))
        if not (step > 0.0 and abs(steps[worst] - step) <= _JITTER * step):
            raise InvalidInput(
                f"step {worst} of the time of record {name}",
                float(steps[worst]),
                f"{step:g} s within {_JITTER:.0%}, as the mean of the record",
            )
        n = len(moments)
        checked = {
            channel: finite_array(f"channel {channel} of record {name}", values, (n,))
            for channel, values in channels.items()
        }
        for attribute, value in (
            ("name", name),
            ("role", role),
            ("time", moments),
            ("channels", checked),
        ):
            object.__setattr__(self, attribute, value)

    def finer(self, factor: int) -> Record:
        """Return the record with ``factor`` samples for each, on a smooth curve through them.

        What takes signals for straight between samples is wrong by three per cent where there are
        ten of them to a period, and by more at a resonance.
        """
        n = len(self.time)
        places, between = np.arange(n), np.arange(factor * (n - 1) + 1) / factor
        channels = {
            name: make_interp_spline(places, channel, 3)(between)
            for name, channel in self.channels.items()
        }
        return Record(self.name, self.role, self.time[0] + self.step * between, channels)

    @property
    def step(self) -> float:
        """Mean time between samples, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))
