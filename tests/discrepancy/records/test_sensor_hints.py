"""A torque sensor behind the load, or in another unit: what the records say of it."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse, read_campaign, write_campaign
from pymoo_hdte.discrepancy._records.sensor_hints import inertia_felt, sensor_hints
from pymoo_hdte.units import FOREIGN

AT_BRAKE = replace(RIG, output_torque_at="brake")


def session(rig, **changed):
    """Return a session on one true rig, with its sensors as stated in ``rig``."""
    true = draw_rig(BELIEVED, (), np.random.default_rng(5))
    true = replace(true, drive=replace(true.drive, **changed))
    return run_campaign(true, BELIEVED, rig, np.random.default_rng(6), CONDITIONS)


def mistaken(campaign, rig):
    """Return a campaign whose sensor is believed to sit elsewhere than it does."""
    return replace(campaign, rig=rig)


def test_a_sensor_at_the_brake_misses_what_accelerates_the_load():
    drive, brake = session(RIG), session(AT_BRAKE)
    for ours, theirs in zip(drive.running, brake.running, strict=True):
        np.testing.assert_array_equal(ours.output_angle, theirs.output_angle)
        np.testing.assert_array_equal(ours.input_torque, theirs.input_torque)
    shares = [inertia_felt(campaign) for campaign in (drive, brake)]
    for (share, error), truth in zip(shares, (1.0, 0.0), strict=True):
        # The believed inertia is off by its tolerance at most.
        assert abs(share - truth) < BELIEVED.tolerance + 4.0 * error
    for sound in (drive, brake):
        assert sensor_hints(sound) == []
    for campaign, place in ((mistaken(brake, RIG), "brake"), (mistaken(drive, AT_BRAKE), "drive")):
        (hint,) = sensor_hints(campaign)
        assert f'"{place}"' in hint


@pytest.mark.nightly
def test_where_the_sensor_sits_decides_between_adequate_and_unlisted(tmp_path):
    brake = session(AT_BRAKE)
    assert analyse(brake).verdict.status == "adequate"
    wrong = analyse(mistaken(brake, RIG))
    assert wrong.verdict.status == "unlisted"
    document = wrong.report(tmp_path / "report")
    assert document["sensor_hints"] == sensor_hints(mistaken(brake, RIG))
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "output_torque_at = &#34;brake&#34;" in page


@pytest.mark.slow
def test_the_load_inertia_is_fitted_at_the_brake_as_well():
    """A lighter load has a higher resonance, by which a fit sees it in front of the sensor."""
    true = 0.75 * BELIEVED.load_inertia
    wide = replace(BELIEVED, tolerances={"load_inertia": 0.5})
    analysis = analyse(replace(session(AT_BRAKE, load_inertia=true), believed=wide))
    assert analysis.verdict.status == "adequate"
    base = analysis.verdict.base
    row = [one.name for one in base.parameters].index("load_inertia")
    error = base.covariance[row, row] ** 0.5
    assert abs(base.values[row] - true) < 4.0 * error
    assert error < 0.05 * true
    (inertia,) = (one for one in analysis.revised_model().effects if one.name == "load_inertia")
    assert inertia.inertia == pytest.approx(base.values[row])


def test_without_a_load_inertia_nothing_is_said():
    bare = replace(session(RIG), believed=replace(BELIEVED, load_inertia=0.0))
    assert sensor_hints(bare) == []


def scaled(campaign, factor):
    """Return a campaign whose output torque is read with another factor."""
    return replace(
        campaign,
        running=tuple(
            replace(one, output_torque=factor * one.output_torque) for one in campaign.running
        ),
    )


@pytest.mark.parametrize("rig", [RIG, AT_BRAKE])
def test_foot_pounds_within_the_tolerance_of_the_load_are_told(rig):
    """A column in lbf.ft is 26 % off as N.m, where 30 % are allowed."""
    campaign, foot_pound = session(rig), FOREIGN["lbf.ft"][1]
    (hint,) = sensor_hints(scaled(campaign, 1.0 / foot_pound))
    assert "lbf.ft" in hint
    for gain in (0.71, 0.755, 0.8, 0.98, 1.02, 1.25):
        assert sensor_hints(scaled(campaign, gain)) == []
    # A range says that the load was not set, so that nobody knows its factor.
    ranges = tuple(
        replace(one, load_range=(one.load_torque - 20.0, one.load_torque + 20.0))
        for one in scaled(campaign, 1.0 / foot_pound).running
    )
    assert sensor_hints(replace(campaign, running=ranges)) == []


def test_place_and_motor_are_kept_in_files_and_beside_another_model(tmp_path):
    rig = replace(AT_BRAKE, motor_poles=8, motor_slots=12)
    write_campaign(session(rig), tmp_path / "first")
    read = read_campaign(tmp_path / "first")
    assert read.rig == rig
    assert read.believed == BELIEVED
    toml = tmp_path / "first" / "campaign.toml"
    text = toml.read_text(encoding="utf-8")
    assert tomllib.loads(text)["rig"]["output_torque_at"] == "brake"
    for wrong, match in (
        (text.replace('"brake"', '"motor"'), "'drive', 'brake'"),
        (text.replace("motor_slots = 12", ""), "motor_slots"),
        (text.replace("motor_poles = 8", "motor_poles = 8.5"), "rig.motor_poles"),
    ):
        toml.write_text(wrong, encoding="utf-8")
        with pytest.raises(InvalidInput, match=match):
            read_campaign(tmp_path / "first")
