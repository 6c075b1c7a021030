"""Figs. 9 and 10: the torsion loop with its branches, and the no-load runs with their lines."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.comparing.figures import BLUE, GREEN, ORANGE, PINK, grid
from experiments.paper.bench.campaign import Records
from pymoo_hdte.identification import LinearFit, stiffness
from pymoo_hdte.identification.prototypes import RunKey
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

BRANCHES = {
    "a1": ("forward loading", BLUE),
    "a2": ("forward unloading", ORANGE),
    "a3": ("reverse loading", GREEN),
    "a4": ("reverse unloading", PINK),
}


def torsion_loop(records: Records, key: RunKey) -> Figure:
    """Draw one loop, branch by branch, and what is left of it without the line of a1."""
    loop = records.loops[key]
    fit = stiffness(loop)
    left = loop.torque - fit.intercept - fit.slope * loop.torsion
    figure, (both,) = grid(1, 2, width=5.4, height=4.2)
    for name, samples in loop.branches.items():
        meaning, colour = BRANCHES[name]
        torsion = loop.torsion[samples] / ARCSEC
        for axis, torque in zip(both, (loop.torque, left), strict=True):
            label = f"{name}, {meaning}"
            axis.plot(torsion, torque[samples], ".", color=colour, markersize=3, label=label)
    ends = np.array([0.0, loop.torsion.max()])
    line = f"K = {fit.slope:.0f} ± {fit.slope_error:.0f} N.m/rad"
    both[0].plot(ends / ARCSEC, fit.intercept + fit.slope * ends, "k-", linewidth=1, label=line)
    both[0].set_ylabel("torque [N.m]")
    both[1].set_ylabel("torque less the line of a1 [N.m]")
    both[0].legend(fontsize=8, frameon=False)
    for axis in both:
        axis.set_xlabel("torsion [arcsec]")
    return figure


def damping_lines(
    records: Records, fits: dict[str, dict[RunKey, LinearFit]], key: RunKey
) -> Figure:
    """Draw the runs of one prototype with the fitted lines."""
    bearing, complete, output = records.bearing[key], records.complete[key], records.output[key]
    figure, (both,) = grid(1, 2, width=5.4, height=4.0)
    difference = complete.torque - bearing.torque
    _line(both[0], bearing.speed, bearing.torque, fits["B_in"][key], BLUE, "B_in")
    _line(both[0], bearing.speed, difference, fits["B_fc"][key], ORANGE, "B_fc")
    _line(both[1], output.speed, output.torque, fits["B_out"][key], GREEN, "B_out")
    both[0].set_xlabel("input speed [r/min]")
    both[1].set_xlabel("output speed [r/min]")
    for axis in both:
        axis.set_ylabel("no-load torque [mN.m]")
        axis.legend(fontsize=8, frameon=False, loc="upper left")
    return figure


def _line(
    axis: Axes, speed: np.ndarray, torque: np.ndarray, fit: LinearFit, colour: str, name: str
) -> None:
    at = speed / REVOLUTION_PER_MINUTE
    label = f"{name} = ({1e4 * fit.slope:.3f} ± {1e4 * fit.slope_error:.3f})e-4 N.m.s/rad"
    axis.plot(at, 1e3 * torque, "o", color=colour, markersize=5, mfc="none")
    line = 1e3 * (fit.intercept + fit.slope * speed)
    axis.plot(at, line, color=colour, linewidth=1.4, label=label)
