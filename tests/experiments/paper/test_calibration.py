"""The calibration ladder: rules against closed forms, predictions against samples, recovery."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from experiments.paper.calibrating import experiment as calibration
from experiments.paper.calibrating.data import (
    Outcome,
    format_outcomes,
    gap,
    information_criteria,
    read_outcomes,
)
from experiments.paper.calibrating.experiment import OUTCOMES, best_rungs
from experiments.paper.calibrating.fitting import (
    TRAITS,
    Budget,
    Fit,
    _refine,
    _residuals,
    front_traits,
    outcome_row,
)
from experiments.paper.calibrating.ladder import (
    EFFECTS,
    KNOWN,
    NARROW,
    WIDE,
    Candidate,
    ladder_rungs,
)
from experiments.paper.calibrating.predictions import (
    BAND,
    FITS,
    PUBLISHED,
    held_out,
    predict,
    prototype_dte,
    surrogate_moments,
    uncertain_box,
)
from experiments.paper.calibrating.rigid import (
    RigidDrive,
    fit_rigid,
    gain,
    inverse_moments,
    simplest,
)
from experiments.paper.scatter import dte_samples
from experiments.published_values import TABLE_9
from experiments.runner.committed import committed_file
from experiments.runner.registry import Context
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.drive import PARAMETERS, PRESETS, preset, transfer_function
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.units import ARCSEC

FULL_LADDER = Candidate(EFFECTS, "semi_amplitude", NARROW)


def test_ladder_has_every_combination_once():
    rungs = ladder_rungs()
    assert len(rungs) == 2**3 * 2 * 2
    assert len({rung.name for rung in rungs}) == len(rungs)


@pytest.mark.parametrize("rung", ladder_rungs(), ids=lambda rung: rung.name)
def test_parameters_survive_the_way_to_the_search_space_and_back(rung):
    parameters = {name: KNOWN[0][name] for name in rung.bounds}
    assert rung.physical(rung.searched(parameters)) == pytest.approx(parameters)
    low, high = np.array(list(rung.bounds.values())).T
    assert np.all((rung.known() >= low) & (rung.known() <= high))
    assert {effect.name for effect in rung.model(parameters).effects} == set(rung.effects)


@pytest.mark.parametrize(("name", "bands"), [("calibrated", NARROW), ("resonant", WIDE)])
def test_moments_are_those_of_samples_of_the_surrogate(name, bands):
    problem = RobustDTE(preset(name))
    found = predict(problem.model, bands, tuple(PUBLISHED))
    for design, nominal in {"initial": problem.nominal, **TABLE_9}.items():
        tolerance = BAND["initial" if design == "initial" else "optimum"][bands]
        values = dte_samples(problem, nominal, tolerance, 20_000, seed=1)
        error = values.std() / np.sqrt(len(values))
        assert abs(found[f"mean_{design}"] - values.mean()) < 4 * error
        assert abs(found[f"std_{design}"] - values.std()) < 4 * error
    assert found["prototypes_mean"] == prototype_dte(problem.model).mean()


@pytest.mark.nightly
def test_surrogates_of_high_order_give_the_moments_of_the_model():
    model = preset("resonant")
    found = surrogate_moments(model, NARROW, 6)
    rng, n = np.random.default_rng(1), 10_000
    theta_s = TruncatedNormal(model.nominal[0], model.kinematic_error.std).sample(rng, n)
    rest = model.nominal[1:] * rng.uniform(0.95, 1.05, (n, 4))
    values = model.dte_arcsec(np.column_stack([theta_s, rest]))
    assert abs(found["mean_initial"] - values.mean()) < 4 * values.std() / np.sqrt(n)
    assert found["std_initial"] == pytest.approx(values.std(), rel=0.03)
    box = uncertain_box(model, NARROW)
    sample = rng.uniform(box.lower, box.upper, (4000, 5))
    assert found["box_std"] == pytest.approx(model.dte_arcsec(sample).std(), rel=0.05)


@pytest.mark.parametrize("name", PRESETS)
def test_rolling_friction_moves_no_dte(name):
    model = preset(name)
    designs = np.tile(model.nominal, (2, 1))
    designs[:, PARAMETERS.index("B_in")] *= [0.65, 1.35]
    low, high = model.dte_arcsec(designs)
    assert low == pytest.approx(high, rel=1e-3)


def test_only_what_is_asked_for_is_predicted():
    model = preset("published")
    assert set(predict(model, NARROW, ("std_balanced", "box_std"))) == {"std_balanced", "box_std"}


def test_a_fit_never_sees_what_it_is_judged_on():
    for direction, names in FITS.items():
        assert set(names) & set(held_out(direction)) == set()
        assert set(names) | set(held_out(direction)) == set(PUBLISHED)


@pytest.mark.nightly
def test_a_local_fit_recovers_the_model_that_made_the_numbers():
    rung = Candidate(("damping_reference",), "peak_to_peak", NARROW)
    truth = {**{name: KNOWN[1][name] for name in rung.bounds}, "std_arcsec": 8.0}
    targets = predict(rung.model(truth), NARROW, tuple(PUBLISHED))
    residuals = _residuals(rung, "table8", targets)
    start = rung.searched({**truth, "std_arcsec": 6.0})
    chi_square, found = _refine(residuals, rung, start, Budget(0, 0, 1, 10))
    assert chi_square < 1e-3
    assert rung.physical(found)["std_arcsec"] == pytest.approx(8.0, rel=1e-3)


@pytest.mark.nightly
def test_a_local_fit_with_all_nine_parameters_off_recovers_what_made_the_numbers():
    """As far as nine numbers tell: `test_inference_search` says which directions they do not."""
    truth = KNOWN[5]
    targets = predict(FULL_LADDER.model(truth), NARROW, FITS["table8"])
    residuals = _residuals(FULL_LADDER, "table8", targets)
    low, high = np.array(list(FULL_LADDER.bounds.values())).T
    signs = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])
    start = FULL_LADDER.searched(truth) + 0.01 * (high - low) * signs
    assert np.sum(residuals(start) ** 2) > 100.0
    chi_square, found = _refine(residuals, FULL_LADDER, start, Budget(0, 0, 1, 5))
    assert chi_square < 0.01
    again = FULL_LADDER.physical(found)
    assert again["std_arcsec"] == pytest.approx(truth["std_arcsec"], rel=0.01)
    assert again["load_inertia"] == pytest.approx(truth["load_inertia"], rel=1e-3)


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_fit():
    rung = Candidate((), "semi_amplitude", NARROW)
    budget = Budget(population=6, generations=1, starts=1, local_evaluations=2)
    first, second = (Fit(rung, "table8", 3, budget).execute() for _ in range(2))
    assert first.columns == second.columns
    assert np.array_equal(first.values, second.values)
    other = Fit(rung, "table8", 4, budget).execute()
    assert not np.array_equal(first.values, other.values)


def test_traits_of_the_printed_model_show_no_trade_off():
    traits = front_traits(preset("published"))
    assert set(traits) == set(TRAITS)
    assert traits["front_mean_width"] < 0.01
    resonant = front_traits(preset("resonant"))
    assert resonant["front_mean_width"] > 3.0
    assert 0.9 < resonant["mean_share_K"] < 1.1


def test_the_committed_ladder_is_what_its_parameters_predict():
    best = best_rungs(read_outcomes(committed_file(OUTCOMES, "calibration")), "table8")
    assert len(best) == len(ladder_rungs())
    for one in (best[0], best[3]):
        model = one.candidate.model(one.parameters)
        found = predict(model, one.candidate.bands, tuple(PUBLISHED))
        assert found == pytest.approx(one.predictions, rel=1e-4)
        residuals = _residuals(one.candidate, "table8", PUBLISHED)
        searched = one.candidate.searched(one.parameters)
        assert np.sum(residuals(searched) ** 2) == pytest.approx(one.chi_square, rel=1e-2)


@pytest.mark.nightly
def test_a_stored_fit_runs_again():
    rung = Candidate((), "semi_amplitude", NARROW)
    run = Fit(rung, "table5", 1, calibration.BUDGETS["table5"]).execute()
    stored = [
        one.chi_square
        for one in read_outcomes(committed_file(OUTCOMES, "calibration"))
        if (one.kind, one.direction, one.candidate, one.seed) == ("fit", "table5", rung, 1)
    ]
    assert run.values[:, 0] == pytest.approx(stored, rel=1e-4)


@pytest.mark.nightly
def test_the_report_is_made_from_the_committed_ladder(tmp_path):
    result = calibration.run(Context(1, tmp_path, Campaign(tmp_path)))
    numbers = result.tables[0]
    assert [row[0] for row in numbers.rows] == [name.replace("_", " ") for name in PUBLISHED]
    *checks, step = numbers.findings
    assert all(finding.agrees for finding in checks)
    assert step.verdict == "Missed by the fit"
    assert "-0.022 and +0.021 arcsec by the best rung, by +0.468 and -0.136 in" in step.sentence
    assert len(result.tables[2].rows) == len(ladder_rungs())


@pytest.mark.nightly
def test_the_full_campaign_leaves_what_the_report_reads(tmp_path, monkeypatch):
    budget = Budget(population=6, generations=1, starts=1, local_evaluations=2)
    rung = Candidate(("load_inertia",), "semi_amplitude", NARROW)
    monkeypatch.setattr(calibration, "ladder_rungs", lambda: [rung])
    monkeypatch.setattr(calibration, "REPLICATES", 2)
    monkeypatch.setattr(calibration, "SEEDS", {"table8": (1,), "table5": (1,)})
    monkeypatch.setattr(calibration, "BUDGETS", dict.fromkeys(FITS, budget))
    context = Context(1, tmp_path, Campaign(tmp_path), full=True)
    first = calibration.run(context)
    written = tmp_path / "calibration" / OUTCOMES
    outcomes = read_outcomes(written)
    kinds = [(one.kind, one.direction) for one in outcomes]
    assert kinds == [("fit", "table8"), ("fit", "table5"), *2 * [("bootstrap", "table8")]]
    assert outcomes[2].parameters != outcomes[3].parameters
    # A second run finds every fit on disk and reports the same.
    runs = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.csv")}
    assert calibration.run(context).tables == first.tables
    assert {path: path.stat().st_mtime_ns for path in runs} == runs


def test_outcomes_survive_their_csv(tmp_path):
    parameters = {name: KNOWN[1][name] for name in FULL_LADDER.bounds}
    row = outcome_row(FULL_LADDER, 1.5, FULL_LADDER.searched(parameters))
    outcome = Outcome(
        kind="fit",
        direction="table8",
        candidate=FULL_LADDER,
        seed=1,
        budget="1x1",
        chi_square=1.5,
        parameters=parameters,
        predictions={name: row[name] for name in PUBLISHED},
        traits={name: row[name] for name in TRAITS},
    )
    path = tmp_path / "calibration.csv"
    path.write_text(format_outcomes([outcome]), encoding="utf-8")
    (read,) = read_outcomes(path)
    assert read.candidate == outcome.candidate
    assert read.parameters == pytest.approx(parameters, rel=1e-6)
    assert read.gap(FITS["table8"]) == pytest.approx(gap(outcome.predictions, FITS["table8"]))


class TestRigid:
    @pytest.mark.parametrize("band", [0.05, 0.35])
    def test_moments_of_an_inverse_are_those_of_quadrature(self, band):
        nodes, weights = leggauss(20)
        values = 1.0 / (1.0 + band * nodes)
        mean = values @ weights / 2.0
        spread = np.sqrt((values - mean) ** 2 @ weights / 2.0)
        assert inverse_moments(band) == pytest.approx((mean, spread))
        assert mean == pytest.approx(np.log((1.0 + band) / (1.0 - band)) / (2.0 * band))

    @pytest.mark.parametrize("bands", [NARROW, WIDE])
    def test_predictions_are_those_of_samples_of_the_drive(self, bands):
        drive = RigidDrive(0.05, 8.0, bands)
        predicted, model = drive.predict(), preset("published")
        rng, n = np.random.default_rng(1), 20_000
        theta_s = TruncatedNormal(model.nominal[0] / ARCSEC, 8.0).sample(rng, n)
        for design, values in {"initial": model.nominal[1:], **TABLE_9}.items():
            band = BAND["initial" if design == "initial" else "optimum"][bands]
            drawn = drive.dte_arcsec(theta_s, values[0] * rng.uniform(1.0 - band, 1.0 + band, n))
            error = drawn.std() / np.sqrt(n)
            assert abs(predicted[f"mean_{design}"] - drawn.mean()) < 4 * error
            assert abs(predicted[f"std_{design}"] - drawn.std()) < 4 * error
        box = uncertain_box(replace(model, kinematic_error=error_of(model, 8.0)), bands)
        low, high = box.lower, box.upper
        theta_s, stiffness = rng.uniform(low[:2], high[:2], (n, 2)).T
        drawn = drive.dte_arcsec(theta_s / ARCSEC, stiffness)
        assert predicted["box_std"] == pytest.approx(drawn.std(), rel=0.02)

    def test_the_gain_is_twice_that_of_the_transfer_function(self):
        model = preset("published")
        drive, orders = model.coefficients(model.nominal[None]), np.array([1.0, 2.02])
        gains = np.abs(transfer_function(drive, orders)[0])
        assert 2.0 * gains.min() < gain() < 2.0 * gains.max()

    @pytest.mark.parametrize("bands", [NARROW, WIDE])
    def test_no_other_drive_fits_better(self, bands):
        best = fit_rigid(bands)
        for share, std in ((1.02, 1.0), (0.98, 1.0), (1.0, 1.02), (1.0, 0.98)):
            other = RigidDrive(best.torsion_share * share, best.std_arcsec * std, bands)
            assert other.chi_square > best.chi_square

    def test_two_parameters_are_set_against_nine(self):
        assert information_criteria(0.6, 9, 9) == pytest.approx((18.6, 0.6 + 9 * np.log(9)))
        best = best_rungs(read_outcomes(committed_file(OUTCOMES, "calibration")), "table8")
        assert simplest().bands == WIDE
        printed = next(one for one in best if not one.candidate.effects)
        assert (best[0].n_parameters, printed.n_parameters) == (9, 1)


def error_of(model, std_arcsec):
    """Return the static error of a model with another standard deviation."""
    return replace(model.kinematic_error, std=std_arcsec * ARCSEC)
