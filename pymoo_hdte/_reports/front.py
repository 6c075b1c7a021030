"""Interactive figure of a front: a script shows the design under the pointer.

Without the script, or printed, it is an ordinary figure; the page lists all designs beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_hdte._reports.figures import AFTER, BEFORE, svg

NAME = "front-point-"
"""Beginning of the name that a point has in the SVG, before its row; ``front.js`` looks for it."""


@dataclass(frozen=True, eq=False)
class Front:
    """The points of a front and their marks in the figure.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
    marked : dict of int
        Rows with a marker of their own, by label.
    initial : ndarray, shape (2,)
        Initial design, drawn beside the front or, if it is distant, given in the legend.
    axes : tuple of str
        Labels of the two axes.
    """

    points: NDArray[np.float64]
    marked: dict[str, int]
    initial: NDArray[np.float64]
    axes: tuple[str, str]


_BEYOND = 10.0
"""Distance of the initial design, in widths of the front, beyond which it is not drawn: the
front would shrink to a heap."""


def _is_distant(initial: NDArray[np.float64], points: NDArray[np.float64]) -> bool:
    width = np.ptp(points, axis=0)
    off = np.maximum(points.min(axis=0) - initial, initial - points.max(axis=0))
    return bool(np.all(width > 0.0) and np.any(off > _BEYOND * width))


def front_svg(front: Front) -> str:
    """Return the figure as an SVG element in which every point has a name."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axis = figure.subplots()
    for row, (x, y) in enumerate(front.points):
        axis.plot(x, y, "o", color=AFTER, markersize=4.5, gid=f"{NAME}{row}")
    for sign, (word, row) in zip("s^v", front.marked.items(), strict=False):
        axis.plot(
            *front.points[row], sign, markersize=11, fillstyle="none", color="black", label=word
        )
    if _is_distant(front.initial, front.points):
        label = "data sheet: {:.4g}, {:.4g}, beyond".format(*front.initial)
        axis.plot([], [], "x", color=BEFORE, markersize=9, mew=2.2, label=label)
    else:
        axis.plot(*front.initial, "x", color=BEFORE, markersize=9, mew=2.2, label="data sheet")
    axis.set_xlabel(front.axes[0])
    axis.set_ylabel(front.axes[1])
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    text = svg(figure)
    return text[text.index("<svg") :]


def design_rows(
    designs: NDArray[np.float64], nominal: NDArray[np.float64]
) -> Sequence[Sequence[tuple[float, float]]]:
    """Return for every design (n, d) its values and their changes from ``nominal`` (d,) in %."""
    changes = 100.0 * (designs / nominal - 1.0)
    return [
        list(zip(values, change, strict=True))
        for values, change in zip(designs.tolist(), changes.tolist(), strict=True)
    ]
