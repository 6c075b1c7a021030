"""Chebyshev surrogates on a box; mean, deviation and Sobol indices over uncertain inputs.

Knows nothing of drives or of pymoo: any function of several real variables will do.
"""

from pymoo_hdte.surrogate.box import Box, ExtrapolationError
from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.error_measures import Accuracy, accuracy, latin_hypercube
from pymoo_hdte.surrogate.inputs import TruncatedNormal, UniformBand
from pymoo_hdte.surrogate.moments import ExactMoments
from pymoo_hdte.surrogate.sampled import SampledMoments
from pymoo_hdte.surrogate.sensitivity import SobolIndices, sobol_indices, sobol_indices_over_box
from pymoo_hdte.surrogate.variable_band import VariableBandMoments

__all__ = [
    "Accuracy",
    "Box",
    "ChebyshevSurrogate",
    "ExactMoments",
    "ExtrapolationError",
    "SampledMoments",
    "SobolIndices",
    "TruncatedNormal",
    "UniformBand",
    "VariableBandMoments",
    "accuracy",
    "latin_hypercube",
    "sobol_indices",
    "sobol_indices_over_box",
]
