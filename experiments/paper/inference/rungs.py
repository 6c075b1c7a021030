"""Rungs: a candidate of the calibration ladder with closures, and the DTE that it predicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from experiments.paper.calibrating.ladder import (
    EFFECTS,
    LOGARITHMIC,
    NARROW,
    WIDE,
    Candidate,
    ladder_rungs,
)
from experiments.paper.calibrating.predictions import VARIABLES
from experiments.paper.inference.closures import CLOSURES, Values
from experiments.paper.inference.peaks import peak_to_peak, shape_peak_to_peak
from pymoo_hdte.drive import PARAMETERS, DriveModel, preset
from pymoo_hdte.drive._solve.coefficients import Coefficients
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.drive._solve.stability import stable_rows
from pymoo_hdte.units import ARCSEC

PERIODIC = ("phase", "phase_2", "phase_2.02")
"""Angles: a search may leave their range, and comes back by whole turns."""
RIGID = ("torsion",)
"""Closures of the rigid drive alone, on no effect: two parameters, std(theta_s) and the share."""
COLUMNS = [PARAMETERS.index(name) for name in VARIABLES]
"""Where `VARIABLES` stand among `PARAMETERS`."""


@dataclass(frozen=True)
class Rung:
    """Effects, readings and closures; its parameters are those of both.

    The printed equations follow theta_s like a rigid drive, whatever its shape. Without effects the
    shape is therefore no parameter: it is that of the preset ``published``.
    """

    candidate: Candidate
    closures: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """All choices in one word, fit for a file name."""
        return "__".join((self.candidate.name, *self.closures))

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """The open parameters with their ranges, on the scale that is searched."""
        bounds = self.candidate.bounds
        if not self.candidate.effects:
            bounds = {name: bounds[name] for name in bounds if name not in _printed_shape()}
        for name in self.closures:
            bounds |= CLOSURES[name].bounds
        return bounds

    @property
    def limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper ends of `bounds`."""
        low, high = np.array(list(self.bounds.values())).T
        return low, high

    def physical(self, searched: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
        """Turn a point of the search space into named parameters; angles within one turn."""
        return {
            name: _physical(name, float(value))
            for name, value in zip(self.bounds, searched, strict=True)
        }

    def searched(self, parameters: dict[str, float]) -> NDArray[np.float64]:
        """Turn named parameters into a point of the search space."""
        return np.array(
            [np.log(parameters[n]) if n in LOGARITHMIC else parameters[n] for n in self.bounds]
        )

    def model(self, parameters: dict[str, float]) -> DriveModel:
        """Return the drive model, without closures."""
        return self.candidate.model(_printed_shape() | parameters)


def _physical(name: str, value: float) -> float:
    if name in LOGARITHMIC:
        return float(np.exp(value))
    return value % (2.0 * np.pi) if name in PERIODIC else value


def all_rungs() -> list[Rung]:
    """Return the ladder; each closure on all its effects; and torsion and all closures on none.

    Torsion on none is the simplest model: a rigid drive, and a share of its torsion read as error.
    With closures theta_s is read as semi-amplitude: read as peak-to-peak, the ladder is far off.
    """
    rungs = [Rung(candidate) for candidate in ladder_rungs()]
    every = tuple(CLOSURES)
    for bands in (WIDE, NARROW):
        full, printed = (Candidate(effects, "semi_amplitude", bands) for effects in (EFFECTS, ()))
        rungs += [Rung(full, (name,)) for name in CLOSURES]
        rungs += [Rung(printed, RIGID), Rung(printed, every), Rung(full, every)]
    return rungs


def noisy_rungs() -> list[Rung]:
    """Return the rungs that are fitted with node noise as well: those of theta_s as semi-amplitude.

    Single closures on all effects are left out: all effects meet the numbers without them.
    """
    return [
        rung
        for rung in all_rungs()
        if rung.candidate.reading == "semi_amplitude"
        and (not rung.candidate.effects or len(rung.closures) != 1)
    ]


def rung_named(name: str) -> Rung:
    """Return the rung of that name."""
    candidate, *closures = name.split("__")
    (matching,) = (rung for rung in ladder_rungs() if rung.name == candidate)
    return Rung(matching, tuple(closures))


def dte_arcsec(
    rung: Rung, parameters: dict[str, float], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the DTE at values of (theta_s, K, J_in, B_fc), shape (n, 4), in arcsec; (n,).

    Stability is not asked for, since it takes longer: see `is_stable`.
    """
    model, values = rung.model(parameters), _values(rung, parameters, points)
    design = np.column_stack([values.stiffness, values.input_inertia, values.damping])
    unique, rows = np.unique(design, axis=0, return_inverse=True)
    spans = peak_to_peak(_coefficients(model, unique), values.theta_s, rows.ravel())
    return (spans + values.added) / ARCSEC


def is_stable(
    rung: Rung, parameters: dict[str, float], points: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return whether the motion at points (n, 4) does not grow, shape (n,)."""
    values = _values(rung, parameters, points)
    design = np.column_stack([values.stiffness, values.input_inertia, values.damping])
    return stable_rows(_coefficients(rung.model(parameters), design))


def _values(rung: Rung, parameters: dict[str, float], points: NDArray[np.float64]) -> Values:
    """Return what enters Eq. (9) at points (n, 4), after all closures."""
    theta_s, stiffness, inertia, damping = points.T
    values = Values(theta_s, stiffness, inertia, damping, np.zeros(len(points)))
    model = rung.model(parameters)
    for name in rung.closures:
        values = CLOSURES[name].apply(values, model, parameters)
    return values


def _coefficients(model: DriveModel, design: NDArray[np.float64]) -> Coefficients:
    """Return Eq. (9) for theta_s of 1 rad at n values of (K, J_in, B_fc), shape (n, 3).

    As `DriveModel.coefficients`, which would take longer to scale the lines than all that follows.
    """
    designs = np.tile(model.nominal, (len(design), 1))
    designs[:, COLUMNS[1:]] = design
    coefficients = _printed().coefficients(designs)
    for effect in model.effects:
        coefficients = effect.apply(coefficients)
    error = model.kinematic_error
    orders = np.array(error.orders)
    lines = sine_phasor(error.amplitudes, error.phases)
    size = {"peak_to_peak": 1.0, "semi_amplitude": 2.0}[error.reading]
    phasors = lines * size / shape_peak_to_peak(orders, lines)
    return replace(
        coefficients, error_orders=orders, error_phasors=np.tile(phasors, (len(design), 1))
    )


@cache
def _printed() -> DriveModel:
    return preset("published")


@cache
def _printed_shape() -> dict[str, float]:
    """Return the shape of theta_s in ``published``, by the names of the ladder's parameters."""
    error = _printed().kinematic_error
    amplitudes, second, beat = error.amplitudes
    return {
        "amplitude_1": amplitudes / second,
        "amplitude_2.02": beat / second,
        "phase_2": error.phases[1] - error.phases[0],
        "phase_2.02": error.phases[2] - error.phases[0],
    }
