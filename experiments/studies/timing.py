"""Ratios of times that are measured in one run, and the table of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._runner.result import Column, Finding, Table
from pymoo_hdte.drive import DriveModel, simulate_drive


@dataclass(frozen=True)
class Ratio:
    """One measured ratio of two times, with what it should reach and whether it does."""

    what: str
    slow: str
    slow_seconds: float
    fast: str
    fast_seconds: float
    target: str
    reached: bool

    @property
    def value(self) -> float:
        """Slow over fast."""
        return self.slow_seconds / self.fast_seconds


def best_time(function: Callable[[], object], repeats: int) -> float:
    """Return the least wall time in seconds of several calls."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return min(times)


def integration_time(model: DriveModel, designs: NDArray[np.float64], method: str) -> float:
    """Return the wall time in seconds of integrating designs, shape (n, 5), one after the other."""
    begin = time.perf_counter()
    for design in designs:
        simulate_drive(model, design, method=method)
    return time.perf_counter() - begin


def ratio_table(ratios: Sequence[Ratio]) -> Table:
    """Return all ratios, with a finding for each that has a target."""
    rows = tuple(
        (r.what, r.slow, 1e3 * r.slow_seconds, r.fast, 1e3 * r.fast_seconds, r.value, r.target)
        for r in ratios
    )
    findings = tuple(
        Finding(r.reached, f"{r.what}: {r.slow} over {r.fast} is {r.value:.3g}; {r.target}.", True)
        for r in ratios
        if r.target
    )
    columns = (
        Column("what"),
        Column("slow side"),
        Column("time", "ms", 3, "slow side"),
        Column("fast side"),
        Column("time", "ms", 3, "fast side"),
        Column("ratio", "", 3),
        Column("wanted"),
    )
    title = "Ratios of times"
    return Table("ratios", title, columns, rows, findings=findings, wall_times=True)
