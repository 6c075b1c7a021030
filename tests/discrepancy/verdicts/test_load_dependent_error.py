"""A line of the static error that grows with the load is found by its loads, and only by these."""

import json
from dataclasses import replace

import pytest
from kept_results import kept, put_files
from measured_oscillator import reported
from planted_features import SCALES
from quick_campaigns import campaign_with
from virtual_rig_cases import BELIEVED

from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes
from pymoo_hdte.drive import LoadDependentError
from pymoo_hdte.units import ARCSEC

PLANTED = LoadDependentError(1.0, 2.5 * ARCSEC, 0.4, reference=40.0)


@kept
def analysis_and_report():
    """Return what is found on a rig whose believed first order grows with the load."""
    return reported(analyse(campaign_with(PLANTED)))


@pytest.mark.slow
def test_a_hidden_one_is_named_with_its_size_and_validated(tmp_path):
    analysis, files = analysis_and_report()
    put_files(files, tmp_path)
    assert analysis.verdict.status == "named"
    document = json.loads((tmp_path / "verdict.json").read_text())
    (effect,) = document["effects"]
    assert (effect["name"], effect["port"]) == ("load_dependent_error", "mesh")
    (line,) = [one for one in analysis.revised_model().effects if one.name == PLANTED.name]
    assert line.order == PLANTED.order
    at_40 = line.amplitude * 40.0 / line.reference
    assert at_40 == pytest.approx(PLANTED.amplitude, rel=0.2)
    gap = document["held_out"]["channels"]["transmission_error"]
    assert gap["after"] < 0.5 * (gap["before"] + gap["noise_floor"])


def orders_sought(loads_differ):
    """Orders at which a growing line is sought where lines of orders 1 to 4 are seen."""
    orders = [1.0, 2.0, 2.02, 3.0, 4.0]
    sizes = port_sizes(BELIEVED, orders, orders, replace(SCALES, loads_differ=loads_differ))
    return [one.order for one in drive_candidates(sizes) if one.name == PLANTED.name]


def test_it_is_sought_where_loads_differ_and_no_varying_stiffness_is_the_same():
    assert orders_sought(True) == [1.0, 2.02, 3.0]
    assert orders_sought(False) == []
