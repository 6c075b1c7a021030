"""Robust design problems for pymoo."""

from pymoo_hdte.problems.family import robust_dte_family
from pymoo_hdte.problems.operating_conditions import (
    OperatingCondition,
    hs_20_100_duty_cycle,
    load_conditions,
)
from pymoo_hdte.problems.robust import RobustProblem
from pymoo_hdte.problems.robust_dte import RobustDTE
from pymoo_hdte.problems.robust_dte_tolerance import RobustDTETolerance
from pymoo_hdte.problems.toy import RobustToy

__all__ = [
    "OperatingCondition",
    "RobustDTE",
    "RobustDTETolerance",
    "RobustProblem",
    "RobustToy",
    "hs_20_100_duty_cycle",
    "load_conditions",
    "robust_dte_family",
]
