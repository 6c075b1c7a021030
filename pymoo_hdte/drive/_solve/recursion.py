"""Forces that remember: sums of parts that each follow from the step before and the way since."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled

Values = NDArray[np.float64]
Places = NDArray[np.int_]


class Recollection(NamedTuple):
    """How forces of n rows depend on a signal elsewhere on a path that recurs, of G points.

    Attributes
    ----------
    retained, gained : ndarray, shape (k, n, 2 G)
        Retained share and gain of each of k parts, at each step of two passages.
    places : ndarray of int, shape (n, G)
        Points of a passage in its order.
    """

    retained: Values
    gained: Values
    places: Places

    def rows(self, rows: slice) -> Recollection:
        """Return the recollection of some of the rows."""
        return Recollection(self.retained[:, rows], self.gained[:, rows], self.places[rows])

    def of_signals(self, signals: Values, row: int = 0) -> Values:
        """Return the forces (G, m) of a row by each of m signals (G, m), as of `recall`."""
        forces = np.zeros(signals.shape)
        recall(self.retained[:, row], self.gained[:, row], self.places[row], signals, forces)
        return forces


@compiled
def recall(
    retained: Values, gained: Values, places: Places, signals: Values, forces: Values
) -> None:
    """Add to ``forces`` how the forces on a path that recurs depend on signals at other points.

    A part keeps a share of itself at each step and gains a multiple of the way of the signal since
    the step before. Once settled it is the same in each passage; one that keeps all of itself goes
    on from the first passage, which begins at zero. What parts gain from the signal at the point
    itself is left out.

    Parameters
    ----------
    retained, gained : ndarray, shape (k, 2 G)
        Retained share and gain of each part at each step of two passages.
    places : ndarray of int, shape (G,)
        Points of a passage in its order.
    signals : ndarray, shape (G, m)
        Signals at each point.
    forces : ndarray, shape (G, m)
    """
    size = len(places)
    force = np.empty(signals.shape[1])
    for part in range(len(retained)):
        of_passage = np.prod(retained[part, size:])
        fades = of_passage < 1.0
        begin = size if fades else 0
        end = 2 * size if fades else size
        for step in range(begin, end):
            # It has forgotten all before.
            if retained[part, step] == 0.0:
                begin = step
        force[:] = 0.0
        for step in range(begin, end):
            _step(retained[part, step], gained[part, step], places, step, signals, force)
        if fades:
            force /= 1.0 - of_passage
        for step in range(size, 2 * size):
            _step(retained[part, step], gained[part, step], places, step, signals, force)
            place = places[step - size]
            for column in range(len(force)):
                forces[place, column] += force[column] - gained[part, step] * signals[place, column]


@compiled
def _step(
    retained: float, gained: float, places: Places, step: int, signals: Values, force: Values
) -> None:
    """Let the force by each signal take a step of the path."""
    place, before = places[step % len(places)], places[(step - 1) % len(places)]
    for column in range(len(force)):
        came_from = signals[before, column] if step > 0 else 0.0
        force[column] = retained * force[column] + gained * (signals[place, column] - came_from)
