"""Problems from papers: fronts that no design dominates, optima that lie on them, known corners."""

import numpy as np
import pytest
from moocore import is_nondominated
from pymoo.problems import get_problem

from experiments.runner.committed import DATA, read_rows
from experiments.studies.suites.formulas import lz09
from experiments.studies.suites.formulas.df import NUMBERS, TIMES, df_designs, df_front, make_df
from experiments.studies.suites.formulas.engineering import MEMBERS, make_engineering
from experiments.studies.suites.formulas.imop import N_PLACES, imop_front, make_imop
from experiments.studies.suites.formulas.lz09 import lz09_front, make_lz09
from experiments.studies.suites.formulas.zcat import make_zcat, zcat_front


def optimal_imop(number, n):
    """Designs at distance zero, spread along the front by undoing the exponents of the means."""
    rng = np.random.default_rng(number)
    X = np.full((n, 10), 0.5)
    places = rng.random((n, 2))
    if number <= 4:
        X[:, :N_PLACES] = places[:, :1] ** 20
    else:
        X[:, 0:N_PLACES:2] = places[:, :1] ** 20
        X[:, 1:N_PLACES:2] = places[:, 1:] ** 0.1
    return X


@pytest.mark.parametrize("number", range(1, 9))
def test_no_design_of_imop_lies_below_its_front(number):
    problem, front = make_imop(number), imop_front(number)
    F = problem.evaluate(optimal_imop(number, 2000))
    assert is_nondominated(front).all()
    width = np.ptp(front, axis=0).max()
    # A front made of points leaves gaps of their distance.
    best = F[is_nondominated(F)][:200]
    covered = max(float(np.max(front - row, axis=1).min()) for row in best)
    assert covered < 0.02 * width
    # A far design is worse by its distance.
    far = optimal_imop(number, 20)
    far[:, N_PLACES:] = 0.0
    assert np.all(
        problem.evaluate(far).sum(axis=1) > problem.evaluate(optimal_imop(number, 20)).sum(axis=1)
    )


@pytest.mark.parametrize("number", range(1, 10))
def test_the_curves_of_lz09_lead_to_its_front(number):
    problem, front = make_lz09(number), lz09_front(number)
    rng = np.random.default_rng(number)
    X = rng.uniform(problem.xl, problem.xu, (50, problem.n_var))
    places = 2 if number == 6 else 1
    j = np.arange(places + 1, problem.n_var + 1)
    worse = problem.evaluate(X)
    X[:, places:] = lz09._best(number, X, j, problem.n_var)
    assert np.all((problem.xl - 1e-12 <= X) & (problem.xu + 1e-12 >= X))
    F = problem.evaluate(X)
    assert max(float(np.abs(front - row).max(axis=1).min()) for row in F) < 0.02
    assert np.all(worse >= F - 1e-12)


@pytest.mark.parametrize("time", TIMES)
@pytest.mark.parametrize("number", NUMBERS)
def test_no_design_of_df_lies_below_its_front(number, time):
    problem, front = make_df(number, time), df_front(number, time)
    rng = np.random.default_rng(number)
    X = rng.permutation(df_designs(number, time))[:1000]
    assert np.all((problem.xl <= X) & (problem.xu >= X))
    near = X + 0.02 * rng.standard_normal(X.shape) * (rng.random(X.shape) < 0.3)
    anywhere = rng.uniform(problem.xl, problem.xu, X.shape)
    F = problem.evaluate(np.vstack([np.clip(near, problem.xl, problem.xu), anywhere]))
    # Some designs are optimal themselves: a rounding below the front is none.
    assert is_nondominated(np.vstack([F + 1e-9, front]))[len(F) :].all()
    # What one design costs does not depend on the others.
    np.testing.assert_array_equal(problem.evaluate(X[:1])[0], problem.evaluate(X[:9])[0])


def test_engineering_problems_have_the_published_corners():
    rows = read_rows(DATA / "suites_boxes.csv")
    nadir = {(row["problem"], int(row["objective"])): float(row["nadir"]) for row in rows}
    # Tanabe and Ishibuchi's table of nadir points.
    for place, value in {
        ("RE21", 1): 2886.3696,
        ("RE21", 2): 0.04,
        ("RE24", 1): 481.608,
        ("RE24", 2): 44.2819,
        ("RE31", 2): 8246211.25,
        ("RE31", 3): 19359919.75,
        ("RE32", 2): 17561.6,
        ("RE32", 3): 425062976.6,
        ("RE34", 3): 0.264,
    }.items():
        assert nadir[place] == pytest.approx(value, rel=2e-3)


@pytest.mark.parametrize("name", MEMBERS)
def test_engineering_problems_add_up_what_is_violated(name):
    problem = make_engineering(name)
    rng = np.random.default_rng(1)
    F = problem.evaluate(rng.uniform(problem.xl, problem.xu, (500, problem.n_var)))
    assert np.isfinite(F).all()
    if name not in ("RE21", "RE34", "RE37"):
        assert F[:, -1].min() >= 0.0
        assert F[:, -1].max() > 0.0


def test_a_pressure_vessel_that_holds_violates_nothing():
    sizes = np.array([[100.0, 100.0, 100.0, 40.0], [1.0, 1.0, 10.0, 10.0]])
    F = make_engineering("RE23").evaluate(sizes)
    assert F[0, 1] == 0.0
    # Sheets of 1/16 inch hold a radius of ten inches not, and the volume lacks nearly all.
    missing = 1_296_000 - np.pi * 1000.0 * (1.0 + 4.0 / 3.0)
    assert F[1, 1] == pytest.approx(0.193 - 0.0625 + 0.0954 - 0.0625 + missing)


@pytest.mark.parametrize("n_obj", [2, 3])
@pytest.mark.parametrize("number", range(1, 21))
def test_zcat_is_that_of_pymoo_and_no_design_lies_below_its_front(number, n_obj):
    rng = np.random.default_rng(number)
    for level in (1, 2, 3, 4):
        problem = make_zcat(number, n_obj, level)
        X = rng.uniform(problem.xl, problem.xu, (6, problem.n_var))
        X[:2] = problem.xl, problem.xu
        theirs = get_problem(
            f"zcat{number}", n_var=30, n_obj=n_obj, complicated_pareto_set=True, level=level
        )
        np.testing.assert_allclose(problem.evaluate(X), theirs.evaluate(X), rtol=1e-12)
    # At 0.221 the plain sets of the paper miss nothing, and have the same front.
    plain = get_problem(f"zcat{number}", n_var=30, n_obj=n_obj)
    X[:] = 0.2210
    X[:, : n_obj - 1] = rng.random((len(X), n_obj - 1))
    F = plain.evaluate(plain.xl + X * (plain.xu - plain.xl))
    front = zcat_front(number, n_obj)
    assert is_nondominated(front).all()
    for row in F:
        # A point of the front is as good or better, but for the gaps of equal steps.
        assert np.max(front - row, axis=1).min() < 0.05 * np.ptp(front, axis=0).max()
