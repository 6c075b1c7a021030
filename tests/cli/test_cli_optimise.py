"""``pymoo-hdte optimise``: what it writes is the optimum it claims, and reads back as a drive."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc, truncnorm

from pymoo_hdte.cli import __main__ as cli
from pymoo_hdte.cli import design_study, optimum_report
from pymoo_hdte.cli.design_study import Gain, Settings, _check, run_design_study
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.drive import hs_20_100, load_datasheet, load_model, preset
from pymoo_hdte.drive.toml_text import model_toml, sheet_toml
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal

QUICK = ("--order", "2", "--evaluations", "1000")
SETTINGS = Settings(0.05, 0.25, 3, None, 1000, 1)


def optimise(*arguments):
    return cli.main(["optimise", *map(str, arguments)])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("optimise") / "report"
    assert optimise("hs_20_100", "--out", out, "--quiet", *QUICK) == 0
    return out


@pytest.fixture(scope="module")
def study():
    return run_design_study(preset("calibrated"), "balanced", SETTINGS)


@pytest.fixture(scope="module")
def document(written):
    return json.loads((written / "optimum.json").read_text())


@pytest.fixture(scope="module")
def front(written):
    with (written / "front.csv").open() as file:
        return np.array(list(csv.reader(file))[1:], dtype=float)


def test_the_front_holds_what_the_problem_says_of_its_designs(front):
    problem = RobustDTE(order=2)
    np.testing.assert_allclose(problem.evaluate(front[:, 2:]), front[:, :2], rtol=1e-13)
    assert np.all(np.diff(front[:, 0]) > 0.0)
    assert np.all(np.diff(front[:, 1]) < 0.0)


def test_each_preference_has_its_design(front, document):
    for word, weights in PREFERENCES.items():
        row = WeightedUtopia(weights).do(front[:, :2])
        found = document["designs"][word]
        assert found["row_of_front"] == row
        values = [found[name]["value"] for name in ("K", "J_in", "B_in", "B_fc")]
        np.testing.assert_array_equal(values, front[row, 2:])
        assert (found["mean_dte_arcsec"], found["std_dte_arcsec"]) == tuple(front[row, :2])


def test_the_chosen_drive_reads_back_and_has_the_dte_of_its_design(written, document):
    sheet = load_datasheet(written / "optimum_sheet.toml")
    model = load_model(written / "optimum_model.toml", sheet)
    chosen = document["designs"]["balanced"]
    names = ("K", "J_in", "B_in", "B_fc")
    np.testing.assert_array_equal(model.nominal[1:], [chosen[name]["value"] for name in names])
    design = np.r_[model.nominal[0], model.nominal[1:]]
    assert model.dte_arcsec(design[None]) == preset("calibrated").dte_arcsec(design[None])
    assert model.effects == preset("calibrated").effects


def test_limits_to_order_enclose_the_design_by_the_tolerance(document):
    for name, band in document["tolerance_band"].items():
        value = document["designs"]["balanced"][name]["value"]
        assert band["lower"] == pytest.approx(0.95 * value)
        assert band["upper"] == pytest.approx(1.05 * value)


def test_the_same_seed_gives_the_same_bytes(written, tmp_path):
    assert optimise("hs_20_100", "--out", tmp_path / "again", "--quiet", *QUICK) == 0
    for name in optimum_report.FOLDER.files:
        assert (tmp_path / "again" / name).read_bytes() == (written / name).read_bytes()


def test_another_preference_goes_into_the_sheet(written, tmp_path, document):
    arguments = ("--preference", "robustness_first", "--out", tmp_path / "out", "--quiet")
    assert optimise("hs_20_100", *arguments, *QUICK) == 0
    sheet = load_datasheet(tmp_path / "out" / "optimum_sheet.toml")
    wanted = document["designs"]["robustness_first"]["K"]["value"]
    assert sheet.nominal.stiffness == wanted != document["designs"]["balanced"]["K"]["value"]


def test_the_words_say_what_the_document_holds(written, capsys, tmp_path, document):
    assert optimise("hs_20_100", "--out", tmp_path / "out", *QUICK) == 0
    printed = capsys.readouterr().out
    chosen = document["designs"]["balanced"]
    assert f"to {chosen['mean_dte_arcsec']:.2f}" in printed
    for gain in document["checked_on_the_model"]["falls_by_arcsec"].values():
        assert f"(by {gain['model']:.2f} ± {2.0 * gain['standard_error_of_model']:.2f}" in printed
    assert str(tmp_path / "out" / "report.html") in printed


def test_json_is_the_document(written, capsys, tmp_path, document):
    assert optimise("hs_20_100", "--out", tmp_path / "out", "--json", *QUICK) == 0
    assert json.loads(capsys.readouterr().out) == document


@pytest.fixture(scope="module")
def checks(study):
    """The checks of the nominal and of the chosen design on 25 small sets of random drives."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(design_study, "CHECKED_DRIVES", 250)
        designs = (study.problem.nominal, study.design)
        return [[_check(study.problem, design, seed) for design in designs] for seed in range(25)]


