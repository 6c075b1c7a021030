"""Damping that grows with the load is told from damping that is larger by a factor."""

import json

import pytest
from kept_results import kept, put_files
from measured_oscillator import reported
from quick_campaigns import campaign_with

from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.drive._effects import LoadDamping

PLANTED = LawAtPort("load_dependent_damping", "mesh", LoadDamping(25.0, reference=40.0))


@kept
def analysis_and_report():
    """Return what is found on a rig whose mesh is damped more under load."""
    return reported(analyse(campaign_with(PLANTED)))


@pytest.mark.nightly
def test_a_hidden_one_is_named_or_in_a_class_that_holds_it(tmp_path):
    analysis, files = analysis_and_report()
    put_files(files, tmp_path)
    document = json.loads((tmp_path / "verdict.json").read_text())
    assert document["status"] in ("named", "class")
    (effect,) = document["effects"]
    assert (effect["name"], effect["port"]) == ("load_dependent_damping", "mesh")
    (law,) = [one.law for one in analysis.revised_model().effects if one.name == PLANTED.name]
    assert law.damping * 40.0 / law.reference == pytest.approx(PLANTED.law.damping, rel=0.3)
