"""Searches: recovery of all parameters, and the closed form of a toy."""

from dataclasses import dataclass

import numpy as np
import pytest

from experiments.paper.calibrating.ladder import EFFECTS, KNOWN, NARROW, Candidate
from experiments.paper.inference import likelihood
from experiments.paper.inference.likelihood import evaluate, residuals_of
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


def test_starts_of_a_hypercube_find_the_optimum_of_a_toy():
    toy = LinearToy()
    ends = multi_start(
        toy.residuals, toy, Effort(6, (2, 5, 5)), np.random.default_rng(1), toy.residuals
    )
    assert len(ends) == 2
    assert ends[0] == pytest.approx(toy.truth, abs=1e-6)


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
    steps = 1e-4 * np.diag(high - low)
    jacobian = [(residuals(place + s) - residuals(place - s))[:9] / 2e-4 for s in steps]
    _, values, directions = np.linalg.svd(np.transpose(jacobian))
    error = directions @ ((found - place) / (high - low))
    assert np.abs(error[values > 100.0]).max() < 2e-3
    assert values[-1] < 10.0


def test_the_same_seed_gives_the_same_search():
    effort = Effort(2, (1, 1, 1))
    rung = Rung(Candidate(("load_inertia",), "semi_amplitude", NARROW))
    first, second = (Search(rung, "common", 3, effort).execute() for _ in range(2))
    assert np.array_equal(first.values, second.values)
    assert not np.array_equal(first.values, Search(rung, "common", 4, effort).execute().values)
    assert first.values[0, 0] <= first.values[-1, 0] + BASIN