class TestCheck:
    def test_where_the_surrogate_is_exact_the_model_confirms_it(self):
        # As printed, the DTE is proportional to theta_s and next to constant in the design.
        study = run_design_study(preset("published"), "balanced", SETTINGS)
        check = study.optimum_check
        assert check.mean == pytest.approx(study.objectives[0], rel=1e-5)
        assert check.std == pytest.approx(study.objectives[1], rel=1e-4)
        assert check.mean_error < 1e-4

    def test_where_it_is_coarse_the_check_agrees_with_quasi_random_runs_of_the_model(self, study):
        cube = qmc.Sobol(5, rng=np.random.default_rng(1)).random(2**12)
        mean, std = study.problem.model.nominal[0], study.problem.model.kinematic_error.std
        theta_s = truncnorm(-3.0, 3.0, loc=mean, scale=std).ppf(cube[:, 0])
        drives = np.column_stack([theta_s, study.design * (0.95 + 0.1 * cube[:, 1:])])
        dte = study.problem.model.dte_arcsec(drives)
        assert abs(study.objectives[0] - dte.mean()) > 0.3
        assert study.optimum_check.mean == pytest.approx(dte.mean(), abs=0.06)
        assert study.optimum_check.std == pytest.approx(dte.std(), abs=0.1)

    @pytest.mark.nightly
    def test_standard_errors_are_the_scatter_over_other_random_drives(self, checks):
        of_nominal = [before for before, _ in checks]
        means, stds = np.array([(one.mean, one.std) for one in of_nominal]).T
        errors = np.mean([(one.mean_error, one.std_error) for one in of_nominal], axis=0)
        assert errors == pytest.approx([means.std(), stds.std()], rel=0.4)

    def test_a_design_that_the_model_refutes_is_not_to_be_built(self, study):
        worse = replace(study.optimum_check, mean=study.initial_check.mean + 1.0)
        refuted = replace(study, optimum_check=worse)
        words = optimum_report.sentences(refuted)[1]
        assert re.search(r"the mean DTE rises from \S+ to \S+ arcsec \(by 1\.00 ±", words)
        refusals = [one for one in optimum_report.limits(refuted, ()) if "do not build" in one]
        assert len(refusals) == 1
        assert "lower mean" in refusals[0]
        assert not any("do not build" in one for one in optimum_report.limits(study, ()))

    def test_more_scatter_than_promised_is_refuted_as_well(self, study):
        worse = replace(study.optimum_check, std=study.initial_check.std + 1.0)
        limits = optimum_report.limits(replace(study, optimum_check=worse), ())
        assert any("lower standard deviation: do not build" in one for one in limits)

    def test_a_mean_that_is_meant_to_rise_refutes_nothing(self, study):
        # A design for less scatter may cost in the mean; only what was promised can be refuted.
        costly = replace(
            study,
            front=study.front + study.initial - study.objectives + [2.0, -1.0],
            optimum_check=replace(
                study.initial_check,
                mean=study.initial_check.mean + 2.0,
                std=study.initial_check.std - 1.0,
            ),
        )
        assert not any(
            "build" in one or "off by" in one for one in optimum_report.limits(costly, ())
        )
        assert "(by 2.00 ± 0.00)" in optimum_report.sentences(costly)[1]

    def test_what_moves_neither_moment_is_said_to_carry_no_information(self, study):
        problem = study.problem
        spans = {}
        for place, name in enumerate(problem.var_names):
            along = np.tile(study.design, (5, 1))
            along[:, place] = np.linspace(problem.xl[place], problem.xu[place], 5)
            spans[name] = np.ptp(problem.evaluate(along) / study.objectives, axis=0).max()
        assert study.free == ("B_in",) == tuple(name for name, one in spans.items() if one < 1e-3)
        assert "No value of B_in within the box" in optimum_report.limits(study, ())[0]

    def test_the_surrogate_is_coarse_only_beyond_chance(self):
        assert Gain(promised=1.0, found=0.4, error=0.1, share=0.01).coarse
        assert not Gain(promised=1.0, found=0.6, error=0.1, share=0.01).coarse
        assert not Gain(promised=0.1, found=0.0, error=0.2, share=0.0).coarse

    def test_gains_are_known_better_than_either_value(self, study):
        before, after = study.initial_check, study.optimum_check
        mean, std = study.gains.values()
        assert mean.found == before.mean - after.mean
        assert std.found == before.std - after.std
        assert 0.0 < mean.error < before.mean_error + after.mean_error
        assert 0.0 < std.error < before.std_error + after.std_error

    @pytest.mark.nightly
    def test_the_errors_of_gains_are_their_scatter_over_other_random_drives(self, study, checks):
        gains = [
            replace(study, initial_check=before, optimum_check=after).gains.values()
            for before, after in checks
        ]
        found = np.array([[gain.found for gain in pair] for pair in gains])
        errors = np.array([[gain.error for gain in pair] for pair in gains])
        np.testing.assert_allclose(errors.mean(0), found.std(0, ddof=1), rtol=0.4)

    def test_sources_are_those_of_the_chosen_design(self, study):
        problem, design = study.problem, study.design
        rng = np.random.default_rng(1)
        mean, std = problem.model.nominal[0], problem.model.kinematic_error.std
        theta_s = TruncatedNormal(mean, std).sample(rng, 20_000)
        fixed = np.column_stack([theta_s, np.tile(design, (20_000, 1))])
        # What theta_s alone explains is nearly all: the rest is additive to first order.
        share = problem.surrogate(fixed).var() / study.objectives[1] ** 2
        assert study.sources.first[0] == pytest.approx(share, abs=0.03)
        assert study.sources.variance**0.5 == pytest.approx(study.objectives[1], rel=1e-9)


