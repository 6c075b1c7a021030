"""The robust DTE problems for others' studies: stored fronts, duty cycles, a priced tolerance."""

import copy
import pickle

import numpy as np
import pytest
from night import others_at_night
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.optimize import minimize
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting
from pymoo.util.ref_dirs import get_reference_directions
from scipy.optimize import nnls

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    preset,
)
from pymoo_hdte.problems import (
    OperatingCondition,
    RobustDTE,
    RobustDTETolerance,
    hs_20_100_duty_cycle,
    load_conditions,
    robust_dte_family,
)
from pymoo_hdte.surrogate import ChebyshevSurrogate, ExtrapolationError
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

APART = ("calibrated_direct", "calibrated_grades")
FAMILY = {name: build for name, build in robust_dte_family().items() if name not in APART}
"""Those on surrogates without constraints, with gradients and fronts to 1e-6."""
DUTY_CYCLE = hs_20_100_duty_cycle()


@pytest.fixture(scope="module", params=FAMILY)
def member(request):
    return FAMILY[request.param]()


@pytest.fixture(scope="module")
def tolerance_problem():
    return RobustDTETolerance()


def designs(problem, n, seed=1):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (n, problem.n_var))


def condition(speed_rpm, load, weight=1.0):
    return OperatingCondition(speed_rpm * REVOLUTION_PER_MINUTE, load, weight)


def test_listing_the_family_builds_nothing(monkeypatch):
    def refused(*_):
        raise AssertionError("a surrogate was fitted")

    monkeypatch.setattr(ChebyshevSurrogate, "fit", refused)
    assert set(robust_dte_family()) == {
        *("calibrated", "calibrated_order4", "calibrated_order5"),
        *("resonant", "resonant_order4", "resonant_order5"),
        *("calibrated_duty_cycle", "calibrated_tolerance", *APART),
    }


def test_members_are_named_as_their_fronts_are(member, request):
    name = request.node.callspec.params["member"]
    assert member.variant == name
    assert name in member.name()


def test_stored_fronts_are_on_the_problem_and_undominated(member):
    front, chosen = member.pareto_front(), member.pareto_set()
    assert front.shape == (len(chosen), member.n_obj)
    assert len(front) >= 1000
    assert member.evaluate(chosen) == pytest.approx(front, rel=1e-9)
    assert len(NonDominatedSorting().do(front, only_non_dominated_front=True)) == len(front)


def test_fronts_have_as_many_pieces_as_the_family_says(member):
    if member.n_obj == 2:
        front = member.pareto_front()
        steps = np.diff(front, axis=0) / np.ptp(front, axis=0)
        gaps = np.count_nonzero(np.linalg.norm(steps, axis=1) > 0.02)
        assert gaps == (member.variant in {"resonant", "calibrated_duty_cycle"})


@pytest.mark.parametrize(
    "member",
    others_at_night(FAMILY, "resonant", "calibrated_tolerance"),
    indirect=True,
    scope="module",
)
def test_nothing_undercuts_a_stored_front(member):
    front = member.pareto_front()
    evolved = minimize(member, NSGA2(pop_size=100), ("n_gen", 40), seed=1).F
    found = np.vstack([evolved, member.evaluate(designs(member, 2000))])
    gain = ((front[None] - found[:, None]) / np.ptp(front, axis=0)).min(axis=2)
    assert gain.max() < 1e-6


def test_stored_fronts_satisfy_the_first_order_conditions(member):
    """Karush, Kuhn, Tucker: weighted slopes vanish but for what pushes on the bounds."""
    front, chosen = member.pareto_front(), member.pareto_set()
    rows = np.random.default_rng(1).choice(len(front), 200, replace=False)
    _, dF = member.evaluate(chosen[rows], return_values_of=["F", "dF"])
    width = member.xu - member.xl
    slopes = dF * width / np.ptp(front, axis=0)[:, None]
    residuals = []
    for x, slope in zip(chosen[rows], slopes, strict=True):
        lower, upper = x - member.xl < 1e-7 * width, member.xu - x < 1e-7 * width
        outwards = np.hstack([-np.eye(member.n_var)[:, lower], np.eye(member.n_var)[:, upper]])
        scale = np.abs(slope).max()
        columns = np.hstack([slope.T / scale, outwards])
        weights_sum_to_one = np.r_[np.ones(member.n_obj), np.zeros(outwards.shape[1])]
        system = np.vstack([columns, weights_sum_to_one])
        residuals.append(nnls(system, np.r_[np.zeros(member.n_var), 1.0])[1])
    assert np.median(residuals) < 1e-6
    assert max(residuals) < 1e-2


