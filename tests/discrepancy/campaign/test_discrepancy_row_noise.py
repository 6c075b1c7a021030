"""The noise of the records beside the stated one, and what an analysis makes of it and of rows."""

import json
from dataclasses import replace

import numpy as np
import pytest
from night import others_at_night
from places import SHARED
from quick_campaigns import quick_campaign

from pymoo_hdte.discrepancy import analyse, read_campaign
from pymoo_hdte.discrepancy.campaign.rows.examination import examined_rows
from pymoo_hdte.discrepancy.drive.analysis import expected_orders
from pymoo_hdte.discrepancy.engine.rules import RULES
from pymoo_hdte.discrepancy.report.row_words import rows_sentence
from pymoo_hdte.units import ARCSEC

NOISES = ("angle_noise", "input_torque_noise", "output_torque_noise", "torsion_angle_noise")
CASES = SHARED / "cases" / "campaigns"


def examined(campaign, rules=RULES):
    return examined_rows(campaign, expected_orders(campaign), rules)


def with_stated(campaign, name, factor):
    rig = replace(campaign.rig, **{name: factor * getattr(campaign.rig, name)})
    return replace(campaign, rig=rig)


def broken(campaign, place, channel, rows, size):
    running = list(campaign.running)
    values = getattr(running[place], channel).copy()
    values[rows] += size
    running[place] = replace(running[place], **{channel: values})
    return replace(campaign, running=tuple(running))


@pytest.fixture(scope="module")
def clean():
    return quick_campaign(1)


def test_a_sound_campaign_is_left_as_it_is(clean):
    same, found = examined(clean)
    assert same is clean
    assert found.faults == ()
    assert found.left_out == ()
    assert not any(one.replaced for one in found.noise)
    assert rows_sentence(found) == ""
    for one in found.noise:
        if one.found is not None:
            assert one.found == pytest.approx(one.stated, rel=0.15)


# A shared case, below, has all of them three times as stated.
@pytest.mark.parametrize("factor", others_at_night([1.0 / 3.0, 1.25], 1.25))
@pytest.mark.parametrize("name", NOISES)
def test_a_misstated_noise_is_replaced_by_that_of_the_records(clean, name, factor):
    changed, found = examined(with_stated(clean, name, factor))
    assert [one.name for one in found.noise if one.replaced] == [name]
    rel = 0.15 if name == "torsion_angle_noise" else 0.03
    assert getattr(changed.rig, name) == pytest.approx(getattr(clean.rig, name), rel=rel)
    assert name.removesuffix("_noise").replace("_", " ") in rows_sentence(found)


def test_a_noise_within_what_the_rules_allow_stays(clean):
    stated = with_stated(clean, "angle_noise", 1.25)
    changed, found = examined(stated, replace(RULES, noise_mismatch=1.5))
    assert changed is stated
    assert not any(one.replaced for one in found.noise)


@pytest.mark.parametrize(("factor", "replaced"), [(1.0, False), (0.2, True)])
def test_repeated_conditions_show_the_repeatability(clean, factor, replaced):
    rng = np.random.default_rng(7)
    spread = clean.rig.repeatability / np.sqrt(3.0)
    copies = []
    for record in clean.running[:4]:
        for copy in range(4):
            lines = spread * (rng.standard_normal(3) + 1j * rng.standard_normal(3))
            waves = np.exp(1j * np.outer(record.input_angle, clean.believed.error_orders))
            noise = clean.rig.angle_noise * rng.standard_normal(len(record.time))
            angle = record.output_angle - (waves @ lines).real + noise
            copies.append(replace(record, name=f"{record.name}_{copy}", output_angle=angle))
    campaign = replace(clean, running=tuple(copies))
    _, found = examined(with_stated(campaign, "repeatability", factor))
    (one,) = (one for one in found.noise if one.name == "repeatability")
    assert one.found == pytest.approx(clean.rig.repeatability, rel=0.25)
    assert one.replaced == replaced


def spiky(campaign):
    return broken(campaign, 4, "output_angle", [500, 1200, 2500], 0.03)


def jumping(campaign):
    return broken(campaign, 5, "output_angle", slice(1500, None), 20.0 * ARCSEC)


def misstated(campaign):
    return with_stated(campaign, "output_torque_noise", 1.0 / 3.0)


@pytest.mark.nightly
@pytest.mark.parametrize("spoil", [spiky, jumping, misstated])
def test_a_clean_drive_with_one_kind_of_fault_is_adequate(clean, spoil):
    assert analyse(spoil(clean)).verdict.status == "adequate"


@pytest.fixture(scope="module")
def spoilt(clean):
    return analyse(spiky(jumping(misstated(clean))))


@pytest.mark.nightly
def test_a_clean_drive_with_bad_records_is_adequate(spoilt):
    assert spoilt.verdict.status == "adequate"
    document = json.loads(json.dumps(spoilt.finding.rows.as_dict()))
    faults = [(one["kind"], one["row"] + 1) for one in document["rows"]["faults"]]
    assert faults == [("spike", 502), ("spike", 1202), ("spike", 2502), ("jump", 1502)]
    assert document["rows"]["left_out"] == 3


