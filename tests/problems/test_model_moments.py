"""Moments of the DTE by quadrature of the drive model, and the problem of that front."""

import copy
import pickle

import numpy as np
import pytest
from places import SHARED
from scipy.stats import qmc, truncnorm

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive import load_datasheet, load_model, preset
from pymoo_hdte.problems import RobustDTE, RobustDTEDirect, robust_dte_family
from pymoo_hdte.surrogate import sobol_indices

CASES = SHARED / "cases"


@pytest.fixture(scope="module")
def direct():
    return robust_dte_family()["calibrated_direct"]()


def soft_windup():
    """Return the model of the case whose drive has no steady state in its resonance."""
    if not CASES.is_dir():
        pytest.skip("the cases are not here")
    return load_model(CASES / "csg32_windup_model.toml", load_datasheet(CASES / "csg32.toml"))


def test_they_are_the_moments_of_random_drives(direct):
    design = direct.nominal * [1.1, 0.75, 1.0, 1.1]
    cube = qmc.Sobol(5, rng=np.random.default_rng(1)).random(2**12)
    mean, std = direct.model.nominal[0], direct.model.kinematic_error.std
    theta_s = truncnorm(-3.0, 3.0, loc=mean, scale=std).ppf(cube[:, 0])
    dte = direct.model.dte_arcsec(np.column_stack([theta_s, design * (0.95 + 0.1 * cube[:, 1:])]))
    found = direct.moments(design[None])[0]
    assert found == pytest.approx([dte.mean(), dte.std()], abs=0.01)
    assert np.array_equal(direct.evaluate(design[None])[0], found)


def test_where_a_surrogate_is_nearly_exact_both_agree():
    surrogate, model = RobustDTE("published"), RobustDTEDirect("published", nodes=(3, 3, 3, 3, 3))
    designs = np.random.default_rng(1).uniform(model.xl, model.xu, (4, 4))
    assert model.evaluate(designs) == pytest.approx(surrogate.evaluate(designs), rel=2e-5)


def test_sources_are_the_sobol_indices():
    # Of order 5 the surrogate of this model is nearly exact here.
    surrogate = RobustDTE("resonant", order=5)
    model = RobustDTEDirect("resonant", nodes=(6, 4, 4, 2, 3))
    design = model.nominal * 0.95
    found = model.moments.sources(design)
    wanted = sobol_indices(surrogate.surrogate, surrogate.inputs, design)
    assert found.first == pytest.approx(wanted.first, abs=3e-3)
    assert found.total == pytest.approx(wanted.total, abs=3e-3)
    assert found.variance**0.5 == pytest.approx(model.evaluate(design[None])[0, 1], rel=1e-9)


def test_sources_need_two_nodes_of_each_input_but_never_too_many():
    for nodes, wanted in (((6, 3, 3, 1, 2), (6, 3, 3, 2, 2)), ((24, 4, 4, 1, 6),) * 2):
        moments = RobustDTEDirect("published", nodes=nodes).moments.at_least_two()
        assert moments.nodes == wanted
    assert 0.9 < moments.sources(moments.model.nominal[1:]).first[0] <= 1.0


def test_a_design_without_steady_state_is_nan_and_named():
    problem = RobustDTEDirect(soft_windup(), nodes=(2, 2, 2, 1, 1))
    designs = problem.nominal * [[0.75, 1.25, 1.0, 1.0], [1.22, 0.8, 1.0, 1.0]]
    found = problem.moments(designs)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()
    with pytest.raises(ArithmeticError, match=r"around the design K = 9\.516e\+04 N\.m/rad, J_in"):
        problem.evaluate(designs)
    node = problem.moments.lost(designs[1])
    assert node["K"] != designs[1, 0]
    assert np.isnan(problem.model.dte_where_found(np.array([list(node.values())])))
    assert problem.moments.lost(designs[0]) is None


def test_nodes_are_added_until_doubling_them_changes_little(direct):
    designs = direct.pareto_set()[:1]
    wanted = np.array([0.05, 0.02])
    refined = direct.moments.with_nodes((2, 2, 1, 1, 1)).refined(designs, wanted)
    finest = direct.moments.with_nodes((16, 4, 4, 1, 2))(designs)
    assert np.prod(refined.nodes) > 4
    assert np.all(np.abs(refined(designs) - finest) <= wanted)


@pytest.mark.parametrize(
    "nodes", [(3, 3, 3, 3), (3, 3, 3, 3, 0), (2.5, 1, 1, 1, 1), (9, 9, 9, 9, 9)]
)
def test_wrong_nodes_are_refused(nodes):
    with pytest.raises(InvalidInput, match="nodes is"):
        RobustDTEDirect("published", nodes=nodes)


def test_the_stored_front_is_the_models(direct):
    """To 1 % of its width, in both objectives, against a quadrature that is far finer."""
    front, chosen = direct.pareto_front(), direct.pareto_set()
    rows = np.linspace(0, len(front) - 1, 5).round().astype(int)
    width = np.ptp(front, axis=0)
    assert direct.evaluate(chosen[rows]) == pytest.approx(front[rows], rel=1e-9)
    finer = direct.moments.with_nodes((24, 4, 4, 1, 3))(chosen[rows])
    assert np.abs(finer - front[rows]).max() < 0.01 * width.min()
    assert np.all(np.diff(front[:, 0]) > 0.0)
    assert np.all(np.diff(front[:, 1]) < 0.0)
    steps = np.linalg.norm(np.diff(front, axis=0) / width, axis=1)
    assert steps.max() < 0.05


def test_the_front_of_the_order_3_surrogate_lies_behind_it(direct):
    surrogate = RobustDTE()
    front, chosen = direct.pareto_front(), surrogate.pareto_set()[::100]
    width = np.ptp(front, axis=0)
    behind = ((direct.evaluate(chosen)[:, None] - front) / width).min(axis=2).max(axis=1)
    assert np.all(behind > 0.0)
    assert np.median(behind) > 0.1


def test_random_designs_do_not_undercut_it(direct):
    designs = np.random.default_rng(2).uniform(direct.xl, direct.xu, (60, 4))
    # Near the front, where chances are best.
    designs[:, 0] = direct.nominal[0] * np.linspace(1.07, 1.13, 60)
    designs[:, 1] = direct.xl[1]
    gain = (direct.pareto_front() - direct.evaluate(designs)[:, None]) / np.ptp(
        direct.pareto_front(), axis=0
    )
    assert gain.min(axis=2).max() < 0.01


def test_it_survives_pickle_and_deepcopy_and_lends_its_front_to_no_other(direct):
    designs = direct.nominal[None]
    for twin in (pickle.loads(pickle.dumps(direct)), copy.deepcopy(direct)):
        assert np.array_equal(twin.evaluate(designs), direct.evaluate(designs))
        assert np.array_equal(twin.pareto_front(), direct.pareto_front())
    assert RobustDTEDirect(nodes=(6, 3, 3, 1, 2)).pareto_front() is None
    assert RobustDTEDirect(preset("resonant")).pareto_front() is None
    assert "calibrated_direct" in direct.name()
