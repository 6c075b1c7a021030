"""Where the model of a machine of any kind is wrong: in which channel, and in which record."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pymoo_hdte.discrepancy._verdicts.own_machine import MachineFinding


@dataclass(frozen=True)
class PartLocation:
    """Which channels and records the nominal model misses.

    Attributes
    ----------
    sentence : str
    channels, records : dict of str to float
        Root mean square of the residual of the base by channel, and by record, in standard
        deviations of the noise.
    """

    sentence: str
    channels: dict[str, float]
    records: dict[str, float]

    def summary(self) -> dict[str, Any]:
        """Return its entry in ``verdict.json``, as plain types."""
        return asdict(self)


def locate_in_parts(finding: MachineFinding) -> PartLocation:
    """Return in which channels and records the base is wrong, and by how much."""
    data, base = finding.data, finding.verdict.base
    excess = data.excess(base)
    chi_square = excess.chi_square + excess.degrees_of_freedom
    channels, records = (
        np.sqrt(chi_square.sum(axis=axis) / np.maximum(excess.degrees_of_freedom.sum(axis=axis), 1))
        for axis in (0, 1)
    )
    shown = [
        f"{part.replace('_', ' ')} ({size:.3g} times the noise)"
        for part, size, beyond in zip(
            data.parts, channels, excess.significant(data.rules), strict=True
        )
        if beyond
    ]
    words = "Nowhere: what the model leaves is noise."
    if finding.verdict.status != "adequate":
        worst = finding.names[int(np.argmax(records))]
        words = f"In the {' and the '.join(shown) or 'records as a whole'}, most in {worst}."
    return PartLocation(
        words,
        dict(zip(data.parts, channels.tolist(), strict=True)),
        dict(zip(finding.names, records.tolist(), strict=True)),
    )
