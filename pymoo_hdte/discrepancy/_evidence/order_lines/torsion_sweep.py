"""The torque of a torsion sweep as a curve over time from each turning point to the next.

The noise of the torque sensor, turned into torsion by the compliance, is eight times that of the
encoder. A sweep is steady, so the torque of a leg is a straight line, fitted to hundreds of rows,
which reduces its noise to a hundredth of a newton metre. A leg that is not steady gets a polynomial
with one coefficient per two points; this costs information, and unsteadiness below the torque noise
is not detected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.stats import chi2

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.believed import Rig
from pymoo_hdte.discrepancy._records.records import TorsionRecord

Values = NDArray[np.float64]

# Reduction of rows to points with a covariance that is passed on; these are no rules of a verdict.
ROWS_A_POINT = 24
"""Number of rows averaged into a point, or slightly more."""
FEWEST_ROWS = 2 * ROWS_A_POINT
"""Least number of rows of a leg."""
MOST_ROWS = 500 * ROWS_A_POINT
"""Rows of a sweep beyond which consecutive ones are averaged first. The covariance of the points
and the polynomials of the legs grow with the square of their number, and 500 points resolve the
bends of every law of the package."""
_REVERSAL = 8.0
"""Least reversal at a turning point, in standard deviations of the torque noise."""
_REVERSAL_SHARE = 0.05
"""Least reversal as a share of the swept range, for a sensor noisier than believed."""
_REFINEMENTS = 3
_FEW_ROWS = 8
"""Rows by which a refinement may move a turning point."""
_RARE = 1e-3
"""Probability that a steady leg is given more than a straight line."""


@dataclass(frozen=True, eq=False)
class TorsionLeg:
    """Rows between two turning points and the curve of their torque.

    Attributes
    ----------
    time, angle : ndarray, shape (n,)
        Time of the rows, s, and minus the output angle, rad.
    end : float
        Time of the turning point at the end, s.
    coefficients : ndarray, shape (k,)
        Coefficients of Chebyshev polynomials over the rows, N.m.
    covariance : ndarray, shape (k, k)
        Covariance of the coefficients.
    """

    time: Values
    angle: Values
    end: float
    coefficients: Values
    covariance: Values

    @property
    def points(self) -> int:
        """Number of points."""
        return len(self.time) // ROWS_A_POINT

    def split(self, rows: Values) -> list[Values]:
        """Return the rows of each point."""
        return np.array_split(rows, self.points)

    def basis(self, time: Values | float) -> Values:
        """Return the polynomials of which the curve is a sum, shape (n, k)."""
        return _basis(np.atleast_1d(time), self.time, len(self.coefficients) - 1)

    def torque(self, time: Values | float) -> Values:
        """Return the torque, N.m, shape (n,)."""
        return np.asarray(self.basis(time) @ self.coefficients)

    def slope(self, time: float) -> float:
        """Return the slope of the torque, N.m/s."""
        slopes = chebyshev.chebder(self.coefficients) * 2.0 / (self.time[-1] - self.time[0])
        return float(chebyshev.chebval(_share(np.array(time), self.time), slopes))

    @property
    def edges(self) -> Values:
        """Times of the beginning of every point and of the end of the last, s."""
        middles = (self.time[1:] + self.time[:-1]) / 2.0
        start, end = 2.0 * self.time[:1] - middles[:1], 2.0 * self.time[-1:] - middles[-1:]
        cuts = np.cumsum([len(rows) for rows in self.split(self.time)])[:-1]
        return np.concatenate([start, middles[cuts - 1], end])


def shortened(record: TorsionRecord, rig: Rig) -> tuple[TorsionRecord, Rig]:
    """Return a sweep of at most `MOST_ROWS` rows, and the rig with the noise of such a row.

    Each row becomes the mean of an equal number of consecutive rows; an incomplete last group is
    left out. A short sweep is returned as it is.

    Parameters
    ----------
    record : TorsionRecord
    rig : Rig
        For the noise of one row, which is taken as independent of that of the next.
    """
    count = -(-len(record.time) // MOST_ROWS)
    if count == 1:
        return record, rig
    used = len(record.time) // count * count
    means = {
        name: getattr(record, name)[:used].reshape(-1, count).mean(axis=1)
        for name in ("time", "output_angle", "output_torque")
    }
    quieter = {
        name: getattr(rig, name) / count**0.5
        for name in ("torsion_angle_noise", "output_torque_noise")
    }
    short = replace(record, sample_rate=record.sample_rate / count, **means)
    return short, replace(rig, **quieter)


def torsion_legs(record: TorsionRecord, rig: Rig) -> list[TorsionLeg]:
    """Return the legs of a sweep, separated where their curves intersect.

    Raises
    ------
    InvalidInput
        For a leg of fewer than `FEWEST_ROWS` rows.
    """
    corners = _turning_times(record, rig.output_torque_noise)
    legs = _legs_between(record, rig, corners)
    for _ in range(_REFINEMENTS):
        corners[1:-1] = [_meeting_time(leg, following) for leg, following in pairwise(legs)]
        legs = _legs_between(record, rig, corners)
    return legs


def _share(time: Values, rows: Values) -> Values:
    """Return -1 at the first row, 1 at the last."""
    return (2.0 * time - rows[0] - rows[-1]) / (rows[-1] - rows[0])


def _basis(time: Values, rows: Values, degree: int) -> Values:
    return np.asarray(chebyshev.chebvander(_share(time, rows), degree))


def _turning_times(record: TorsionRecord, noise: float) -> Values:
    """Return the times of the first row, of the extreme rows between reversals, and of the last."""
    torque = record.output_torque
    reversal = max(_REVERSAL * noise, _REVERSAL_SHARE * float(np.ptp(torque)))
    rows, rising = [0], None
    high = low = 0
    for row, value in enumerate(torque):
        high, low = (row if value > torque[high] else high), (row if value < torque[low] else low)
        if rising is not True and value - torque[low] > reversal:
            rows += [] if rising is None else [low]
            rising, high = True, row
        elif rising is not False and torque[high] - value > reversal:
            rows += [] if rising is None else [high]
            rising, low = False, row
    return record.time[[*rows, len(torque) - 1]]


def _legs_between(record: TorsionRecord, rig: Rig, corners: Values) -> list[TorsionLeg]:
    """Fit the torque of the rows that lie wholly between two turning points."""
    half = 0.5 / record.sample_rate
    legs = []
    for start, end in pairwise(corners):
        rows = (record.time - half >= start) & (record.time + half <= end)
        count = int(np.count_nonzero(rows))
        if count < FEWEST_ROWS:
            allowed = f"at least {FEWEST_ROWS} from each turning point of the torque to the next"
            raise InvalidInput("number of samples", count, allowed)
        legs.append(_fitted_leg(record, rows, float(end), rig.output_torque_noise))
    return legs


def _fitted_leg(
    record: TorsionRecord, rows: NDArray[np.bool_], end: float, noise: float
) -> TorsionLeg:
    """Fit a straight line, or a polynomial where the residual exceeds the noise."""
    time, torque = record.time[rows], record.output_torque[rows]
    flexible = max(len(time) // ROWS_A_POINT // 2, 2)
    curve = chebyshev.chebfit(_share(time, time), torque, flexible)
    line = chebyshev.chebfit(_share(time, time), torque, 1)
    apart = _basis(time, time, flexible) @ curve - _basis(time, time, 1) @ line
    steady = apart @ apart <= noise**2 * chi2.isf(_RARE, flexible - 1)
    coefficients = np.asarray(line if steady else curve, dtype=float)
    basis = _basis(time, time, len(coefficients) - 1)
    covariance = np.asarray(noise**2 * np.linalg.inv(basis.T @ basis), dtype=float)
    return TorsionLeg(time, -record.output_angle[rows], end, coefficients, covariance)


def _meeting_time(leg: TorsionLeg, following: TorsionLeg) -> float:
    """Return the time at which two curves meet, within a few rows of the present turning point."""
    closing = leg.slope(leg.end) - following.slope(leg.end)
    if closing == 0.0:
        return leg.end
    apart = float(following.torque(leg.end)[0] - leg.torque(leg.end)[0])
    most = _FEW_ROWS * float(leg.time[1] - leg.time[0])
    return leg.end + min(max(apart / closing, -most), most)
