"""Figures that makers print, as a drive model has them: torques, efficiency, lost motion, accuracy.

Nothing here knows where the model comes from: starting torque, running torque and efficiency are
read off its steady motion, hysteresis and lost motion off its torsion with a locked input.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.quasi_static import quasi_static_torsion
from pymoo_hdte.drive.catalogue import (
    CataloguePage,
    Entry,
    Figure,
    accuracy_of_parts,
    complete,
    drive_of,
    loop_width,
    sampled,
)
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

Values = NDArray[np.float64]

LOST_MOTION_LOAD = 0.04
"""Share of the rated torque between whose two signs makers measure the lost motion."""
_CREEP = 0.1 * REVOLUTION_PER_MINUTE
"""Speed of a drive that has just started, rad/s: viscous torques are negligible."""
_GRID = 32
_DRAWS = 19
"""Fewest draws of which the least and the largest bound 90 %: (19 - 1) / (19 + 1)."""


def input_torque(model: DriveModel, speed: ArrayLike, load: ArrayLike) -> Values:
    """Return the torque of the motor that turns the drive evenly, N.m, in n conditions.

    It is that of load, bearings and friction. What ripple of the motion loses besides is of second
    order in the ripple, and left out.

    Parameters
    ----------
    model : DriveModel
    speed : array_like, shape (n,)
        Of the input, rad/s, not 0; negative in reverse.
    load : array_like, shape (n,)
        At the output, N.m; it opposes forward motion where positive.

    Returns
    -------
    ndarray, shape (n,)
        N.m.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> print(f"{input_torque(model, [200.0], [40.0])[0]:.3f} N.m")
    0.430 N.m
    """
    speeds, loads = (
        np.asarray(values, float)[:, None]
        for values in np.broadcast_arrays(np.atleast_1d(speed), np.atleast_1d(load))
    )
    drive = model.coefficients(model.nominal[None])
    of_output = speeds / drive.ratio
    delivered = loads + drive.output_damping * of_output
    for port in ("output", "load"):
        delivered = delivered + _friction(drive, port, of_output, loads)
    carried = delivered / drive.ratio
    torque = carried + drive.input_damping * speeds + _friction(drive, "input", speeds, carried)
    return np.asarray(torque[:, 0])


def _friction(drive: Coefficients, port: str, speed: Values, load: Values) -> Values:
    """Return the mean torque (n, 1) of the laws at a port that turns evenly, with loads (n, 1).

    A periodic law is averaged over its period; a law with memory has moved far.
    """
    angle = np.linspace(0.0, 4.0 * np.pi, 2 * _GRID, endpoint=False)
    position = np.sign(speed) * angle
    state = PortState(
        position,
        np.broadcast_to(speed, position.shape),
        lambda order: angle,
        np.full_like(position, drive.stiffness[0]),
        load=np.broadcast_to(load, position.shape),
        temperature=drive.temperature,
    )
    torque = np.zeros_like(position)
    for place, law in drive.laws:
        if place == port:
            torque = torque + law.respond(state).torque
    return np.asarray(torque[:, _GRID:].mean(axis=1, keepdims=True))


def efficiency(model: DriveModel, speed: ArrayLike, load: ArrayLike) -> Values:
    """Return the share of the power that leaves the drive, in n conditions.

    Where the load opposes the motion the power leaves at the output; where the load drives, at the
    input. A drive that both have to push has 0.

    Parameters
    ----------
    model : DriveModel
    speed, load : array_like, shape (n,)
        As of `input_torque`.

    Returns
    -------
    ndarray, shape (n,)
        Dimensionless; NaN without load, or where no motion is found.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> print(f"{efficiency(model, [200.0], [40.0])[0]:.2f}")
    0.92
    """
    speeds, loads = np.broadcast_arrays(np.atleast_1d(speed), np.atleast_1d(load))
    torque = input_torque(model, speeds, loads)
    return power_share(torque * speeds, loads * speeds / model.sheet.ratio)


def power_share(given: Values, taken: Values) -> Values:
    """Return output over input of the power that goes in at the motor and out at the load.

    Parameters
    ----------
    given, taken : ndarray, shape (...)
        Power that the motor gives and that the load takes, in one unit; negative the other way.

    Returns
    -------
    ndarray, shape (...)
        Between 0 and 1; NaN where the load takes none.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(taken > 0.0, taken / given, np.maximum(given / taken, 0.0))
    return np.where(taken == 0.0, np.nan, share)


def starting_torque(model: DriveModel) -> float:
    """Return the torque, N.m, at which the unloaded input begins to turn.

    Parameters
    ----------
    model : DriveModel

    Examples
    --------
    >>> starting_torque(preset("calibrated")) < 1e-4
    True
    """
    return float(input_torque(model, [_CREEP], [0.0])[0])


