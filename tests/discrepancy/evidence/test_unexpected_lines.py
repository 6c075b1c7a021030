"""Lines of running records that no one expected."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_rig_cases import BELIEVED, RIG

from pymoo_hdte.discrepancy._evidence.order_lines.features import (
    Features,
    _is_common,
    _Spectrum,
    unexpected_lines,
    unexpected_orders,
)
from pymoo_hdte.discrepancy._evidence.order_lines.prediction import Conditions
from pymoo_hdte.discrepancy._records.records import RunningRecord
from pymoo_hdte.units import ARCSEC


def steady(rng, error):
    """Two output turns at 600 rpm and nothing but the noise of the sensors and an error."""
    speed = 20.0 * np.pi
    time = np.arange(int(2.0 * 101.0 * 2.0 * np.pi / speed * 200.0)) / 200.0
    angle = 40.0 + speed * time
    noise = rng.standard_normal((4, len(time)))
    return RunningRecord(
        name="run",
        role="train",
        input_speed=speed,
        load_torque=20.0,
        sample_rate=200.0,
        samples_averaged=1,
        elapsed=0.0,
        time=time,
        input_angle=angle + BELIEVED.ratio * RIG.angle_noise * noise[0],
        output_angle=angle / BELIEVED.ratio - error(angle) + RIG.angle_noise * noise[1],
        input_torque=0.2 + RIG.input_torque_noise * noise[2],
        output_torque=20.0 + RIG.output_torque_noise * noise[3],
    )


@pytest.mark.parametrize("lines", [(), (46.0 / 101.0,), (7.0, 46.0 / 101.0)])
def test_lines_that_no_one_expected_are_found_the_strongest_first(lines):
    def error(angle):
        return sum((1.0 * ARCSEC / (1 + k) * np.sin(o * angle) for k, o in enumerate(lines)), 0.0)

    rng = np.random.default_rng(7)
    records = tuple(steady(rng, error) for _ in range(3))
    orders = np.array([1.0, 2.0, 2.02])
    conditions = Conditions(*np.ones((3, 3)), np.zeros((3, 3, 4), dtype=complex))
    features = Features(records, conditions, orders, np.zeros((3, 26)), np.zeros((3, 26, 26)))
    found = unexpected_orders(unexpected_lines(features, BELIEVED.ratio, RIG), BELIEVED.ratio)
    assert found == pytest.approx(lines, abs=0.5 / BELIEVED.ratio)


def are_common(phasors, samples):
    """Tell of sets of phasors (n, r) of the transmission error whether each may be of one line."""
    orders, channels = np.array([1.5]), np.ones((5, 1))
    return [
        _is_common(
            [_Spectrum(orders, z * channels, n) for z, n in zip(row, samples, strict=True)], 1.5
        )
        for row in phasors
    ]


def noise(rng, shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


@pytest.mark.parametrize("largest", [4.0, 10.0, 100.0])
@pytest.mark.parametrize("samples", [[4000] * 3, [4000] * 7, [1000, 1000, 2000, 4000, 8000] * 2])
def test_a_line_that_grows_towards_a_resonance_is_common_to_all_records(rng, samples, largest):
    shape = 500, len(samples)
    sizes = largest * np.sqrt(np.array(samples) / max(samples)) * rng.uniform(1.0, 1.6, shape)
    assert np.mean(are_common(sizes * np.exp(2j) + noise(rng, shape), samples)) >= 0.98


def test_a_tone_in_one_record_or_with_other_phases_is_not_common(rng):
    shape, samples = (500, 7), [4000] * 7
    in_one = 6.0 * (np.arange(7) == 0)
    assert np.mean(are_common(in_one + noise(rng, shape), samples)) <= 0.01
    anywhere = 6.0 * np.exp(2j * np.pi * rng.random(shape))
    assert np.mean(are_common(anywhere + noise(rng, shape), samples)) <= 0.01


def test_a_line_of_the_input_is_found_at_its_order_where_the_ratio_is_no_whole_number():
    def error(angle):
        return 0.5 * ARCSEC * np.sin(7.0 * angle)

    rng = np.random.default_rng(8)
    records = tuple(steady(rng, error) for _ in range(3))
    angles = [record.input_angle * (1.0 / BELIEVED.ratio - 1.0 / 50.5) for record in records]
    records = tuple(
        replace(record, output_angle=record.output_angle - angle)
        for record, angle in zip(records, angles, strict=True)
    )
    conditions = Conditions(*np.ones((3, 3)), np.zeros((3, 3, 4), dtype=complex))
    orders = np.array([1.0, 2.0])
    features = Features(records, conditions, orders, np.zeros((3, 18)), np.zeros((3, 18, 18)))
    # What the lines of such a ratio leak to comes after it.
    assert unexpected_orders(unexpected_lines(features, 50.5, RIG), 50.5)[0] == 7.0
