"""A torque sensor behind the load: the same motion, another torque, and the same verdict."""

from dataclasses import replace

import numpy as np
from quick_campaigns import CONDITIONS
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.discrepancy.campaign.files import with_load_before_sensor
from pymoo_hdte.discrepancy.campaign.sensor_place import inertia_felt, sensor_hint


def at_both_places():
    """Return one session with the sensor at the drive, and with it at the brake."""
    rig = draw_rig(BELIEVED, (), np.random.default_rng(5))
    behind = replace(rig, drive=with_load_before_sensor(rig.drive))
    return [
        run_campaign(one, BELIEVED, RIG, np.random.default_rng(6), CONDITIONS)
        for one in (rig, behind)
    ]


def test_a_sensor_at_the_brake_misses_what_accelerates_the_load():
    drive, brake = at_both_places()
    for ours, theirs in zip(drive.running, brake.running, strict=True):
        np.testing.assert_allclose(ours.output_angle, theirs.output_angle, rtol=0, atol=1e-9)
    shares = [inertia_felt(campaign) for campaign in (drive, brake)]
    for (share, error), truth in zip(shares, (1.0, 0.0), strict=True):
        # The believed inertia is off by its tolerance at most.
        assert abs(share - truth) < BELIEVED.tolerance + 4.0 * error
    assert sensor_hint(drive) == ""
    assert '"brake"' in sensor_hint(brake)


def test_where_the_sensor_sits_decides_between_adequate_and_unlisted():
    _, brake = at_both_places()
    stated = replace(brake, believed=with_load_before_sensor(brake.believed))
    assert analyse(stated).verdict.status == "adequate"
    assert analyse(brake).verdict.status == "unlisted"


def test_without_a_load_inertia_nothing_is_said():
    drive, _ = at_both_places()
    bare = replace(drive, believed=with_load_before_sensor(drive.believed))
    assert sensor_hint(bare) == ""
