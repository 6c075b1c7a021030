"""Searches, profiles and posteriors: recovery of all parameters, and closed forms of a toy."""

from dataclasses import dataclass

import numpy as np
import pytest

from experiments.paper.calibrating.ladder import EFFECTS, KNOWN, NARROW, Candidate
from experiments.paper.inference import likelihood, posterior
from experiments.paper.inference.knowledge import interval
from experiments.paper.inference.likelihood import evaluate, least_deviance, residuals_of
from experiments.paper.inference.posterior import (
    Posterior,
    near,
    optima,
    profiles,
    sample,
    scaled_jacobian,
)
from experiments.paper.inference.rungs import Rung
from experiments.paper.inference.search import BASIN, Effort, Search, multi_start, refine

FULL = Rung(Candidate(EFFECTS, "semi_amplitude", NARROW))


@dataclass(frozen=True)
class LinearToy:
    """Numbers that are linear in two parameters, with unit errors: all is known in closed form."""

    matrix = np.array([[3.0, 1.0], [1.0, 2.0], [0.5, -1.0]])
    truth = np.array([8.0, -6.0])
    bounds = {"a": (-20.0, 20.0), "b": (-20.0, 20.0)}  # noqa: RUF012

    @property
    def limits(self):
        return np.array([-20.0, -20.0]), np.array([20.0, 20.0])

    def residuals(self, place):
        return self.matrix @ (place - self.truth)

    @property
    def covariance(self):
        return np.linalg.inv(self.matrix.T @ self.matrix)


def test_the_posterior_of_a_linear_toy_is_the_normal_one():
    pytest.importorskip("emcee")
    toy = LinearToy()
    rng = np.random.default_rng(1)
    starts = rng.multivariate_normal(toy.truth, toy.covariance, 12)

    def log_probability(place):
        return -0.5 * float(np.sum(toy.residuals(place) ** 2))

    def chain(seed, steps):
        return sample(log_probability, starts, steps, np.random.default_rng(seed))

    draws = chain(3, 1000)
    later = draws[200:].reshape(-1, 2)
    error = np.sqrt(np.diag(toy.covariance))
    assert later.mean(axis=0) == pytest.approx(toy.truth, abs=0.15 * error.min())
    assert np.cov(later.T) == pytest.approx(toy.covariance, rel=0.15, abs=0.01)
    # A longer chain goes on from a shorter one.
    assert np.array_equal(draws[:100], chain(3, 100))
    assert not np.array_equal(draws[:100], chain(4, 100))


def test_profiles_of_a_linear_toy_are_its_parabolas():
    toy = LinearToy()
    rows = profiles(toy.residuals, toy, toy.truth)
    std = np.sqrt(np.diag(toy.covariance))
    for axis in (0, 1):
        _, values, least = rows[rows[:, 0] == axis].T
        assert least == pytest.approx(((values - toy.truth[axis]) / std[axis]) ** 2, abs=1e-6)
        order = np.argsort(values)
        low, high = interval("a", np.column_stack([values, least])[order])
        # Interpolated between points of a parabola, 2 and 3 standard deviations away.
        assert (high - toy.truth[axis]) / std[axis] == pytest.approx(1.96, abs=0.03)
        assert (low - toy.truth[axis]) / std[axis] == pytest.approx(-1.96, abs=0.03)


def test_a_profile_that_never_rises_has_no_end():
    curve = np.column_stack([np.arange(5.0), [9.0, 1.0, 0.0, 0.5, 1.0]])
    low, high = interval("std_arcsec", curve)
    assert low == pytest.approx(1.0 - (3.84 - 1.0) / 8.0)
    assert high is None


def test_starts_of_a_hypercube_find_the_optimum_of_a_toy():
    toy = LinearToy()
    ends = multi_start(
        toy.residuals, toy, Effort(6, (2, 5, 5)), np.random.default_rng(1), toy.residuals
    )
    assert len(ends) == 2
    assert ends[0] == pytest.approx(toy.truth, abs=1e-6)
    _, held = refine(toy.residuals, toy, np.zeros(2), 5, fixed=1)
    assert held[1] == 0.0


@pytest.mark.parametrize("number", [5])
def test_nine_perturbed_parameters_are_recovered_as_far_as_they_can_be_known(number, monkeypatch):
    """Numbers made by the model; a start off by 2 % of every range comes back to their prediction.

    Nine parameters for nine numbers, and directions among them that no number sees: there the
    parameters may stay where they started, in all others they come back.
    """
    truth = KNOWN[number]
    low, high = FULL.limits
    made = evaluate(FULL, truth, front=False)
    monkeypatch.setattr(likelihood, "OBSERVED", made.predicted)

    def residuals(place):
        return residuals_of(FULL, "independent", place)

    place = FULL.searched(truth)
    perturbed = place + 0.02 * (high - low) * np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])
    assert np.sum(residuals(perturbed)[:9] ** 2) > 100.0
    _, found = refine(residuals, FULL, perturbed, 25)
    again = evaluate(FULL, FULL.physical(found), front=False)
    assert np.sum(residuals(found)[:9] ** 2) < 0.05
    assert again.predicted == pytest.approx(made.predicted, abs=0.1)
    # Along the directions that are known to a hundredth of the ranges, the truth is met.
    _, values, directions = np.linalg.svd(
        scaled_jacobian(lambda at: residuals(at)[:9], place, high - low)
    )
    error = directions @ ((found - place) / (high - low))
    assert np.abs(error[values > 100.0]).max() < 2e-3
    assert values[-1] < 10.0


def test_the_same_seed_gives_the_same_search_and_the_same_posterior(monkeypatch):
    effort = Effort(2, (1, 1, 1))
    rung = Rung(Candidate(("load_inertia",), "semi_amplitude", NARROW))
    first, second = (Search(rung, "common", 3, effort).execute() for _ in range(2))
    assert np.array_equal(first.values, second.values)
    assert not np.array_equal(first.values, Search(rung, "common", 4, effort).execute().values)
    assert first.values[0, 0] <= first.values[-1, 0] + BASIN
    pytest.importorskip("emcee")
    monkeypatch.setattr(posterior, "DRAWS", 2)
    job = Posterior(rung, "common", tuple(first.values[0, 1:].tolist()), 3, 2)
    once, twice = job.execute(), job.execute()
    assert np.array_equal(once.values, twice.values)
    deviance = least_deviance(residuals_of(rung, "common", once.values[0, 1:7]))
    assert once.values[0, 0] == pytest.approx(deviance)


def test_walkers_begin_inside_the_ranges():
    place = FULL.searched(KNOWN[1])
    found = near(FULL, "common", place, 30, np.random.default_rng(1))
    low, high = FULL.limits
    ends = np.array([not name.startswith("phase") for name in FULL.bounds])
    assert np.all((found >= low)[:, ends] & (found <= high)[:, ends])
    assert found.std(axis=0).min() > 0.0


def test_the_chosen_design_is_on_the_front_of_the_box():
    found = optima(FULL, KNOWN[5], 5)
    means = [found[f"mean_{name}"] for name in ("accuracy_first", "balanced", "robustness_first")]
    stds = [found[f"std_{name}"] for name in ("accuracy_first", "balanced", "robustness_first")]
    assert means == sorted(means)
    assert stds == sorted(stds, reverse=True)
    assert all(0.75 <= found[f"{name}_balanced"] <= 1.25 for name in ("K", "J_in", "B_fc"))
