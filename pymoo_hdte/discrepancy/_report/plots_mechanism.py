"""Plots of a mechanism: friction over speed at each port, and the torsion of a joint's gear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._report.plots import MOST_POINTS, Panel, Plot, Series
from pymoo_hdte.discrepancy._verdicts.joint import JointFinding
from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.mechanism import LawAt
from pymoo_hdte.mechanism.balances import ForceBalance
from pymoo_hdte.mechanism.parts import Port
from pymoo_hdte.mechanism.port_motion import PortMotion, law_force
from pymoo_hdte.mechanism.quantity_units import unit_of
from pymoo_hdte.units import ARCSEC

Values = NDArray[np.float64]

_CURVE = 201
_LOADS = 3
"""Bands of load, of equally many rows, where the load that a port passes on is known."""


def mechanism_plots(finding: MechanismFinding, joint: JointFinding | None = None) -> list[Plot]:
    """Return the plots of a mechanism, and of the torsion of a joint with two encoders.

    Parameters
    ----------
    finding : MechanismFinding
    joint : JointFinding, optional
        Of a joint, ``finding`` being on its torques.
    """
    panels = tuple(
        panel
        for port in finding.mechanism.ports
        if not port.followed and (panel := _friction_at(finding, port)) is not None
    )
    plots = []
    if panels:
        plots.append(
            Plot(
                "friction",
                "friction over speed",
                "Lines: damper and friction of the accepted model. Points: what these records say, "
                "the residual of the force balance with that friction added back.",
                panels,
            )
        )
    return plots if joint is None else [*plots, _torsion(joint)]


def _friction_at(finding: MechanismFinding, port: Port) -> Panel | None:
    """Return friction over speed at a port; None where nothing moves it."""
    of_port = port.name if port.read else max(port.motion, key=lambda name: abs(port.motion[name]))
    share = 1.0 if port.read else port.motion[of_port]
    row = finding.data.names.index(of_port)
    values = dict(
        zip(
            (parameter.name for parameter in finding.accepted.parameters),
            finding.accepted.values.tolist(),
            strict=True,
        )
    )
    damping = values.get(f"damping of {port.name}", 0.0)
    stiffness = values.get(f"stiffness of {port.name}", port.stiffness.value)
    laws = _of_friction((*finding.believed, *finding.accepted.effects), port.name, stiffness)

    def friction(motion: PortMotion) -> Values:
        still = PortMotion(motion.position, 0.0 * motion.speed, motion.load, motion.angle)
        forces = [
            law_force(law, motion, stiffness) - law_force(law, still, stiffness) for law in laws
        ]
        return np.sum([damping * motion.speed, *forces], axis=0)

    speeds, forces, loads = [], [], []
    coefficients = finding.data.coefficients(finding.accepted.residuals)
    for balance, residual in zip(finding.data.spectra, coefficients, strict=True):
        motion, rows = balance.ports[port.name], np.flatnonzero(balance.moving.whole)
        rows = rows[:: max(1, len(rows) * len(coefficients) // MOST_POINTS)]
        force = balance.in_time(residual[row]) / share + friction(motion)
        speeds.append(motion.speed[rows])
        forces.append(force[rows])
        loads.append(np.full(len(rows), np.nan) if motion.load is None else motion.load[rows])
    speed, force, load = map(np.concatenate, (speeds, forces, loads))
    if not np.any(speed):
        return None
    mechanism = finding.mechanism
    unit, force_unit = unit_of(mechanism, port.name, "speed"), unit_of(mechanism, port.name)
    series: list[Series] = []
    for label, rows, middle in _bands(load, force_unit):
        reach = max(abs(speed[rows].min()), abs(speed[rows].max()))
        # Denser at low speed, where friction bends.
        half = reach * np.linspace(0.0, 1.0, _CURVE // 2 + 1)[1:] ** 3
        grid = np.concatenate([-half[::-1], half])
        grid = grid[(grid >= speed[rows].min()) & (grid <= speed[rows].max())]
        here = np.zeros_like(grid)
        curve = friction(PortMotion(here, grid, None if middle is None else here + middle))
        series += [
            Series(label, speed[rows], force[rows], "points"),
            Series(label if middle is not None else "model", grid, curve),
        ]
    title = f"At {'sensor ' if port.read else ''}{port.name}"
    return Panel(title, f"speed [{unit}]", f"friction [{force_unit}]", tuple(series))


def _of_friction(effects: Sequence[LawAt], port: str, stiffness: float) -> list:
    """Return the laws at a port whose force depends on the speed alone or beside other things."""
    speed = np.array([-1.0, 1.0])
    laws = []
    for effect in effects:
        if effect.port == port and not effect.law.states:
            moving = PortMotion(0.0 * speed, speed, 1.0 + 0.0 * speed)
            still = PortMotion(0.0 * speed, 0.0 * speed, 1.0 + 0.0 * speed)
            forces = (law_force(effect.law, motion, stiffness) for motion in (moving, still))
            if np.any(np.subtract(*forces)):
                laws.append(effect.law)
    return laws


def _bands(load: Values, unit: str) -> Iterator[tuple[str, NDArray[np.int_], float | None]]:
    """Return label, rows and median load of bands of load; one band where it is unknown."""
    if np.any(np.isnan(load)):
        yield "records", np.arange(len(load)), None
        return
    for rows in np.array_split(np.argsort(load, kind="stable"), _LOADS):
        low, high = float(load[rows].min()), float(load[rows].max())
        if len(rows):
            yield f"load {low:.3g} … {high:.3g} {unit}", np.sort(rows), float(np.median(load[rows]))


def _torsion(finding: JointFinding) -> Plot:
    torsion, gear = finding.torsion, finding.joint.gear.name
    coefficients = torsion.data.coefficients(torsion.accepted.residuals)
    measured, modelled = [], []
    for balance, residual in zip(torsion.data.spectra, coefficients, strict=True):
        stride = max(1, len(balance.time) * len(coefficients) // MOST_POINTS)
        torque = motor_torque(finding, balance)[::stride]
        twist = balance.ports[gear].position
        unexplained = balance.in_time(residual[0]) / finding.stiffness
        measured.append(Series("measured", torque, twist[::stride] / ARCSEC, "points"))
        modelled.append(Series("model", torque, (twist - unexplained)[::stride] / ARCSEC, "points"))
    return Plot(
        "torsion",
        "torsion over torque",
        "Measured torsion of the fitted records, and that of the accepted model at the same times.",
        (Panel("", _TORQUE, f"torsion of {gear} [arcsec]", (*measured, *modelled)),),
    )


_TORQUE = "torque of the motor, at the output [N.m]"


def motor_torque(finding: JointFinding, balance: ForceBalance) -> Values:
    """Return the motor's torque at the working rate, N.m at the output, shape (n,)."""
    record = balance.record
    torques = [
        actuator.gain.value * actuator.acts[finding.joint.motor] * record.channels[actuator.name]
        for actuator in finding.torsion.mechanism.inputs
    ]
    return np.interp(balance.time, record.time, np.asarray(np.sum(torques, axis=0)))
