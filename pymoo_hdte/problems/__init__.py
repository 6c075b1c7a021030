"""Robust design problems for pymoo."""

from pymoo_hdte.problems.robust import RobustProblem
from pymoo_hdte.problems.robust_dte import RobustDTE
from pymoo_hdte.problems.toy import RobustToy

__all__ = ["RobustDTE", "RobustProblem", "RobustToy"]
