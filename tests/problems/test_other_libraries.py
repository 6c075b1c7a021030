"""Problems in the hands of other libraries and languages have the same values and constraints."""

import json
import runpy
import shutil
import subprocess

import numpy as np
import pytest
from places import DOCS

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.problems import get_problem, robust_benchmarks, robust_dte_family
from pymoo_hdte.problems.adapters import PygmoProblem, to_callable, to_jmetal, to_platypus
from pymoo_hdte.problems.specification import specification

CONSTRAINED = "srinivas"


@pytest.fixture(scope="module")
def resonant():
    return get_problem("resonant")


def designs_of(problem, n=5):
    rng = np.random.default_rng(3)
    return problem.xl + (problem.xu - problem.xl) * rng.random((n, problem.n_var))


def test_problems_have_names():
    assert get_problem("toy").n_obj == 2
    assert get_problem("deb_gupta_1", beta=10.0).pareto_front().shape[1] == 2
    assert not set(robust_benchmarks()) & set(robust_dte_family())
    with pytest.raises(InvalidInput, match="deb_gupta_1"):
        get_problem("deb_gupta")


@pytest.mark.parametrize("name", [CONSTRAINED, "resonant"])
def test_pygmo_sees_objectives_bounds_and_constraints(name):
    pygmo = pytest.importorskip("pygmo", reason="pygmo is not installed")
    problem = get_problem(name)
    theirs = pygmo.problem(PygmoProblem(problem))
    assert (theirs.get_nobj(), theirs.get_nic()) == (2, problem.n_ieq_constr)
    np.testing.assert_array_equal(theirs.get_bounds(), problem.bounds())
    X = designs_of(problem)
    expected = np.column_stack(problem.evaluate(X, return_values_of=["F", "G"]))
    np.testing.assert_allclose([theirs.fitness(x) for x in X], expected, rtol=1e-13)
    np.testing.assert_array_equal(theirs.batch_fitness(X.ravel()), expected.ravel())


def test_an_algorithm_of_pygmo_comes_near_the_front(resonant):
    pygmo = pytest.importorskip("pygmo", reason="pygmo is not installed")
    theirs = pygmo.population(pygmo.problem(PygmoProblem(resonant)), 40, seed=1)
    theirs = pygmo.algorithm(pygmo.nsga2(gen=60, seed=1)).evolve(theirs)
    least = resonant.pareto_front().min(axis=0)
    np.testing.assert_allclose(theirs.get_f().min(axis=0), least, rtol=2e-3)


def test_jmetal_sees_the_same_and_its_sign_of_constraints():
    pytest.importorskip("jmetal", reason="jMetalPy is not installed")
    problem = get_problem(CONSTRAINED)
    theirs = to_jmetal(problem)
    solution = theirs.create_solution()
    for x in designs_of(problem):
        solution.variables = x.tolist()
        theirs.evaluate(solution)
        F, G = problem.evaluate(x, return_values_of=["F", "G"])
        np.testing.assert_array_equal(solution.objectives, F)
        np.testing.assert_array_equal(solution.constraints, -G)
    assert theirs.evaluations == 5


def test_platypus_sees_the_same():
    platypus = pytest.importorskip("platypus", reason="Platypus is not installed")
    problem = get_problem(CONSTRAINED)
    theirs = to_platypus(problem)
    for x in designs_of(problem):
        solution = platypus.Solution(theirs)
        solution.variables[:] = x.tolist()
        solution.evaluate()
        F, G = problem.evaluate(x, return_values_of=["F", "G"])
        np.testing.assert_array_equal(solution.objectives, F)
        np.testing.assert_array_equal(solution.constraints, G)
        assert solution.feasible == bool(np.all(G <= 0.0))
    algorithm = platypus.NSGAII(to_platypus(get_problem("toy")), population_size=20)
    algorithm.run(100)
    assert len(algorithm.result) == 20


def test_a_function_takes_and_returns_names(resonant):
    function = to_callable(resonant)
    (x,) = designs_of(resonant, 1)
    values = function(dict(zip(reversed(resonant.var_names), x[::-1], strict=True)))
    assert list(values) == list(resonant.obj_names)
    np.testing.assert_array_equal(list(values.values()), resonant.evaluate(x))
    constrained = get_problem(CONSTRAINED)
    assert {"g1", "g2"} < set(to_callable(constrained)({"x1": 1.0, "x2": 1.0}))


# --- specification --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def document(resonant):
    return json.loads(json.dumps(specification(resonant)))


@pytest.fixture(scope="module")
def file(document, tmp_path_factory):
    path = tmp_path_factory.mktemp("specification") / "resonant.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_the_series_are_mean_and_variance_anywhere(resonant, document):
    """By numpy's own sum of a Chebyshev series, one variable after the other."""
    series = [
        np.reshape(document[name], [degree + 1 for degree in document[f"{name}_degrees"]])
        for name in ("mean", "variance")
    ]
    cube = np.random.default_rng(2).uniform(-1.0, 1.0, (20, 4))
    lower, upper = np.array(document["lower"]), np.array(document["upper"])
    F = resonant.evaluate((lower + upper) / 2.0 + cube * (upper - lower) / 2.0)
    for coefficients, expected in zip(series, (F[:, 0], F[:, 1] ** 2), strict=True):
        values = []
        for point in cube:
            part = coefficients
            for t in point:
                part = np.polynomial.chebyshev.chebval(t, part)
            values.append(part)
        np.testing.assert_allclose(values, expected, rtol=1e-10)


def test_front_and_checks_are_evaluated_designs(resonant, document):
    for designs, objectives in (
        ("check_designs", "check_objectives"),
        ("front_designs", "front"),
    ):
        F = resonant.evaluate(np.reshape(document[designs], (-1, 4)))
        np.testing.assert_allclose(F.ravel(), document[objectives], rtol=1e-9)


def test_the_reader_in_python_gives_the_same(document):
    reader = runpy.run_path(str(DOCS / "examples" / "read_specification.py"))
    designs = np.reshape(document["check_designs"], (-1, 4))
    values = [reader["evaluate"](document, design) for design in designs]
    np.testing.assert_allclose(np.ravel(values), document["check_objectives"], rtol=1e-12)


def test_the_reader_in_c_gives_the_same(document, file, tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    source, program = DOCS / "examples" / "read_specification.c", tmp_path / "read"
    flags = ["-O1", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([compiler, *flags, source, "-o", program, "-lm"], check=True)
    printed = subprocess.run([program, file], check=True, capture_output=True, text=True).stdout
    values = np.array(printed.split(), dtype=float)
    np.testing.assert_allclose(values, document["check_objectives"], rtol=1e-10)


def test_other_problems_have_no_specification():
    with pytest.raises(InvalidInput, match="exact moments"):
        specification(get_problem("deb_gupta_1"))
