"""The robust problems inside pymoo: closed forms, gradients, stored fronts, bad input."""

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import (
    DampingReference,
    LoadInertia,
    MeshStiffnessVariation,
    UnstableDrive,
    preset,
)
from pymoo_hdte.problems import RobustDTE, RobustToy
from pymoo_hdte.problems.reference import ReferenceFront, format_reference, load_reference
from pymoo_hdte.surrogate import ChebyshevSurrogate, ExtrapolationError
from pymoo_hdte.units import ARCSEC


@pytest.fixture(scope="module", params=["calibrated", "resonant"])
def problem(request):
    return RobustDTE(request.param)


def designs(problem, n, seed=1):
    return np.random.default_rng(seed).uniform(problem.xl, problem.xu, (n, problem.n_var))


def test_toy_moments_equal_the_closed_form():
    for tolerance in (0.01, 0.05, 0.2):
        toy = RobustToy(tolerance=tolerance)
        U = designs(toy, 50)
        assert toy.evaluate(U) == pytest.approx(np.column_stack(toy.closed_form(U)), rel=1e-12)


def test_sampled_toy_is_within_its_sampling_error_of_the_closed_form():
    n = 20_000
    toy = RobustToy(moments="sample", n_samples=n)
    mean, std = toy.evaluate(designs(toy, 20)).T
    true_mean, true_std = toy.closed_form(designs(toy, 20))
    assert np.all(np.abs(mean - true_mean) < 5 * true_std / np.sqrt(n))
    assert std == pytest.approx(true_std, rel=0.05)


def test_nothing_dominates_the_toys_front_and_its_set_gives_it():
    toy = RobustToy()
    front, chosen = toy.pareto_front(), toy.pareto_set()
    assert toy.evaluate(chosen) == pytest.approx(front, rel=1e-12)
    F = toy.evaluate(designs(toy, 20_000))
    # A design dominates the front if it lies below the curve f2(f1) by interpolation.
    below = np.interp(F[:, 0], front[:, 0], front[:, 1]) - F[:, 1]
    inside = F[:, 0] <= front[-1, 0]
    assert below[inside].max() < 1e-6


@pytest.mark.parametrize("moments", ["exact", "sample"])
def test_gradients_equal_finite_differences(moments):
    problem = RobustDTE(moments=moments, n_samples=200)
    U = designs(problem, 5) * 0.98 + problem.nominal * 0.02
    F, dF = problem.evaluate(U, return_values_of=["F", "dF"])
    assert F.shape == (5, 2)
    assert dF.shape == (5, 2, 4)
    for variable in range(4):
        step = 1e-3 * problem.nominal * np.eye(4)[variable]
        difference = problem.evaluate(U + step) - problem.evaluate(U - step)
        expected = difference / (2 * step[variable])
        rounding = 1e-14 * F.max() / step[variable]
        assert dF[:, :, variable] == pytest.approx(expected, rel=1e-4, abs=rounding)


@pytest.mark.parametrize("problem", others_at_night(["calibrated", "resonant"]), indirect=True)
def test_exact_objectives_are_the_model_averaged_over_its_scatter(problem):
    """100,000 samples of the surrogate at each design against the exact moments."""
    sampled = RobustDTE(problem.model, moments="sample", n_samples=100_000)
    U = designs(problem, 3)
    exact, drawn = problem.evaluate(U), sampled.evaluate(U)
    assert np.all(np.abs(exact[:, 0] - drawn[:, 0]) < 4 * exact[:, 1] / np.sqrt(100_000))
    assert drawn[:, 1] == pytest.approx(exact[:, 1], rel=0.01)


def test_surrogate_predicts_the_drive_model(problem):
    box = problem.surrogate.box
    points = np.random.default_rng(3).uniform(box.lower, box.upper, (200, 5))
    actual = problem.model.dte_arcsec(points)
    error = problem.surrogate(points) - actual
    assert 1.0 - np.mean(error**2) / np.var(actual) > 0.99


