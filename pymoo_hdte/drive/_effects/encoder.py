"""Errors of the output encoder by angle: they change what is read, not the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pymoo_hdte.drive._effects.base import DriveEffect, DriveSizes, Lines, Session, check_line
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess, guess_of_lines
from pymoo_hdte.effects.law import Values
from pymoo_hdte.effects.unknowns import is_whole

ENCODER_LINE = "encoder_line"
"""Name of an error of the encoder's scale, which no verdict names: see `Guess.name`."""


@dataclass(frozen=True)
class Eccentricity(DriveEffect):
    """The disc of the output encoder is off centre: amplitude cos(theta_out + phase) is added.

    A once-per-turn error of the drive itself looks the same unless the encoder is turned on its
    shaft.

    Attributes
    ----------
    name, port : str
        ``"eccentricity"`` and ``"sensor"``, in model files and verdicts.
    amplitude, phase : float
        rad.
    order : float
        Cycles per output turn: 1 off centre, 2 oval or tilted, more for the scale itself.

    Raises
    ------
    InvalidInput
        For a number that is not finite, or an order that is not above 0.

    Examples
    --------
    >>> disc = Eccentricity(amplitude=2e-5, phase=0.0)
    >>> disc.port, disc.order
    ('sensor', 1.0)
    """

    name: ClassVar[str] = "eccentricity"
    port: ClassVar[str] = "sensor"
    amplitude: float
    phase: float
    order: float = 1.0

    def __post_init__(self) -> None:
        check_line(self)

    def reading_lines(self, records: Session) -> tuple[Values, Lines]:
        """Return means (r,) and lines (r, m) of what is added to the reading, rad.

        Parameters
        ----------
        records : Session
            r records, each with m lines.
        """
        lines = np.zeros((len(records.elapsed), len(records.orders)), dtype=complex)
        # theta_out is theta_in / N except for the transmission error, a part in 10^3.
        line = np.isclose(records.orders, self.order / records.ratio)
        lines[:, line] = self.amplitude * np.exp(1j * self.phase)
        return np.zeros(len(lines)), lines


def _off_centre(sizes: DriveSizes) -> list[Guess]:
    """Guess a disc off centre, and errors of its scale wherever whole cycles per turn are seen."""
    guesses = [_turning(sizes, 1.0)]
    for order in sizes.further().seen:
        turns = order * sizes.slower
        if turns > 1.5 and is_whole(turns):
            guesses.append(_turning(sizes, float(round(turns))))
    return guesses


def _turning(sizes: DriveSizes, turns: float) -> Guess:
    def line(order: float, amplitude: float, phase: float) -> Eccentricity:
        return Eccentricity(amplitude, phase, order)

    family, largest, typical = sizes.family(turns), sizes.largest_error, sizes.error
    if turns == 1.0:
        return guess_of_lines(family, "amplitude", largest, typical, line)
    sentence = "The output encoder errs {order} times in its turn."
    return guess_of_lines(
        family, "amplitude", largest, typical, line, sentence=sentence, name=ENCODER_LINE
    )


register(
    Effect(
        Eccentricity.name,
        None,
        ("sensor",),
        {"amplitude": "angle", "phase": "angle", "order": ""},
        "The output encoder sits off centre.",
        _off_centre,
        change=Eccentricity,
        exact=True,
        forms="harmonics_of_scale",
        twin="kinematic_error",
    )
)
