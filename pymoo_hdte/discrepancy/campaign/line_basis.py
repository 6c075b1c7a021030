"""The least squares behind order lines: a straight line in time, waves over the angle, jumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.discrepancy.campaign.records import RunningRecord

# A numerical limit of a linear fit; the verdict does not depend on it.
LARGEST_CONDITION = 1e3
"""Largest condition number of the fit; beyond it the noise of the lines grows a thousandfold."""


@dataclass(frozen=True, eq=False)
class LineFit:
    """Least squares by QR: ``values = basis @ triangle @ coefficients + residual``.

    Attributes
    ----------
    orders : ndarray, shape (m,)
        Cycles per input turn.
    values : ndarray, shape (n, 4)
        Rows of the channels: transmission error (rad), input torque, output torque (N.m), input
        angle (rad).
    basis : ndarray, shape (n, p)
        Orthonormal; p = 2 + 2 m + number of jumps.
    triangle : ndarray, shape (p, p)
    coefficients : ndarray, shape (p, 4)
        Of 1, the time from the middle of the record, the cosines, minus the sines, and a step of
        one at each of the record's jumps: what its repair has left of them.
    """

    orders: NDArray[np.float64]
    values: NDArray[np.float64]
    basis: NDArray[np.float64]
    triangle: NDArray[np.float64]
    coefficients: NDArray[np.float64]

    @classmethod
    def of(cls, record: RunningRecord, ratio: float, orders: ArrayLike) -> LineFit:
        """Fit a record.

        Raises
        ------
        InvalidInput
            For orders out of range or closer together than the record can tell apart.
        """
        checked = finite_array("orders", orders, (None,))
        for order in checked:
            real_number("orders", float(order), above=0.0, below=nyquist_order(record))
        angle = np.outer(record.input_angle, checked)
        time = centred(record)
        steps = [record.time >= jump.time for jump in record.jumps]
        design = np.column_stack([np.ones_like(time), time, np.cos(angle), -np.sin(angle), *steps])
        scale = np.linalg.norm(design, axis=0)
        basis, triangle = np.linalg.qr(design / scale)
        if design.shape[0] <= design.shape[1] or np.linalg.cond(triangle) > LARGEST_CONDITION:
            allowed = "orders that a record of this length can tell apart"
            raise InvalidInput("orders", checked.tolist(), allowed)
        values = np.column_stack(
            [
                record.transmission_error(ratio),
                record.input_torque,
                record.output_torque,
                record.input_angle,
            ]
        )
        triangle = triangle * scale
        coefficients = np.linalg.solve(triangle, basis.T @ values)
        return cls(checked, values, basis, triangle, coefficients)

    @property
    def residual(self) -> NDArray[np.float64]:
        """What the fit leaves of the values, shape (n, 4)."""
        return np.asarray(self.values - self.basis @ (self.basis.T @ self.values))


def centred(record: RunningRecord) -> NDArray[np.float64]:
    """Return the time from the middle of a record, s, shape (n,)."""
    return np.asarray(record.time - (record.time[0] + record.time[-1]) / 2.0)


def mean_speed(record: RunningRecord) -> float:
    """Return the mean speed of the input, without its sign, rad/s."""
    travel = record.input_angle[-1] - record.input_angle[0]
    return abs(float(travel / (record.time[-1] - record.time[0])))


def nyquist_order(record: RunningRecord) -> float:
    """Return the order at half the rate of the rows, in cycles per input turn."""
    return float(np.pi * record.sample_rate / mean_speed(record))
