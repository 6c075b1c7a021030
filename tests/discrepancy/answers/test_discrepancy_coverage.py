"""Limits of what a campaign can tell are stated, and only where they apply."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_verdicts import made_verdict
from quick_campaigns import quick_campaign

from pymoo_hdte.discrepancy._answers.where.coverage import campaign_limits
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._report.words import limit_sentence
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.effects import effect_named

ORDERS = [1.0, 2.0, 2.02, 3.0, 4.0]
FREEDOM = 2000
UNFITTED = SimpleNamespace(parameters=(), values=np.empty(0), chi_square=float(FREEDOM))


@pytest.fixture(scope="module")
def campaign():
    clean = quick_campaign(1)
    turned = replace(clean.running[0], input_speed=-clean.running[0].input_speed)
    # The channels are turned, too, so that nothing but the direction differs.
    angles = {"input_angle": -turned.input_angle, "output_angle": -turned.output_angle}
    return replace(clean, running=(replace(turned, **angles), *clean.running[1:]))


def said(campaign, fitted=None, orders=ORDERS, chosen=None, status=None, **of_data):
    """Return all limits of a campaign of which some records, by default all, were fitted."""
    features = measure(campaign, fitted or campaign.train, orders)
    data = Data(campaign, features, (), campaign.torsion, **of_data)
    status = status or ("adequate" if chosen is None else "named")
    verdict = made_verdict(status, UNFITTED, chosen, freedom=FREEDOM)
    limits = campaign_limits(DriveFinding(campaign, data, verdict, ()))
    return [limit_sentence(limit) for limit in limits]


def periodic(misfit, *orders):
    """Effects of some orders that leave ``misfit`` times the variance of the noise."""
    fit = SimpleNamespace(**{**vars(UNFITTED), "chi_square": misfit * FREEDOM})
    ripple = effect_named("torque_ripple")
    candidates = [
        SimpleNamespace(effect=ripple, name=ripple.name, order=order, is_value=False)
        for order in orders
    ]
    return SimpleNamespace(fit=fit, candidates=candidates, listed=True, label="torque_ripple")


def trained(campaign, keep):
    return [replace(one, role="train") for one in campaign.running if keep(one)]


def test_friction_of_the_load_is_told_from_a_gain_where_the_load_drives(campaign):
    """A torque sensor that was off by 5 % was friction that grows with the load, for 97 %."""
    chosen = periodic(1.0, None)
    chosen.candidates[0].effect = effect_named("load_dependent_friction")
    loaded = [one for one in campaign.train if one.load_torque > 0.0]
    (limit,) = [one for one in said(campaign, loaded, chosen=chosen) if "gain error" in one]
    assert "0.5 %" in limit
    driven = [replace(loaded[0], load_torque=-loaded[0].load_torque), *loaded[1:]]
    assert not [one for one in said(campaign, driven, chosen=chosen) if "gain error" in one]


def test_counters_that_were_zeroed_at_each_record_are_told(campaign):
    """The drive was said to lack something for certain, and the zeros were not mentioned."""

    def zeroed(record):
        angles = {one: getattr(record, one) for one in ("input_angle", "output_angle")}
        return replace(record, **{one: values - values[0] for one, values in angles.items()})

    running = tuple(map(zeroed, campaign.running))
    assert any("state the zero" in one for one in said(replace(campaign, running=running)))
    running = (campaign.running[0], *running[1:])
    assert not any("state the zero" in one for one in said(replace(campaign, running=running)))


def test_a_full_campaign_has_no_limits(campaign):
    assert said(campaign) == []


CASES = {
    "held out": (lambda c: said(replace(c, running=c.train)), "not validated"),
    "speed": (lambda c: said(c, trained(c, lambda r: r.input_speed > 200.0)), "one speed"),
    "load": (lambda c: said(c, trained(c, lambda r: r.load_torque == 40.0)), "one load"),
    "no load": (lambda c: said(c, trained(c, lambda r: r.load_torque == 0.0)), "one load"),
    "direction": (lambda c: said(c, c.train[1:]), "turn one way"),
    "drift": (
        lambda c: said(c, [replace(one, elapsed=5.0) for one in c.train]),
        "no drift can be seen",
    ),
    "sweep": (lambda c: said(replace(c, torsion=())), "No torsion sweep"),
    "order": (lambda c: said(c, orders=[1.0, 2.0, 3.0]), "order 2.02."),
    "between lines": (lambda c: said(c, orders=[1.0, 2.0, 2.02 + 0.4 / 101.0]), "order 2.02."),
    "rattle": (
        lambda c: said(c, c.train[:-1]),
        r"Neither fitted nor predicted.*: run_2000rpm_40Nm[,.]",
    ),
    "evident": (lambda c: said(c, evident=frozenset(["backlash"])), "does not repeat"),
}


def test_a_record_in_reverse_has_its_speed(campaign):
    """The fastest record turns backwards: its speed is another one all the same."""
    fast = max(campaign.running, key=lambda record: record.input_speed)
    slow = min(campaign.running, key=lambda record: abs(record.input_speed))
    back = replace(
        fast,
        input_speed=-fast.input_speed,
        input_angle=-fast.input_angle,
        output_angle=-fast.output_angle,
    )
    forward = [replace(one, role="train") for one in campaign.running if one.input_speed > 0.0]
    forward = [one for one in forward if one.input_speed == abs(slow.input_speed)]
    assert forward
    assert back.input_speed < -1.1 * forward[0].input_speed
    fitted = [*forward, replace(back, role="train")]
    assert not any("one speed" in sentence for sentence in said(campaign, fitted))


def nyquist_order(record):
    return np.pi * record.sample_rate / abs(record.input_speed)


def alike(data):
    """As much that is not explained in each record."""
    return SimpleNamespace(chi_square=np.ones((len(data.features.records) + 1, 5)))


@pytest.mark.parametrize(
    ("others", "sweeps", "n_records", "status", "told"),
    [
        (0.9, 0.0, 5, "unlisted", "53 %"),
        (-1.0, 0.0, 5, "unlisted", "100 %"),
        (1.1, 0.0, 5, "unlisted", ""),
        (0.9, 0.2, 5, "unlisted", ""),
        (0.9, 0.0, 3, "unlisted", ""),
        (0.9, 0.0, 5, "named", ""),
    ],
)
def test_a_record_that_has_most_of_what_nothing_explains_is_told(
    others, sweeps, n_records, status, told, campaign, monkeypatch
):
    """One record with another zero of the encoder made a campaign unlisted, without its name.

    Without a misfit of its own a record leaves less than its degrees of freedom now and then.
    """

    def uneven(data, fitted):
        found = alike(data)
        found.chi_square *= others / (n_records - 1)
        found.chi_square[1], found.chi_square[-1] = 1.0, sweeps
        return found

    monkeypatch.setattr(Data, "excess", uneven)
    fitted = campaign.train[:n_records]
    assert len(fitted) == n_records
    sentences = said(campaign, fitted, chosen=periodic(1.0, None), status=status)
    found = [one for one in sentences if one.startswith(f"Record {fitted[1].name} alone")]
    assert bool(found) == bool(told)
    assert told in "".join(found)


def test_a_harmonic_that_is_not_looked_at_is_told_where_misfit_is_left(campaign, monkeypatch):
    highest = 0.9 * min(map(nyquist_order, campaign.running))
    assert highest < 14.0
    above, below = 0.501 * highest, 0.499 * highest
    (sentence,) = said(campaign, chosen=periodic(1.2, above, None, above, below))
    assert f"Order {2.0 * above:.4g}, the second harmonic of order {above:.4g}, is not" in sentence
    assert f"above order {highest:.3g}." in sentence
    assert "the values of the effect" in sentence
    monkeypatch.setattr(Data, "excess", lambda data, fitted: alike(data))
    (sentence,) = said(campaign, chosen=periodic(1.2, above), status="unlisted")
    assert "the values of the effect" not in sentence
    # Four standard deviations of chi-square: 1.126 times the noise.
    assert said(campaign, chosen=periodic(1.12, above)) == []
    assert said(campaign, chosen=periodic(1.13, above)) != []


def test_no_rate_of_sampling_shows_order_14(campaign):
    fast = [record for record in campaign.running if nyquist_order(record) > 20.0]
    fast = replace(campaign, running=tuple(fast))
    quiet = said(fast, chosen=periodic(1.0, 7.0))
    (sentence,) = set(said(fast, chosen=periodic(1.2, 7.0, 6.99))) - set(quiet)
    assert "Order 14, the second harmonic of order 7" in sentence
    # Where that line is expected, it is examined.
    expected = [*ORDERS, 14.0]
    assert said(fast, orders=expected, chosen=periodic(1.2, 7.0)) == said(fast, orders=expected)


@pytest.mark.parametrize("case", CASES)
def test_what_is_missing_is_said(campaign, case):
    found, words = CASES[case]
    assert any(re.search(words, sentence) for sentence in found(campaign))


def test_only_what_is_missing_is_said(campaign):
    assert len(said(replace(campaign, torsion=()))) == 1
    assert len(said(campaign, orders=[1.0, 2.0, 3.0])) == 1
    assert len(said(replace(campaign, running=campaign.train))) == 1


def test_a_line_believed_to_be_nothing_need_not_be_seen(campaign):
    lines = {"error_orders": (1.0, 2.0, 2.023, 20.0), "error_amplitudes": (1e-5, 1e-5, 0.0, 0.0)}
    assert said(replace(campaign, believed=replace(campaign.believed, **lines))) == said(campaign)


def test_a_line_above_all_that_is_looked_at_is_not_called_unresolved(campaign):
    lines = {"error_orders": (1.0, 2.0, 14.5), "error_amplitudes": (1e-5, 1e-5, 1e-5)}
    believed = replace(campaign.believed, **lines)
    (sentence,) = said(replace(campaign, believed=believed))
    assert sentence.startswith("The nominal static error of order 14.5 is not compared")
