"""Believed lines that records cannot show or tell apart are refused, and no others."""

from dataclasses import replace

import numpy as np
import pytest
from quick_campaigns import quick_campaign

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive, expected_orders

RATIO = 101.0


@pytest.fixture(scope="module")
def campaign():
    return quick_campaign(1)


def believing(campaign, *orders, amplitude=2e-5):
    amplitudes = (*(2e-5 for _ in orders[1:]), amplitude)
    believed = replace(campaign.believed, error_orders=orders, error_amplitudes=amplitudes)
    return replace(campaign, believed=believed)


def lasting(record, turns):
    """The same record with an input that went ``turns`` as far."""
    return replace(record, input_angle=turns * record.input_angle)


def with_records(campaign, running):
    # What a record says of its drive does not matter here.
    changed = replace(campaign)
    object.__setattr__(changed, "running", tuple(running))
    return changed


def folded(campaign, record, rate):
    rows = slice(None, None, round(record.sample_rate / rate))
    channels = ("time", "input_angle", "output_angle", "input_torque", "output_torque")
    slow = replace(
        record, sample_rate=rate, **{name: getattr(record, name)[rows] for name in channels}
    )
    running = [slow if one is record else one for one in campaign.running]
    return replace(campaign, running=tuple(running))


@pytest.mark.parametrize("analysed", [expected_orders, examine_drive])
def test_lines_that_merge_are_refused(campaign, analysed):
    with pytest.raises(InvalidInput) as refused:
        analysed(believing(campaign, 1.0, 2.0, 2.005))
    assert refused.value.field == "believed.error_orders"
    assert refused.value.value == 2.005
    # 0.9 / (101 x 0.005) turns of the output.
    assert "from order 2" in refused.value.allowed
    assert "at least 1.78 output turns" in refused.value.allowed


def test_an_order_that_the_rows_fold_is_refused(campaign):
    record = next(one for one in campaign.running if one.sample_rate == 500.0)
    slow = folded(campaign, record, 20.0)
    shown = 0.9 * np.pi * 20.0 / record.input_speed
    assert 1.0 > shown > 0.8
    with pytest.raises(InvalidInput) as refused:
        examine_drive(slow)
    assert (refused.value.field, refused.value.value) == ("believed.error_orders", 1.0)
    assert f"at most {shown:.4g}" in refused.value.allowed
    assert record.name in refused.value.allowed
    assert f"rows at {20.0 / shown:.4g} Hz" in refused.value.allowed


@pytest.mark.parametrize(
    "orders", [(1.0, 2.0, 2.02), (2.0, 2.0 + 0.95 / RATIO), (1.0 / RATIO, 1.0, 13.0)]
)
def test_lines_that_every_record_shows_are_all_looked_at(campaign, orders):
    assert set(orders) <= set(expected_orders(believing(campaign, *orders)))


def test_what_is_believed_to_be_nothing_need_not_be_seen(campaign):
    for order in (2.005, 40.0):
        found = expected_orders(believing(campaign, 1.0, 2.0, order, amplitude=0.0))
        assert order not in found


def test_an_order_above_all_that_is_looked_at_is_passed_over(campaign):
    fast = [one for one in campaign.running if one.input_speed < 0.8 * 209.4]
    found = expected_orders(believing(with_records(campaign, fast), 1.0, 2.0, 15.0))
    assert {1.0, 2.0} <= set(found)
    assert max(found) < 15.0


def test_longer_records_tell_closer_lines_apart(campaign):
    close = believing(campaign, 1.0, 2.0, 2.005)
    turns = [np.ptp(one.input_angle) / (2.0 * np.pi * RATIO) for one in close.running]
    for most, enough in ((1.7, False), (1.9, True)):
        longer = [lasting(one, most / turn) for one, turn in zip(close.running, turns, strict=True)]
        if enough:
            assert {2.0, 2.005} <= set(expected_orders(with_records(close, longer)))
        else:
            with pytest.raises(InvalidInput, match=r"2\.005"):
                expected_orders(with_records(close, longer))
