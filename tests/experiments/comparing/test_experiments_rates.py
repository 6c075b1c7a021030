"""States of scores: exact intervals against a demand, and what a finding says of them."""

import numpy as np
import pytest

from pymoo_hdte._comparing.statistics import Estimate, mean, median, rate
from pymoo_hdte._runner.result import MISSED, NOT_SHOWN, SHOWN, Finding, scored


@pytest.mark.parametrize("n", [5, 20, 200])
def test_intervals_of_a_rate_are_exact(n):
    none, every = rate(0, n), rate(n, n)
    assert none.high == pytest.approx(1.0 - 0.025 ** (1.0 / n))
    assert none.low == 0.0
    assert every.low == pytest.approx(0.025 ** (1.0 / n))
    assert every.high == 1.0


def test_an_interval_holds_the_true_rate_in_95_percent_of_all_draws_or_more(rng):
    for true, n in ((0.01, 72), (0.8, 30), (0.97, 465)):
        intervals = {hits: rate(hits, n) for hits in range(n + 1)}
        drawn = [intervals[hits] for hits in rng.binomial(n, true, 4000).tolist()]
        assert np.mean([one.low <= true <= one.high for one in drawn]) >= 0.94


def test_no_event_in_three_cases_shows_no_small_rate():
    # With a true rate of one in two, three cases without an event are drawn once in eight times.
    assert rate(0, 3).high == pytest.approx(0.7076, abs=1e-4)
    assert rate(0, 3).state(0.01, at_least=False) == NOT_SHOWN
    assert rate(0, 1000).state(0.01, at_least=False) == SHOWN


def test_a_score_is_shown_not_shown_or_missed():
    # 1 - 0.025^(1 / 72) = 0.0499: 72 cases without a miss are the fewest that show 95 %.
    states = [rate(n - missed, n).state(0.95) for n, missed in ((72, 0), (71, 0), (20, 1), (20, 2))]
    assert states == [SHOWN, NOT_SHOWN, NOT_SHOWN, MISSED]
    assert rate(20, 20).state(0.95, at_least=False) == MISSED
    assert rate(0, 0).n == 0
    assert rate(0, 0).state(0.5) == NOT_SHOWN


def test_a_score_rarely_shows_what_is_not_so(rng):
    # At a true rate just short of the demand, at most 2.5 % of the campaigns show it.
    drawn = rng.binomial(200, 0.899, 4000)
    states = {hits: rate(hits, 200).state(0.9) for hits in set(drawn.tolist())}
    assert np.mean([states[hits] == SHOWN for hits in drawn.tolist()]) < 0.03


def test_the_interval_of_a_median_lies_between_order_statistics():
    # P(at most 2 of 12 below the median) = (1 + 12 + 66) / 2^12 = 1.9 %, at most 3: 7.3 %.
    found = median([*np.arange(12.0), None])
    assert found == Estimate(5.5, 2.0, 9.0, 12)
    few = median([1.0, 2.0, 3.0])
    assert (few.low, few.high) == (-np.inf, np.inf)
    assert few.state(1.5) == NOT_SHOWN
    assert median([1.0] * 20).state(2.0) == MISSED
    assert median([1.0] * 20).state(2.0, at_least=False) == SHOWN


def test_the_interval_of_a_mean_is_students(rng):
    # With two values and one degree of freedom, t is tan(0.475 pi) = 12.7 times half the distance.
    found = mean([1.0, 3.0])
    assert (found.value, found.n) == (2.0, 2)
    assert found.high - 2.0 == pytest.approx(np.tan(0.475 * np.pi))
    assert mean([1.0]).state(0.5) == NOT_SHOWN
    drawn = [mean(values.tolist()) for values in rng.normal(5.0, 2.0, (4000, 8))]
    assert np.mean([one.low <= 5.0 <= one.high for one in drawn]) == pytest.approx(0.95, abs=0.015)


def test_only_what_is_shown_agrees():
    findings = [scored(state, "A score.") for state in (SHOWN, NOT_SHOWN, MISSED)]
    assert [one.agrees for one in findings] == [True, False, False]
    assert [one.verdict for one in findings] == [SHOWN, NOT_SHOWN, MISSED]
    with pytest.raises(ValueError, match="a score is a check"):
        Finding(True, "No check.", score=SHOWN)
    with pytest.raises(ValueError, match="in one of the states"):
        Finding(True, "Another state.", check=True, score="Reached")
