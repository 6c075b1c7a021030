"""The rate at which a record's force balances are formed, and its requirements on a record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import prev_fast_len

from pymoo_hdte.checks import InvalidInput, real_number
from pymoo_hdte.mechanism.mechanism import Mechanism
from pymoo_hdte.mechanism.motion import RATE_SLACK, highest_share, margin_of, stride_of
from pymoo_hdte.mechanism.records import Record

FEWEST_BINS = 8
"""Least number of coefficients of a force balance."""


def working_rows(mechanism: Mechanism, record: Record, cutoff: float) -> slice:
    """Return the rows of a record at the working rate, without the ends that smoothing distorts.

    Parameters
    ----------
    mechanism : Mechanism
    record : Record
    cutoff : float
        Hz, up to which the motion is known.

    Raises
    ------
    InvalidInput
        If the record is too short, or the cutoff beyond ten samples in a period.
    """
    real_number("cutoff", cutoff, above=0.0)
    if cutoff > RATE_SLACK * highest_share(record.step):
        least = cutoff / highest_share(1.0)
        raise InvalidInput(
            f"sampling rate of record {record.name}",
            round(1.0 / record.step, 6),
            f"at least {least:.4g} Hz, ten samples in a period of the cutoff of {cutoff:.4g} Hz; "
            f"or a cutoff of at most {highest_share(record.step):.4g} Hz",
        )
    margin = margin_of(cutoff, record.step)
    before, after = (max(margin, rows) for rows in record.context)
    stride = stride_of(highest_known(mechanism, record, cutoff), record.step)
    # Of a length without large prime factors: a transform of another one takes many times as long.
    n = prev_fast_len(max(len(range(before, len(record.time) - after, stride)), 1), real=True)
    rows = slice(before, before + (n - 1) * stride + 1, stride)
    if np.count_nonzero(frequencies(n, record.step * stride) <= cutoff) < FEWEST_BINS:
        shortest = FEWEST_BINS / (2.0 * cutoff) + (before + after) * record.step
        duration = float(record.time[-1] - record.time[0])
        raise InvalidInput(
            f"duration of record {record.name}",
            duration,
            f"at least {shortest:.3g} s, to say anything below {cutoff:.3g} Hz; or a cutoff of at "
            f"least {1.02 * cutoff * shortest / duration:.3g} Hz",
        )
    return rows


def highest_known(mechanism: Mechanism, record: Record, cutoff: float) -> float:
    """Return the frequency up to which some balance is known, Hz."""
    read = any(port.read for port in mechanism.ports)
    return highest_share(record.step) if read else cutoff


def frequencies(n: int, step: float) -> NDArray[np.float64]:
    """Return the frequencies of the coefficients of n samples, Hz."""
    return np.arange(n) / (2.0 * n * step)
