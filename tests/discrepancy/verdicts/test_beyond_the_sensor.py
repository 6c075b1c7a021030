"""What acts on the load beyond the torque sensor is told from what acts within the drive."""

import json

import pytest
from quick_campaigns import campaign_with

from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.effects.gravity import Gravity
from pymoo_hdte.effects.ripple import PeriodicTorque

PLANTED = {
    "torque_ripple": (PeriodicTorque(3.0, 0.7, 0.2), "amplitude", 0.2),
    "gravity": (Gravity(0.8, 0.4), "torque", 0.8),
}


@pytest.mark.nightly
@pytest.mark.parametrize("name", PLANTED)
def test_a_hidden_torque_of_the_load_is_named_there_with_its_size(name, tmp_path):
    law, number, size = PLANTED[name]
    analysis = analyse(campaign_with(LawAtPort(name, "load", law)))
    analysis.report(tmp_path)
    document = json.loads((tmp_path / "verdict.json").read_text())
    (effect,) = [*document["effects"], *document.get("nuisances", [])]
    assert (effect["name"], effect["port"]) == (name, "load")
    assert effect["parameters"][number]["value"] == pytest.approx(size, rel=0.02)
