"""The ladder of candidate drive models: which effects, and which readings of the paper.

A candidate leaves some numbers open, its parameters, which `fitting` fits to published statistics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.drive import (
    DampingReference,
    DataSheet,
    DriveEffect,
    DriveModel,
    KinematicError,
    LoadInertia,
    MeshStiffnessVariation,
    hs_20_100,
)
from pymoo_hdte.units import ARCSEC

EFFECTS = (LoadInertia.name, DampingReference.name, MeshStiffnessVariation.name)
READINGS = {"peak_to_peak": "p2p", "semi_amplitude": "semi"}
WIDE, NARROW = "R2", "R1"
"""Readings of the bands. R1: every Monte Carlo at +-5 %, the surrogate's box +-35 % in all five
parameters. R2: the initial design at +-35 %, the optima at +-5 %, theta_s over mean +- 3 std."""

_SHAPE = {
    # Ratios of order amplitudes: the central 98 % of 20,000 virtual prototypes of Table 2.
    "amplitude_1": (0.13, 11.0),
    "amplitude_2.02": (0.065, 6.5),
    "phase_2": (0.0, 2.0 * np.pi),
    "phase_2.02": (0.0, 2.0 * np.pi),
    # From where 3 std hold the +-35 % box of reading R1, to where theta_s stays positive.
    "std_arcsec": (4.25, 12.0),
}
LOGARITHMIC = ("amplitude_1", "amplitude_2.02", "load_inertia", "damping_factor")
"""Searched as logarithms."""
_OF_EFFECT = {
    LoadInertia.name: {"load_inertia": (1e-3, 3.0)},
    DampingReference.name: {"damping_factor": (0.01, 30.0)},
    MeshStiffnessVariation.name: {"depth": (0.0, 0.15), "phase": (0.0, 2.0 * np.pi)},
}


_NAMES = (
    "load_inertia", "damping_factor", "depth", "phase", "amplitude_1", "amplitude_2.02",
    "phase_2", "phase_2.02", "std_arcsec",
)  # fmt: skip
KNOWN = tuple(
    dict(zip(_NAMES, values, strict=True))
    for values in (
        (0.047, 0.01, 0.019, 2.59, 0.13, 0.73, 4.20, 0.74, 5.8),
        (0.395, 2.8, 0.041, 4.14, 2.42, 0.065, 1.80, 0.0, 8.9),
        (0.545, 3.2, 0.015, 4.44, 0.78, 1.29, 2.99, 0.62, 7.1),
        (0.001, 8.7, 0.055, 3.95, 2.50, 1.26, 0.81, 3.52, 9.1),
        (0.0086, 9.8, 0.055, 3.95, 2.50, 1.26, 0.81, 3.52, 9.1),
        (0.461, 4.153, 0.02615, 3.862, 0.9039, 0.6285, 4.222, 1.514, 7.033),
        (0.453, 3.727, 0.05751, 4.651, 2.053, 0.0745, 2.739, 0.0, 9.416),
    )
)
"""Basins that earlier, shorter searches ended in; every fit also starts from them."""


@dataclass(frozen=True)
class Candidate:
    """One rung: the effects beside Eq. (9), what theta_s measures, and how the bands are read."""

    effects: tuple[str, ...]
    reading: str
    bands: str

    @property
    def name(self) -> str:
        """All choices in one word, fit for a file name."""
        effects = "+".join(self.effects) or "nothing"
        return f"{effects}_{READINGS[self.reading]}_{self.bands}"

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """The open parameters with their ranges, on the scale that is searched."""
        bounds = dict(_SHAPE)
        for effect in self.effects:
            bounds |= _OF_EFFECT[effect]
        return {
            name: (float(np.log(low)), float(np.log(high))) if name in LOGARITHMIC else (low, high)
            for name, (low, high) in bounds.items()
        }

    def physical(self, searched: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
        """Turn a point of the search space into named parameters."""
        return {
            name: float(np.exp(value)) if name in LOGARITHMIC else float(value)
            for name, value in zip(self.bounds, searched, strict=True)
        }

    def searched(self, parameters: dict[str, float]) -> NDArray[np.float64]:
        """Turn named parameters into a point of the search space."""
        return np.array(
            [np.log(parameters[n]) if n in LOGARITHMIC else parameters[n] for n in self.bounds]
        )

    def known(self) -> NDArray[np.float64]:
        """Return the `KNOWN` basins as points of the search space, shape (n, n_parameters)."""
        low, high = np.array(list(self.bounds.values())).T
        return np.clip([self.searched(parameters) for parameters in KNOWN], low, high)

    def model(self, parameters: dict[str, float]) -> DriveModel:
        """Return the drive model with these parameters."""
        error = KinematicError(
            orders=(1.0, 2.0, 2.02),
            amplitudes=(parameters["amplitude_1"], 1.0, parameters["amplitude_2.02"]),
            phases=(0.0, parameters["phase_2"], parameters["phase_2.02"]),
            reading=self.reading,
            std=parameters["std_arcsec"] * ARCSEC,
        )
        return DriveModel(
            name=self.name,
            description=f"Candidate {self.name} of the calibration.",
            provenance="Fitted by experiments calibration.",
            sheet=_sheet(),
            kinematic_error=error,
            effects=tuple(_effect(name, parameters) for name in self.effects),
        )


@cache
def _sheet() -> DataSheet:
    # A fit makes thousands of models, and reading the file takes as long as a steady state.
    return hs_20_100()


def _effect(name: str, parameters: dict[str, float]) -> DriveEffect:
    if name == LoadInertia.name:
        return LoadInertia(parameters["load_inertia"])
    if name == DampingReference.name:
        return DampingReference(parameters["damping_factor"])
    return MeshStiffnessVariation(parameters["depth"], parameters["phase"])


def ladder_rungs() -> list[Candidate]:
    """Return all candidates, from no effect to all three, under every pair of readings."""
    subsets = [subset for size in range(len(EFFECTS) + 1) for subset in combinations(EFFECTS, size)]
    return [Candidate(*rung) for rung in product(subsets, READINGS, (WIDE, NARROW))]
