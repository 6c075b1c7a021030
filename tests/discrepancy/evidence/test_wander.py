"""A set speed that wanders is no misfit of the lines into which it falls."""

from types import SimpleNamespace

import numpy as np
import pytest
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.discrepancy import RunningRecord
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure, unexpected_lines
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

RATIO = BELIEVED.ratio
ORDERS = [1.0 / RATIO, 2.0 / RATIO, 1.0, 2.0, 2.02]
CAMPAIGN = SimpleNamespace(believed=BELIEVED, rig=RIG)
RATES = {200.0: 250.0, 600.0: 500.0, 1500.0: 1000.0, 2000.0: 1000.0}
"""Rows a second at each speed in r/min, for an output turn."""
IN_A_LINE = 2.0 / RATIO * 600.0 / 60.0
"""Hz: in the second line of the output turn at 600 r/min, and in no neighbour of it."""


def wandering(rng, rpm, size):
    """A record of a steady drive whose set speed wanders by tones of a share of it."""
    speed, rate = rpm * REVOLUTION_PER_MINUTE, RATES[rpm]
    time = np.arange(int(RATIO * 60.0 / rpm * rate) + 1) / rate
    noise = RIG.angle_noise * rng.standard_normal((2, len(time)))
    angle = speed * time
    for tone in 2.0 * np.pi * np.array([IN_A_LINE, 3.0]):
        angle += size * speed / tone * np.sin(tone * time + rng.uniform(0.0, 2.0 * np.pi))
    torques = 1e-3 * rng.standard_normal((2, len(time)))
    return RunningRecord(
        f"run_{rpm}", "train", speed, 0.0, rate, 1, 0.0, time,
        angle + RATIO * noise[0], angle / RATIO + noise[1], *torques,
    )  # fmt: skip


@pytest.mark.parametrize("size", [1e-5, 1e-4])
def test_a_tone_within_a_line_is_known_from_records_at_other_speeds(rng, size):
    for _ in range(2):
        records = [wandering(rng, rpm, size) for rpm in RATES]
        features = measure(CAMPAIGN, records, ORDERS)
        lead = features.places(3)[:, 0]
        noise = np.diagonal(features.covariance, axis1=1, axis2=2)[:, lead]
        expected = np.sqrt(2.0 * (features.wander + noise))
        # A tone has an amplitude, so that its line is not far above it.
        assert np.all(np.abs(features.conditions.lead) < 3.0 * expected)


def test_what_does_not_wander_does_so_in_no_line(rng):
    features = measure(CAMPAIGN, [wandering(rng, rpm, 0.0) for rpm in RATES], ORDERS)
    assert not features.wander.any()


@pytest.mark.parametrize("coarse", [False, True])
@pytest.mark.parametrize("size", [1e-5, 4e-4])
def test_a_speed_that_wanders_shows_no_line_of_the_drive(rng, size, coarse):
    """The output follows the input, so that an angle of either shows what is none."""
    features = measure(CAMPAIGN, [wandering(rng, rpm, size) for rpm in RATES], ORDERS)
    assert unexpected_lines(features, RATIO, RIG, coarse=coarse) == [{}] * len(RATES)