@pytest.mark.nightly
def test_a_preset_on_another_drive_is_said_to_be_borrowed(tmp_path, capsys):
    text = sheet_toml(hs_20_100()).replace("HS-20-100", "MY-17-100").replace("25830.0", "20000.0")
    (tmp_path / "mine.toml").write_text(text)
    assert optimise(tmp_path / "mine.toml", "--out", tmp_path / "out", *QUICK) == 0
    printed = capsys.readouterr().out
    assert "need not hold for MY-17-100" in printed
    (tmp_path / "model.toml").write_text(
        model_toml(preset("calibrated")).replace('name = "calibrated"', 'name = "mine"')
    )
    arguments = ("--model", tmp_path / "model.toml", "--out", tmp_path / "out2")
    assert optimise(tmp_path / "mine.toml", *arguments, *QUICK) == 0
    assert "need not hold" not in capsys.readouterr().out


def test_a_model_without_trade_off_is_said_to_gain_nothing(tmp_path, capsys):
    arguments = ("--model", "published", "--out", tmp_path / "out")
    assert optimise("hs_20_100", *arguments, *QUICK) == 0
    assert "next to nothing to gain" in capsys.readouterr().out


def test_what_the_model_refutes_is_said(written, tmp_path, capsys):
    files = (written / "optimum_sheet.toml", "--model", written / "optimum_model.toml")
    assert optimise(*files, "--out", tmp_path / "again", "--box", "0.02", *QUICK) == 0
    printed = capsys.readouterr().out
    assert "next to nothing to gain" in printed
    assert "in how the mean changes, more than half of the change" in printed
    assert "in how the standard deviation changes, more than half" in printed
    assert "need not hold" not in printed


def test_a_duty_cycle_is_averaged_over(tmp_path, capsys):
    cycle = tmp_path / "cycle.csv"
    cycle.write_text("speed_rpm,load_Nm,weight\n200,40,1\n2000,40,3\n")
    arguments = ("--cycle", cycle, "--out", tmp_path / "out", "--json")
    assert optimise("hs_20_100", *arguments, *QUICK) == 0
    shares = [row["share"] for row in json.loads(capsys.readouterr().out)["settings"]["conditions"]]
    assert shares == [0.25, 0.75]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--preference", "cheap"), "--preference is 'cheap'"),
        (("--tolerance", "1.5"), "tolerance is 1.5"),
        (("--box", "nan"), "box is nan"),
        (("--order", "9"), "order is 9"),
        (("--evaluations", "50"), "--evaluations is 50"),
        (("--seed", "-1"), "--seed is -1"),
        (("--model", "nowhere.toml"), "nowhere.toml"),
        (("--cycle", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(options, words, tmp_path, capsys):
    assert optimise("hs_20_100", "--out", tmp_path / "out", *options, "--quiet") == cli.MISTAKE
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_of_somebody_else_is_refused_before_the_work(tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    assert optimise("hs_20_100", "--out", tmp_path / "out", "--quiet") == cli.MISTAKE
    assert "an earlier report" in capsys.readouterr().err
    assert (tmp_path / "out" / "thesis.tex").read_text() == "years of work"
