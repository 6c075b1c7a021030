"""A kind of machine of your own: ring-down tests, of which the amplitudes are measured.

A body on a spring is deflected and let go. Recorded are its turning points, one each half cycle;
what takes energy from the motion shows in how fast they shrink. The model is a balance of energy,

    stiffness (a_n^2 - a_(n+1)^2) / 2 = work of damper and laws over the half cycle,

so that neither time series nor forces are needed, and every law of the library can be asked.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pymoo_hdte.discrepancy import ModelEvidence
from pymoo_hdte.effects import Sizes, unknown
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force

_CYCLE = np.linspace(0.0, 4.0 * np.pi, 1025)
"""Phases of two cycles: laws with memory start from rest and repeat in the second one."""
_AMPLITUDES = 16
"""Amplitudes at which the work of a law is computed; between them it is interpolated."""


@dataclass(frozen=True)
class RingDown:
    """One test: its turning points, m, as sizes, the first one included."""

    name: str
    role: str
    amplitudes: np.ndarray


@dataclass(frozen=True)
class Oscillator:
    """A body on a spring, with its ring-down tests.

    Attributes
    ----------
    stiffness, frequency : float
        N/m and rad/s, both known well.
    damping, tolerance : float
        N.s/m, and the largest deviation from it as a share.
    noise : float
        Standard deviation of a measured amplitude, m.
    records : sequence of RingDown
    known : tuple of LawAt
        Effects that it is known to have.
    """

    stiffness: float
    frequency: float
    damping: float
    tolerance: float
    noise: float
    records: Sequence[RingDown]
    known: tuple = ()
    title: str = "ring-down tests"

    def evidence(self, records):
        """Return some of the tests beside the predictions of the model."""
        return RingDownEvidence(self, records)


class RingDownEvidence(ModelEvidence):
    """Measured amplitudes beside those that the balance of energy predicts."""

    def __init__(self, machine, records):
        self.machine, self.records, self.known = machine, records, machine.known
        self.units, self.along = {"damping": "N.s/m"}, ("spring",)
        width = machine.tolerance * machine.damping
        self.base = (
            unknown("damping", machine.damping - width, machine.damping + width, machine.damping),
        )
        self.largest = max(record.amplitudes.max() for record in records)

    def residuals(self, values, effects):
        """Return predicted minus measured amplitudes over the noise, for each test."""
        work = self._work(values["damping"], (*self.known, *effects))
        measured = [record.amplitudes for record in self.records]
        starts, step = np.array([course[0] for course in measured]), 1e-4 * self.largest
        courses, moved = (self._courses(start, work) for start in (starts, starts + step))
        # Each test starts from the amplitude that suits all of its turning points.
        for test, (points, course, after) in enumerate(zip(measured, courses, moved, strict=True)):
            slope = (after - course) / step
            starts[test] += slope @ (points - course) / (slope @ slope)
        return [
            {"amplitude": (course - points) / self.machine.noise}
            for course, points in zip(self._courses(starts, work), measured, strict=True)
        ]

    def sizes(self, fitted):
        """Return the size of a friction that would explain all of the decay, for the spring."""
        drops = np.concatenate([-np.diff(record.amplitudes) for record in self.records])
        force = 0.5 * self.machine.stiffness * float(drops.mean())
        return {
            "spring": Sizes(
                force=force,
                residual=force,
                largest=5.0 * force,
                speed=self.machine.frequency * self.largest,
                travel=self.largest,
                stiffness=self.machine.stiffness,
                damping=self.machine.damping,
            )
        }

    def _work(self, damping, effects):
        """Return a function: the energy that half a cycle of an amplitude takes."""
        grid = np.linspace(0.0, 1.2 * self.largest, _AMPLITUDES)[1:]
        half = len(_CYCLE) // 2
        taken = []
        for amplitude in grid:
            speed = -amplitude * self.machine.frequency * np.sin(_CYCLE)
            motion = PortMotion(amplitude * np.cos(_CYCLE), speed)
            force = sum(law_force(one.law, motion, self.machine.stiffness) for one in effects)
            power = (np.zeros_like(speed) + force) * speed
            taken.append(0.5 * np.trapezoid(power[half:], _CYCLE[half:]) / self.machine.frequency)

        def work(amplitude):
            viscous = 0.5 * np.pi * damping * self.machine.frequency * amplitude**2
            return viscous + np.interp(amplitude, [0.0, *grid], [0.0, *taken])

        return work

    def _courses(self, starts, work):
        """Return the amplitudes that follow from the first one of each test."""
        courses = [starts]
        for _ in range(max(len(record.amplitudes) for record in self.records) - 1):
            here = after = courses[-1]
            # The loss depends on the mean of both amplitudes, which three steps settle.
            for _ in range(3):
                lost = 2.0 * work(0.5 * (here + after)) / self.machine.stiffness
                after = np.sqrt(np.maximum(here**2 - lost, 0.0))
            courses.append(after)
        table = np.transpose(courses)
        return [
            row[: len(record.amplitudes)] for row, record in zip(table, self.records, strict=True)
        ]