def back_driving_torque(model: DriveModel) -> float:
    """Return the torque at the output, N.m, at which it begins to turn the free input.

    It is where the torque of a driving load leaves nothing for a motor; inf if the drive locks.

    Parameters
    ----------
    model : DriveModel

    Examples
    --------
    >>> back_driving_torque(preset("calibrated")) < 0.01
    True
    """
    unit = max(abs(model.sheet.load_torque), 1.0)
    torques = input_torque(model, [_CREEP, _CREEP], [-0.5 * unit, -unit])
    slope = (torques[0] - torques[1]) / (0.5 * unit)
    return float(unit + torques[1] / slope) if slope > 0.0 else np.inf


def hysteresis_loss(model: DriveModel) -> float:
    """Return the width of the torsion loop at zero torque after +- the rated torque, rad.

    Parameters
    ----------
    model : DriveModel

    Examples
    --------
    >>> hysteresis_loss(preset("calibrated"))
    0.0
    """
    return loop_width(model, model.sheet.load_torque)


def lost_motion(model: DriveModel) -> float:
    """Return the torsion between plus and minus `LOST_MOTION_LOAD` of the rated torque, rad.

    Parameters
    ----------
    model : DriveModel

    Examples
    --------
    >>> model = preset("calibrated")
    >>> print(f"{np.degrees(lost_motion(model)) * 60:.2f} arcmin")
    0.43 arcmin
    """
    torque = LOST_MOTION_LOAD * model.sheet.load_torque
    path = torque * np.array([1.0, -1.0, 1.0])
    twist = quasi_static_torsion(model.coefficients(model.nominal[None]), path)[0]
    return float(abs(twist[2] - twist[1]))


def predicted(model: DriveModel, figure: Figure) -> float:
    """Return a figure as the model has it, in SI and for the condition of the printed one.

    Raises
    ------
    KeyError
        For a figure that is not compared, such as a peak torque.
    """
    speed = model.sheet.input_speed if figure.speed is None else figure.speed
    load = model.sheet.load_torque if figure.load is None else figure.load
    of_name = {
        "efficiency": lambda: float(efficiency(model, [speed], [load])[0]),
        "no_load_running_torque": lambda: float(input_torque(model, [speed], [0.0])[0]),
        "no_load_starting_torque": lambda: starting_torque(model),
        "no_load_back_driving_torque": lambda: back_driving_torque(model),
        "hysteresis_loss": lambda: hysteresis_loss(model),
        "lost_motion": lambda: lost_motion(model),
        "transmission_accuracy": lambda: accuracy_of_parts(model.sheet)[0],
    }
    return of_name[figure.name]()


@dataclass(frozen=True)
class Comparison:
    """A printed figure beside its prediction.

    Attributes
    ----------
    figure : Figure
        As printed.
    value : float
        Predicted, SI.
    low, high : float
        Where 90 % of predictions lie as estimates vary within their tolerances; for the accuracy,
        of drives; SI.

    Examples
    --------
    >>> Comparison(Figure("lost_motion", 2.9e-4, limit=True), 2e-4, 1e-4, 3e-4).holds
    True
    """

    figure: Figure
    value: float
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Whether the prediction itself is within the printed tolerance, or below the limit."""
        if self.figure.limit:
            return self.value <= self.figure.value
        return abs(self.value - self.figure.value) <= self.figure.tolerance * self.figure.value


def compared(
    page: CataloguePage, entries: Mapping[str, Entry] | None = None, draws: int = _DRAWS
) -> list[Comparison]:
    """Compare every figure of a page that is printed but not entered with the model.

    Parameters
    ----------
    page : CataloguePage
    entries : mapping of Entry, optional
        Of `complete`, by default.
    draws : int
        Sets of estimates that are drawn for the intervals.

    Returns
    -------
    list of Comparison
        In the order of the page.

    Raises
    ------
    InvalidInput
        As `drive_of`.

    Examples
    --------
    >>> results = compared(load_page(built_in_page(25)), draws=2)
    >>> [result.holds for result in results]
    [True, True, True, True, True]
    """
    entries = complete(page) if entries is None else entries
    rng = np.random.default_rng(1)
    models = [drive_of(page, entries)]
    if any(entry.estimated for entry in entries.values()):
        models += [drive_of(page, drawn) for drawn in sampled(entries, draws, rng)]
    return [_comparison(models, figure) for figure in page.printed]


def _comparison(models: Sequence[DriveModel], figure: Figure) -> Comparison:
    if figure.name == "transmission_accuracy":
        mean, std = accuracy_of_parts(models[0].sheet)
        return Comparison(figure, mean, mean - 1.64 * std, mean + 1.64 * std)
    value, *others = (predicted(model, figure) for model in models)
    low, high = np.quantile(others or [value], [0.05, 0.95], method="weibull")
    return Comparison(figure, value, float(low), float(high))
