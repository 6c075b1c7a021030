"""Numbers of README and its pages about rivals, of the swarm and of the robust surrogate."""

import numpy as np
from places import WORDS

from experiments.runner.registry import Context
from experiments.studies.robust.data import CHAOSPY, KRIGING, OURS, ahead, is_complete, outcome_for
from pymoo_hdte._runner.campaign import Campaign


def test_runs_of_robust_surrogates_are_those_of_the_stored_outcome(tmp_path):
    outcome = outcome_for(Context(1, tmp_path, Campaign(tmp_path)))
    names = [name for name in outcome.functions() if is_complete(outcome, name)]
    fewer = [name for name in names if ahead(outcome, name)]
    assert f"on {len(fewer)} of the {len(names)} functions for which the count is complete" in WORDS
    above = {name for name in names if outcome.needed(name, OURS) is None}
    assert above == {"two kinks", "jump", "robot arm"}
    assert {*names} - {*fewer} - above == {"kink", "failing region"}
    rival, ours = (outcome.needed("kink", method) for method in (KRIGING, OURS))
    assert f"Kriging takes {rival} runs on a kink and ours {ours}" in WORDS
    rival, ours = (outcome.needed("failing region", method) for method in (CHAOSPY, OURS))
    assert f"chaospy takes {rival} and ours {ours}" in WORDS
    builds = outcome.stops.values()
    assert all(min(build["covered_mean"], build["covered_std"]) >= 0.95 for build in builds)
    assert f"in all {len(builds)} builds of {len(outcome.functions())} functions" in WORDS
    refused = sum(np.isnan(build["runs"]) for build in builds)
    assert f"{refused} of them not accurate to 1 % after 500 runs" in WORDS
