"""Identification of a series from bench records: stiffness, damping, errors of the components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import CataloguePage, complete
from pymoo_hdte.identification import (
    ErrorStatistics,
    LinearFit,
    NoLoadRun,
    NormalSample,
    Series,
    TorsionLoop,
    bearing_damping,
    error_statistics,
    hysteresis_width,
    mesh_damping,
    read_error_measurements,
    read_no_load_runs,
    read_torsion_loops,
    series,
    stiffness,
    stiffness_between,
)
from pymoo_hdte.identification.prototypes import RunKey

LOOPS, BEARING, COMPLETE, OUTPUT, ERRORS = FILES = (
    "torsion_loops.csv",
    "no_load_bearing.csv",
    "no_load_complete.csv",
    "no_load_output.csv",
    "errors.csv",
)


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter, identified from every run of every prototype.

    Attributes
    ----------
    name : str
        One of `NOMINAL_FIELDS`; all values are in its `unit_of`.
    fits : mapping of (prototype, repeat) to LinearFit
    """

    name: str
    fits: Mapping[RunKey, LinearFit]

    @property
    def series(self) -> Series | None:
        """Statistics over the prototypes; None for a single one."""
        if len({prototype for prototype, _ in self.fits}) < 2:
            return None
        return series({key: fit.slope for key, fit in self.fits.items()})

    @property
    def value(self) -> float:
        """Mean over the prototypes of the means of their repeats."""
        series = self.series
        return series.between.mean if series else float(np.mean(self._slopes))

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of `value`: over prototypes, else repeats, else the fitted line."""
        if series := self.series:
            return series.between.mean_interval()
        if len(self.fits) > 1:
            return NormalSample.of(self._slopes).mean_interval()
        return next(iter(self.fits.values())).slope_interval()

    @property
    def _slopes(self) -> list[float]:
        return [fit.slope for fit in self.fits.values()]


@dataclass(frozen=True, eq=False)
class Identification:
    """The identified parameters, loops and errors of a folder.

    Attributes
    ----------
    folder : str
    parameters : tuple of Parameter
    loops : mapping of (prototype, repeat) to TorsionLoop
    errors : ErrorStatistics or None
        Errors of components in micrometres.
    complete : mapping of (prototype, repeat) to NoLoadRun
        Of the whole drive.
    """

    folder: str
    parameters: tuple[Parameter, ...]
    loops: Mapping[RunKey, TorsionLoop]
    errors: ErrorStatistics | None
    complete: Mapping[RunKey, NoLoadRun]


class MeasuredFigure(NamedTuple):
    """A figure of a catalogue page, as records have it.

    Attributes
    ----------
    value : float
        Mean over the prototypes of the means of their repeats, SI.
    prototypes : int
        How many there are.
    scatter : float
        Standard deviation over them, SI; NaN for one.
    """

    value: float
    prototypes: int
    scatter: float


def measured_figures(
    identification: Identification, page: CataloguePage
) -> dict[str, MeasuredFigure]:
    """Return the figures of a catalogue page that the records hold.

    K1 to K3 are the slopes between 0, T1, T2 and the peak of the loops, with T1 and T2 of the page;
    starting and running torque are the line through the no-load torque of the whole drive, at rest
    and at the rated speed.

    Parameters
    ----------
    identification : Identification
    page : CataloguePage

    Returns
    -------
    dict of MeasuredFigure
        By name; a loop that ends below T2 says nothing of K3.
    """
    entries = complete(page)
    first, second, rated = (entries[name].value for name in ("T1", "T2", "rated_speed"))
    ranges = {"K1": (0.0, first), "K2": (first, second), "K3": (second, np.inf)}
    values: dict[str, dict[RunKey, float]] = {}
    for key, loop in identification.loops.items():
        peak = float(np.abs(loop.torque).max())
        for name, (low, high) in ranges.items():
            if peak > 1.2 * low:
                values.setdefault(name, {})[key] = stiffness_between(loop, low, high).slope
        if peak > 0.9 * entries["rated_torque"].value:
            values.setdefault("hysteresis_loss", {})[key] = hysteresis_width(loop)
    for key, run in identification.complete.items():
        line = bearing_damping(run)
        values.setdefault("no_load_starting_torque", {})[key] = line.intercept
        running = line.intercept + line.slope * rated
        values.setdefault("no_load_running_torque", {})[key] = running
    return {name: _over_prototypes(runs) for name, runs in values.items()}


def _over_prototypes(runs: Mapping[RunKey, float]) -> MeasuredFigure:
    if len({prototype for prototype, _ in runs}) < 2:
        return MeasuredFigure(float(np.mean(list(runs.values()))), 1, np.nan)
    between = series(runs).between
    return MeasuredFigure(between.mean, between.n, between.std)


def identify_drive(folder: Path) -> Identification:
    """Read the `FILES` that are there and identify what they hold.

    Raises
    ------
    InvalidInput
        If none is there, the whole drive was run without its bearing, or a record is at fault.
    OSError
        If the folder or a file cannot be read.
    """
    present = {path.name for path in folder.iterdir()} & set(FILES)
    if not present:
        raise InvalidInput("records", str(folder), f"a folder with one of {', '.join(FILES)}")
    if COMPLETE in present and BEARING not in present:
        allowed = f"also {BEARING}, whose torque is taken off"
        raise InvalidInput("records", COMPLETE, allowed)
    loops = read_torsion_loops(folder / LOOPS) if LOOPS in present else {}
    runs = {
        name: read_no_load_runs(folder / name)
        for name in (BEARING, COMPLETE, OUTPUT)
        if name in present
    }
    fits: dict[str, dict[RunKey, LinearFit]] = {
        "K": {key: stiffness(loop) for key, loop in loops.items()},
        "B_in": {key: bearing_damping(run) for key, run in runs.get(BEARING, {}).items()},
        "B_fc": {
            key: mesh_damping(_same(runs[BEARING], key), run)
            for key, run in runs.get(COMPLETE, {}).items()
        },
        "B_out": {key: bearing_damping(run) for key, run in runs.get(OUTPUT, {}).items()},
    }
    return Identification(
        folder=folder.resolve().name or str(folder),
        parameters=tuple(Parameter(name, runs) for name, runs in fits.items() if runs),
        loops=loops,
        complete=runs.get(COMPLETE, {}),
        errors=error_statistics(*read_error_measurements(folder / ERRORS))
        if ERRORS in present
        else None,
    )


def _same(runs: Mapping[RunKey, NoLoadRun], key: RunKey) -> NoLoadRun:
    if key not in runs:
        allowed = f"only runs that stand in {BEARING} too"
        raise InvalidInput(f"{COMPLETE}: (prototype, repeat)", key, allowed)
    return runs[key]
