"""Robust design problems for pymoo."""

from pymoo_hdte.problems._simulator.crashes import CrashProbability
from pymoo_hdte.problems._simulator.data import Runs
from pymoo_hdte.problems._simulator.direct import DirectProblem
from pymoo_hdte.problems._simulator.existing import Robust
from pymoo_hdte.problems._simulator.inputs import Design
from pymoo_hdte.problems._simulator.kinds_of_noise import Interval, Scenarios
from pymoo_hdte.problems._simulator.problem import SimulatorProblem
from pymoo_hdte.problems._simulator.reliability import Reliability, failure_probability
from pymoo_hdte.problems._simulator.robust_problem import robust_problem
from pymoo_hdte.problems._simulator.runs import SimulatorFailed
from pymoo_hdte.problems._simulator.sampled_statistics import CVaR, FailureProbability, Quantile
from pymoo_hdte.problems._simulator.statistics import (
    Mean,
    MeanPlusStd,
    RobustConstraint,
    Std,
    WorstCase,
)
from pymoo_hdte.problems.catalogue import robust_benchmarks
from pymoo_hdte.problems.family import robust_dte_family
from pymoo_hdte.problems.named import get_problem
from pymoo_hdte.problems.operating_conditions import (
    OperatingCondition,
    hs_20_100_duty_cycle,
    load_conditions,
)
from pymoo_hdte.problems.robust import RobustProblem
from pymoo_hdte.problems.robust_dte import RobustDTE
from pymoo_hdte.problems.robust_dte_direct import RobustDTEDirect
from pymoo_hdte.problems.robust_dte_grades import RobustDTEGrades
from pymoo_hdte.problems.robust_dte_tolerance import RobustDTETolerance
from pymoo_hdte.problems.toy import RobustToy
from pymoo_hdte.surrogate._rare.events import Event, Response
from pymoo_hdte.surrogate.trust import UntrustedSurrogate

__all__ = [
    "CVaR",
    "CrashProbability",
    "Design",
    "DirectProblem",
    "Event",
    "FailureProbability",
    "Interval",
    "Mean",
    "MeanPlusStd",
    "OperatingCondition",
    "Quantile",
    "Reliability",
    "Response",
    "Robust",
    "RobustConstraint",
    "RobustDTE",
    "RobustDTEDirect",
    "RobustDTEGrades",
    "RobustDTETolerance",
    "RobustProblem",
    "RobustToy",
    "Runs",
    "Scenarios",
    "SimulatorFailed",
    "SimulatorProblem",
    "Std",
    "UntrustedSurrogate",
    "WorstCase",
    "failure_probability",
    "get_problem",
    "hs_20_100_duty_cycle",
    "load_conditions",
    "robust_benchmarks",
    "robust_dte_family",
    "robust_problem",
]
