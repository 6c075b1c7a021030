"""Numbers of README and its pages about rivals, of the swarm and of the robust surrogate."""

import numpy as np
import pytest
from places import WORDS
from scipy.stats import norm

from experiments.runner.registry import Context
from experiments.studies.robust.data import (
    CHAOSPY,
    KRIGING,
    OURS,
    SEEDS,
    ahead,
    is_complete,
    outcome_for,
)
from experiments.studies.robust.experiment import WANTED_COVERED
from pymoo_hdte._runner.campaign import Campaign


def test_runs_of_robust_surrogates_are_those_of_the_stored_outcome(tmp_path):
    outcome = outcome_for(Context(1, tmp_path, Campaign(tmp_path)))
    names = [name for name in outcome.functions() if is_complete(outcome, name)]
    fewer = [name for name in names if ahead(outcome, name)]
    assert f"on {len(fewer)} of {len(names)} functions, in the median of five seeds" in WORDS
    assert {seed for _, seed in outcome.stops} == set(SEEDS)
    above = {name for name in names if outcome.needed(name, OURS) is None}
    assert above == {"two kinks", "jump", "robot arm"}
    assert {*names} - {*fewer} - above == {"kink", "failing region"}
    assert outcome.needed("kink", KRIGING) == outcome.needed("kink", OURS)
    rival, ours = (outcome.needed("failing region", method) for method in (CHAOSPY, OURS))
    assert f"chaospy takes {rival} runs and ours {ours}" in WORDS
    builds = list(outcome.stops.values())
    covered = [min(build["covered_mean"], build["covered_std"]) for build in builds]
    few = sum(share < WANTED_COVERED for share in covered)
    least = f"one of them {100.0 * min(covered):.0f} %"
    assert f"Of {len(builds)} builds, {few} cover fewer, {least}" in WORDS
    for name in names:
        stops = outcome.stops_of(name)
        for moment in ("covered_mean", "covered_std"):
            assert np.mean([stop[moment] for stop in stops]) >= WANTED_COVERED
    unsure = sum(np.isnan(build["runs"]) for build in builds)
    assert f"{unsure} were not sure of 1 % after 500 runs" in WORDS
    shares = [
        build[f"true_{moment}_error"] / build[f"stated_{moment}_error"]
        for build in builds
        for moment in ("mean", "std")
    ]
    # A third; of a normal error with a band of 95 % it is .34.
    assert np.median(shares) == pytest.approx(norm.ppf(0.75) / norm.ppf(0.975), abs=0.03)
