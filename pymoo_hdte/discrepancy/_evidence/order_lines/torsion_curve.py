"""The torsion sweep of a campaign as a few points with their covariance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from pymoo_hdte.discrepancy._evidence.order_lines.torsion_sweep import (
    TorsionLeg,
    shortened,
    torsion_legs,
)
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.records import TorsionRecord

Values = NDArray[np.float64]

_CLEAR = 4.0
"""Least step from row to row that counts as a jump, as in a clearance, in standard deviations."""


@dataclass(frozen=True, eq=False)
class TorsionPoints:
    """Means of consecutive rows of a torsion sweep, in the order of the path.

    A model of them is `pymoo_hdte.drive.mean_torsion` of ``path`` at ``intervals``. Gain and zero
    error of the torque sensor are not in the covariance: they are common to all points and
    therefore parameters; the true path is (path - zero) / (1 + gain).

    Attributes
    ----------
    torque : ndarray, shape (b,)
        Mean output torque of each point, N.m.
    angle : ndarray, shape (b,)
        Mean of minus the output angle, rad: the torsion plus an unknown constant.
    covariance : ndarray, shape (b, b)
        Covariance of ``angle`` at given ``torque``, rad2: white noise of the encoder, and the
        residual torque noise, which is common to the points of a leg.
    path : ndarray, shape (m,)
        Torques at the turning points and at the beginnings and ends of the points, N.m.
    intervals : ndarray of int, shape (b,)
        Point i is the mean between ``path[intervals[i]]`` and the next.
    """

    torque: Values
    angle: Values
    covariance: Values
    path: Values
    intervals: NDArray[np.intp]

    @property
    def deviation(self) -> Values:
        """Standard deviation of each angle, rad, shape (b,)."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def whitening(self) -> Values:
        """Matrix (b - 1, b) that removes the angles' constant and gives them unit covariance."""
        white = np.linalg.inv(np.linalg.cholesky(self.covariance))
        constant = white.sum(axis=1, keepdims=True)
        basis = np.linalg.qr(constant, mode="complete")[0]
        return np.asarray(basis[:, 1:].T @ white)


def torsion_points(record: TorsionRecord, rig: Rig) -> TorsionPoints:
    """Reduce a sweep to points, each the mean of about `torsion_sweep.ROWS_A_POINT` rows.

    In a sweep of more than `torsion_sweep.MOST_ROWS` rows, consecutive rows are averaged first.

    Parameters
    ----------
    record : TorsionRecord
        Swept up and down with any number of turning points.
    rig : Rig
        For the noise of one row.

    Returns
    -------
    TorsionPoints

    Raises
    ------
    InvalidInput
        For too few rows between two turning points.
    """
    record, rig = shortened(record, rig)
    legs = torsion_legs(record, rig)
    paths = [leg.torque(np.append(leg.edges, leg.end)) for leg in legs]
    starts = np.cumsum([0, *(len(path) for path in paths)])
    intervals = [start + np.arange(leg.points) for start, leg in zip(starts, legs, strict=False)]
    return TorsionPoints(
        torque=np.concatenate([_means(leg) @ leg.coefficients for leg in legs]),
        angle=np.concatenate([[rows.mean() for rows in leg.split(leg.angle)] for leg in legs]),
        covariance=_covariance(legs, rig),
        path=np.concatenate(paths),
        intervals=np.concatenate(intervals),
    )


def _means(leg: TorsionLeg) -> Values:
    """Return the matrix that maps the coefficients of the leg to the mean torques of the points."""
    return np.array([rows.mean(axis=0) for rows in leg.split(leg.basis(leg.time))])


def _covariance(legs: list[TorsionLeg], rig: Rig) -> Values:
    """Return the covariance of the angles, given the torques of all legs."""
    local = [_compliance(leg, rig) for leg in legs]
    usual = float(np.median(np.concatenate(local)))
    by_leg = [slopes[:, None] * _means(leg) for slopes, leg in zip(local, legs, strict=True)]
    influence = block_diag(*by_leg)
    rows, columns = (np.cumsum([0, *(part.shape[i] for part in by_leg)]) for i in (0, 1))
    # An angle that does not follow the load, as before breakaway, depends on the last turning
    # point.
    for i in range(1, len(legs)):
        hanging = np.maximum(usual - local[i], 0.0)
        at_turn = np.outer(hanging, _turning_torque(legs[i - 1], legs[i]))
        influence[rows[i] : rows[i + 1], columns[i - 1] : columns[i + 1]] += at_turn
    torques = block_diag(*(leg.covariance for leg in legs))
    white = np.concatenate([_white_variance(leg, rig) for leg in legs])
    return np.asarray(np.diag(white) + influence @ torques @ influence.T)


def _compliance(leg: TorsionLeg, rig: Rig) -> Values:
    """Return the slope of angle over torque at each point, rad/(N.m); 0 at constant load."""
    slopes = []
    for load, angle in zip(leg.split(leg.torque(leg.time)), leg.split(leg.angle), strict=True):
        least = rig.output_torque_noise**2 / len(load)
        slopes.append(np.mean((load - load.mean()) * angle) / (load.var() + least))
    return np.array(slopes)


def _turning_torque(leg: TorsionLeg, following: TorsionLeg) -> Values:
    """Return the derivatives, by the coefficients of both legs, of the torque where they meet."""
    before, after = leg.slope(leg.end), following.slope(leg.end)
    # Where two lines cross, the steeper one determines the torque less; equal weights at rest.
    share = np.clip(before / (before - after), 0.0, 1.0) if before != after else 0.5
    sides = [(1.0 - share) * leg.basis(leg.end)[0], share * following.basis(leg.end)[0]]
    return np.concatenate(sides)


def _white_variance(leg: TorsionLeg, rig: Rig) -> Values:
    """Return the variance of the angles from encoder noise, and from a jump between two rows."""
    rows = leg.split(leg.angle)
    count = np.array([len(part) for part in rows])
    rises = [np.abs(np.diff(part)) for part in rows]
    noise = _CLEAR * 2.0**0.5 * rig.torsion_angle_noise
    jump = np.array([max(rise.max() - np.median(rise) - noise, 0.0) for rise in rises])
    # The instant of a jump is known to within a row: a uniform error, hence the 12.
    return np.asarray(rig.torsion_angle_noise**2 / count + (jump / count) ** 2 / 12.0)