def test_stored_front_is_on_the_surrogate_dense_and_undominated(problem):
    front, chosen = problem.pareto_front(), problem.pareto_set()
    assert len(front) >= 1000
    assert problem.evaluate(chosen) == pytest.approx(front, rel=1e-9)
    assert np.all(np.diff(front[:, 0]) > 0.0)
    assert np.all(np.diff(front[:, 1]) < 0.0)
    steps = np.hypot(*(np.diff(front, axis=0) / np.ptp(front, axis=0)).T)
    assert np.sum(steps > 0.005) == {"calibrated": 0, "resonant": 1}[problem.model.name]
    found = minimize(problem, NSGA2(pop_size=100), ("n_gen", 60), seed=1).F
    gain = ((front[None] - found[:, None]) / np.ptp(front, axis=0)).min(axis=2)
    assert gain.max() < 1e-6


def test_stored_front_satisfies_first_order_conditions(problem):
    """Some mixture of both gradients vanishes inside the box and pushes outwards on its bounds."""
    front, chosen = problem.pareto_front()[5:-5], problem.pareto_set()[5:-5]
    _, dF = problem.evaluate(chosen, return_values_of=["F", "dF"])
    width = problem.xu - problem.xl
    slopes = dF * width / np.ptp(front, axis=0)[:, None]
    at_lower, at_upper = chosen - problem.xl < 1e-7 * width, problem.xu - chosen < 1e-7 * width
    free = ~(at_lower | at_upper)
    apart = np.where(free, slopes[:, 0] - slopes[:, 1], 0.0)
    some_free = free.any(axis=1)
    weight = -np.sum(apart * slopes[:, 1], axis=1)[some_free] / np.sum(apart**2, axis=1)[some_free]
    assert np.all((weight > 0.0) & (weight < 1.0))
    mixed = slopes[:, 1][some_free] + weight[:, None] * (slopes[:, 0] - slopes[:, 1])[some_free]
    scale = np.abs(slopes[some_free]).max(axis=(1, 2))[:, None]
    residual = np.where(free[some_free], mixed, 0.0)
    residual = np.where(at_lower[some_free], np.minimum(mixed, 0.0), residual)
    residual = np.where(at_upper[some_free], np.maximum(mixed, 0.0), residual)
    assert np.median(np.abs(residual / scale)) < 1e-6
    assert np.abs(residual / scale).max() < 1e-2


@pytest.mark.parametrize("field", ["output_inertia", "output_damping", "stiffness"])
def test_a_front_is_not_lent_to_another_drive(field):
    model = preset("calibrated")
    nominal = replace(model.sheet.nominal, **{field: getattr(model.sheet.nominal, field) * 1.1})
    other = replace(model, sheet=replace(model.sheet, nominal=nominal))
    assert RobustDTE(other, order=1).settings["nominal"] != RobustDTE(order=1).settings["nominal"]
    assert RobustDTE(other).pareto_front() is None
    teeth = replace(model.sheet, circular_spline_teeth=204)
    assert RobustDTE(replace(model, sheet=teeth)).pareto_front() is None


def test_the_surrogate_carries_the_model_that_made_it(tmp_path):
    problem = RobustDTE(order=1)
    problem.surrogate.save(tmp_path / "surrogate.npz")
    loaded = ChebyshevSurrogate.load(tmp_path / "surrogate.npz")
    assert loaded.provenance["model"] == json.loads(json.dumps(problem.model.to_dict()))


def test_no_designs_give_no_objectives(problem):
    assert problem.evaluate(np.empty((0, 4))).shape == (0, 2)


