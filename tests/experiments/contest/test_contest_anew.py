"""Runs of an algorithm that changed, made anew in a stored outcome."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.contest.anew import anew
from experiments.contest.peers_data import contest_scores
from experiments.runner.campaign import Campaign
from pymoo_hdte.checks import InvalidInput

NAMES = ("AMP-MOPSO", "random search")


def test_only_the_rows_of_the_algorithm_are_made_again(tmp_path):
    campaign = Campaign(tmp_path)
    scores = contest_scores(campaign, ["ZDT1", "RobustToy"], NAMES, (200, 300), (1, 2))
    forgotten = scores.values.copy()
    forgotten[:, :, 0] = 0.0
    found = anew(replace(scores, values=forgotten), campaign, NAMES[:1])
    np.testing.assert_array_equal(found.values, scores.values)
    np.testing.assert_array_equal(found.spent, scores.spent)


def test_a_budget_that_was_not_run_is_not_run(tmp_path):
    campaign = Campaign(tmp_path)
    scores = contest_scores(campaign, ["RobustToy"], NAMES, (200, 300), (1,))
    scores.spent[:, :, 1] = 0
    assert not anew(scores, campaign, NAMES[:1]).spent[:, :, 1].any()


def test_an_algorithm_that_is_not_stored_is_refused(tmp_path):
    campaign = Campaign(tmp_path)
    scores = contest_scores(campaign, ["RobustToy"], NAMES[:1], (200,), (1,))
    with pytest.raises(InvalidInput, match="random search"):
        anew(scores, campaign, NAMES[1:])
