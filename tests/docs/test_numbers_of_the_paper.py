"""Numbers that README and its pages hold beside those of the paper."""

import csv
import io
import re

import numpy as np
import pytest
from places import PAGES, WORDS
from pymoo.indicators.igd import IGD
from pymoo.indicators.spacing import SpacingIndicator
from pymoo.optimize import minimize

from experiments.anytime import data as anytime
from experiments.anytime.measures import EQUAL
from experiments.anytime.readings import readings
from experiments.anytime.sentences import settings_ahead
from experiments.anytime.strategies import strategies
from experiments.anytime.tables import Contest, contests, stated_place
from experiments.comparison.paired import objectives
from experiments.comparison.quality import TrueFront
from experiments.comparison.references import true_front
from experiments.comparison.runs import ALGORITHMS, OptimisationRun
from experiments.paper import fig12, table5
from experiments.paper.choices import dominating_shares
from experiments.paper.inference import data as inference
from experiments.paper.inference.knowledge import balanced_ranges, shift
from experiments.paper.inference.likelihood import READING
from experiments.paper.inference.verdicts import (
    above_a_special_case,
    chosen_fits,
    gives_trade_off,
    step_errors,
    steps_of,
    undominated,
)
from experiments.paper.scatter import dte_samples, exact_moments
from experiments.published_values import TABLE_7, TABLE_8, TABLE_9
from experiments.runner.campaign import Campaign
from experiments.runner.committed import DATA
from experiments.runner.registry import Context
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.drive import preset
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.surrogate import accuracy, latin_hypercube


def row(words: str) -> list[list[float]]:
    """Return the numbers in the cells of the table row that holds these words."""
    line = next(line for line in PAGES.splitlines() if line.startswith("|") and words in line)
    _, _, paper, ours, _ = line.split("|")
    return [[float(n) for n in re.findall(r"\d+\.\d+", cell)] for cell in (paper, ours)]


def qualities(seeds, folder):
    """Return IGD and spacing, shape (3, n, 2), of AMP-MOPSO, MOPSO and NSGA-II with n seeds."""
    names = ("AMP-MOPSO", "MOPSO", "NSGA-II")
    jobs = [OptimisationRun("calibrated", name, seed) for name in names for seed in seeds]
    truth = TrueFront(true_front("calibrated"))
    found = [truth.quality(objectives(run))[:2] for run in Campaign(folder).run(jobs, "all")]
    return np.reshape(found, (3, len(seeds), 2))


