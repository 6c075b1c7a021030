"""Errors of torque sensors that a fit left far beyond what is stated of them, and what they do.

A misfit that nothing else takes up ends in the gains of the sensors. All torques then share a
scale that nobody stated, and with them whatever is a torque by motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._evidence.order_lines.parameters import READING
from pymoo_hdte.discrepancy._selection.candidate import Layout
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.rules import Rules
from pymoo_hdte.effects.unknowns import Parameter

_OF_TORQUES = ("N", "kg")
"""How units begin that hold a force: of torques, stiffness, damping and inertias."""


def beyond_limits(fitted: Fit, rules: Rules) -> list[tuple[Parameter, float]]:
    """Return gains and zeros that plainly contradict their stated limits, with values; SI."""
    contradicted = np.flatnonzero(_from_stated(fitted) ** 2 >= rules.contradicting_chi_square)
    known = [(fitted.parameters[place], float(fitted.values[place])) for place in contradicted]
    return [(parameter, value) for parameter, value in known if parameter.name in READING]


def scale_error(fitted: Fit, rules: Rules) -> float:
    """Return the largest gain that contradicts what is stated of it, a share; 0 without any."""
    gains = [abs(value) for parameter, value in beyond_limits(fitted, rules) if _is_gain(parameter)]
    return max(gains, default=0.0)


def shares_scale(unit: str) -> bool:
    """Tell whether a value in an SI unit grows with the torques from which it is found.

    Examples
    --------
    >>> [shares_scale(unit) for unit in ("N.m/rad", "kg.m2", "rad", "1")]
    [True, True, False, False]
    """
    return unit.startswith(_OF_TORQUES)


def _is_gain(sensor: Parameter) -> bool:
    return sensor.name.endswith("_gain")


def _from_stated(fitted: Fit) -> NDArray[np.float64]:
    """Return how far parameters are from what is stated of them, in units of its deviation.

    Shape (n_parameters,); zero where nothing is stated.
    """
    stated = Layout(fitted.parameters)
    return np.asarray((fitted.values - stated.array("start")) / stated.array("prior"))
