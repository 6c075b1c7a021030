"""Pictures and the page of a robust problem."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from scipy.stats import norm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import Design, Mean, Std, robust_problem


@pytest.fixture(scope="module")
def problem():
    return robust_problem(
        lambda x, a: {"<y>": x + a, "z": x * a},
        {"x": Design(1.0, 2.0)},
        {"a": norm(0.0, 0.1)},
        [-Mean(response="<y>"), Std(response="z")],
        vectorised=True,
        progress=False,
    )


@pytest.fixture(scope="module")
def result(problem):
    return minimize(problem, NSGA2(8), ("n_gen", 3), seed=1)


def test_scatter_is_that_of_the_response(problem):
    name, values = problem.scatter([1.5], "z")
    assert name == "z"
    assert values.mean() == pytest.approx(0.0, abs=1e-3)
    assert values.std() == pytest.approx(0.15, rel=0.02)


def test_pictures_go_where_they_are_told(problem, result):
    left, right = Figure().subplots(1, 2)
    assert problem.plot_front(result, left) is left
    assert problem.plot_scatter([1.5], "z", right) is right
    assert left.get_xlabel() == problem.obj_names[0]
    points = left.containers[0][0].get_xydata()
    assert np.allclose(np.sort(points, axis=0), np.sort(result.F, axis=0))
    assert right.get_xlabel() == "z"


def test_the_page_holds_everything_and_runs_nothing(problem, result, tmp_path):
    problem.report(tmp_path / "page.html", result)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 3
    assert not re.search(r"<script|https?://|<y>", page)
    assert "&lt;y&gt;" in page
    with pytest.raises(InvalidInput, match="one of them"):
        problem.report(tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()
