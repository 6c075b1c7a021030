"""Steady state and peak-to-peak of the drive at many points at once, compiled.

The equations are those of `pymoo_hdte.drive._solve.hill`, solved family by family as tridiagonal
systems; a test holds them against `DriveModel.dte_arcsec`. A search needs some hundred million of
these values, and is done in minutes instead of hours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._compilation import compiled
from pymoo_hdte.drive._solve.coefficients import Coefficients

POINTS = 96
"""Grid points in an input turn; a parabola through three of them misses a peak of an order o by
some (2 pi o / POINTS)^4 / 128 of its amplitude: 2e-6 of order 2, 4e-5 of order 4."""
TURNS = 50
"""Input turns after which order 2.02 repeats; the output turn of 101 holds them all."""
NEAR = 3
"""Turns on both sides of the crest at a grid point that may hold the peak beside it: the crest
moves by less than two turns to the next grid point."""
_COSINE = np.cos(2.0 * np.pi * np.arange(TURNS) / TURNS)
_SINE = np.sin(2.0 * np.pi * np.arange(TURNS) / TURNS)
REACH = 4
"""Orders kept beyond the excited ones; each falls by depth / 2 or more, to 1e-5 at 0.15."""

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def peak_to_peak(
    coefficients: Coefficients, theta_s: Real, rows: NDArray[np.int_]
) -> NDArray[np.float64]:
    """Return the peak-to-peak of theta_d over an output turn at n points, rad, shape (n,).

    Parameters
    ----------
    coefficients : Coefficients
        Of m designs, with error lines of whole orders or 0.02 above, for theta_s of 1 rad.
    theta_s : ndarray, shape (n,)
        rad.
    rows : ndarray of int, shape (n,)
        The design of each point.
    """
    grids = _grids(coefficients)
    return np.asarray(_spans(*grids, theta_s, rows))


def shape_peak_to_peak(orders: Real, phasors: Complex) -> float:
    """Return the peak-to-peak of lines (n,), whole orders or 0.02 above, over an output turn."""
    steady, in_phase, quadrature = _waves(orders, phasors[None, :])
    bend = np.abs(phasors) @ orders**2 * (2.0 * np.pi / POINTS) ** 2 / 8.0
    nothing = np.zeros_like(steady)
    unit = np.ones(1)
    return float(
        _spans(steady, in_phase, quadrature, np.array([bend]), nothing, np.zeros(1), unit,
               np.zeros(1, dtype=np.int_))[0]
    )  # fmt: skip


def _grids(drive: Coefficients) -> tuple[Real, Real, Real, Real, Real, Real]:
    """Return waves of the response to theta_s = 1 rad (three), its rise, and those of the load."""
    steady = in_phase = quadrature = rise = np.zeros(1)
    loaded, loaded_rise = np.zeros((len(drive.stiffness), POINTS)), np.zeros(len(drive.stiffness))
    steps = 2.0 * np.pi / POINTS
    whole: list[tuple[Real, Complex]] = []
    orders = drive.error_orders
    # One layout for all, since another would be compiled anew.
    columns = [
        np.ascontiguousarray(np.broadcast_to(values, drive.stiffness.shape), dtype=float)
        for values in (
            drive.stiffness, drive.damping,
            drive.input_inertia * drive.ratio**2, drive.input_damping * drive.ratio**2,
            drive.output_inertia, drive.output_damping, drive.mean_mesh_torque,
        )
    ]  # fmt: skip
    for start in (0.0, 1.0, 0.02):
        lines = np.flatnonzero(np.abs((orders - start) % 2.0) < 1e-6)
        highest = int(np.rint((orders[lines] - start).max() / 2.0)) if len(lines) else 0
        kept = start + 2.0 * np.arange(-REACH, highest + REACH + 1, dtype=np.float64)
        static = np.zeros((len(drive.stiffness), len(kept)), dtype=np.complex128)
        for line in lines:
            at = int(np.rint((orders[line] - start) / 2.0)) + REACH
            static[:, at] += drive.error_phasors[:, line]
        answer, load = _family(
            kept * drive.input_speed, static,
            drive.stiffness_depth / 2.0 * np.exp(1j * drive.stiffness_phase), *columns,
        )  # fmt: skip
        rise = rise + np.abs(answer) @ (kept * steps) ** 2 / 8.0
        if start == 0.02:
            _, in_phase, quadrature = _waves(kept, answer)
            continue
        whole.append((kept, answer))
        if start == 0.0:
            loaded = _waves(kept, load)[0]
            loaded_rise = np.abs(load) @ (kept * steps) ** 2 / 8.0
    steady = sum(_waves(order, answer)[0] for order, answer in whole)  # type: ignore[assignment]
    return steady, in_phase, quadrature, rise, loaded, loaded_rise


def _waves(orders: Real, phasors: Complex) -> tuple[Real, Real, Real]:
    """Return whole orders, and cosine and sine parts of the others, on the grid, (m, POINTS).

    The mean, order 0, has no part in a peak-to-peak and is left out.
    """
    moving = orders != 0.0
    argument = np.outer(orders[moving], 2.0 * np.pi * np.arange(POINTS) / POINTS)
    cosine, sine = np.cos(argument), np.sin(argument)
    real, imaginary = phasors.real[:, moving].copy(), phasors.imag[:, moving].copy()
    whole = orders[moving] == np.round(orders[moving])
    a, b = real[:, whole], imaginary[:, whole]
    steady = a @ cosine[whole] - b @ sine[whole]
    a, b = real[:, ~whole], imaginary[:, ~whole]
    in_phase = a @ cosine[~whole] - b @ sine[~whole]
    return steady, in_phase, a @ sine[~whole] + b @ cosine[~whole]


@compiled
def _family(
    frequency: Real,
    static: Complex,
    coupling: complex,
    stiffness: Real,
    damping: Real,
    input_inertia: Real,
    input_damping: Real,
    output_inertia: Real,
    output_damping: Real,
    torque: Real,
) -> tuple[Complex, Complex]:
    """Return theta_d of one family for theta_s = 1 rad, and for the mean torque, (m, orders).

    Thomas' elimination of the tridiagonal system of `hill`, with two right-hand sides.
    """
    n, size = static.shape
    answer = np.empty((n, size), dtype=np.complex128)
    load = np.empty((n, size), dtype=np.complex128)
    above = np.empty(size, dtype=np.complex128)
    for row in range(n):
        for m in range(size):
            w = frequency[m]
            impedance = 0.0 + 0.0j
            if w != 0.0:
                ahead = 1j * w * (input_damping[row] + 1j * w * input_inertia[row])
                behind = 1j * w * (output_damping[row] + 1j * w * output_inertia[row])
                impedance = ahead * behind / (ahead + behind)
            pivot = impedance + stiffness[row] + 1j * w * damping[row]
            scaled = -impedance * static[row, m]
            second = torque[row] + 0.0j if w == 0.0 else 0.0j
            if m > 0:
                below = stiffness[row] * coupling
                pivot -= below * above[m - 1]
                scaled -= below * answer[row, m - 1]
                second -= below * load[row, m - 1]
            above[m] = stiffness[row] * np.conj(coupling) / pivot
            answer[row, m] = scaled / pivot
            load[row, m] = second / pivot
        for m in range(size - 2, -1, -1):
            answer[row, m] -= above[m] * answer[row, m + 1]
            load[row, m] -= above[m] * load[row, m + 1]
        answer[row] += static[row]
    return answer, load


@compiled
def _spans(
    steady: Real,
    in_phase: Real,
    quadrature: Real,
    rise: Real,
    loaded: Real,
    loaded_rise: Real,
    theta_s: Real,
    rows: NDArray[np.int_],
) -> Real:
    """Return highest less lowest of the scaled waves with those of the load, shape (n,)."""
    result = np.empty(len(theta_s))
    for n in range(len(theta_s)):
        row, size = rows[n], theta_s[n]
        wave = size * steady[row] + loaded[row]
        cosine_part, sine_part = size * in_phase[row], size * quadrature[row]
        allowed = size * rise[row] + loaded_rise[row]
        top = _highest(wave, cosine_part, sine_part, allowed)
        result[n] = top + _highest(-wave, -cosine_part, -sine_part, allowed)
    return result


@compiled
def _highest(steady: Real, in_phase: Real, quadrature: Real, rise: float) -> float:
    """Return the greatest value of steady + cos(turn) in_phase - sin(turn) quadrature.

    Every grid point that could lie beside the highest peak is followed in the turns in which the
    other lines are near their crest there; a parabola through it and its neighbours gives the peak.
    """
    points = len(steady)
    envelope = steady + np.sqrt(in_phase**2 + quadrature**2)
    at = int(np.argmax(envelope))
    best = -np.inf
    crest = _crest(in_phase[at], quadrature[at])
    for turn in range(crest - 1, crest + 2):
        best = max(best, _at(steady, in_phase, quadrature, at, turn))
    reached = best
    for point in range(points):
        if envelope[point] < best - rise:
            continue
        crest = _crest(in_phase[point], quadrature[point])
        for turn in range(crest - NEAR, crest + NEAR + 1):
            here = _at(steady, in_phase, quadrature, point, turn)
            if here < best - rise:
                continue
            before = _at(steady, in_phase, quadrature, point - 1, turn)
            after = _at(steady, in_phase, quadrature, point + 1, turn)
            height = here
            if here >= before and here >= after and 2.0 * here > before + after:
                height = here + (after - before) ** 2 / (8.0 * (2.0 * here - before - after))
            reached = max(reached, height)
    return reached


@compiled
def _crest(in_phase: float, quadrature: float) -> int:
    """Return the turn nearest to the crest of cos(turn) in_phase - sin(turn) quadrature."""
    return int(np.rint(np.arctan2(-quadrature, in_phase) / (2.0 * np.pi) * TURNS))


@compiled
def _at(steady: Real, in_phase: Real, quadrature: Real, point: int, turn: int) -> float:
    """Return the value at a grid point that may lie one before or after the turn."""
    within = (turn + point // len(steady)) % TURNS
    place = point % len(steady)
    return steady[place] + _COSINE[within] * in_phase[place] - _SINE[within] * quadrature[place]
