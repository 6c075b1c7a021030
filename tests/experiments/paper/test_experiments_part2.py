"""Prototypes, sensitivities, cross-checks and maps against other ways to get them."""

from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from numpy.polynomial.legendre import leggauss
from scipy.signal import butter, sosfreqz

from experiments.paper import fig12, published, table8
from experiments.paper.choices import (
    BAND,
    design_indices,
    falls_when_halved,
    initial_choices,
    paper_choices,
    scatter_indices,
    study_designs,
)
from experiments.paper.prototypes.consistency import Prediction, best_case_table, consistency_table
from experiments.paper.prototypes.printed_validation import (
    HIGHEST,
    LOWEST,
    MAE,
    MAPE_PERCENT,
    MAX_ERROR,
    MEAN_ERROR,
    MEAN_ERROR_INTERVAL,
    NUMBERS,
    R2,
    RMSE,
    bounds,
    nearest_assignment,
)
from experiments.paper.scatter import exact_moments
from experiments.paper.table6 import record
from experiments.paper.table8 import _idle_sweep, deviation_table
from experiments.published_values import TABLE_6, Moments
from experiments.runner.registry import Context
from experiments.runner.report import report_fingerprint
from experiments.studies import dte_map, sensitivity
from experiments.studies.crosscheck import (
    FAMILIES,
    SCREENED,
    TENSOR,
    Trial,
    chaos,
    compare,
    fit_grid,
    needed_table,
    rivals,
)
from pymoo_hdte._comparing.models import FITTED
from pymoo_hdte._comparing.runs import robust_problem
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.store import load, png_bytes, save
from pymoo_hdte.decision import deviation_degree
from pymoo_hdte.drive import (
    PARAMETERS,
    PRESETS,
    MeshStiffnessVariation,
    floquet_multipliers,
    preset,
)
from pymoo_hdte.drive.dte_map import (
    SpeedLoadMap,
    critical_speeds,
    speed_load_map,
    torsional_mode,
)
from pymoo_hdte.drive.measurement import CUTOFF, FILTER_ORDER, SAMPLING_RATE
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    SobolIndices,
    TruncatedNormal,
    latin_hypercube,
)
from pymoo_hdte.units import REVOLUTION_PER_MINUTE
from pymoo_hdte.validation import validation_metrics

HIGH, LOW = NUMBERS.index(HIGHEST), NUMBERS.index(LOWEST)


def context(out):
    return Context(2, out, Campaign(out, None))


def residuals_with_the_printed_statistics(rng):
    """One residual is the largest error; the other four lie on a sphere about their mean."""
    mean = (5 * MAE - MAX_ERROR) / 4
    radius = np.sqrt(5 * RMSE**2 - MAX_ERROR**2 - 4 * mean**2)
    direction = rng.normal(size=4)
    direction -= direction.mean()
    return np.append(mean + radius * direction / np.linalg.norm(direction), MAX_ERROR)


