"""The second look at designs of a front: as sharp as the front is narrow, and all of it counted."""

from dataclasses import replace

import numpy as np
import pytest
from places import SHARED

from pymoo_hdte.cli import design_check
from pymoo_hdte.cli.design_check import check_designs
from pymoo_hdte.cli.design_study import AGREEMENT, Settings, run_design_study
from pymoo_hdte.cli.optimum_report import optimum_document
from pymoo_hdte.drive import load_datasheet, load_model, preset
from pymoo_hdte.problems import RobustDTEDirect

CASES = SHARED / "cases"


def size_32(name):
    if not CASES.is_dir():
        pytest.skip("the cases are not here")
    return load_model(CASES / f"{name}.toml", load_datasheet(CASES / "csg32.toml"))


def test_what_is_taken_as_exact_is_orthonormal(monkeypatch):
    monkeypatch.setattr(design_check, "DRIVES", 2**12)
    problem = RobustDTEDirect("published")
    standard, relative = design_check._drives(problem, np.random.default_rng(1))
    basis = design_check._basis(problem, standard).reshape(-1, 21)
    assert basis.T @ basis / len(basis) == pytest.approx(np.eye(21), abs=5e-3)
    theta_s = relative[..., 0].ravel()
    assert theta_s.mean() == pytest.approx(problem.model.nominal[0], rel=1e-4)


@pytest.mark.parametrize(
    "name", ["csg32_model", pytest.param("csg32_windup_model", marks=pytest.mark.nightly)]
)
def test_the_check_is_sharp_where_the_front_is_narrow(name):
    problem = RobustDTEDirect(size_32(name))
    design = problem.nominal * [0.75, 1.25, 1.0, 1.0]
    check = check_designs(problem, design[None], np.random.default_rng(1))[0]
    # Width of the front in mean and standard deviation, arcsec.
    assert 2.0 * check.mean_error < 0.5 * AGREEMENT * 1.04
    assert 2.0 * check.std_error < 0.5 * AGREEMENT * 0.2


@pytest.mark.nightly
def test_standard_errors_are_the_scatter_over_other_drives():
    problem = RobustDTEDirect("published")
    rngs = map(np.random.default_rng, range(25))
    checks = [check_designs(problem, problem.nominal[None], rng)[0] for rng in rngs]
    means, stds = np.array([(one.mean, one.std) for one in checks]).T
    errors = np.mean([(one.mean_error, one.std_error) for one in checks], axis=0)
    assert errors == pytest.approx([means.std(), stds.std()], rel=0.5)


def test_all_searches_are_counted(monkeypatch):
    model, nodes = preset("published"), (6, 1, 1, 1, 1)
    asked = []

    def check(problem, designs, rng):
        found = check_designs(problem, designs, rng)
        asked.append((problem.moments.nodes, problem.moments.n_runs))
        # The first search does not hold on other drives.
        off = 1.0 if len(asked) == 1 else 0.0
        return [replace(one, means=one.means + off) for one in found]

    def refined(moments, designs, wanted):
        return moments.with_nodes(nodes)

    monkeypatch.setattr("pymoo_hdte.cli.design_study.FIRST_NODES", (3, 1, 1, 1, 1))
    monkeypatch.setattr("pymoo_hdte.cli.design_study.check_designs", check)
    monkeypatch.setattr("pymoo_hdte.problems.model_moments.ModelMoments.refined", refined)
    told = []
    settings = Settings(0.05, 0.03, None, 40, 1)
    found = run_design_study(model, "balanced", settings, lambda *now: told.append(now[0]))
    assert [one[0] for one in asked] == [(3, 1, 1, 1, 1), nodes]
    evaluated = optimum_document(found, ())["evaluated"]
    assert evaluated["designs"] == told[-1] > found.search.evaluated
    assert evaluated["model_runs"] >= asked[0][1] + 6 * found.search.evaluated
