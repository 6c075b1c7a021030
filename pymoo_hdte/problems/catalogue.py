"""Robust problems with known fronts, beside those of the drive."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pymoo_hdte.problems._closed_form import (
    BeamReliability,
    ClosedFormProblem,
    DebGupta3,
    DebGupta4,
    DebGupta12,
    Disconnected,
    ExponentialNoise,
    MeanDTLZ2,
    Portfolio,
    RobustSrinivas,
    WorstCaseSchaffer,
)
from pymoo_hdte.problems.toy import RobustToy


def robust_benchmarks() -> dict[str, Callable[[], ClosedFormProblem | RobustToy]]:
    """Return twelve robust problems by name, each as a function that builds the problem.

    Statistics are closed forms; ``pareto_front()`` and ``pareto_set()`` are true to rounding.

    =================== ===================================================== ================
    name                statistics                                            front
    =================== ===================================================== ================
    deb_gupta_1         means over a box, 5 variables                         concave, moved
    deb_gupta_2         the same                                              a part is left
    deb_gupta_3         the same; the wider valley is the better one          convex
    deb_gupta_4         the same; valleys change along the front              convex or not
    mean_dtlz2          means over a box, 7 variables, 3 objectives           ellipsoid
    worst_case_schaffer worst cases in a box, 3 variables                     convex
    srinivas            means; mean + 3 std as 2 constraints, 2 variables     along both
    toy                 mean and std, 3 variables                             convex
    disconnected        mean and std, 10 variables                            several pieces
    exponential_noise   mean and quantile; CVaR as a constraint, 4 variables  convex
    beam_reliability    mean and probability of failure, which is also        with a knee
                        limited, and a limit of shape, 2 variables
    portfolio           mean and CVaR, dependent noise; 3 variables, 1        convex
                        constraint
    =================== ===================================================== ================

    Examples
    --------
    >>> problems = robust_benchmarks()
    >>> len(problems), next(iter(problems.values()))().pareto_front().shape[1]
    (12, 2)
    """
    return {
        "deb_gupta_1": DebGupta12,
        "deb_gupta_2": partial(DebGupta12, beta=10.0),
        "deb_gupta_3": DebGupta3,
        "deb_gupta_4": DebGupta4,
        "mean_dtlz2": MeanDTLZ2,
        "worst_case_schaffer": WorstCaseSchaffer,
        "srinivas": RobustSrinivas,
        "toy": RobustToy,
        "disconnected": Disconnected,
        "exponential_noise": ExponentialNoise,
        "beam_reliability": BeamReliability,
        "portfolio": Portfolio,
    }