class TestPrintedStatistics:
    def test_bounds_hold_for_all_residuals_and_are_reached(self, rng):
        found = bounds()
        smallest, widest = np.inf, 0.0
        for _ in range(20_000):
            residuals = residuals_with_the_printed_statistics(rng)
            smallest = min(smallest, residuals.min())
            widest = max(widest, np.ptp(residuals))
        assert np.std(residuals) == pytest.approx(found.residual_std, rel=1e-12)
        assert found.smallest_residual <= smallest < found.smallest_residual + 0.01
        assert found.largest_difference - 0.01 < widest <= found.largest_difference

    def test_no_five_values_of_that_deviation_have_a_smaller_range(self, rng):
        found = bounds()
        values = rng.normal(size=(20_000, 5))
        ranges = found.measured_std * np.ptp(values, axis=1) / values.std(axis=1)
        assert ranges.min() >= found.least_range
        extreme = np.array([0.0, 0.0, 1.0, 1.0, 1.0])
        assert found.measured_std / extreme.std() == pytest.approx(found.least_range, rel=1e-12)

    @pytest.mark.parametrize("ranked", [False, True])
    @pytest.mark.parametrize("to", ["predicted", "measured"])
    def test_an_assignment_has_what_the_paper_prints(self, to, ranked, rng):
        found = nearest_assignment(rng.uniform(70.0, 110.0, 5), to=to, ranked=ranked)
        metrics = validation_metrics(found.predicted, found.measured)
        assert metrics.mean_error == pytest.approx(MEAN_ERROR, abs=1e-5)
        assert metrics.mean_error_interval == pytest.approx(MEAN_ERROR_INTERVAL, abs=0.003)
        assert metrics.rmse == pytest.approx(RMSE, abs=1e-5)
        assert metrics.max_error == pytest.approx(MAX_ERROR, abs=1e-5)
        assert metrics.mape_percent == pytest.approx(MAPE_PERCENT, abs=1e-5)
        assert metrics.r2 == pytest.approx(R2, abs=1e-5)
        if ranked:
            assert found.measured[HIGH] >= found.measured.max() - 1e-5
            assert found.measured[LOW] <= found.measured.min() + 1e-5
            lead = found.predicted[HIGH] - found.predicted[LOW]
            assert lead >= bounds().least_lead - 1e-4

    @pytest.mark.nightly
    def test_predictions_that_fit_are_recognised_and_others_are_not(self):
        near = np.array([88.0, 80.0, 90.0, 99.0, 77.0])
        fitting = nearest_assignment(near, to="predicted", ranked=True)
        exact = Prediction("exact", fitting.predicted, fitting.predicted)
        assert exact.change(ranked=True).rms < 1e-3
        assert exact.change(ranked=False).rms < 1e-3
        swapped = fitting.predicted.copy()
        swapped[[HIGH, LOW]] = swapped[[LOW, HIGH]]
        wrong = Prediction("swapped", swapped, swapped)
        assert wrong.change(ranked=False).rms < 1e-3
        assert wrong.change(ranked=True).rms > 5.0
        table = consistency_table([exact, wrong])
        assert [finding.agrees for finding in table.findings] == [True, False]

    @pytest.mark.nightly
    def test_no_measured_values_give_a_smaller_rmse_than_the_best_case(self, rng):
        predictions = rng.uniform(75.0, 105.0, 5)
        prediction = Prediction("ours", predictions, predictions)
        best = prediction.best_case(ranked=False)
        table = best_case_table([prediction], {("ours", False): best, ("ours", True): None})
        heading = [column.name for column in table.columns].index("RMSE")
        least = table.rows[0][heading]
        for start in rng.uniform(70.0, 115.0, (4, 5)):
            other = nearest_assignment(start, to="measured", ranked=False)
            assert validation_metrics(predictions, other.measured).rmse >= least - 1e-4


def test_the_chain_takes_from_a_single_order_what_the_filter_s_gain_says():
    model = preset("published")
    error = replace(model.kinematic_error, orders=(2.0,), amplitudes=(1.0,), phases=(0.3,))
    found = record(replace(model, kinematic_error=error), model.nominal)
    frequency = 2.0 * model.sheet.input_speed / (2.0 * np.pi)
    sections = butter(FILTER_ORDER, CUTOFF, fs=SAMPLING_RATE, output="sos")
    gain = abs(sosfreqz(sections, [frequency], fs=SAMPLING_RATE)[1][0]) ** 2
    assert found.integrated == pytest.approx(found.steady, rel=1e-4)
    assert found.measured / found.sampled == pytest.approx(gain, rel=2e-3)
    # Fifteen samples a cycle miss a peak by half their distance at most.
    assert np.cos(np.pi / 15) <= found.sampled / found.integrated <= 1.0


