"""One drive under one condition: steady state, integration in time, and the speeds around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import (
    CataloguePage,
    Comparison,
    DriveModel,
    OperatingMap,
    Run,
    back_driving_torque,
    compared,
    efficiency,
    operating_map,
    simulate_drive,
    starting_torque,
)
from pymoo_hdte.drive._solve.time_domain import memories
from pymoo_hdte.drive.dte_map import (
    SpeedLoadMap,
    TorsionalMode,
    critical_speeds,
    speed_load_map,
    torsional_mode,
)
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

FASTEST = 2.0
"""Highest speed of the map, as a multiple of the condition's."""
SPEEDS = 80
MAP_SPEEDS, MAP_LOADS = 40, 17
"""Grid of the operating map; the number of loads is odd, so that zero is among them."""
SETTLE = 1.5
"""Time before the record begins, s."""
TURNS_TO_SETTLE = 0.02
"""Least number of output turns before the record begins; it decides at low speed."""

WITH_MEMORY = 1e-5
"""Tolerance of the integration where a law has memory, whose kinks cost steps: the DTE is off by
less than 1 % then."""

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Simulation:
    """The motion of the nominal design under one condition.

    Attributes
    ----------
    model : DriveModel
        The model at the simulated condition.
    run : Run
        One output turn, integrated from rest with a free input angle.
    steady : float
        DTE of the steady state, arcsec.
    lines : dict of float
        Amplitude of theta_d, arcsec, by order of the input turn.
    speeds : SpeedLoadMap
        DTE over `SPEEDS` speeds up to `FASTEST` times this speed, at this load.
    mode : TorsionalMode
    resonances : list of (order, input speed in r/min)
    efficiency : float
        Power out over power in; NaN without load.
    starting, back_driving : float
        Torque that starts the unloaded input, and the free output, N.m.
    printed : tuple of Comparison
        Figures of the catalogue page that were not entered.
    map : OperatingMap or None
    """

    model: DriveModel
    run: Run
    steady: float
    lines: dict[float, float]
    speeds: SpeedLoadMap
    mode: TorsionalMode
    resonances: list[tuple[float, float]]
    efficiency: float
    starting: float
    back_driving: float
    printed: tuple[Comparison, ...] = ()
    map: OperatingMap | None = None

    @property
    def speed(self) -> float:
        """Input speed, r/min."""
        return self.model.sheet.input_speed / REVOLUTION_PER_MINUTE

    @property
    def difference(self) -> float:
        """Difference of the integration from the steady state, relative to the latter."""
        return self.run.dte_arcsec() / self.steady - 1.0


def simulate_condition(
    model: DriveModel, with_map: bool = False, page: CataloguePage | None = None
) -> Simulation:
    """Simulate the nominal design of a model at the condition of its data sheet.

    Parameters
    ----------
    model : DriveModel
    with_map : bool
        Whether to go over speeds, loads and directions, too.
    page : CataloguePage, optional
        Whose printed figures are compared.

    Raises
    ------
    UnstableDrive
        If it has no steady state there.
    ArithmeticError
        If the integrator or the harmonic balance gives up.
    """
    spectrum = model.steady_state(model.nominal[None])
    turn = 2.0 * np.pi * model.sheet.ratio / model.sheet.input_speed
    fastest = FASTEST * model.sheet.input_speed / REVOLUTION_PER_MINUTE
    speeds = np.linspace(0.0, fastest, SPEEDS + 1)[1:]
    return Simulation(
        model=model,
        run=simulate_drive(
            model,
            model.nominal,
            settle=max(SETTLE, TURNS_TO_SETTLE * turn),
            rtol=WITH_MEMORY if memories(model.coefficients(model.nominal[None])) else 1e-8,
        ),
        steady=float(spectrum.peak_to_peak(model.sheet.ratio)[0] / ARCSEC),
        lines={
            order: float(amplitude[0] / ARCSEC)
            for order, amplitude in spectrum.amplitudes().items()
        },
        speeds=speed_load_map(model, speeds, np.array([model.sheet.load_torque])),
        mode=torsional_mode(model),
        resonances=critical_speeds(model),
        efficiency=float(efficiency(model, model.sheet.input_speed, model.sheet.load_torque)[0]),
        starting=starting_torque(model),
        back_driving=back_driving_torque(model),
        printed=() if page is None else tuple(compared(page)),
        map=_map(model, fastest) if with_map else None,
    )


def _map(model: DriveModel, fastest: float) -> OperatingMap:
    load = abs(model.sheet.load_torque) or 1.0
    speeds = np.linspace(0.0, fastest * REVOLUTION_PER_MINUTE, MAP_SPEEDS + 1)[1:]
    return operating_map(model, speeds, np.linspace(-load, load, MAP_LOADS))