def test_members_survive_pickle_and_deepcopy(member):
    U = designs(member, 4)
    for twin in (pickle.loads(pickle.dumps(member)), copy.deepcopy(member)):
        assert np.array_equal(twin.evaluate(U), member.evaluate(U))
        assert np.array_equal(twin.pareto_front(), member.pareto_front())


def test_one_rated_condition_is_the_plain_problem():
    plain = RobustDTE(order=2)
    (rated,) = plain.conditions
    assert rated == condition(2000.0, 40.0)
    again = RobustDTE(order=2, conditions=[OperatingCondition(*rated_values(rated), weight=7.0)])
    U = designs(plain, 20)
    assert np.array_equal(again.evaluate(U), plain.evaluate(U))
    elsewhere = RobustDTE(plain.model.at(50.0, 10.0), order=2, conditions=[rated])
    assert np.array_equal(elsewhere.evaluate(U), plain.evaluate(U))
    assert elsewhere.settings == again.settings != plain.settings


def rated_values(entry):
    return entry.input_speed, entry.load_torque


def test_the_mean_over_a_duty_cycle_is_the_mean_of_the_means():
    cycle = [condition(300, 40, 1.0), condition(1700, 10, 2.0), condition(2000, 25, 5.0)]
    together = RobustDTE(order=2, conditions=cycle)
    U = designs(together, 20)
    alone = np.array([RobustDTE(order=2, conditions=[entry]).evaluate(U) for entry in cycle])
    shares = np.array([1.0, 2.0, 5.0]) / 8.0
    mean, std = together.evaluate(U).T
    assert mean == pytest.approx(shares @ alone[:, :, 0], rel=1e-12)
    # Minkowski's inequality: parts that are bad here need not be bad there.
    assert np.all(std < shares @ alone[:, :, 1])


def test_only_the_ratios_of_weights_matter():
    thrice = [condition(500, 40, 0.3), condition(2000, 40, 0.6)]
    once = [condition(500, 40, 0.1), condition(2000, 40, 0.2)]
    first, second = (RobustDTE(order=1, conditions=cycle) for cycle in (once, thrice))
    U = designs(first, 5)
    assert second.evaluate(U) == pytest.approx(first.evaluate(U), rel=1e-12)
    assert second.settings == first.settings
    other = RobustDTE(order=1, conditions=[once[0], condition(2000, 40, 0.3)])
    assert np.abs(other.evaluate(U) / first.evaluate(U) - 1.0).max() > 1e-3
    assert other.settings != first.settings


def test_the_shipped_duty_cycle_stays_within_the_ratings():
    sheet = preset("calibrated").sheet
    assert sum(entry.weight for entry in DUTY_CYCLE) == pytest.approx(1.0)
    for entry in DUTY_CYCLE:
        assert entry.input_speed <= sheet.input_speed * (1.0 + 1e-12)
        assert entry.load_torque <= sheet.load_torque
    assert DUTY_CYCLE[2] == condition(1600.0, 20.0, 0.3)


def test_the_surrogate_predicts_the_dte_over_the_duty_cycle():
    problem = RobustDTE(conditions=DUTY_CYCLE)
    box = problem.surrogate.box
    points = np.random.default_rng(3).uniform(box.lower, box.upper, (200, 5))
    actual = sum(
        share * problem.model.at(*rated_values(entry)).dte_arcsec(points)
        for entry, share in zip(DUTY_CYCLE, (0.1, 0.2, 0.3, 0.4), strict=True)
    )
    error = problem.surrogate(points) - actual
    assert 1.0 - np.mean(error**2) / np.var(actual) > 0.999
    rows = problem.surrogate.provenance["conditions"]
    assert [row["share"] for row in rows] == [0.1, 0.2, 0.3, 0.4]


def test_a_front_is_not_lent_to_another_duty_cycle():
    assert RobustDTE(conditions=DUTY_CYCLE[1:]).pareto_front() is None
    assert RobustDTE(conditions=[condition(2000.0, 40.0)]).pareto_front() is None


