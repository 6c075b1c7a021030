"""Records sampled coarsely for their motion, of whose derivatives polynomials know little."""

import json

import numpy as np
import pytest
from measured_oscillator import (
    FORCE_NOISE,
    HIGHEST,
    OSCILLATOR,
    POSITION_NOISE,
    cubic,
    nothing,
    record_of,
    reported,
)

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import MeasuredMechanism, analyse
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.mechanism import Record
from pymoo_hdte.mechanism.motion import highest_frequency, highest_share
from pymoo_hdte.mechanism.resampling import floor_noise, refined, share_beyond

SLOWER = 3
"""Of the oscillator's 250 Hz: 83 Hz, eight samples in a period of its resonance."""


def coarse(record, every=SLOWER):
    channels = {name: one[::every] for name, one in record.channels.items()}
    return Record(record.name, record.role, record.time[::every], channels)


HELD_OUT = record_of(nothing, "held_out", seed=3, duration=4.0)


def coarse_records(hidden):
    return [
        coarse(record_of(hidden, duration=8.0)),
        coarse(record_of(hidden, "held_out", seed=3, duration=4.0)),
    ]


def test_a_curve_through_coarse_samples_is_the_signal_within_its_noise():
    time = np.arange(2000) / 100.0
    signal = np.cos(2.0 * np.pi * 7.3 * time) + 0.5 * np.sin(2.0 * np.pi * 31.0 * time + 1.0)
    record = Record("lines", "train", time, {"x": signal}, noise={"x": 1e-3})
    fine = refined(record, 5)
    t = fine.time
    exact = np.cos(2.0 * np.pi * 7.3 * t) + 0.5 * np.sin(2.0 * np.pi * 31.0 * t + 1.0)
    assert fine.step == pytest.approx(record.step / 5.0)
    assert np.abs(fine.channels["x"] - exact).max() < 1e-3
    # As much noise at each frequency as before: five times the band holds five times the power.
    assert fine.noise["x"] == pytest.approx(1e-3 * 5.0**0.5)


@pytest.mark.parametrize("deviation", [1e-4, 1e-2])
def test_noise_is_the_floor_of_the_spectrum(deviation, rng):
    time = np.arange(6000) / 50.0
    signal = np.cos(2.0 * np.pi * 10.0 * time) + deviation * rng.standard_normal(len(time))
    assert floor_noise(signal) == pytest.approx(deviation, rel=0.15)


def test_share_beyond_a_frequency_is_that_of_the_lines_there():
    time = np.arange(5000) / 100.0
    signal = 7.0 + 3.0 * np.cos(2.0 * np.pi * 2.0 * time) + np.cos(2.0 * np.pi * 20.0 * time)
    assert share_beyond(signal, 0.01, 10.0) == pytest.approx(0.1, abs=1e-3)
    slow = 40.0 * time / time[-1] + 1e-3 * np.cos(2.0 * np.pi * 20.0 * time)
    assert share_beyond(slow, 0.01, 10.0) < 0.01


@pytest.mark.nightly
def test_a_cubic_spring_is_found_at_eight_samples_a_period():
    """At a tenth of the rate the resonance is lost, and with it the spring."""
    analysis, files = reported(
        analyse(MeasuredMechanism(OSCILLATOR, coarse_records(cubic), title="coarse"))
    )
    assert analysis.verdict.status == "named"
    (effect,) = json.loads(files["verdict.json"])["effects"]
    assert (effect["name"], effect["port"]) == ("hardening_stiffness", "spring")
    found = effect["parameters"]["coefficient"]
    assert found["value"] == pytest.approx(4e6, rel=0.05)
    band = json.loads(files["verdict.json"])["band"]
    assert band["cutoff_Hz"] > HIGHEST
    assert band["share_of_motion_beyond"] < 0.2
    assert f"{band['cutoff_Hz']:.3g} Hz" in files["report.html"].decode()


@pytest.mark.parametrize("every", [3, pytest.param(5, marks=pytest.mark.nightly)])
def test_nothing_hidden_is_adequate_however_coarse_the_samples(every):
    records = [coarse(one, every) for one in (record_of(nothing), HELD_OUT)]
    assert examine_mechanism(OSCILLATOR, records).verdict.status == "adequate"


@pytest.mark.nightly
def test_a_record_that_is_fine_enough_stays_as_it_is():
    records = [record_of(cubic), record_of(cubic, "held_out", seed=3, duration=4.0)]
    finding = examine_mechanism(OSCILLATOR, records)
    assert all(one is other for one, other in zip(finding.records, records, strict=True))


def test_less_than_three_samples_in_a_period_of_the_cutoff_are_refused():
    with pytest.raises(InvalidInput, match="three samples in a period"):
        examine_mechanism(OSCILLATOR, coarse_records(nothing), cutoff=30.0)


def test_the_planted_noise_is_that_of_the_helpers():
    """What the floor of a coarse record says: no more than the sensors have."""
    record = coarse(record_of(nothing))
    assert floor_noise(record.channels["x"]) == pytest.approx(POSITION_NOISE, rel=0.25)
    assert floor_noise(record.channels["force"]) == pytest.approx(FORCE_NOISE, rel=0.25)


@pytest.mark.parametrize("rate", [990.0, 1000.0])
def test_a_motion_known_up_to_the_limit_is_within_it_at_any_rate(rate):
    """The limit is one number: worked out in two ways it differed in the last digit at 990 Hz."""
    step = 1.0 / rate
    position = np.cumsum(np.cumsum(np.random.default_rng(3).standard_normal(4000)))
    assert highest_frequency(position, step, 1e-6) <= highest_share(step)