def test_models_without_a_positive_static_error_or_a_steady_state_are_refused():
    model = preset("calibrated")
    wide = replace(model.kinematic_error, std=13 * ARCSEC)
    with pytest.raises(InvalidInput, match=r"kinematic_error\.std in arcsec is 1[23]\."):
        RobustDTE(replace(model, kinematic_error=wide))
    effects = (LoadInertia(0.395), DampingReference(0.01), MeshStiffnessVariation(0.3, 0.0))
    with pytest.raises(UnstableDrive):
        RobustDTE(replace(model, effects=effects).at(280.0, 40.0), order=1)


def test_fronts_belong_to_their_settings_only():
    assert RobustDTE(order=2).pareto_front() is None
    assert RobustDTE(tolerance=0.04).pareto_set() is None
    assert RobustDTE(moments="sample", n_samples=10).pareto_front() is None
    assert RobustDTE(preset("calibrated")).pareto_front() is not None
    slow = preset("calibrated").at(100.0, 40.0)
    assert RobustDTE(slow).pareto_front() is None


def test_printed_model_has_a_front_of_one_point():
    assert RobustDTE("published").pareto_front().shape == (1, 2)


def test_reference_files_round_trip_exactly(tmp_path, monkeypatch):
    rng = np.random.default_rng(1)
    reference = ReferenceFront(rng.random((5, 2)), rng.random((5, 3)))
    settings = {"model": {"a": (1, 2)}, "tolerance": 0.1}
    text = format_reference(reference, settings, ("f1", "f2", "a", "b", "c"))
    (tmp_path / "front_x.csv").write_text(text, encoding="utf-8")
    monkeypatch.setattr("pymoo_hdte.problems.reference._FOLDER", tmp_path)
    loaded = load_reference("x", settings)
    assert np.array_equal(loaded.front, reference.front)
    assert np.array_equal(loaded.designs, reference.designs)
    assert load_reference("x", settings | {"tolerance": 0.2}) is None
    assert load_reference("y", settings) is None


def test_problem_survives_pickle_and_deepcopy(problem):
    U = designs(problem, 4)
    expected = problem.evaluate(U)
    for twin in (pickle.loads(pickle.dumps(problem)), copy.deepcopy(problem)):
        assert np.array_equal(twin.evaluate(U), expected)
        assert np.array_equal(twin.pareto_front(), problem.pareto_front())


def test_names_and_units_follow_the_columns(problem):
    assert problem.var_names == ("K", "J_in", "B_in", "B_fc")
    assert problem.obj_names == ("mean_dte_arcsec", "std_dte_arcsec")
    assert set(problem.units) == {*problem.var_names, *problem.obj_names}
    assert problem.units["K"] == "N.m/rad"
    assert problem.nominal == pytest.approx((problem.xl + problem.xu) / 2)


def test_a_wide_search_space_widens_the_surrogate_instead_of_extrapolating():
    wide = RobustDTE(order=1, box=0.5, tolerance=0.1)
    assert wide.surrogate.box.upper[1:] == pytest.approx(wide.nominal * 1.65)
    assert np.all(np.isfinite(wide.evaluate(np.array([wide.xl, wide.xu]))))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model": "measured"}, "model is 'measured'"),
        ({"order": 0}, "order is 0, allowed: a whole number of at least 1"),
        ({"order": 2.5}, "order is 2.5"),
        ({"order": 7}, "order is 7, allowed: 1 to 6"),
        ({"model": None}, "model is None, allowed: a DriveModel or one of published"),
        ({"moments": "sample", "sample_seed": -1}, "sample_seed is -1"),
        ({"moments": "mean"}, "moments is 'mean'"),
        ({"moments": "sample", "n_samples": 1}, "n_samples is 1"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"tolerance": float("nan")}, "tolerance is nan"),
        ({"box": 1.0}, "box is 1.0"),
        ({"box": "wide"}, "box is 'wide'"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(InvalidInput) as caught:
        RobustDTE(**arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_no_nan_leaves_the_problem(problem, value):
    U = designs(problem, 3)
    U[1, 2] = value
    with pytest.raises(ExtrapolationError, match="B_in"):
        problem.evaluate(U)
