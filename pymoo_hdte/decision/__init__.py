"""Choosing one design from a front."""

from pymoo_hdte.decision.tolerance import deviation_degree, tolerance_band
from pymoo_hdte.decision.utopia import PREFERENCES, WeightedUtopia

__all__ = ["PREFERENCES", "WeightedUtopia", "deviation_degree", "tolerance_band"]
