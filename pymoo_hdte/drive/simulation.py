"""One design driven from rest to its steady state: Eq. (9) integrated in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number
from pymoo_hdte.drive._solve.time_domain import StartUp, equations_of_motion, memories
from pymoo_hdte.drive.model import DriveModel
from pymoo_hdte.drive.parameters import PARAMETERS
from pymoo_hdte.units import ARCSEC

METHODS = ("LSODA", "DOP853", "Radau", "RK45", "BDF")


ANGLES = ("free", "prescribed")


_POINTS_PER_TURN = 120
_CLUTCH_TIMES = 20.0
"""Times of settling, after which exp(-20) remains of the slip of a clutch at the start."""


@dataclass(frozen=True)
class Run:
    """One simulated output turn in steady state, on the samples of the integrator's output.

    Attributes
    ----------
    time : ndarray, shape (n_times,)
        s, from the start at rest.
    input_angle : ndarray, shape (n_times,)
        Angle on which theta_s and the stiffness depend, rad; passes 0 where the output turn begins.
    input_speed : ndarray, shape (n_times,)
        th_in', rad/s.
    transmission_error : ndarray, shape (n_times,)
        theta_d, rad.
    ratio : float
        Transmission ratio N, dimensionless.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> run = simulate_drive(model, model.nominal)
    >>> print(f"{run.dte_arcsec():.1f} arcsec over the last turn of the output")
    87.0 arcsec over the last turn of the output
    """

    time: NDArray[np.float64]
    input_angle: NDArray[np.float64]
    input_speed: NDArray[np.float64]
    transmission_error: NDArray[np.float64]
    ratio: float

    def peak_to_peak(self) -> float:
        """Return the peak-to-peak of theta_d over 0 <= input angle <= 2 pi N, in rad."""
        curve = scipy.interpolate.CubicSpline(self.input_angle, self.transmission_error)
        end = 2.0 * np.pi * self.ratio
        turning = curve.derivative().roots(extrapolate=False)
        inside = turning[(turning > 0.0) & (turning < end)]
        values = curve(np.concatenate([[0.0], inside, [end]]))
        return float(values.max() - values.min())

    def dte_arcsec(self) -> float:
        """Return the DTE of Section 4 in arcsec."""
        return self.peak_to_peak() / ARCSEC


def simulate_drive(
    model: DriveModel,
    parameters: ArrayLike,
    *,
    angle: str = "free",
    method: str = "LSODA",
    ramp: float = 0.5,
    settle: float = 1.5,
    rtol: float = 1e-8,
) -> Run:
    """Integrate the motion, Eq. (9), of one design from rest and through one steady output turn.

    Torque-driven as in Section 2.2, from the rest of Eq. (11). The input torque rises smoothly from
    zero to the level that holds the rated speed, plus the torque that accelerates the inertias
    meanwhile; load and static error follow the same envelope. The drive starts at the negative
    input angle from which it reaches 0 after ``ramp + settle``, so that the output turn is the one
    the steady state is evaluated on.

    Parameters
    ----------
    model : DriveModel
        The model, with its effects.
    parameters : array_like, shape (5,)
        `PARAMETERS` in SI units.
    angle : {"free", "prescribed"}
        Whether theta_s and the stiffness follow the simulated input angle, as in a real drive, or
        the angle of the nominal speed, as Hill's method has it.
    method : str
        One of `METHODS`, of ``scipy.integrate.solve_ivp``.
    ramp, settle : float
        Duration of the start-up and of the settling after it, s.
    rtol : float
        Relative tolerance, dimensionless.

    Returns
    -------
    Run

    Raises
    ------
    InvalidInput
        For a wrong argument.
    ArithmeticError
        If the integrator gives up, the speed does not settle, or no mean torque holds it.

    Examples
    --------
    >>> model = preset("calibrated")
    >>> print(f"{simulate_drive(model, model.nominal).dte_arcsec():.1f} arcsec")
    87.0 arcsec
    """
    if not isinstance(model, DriveModel):
        raise InvalidInput("model", model, "a DriveModel, e.g. preset('calibrated')")
    values = finite_array("parameters", parameters, (len(PARAMETERS),))
    one_of("angle", angle, ANGLES)
    one_of("method", method, METHODS)
    real_number("ramp", ramp, above=0.0)
    real_number("settle", settle, at_least=0.0)
    real_number("rtol", rtol, at_least=1e-13, at_most=1e-2)
    coefficients = model.coefficients(values[None, :])
    start_up = StartUp(coefficients.input_speed, ramp, settle)
    turn = 2.0 * np.pi * coefficients.ratio / coefficients.input_speed
    margin = 0.01 * turn
    steps = int(np.ceil(_POINTS_PER_TURN * coefficients.ratio * 1.02))
    times = np.linspace(ramp + settle - margin, ramp + settle + turn + margin, steps)
    if times[0] < ramp:
        raise InvalidInput("settle", settle, f"at least {margin:.3g} s, the margin of the record")

    for _, late in coefficients.coupled:
        if settle < _CLUTCH_TIMES * late:
            allowed = f"at least {_CLUTCH_TIMES * late:.3g} s, {_CLUTCH_TIMES:g} times of a clutch"
            raise InvalidInput("settle", settle, allowed)
    memory = sum(law.states for law in memories(coefficients))
    clutches, twists = len(coefficients.coupled), 0 if coefficients.loaded_shaft is None else 1
    start = np.array([start_up.angle(0.0), *np.zeros(3 + memory + clutches + 2 * twists)])
    # theta_d is of the order of arcseconds and its rate of the order of arcseconds times 100 1/s.
    twist, rate = 1e-4 * ARCSEC, 1e-2 * ARCSEC
    further = [*[twist] * memory, *[rate] * clutches, *[twist, rate] * twists]
    atol = np.array([1e-8, 1e-6, twist, rate, *further]) * (rtol / 1e-8)
    solution = scipy.integrate.solve_ivp(
        equations_of_motion(coefficients, start_up, prescribed=angle == "prescribed"),
        (0.0, times[-1]),
        start,
        method=method,
        t_eval=times,
        rtol=rtol,
        atol=atol,
    )
    if not solution.success:
        reached = f"t = {solution.t[-1]:g} s" if len(solution.t) else "the start"
        raise ArithmeticError(f"{method} gave up at {reached}: {solution.message}")
    input_angle, input_speed, transmission_error = solution.y[:3]
    if angle == "prescribed":
        input_angle = np.array([start_up.angle(time) for time in times])
    end = 2.0 * np.pi * coefficients.ratio
    if not (input_angle[0] <= 0.0 and input_angle[-1] >= end):
        raise ArithmeticError(
            f"the record covers input angles {input_angle[0]:g} to {input_angle[-1]:g} rad, not "
            f"the whole output turn 0 to {end:g}: the speed has not settled"
        )
    return Run(times, input_angle, input_speed, transmission_error, coefficients.ratio)