class TestShares:
    def test_scatter_has_the_exact_moments(self):
        problem = robust_problem("resonant")
        for _, design, tolerance in study_designs(problem):
            indices = scatter_indices(problem, design, tolerance)
            expected = exact_moments(problem, design, tolerance)
            assert (indices.mean, indices.variance**0.5) == pytest.approx(expected, rel=1e-12)

    def test_halving_theta_s_is_what_quadrature_over_it_says(self):
        problem = robust_problem("calibrated")
        std, falls = falls_when_halved(problem, problem.nominal, 0.0)
        wide = problem.inputs[0]
        expected = []
        for theta_s in (wide, TruncatedNormal(wide.mean, wide.std / 2.0)):
            values, weights = theta_s.quadrature(8)
            points = np.column_stack([values, np.tile(problem.nominal, (len(values), 1))])
            dte = problem.surrogate(points)
            expected.append(np.sqrt(weights @ (dte - weights @ dte) ** 2))
        assert std == pytest.approx(expected[0], rel=1e-10)
        assert falls[0] == pytest.approx(100.0 * (1.0 - expected[1] / expected[0]), rel=1e-9)
        assert falls[1:] == pytest.approx(np.zeros(4), abs=1e-10)

    def test_shares_of_the_moments_are_those_of_sampled_designs(self, rng):
        problem = robust_problem("resonant")
        found = design_indices(problem)
        designs = rng.uniform(problem.xl, problem.xu, (20_000, 4))
        mean, std = problem.moments(designs)
        assert found["mean"].variance == pytest.approx(mean.var(), rel=0.05)
        assert found["variance"].variance == pytest.approx((std**2).var(), rel=0.1)
        # Redrawing one variable alone moves the output by twice its total share (Jansen).
        for axis in range(4):
            other = designs.copy()
            other[:, axis] = rng.uniform(problem.xl[axis], problem.xu[axis], len(designs))
            total = np.mean((problem.moments(other)[0] - mean) ** 2) / (2.0 * mean.var())
            assert found["mean"].total[axis] == pytest.approx(total, rel=0.1, abs=1e-6)

    @pytest.mark.parametrize("name", ["calibrated", "resonant"])
    def test_shares_of_the_moments_are_exact(self, name):
        problem = robust_problem(name)
        found = design_indices(problem)
        # The variance has twice the surrogate's degree in each variable, its square four times.
        rule = leggauss(2 * max(problem.surrogate.orders) + 1)
        nodes = np.stack(np.meshgrid(*[rule[0]] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
        weights = np.prod(np.meshgrid(*[rule[1] / 2.0] * 4, indexing="ij"), axis=0).ravel()
        middle, reach = (problem.xu + problem.xl) / 2.0, (problem.xu - problem.xl) / 2.0
        mean, std = problem.moments(middle + reach * nodes)
        for kind, values in (("mean", mean), ("variance", std**2)):
            average = weights @ values
            assert found[kind].mean == pytest.approx(average, rel=1e-12)
            expected = weights @ (values - average) ** 2
            assert found[kind].variance == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("experiment", others_at_night([fig12, sensitivity], fig12))
def test_quick_experiments_can_be_stored_and_read_again(experiment, tmp_path):
    result = experiment.run(context(tmp_path))
    name = experiment.__name__.rpartition(".")[2]
    save(tmp_path, name, result, report_fingerprint())
    stored = load(tmp_path, name)
    assert stored.tables == result.tables
    assert result.command == f"python -m experiments {name}"
    if experiment is fig12:
        shares = [row[-1] for row in result.tables[0].rows if row[1] == "theta_s alone"]
        assert shares == pytest.approx([100.0] * 3)


class TestSentences:
    @pytest.mark.parametrize(("gain", "word"), [(1.009, "rigid"), (1.011, "not rigid")])
    def test_a_drive_is_rigid_only_if_its_gain_is_1(self, gain, word):
        finding = published._gain_finding(np.array([1.0, gain, 1.0]))
        assert finding.sentence.endswith(f"the printed drive is {word} for its own excitation.")
        assert finding.agrees == (word == "rigid")

    @pytest.mark.parametrize(
        ("dte", "word"), [(36.8, "damping hardly matter."), (37.0, "damping matter.")]
    )
    def test_parameters_matter_if_the_dte_is_not_the_static_error(self, dte, word):
        table = published._designs([published.Design(36.5, dte, dte)])
        assert table.findings[0].sentence.endswith(word)
        assert table.findings[0].agrees == ("hardly" in word)

    @pytest.mark.parametrize(("least", "idle"), [(0.02, False), (0.005, True)])
    def test_variables_without_information_are_named_only_if_there_are_any(self, least, idle):
        shares = np.array([0.9, 0.05, 0.03, least])
        indices = SobolIndices(PARAMETERS[1:], 1.0, 1.0, shares, shares)
        finding = sensitivity._influence_finding({"mean": indices})
        assert ("The optimal value of the others" in finding.sentence) == idle
        assert finding.agrees == (not idle)


class TestFitted:
    def test_the_fitted_presets_say_so_themselves(self):
        assert set(FITTED) == {name for name in PRESETS if "fitted" in preset(name).provenance}

    @pytest.mark.parametrize("model", PRESETS)
    @pytest.mark.parametrize("good", [0, 1])
    def test_fig_12_is_judged_by_the_range_that_the_paper_states(self, model, good):
        moments = [Moments(*(2.0 * np.array(fig12.PAPER)))] * 3
        moments[good] = fig12.PAPER
        distributions = [
            fig12.Distribution(name, band, *pair, np.ones(1))
            for name in PRESETS
            for band, pair in zip(fig12.BANDS, zip(moments, [0.9] * 3, strict=True), strict=True)
        ]
        finding = list(fig12._findings(distributions))[list(PRESETS).index(model)]
        assert finding.verdict == ("Agrees" if good == 0 else "Differs")
        assert ("to which the model was fitted" in finding.sentence) == (model in FITTED)

    def test_the_paper_s_own_designs_are_no_agreement_of_a_model_fitted_to_them(self):
        ours = [replace(choice, source="AMP-MOPSO") for choice in paper_choices()]
        table = table8._moments_table(initial_choices(), ours)
        at_theirs, at_ours, _ = table.findings
        assert (at_theirs.verdict, at_ours.verdict) == ("Fitted", "Agrees")

    @pytest.mark.parametrize(
        ("share", "words", "verdict"), [(5e-5, "0.0050 %", "Agrees"), (0.2, "20 %", "Differs")]
    )
    def test_optima_that_random_designs_dominate_are_not_of_this_model(
        self, share, words, verdict, monkeypatch
    ):
        monkeypatch.setattr(table8, "dominating_shares", lambda _: {"balanced": share})
        _, _, *found = table8.optima_table(paper_choices()).findings
        assert [finding.verdict for finding in found] == [verdict] * len(FITTED)
        assert all(f" is {words} (balanced)." in finding.sentence for finding in found)

    def test_which_prototype_is_nearest_hangs_on_a_variable_that_moves_nothing(self):
        problem = robust_problem("calibrated")
        *_, chosen, _, _ = study_designs(problem)
        optimum = replace(paper_choices()[0], design=chosen[1])
        table = deviation_table(optimum)
        assert [finding.verdict for finding in table.findings] == ["Consistent"]
        name, share, swept = _idle_sweep(optimum)
        assert name == "B_in"
        moments = problem.evaluate(swept)
        assert np.ptp(moments, axis=0).max() < 0.02
        assert 1e-8 < share < 1e-5
        measured = [prototype.design for prototype in TABLE_6.values()]
        degrees = np.array([deviation_degree(measured, design) for design in swept])
        nearest = [list(TABLE_6)[place] for place in degrees.argmin(axis=1)]
        assert len(set(nearest)) > 1
        assert f"nearest is No. {', '.join(map(str, nearest))} and" in table.note


class TestMap:
    def test_the_rated_condition_is_the_preset_s_own(self, model):
        speed = model.sheet.input_speed / REVOLUTION_PER_MINUTE
        load_torque = model.sheet.load_torque
        found = speed_load_map(model, np.array([speed]), np.array([load_torque]))
        assert found.dte[0, 0] == pytest.approx(model.dte_arcsec(model.nominal[None])[0], rel=1e-12)

    def test_the_torsional_mode_is_an_eigenvalue_of_the_free_drive(self):
        model = preset("resonant")
        c = model.coefficients(model.nominal[None])
        masses = np.diag([c.input_inertia[0] * c.ratio**2, c.output_inertia])
        spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
        inverse = np.linalg.inv(masses)
        system = np.block(
            [
                [np.zeros((2, 2)), np.eye(2)],
                [-c.stiffness[0] * inverse @ spring, -c.damping[0] * inverse @ spring],
            ]
        )
        oscillating = max(np.linalg.eigvals(system), key=lambda value: value.imag)
        mode = torsional_mode(model)
        assert 2.0 * np.pi * mode.frequency == pytest.approx(abs(oscillating), rel=1e-9)
        assert mode.damping_ratio == pytest.approx(-oscillating.real / abs(oscillating), rel=1e-9)

    def test_the_dte_peaks_where_an_excited_order_meets_the_mode(self):
        model = preset("resonant")
        speeds = np.arange(900.0, 3400.0, 50.0)
        found = speed_load_map(model, speeds, np.array([model.sheet.load_torque]))
        expected = sorted(speed for _, speed in critical_speeds(model))
        peaks = [speed for speed, _ in found.peaks(0)]
        assert peaks == pytest.approx(expected, abs=60.0)

    def test_an_overdamped_drive_has_no_resonance(self):
        model = preset("resonant")
        damping = next(e for e in model.effects if e.name == "damping_reference")
        others = tuple(e for e in model.effects if e is not damping)
        stiff = replace(model, effects=(*others, replace(damping, factor=100 * damping.factor)))
        assert critical_speeds(stiff) == []
        assert len(critical_speeds(model)) == 2

    def test_a_drive_without_steady_state_leaves_a_hole_and_the_rest_stands(self):
        model = preset("resonant")
        kept = tuple(e for e in model.effects if e.name == "load_inertia")
        wild = replace(model, effects=(*kept, MeshStiffnessVariation(depth=0.5, phase=0.0)))
        # The stiffness varies twice per turn, and does most harm at twice the natural frequency.
        worst = torsional_mode(wild).speed(1.0)
        speeds = np.array([worst, 3.0 * worst])
        at_worst = wild.at(worst * REVOLUTION_PER_MINUTE, 40.0)
        coefficients = at_worst.coefficients(wild.nominal[None])
        assert np.abs(floquet_multipliers(coefficients)).max() > 1.0
        found = speed_load_map(wild, speeds, np.array([0.0, 20.0, 40.0]))
        assert found.unstable == 3
        assert np.isnan(found.dte[:, 0]).all()
        assert np.isfinite(found.dte[:, 1]).all()

    def test_holes_can_be_drawn(self):
        dte = np.linspace(40.0, 90.0, 33).reshape(3, 11)
        dte[1:, 4] = np.nan
        found = SpeedLoadMap(
            preset("resonant"), np.linspace(100.0, 4000.0, 11), np.array([0.0, 20.0, 40.0]), dte
        )
        assert png_bytes(dte_map._figure([found])).startswith(b"\x89PNG")
        assert "2 of 33" in dte_map._modes_table([found]).rows[0]


PLANE = Box(("a", "b", "idle"), [0.0, -1.0, 2.0], [1.0, 3.0, 5.0])


def quadratic(points):
    a, b, _ = points.T
    return 3.0 + a - 2.0 * b + 0.5 * a * b + b**2


@pytest.fixture(scope="module")
def found_rivals():
    """Every rival, with the number of runs that were asked for in making it."""
    asked = [0]

    def counted(points):
        asked[0] += len(points)
        return quadratic(points)

    pairs, before = [], 0
    for rival in rivals(counted, PLANE):
        pairs.append((rival, asked[0] - before))
        before = asked[0]
    return pairs


class TestRivals:
    def test_every_family_finds_a_quadratic_from_order_two_on(self, found_rivals):
        points = latin_hypercube(PLANE, 50, 1)
        assert {rival.family for rival, _ in found_rivals} == set(FAMILIES)
        for rival, _ in found_rivals:
            if rival.order >= 2:
                values = rival.predict(points)
                assert values == pytest.approx(quadratic(points), abs=1e-9), rival.family

    def test_runs_are_what_the_model_was_asked_for(self, found_rivals):
        for rival, asked in found_rivals:
            # The screening grid is made once for all orders, but each order needs it.
            screening = 2**3 if rival.family == SCREENED and rival.order > 1 else 0
            assert rival.runs == asked + screening

    def test_screening_saves_the_runs_of_idle_parameters(self, found_rivals):
        runs = {(rival.family, rival.order): rival.runs for rival, _ in found_rivals}
        assert runs[TENSOR, 3] == 4**3
        assert runs[SCREENED, 3] == 2**3 + 4**2

    def test_a_grid_of_equal_sizes_is_the_surrogate(self):
        def function(points):
            return np.exp(points[:, 0] - 0.3 * points[:, 1] * points[:, 2])

        expected = ChebyshevSurrogate.fit(function, PLANE, 3)
        grid = fit_grid(function, PLANE, [4, 4, 4])
        assert grid.coefficients == pytest.approx(expected.coefficients, abs=1e-12)
        assert fit_grid(function, PLANE, [4, 2, 3]).orders == (3, 1, 2)


def test_needed_runs_are_the_least_that_reach_the_target():
    trials = [
        Trial("calibrated", TENSOR, 2, 243, 2.0, 9.0),
        Trial("calibrated", TENSOR, 3, 1024, 1.0, 5.0),
        Trial("calibrated", SCREENED, 2, 59, 1.2, 9.0),
        Trial("calibrated", SCREENED, 3, 96, 1.0, 5.0),
    ]
    table = needed_table(trials)
    rows = {row[1]: row[2:] for row in table.rows}
    assert rows[TENSOR] == (1024, 1024)
    assert rows[SCREENED] == (96, 59)
    assert not table.findings[0].agrees


@pytest.mark.parametrize("model", others_at_night(["calibrated", "resonant"], "resonant"))
def test_chaospy_agrees_on_moments_and_indices(model):
    problem = RobustDTE(model, order=2)
    twin = chaos(2, problem.inputs[0].cut)
    found = compare(twin, problem, problem.nominal, BAND)
    assert found.moments < 1e-10
    assert found.indices < 1e-10
    assert abs(found.surrogate_mean) < 0.1