def test_an_unstable_condition_is_named():
    effects = (LoadInertia(0.395), DampingReference(0.01), MeshStiffnessVariation(0.3, 0.0))
    model = preset("calibrated")
    shaky = type(model)("shaky", "", "", model.sheet, model.kinematic_error, effects)
    with pytest.raises(UnstableDrive, match=r"at 2673\.8 r/min and 40 N\.m, design"):
        RobustDTE(shaky, order=1, conditions=[OperatingCondition(280.0, 40.0)])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 40.0), "input_speed is 0.0, allowed: a finite number above 0"),
        ((200.0, -1.0), "load_torque is -1.0"),
        ((200.0, 40.0, 0.0), "weight is 0.0"),
        ((float("nan"), 40.0), "input_speed is nan"),
        ((200.0, "40"), "load_torque is '40'"),
    ],
)
def test_bad_conditions_are_named(arguments, message):
    with pytest.raises(InvalidInput) as caught:
        OperatingCondition(*arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("conditions", "message"),
    [
        ([], "conditions is [], allowed: one or more"),
        ("cycle.csv", "conditions[0] is 'c', allowed: an OperatingCondition"),
        (condition(2000, 40), "conditions is OperatingCondition("),
        ([condition(2000, 40), (1.0, 2.0)], "conditions[1] is (1.0, 2.0)"),
    ],
)
@pytest.mark.parametrize("problem", [RobustDTE, RobustDTETolerance])
def test_what_is_no_duty_cycle_is_refused(problem, conditions, message):
    with pytest.raises(InvalidInput) as caught:
        problem(conditions=conditions)
    assert message in str(caught.value)


def test_conditions_are_read_in_any_order_of_columns(tmp_path):
    path = tmp_path / "cycle.csv"
    path.write_text("# ours\n\nweight, speed_rpm,load_Nm\n1,2000,40\n# fast\n2.5,60,0\n")
    assert load_conditions(path) == (condition(2000, 40), condition(60, 0, 2.5))
    assert load_conditions(str(path))[1].input_speed == pytest.approx(2 * np.pi)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "cycle.csv, line 1: columns is []"),
        ("speed_rpm,load_Nm\n1,2\n", "cycle.csv, line 1: columns is ['speed_rpm', 'load_Nm']"),
        ("speed_rpm,load_Nm,weight,name\n", "allowed: speed_rpm, load_Nm, weight, each once"),
        ("#\nspeed_rpm,load_Nm,weight\n", "cycle.csv, line 2: rows below the header is 0"),
        ("speed_rpm,load_Nm,weight\n1,2,3\n1,2\n", "line 3: number of cells is 2, allowed: 3"),
        ("speed_rpm,load_Nm,weight\n1,2,3\n\n1,two,3\n", "line 4: load_Nm is 'two'"),
        ("speed_rpm,load_Nm,weight\n0,2,3\n", "line 2: speed_rpm is 0.0, allowed: a finite"),
        ("speed_rpm,load_Nm,weight\n1,2,nan\n", "line 2: weight is 'nan'"),
        ("speed_rpm,load_Nm,weight\n1,-2,1\n", "line 2: load_Nm is -2.0"),
    ],
)
def test_bad_files_are_told_with_their_line(tmp_path, text, message):
    path = tmp_path / "cycle.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput) as caught:
        load_conditions(path)
    assert message in str(caught.value)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "cycle.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidInput, match=r"cycle\.csv is .* allowed: CSV text in UTF-8"):
        load_conditions(tmp_path / "cycle.csv")


def test_at_the_papers_tolerance_it_is_the_papers_problem(tolerance_problem):
    plain = RobustDTE()
    U = designs(plain, 30)
    F = tolerance_problem.evaluate(np.column_stack([U, np.full(30, 0.05)]))
    assert F[:, :2] == pytest.approx(plain.evaluate(U), rel=1e-12)
    assert F[:, 2] == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("tolerance", [0.01, 0.033, 0.08])
def test_a_slice_is_the_problem_at_that_tolerance(tolerance_problem, tolerance):
    at_tolerance = tolerance_problem.at_tolerance(tolerance)
    U = designs(at_tolerance, 30)
    F = tolerance_problem.evaluate(np.column_stack([U, np.full(30, tolerance)]))
    assert F[:, :2] == pytest.approx(at_tolerance.evaluate(U), rel=1e-12)
    assert F[:, 2] == pytest.approx(0.05 / tolerance)


def test_a_looser_tolerance_costs_less_and_scatters_more(tolerance_problem):
    U = np.repeat(designs(tolerance_problem, 20)[:, None], 8, axis=1)
    U[:, :, -1] = np.linspace(0.01, 0.08, 8)
    F = tolerance_problem.evaluate(U.reshape(-1, 5)).reshape(20, 8, 3)
    assert np.all(np.diff(F[:, :, 1], axis=1) > 0.0)
    assert np.all(np.diff(F[:, :, 2], axis=1) < 0.0)


