"""Numbers of README and its pages about rivals, of the swarm and of the robust surrogate."""

import numpy as np
from places import WORDS

from experiments.runner.registry import Context
from experiments.studies.robust.data import METHODS, OPENTURNS, OURS, ahead, outcome_for
from experiments.studies.robust.functions import FUNCTIONS
from pymoo_hdte._runner.campaign import Campaign


def test_runs_of_robust_surrogates_are_those_of_the_stored_outcome(tmp_path):
    outcome = outcome_for(Context(1, tmp_path, Campaign(tmp_path)))
    names = outcome.functions()
    fewer = [name for name in names if ahead(outcome, name)]
    kept_out = [one.name for one in FUNCTIONS if not one.tuned]
    assert f"on {len(fewer)} of {len(names)} functions, most of the literature" in WORDS
    assert f"({len({*fewer} & {*kept_out})} of the {len(kept_out)} kept out of" in WORDS
    assert {*names} - {*fewer} == {"kink", "robot arm"}
    rival, ours = (outcome.needed("kink", method) for method in (OPENTURNS, OURS))
    assert f"on a kink OpenTURNS takes {rival} and ours {ours}" in WORDS
    assert all(outcome.needed("robot arm", method) is None for method in METHODS)
    answered = [one for one in outcome.stops.values() if np.isfinite(one["runs"])]
    covered = [min(one["covered_mean"], one["covered_std"]) for one in answered]
    held = sum(share >= 0.95 for share in covered)
    assert f"covers 95 % of 200 designs in {held} of {len(covered)} surrogate builds" in WORDS
    assert f"({100.0 * min(covered):g} % in one of the kink)" in WORDS
    refused = {name for (name, _), one in outcome.stops.items() if not np.isfinite(one["runs"])}
    assert len(refused) == 3
    assert "three of the ten functions are refused after 1000 runs" in WORDS
