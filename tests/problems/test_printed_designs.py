"""Designs as a paper prints them: what rounding to four digits puts outside is evaluated."""

import numpy as np
import pytest

from experiments.published_values import TABLE_9
from pymoo_hdte.problems import (
    Design,
    RobustDTE,
    RobustDTEGrades,
    RobustDTETolerance,
    RobustToy,
    robust_benchmarks,
    robust_problem,
)
from pymoo_hdte.surrogate import ExtrapolationError


@pytest.fixture(scope="module")
def problem():
    return RobustDTE()


def test_the_paper_s_optima_are_evaluated_as_printed(problem):
    designs = np.array(list(TABLE_9.values()))
    assert np.any(designs > problem.xu)
    F, dF = problem.evaluate(designs, return_values_of=["F", "dF"])
    inside = np.clip(designs, problem.xl, problem.xu)
    expected, slopes = problem.evaluate(inside, return_values_of=["F", "dF"])
    assert np.array_equal(F, expected)
    assert np.array_equal(dF, slopes)


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        RobustDTE,
        RobustDTETolerance,
        RobustDTEGrades,
        lambda: RobustToy(moments="sample"),
        robust_benchmarks()["srinivas"],
        lambda: robust_problem(
            lambda x: x**2, {"x": Design(1.0, 2.0, tolerance=0.1)}, progress=False
        ),
    ],
)
def test_every_problem_takes_its_ends_as_printed(make):
    problem = make()
    ends = np.array([problem.xl, problem.xu])
    # Four digits move a number by 5e-5 of it at least before they show it.
    beside = ends + np.array([[-1.0], [1.0]]) * 1e-5 * np.abs(ends)
    F, G = problem.evaluate(beside, return_values_of=["F", "G"])
    expected, constraints = problem.evaluate(ends, return_values_of=["F", "G"])
    assert np.array_equal(F, expected)
    assert np.array_equal(G, constraints)


def test_what_lies_farther_outside_is_refused_with_its_value(problem):
    design = problem.xu + np.array([10.0, 0.0, 0.0, 0.0])
    with pytest.raises(ExtrapolationError, match=r"K is 32297\.5, allowed: 19372\.5 to 32287\.5"):
        problem.evaluate(design)