class TestNumbersBesideThePaper:
    def test_nominal_design(self):
        _, ours = row("DTE of the nominal design")
        problem = RobustDTE()
        assert ours == [round(value, 2) for value in problem.evaluate(problem.nominal)]

    def test_nominal_design_in_the_wider_reading(self, tmp_path):
        rows = fig12.run(Context(20, tmp_path, Campaign(tmp_path))).tables[0].rows
        (wide,) = (row for row in rows if row[0] == "calibrated" and "35 %" in row[1])
        assert f"it gives {wide[2]:.1f}, {wide[3]:.1f} arcsec" in WORDS

    def test_surrogate(self):
        problem = RobustDTE()
        _, (ours,) = row("RMSE over the box")
        box = problem.surrogate.box
        points = latin_hypercube(box, table5.N_TEST, table5.TEST_SEED)
        measured = accuracy(problem.surrogate(points), problem.model.dte_arcsec(points))
        assert ours == round(measured.rmse, 3)

    def test_balanced_designs(self):
        paper, ours = row("The paper's balanced design")
        assert paper == [85.99, 15.77]
        design = [2.998e4, 2.282e-4, 1.887e-4, 3.405e-4]
        assert ours == [round(value, 2) for value in RobustDTE().evaluate(np.array(design))]

    def test_published_comparison(self):
        for words, indicator in (("IGD of AMP-MOPSO", "igd"), ("Spacing of the same", "spacing")):
            paper, _ = row(words)
            names = ("AMP-MOPSO", "MOPSO", "NSGA-II")
            assert paper == [getattr(TABLE_7[name], indicator) for name in names]

    @pytest.mark.nightly
    def test_comparison_over_all_seeds(self, tmp_path):
        igd, spacing = qualities(range(1, 21), tmp_path).mean(axis=1).T
        assert row("IGD of AMP-MOPSO")[1] == [round(value, 4) for value in igd]
        assert row("Spacing of the same")[1] == [round(value, 4) for value in spacing]
        assert "differs by less than two per cent, NSGA-II ahead" in WORDS
        assert igd.max() < 1.02 * igd.min()
        assert igd.argmin() == 2

    def test_comparison_of_the_first_seed(self, tmp_path):
        igd = qualities([1], tmp_path)[:, 0, 0]
        # Single runs scatter by two per cent: four standard deviations.
        assert igd == pytest.approx(row("IGD of AMP-MOPSO")[1], rel=0.08)

    def test_comparison_at_a_small_budget(self):
        problem = RobustDTE()
        igd, spacing = IGD(problem.pareto_front()), SpacingIndicator()
        found = {}
        for name in ("NSGA-II", "MOPSO", "AMP-MOPSO"):
            sets = [
                minimize(problem, ALGORITHMS[name](10, 50), ("n_gen", 20), seed=seed).F
                for seed in range(1, 13)
            ]
            found[name] = [[measure(F) for F in sets] for measure in (igd, spacing)]
            assert max(map(len, sets)) <= (10 if name == "NSGA-II" else 50)
        words = r"have an IGD of (.*) arcsec and a Spacing of (.*) arcsec \(means of 12 seeds"
        columns = re.search(words, WORDS).groups()
        stated = [[float(one) for one in re.findall(r"\d\.\d+", column)] for column in columns]
        runs = np.moveaxis(np.array(list(found.values())), 0, 1)
        # Another processor rounds otherwise, which sends single seeds another way.
        error = runs.std(axis=2, ddof=1) / np.sqrt(runs.shape[2])
        assert np.all(np.abs(runs.mean(axis=2) - stated) < error + 5e-4)

    def test_comparison_at_every_budget(self):
        scores = anytime.committed_scores()
        found, best = contests(scores), readings(scores)[0]
        assert (best.population, best.evaluations) == (10, 200)
        stated = readings(scores)[stated_place(readings(scores))]
        off = (
            f"(off by a factor of {best.factor:.1f}, at the stated budget by {stated.factor:.1f} or"
        )
        assert off in WORDS
        for model, words in (
            ("calibrated", "ahead of both by IGD {} in `calibrated`"),
            ("resonant", "in `resonant` only {}, and by Spacing nowhere"),
        ):
            assert words.format(settings_ahead(found[Contest(model, "igd")])) in WORDS
            assert not settings_ahead(found[Contest(model, "spacing")])
            equal = found[Contest(model, "igd", EQUAL)]
            assert {duel.rival for duel in equal if duel.ahead} == {"NSGA-II"}
            assert all(duel.ahead >= 0 for duel in equal)
        of_calibrated = [
            (strategy, duel)
            for model, strategy, _, entries in strategies(scores, "igd")
            for duel in entries
            if model == "calibrated"
        ]
        better = [duel for strategy, duel in of_calibrated if duel.ahead > 0]
        assert all(strategy == "entropy weight" for strategy, d in of_calibrated if d.ahead > 0)
        assert f"in {len(better)} of {len(of_calibrated) // 2} comparisons" in WORDS
        assert {min(d.evaluations for d in better), max(d.evaluations for d in better)} == {
            200,
            1000,
        }

    def test_random_designs_dominate_the_published_optima(self):
        for model, words in (
            ("calibrated", "{:.0f} to {:.0f} % of random designs"),
            ("resonant", "({:.1g} to {:.0f} % in `resonant`)"),
        ):
            percent = [100.0 * share for share in dominating_shares(model).values()]
            assert words.format(min(percent), max(percent)) in WORDS

    def test_the_step_between_two_published_optima(self):
        names = ("accuracy_first", "balanced", "robustness_first")
        problem, band = RobustDTE(), 0.05
        ours = [exact_moments(problem, TABLE_9[name], band) for name in names]
        for moments, words in (
            ([TABLE_8[name] for name in names], "{:+.3f} arcsec in the mean and {:+.3f} in"),
            (ours, "`calibrated` gives {:+.3f} and {:+.3f}."),
        ):
            assert words.format(*np.subtract(moments[2], moments[1])) in WORDS
        drawn = [dte_samples(problem, TABLE_9[name], band, 200_000, 2) for name in names]
        correlations = np.corrcoef(drawn)[np.triu_indices(3, 1)]
        least, most = f"{correlations.min():.3f}"[1:], f"{correlations.max():.4f}"[1:]
        assert f"correlate at {least} to {most} in `calibrated`" in WORDS
        first, last = np.reshape(drawn[1:], (2, 200, 1000))
        steps = last.mean(axis=1) - first.mean(axis=1), last.std(axis=1) - first.std(axis=1)
        assert np.std(steps, axis=1) == pytest.approx(0.012, abs=0.002)
        assert "known to some 0.012 arcsec" in WORDS

    def test_what_the_covariance_says_of_the_models(self):
        fits = inference.read_fits(DATA / "inference.csv")
        refitted, best = (named.fit for named in chosen_fits(fits)[1:3])
        common = [one for one in fits if one.target == "common"]
        assert gives_trade_off(best)
        assert not undominated(best)
        ours = steps_of(best.evaluation.predicted)
        alone = step_errors(best.evaluation, sampling_alone=True)
        for words in (
            f"of {len(common)} models searched, ",
            f"(chi-square {best.evaluation.chi_square('common'):.1f}, and "
            f"{ours[1]:+.2f} and {ours[3]:+.2f} arcsec for that step",
            f"{refitted.evaluation.chi_square('common'):.0f} where it is read at ±5 %",
            f"{best.reached} of {best.starts} starts",
            f"with {READING} arcsec beside sampling in each number",
            f"likeliest misses a step by {np.abs(alone).max():.1f} standard errors",
            f"{len(above_a_special_case(common))} of the searches ended above a special case",
        ):
            assert words in WORDS

    @pytest.mark.nightly
    def test_what_the_covariance_says_of_all_models(self):
        fits = inference.read_fits(DATA / "inference.csv")
        common = [one for one in fits if one.target == "common"]
        meeting = [one for one in common if gives_trade_off(one)]
        assert chosen_fits(fits)[2].fit is min(meeting, key=lambda one: one.bic)
        assert not any(gives_trade_off(one) and undominated(one) for one in fits)
        for words in (
            f"of {len(common)} models searched, {len(meeting)} give the nine numbers",
            f"by {min(one.evaluation.depths.max() for one in meeting):.2f} widths",
        ):
            assert words in WORDS

    def test_how_far_the_optimum_can_move(self):
        draws = inference.read_draws(DATA / "inference_posterior.csv")
        assert f"shift by up to {max(map(shift, draws)):.1f} standard deviations" in WORDS
        for drawn, words in zip(
            draws,
            ("a mean of {:.1f} to {:.1f} arcsec, J_in", "mean {:.1f} to {:.1f} arcsec, B_fc"),
            strict=True,
        ):
            mean, _, _, inertia, damping = balanced_ranges(drawn)
            assert words.format(*mean) in WORDS
            shown = inertia if "J_in" in words else damping
            assert f"at {shown[0]:.2f} to {shown[1]:.2f} of the nominal" in WORDS

    def test_the_front_of_order_3_is_dominated_at_order_5(self):
        finer = RobustDTE(order=5)
        front = finer.pareto_front()
        values = finer.evaluate(RobustDTE().pareto_set())
        assert "every design of the order-3 front of `calibrated` is dominated" in WORDS
        assert all(np.any(np.all(front < row, axis=1)) for row in values)

    def test_best_balanced_design_of_the_surrogates_front(self):
        front = RobustDTE().pareto_front()
        _, ours = row("best balanced design")
        best = front[WeightedUtopia(PREFERENCES["balanced"]).do(front)]
        assert ours == [round(value, 2) for value in best]

    def test_the_readme_in_three_sentences(self):
        published = preset("published")
        printed = published.dte_arcsec(published.nominal[np.newaxis])[0]
        paper = TABLE_8["initial"].mean_arcsec
        words = f"give a transmission error of {printed:.0f} arcsec where the paper has {paper:.0f}"
        assert words in WORDS

    def test_rows_have_both_sides(self):
        with io.StringIO(PAGES) as text:
            rows = [line for line in csv.reader(text, delimiter="|") if len(line) == 5]
        assert all(cell.strip() for line in rows for cell in line[2:4])
