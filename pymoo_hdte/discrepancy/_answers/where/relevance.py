"""Whether what is named matters: its largest change against what the campaign calls good enough."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._answers.where.map import Location
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True)
class Relevance:
    """The largest changes that the named effects make, and what is good enough.

    A change is the largest deviation, at any time, from the model without the named effects and
    with every value within its tolerance, in the fitted records: at most the change of the mean
    plus the amplitudes of all lines that change.

    Attributes
    ----------
    error, torque : float
        Of the transmission error, rad; of the input or output torque, whichever is larger, N.m.
    good_enough_error, good_enough_torque : float or None
        As the campaign states them, rad and N.m; None where it states none.
    whole : bool
        Whether the named effects leave nothing but noise.
    """

    error: float
    torque: float
    good_enough_error: float | None
    good_enough_torque: float | None
    whole: bool

    @property
    def irrelevant(self) -> bool:
        """Whether every change for which the campaign says so is good enough."""
        stated = [limit for _, _, limit in self._compared() if limit is not None]
        below = [limit is None or change < limit for _, change, limit in self._compared()]
        return bool(stated) and all(below)

    @property
    def sentence(self) -> str:
        """What is named in numbers, as real and irrelevant or as more than is good enough."""
        compared = [change for change in self._compared() if change[2] is not None]
        if self.irrelevant:
            words = " and ".join(
                f"{what} by at most {_shown(change, what)} ({_shown(limit, what)} is good enough)"
                for what, change, limit in compared
            )
            remark = "" if self.whole else " The unexplained residual is not counted."
            return f"Real and irrelevant at the stated size: it changes {words}.{remark}"
        words = " and ".join(
            f"{what} by up to {_shown(change, what)} ({_shown(limit, what)} is good enough)"
            for what, change, limit in compared
            if limit is not None and change >= limit
        )
        return f"It changes {words}."

    def as_dict(self) -> dict[str, Any]:
        """Return its entry in ``verdict.json``, as plain types."""
        return {
            "irrelevant": self.irrelevant,
            "sentence": self.sentence,
            "largest_change": {
                "transmission_error": {"value": self.error, "unit": "rad"},
                "torque": {"value": self.torque, "unit": "N.m"},
            },
            "good_enough": {
                "transmission_error": {"value": self.good_enough_error, "unit": "rad"},
                "torque": {"value": self.good_enough_torque, "unit": "N.m"},
            },
        }

    def _compared(self) -> list[tuple[str, float, float | None]]:
        return [
            (_ERROR, self.error, self.good_enough_error),
            ("torques", self.torque, self.good_enough_torque),
        ]


_ERROR = "the transmission error"


def _shown(size: float | None, what: str) -> str:
    if size is None:
        return "any size"
    return f"{size / ARCSEC:.3g} arcsec" if what == _ERROR else f"{size:.3g} N.m"


def relevance(finding: DriveFinding, location: Location) -> Relevance | None:
    """Return how what is named compares with what is good enough.

    None where nothing is named or the campaign does not say what is good enough.

    Parameters
    ----------
    finding : DriveFinding
    location : Location
        Of the same finding.
    """
    campaign, verdict = finding.campaign, finding.verdict
    limits = campaign.good_enough_error, campaign.good_enough_torque
    if not location.named or limits == (None, None):
        return None
    error, *torques = largest_change(location)[:3]
    whole = verdict.status != "partial" and not verdict.leaves_more_than_noise
    return Relevance(float(error), float(max(torques)), *limits, whole)


def largest_change(location: Location) -> NDArray[np.float64]:
    """Return the largest change of each channel in any record, rad and N.m, shape (4,)."""
    return np.asarray(np.nansum(np.abs(location.change), axis=2).max(axis=0))
