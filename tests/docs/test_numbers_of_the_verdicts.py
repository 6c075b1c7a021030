"""Numbers of README and its pages about blind campaigns."""

import re

from places import README, WORDS
from scipy.stats import binomtest

from experiments.blind.cases import all_cases
from experiments.blind.data import read_outcomes
from experiments.blind.experiment import OUTCOMES, SECONDS
from experiments.blind.runs import RUNS, read_runs, total
from experiments.runner.committed import DATA


def test_blind_scores_are_those_of_the_committed_cases():
    outcomes = read_outcomes(DATA / OUTCOMES, DATA / SECONDS)
    singles, pairs, clean = (
        [one for one in outcomes if one.case.kind == kind] for kind in ("single", "pair", "none")
    )
    stated = re.search(
        r"Of the (\d+) blind campaigns .* cases (\d+) to (\d+) have .* (\d+) of (\d+) plain "
        r"answers w(?:as|ere) wrong, (\d+) of (\d+) single effects .* both effects of (\d+) of "
        r"(\d+) pairs.* (\d+) of (\d+) campaigns that hide nothing",
        WORDS,
    )
    assert stated is not None
    first = all_cases().index(outcomes[0].case) + 1
    assert [int(one) for one in stated.groups()] == [
        *(len(all_cases()), first, first + len(outcomes) - 1),
        *(sum(one.wrong_confident for one in outcomes), sum(one.confident for one in outcomes)),
        *(sum(one.right for one in singles), len(singles)),
        *(sum(one.all_named for one in pairs), len(pairs)),
        *(sum(one.status != "adequate" for one in clean), len(clean)),
    ]


def test_the_readme_says_what_came_of_the_blind_campaigns():
    outcomes = read_outcomes(DATA / OUTCOMES, DATA / SECONDS)
    plain = [one for one in outcomes if one.confident]
    pairs = [one for one in outcomes if one.case.kind == "pair"]
    said = " ".join(README.split())
    assert f"Of the last {len(outcomes)} blind campaigns" in said
    wrong = sum(one.wrong_confident for one in plain)
    verb = "was" if wrong < 2 else "were"
    assert f"{wrong or 'none'} of {len(plain)} plain answers {verb} wrong" in said
    singles = [one for one in outcomes if one.case.kind == "single"]
    assert f"of {len(singles)} single effects it found {sum(one.right for one in singles)}" in said
    both = sum(one.all_named for one in pairs)
    assert f"it named both in {both} of {len(pairs)}" in said


def test_pooled_figures_are_those_of_the_runs():
    runs = read_runs(DATA / RUNS)
    firsts = set(re.findall(r"since case (\d+)", WORDS))
    assert len(firsts) == 1
    first = firsts.pop()
    since = total([one for one in runs if one.first >= int(first)])

    def share(value):
        return f"{value:.2f}".removeprefix("0")

    def pooled(good, of):
        found = binomtest(good, of)
        low, high = found.proportion_ci(method="exact")
        return share(found.statistic), f"({share(low)} to {share(high)})"

    both, interval = pooled(since.pair_both, since.pair)
    assert f"{both} {interval} of the {since.pair} since case {first}" in WORDS
    holds, interval = pooled(since.interval_holds, since.interval)
    assert f"{holds} {interval} of {since.interval} since case {first}" in WORDS
    low, high = binomtest(since.plain_wrong, since.plain).proportion_ci(method="exact")
    wrong = f"({f'{100 * low:.1f}'.removeprefix('0')} to {100 * high:.1f} %)"
    assert f"{since.plain_wrong} of {since.plain} {wrong} since case {first}" in WORDS
    before = total(runs[:-1])
    assert f"{before.plain_wrong} of their {before.plain} plain answers were wrong" in WORDS
