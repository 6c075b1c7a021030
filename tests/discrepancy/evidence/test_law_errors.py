"""Relative errors of laws: processes of the stated size, and tangents of scaled laws."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_hdte.discrepancy._evidence.force_balances.law_errors import (
    BalanceErrors,
    _of_turn,
    _turns_of,
)
from pymoo_hdte.discrepancy._evidence.order_lines.law_errors import ScaledLaw
from pymoo_hdte.discrepancy._selection.process import TERMS, sine_of, sines_of
from pymoo_hdte.effects.law import PortState, periodic_phase
from pymoo_hdte.effects.stiffness import HardeningStiffness, SoftWindup

PLACES = np.linspace(-1.0, 1.0, 41)


def test_an_error_has_the_stated_deviation_wherever_it_is():
    assert np.sum(sines_of(PLACES) ** 2, axis=1) == pytest.approx(np.ones(41), abs=0.02)


def test_further_sines_have_hardly_any_size():
    further = sum(sine_of(number, PLACES)[0] ** 2 for number in range(TERMS + 1, 2 * TERMS + 1))
    assert np.max(further) < 0.02


@given(st.floats(-0.9, 0.9), st.integers(1, TERMS))
def test_tangents_are_those_of_the_torque(place, number):
    state_of = lambda x: PortState(  # noqa: E731
        np.array([x]), np.array([0.3]), periodic_phase(np.array([x])), np.array([2.6e4])
    )
    for law in (HardeningStiffness(2e9), SoftWindup(0.3, 3e-4, 3.0)):
        scaled, travel = ScaledLaw(law, 1e-3, number, 0.01), 1e-3
        at, step = place * travel, 1e-6 * travel
        ahead, behind = (scaled.respond(state_of(at + sign * step)).torque for sign in (1, -1))
        slope = np.asarray(scaled.respond(state_of(at)).slope)
        size = max(abs(float(slope[0])), 1.0)
        assert (ahead - behind) / (2.0 * step) == pytest.approx(slope, abs=1e-4 * size)


def test_a_motion_turns_stops_and_starts():
    """At once, or anywhere in a rest, of which the ends of a record may be parts."""
    speed = np.concatenate([np.ones(10), -np.ones(10), np.zeros(11), np.ones(10)])
    (turn, *rest) = _turns_of(speed, 0.5, 4.0)
    assert turn == (9.5, 1.0, -1.0)
    assert rest == [(place, -1.0, 1.0) for place in (20.5, 23.5, 26.5, 29.5)]
    assert _turns_of(np.ones(10), 0.5, 4.0) == []
    slows = np.abs(np.linspace(-1.0, 1.0, 41))
    # However shortly: noise of the speed hides whether it stops there.
    assert _turns_of(slows, 0.02, 4.0) == [(20.0, 1.0, 1.0)]
    from_rest = np.linspace(0.01, 1.0, 40)
    assert _turns_of(from_rest, 0.0, 4.0) == [(0.0, 0.0, 1.0)]
    assert _turns_of(-from_rest[::-1], 0.0, 4.0) == [(39.0, -1.0, 0.0)]


@pytest.mark.parametrize(("before", "after"), [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)])
def test_dry_friction_may_turn_at_any_moment_around_a_turn_that_is_seen(rng, before, after):
    """Beside a stop it is less on both sides, beside a turn each time nearer to the other side."""
    places = np.array([-1.5, -0.7, -0.4, -0.1, 0.1, 0.3, 0.6, 0.9, 1.2])
    turns = rng.uniform(-1.0, 1.0, (40_000, 1))
    between = np.where(places < 0.0, -before, -after)
    between = between * ((places * turns > 0.0) & (np.abs(places) < np.abs(turns)))
    wanted = 4.0 * between.T @ between / len(turns)
    pulses = np.array(list(_of_turn(places, before, after)))
    assert pulses.T @ pulses == pytest.approx(wanted, abs=0.15)


def balances(residuals, frequency, parts=1):
    """Return what the score knows of residuals (n,) of one record, each part at all frequencies."""
    data = SimpleNamespace(
        frequency=np.tile(frequency, parts),
        _part=np.repeat(np.arange(parts), len(frequency)),
        _record=np.zeros(parts * len(frequency), dtype=int),
    )
    return BalanceErrors(data, None, SimpleNamespace(residuals=residuals))


def test_each_octave_of_a_balance_has_its_noise():
    frequency = np.linspace(0.0, 16.0, 200)
    channels = balances(np.ones(400), frequency, parts=2).channels
    counts = np.bincount(channels)
    assert np.all(counts >= 20)
    of_first = channels[:200]
    assert np.array_equal(channels[200:], of_first + of_first.max() + 1)
    # From above: over 8 Hz, over 4 Hz, and all that are fewer than 20 with the octave over them.
    assert [frequency[of_first == k].min() > low for k, low in ((0, 7.9), (1, 3.9))] == [True] * 2
    assert frequency[of_first == of_first.max()].min() == 0.0


def test_residuals_of_a_motion_that_repeats_count_for_few(rng):
    """White ones count nearly for all; of lines the others are no witnesses."""
    frequency = np.linspace(8.1, 16.0, 400)
    white = rng.normal(size=400)
    lines = np.where(np.arange(400) % 100 == 50, 40.0, 0.1) * white
    counts = [balances(residuals, frequency).shares.sum() for residuals in (white, lines)]
    assert counts[0] > 0.7 * 400
    assert counts[1] < 0.2 * 400