def test_the_front_at_the_papers_tolerance_is_that_of_the_papers_problem(tolerance_problem):
    """Two fronts that were searched for and stored apart."""
    front = tolerance_problem.pareto_front()
    rows = tolerance_problem.pareto_set()[:, -1] == 0.05
    mean, std, cost = front[rows].T
    stored = RobustDTE().pareto_front()
    width = np.ptp(stored, axis=0)
    assert rows.sum() >= 40
    assert cost == pytest.approx(1.0)
    assert abs(mean[0] - stored[0, 0]) < 1e-6 * width[0]
    assert abs(std[-1] - stored[-1, 1]) < 1e-6 * width[1]
    # The stored front is drawn through by straight lines, so between its points it lies above.
    between = np.interp(mean, *stored.T)
    assert np.abs(between - std).max() < 1e-3 * width[1]


def test_the_sheet_is_dense(tolerance_problem):
    front = tolerance_problem.pareto_front()
    scaled = (front - front.min(axis=0)) / np.ptp(front, axis=0)
    rng = np.random.default_rng(1)
    for row in rng.choice(len(front), 100, replace=False):
        distance = np.sort(np.linalg.norm(scaled - scaled[row], axis=1))
        assert distance[2] < 0.05
    tolerances = np.unique(tolerance_problem.pareto_set()[:, -1])
    assert len(tolerances) == 40
    assert (tolerances[0], tolerances[-1]) == (0.01, 0.08)


def test_gradients_of_three_objectives_equal_finite_differences(tolerance_problem):
    centre = np.r_[tolerance_problem.nominal, 0.045]
    U = designs(tolerance_problem, 5) * 0.98 + centre * 0.02
    F, dF = tolerance_problem.evaluate(U, return_values_of=["F", "dF"])
    assert dF.shape == (5, 3, 5)
    for variable in range(5):
        step = 1e-4 * centre * np.eye(5)[variable]
        difference = tolerance_problem.evaluate(U + step) - tolerance_problem.evaluate(U - step)
        expected = difference / (2 * step[variable])
        rounding = 1e-13 * F.max() / step[variable]
        assert dF[:, :, variable] == pytest.approx(expected, rel=1e-4, abs=rounding)


def test_three_objective_algorithms_run_on_it(tolerance_problem):
    directions = get_reference_directions("das-dennis", 3, n_partitions=6)
    found = minimize(tolerance_problem, NSGA3(directions), ("n_gen", 10), seed=1)
    assert found.F.shape[1] == 3
    assert np.all(tolerance_problem.xl <= found.X)
    assert np.all(tolerance_problem.xu >= found.X)


def test_names_and_units_of_the_tolerance_problem(tolerance_problem):
    assert tolerance_problem.var_names == ("K", "J_in", "B_in", "B_fc", "tolerance")
    assert tolerance_problem.obj_names[2] == "tolerance_cost"
    names = {*tolerance_problem.var_names, *tolerance_problem.obj_names}
    assert set(tolerance_problem.units) == names
    assert tolerance_problem.units["tolerance"] == "1"
    assert RobustDTETolerance(order=1).pareto_front() is None
    assert RobustDTETolerance(order=1).variant == "calibrated_order1_tolerance"
    assert RobustDTETolerance(tolerances=(0.01, 0.07)).pareto_set() is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerances": (0.0, 0.05)}, "tolerances[0] is 0.0"),
        ({"tolerances": (0.05, 0.05)}, "tolerances[0] is 0.05, allowed: a finite number above 0"),
        ({"tolerances": (0.05, 1.0)}, "tolerances[1] is 1.0"),
        ({"tolerances": (0.05, np.nan)}, "tolerances[1] is nan"),
        ({"tolerances": 0.05}, "shape of tolerances is ()"),
        ({"model": "measured"}, "model is 'measured'"),
        ({"order": 7}, "order is 7, allowed: 1 to 6"),
        ({"box": 0.0}, "box is 0.0"),
    ],
)
def test_bad_arguments_of_the_tolerance_problem_are_named(arguments, message):
    with pytest.raises(InvalidInput) as caught:
        RobustDTETolerance(**arguments)
    assert message in str(caught.value)


def test_no_tolerance_out_of_range_is_evaluated(tolerance_problem):
    U = designs(tolerance_problem, 3)
    U[1, -1] = 0.081
    with pytest.raises(ExtrapolationError, match=r"tolerance is 0\.081"):
        tolerance_problem.evaluate(U)
    with pytest.raises(InvalidInput, match=r"tolerance is 0\.081"):
        tolerance_problem.at_tolerance(0.081)
