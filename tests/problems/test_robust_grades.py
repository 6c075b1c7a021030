"""Grades of the error classes as variables: physics, constraints, slopes, the stored front."""

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from scipy.optimize import nnls

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import preset
from pymoo_hdte.drive.dte_map import torsional_mode
from pymoo_hdte.problems import OperatingCondition, RobustDTEGrades

ALL = ["F", "dF", "G", "dG"]


@pytest.fixture(scope="module")
def problem():
    return RobustDTEGrades()


def designs(problem, n, seed=1):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (n, problem.n_var))


@pytest.mark.slow
def test_drives_of_grade_one_are_those_of_the_data_sheet(problem):
    parameters = problem.model.nominal * np.random.default_rng(2).uniform(0.9, 1.1, (20, 5))
    points = np.column_stack([parameters, np.ones((20, 3))])
    assert problem.dte_arcsec(points) == pytest.approx(
        problem.model.dte_arcsec(parameters), rel=1e-14
    )


@pytest.mark.slow
def test_a_linear_drive_errs_in_proportion_to_its_grades(problem):
    """Constant stiffness: theta_s alone moves the drive, and each line adds its own part."""
    linear = RobustDTEGrades.__new__(RobustDTEGrades)
    linear.model = preset("published")
    linear.conditions = (OperatingCondition(209.0, 40.0),)
    points = np.column_stack([np.tile(linear.model.nominal, (3, 1)), np.ones((3, 3))])
    points[1:, 5:] = [[0.7] * 3, [0.7, 1.0, 1.0]]
    whole, smaller, mixed = linear.dte_arcsec(points)
    assert smaller == pytest.approx(0.7 * whole, rel=1e-9)
    assert smaller < mixed < whole


@pytest.mark.slow
def test_the_surrogate_predicts_the_drive_model(problem):
    box = problem.surrogate.box
    points = np.random.default_rng(3).uniform(box.lower, box.upper, (300, len(box)))
    actual = problem.dte_arcsec(points)
    error = problem.surrogate(points) - actual
    assert 1.0 - np.mean(error**2) / np.var(actual) > 0.997


@pytest.mark.slow
def test_grades_stand_for_the_error_sources_of_the_data_sheet(problem):
    assert problem.var_names == ("K", "J_in", "B_in", "B_fc", "grade_w", "grade_mp", "grade_g")
    # Five sources turn with the wave generator, four stand still or are of the pitch, two turn
    # with the flexspline; those from tooth to tooth excite no line of the model.
    assert problem.cost_shares * 11 == pytest.approx([5.0, 4.0, 2.0])


@pytest.mark.slow
def test_the_cost_of_the_data_sheets_drive_is_the_limit(problem):
    U = np.tile(np.r_[problem.nominal, np.ones(3)], (2, 1))
    U[1, 4:] = 0.8
    cost = problem.evaluate(U, return_values_of=["G"])[:, 0] + 1.0
    assert cost == pytest.approx([1.0, 1.25], rel=1e-14)


@pytest.mark.slow
def test_the_resonance_is_that_of_the_drive_model(problem):
    frequency, _ = problem.resonance(np.r_[problem.nominal, np.ones(3)][None])
    assert frequency[0] / (2.0 * np.pi) == pytest.approx(torsional_mode(problem.model).frequency)


@pytest.mark.slow
def test_a_resonance_is_allowed_from_the_margin_on_either_side(problem):
    excitation = 2.0 * problem.process_speed
    U = np.tile(np.r_[problem.nominal, np.ones(3)], (5, 1))
    wanted = excitation * (1.0 + problem.margin * np.array([-1.001, -0.999, 0.0, 0.999, 1.001]))
    U[:, 0] *= (wanted / problem.resonance(U)[0]) ** 2
    limit = problem.evaluate(U, return_values_of=["G"])[:, 1]
    assert limit[2] == pytest.approx(1.0)
    assert (limit > 0.0).tolist() == [False, True, True, True, False]


@pytest.mark.slow
def test_slopes_equal_finite_differences(problem):
    centre = (problem.xl + problem.xu) / 2.0
    U = designs(problem, 4) * 0.98 + centre * 0.02
    _, dF, _, dG = problem.evaluate(U, return_values_of=ALL)
    assert dF.shape == dG.shape == (4, 2, 7)
    for variable in range(7):
        step = 1e-4 * centre * np.eye(7)[variable]
        (F_up, G_up), (F_down, G_down) = problem.evaluate(U + step), problem.evaluate(U - step)
        twice = 2.0 * step[variable]
        found = np.hstack([dF[:, :, variable], dG[:, :, variable]])
        expected = np.hstack([F_up - F_down, G_up - G_down]) / twice
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-10 / step[variable])


@pytest.mark.slow
def test_the_stored_front_is_allowed_on_the_problem_and_undominated(problem):
    front, chosen = problem.pareto_front(), problem.pareto_set()
    F, G = problem.evaluate(chosen)
    assert len(front) >= 120
    assert pytest.approx(front, rel=1e-9) == F
    assert np.all(G <= 0.0)
    assert len(NonDominatedSorting().do(front, only_non_dominated_front=True)) == len(front)


@pytest.mark.slow
def test_nothing_undercuts_the_stored_front(problem):
    front = problem.pareto_front()
    evolved = minimize(problem, NSGA2(pop_size=100), ("n_gen", 40), seed=2).F
    F, G = problem.evaluate(designs(problem, 5000))
    found = np.vstack([evolved, F[np.all(G <= 0.0, axis=1)]])
    gain = ((front[None] - found[:, None]) / np.ptp(front, axis=0)).min(axis=2)
    assert gain.max() < 1e-6


@pytest.mark.slow
def test_the_stored_front_satisfies_the_first_order_conditions(problem):
    """Karush, Kuhn, Tucker: weighted slopes vanish but for what pushes on bounds and limits."""
    front, chosen = problem.pareto_front()[5:-5:4], problem.pareto_set()[5:-5:4]
    _, dF, G, dG = problem.evaluate(chosen, return_values_of=ALL)
    width = problem.xu - problem.xl
    slopes = dF * width / np.ptp(problem.pareto_front(), axis=0)[:, None]
    residuals = []
    for x, slope, limit, of_limit in zip(chosen, slopes, G, dG * width, strict=True):
        lower, upper = x - problem.xl < 1e-6 * width, problem.xu - x < 1e-6 * width
        outwards = np.hstack([-np.eye(7)[:, lower], np.eye(7)[:, upper]])
        columns = np.hstack([slope.T / np.abs(slope).max(), outwards, of_limit[limit > -1e-6].T])
        weights = np.r_[1.0, 1.0, np.zeros(columns.shape[1] - 2)]
        residuals.append(nnls(np.vstack([columns, weights]), np.r_[np.zeros(7), 1.0])[1])
    assert len(front) > 20
    assert np.median(residuals) < 1e-4
    assert max(residuals) < 1e-2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"grades": (0.0, 1.0)}, "grades[0] is 0.0"),
        ({"grades": (1.0, 1.0)}, "grades[0] is 1.0"),
        ({"cost_limit": 2.0}, "cost_limit is 2.0"),
        ({"process_speed": 0.0}, "process_speed is 0.0"),
        ({"margin": 1.0}, "margin is 1.0"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"model": "measured"}, "model is 'measured'"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(InvalidInput) as caught:
        RobustDTEGrades(**arguments)
    assert message in str(caught.value)
