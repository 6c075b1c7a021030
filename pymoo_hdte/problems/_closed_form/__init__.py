"""Robust problems with closed-form statistics and fronts, to test algorithms and surrogates on."""

from pymoo_hdte.problems._closed_form.deb_gupta import DebGupta3, DebGupta4, DebGupta12
from pymoo_hdte.problems._closed_form.noisy import (
    BeamReliability,
    Disconnected,
    ExponentialNoise,
    Portfolio,
)
from pymoo_hdte.problems._closed_form.problem import ClosedFormProblem
from pymoo_hdte.problems._closed_form.scattered import (
    MeanDTLZ2,
    RobustSrinivas,
    WorstCaseSchaffer,
)

__all__ = [
    "BeamReliability",
    "ClosedFormProblem",
    "DebGupta3",
    "DebGupta4",
    "DebGupta12",
    "Disconnected",
    "ExponentialNoise",
    "MeanDTLZ2",
    "Portfolio",
    "RobustSrinivas",
    "WorstCaseSchaffer",
]
