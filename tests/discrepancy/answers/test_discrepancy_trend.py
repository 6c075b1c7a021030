"""How a misfit changes with speed and load: what was planted is said, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from planted_features import CONDITIONS as TWO_SPEEDS

from pymoo_hdte.discrepancy._answers.where.trend import Trend, broad_band, in_words, trends
from pymoo_hdte.discrepancy._selection.rules import RULES

SPEED, LOAD = np.array(
    [(rpm, load) for rpm in (10.0, 200.0, 1000.0, 2000.0) for load in (0.0, 10.0, 40.0)]
).T
COUNT = len(SPEED)
NOISE = np.full(COUNT, 0.01)


def kinds(misfit, noise=NOISE, speed=SPEED, load=LOAD, rules=RULES):
    found = trends(np.asarray(misfit, dtype=complex), noise, speed, load, rules)
    return {name: None if trend is None else trend.kind for name, trend in found.items()}


def plane(constant, by_speed, by_load, speed=SPEED, load=LOAD):
    return constant + by_speed * np.abs(speed) / 2000.0 + by_load * np.abs(load) / 40.0


PLANTED = {
    "steady": (plane(1.0, 0.0, 0.0), ("steady", "steady")),
    "load": (plane(0.1, 0.0, 1.0), ("steady", "grows")),
    "load without constant": (plane(0.0, 0.0, 1.0), ("steady", "grows")),
    "speed": (plane(0.1, 1.0, 0.0), ("grows", "steady")),
    "both": (plane(0.2, 1.0, 1.0), ("grows", "grows")),
    "less with load": (plane(1.0, 0.0, -0.9), ("steady", "falls")),
    "less with speed": (plane(1.0, -0.9, 0.0), ("falls", "steady")),
    "opposed": (plane(1.0, 1.0, -0.9), ("grows", "falls")),
    "a tenth": (plane(1.0, 0.0, 0.1), ("steady", "steady")),
    "product": (0.2 * LOAD / 40.0 + LOAD / 40.0 * SPEED / 2000.0, ("grows", "grows")),
}


@pytest.mark.parametrize("case", PLANTED)
@pytest.mark.parametrize("phase", [0.0, 2.3])
def test_what_was_planted_is_found(case, phase):
    misfit, (speed, load) = PLANTED[case]
    assert kinds(misfit * np.exp(1j * phase)) == {"speed": speed, "load": load}


def test_a_constant_taken_up_by_the_fit_does_not_hide_a_slope():
    """A zero of the sensor may take up half of it, so that its amplitude is equal at both ends."""
    misfit = plane(-0.5, 0.0, 1.0)
    amplitude = np.abs(misfit)
    assert amplitude[LOAD == 0.0].mean() == pytest.approx(amplitude[LOAD == 40.0].mean())
    assert kinds(misfit) == {"speed": "steady", "load": "turns"}
    assert kinds(plane(-0.1, 0.0, 1.0)) == {"speed": "steady", "load": "grows"}
    assert kinds(plane(-0.9, 0.0, 1.0)) == {"speed": "steady", "load": "falls"}


def test_a_friction_turns_with_the_speed_and_is_the_same_all_the_same():
    turned = np.where(np.arange(COUNT) % 2 == 0, SPEED, -SPEED)
    assert kinds(np.sign(turned), speed=turned) == {"speed": "steady", "load": "steady"}
    wound = np.where(np.arange(COUNT) % 2 == 0, LOAD, -LOAD)
    assert kinds(wound, load=wound) == {"speed": "steady", "load": "grows"}


def test_a_phase_that_passes_a_resonance_is_no_change_of_sign_of_what_grows():
    growing = (SPEED / 2000.0) ** 2
    passed = np.where(SPEED >= 2000.0, -growing, growing)
    assert kinds(passed)["speed"] == "grows"


def test_a_resonance_does_not_hide_that_the_load_changes_nothing():
    resonance = np.select([SPEED == 1000.0, SPEED == 200.0], [8.0, 1.5], 1.0)
    assert kinds(resonance) == {"speed": "unknown", "load": "steady"}
    milder = np.where(SPEED == 1000.0, 2.0, 1.0)
    assert kinds(milder * plane(0.1, 0.0, 1.0))["load"] == "grows"
    # A zero load that a sensor reads a little differently every time is one load.
    around = LOAD + np.where(LOAD == 0.0, 0.1 * np.cos(np.arange(COUNT)), 0.0)
    assert kinds(resonance, load=around)["load"] == "steady"
    turned = resonance * np.where(SPEED > 500.0, -1.0, 1.0)
    assert kinds(turned) == {"speed": "unknown", "load": "steady"}


def test_a_condition_that_was_not_varied_is_not_judged():
    one_load = np.full(COUNT, 40.0)
    assert kinds(plane(0.1, 1.0, 0.0), load=one_load) == {"speed": "grows", "load": None}
    assert "was measured at one load only" in in_words(
        trends(plane(0.1, 1.0, 0.0) + 0j, NOISE, SPEED, one_load, RULES)
    )


def test_conditions_varied_together_are_not_told_apart():
    together = 40.0 * SPEED / 2000.0
    found = trends(plane(0.1, 1.0, 0.0) + 0j, NOISE, SPEED, together, RULES)
    assert [trend.kind for trend in found.values()] == ["grows"]
    assert "speed or load, which were varied together" in in_words(found)
    # One record more that breaks the connection is enough to tell them apart.
    together[3:6] = 40.0, 0.0, 20.0
    assert kinds(plane(0.1, 1.0, 0.0), load=together) == {"speed": "grows", "load": "steady"}


def test_few_or_noisy_records_say_nothing(rng):
    three = [0, 2, 11]
    assert set(kinds(plane(0.1, 0.0, 1.0)[three], NOISE[three], SPEED[three], LOAD[three]).values()
    ) == {"unknown"}  # fmt: skip
    uneven = 1.0 + 0.9 * np.cos(9.0 * np.arange(COUNT))
    assert "differs from record to record" in in_words(
        trends(uneven + 0j, NOISE, SPEED, LOAD, RULES)
    )
    rough = plane(1.0, 0.0, 0.3) + rng.normal(0.0, 0.5, COUNT)
    assert kinds(rough, np.full(COUNT, 0.5)) == {"speed": "unknown", "load": "unknown"}
    assert "neither grows nor falls surely" in in_words(
        trends(rough + 0j, np.full(COUNT, 0.5), SPEED, LOAD, RULES)
    )


def test_noise_is_said_to_grow_as_rarely_as_the_rule_says(rng):
    speed, load = np.array(TWO_SPEEDS).T
    noise = np.full(len(speed), 0.1)
    trials, said = 400, 0
    for _ in range(trials):
        parts = rng.normal(0.0, 0.1, (2, len(speed)))
        found = kinds(1.0 + parts[0] + 1j * parts[1], noise, speed, load)
        said += sum(kind in ("grows", "falls", "turns") for kind in found.values())
    # Two conditions a trial; three standard deviations of the count.
    expected = 2.0 * trials * RULES.growth_chance
    assert said <= expected + 3.0 * np.sqrt(expected)


def test_the_rules_decide_what_matters():
    misfit = plane(1.0, 0.0, 0.4)
    assert kinds(misfit)["load"] == "grows"
    assert kinds(misfit, rules=replace(RULES, growth_ratio=2.0))["load"] == "steady"
    doubtful = plane(1.0, 0.0, 1.0) + 0.3 * np.cos(7.0 * np.arange(COUNT))
    surer = replace(RULES, growth_chance=1e-9)
    assert kinds(doubtful)["load"] == "grows"
    assert kinds(doubtful, rules=surer)["load"] == "unknown"


def test_the_quiet_records_do_not_decide_alone():
    """Slow records have a hundredth of the noise; what they miss is the form, not the noise."""
    noise = np.where(SPEED < 500.0, 1e-5, 1e-2)
    bent = plane(0.1, 0.0, 0.0) + np.where(SPEED < 500.0, 1e-3 * SPEED / 200.0, SPEED / 2000.0)
    assert kinds(bent, noise)["speed"] == "grows"


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(1e-9, 1e9), st.floats(0.1, 3.0))
@example(by_speed=0.03125, by_load=-0.4375, size=1.0, angle=2.0)
@settings(max_examples=40, deadline=None)
def test_units_and_angles_do_not_matter(by_speed, by_load, size, angle):
    """A mean is real; a line has a phase, and noise in two parts in place of one."""
    mean = plane(0.5, by_speed, by_load) + 0.02 * np.cos(5.0 * np.arange(COUNT)) + 0j
    line = np.exp(1j) * mean
    for misfit, other in ((mean, mean), (line, np.exp(1j * angle) * mean)):
        # At a limit rounding may decide.
        assert kinds(size * other, size * NOISE) == kinds(misfit) or any(
            near_a_limit(trend) for trend in trends(misfit, NOISE, SPEED, LOAD, RULES).values()
        )


def near_a_limit(trend):
    change = abs(trend.end - trend.start)
    low, high = sorted((abs(trend.start), abs(trend.end)))
    matters = (1.0 - 1.0 / RULES.growth_ratio) * max(high, trend.size)
    limits = (change - trend.reach, change + trend.reach - matters, change - matters, low - matters)
    return min(abs(limit) for limit in (*limits, high - low)) < 1e-6


@given(st.permutations(range(COUNT)))
@settings(max_examples=20, deadline=None)
def test_the_order_of_records_does_not_matter(places):
    places = list(places)
    misfit = plane(0.3, 0.5, -0.2) + 0.02 * np.cos(5.0 * np.arange(COUNT))
    assert kinds(misfit[places], NOISE, SPEED[places], LOAD[places]) == kinds(misfit)


@given(*[st.floats(-10.0, 10.0)] * 2, *[st.floats(0.0, 10.0)] * 2)
def test_a_kind_says_what_its_numbers_do(start, end, reach, size):
    trend = Trend(start, end, reach, size, 0.0, RULES)
    low, high, change = abs(start), abs(end), abs(end - start)
    if trend.kind == "grows":
        assert high > low
        assert change > reach
    if trend.kind == "falls":
        assert high <= low
        assert change > reach
    if trend.kind == "turns":
        assert start * end < 0.0
    if trend.kind == "steady":
        assert change <= 0.2 * max(low, high, size) + 1e-12
    if trend.ratio is not None:
        assert trend.ratio == pytest.approx(max(low, high) / min(low, high))


@given(arrays(float, (5, 3), elements=st.floats(0.1, 1e3)))
@settings(max_examples=20)
def test_a_broad_band_has_the_power_of_its_lines(lines):
    amplitude, noise = broad_band(lines + 0j, np.full((5, 3), 1e-9))
    assert np.abs(amplitude) == pytest.approx(np.sqrt(np.sum(lines**2, axis=1)))
    assert noise == pytest.approx(np.sqrt(3.0) * 1e-9)
