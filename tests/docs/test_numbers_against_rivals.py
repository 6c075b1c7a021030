"""Numbers of README and its pages about rivals, of the swarm and of the robust surrogate."""

import numpy as np
from places import WORDS

from experiments.runner.registry import Context
from experiments.studies.robust.data import CHAOSPY, KRIGING, OURS, ahead, outcome_for
from pymoo_hdte._runner.campaign import Campaign


def test_runs_of_robust_surrogates_are_those_of_the_stored_outcome(tmp_path):
    outcome = outcome_for(Context(1, tmp_path, Campaign(tmp_path)))
    names = outcome.functions()
    fewer = [name for name in names if ahead(outcome, name)]
    assert f"on {len(fewer)} of the {len(names)} functions for which the count is complete" in WORDS
    assert {*names} - {*fewer} == {"kink", "failing region"}
    rival, ours = (outcome.needed("kink", method) for method in (KRIGING, OURS))
    assert f"Kriging takes {rival} runs on a kink and ours {ours}" in WORDS
    rival, ours = (outcome.needed("failing region", method) for method in (CHAOSPY, OURS))
    assert f"chaospy takes {rival} and ours {ours}" in WORDS
    accepted = [one for one in outcome.stops.values() if np.isfinite(one["runs"])]
    held = [min(one["covered_mean"], one["covered_std"]) >= 0.95 for one in accepted]
    assert all(held)
    assert f"in all {len(held)} builds of these functions that were accepted" in WORDS
