"""The picture of a torsion: over the torque, over the angle, and what the model leaves of it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pymoo_hdte.discrepancy.joint.analysis import JointFinding
from pymoo_hdte.reports.figures import AFTER, BEFORE, GREY
from pymoo_hdte.units import ARCSEC

_POINTS = 1500


def torsion_picture(finding: JointFinding) -> Figure:
    """Draw the torsion over the motor's torque and the angle; below, what models leave of it.

    Of the records that were fitted; and, grey, of those held out.
    """
    torsion, gear = finding.torsion, finding.joint.gear.name
    figure = Figure(figsize=(8.4, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=(3, 2))
    fits = [(torsion.verdict.base, BEFORE, ".", "before")]
    if torsion.accepted.candidates:
        fits.append((torsion.accepted, AFTER, "x", "after"))
    left = [torsion.data.coefficients(fit.residuals) for fit, *_ in fits]
    for record, balance in enumerate(torsion.data.spectra):
        motion, rows = balance.ports[gear], balance.record.time
        torque = sum(
            one.gain.value * one.acts[finding.joint.motor] * balance.record.channels[one.name]
            for one in torsion.mechanism.inputs
        )
        over = np.interp(balance.time, rows, np.asarray(torque)), motion.shaft
        stride = slice(None, None, max(1, len(balance.time) * len(torsion.data.spectra) // _POINTS))
        for column, x in enumerate(over):
            axes[0, column].plot(
                x[stride], motion.position[stride] / ARCSEC, "-", color=GREY, lw=1.2,
                label="measured" if record == 0 else None,
            )  # fmt: skip
            for (_, colour, marker, label), one in zip(fits, left, strict=True):
                angle = balance.in_time(one[record][0]) / finding.stiffness / ARCSEC
                axes[1, column].plot(
                    x[stride], angle[stride], marker, ms=3, color=colour, alpha=0.6,
                    label=label if record == 0 else None,
                )  # fmt: skip
    axes[0, 0].set_ylabel(f"torsion of {gear} [arcsec]")
    axes[1, 0].set_ylabel("residual [arcsec]")
    axes[1, 0].set_xlabel("torque of the motor, at the output [N.m]")
    axes[1, 1].set_xlabel("angle [rad]")
    for axis in axes.flat:
        _plain(axis)
    for row in (0, 1):
        axes[row, 0].legend(frameon=False, fontsize=8)
    return figure


def _plain(axis: Axes) -> None:
    axis.spines[["top", "right"]].set_visible(False)