@pytest.mark.nightly
def test_what_was_found_stands_in_the_verdict_and_on_the_page(spoilt, clean, tmp_path):
    verdict = spoilt.report(tmp_path / "out")
    assert [one["name"] for one in verdict["noise"] if one["replaced"]] == ["output_torque_noise"]
    names = {clean.running[place].name for place in (4, 5)}
    assert {one["record"] for one in verdict["rows"]["faults"]} == names
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "3 spikes and 1 jump in 2 records" in page


def test_a_record_of_two_loads_is_left_out_and_said(clean):
    campaign = clean
    for channel, size in (("output_torque", 2.0), ("input_torque", 0.02), ("output_angle", -8e-5)):
        campaign = broken(campaign, 6, channel, slice(1500, None), size)
    changed, found = examined(campaign)
    assert found.left_out == (clean.running[6].name,)
    assert len(changed.running) == len(clean.running) - 1
    assert clean.running[6].name in rows_sentence(found)


def unsettled(campaign, sizes, constant=lambda record: 0.15):
    """Let the motor run out into the motion at the beginning of each record: sizes (r,), rad."""
    running = []
    for one, size in zip(campaign.running, sizes, strict=True):
        decay = size * np.exp(-(one.time - one.time[0]) / constant(one))
        turned = one.output_angle + decay / campaign.believed.ratio
        running.append(replace(one, input_angle=one.input_angle + decay, output_angle=turned))
    return replace(campaign, running=tuple(running))


def test_a_clean_drive_in_records_that_begin_unsettled_is_adequate(clean):
    loads = np.array([one.load_torque for one in clean.running])
    campaign = unsettled(clean, 2e-4 * loads)
    analysis = analyse(campaign)
    assert analysis.verdict.status == "adequate"
    faults = analysis.finding.rows.faults
    assert {one.kind for one in faults} == {"settling"}
    assert "beginnings that have not settled" in rows_sentence(analysis.finding.rows)


@pytest.mark.parametrize(
    "constant", [lambda record: 0.15, lambda record: 15.0 / abs(record.input_speed)]
)
def test_where_several_records_begin_unsettled_all_are_fitted_so(clean, constant):
    """Of a decay below the noise a slow line of a short record takes the most."""
    number = len(clean.running)
    slight = number - 1
    for several in (1, 3):
        sizes = np.zeros(number)
        sizes[:several] = 6e-3
        sizes[slight] = 2e-4
        changed, found = examined(unsettled(clean, sizes, constant))
        plain = [one for one in found.faults if one.channel == "input_angle"]
        assert len(plain) == several
        last = changed.running[slight]
        if several == 1:
            assert last.settling is None
            assert found.faults == tuple(plain)
        else:
            assert last.name in {one.record for one in found.faults}
            hidden = len(found.faults) - several
            assert f"also in {hidden} more" in rows_sentence(found)
            assert last.settling == pytest.approx(constant(last), rel=0.3)


def in_session(campaign, change):
    """Change the output angle of each record by its place in the session, from 0 to 1."""
    last = max(record.elapsed for record in campaign.running)
    running = tuple(
        replace(one, output_angle=one.output_angle + change(one.elapsed / last))
        for one in campaign.running
    )
    return replace(campaign, running=running)


@pytest.mark.parametrize("channel", ["input_angle", "output_angle"])
def test_a_new_zero_between_two_records_is_found_and_taken_out(clean, channel):
    ordered = sorted(clean.running, key=lambda one: one.elapsed)
    size = 200.0 * ARCSEC * (clean.believed.ratio if channel == "input_angle" else 1.0)
    late = {one.name for one in ordered[5:]}
    running = tuple(
        replace(one, **{channel: getattr(one, channel) + size}) if one.name in late else one
        for one in clean.running
    )
    changed, found = examined(replace(clean, running=running))
    (fault,) = found.faults
    assert (fault.kind, fault.record, fault.channel) == ("new zero", ordered[5].name, channel)
    assert fault.size == pytest.approx(size, rel=0.01)
    for one, before in zip(changed.running, clean.running, strict=True):
        apart = getattr(one, channel) - getattr(before, channel)
        np.testing.assert_allclose(apart, 0.0, atol=0.01 * size)


@pytest.mark.parametrize(
    "course",
    [
        pytest.param(lambda t: t, marks=pytest.mark.nightly),
        pytest.param(lambda t: -np.expm1(-t / 0.2), marks=pytest.mark.nightly),
        lambda t: -np.expm1(-t / 0.05),
        lambda t: t**2,
    ],
)
def test_a_drift_over_the_session_is_no_new_zero(clean, course):
    _, found = examined(in_session(clean, lambda t: 40.0 * ARCSEC * course(t)))
    assert found.faults == ()


@pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not here")
@pytest.mark.parametrize(
    ("case", "faults", "replaced"),
    [
        ("nothing-encoder-spikes", ["spike"] * 3, 0),
        pytest.param("nothing-encoder-jump", ["jump"], 0, marks=pytest.mark.nightly),
        pytest.param("coulomb-gap", ["gap"], 0, marks=pytest.mark.nightly),
        ("coulomb-noise-x3", [], 4),
    ],
)
def test_shared_cases_show_the_faults_that_were_planted(case, faults, replaced):
    _, found = examined(read_campaign(CASES / case))
    assert [one.kind for one in found.faults] == faults
    assert sum(one.replaced for one in found.noise) == replaced
    for one in found.noise:
        if one.replaced:
            assert one.used == pytest.approx(3.0 * one.stated, rel=0.05)
