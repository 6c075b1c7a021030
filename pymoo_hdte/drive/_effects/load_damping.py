"""Damping of the torsion that grows with the load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from pymoo_hdte.checks import real_number
from pymoo_hdte.drive._effects.base import DriveSizes
from pymoo_hdte.effects.effect import Effect, register
from pymoo_hdte.effects.guess import Guess
from pymoo_hdte.effects.law import Aperiodic, Law, PortState, Response
from pymoo_hdte.effects.portable import Formula, Lumped
from pymoo_hdte.effects.unknowns import unknown


@dataclass(frozen=True)
class LoadDamping(Aperiodic):
    """T = damping (``|load|`` / reference) speed, beside the damping of the port itself.

    Flanks that are pressed together more firmly lose more as they slide. The load is that of
    `PortState`, which at the mesh of a drive is the torque beyond all inertias.

    Attributes
    ----------
    damping : float
        Under the reference load, N.m.s/rad (or N.s/m).
    reference : float
        Load, N.m (or N), above 0; in a verdict the largest of the records.
    """

    loaded: ClassVar[bool] = True
    damping: float
    reference: float

    def __post_init__(self) -> None:
        real_number("load_dependent_damping.damping", self.damping)
        real_number("load_dependent_damping.reference", self.reference, above=0.0)

    def respond(self, state: PortState) -> Response:
        """Return torque and tangents.

        Raises
        ------
        InvalidInput
            Where the solver does not know the load.
        """
        load = state.known_load("load_dependent_damping", "mesh")
        damping = self.damping * np.abs(load) / self.reference
        return Response(damping * state.speed, damping=damping)

    def with_input_locked(self) -> Law | None:
        """Return None: a slow sweep has no speed."""
        return None

    @property
    def formula(self) -> Formula:
        """Its equations."""
        return Formula("damping * abs(load) / reference * speed")

    @property
    def lumped(self) -> Lumped:
        """The damper under the reference load."""
        missing = f"the damping under a load of {self.reference:.4g} SI in its place"
        return Lumped(damping=self.damping, missing=missing)


def _growing(sizes: Any) -> list[Guess]:
    """Guess up to fifty times the believed damping, where the loads of a drive differ."""
    if not (isinstance(sizes, DriveSizes) and sizes.loads_differ and sizes.damping):
        return []

    def build(values: Sequence[float]) -> tuple[Law, ...]:
        return (LoadDamping(values[0], sizes.largest),)

    added = unknown("damping", 0.0, 50.0 * sizes.damping, sizes.damping)
    return [Guess((added,), [(share * sizes.damping,) for share in (0.5, 2.0, 8.0)], build)]


register(
    Effect(
        "load_dependent_damping",
        LoadDamping,
        ("mesh",),
        {"damping": "damping", "reference": "torque"},
        "Damping of the torsion that grows with the load.",
        _growing,
        forms="growing_damping",
        with_load=True,
    )
)
