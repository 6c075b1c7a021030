"""Table 7 as the paper prints it, and what it answers."""

from __future__ import annotations

from typing import NamedTuple


class AlgorithmQuality(NamedTuple):
    """One row of Table 7: means of 20 runs."""

    igd: float
    spacing: float
    seconds: float


TABLE_7 = {
    "NSGA-II": AlgorithmQuality(0.2162, 0.1122, 22.86),
    "MOPSO": AlgorithmQuality(0.0894, 0.0468, 22.13),
    "AMP-MOPSO": AlgorithmQuality(0.0180, 0.0235, 22.28),
}
"""By name of the algorithm."""

QUESTION = "At the paper's budget, does AMP-MOPSO find a better front than MOPSO and NSGA-II?"
