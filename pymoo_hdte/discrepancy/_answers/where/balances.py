"""Where a mechanism's model is wrong: in which force balance, and by how much."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pymoo_hdte.discrepancy._verdicts.mechanism_finding import MechanismFinding
from pymoo_hdte.mechanism.quantity_units import unit_of


@dataclass(frozen=True)
class MechanismLocation:
    """Which force balances the believed mechanism misses.

    Attributes
    ----------
    sentence : str
    base_misfit, sensor_noise : dict of str to float
        Root mean square by balance, N or N.m: of the residual of the base, and of the sensors'
        noise.
    """

    sentence: str
    base_misfit: dict[str, float]
    sensor_noise: dict[str, float]

    def summary(self) -> dict[str, Any]:
        """Return its entry in ``verdict.json``, as plain types."""
        return asdict(self)


def locate_in_mechanism(finding: MechanismFinding) -> MechanismLocation:
    """Return in which balance the base is wrong, and by how much."""
    names = finding.data.names
    misfit = dict(zip(names, finding.base_misfit.tolist(), strict=True))
    noise = dict(zip(names, finding.sensor_noise.tolist(), strict=True))
    if finding.verdict.status == "adequate":
        words = "Nowhere: the residual is at or near the sensor noise."
    elif finding.verdict.chosen is None and finding.verdict.status == "named":
        words = "Only in the forces beyond the cutoff frequency."
    else:
        parts = [
            f"the {finding.data.what(name)} (error {misfit[name]:.3g} "
            f"{unit_of(finding.mechanism, name)}, sensor noise {noise[name]:.2g})"
            for name in names
            if misfit[name] ** 2 > finding.data.rules.noise_power_ratio * noise[name] ** 2
        ]
        words = f"In {' and '.join(parts) or 'no single balance'}."
    return MechanismLocation(words, misfit, noise)
